"""The inflated tyre pressed on the road, by its decks: equilibrium, symmetry, refusals; a ring."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.road import footprint_job
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton
from tyrecal_solvers.bundled.road.road_data import LoadRequest, TyreToPress, read_road
from tyrecal_solvers.errors import NoEquilibrium, RunFailed
from tyrecal_solvers.language.text import DeckError, read_keywords

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign

from . import support
from .contact import ANGLES, GRADED, Late, Round, coarse_case, ring, solid_ring

Array = np.ndarray
LOADS = (1000.0, 2000.0)


@cache
def texts(loads: tuple[float, ...], friction: float) -> dict[str, str]:
    return Decks(TyreDesign(coarse_case(friction=friction)), loads_N=loads).texts("abaqus")


def run(
    folder: Path,
    loads: tuple[float, ...] = LOADS,
    friction: float = 0.5,
    edit: Callable[[str], str] = lambda text: text,
    limit: float = float("inf"),
) -> dict[str, Any]:
    for name, text in texts(loads, friction).items():
        (folder / name).write_text(edit(text) if name == "press.inp" else text)
    job.run(folder, "press", "inflate", limit)
    return footprint_job.read(folder / "press")


@pytest.fixture(scope="module")
def pressed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Footprints of two loads with friction."""
    return run(tmp_path_factory.mktemp("pressed"))


def refused(folder: Path, edit: Callable[[str], str], loads: tuple[float, ...] = LOADS) -> str:
    with pytest.raises(DeckError) as error:
        run(folder, loads, edit=edit)
    return str(error.value)


def changed(old: str, new: str) -> Callable[[str], str]:
    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return edit


def test_forces_balance(pressed: dict[str, Any]) -> None:
    """Load, road's force, rim's reaction and the pressure's integral are one number."""
    assert [f["load_N"] for f in pressed["footprints"]] == list(LOADS)
    assert "cause" not in pressed and pressed["failure"] == ""
    for f in pressed["footprints"]:
        assert f["road_N"] == pytest.approx(f["load_N"], rel=1e-6)
        assert f["rim_N"][0] == pytest.approx(f["load_N"], rel=1e-6)
        assert (f["pressure_Pa"] * f["area_m2"]).sum() == pytest.approx(f["load_N"], rel=1e-6)
        assert not f["rim_N"][1:].any()


def test_patch_grows_and_presses_like_the_tyre_is_inflated(pressed: dict[str, Any]) -> None:
    """Mean pressure between the inflation pressure and thrice it; the deflection's secants bracket
    the tangent stiffnesses."""
    one, two = pressed["footprints"]
    for f in (one, two):
        mean = f["load_N"] / f["area_m2"][f["pressure_Pa"] > 0].sum()
        assert 0.9 < mean / pressed["pressure_Pa"] < 3.0
        assert (f["pressure_Pa"] > 0).all()
        assert abs(f["along_m"]).max() < 0.2 and abs(f["across_m"]).max() < 0.12
    assert 0 < one["deflection_m"] < two["deflection_m"] < 0.05
    secant = 1000.0 / (two["deflection_m"] - one["deflection_m"])
    low, high = sorted(f["stiffness_N_per_m"] for f in (one, two))
    assert 0.9 * low < secant < 1.1 * high


def test_results_keep_the_half_turn(pressed: dict[str, Any]) -> None:
    """Every contact node has its image at the other side with the same pressure; the tractions
    cancel; displacements too, at all angles."""
    nodes, X = list(pressed["nodes"]), pressed["points"]
    K = len(pressed["angles"])
    np.testing.assert_allclose(
        (pressed["angles"] + pressed["angles"][(-np.arange(K)) % K]) % (2 * np.pi), 0, atol=1e-9
    )
    places = {tuple(np.round(x, 6)): i for i, x in enumerate(X)}
    other = np.array([places[(round(r, 6), round(-z, 6) + 0.0)] for r, z in X])
    for f in pressed["footprints"]:
        U = f["displacement"]
        assert U.shape == (K, len(X), 3)
        image = U[(-np.arange(K)) % K][:, other] * [1, -1, -1]
        np.testing.assert_allclose(U, image, atol=1e-9 * abs(U).max() + 1e-12)
        row = {n: i for i, n in enumerate(nodes)}
        index = {
            (ring, row[n]): i for i, (ring, n) in enumerate(zip(f["ring"], f["node"], strict=True))
        }
        assert len(index) == len(f["ring"])
        images = [index[((-r) % K, other[n])] for r, n in index]
        for name in ("pressure_Pa", "area_m2"):
            np.testing.assert_allclose(f[name], f[name][images], rtol=1e-6)
        scale = abs(f["traction_Pa"]).max()
        np.testing.assert_allclose(f["traction_Pa"], -f["traction_Pa"][images], atol=1e-6 * scale)
        for name in ("along_m", "across_m"):
            np.testing.assert_allclose(f[name], -f[name][images], atol=1e-9)


def test_places_are_the_displaced_nodes(pressed: dict[str, Any]) -> None:
    """Along and across from the displacements; every node that is deeper than the road is high
    belongs to the patch, sunk in by its pressure, and of the others those beside it."""
    X = pressed["points"]
    rows = np.array([list(pressed["nodes"]).index(n) for n in pressed["footprints"][1]["node"]])
    f = pressed["footprints"][1]
    u, angle = f["displacement"][f["ring"], rows], pressed["angles"][f["ring"]]
    c, s = np.cos(angle), np.sin(angle)
    R, Z = X[rows].T
    np.testing.assert_allclose(f["along_m"], s * (R + u[:, 0]) + c * u[:, 1], atol=1e-9)
    np.testing.assert_allclose(f["across_m"], Z + u[:, 2], atol=1e-9)
    depth = c * (R + u[:, 0]) - s * u[:, 1]
    height = pressed["free_radius_m"] - f["deflection_m"]
    inside = depth > height
    assert 0.3 < inside.mean() < 1.0
    assert (depth < height + 1.5 * f["pressure_Pa"].max() / 1e9).all()
    c, s = np.cos(pressed["angles"])[:, None], np.sin(pressed["angles"])[:, None]
    u = f["displacement"]
    assert (c * (X[:, 0] + u[..., 0]) - s * u[..., 1] > height).sum() == inside.sum()


def test_friction_is_within_coulombs_cone(pressed: dict[str, Any]) -> None:
    """Nodes that touched at the first load pull at the second."""
    f = pressed["footprints"][1]
    traction = np.linalg.norm(f["traction_Pa"], axis=1)
    assert (traction <= 0.5 * f["pressure_Pa"] * (1 + 1e-6)).all()
    assert traction.max() > 0.05 * f["pressure_Pa"].max()


@pytest.mark.slow
def test_with_friction_the_way_hardly_matters(tmp_path: Path, pressed: dict[str, Any]) -> None:
    """A load at once, in two steps or in six: nodes rub from where the road met them on."""
    direct = run(tmp_path, (2000.0,))["footprints"][-1]
    steps = run(tmp_path, (300.0, 700.0, 1000.0, 1300.0, 1700.0, 2000.0))["footprints"][-1]
    for footprint in (direct, pressed["footprints"][-1]):
        assert footprint["deflection_m"] == pytest.approx(steps["deflection_m"], rel=1e-2)
        assert footprint["contact_area_m2"] == pytest.approx(steps["contact_area_m2"], rel=3e-2)
    rubbing, after = (np.linalg.norm(f["traction_Pa"], axis=1).max() for f in (direct, steps))
    assert rubbing == pytest.approx(after, rel=0.3)


@pytest.mark.slow
def test_without_friction_the_way_does_not_matter(tmp_path: Path) -> None:
    """A load at once or after a smaller one: the same state to one part in 1e5 (the linear
    equations of the stiffness are solved to 1e-3); the loads' slope is the tangent stiffness."""
    direct = run(tmp_path, (2000.0,), 0.0)["footprints"][-1]
    steps = run(tmp_path, (1980.0, 2000.0, 2020.0), 0.0)["footprints"]
    assert steps[1]["deflection_m"] == pytest.approx(direct["deflection_m"], rel=1e-5)
    np.testing.assert_array_equal(steps[1]["node"], direct["node"])
    for name, close in (("pressure_Pa", 1e-5), ("displacement", 1e-5)):
        scale = abs(direct[name]).max()
        np.testing.assert_allclose(steps[1][name], direct[name], rtol=0, atol=close * scale)
    assert not direct["traction_Pa"].any()
    slope = 40.0 / (steps[2]["deflection_m"] - steps[0]["deflection_m"])
    for f in (direct, steps[1]):
        assert f["stiffness_N_per_m"] == pytest.approx(slope, rel=1e-3)


@pytest.mark.parametrize(
    ("loads", "words"),
    [((2000.0, 1000.0), "rise"), ((1000.0, 1000.0), "rise"), ((-1000.0,), "push it to the tyre")],
)
def test_loads_that_do_not_rise_are_refused(
    tmp_path: Path, loads: tuple[float, ...], words: str
) -> None:
    assert words in refused(tmp_path, lambda text: text, loads)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("900002, 1, -2000", "900002, 2, -2000", "along the first axis"),
        ("900002, 1, -2000", "900001, 1, -2000", "the force on the road"),
        ("0.0, -1.0\nSTART", "0.1, -1.0\nSTART", "only a flat road"),
        ("TREAD, ROAD", "TREAD, STREET", "STREET is no analytical surface"),
        ("TREAD, ROAD", "FLANK, ROAD", "FLANK is not defined"),
        ("*FRICTION, ELASTIC SLIP=0.0001", "*FRICTION, ELASTIC SLIP=0.0", "elastic slip"),
        ("4.0, 1, 1.0, C", "4.0, 1, 1.2, C", "bias"),
        ("CAVITY, P, 240000", "HOLE, P, 240000", "HOLE"),
    ],
)
def test_roads_that_are_not_honoured(tmp_path: Path, old: str, new: str, words: str) -> None:
    def edit(text: str) -> str:
        for spelled in (old, old.replace("4.0, 1", "4, 1"), old.replace("0.0001", "1e-04")):
            if spelled in text:
                return text.replace(spelled, new)
        raise AssertionError(text)

    assert words in refused(tmp_path, edit)


def test_a_road_without_a_load_is_refused(tmp_path: Path) -> None:
    def edit(text: str) -> str:
        return re.sub(r"\*CLOAD\n.*\n", "", text)

    assert "no *CLOAD presses the road" in refused(tmp_path, edit)


def test_elements_that_do_not_mirror_are_refused(tmp_path: Path) -> None:
    def edit(text: str) -> str:
        rows = [line for line in text.splitlines() if line.endswith(", C")]
        assert len(rows) == 2 * len(ANGLES)
        block = "\n".join(rows)
        assert block in text
        return text.replace(block, "\n".join([*rows[1:], rows[0]]))

    assert "mirror at 180 degrees" in refused(tmp_path, edit)


@pytest.mark.slow
def test_an_unreachable_load_keeps_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The load before it stays, with a sentence why there is no more."""
    support.bears(monkeypatch, 1500.0)
    result = run(tmp_path, (1000.0, 1e4), 0.0)
    assert [f["load_N"] for f in result["footprints"]] == [1000.0]
    assert result["cause"] == "no_equilibrium"
    assert re.fullmatch(
        r"no equilibrium between 1000 and \d+ N \(\d+ of \d+ mm down to the rim\): too much",
        result["failure"],
    )


@pytest.mark.slow
def test_an_absurd_load_is_not_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ton of tonnes: at the stiffness of the load before, many times the way down to the rim."""
    tried: list[float] = []
    newton = ContactNewton._newton
    monkeypatch.setattr(
        ContactNewton, "_newton", lambda press, load: tried.append(load) or newton(press, load)
    )
    result = run(tmp_path, (1000.0, 1e7), 0.0)
    assert tried == [1000.0]
    reached = result["footprints"][0]
    down = reached["deflection_m"] + (1e7 - 1000.0) / reached["stiffness_N_per_m"]
    assert result["failure"].endswith(f"down by {1e3 * down:.0f} mm")
    assert result["cause"] == "no_equilibrium"


def test_the_time_limit_passes(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="time limit"):
        run(tmp_path, limit=0.05)


def test_nothing_pickled_is_read(tmp_path: Path) -> None:
    """Whatever lies where results should: objects are refused, not made."""
    (tmp_path / "press.json").write_text('{"format": 1, "footprints": [], "cause": ""}')
    plain = {name: np.arange(3.0) for name in ("nodes", "points", "angles")}
    np.savez(tmp_path / "press.npz", allow_pickle=True, **plain)
    assert set(footprint_job.read(tmp_path / "press")) == {"footprints", *plain}
    for name in plain:
        objects = {**plain, name: np.array([Path("made"), None])}
        np.savez(tmp_path / "press.npz", allow_pickle=True, **objects)
        with pytest.raises(ValueError, match="allow_pickle"):
            footprint_job.read(tmp_path / "press")


@pytest.mark.slow
def test_incompressible_rubber_is_pressed(tmp_path: Path) -> None:
    """The vertical stiffness with hybrid elements is that of the difference of two loads."""
    loads = (1000.0, 1010.0)
    for name, text in texts(loads, 0.0).items():
        hybrid = text.replace("TYPE=CGAX8R", "TYPE=CGAX8RH").replace("5.085e-08", "0")
        (tmp_path / name).write_text(hybrid)
    job.run(tmp_path, "press", "inflate")
    low, high = footprint_job.read(tmp_path / "press")["footprints"]
    stiffness = 10.0 / (high["deflection_m"] - low["deflection_m"])
    assert stiffness == pytest.approx(
        (low["stiffness_N_per_m"] + high["stiffness_N_per_m"]) / 2, 0.01
    )


def test_the_contact_has_the_properties_that_its_pair_names() -> None:
    """A pair of several *SURFACE INTERACTION has those of its own, wherever it stands."""
    pair = texts(LOADS, 0.5)
    at = pair["press.inp"].index("*SURFACE INTERACTION")
    other = "*SURFACE INTERACTION, NAME=OTHER\n*FRICTION, ELASTIC SLIP=0.1\n0.9\n"
    after = pair["press.inp"].index("*CONTACT PAIR")
    road = [
        read_road(read_keywords(pair["press.inp"][:k] + other + pair["press.inp"][k:]))
        for k in (at, after)
    ]
    assert road[0] and road[1] and road[0].friction == road[1].friction == 0.5


@pytest.fixture(scope="module")
def solid() -> Round:
    return solid_ring()


def footprints(work: Round, clock: Late, loads: list[float]) -> dict[str, Any]:
    road = footprint_job.RoadData("1", "TREAD", 1e10, 0.0, 1e-5, GRADED)
    equations = support.numbering(work.model, ~work.free)
    inflated = TyreToPress(work.model, equations, work.loads, work.U)
    return footprint_job.press(inflated, road, dict.fromkeys(loads, LoadRequest()), clock)


def test_nodes_that_bear_less_than_a_newton_belong_to_the_patch(solid: Round) -> None:
    (footprint,) = footprints(solid, Late(1000), [0.5])["footprints"]
    assert footprint["pressure_Pa"] @ footprint["area_m2"] == pytest.approx(0.5, rel=1e-6)
    assert (footprint["pressure_Pa"] > 0).all() and len(footprint["node"]) > 1


def test_each_load_that_is_reached_is_told(
    solid: Round, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The solver reports each load, the share of a load that takes several steps, and each
    iteration for --verbose."""
    newton = ContactNewton._newton

    def in_two_steps(press: ContactNewton, load: float) -> Any:
        if load == 150.0 and press.load == 50.0:
            raise NoEquilibrium("too much")
        return newton(press, load)

    monkeypatch.setattr(ContactNewton, "_newton", in_two_steps)
    with caplog.at_level("DEBUG", "tyrecal_solvers"):
        footprints(solid, Late(1000), [50.0, 150.0])
    iterations = [each for each in caplog.records if each.levelname == "DEBUG"]
    assert caplog.records[0] is iterations[0]
    assert re.match(r"50 N: Newton iteration 1, residual \S+$", iterations[0].getMessage())
    first, halfway, last = (each for each in caplog.records if each not in iterations)
    messages = [(each.getMessage(), each.__dict__.get("loads")) for each in (first, last)]
    assert messages[0] == ("load 1 of 2 is reached: 50 N", (1, 2))
    assert messages[1] == ("load 2 of 2 is reached: 150 N", (2, 2))
    assert re.match(r"100 of 150 N are reached \(\d+ of \d+ mm down", halfway.getMessage())


def test_elements_with_hourglass_stiffness_are_not_pressed() -> None:
    linear = ring((0.05, 0.08, 0.1), 0.02, 2, support.Rubber(), quadratic=False)
    with pytest.raises(DeckError, match=r"CGAX4R cannot be pressed on a road.*: take CGAX8R"):
        footprints(linear, Late(1000), [50.0])


def test_footprints_before_the_time_limit_stay(solid: Round) -> None:
    """The job keeps the loads that were reached in time, and says why there are no more."""
    unhurried = Late(1000)
    wanted = footprints(solid, unhurried, [50.0])
    result = footprints(solid, Late(1000 - unhurried.left + 2), [50.0, 200.0])
    assert result["cause"] == "timed_out" and "time limit" in result["failure"]
    assert [f["load_N"] for f in result["footprints"]] == [50.0]
    assert result["footprints"][0]["deflection_m"] == wanted["footprints"][0]["deflection_m"]
    assert wanted["cause"] == wanted["failure"] == ""
    with pytest.raises(RunFailed):
        footprints(solid, Late(2), [50.0, 200.0])


def test_nodes_of_the_middle_plane_count_for_both_halves(solid: Round) -> None:
    """Equal elements round the patch: nodes at its middle and one element on stand for equal areas
    with much the same pressure, which falls from the middle on."""
    (f,) = footprints(solid, Late(1000), [200.0])["footprints"]
    at = lambda ring: {n: i for i, n in enumerate(f["node"]) if f["ring"][i] == ring}
    own = {i: at(2)[n] for n, i in at(0).items()}
    here = np.array([f["area_m2"][i] for i in at(0).values()])
    there = np.array([f["area_m2"][own[i]] for i in at(0).values()])
    np.testing.assert_allclose(here, there, rtol=0.02)
    for i, j in own.items():
        assert 0.8 < f["pressure_Pa"][j] / f["pressure_Pa"][i] < 1.0
    assert len(set(zip(f["ring"], f["node"], strict=True))) == len(f["ring"])
