"""The inflated tyre pressed on the road, through its decks: equilibrium, symmetry, refusals."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.deck.keywords import DeckError
from tyrecal_solvers.bundled.road import contact_newton, footprint_job
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton
from tyrecal_solvers.errors import Indefinite, NoEquilibrium, RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from . import support
from .contact import Round, ring

Array = np.ndarray
ANGLES = [4.0, 4.0, 4.0, 5.0, 8.0, 15.0, 40.0, 100.0]  # degrees, half the tyre
LOADS = (1000.0, 2000.0)


def coarse_case(**road: object) -> LoadedCase:
    """The main case on a coarse mesh and few elements round the tyre."""
    loaded = load_case(CASES / "p235_75r17.yaml")
    case = loaded.case
    level = case.mesh.levels["default"].model_copy(
        update={
            "elements": {"crown": 3, "upper_sidewall": 2, "lower_sidewall": 2, "bead": 1},
            "rows": [1, 1, 1, 1],
            "grading": None,
        }
    )
    return replace(
        loaded,
        case=case.model_copy(
            update={
                "mesh": case.mesh.model_copy(update={"levels": {"default": level}}),
                "road": case.road.model_copy(update={"element_angles_deg": ANGLES, **road}),
            }
        ),
    )


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
    """Two loads with friction."""
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
    for found in (direct, pressed["footprints"][-1]):
        assert found["deflection_m"] == pytest.approx(steps["deflection_m"], rel=1e-2)
        assert found["contact_area_m2"] == pytest.approx(steps["contact_area_m2"], rel=3e-2)
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


def test_an_unreachable_load_keeps_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The load before it stays, with a sentence why there is no more."""
    support.bears(monkeypatch, 1500.0)
    found = run(tmp_path, (1000.0, 1e4), 0.0)
    assert [f["load_N"] for f in found["footprints"]] == [1000.0]
    assert found["cause"] == "no_equilibrium"
    assert re.fullmatch(
        r"no equilibrium between 1000 and \d+ N \(\d+ of \d+ mm down to the rim\): too much",
        found["failure"],
    )


def test_an_absurd_load_is_not_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ton of tonnes: at the stiffness of the load before, many times the way down to the rim."""
    tried: list[float] = []
    newton = ContactNewton._newton
    monkeypatch.setattr(
        ContactNewton, "_newton", lambda press, load: tried.append(load) or newton(press, load)
    )
    found = run(tmp_path, (1000.0, 1e7), 0.0)
    assert tried == [1000.0]
    reached = found["footprints"][0]
    down = reached["deflection_m"] + (1e7 - 1000.0) / reached["stiffness_N_per_m"]
    assert found["failure"].endswith(f"down by {1e3 * down:.0f} mm")
    assert found["cause"] == "no_equilibrium"


def test_the_time_limit_passes(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="time limit"):
        run(tmp_path, limit=0.05)


class Late:
    """A clock that stops the work at the n-th look."""

    def __init__(self, looks: int):
        self.left = looks

    def __call__(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise RunFailed("timed_out", "the time limit passed")


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


@pytest.fixture(scope="module")
def solid() -> Round:
    return ring((0.05, 0.08, 0.1), 0.02, 2, support.Rubber())


LENGTHS = np.radians([3.0] * 6 + [12.0, 30.0, 60.0, 60.0])


def test_a_first_load_out_of_reach_fails(solid: Round) -> None:
    for load, why in ((1e7, "at its stiffness there it would go down"), (2e4, "flat on its rim")):
        with pytest.raises(NoEquilibrium, match=why):
            solid.press(LENGTHS, 1e10).to(load)


def test_a_clock_that_runs_out_between_loads(solid: Round) -> None:
    """What was reached before stays; the same from `ContactNewton` and from the job."""
    press = solid.press(LENGTHS, 1e10)
    first = press.to(50.0)
    press.check = Late(1)
    with pytest.raises(RunFailed):
        press.to(200.0)
    assert press.load == 50.0
    np.testing.assert_array_equal(press.parts, first.parts)


def footprints(work: Round, clock: Late, loads: list[float]) -> dict[str, Any]:
    road = footprint_job.RoadData("1", "TREAD", 1e10, 0.0, 1e-5, LENGTHS)
    equations = support.numbering(work.model, ~work.free)
    return footprint_job.press(work.model, equations, work.loads, work.U, road, loads, clock)


def test_nodes_that_bear_less_than_a_newton_belong_to_the_patch(solid: Round) -> None:
    (found,) = footprints(solid, Late(1000), [0.5])["footprints"]
    assert found["pressure_Pa"] @ found["area_m2"] == pytest.approx(0.5, rel=1e-6)
    assert (found["pressure_Pa"] > 0).all() and len(found["node"]) > 1


def test_each_load_that_is_reached_is_told(
    solid: Round, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And how far on the way to one that takes several steps, from the first iteration on."""
    newton = ContactNewton._newton

    def in_two_steps(press: ContactNewton, load: float) -> Any:
        if load == 150.0 and press.load == 50.0:
            raise NoEquilibrium("too much")
        return newton(press, load)

    monkeypatch.setattr(ContactNewton, "_newton", in_two_steps)
    with caplog.at_level("INFO", "tyrecal_solvers"):
        footprints(solid, Late(1000), [50.0, 150.0])
    iterations = [each for each in caplog.records if "out of balance" in each.msg]
    assert caplog.records[0] is iterations[0]
    first, halfway, last = (each for each in caplog.records if each not in iterations)
    told = [(each.getMessage(), each.__dict__.get("loads")) for each in (first, last)]
    assert told[0] == ("load 1 of 2 is reached: 50 N", (1, 2))
    assert told[1] == ("load 2 of 2 is reached: 150 N", (2, 2))
    assert re.match(r"100 of 150 N are reached \(\d+ of \d+ mm down", halfway.getMessage())


def test_elements_with_hourglass_stiffness_are_not_pressed() -> None:
    linear = ring((0.05, 0.08, 0.1), 0.02, 2, support.Rubber(), quadratic=False)
    with pytest.raises(DeckError, match=r"CGAX4R cannot be pressed on a road.*: take CGAX8R"):
        footprints(linear, Late(1000), [50.0])


def test_footprints_before_the_time_limit_stay(solid: Round) -> None:
    """The job keeps the loads that were reached in time, and says why there are no more."""
    unhurried = Late(1000)
    wanted = footprints(solid, unhurried, [50.0])
    found = footprints(solid, Late(1000 - unhurried.left + 2), [50.0, 200.0])
    assert found["cause"] == "timed_out" and "time limit" in found["failure"]
    assert [f["load_N"] for f in found["footprints"]] == [50.0]
    assert found["footprints"][0]["deflection_m"] == wanted["footprints"][0]["deflection_m"]
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


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_two_presses_give_the_same_bits(solid: Round, friction: float) -> None:
    runs: list[ContactNewton] = []
    for _ in range(2):
        runs.append(solid.press(LENGTHS, 1e10, friction))
        for load in (50.0, 100.0):
            runs[-1].to(load)
    np.testing.assert_array_equal(runs[0].parts, runs[1].parts)
    assert runs[0].height == runs[1].height


def test_off_the_road_there_is_no_step(solid: Round) -> None:
    """Newton's step has overshot to where nothing touches: a smaller load is tried."""
    press = solid.press(LENGTHS, 1e10)
    force, lacking, contact = press._state(press.parts, press.height + 0.01, 100.0, None)
    with pytest.raises(NoEquilibrium, match="no force answers"):
        press._step(contact, force, lacking, 1e-6)


def test_nearly_the_same_load_again(solid: Round) -> None:
    """A start that is in equilibrium already needs no step, and has its stiffness all the same."""
    press = solid.press(LENGTHS, 1e10)
    first = press.to(50.0)
    again = press.to(50.0 * (1 + 1e-9))
    assert again.height == pytest.approx(first.height, rel=1e-9)
    assert again.stiffness == pytest.approx(first.stiffness, rel=2e-3)


def test_a_stiffness_that_is_not_found_is_no_number(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(contact_newton, "MAX_UNIT_RESIDUAL", 1e-30)
    with pytest.raises(NoEquilibrium, match="vertical stiffness was not found in 60 iterations"):
        solid.press(LENGTHS, 1e10).to(50.0)


@pytest.mark.slow
def test_incompressible_rubber_is_pressed(tmp_path: Path) -> None:
    """In hybrid elements: the vertical stiffness is that of two loads' difference."""
    loads = (1000.0, 1010.0)
    for name, text in texts(loads, 0.0).items():
        hybrid = text.replace("TYPE=CGAX8R", "TYPE=CGAX8RH").replace("5.085e-08", "0")
        (tmp_path / name).write_text(hybrid)
    job.run(tmp_path, "press", "inflate")
    low, high = footprint_job.read(tmp_path / "press")["footprints"]
    found = 10.0 / (high["deflection_m"] - low["deflection_m"])
    assert found == pytest.approx((low["stiffness_N_per_m"] + high["stiffness_N_per_m"]) / 2, 0.01)


def test_a_little_more_load_is_one_step_along_the_slope(solid: Round) -> None:
    """1 % more: what the slope by the load leaves is of second order, and what one step of Newton's
    method leaves of that of fourth, so two do, with the preconditioner of the load before; without
    the slope it takes several. A fifth more has one of its own."""
    press = solid.press(LENGTHS, 1e10)
    found = [press.to(load) for load in (198.0, 200.0)]
    before = press.iterations, press.factorisations
    found.append(press.to(202.0))
    assert (press.iterations, press.factorisations) == (before[0] + 2, before[1])
    parts, heights = np.array([f.parts for f in found]), [f.height for f in found]
    curved = np.linalg.norm(parts[0] - 2 * parts[1] + parts[2])
    assert curved < 0.02 * np.linalg.norm(parts[2] - parts[1])
    assert abs(heights[0] - 2 * heights[1] + heights[2]) < 0.02 * (heights[1] - heights[2])
    press.to(242.0)
    assert press.factorisations == before[1] + 1


@pytest.mark.parametrize(("used", "formed"), [(15, 0), (16, 1)])
def test_after_many_iterations_the_preconditioner_is_formed_anew(
    solid: Round, used: int, formed: int
) -> None:
    press = solid.press(LENGTHS, 1e10)
    press.to(50.0)
    state = press._state(press.parts, press.height, 51.0, None)
    before, press._used = press.factorisations, used
    press._step(state[2], *state[:2], 1e-2)
    assert press.factorisations == before + formed and press._used < 15


def test_an_unstable_tangent_has_no_preconditioner(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one before is let go first, as memory holds but one: the load is not reached."""
    press = solid.press(LENGTHS, 1e10)
    contact = press.to(50.0).contact
    alive: list[bool] = []

    def unstable(*given: object) -> None:
        alive.append(press._factor is not None)
        raise Indefinite

    monkeypatch.setattr(contact_newton, "Factor", unstable)
    with pytest.raises(Indefinite):
        press._form(contact)
    assert alive == [False]
    with pytest.raises(NoEquilibrium, match="no equilibrium between 50 and"):
        press.to(60.0)


def test_time_is_looked_at_before_every_iteration(solid: Round) -> None:
    looks: list[int] = []
    press = solid.press(LENGTHS, 1e10, check=lambda: looks.append(1))
    press.to(50.0)
    looks.clear()
    before = press.iterations
    state = press.parts, press.height - 1e-4, 100.0, None, 1e-8
    press._settle(*state)
    assert len(looks) == press.iterations - before + 1 > 2


def test_friction_that_does_not_converge_is_left_soon(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After three steps that do not halve the residual; two are borne."""
    press = solid.press(LENGTHS, 1e10, 0.5)
    press.to(50.0)
    monkeypatch.setattr(press, "_step", lambda *given: (0 * press.parts, 0.0))
    before = press.iterations
    with pytest.raises(NoEquilibrium, match="did not converge"):
        press._settle(press.parts, press.height - 1e-4, 100.0, None, 1e-8)
    assert press.iterations == before + 3


@pytest.mark.parametrize(("share", "words"), [(0.9e-4, "no lower energy"), (1.1e-4, "converge")])
def test_the_line_search_asks_for_a_ten_thousandth_of_the_slope(
    solid: Round, monkeypatch: pytest.MonkeyPatch, share: float, words: str
) -> None:
    """An energy that falls by a share of what the forces on the parts and on the road tell."""
    press = solid.press(LENGTHS, 1e10)
    press.to(50.0)
    parts, height = press.parts, press.height - 1e-5
    force, lacking, _ = press._state(parts, height, 100.0, press._bound)
    step, rise = -1e-9 * force / (force**2).sum(), -1e-9 / lacking
    monkeypatch.setattr(press, "_step", lambda *given: (step, rise))
    fall = lambda contact, load, at: -share * 2e-9 * (at - height) / rise
    monkeypatch.setattr(press, "_energy", fall)
    with pytest.raises(NoEquilibrium, match=words):
        press._settle(parts, height, 100.0, press._bound, 1e-8)


def test_a_load_starts_along_the_slope_of_the_last_one(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one by a micrometre per newton."""
    press = solid.press(LENGTHS, 1e10)
    started: list[tuple[Array, float]] = []
    settle = ContactNewton._settle

    def note(self: ContactNewton, parts: Array, height: float, *rest: Any) -> Any:
        started.append((parts, height))
        return settle(self, parts, height, *rest)

    monkeypatch.setattr(ContactNewton, "_settle", note)
    rest, free = press.parts, press.free_radius
    first = press.to(50.0)
    np.testing.assert_array_equal(started[0][0], rest)
    assert started[0][1] == pytest.approx(free - 50e-6, abs=1e-12)
    started.clear()
    slope = press._slope
    press.to(80.0)
    assert slope is not None and slope[1] < 0
    np.testing.assert_allclose(started[0][0], first.parts + 30 * slope[0], atol=1e-15)
    assert started[0][1] == pytest.approx(first.height + 30 * slope[1], abs=1e-12)
    assert slope[1] == pytest.approx(-1 / first.stiffness)


def test_how_far_down_is_told_in_words(solid: Round) -> None:
    """Of the way to where the crown, 10 mm thick, lies on the rim, 200 mm from the axle."""
    X = np.array(
        [[0.15, 0.0], [0.2, 0.1], [0.2, -0.1], [0.3, 0.1], [0.31, 0], [0.305, 0], [0.3, 0]]
    )
    assert ContactNewton._flat_height(X, np.array([1, 2])) == pytest.approx(0.21)
    assert ContactNewton._flat_height(X[3:], np.array([], int)) == pytest.approx(0.01)
    press = solid.press(LENGTHS, 1e10)
    assert press.depth() == ""
    press.flat, press.height, press.load = press.free_radius - 0.04, press.free_radius - 0.013, 1.0
    assert press.depth() == " (13 of 40 mm down to the rim)"


@pytest.mark.parametrize(("most_N", "reached"), [(101.0, 2), (26.0, 8), (12.6, 16), (12.4, 0)])
def test_a_load_is_reached_in_up_to_sixteen_steps(
    solid: Round, monkeypatch: pytest.MonkeyPatch, most_N: float, reached: int
) -> None:
    """Steps are halved until Newton's method finds a state; time is looked at before each."""
    press, looks = solid.press(LENGTHS, 1e10), []
    monkeypatch.setattr(press, "check", lambda: looks.append(1))
    first, taken = press.to(50.0), []

    def newton(load: float) -> object:
        if load > press.load + most_N:
            raise NoEquilibrium("too much")
        taken.append(load)
        return first

    monkeypatch.setattr(press, "_newton", newton)
    looks.clear()
    if reached:
        press.to(250.0)
        assert taken == pytest.approx([50.0 + 200.0 / reached * (i + 1) for i in range(reached)])
        assert len(looks) == reached + np.log2(reached)
    else:
        with pytest.raises(
            NoEquilibrium, match=r"no equilibrium between 50 and 62.5 N \(.*too much"
        ):
            press.to(250.0)


def test_a_much_larger_load_after_a_small_one(solid: Round) -> None:
    """A hundred times the load: the same as at once."""
    press = solid.press(LENGTHS, 1e10)
    press.to(5.0)
    found, direct = press.to(500.0), solid.press(LENGTHS, 1e10).to(500.0)
    assert found.height == pytest.approx(direct.height, rel=1e-8)
    np.testing.assert_allclose(found.parts, direct.parts, atol=1e-6 * abs(direct.parts).max())


@pytest.mark.parametrize("slip", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("friction", [0.5, 3.0])
def test_friction_of_any_size_converges(solid: Round, friction: float, slip: float) -> None:
    """From a soft to a hard stick, and more friction than rubber has."""
    press = solid.press(LENGTHS, 1e10, friction, slip)
    press.to(50.0)
    found = press.to(100.0)
    assert found.contact.force == pytest.approx(100.0, rel=1e-7)
    traction = np.linalg.norm(found.contact.traction, axis=-1)
    assert (traction <= friction * found.contact.normal * (1 + 1e-9)).all()


def test_a_ring_is_pressed_in_the_middle(solid: Round) -> None:
    """No cords: mirror images in both planes, so the second part of the fold stays nil."""
    press = solid.press(LENGTHS, 1e10, 0.5)
    press.to(50.0)
    found = press.to(100.0)
    assert abs(found.parts[1]).max() < 1e-9 * abs(found.parts[0]).max()
    assert found.contact.force == pytest.approx(100.0, rel=1e-8)
    assert abs(found.contact.traction).max() > 0.0  # friction is at work


def test_a_softer_road_gives_more(solid: Round) -> None:
    """The overclosure is a spring in series: at 1e12 Pa/m it no longer matters."""
    heights = {k: solid.press(LENGTHS, k).to(100.0).height for k in (1e9, 1e10, 1e11, 1e12)}
    given = [heights[1e12] - heights[k] for k in (1e9, 1e10, 1e11)]
    assert given[0] > given[1] > given[2] > 0
    assert given[1] < 0.2 * given[0] and given[2] < 0.2 * given[1]
