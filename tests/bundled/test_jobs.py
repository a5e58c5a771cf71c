"""Pairs of jobs as the tool writes them, edited; files that the adapter writes and reads."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import job as job_module
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.frequency_step import FrequencyStep
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.results import StepResult, write
from tyrecal_solvers.bundled.section.boundary import rim_freedoms
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.language.text import WHOLE_DECK, Row

from .support import FREQUENCY, MASS, PLAIN, STEP, TURNING, WHEEL, run, texts


def test_rubber_is_relaxed_until_a_static_step_says_otherwise() -> None:
    """A *FREQUENCY step has the state of the *STATIC one before it; before any it is relaxed."""
    pair = dict(texts(PLAIN))
    begin, end = (pair["modes"].index(text) for text in (STEP, "*STEP, NAME=MODES"))
    pair["modes"] = pair["modes"][:begin] + pair["modes"][end:]
    sudden = {name: text.replace(", LONG TERM", "") for name, text in texts(PLAIN).items()}
    assert sudden != texts(PLAIN)
    for texts_, relaxed in ((texts(PLAIN), [True] * 3), (sudden, [False] * 3), (pair, [True] * 2)):
        *_, steps = Deck(texts_, "modes", "inflate").read([])
        assert [step.long_term for step in steps] == relaxed


def test_the_pressure_of_a_step_is_the_largest_of_its_surfaces() -> None:
    """None: 0. Within a job they carry on from step to step."""
    pair = dict(texts(PLAIN))
    pair["modes"] = pair["modes"].replace("CAVITY, P, 160000", "WELL, P, 170000\nFLANK, P, 10")
    _, _, (first, second, third) = Deck(pair, "modes", "inflate").read([])
    assert second.pressures == third.pressures == {"WELL": 170e3, "FLANK": 10.0}
    assert (first.pressure, second.pressure) == (160e3, 170e3)
    assert replace(first, pressures={}).pressure == 0.0


def test_increments_are_counted_whole() -> None:
    """A tenth ten times is ten increments, whatever rounding says; of 0.3 there are four."""
    for increment, count in ((0.1, 10), (0.3, 4), (0.5, 2), (1.0, 1), (0.07, 15)):
        pair = dict(texts(PLAIN))
        pair["inflate"] = pair["inflate"].replace("DIRECT\n0.1,", f"DIRECT\n{increment},")
        pair["modes"] = pair["modes"].replace("INC=10", f"INC={count}")
        _, _, steps = Deck(pair, "modes", "inflate").read([])
        assert [step.procedure.name for step in steps] == ["STATIC", "STATIC", "FREQUENCY"]
        assert [step.revolved for step in steps] == [False, True, True]
        assert steps[0].long_term and steps[0].pressure == 160000.0
        assert [step.output for step in steps] == ["", "", "CROWN"]


def test_a_section_alone_has_the_modes_without_waves() -> None:
    """The *FREQUENCY step of a section computes n = 0 only, whatever harmonics a request has."""
    text = texts(PLAIN)["inflate"] + f"*STEP\n{FREQUENCY.replace('20', '4')}*END STEP\n"
    for request in (Request(), Request(harmonics=[0, 1, 2])):
        (result,) = Job(Deck({"inflate": text}, "inflate", None), request).run()
        assert [m.n for m in result.modes] == [0]
        assert len(result.modes[0].eigenvalues) == request.modes_per_harmonic


def test_as_many_modes_of_each_harmonic_as_the_fullest_has() -> None:
    """A tyre that is not the same all round, whose harmonics *FREQUENCY's number determines."""
    few = (FREQUENCY, FREQUENCY.replace("20", "9"))
    plain, split = (run(effects, few)[0].modes for effects in (PLAIN, MASS))
    most = max(len(m.eigenvalues) for m in plain)
    assert most > min(len(m.eigenvalues) for m in plain)
    assert [m.n for m in split] == [m.n for m in plain]
    assert [len(m.eigenvalues) for m in split] == [(2 if m.n else 1) * most for m in plain]


def test_what_holds_other_nodes_does_not_hold_the_rim() -> None:
    """Named by its number or by a set of it alone; a row without an end is of one freedom."""
    mesh: Any = SimpleNamespace(node_sets={"RIM_REFERENCE": [9], "CROWN": [1, 9], "ONE": [1]})

    def free(*rows: str) -> set[int]:
        held = [Row(WHOLE_DECK, row) for row in rows]
        return rim_freedoms(mesh, SimpleNamespace(held=held), 9)  # type: ignore[arg-type]

    assert free("9, 1, 6") == set() and free() == {1, 2, 3, 4, 5, 6}
    assert free("9, 1, 3", "CROWN, 1, 6", "ONE, 1, 6", "1, 1, 6") == {4, 5, 6}
    assert free("9, 2", "Rim_Reference, 4, 5") == {1, 3, 6}


def test_a_job_without_a_frequency_step_ends_with_its_static_state() -> None:
    text = texts(PLAIN)["inflate"]
    (result,) = Job(Deck({"inflate": text}, "inflate", None), Request()).run()
    assert (result.step, result.pressure_Pa, result.modes) == (1, 160000.0, [])
    assert 1e-4 < abs(result.U).max() < 0.02 and result.factorisations > 1


def test_the_time_limit_counts_processor_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that waits for a busy machine goes on; one that computes for longer is ended."""
    text, used = texts(PLAIN)["inflate"], [0.0]
    clock = SimpleNamespace(thread_time=lambda: used[0])  # no other clock may be read
    monkeypatch.setattr(job_module, "time", clock)
    analysis = Job(Deck({"inflate": text}, "inflate", None), Request(), time_limit_s=2.0)
    used[0] = 1.9
    assert analysis.run()
    used[0] = 2.1
    with pytest.raises(RunFailed, match="time limit of 2 s of processor time") as failure:
        analysis.run()
    assert failure.value.cause == "timed_out"


@pytest.mark.parametrize("effects", [PLAIN, TURNING], ids=["plain", "turning"])
def test_time_is_looked_at_between_harmonics(
    effects: tuple[tuple[str, float], ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[int] = []
    monkeypatch.setattr(Job, "_check_time", lambda self: looks.append(1))
    counts = []
    for harmonics in ([1], [1, 2, 3]):
        looks.clear()
        run(effects, harmonics=harmonics)
        counts.append(len(looks))
    assert counts[1] >= counts[0] + 2 * len(run(effects, harmonics=[1]))


def crown_held(rows: str) -> StepResult:
    held = f"*BOUNDARY\n{rows}*FILE FORMAT"
    (result,) = run(PLAIN, ("*FILE FORMAT", held), harmonics=[1, 2])
    return result


def motion_at_the_crown(result: StepResult) -> np.ndarray:
    """Largest motion (3,) of the set CROWN over all modes, of that of all nodes."""
    mesh = Job(Deck(texts(PLAIN), "modes", "inflate"), Request()).model.mesh
    rows = [mesh.index[node] for node in mesh.node_sets["CROWN"]]
    shapes = np.concatenate([m.shapes for m in result.modes])
    return abs(shapes[:, rows]).max((0, 1)) / abs(shapes).max()


def test_a_set_is_held_in_the_components_that_are_named() -> None:
    """2 alone: along the axle; 1 to 3: wholly; else every component of the crown moves."""
    assert (motion_at_the_crown(crown_held("RIM, 1, 3\n")) > 0.05).all()
    axial = motion_at_the_crown(crown_held("CROWN, 2\n"))
    assert axial[2] == 0.0 and (axial[:2] > 0.05).all()
    assert (motion_at_the_crown(crown_held("CROWN, 1, 3\n")) == 0.0).all()


@pytest.mark.parametrize("effects", [PLAIN, MASS, TURNING])
def test_modes_above_the_limit_are_left_out(effects: tuple[tuple[str, float], ...]) -> None:
    """The third number of *FREQUENCY; what stays is what it was, with its slopes, with and without
    a doublet that has split. A turning tyre's waves are asked for by another step, which has no
    limit."""
    density = texts(effects)["inflate"].splitlines().index("*DENSITY") + 2
    sensitivities = {"p": [("inflate", density, 0, 1.0)]}
    (first, *_) = run(effects, harmonics=[0, 1, 2], sensitivities=sensitivities)
    whole = first.modes
    hertz = np.sort(np.sqrt(np.concatenate([m.eigenvalues for m in whole]))) / (2 * np.pi)
    limit = (hertz[2] + hertz[3]) / 2
    edit = FREQUENCY, f"{FREQUENCY[:-1]}, , {float(limit)!r}\n"
    cut = run(effects, edit, harmonics=[0, 1, 2], sensitivities=sensitivities)
    left = cut[0].modes
    slopes = zip(cut[0].rates["p"], first.rates["p"], strict=True)
    for few, many, (own, all_) in zip(left, whole, slopes, strict=True):
        below = np.sqrt(many.eigenvalues) < 2 * np.pi * limit
        np.testing.assert_array_equal(few.eigenvalues, many.eigenvalues[below])
        np.testing.assert_array_equal(few.shapes, many.shapes[below])
        np.testing.assert_allclose(own, all_[below], rtol=1e-9)
    assert sum(len(m.eigenvalues) for m in left) == 3


def test_slopes_take_the_static_tangent_whatever_the_vibration_has() -> None:
    """Sensitivities use the factor of Newton's method at the inflated state, without the
    vibration's shift and moduli."""
    work = {}
    for name, data in (("plain", "20\n"), ("shifted", "20, , , -1000.\n")):
        pair = dict(texts(PLAIN))
        pair["modes"] = pair["modes"].replace(FREQUENCY, FREQUENCY.replace("20\n", data))
        job = Job(Deck(pair, "modes", "inflate"), Request())
        job._static(job.steps[0])
        work[name] = FrequencyStep(job.tyre, 2, job.steps[2])
    plain, shifted = work["plain"], work["shifted"]
    right = np.ones(plain.equations.size)
    wanted = plain.factor.solve(right)
    np.testing.assert_array_equal(plain.static_factor.solve(right), wanted)
    np.testing.assert_array_equal(shifted.static_factor.solve(right), wanted)
    assert not np.allclose(shifted.factor.solve(right), wanted, rtol=1e-9, atol=0)


@pytest.mark.parametrize(
    "effects",
    [PLAIN, pytest.param(TURNING, marks=pytest.mark.slow), WHEEL],
    ids=["plain", "turning", "wheel"],
)
def test_slopes_by_density_and_shape_against_differences(
    effects: tuple[tuple[str, float], ...],
) -> None:
    """d lambda/dp of all modes of a pair by the rubber's density and the radius of a node of the
    inner surface, which move masses and, turning, forces: within 1e-5 of the largest."""
    lines = texts(effects)["inflate"].splitlines()
    density = lines.index("*DENSITY") + 1
    node = next(i for i, line in enumerate(lines) if line.startswith("21001,"))
    for line, field, scale in ((density, 0, 1100.0), (node, 1, 0.003)):

        def at(step: float, line: int = line, field: int = field, scale: float = scale) -> Any:
            fields = lines[line].split(",")
            fields[field] = repr(float(fields[field]) + step * scale)
            (result, *waves) = run(
                effects,
                (
                    f"\n{lines[line - 1]}\n{lines[line]}\n",
                    f"\n{lines[line - 1]}\n{','.join(fields)}\n",
                ),
                harmonics=[0, 1, 2],
            )
            return np.concatenate([m.eigenvalues for m in (waves or [result])[0].modes])

        sensitivities = {"p": [("inflate", line + 1, field, scale)]}
        result = run(effects, harmonics=[0, 1, 2], sensitivities=sensitivities)[-1]
        h = 5e-3
        wanted = (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)
        got = np.concatenate(result.rates["p"])
        assert abs(got - wanted).max() <= 1e-5 * abs(wanted).max()


def test_the_adapter_writes_the_decks_and_what_they_cannot_say(tmp_path: Path) -> None:
    """Harmonics up to the highest, and of the rest what the tool asks for; a pressed tyre's deck
    says all but the slopes."""
    tangents = {"p": [("modes", 3, 0, 1.0)]}
    decks: Any = SimpleNamespace(
        request={"highest_harmonic": 3, "modes_per_harmonic": 4, "own_frequency": True, "other": 1},
        loads_N=(),
        start=None,
        pressed_start=None,
        texts=lambda dialect: {"modes.inp": f"** ä {dialect}\n"},
        tangents=lambda dialect: tangents,
    )
    deck, request = Bundled().write(decks, tmp_path)
    assert deck.name == "modes.inp" and deck.read_bytes() == "** ä abaqus\n".encode()
    assert request.name == "modes.request.json"
    assert json.loads(request.read_text()) == {
        "harmonics": [0, 1, 2, 3],
        "modes_per_harmonic": 4,
        "sensitivities": {"p": [["modes", 3, 0, 1.0]]},
        "own_frequency": True,
    }
    request.unlink()
    decks.loads_N = (100.0,)
    deck, request = Bundled().write(decks, tmp_path)
    assert request.name == "press.request.json"
    assert json.loads(request.read_text()) == {"sensitivities": {"p": [["modes", 3, 0, 1.0]]}}
    request.unlink()
    tangents.clear()
    assert Bundled().write(decks, tmp_path) == [deck] and not request.exists()


def test_the_two_that_a_doublet_has_split_into_are_read_as_one(tmp_path: Path) -> None:
    """The adapter reads both frequencies, the mean of them and of their slopes, and the first
    shape."""
    density = texts(MASS)["inflate"].splitlines().index("*DENSITY") + 2
    sensitivities = {"p": [("inflate", density, 0, 1.0)]}
    job = Job(Deck(texts(MASS), "modes", "inflate"), Request([0, 1], 2, sensitivities))
    (result,) = job.run()
    write(tmp_path / "modes", job.model, [result])
    answer = Bundled().read(tmp_path)
    shapes = np.load(tmp_path / "modes.npz")["shapes_2"]
    order = np.sort(np.concatenate([m.eigenvalues for m in result.modes]))
    wanted = {}
    for m, rates in zip(result.modes, result.rates["p"], strict=True):
        size, hertz = 2 if m.n else 1, np.sqrt(m.eigenvalues) / (2 * np.pi)
        for i in range(0, len(hertz), size):
            own = slice(i, i + size)
            slope = (rates[own] / (8 * np.pi**2 * hertz[own])).mean()
            first = shapes[np.flatnonzero(order == m.eigenvalues[i])[0]]
            wanted[hertz[own].mean()] = m.n, size, list(hertz[own]), slope, first
    assert len(answer["modes"]) == len(wanted) == 4
    for mode, slope in zip(answer["modes"], answer["gradients"]["p"], strict=True):
        place = min(wanted, key=lambda f, mode=mode: abs(f - mode["frequency_Hz"]))
        n, size, members, own, shape = wanted[place]
        assert mode["frequency_Hz"] == pytest.approx(place) and slope == pytest.approx(own)
        assert (mode["n"], mode["multiplicity"]) == (n, size)
        assert mode.get("members", members) == pytest.approx(members)
        assert ("members" in mode) == (n > 0)
        np.testing.assert_array_equal(mode["amplitude"], shape)
    assert (answer["mass_kg"], answer["pressure_Pa"]) == (job.mass_kg, 160e3)
    np.testing.assert_array_equal(answer["displacement"], result.U)
    np.testing.assert_array_equal(answer["points"], job.model.mesh.X)
    assert answer["nodes"].tolist() == list(job.model.mesh.index)


def test_modes_are_written_by_rising_frequency(tmp_path: Path) -> None:
    """Shapes and slopes keep this order, whatever their harmonics."""
    lines = texts(PLAIN)["inflate"].splitlines()
    density = lines.index("*DENSITY") + 2
    deck = Deck(texts(PLAIN), "modes", "inflate")
    sensitivities = {"rho": [("inflate", density, 0, 1.0)]}
    analysis = Job(deck, Request(harmonics=[2, 0, 1], sensitivities=sensitivities))
    (result,) = analysis.run()
    write(tmp_path / "modes", analysis.model, [result])
    (step,) = json.loads((tmp_path / "modes.json").read_text())["steps"]
    hertz = [mode["frequency_Hz"] for mode in step["modes"]]
    assert hertz == sorted(hertz) and len(hertz) == 6
    shapes = np.load(tmp_path / "modes.npz")["shapes_2"]
    for mode, slope, shape in zip(step["modes"], step["sensitivities"]["rho"], shapes, strict=True):
        place = [m.n for m in result.modes].index(mode["n"])
        own = result.modes[place]
        j = int(np.argmin(abs(own.eigenvalues - mode["eigenvalue"])))
        assert own.eigenvalues[j] == mode["eigenvalue"]
        circle = np.pi if mode["n"] else 2 * np.pi
        assert shape == pytest.approx(own.shapes[j] / np.sqrt(circle), rel=1e-5, abs=1e-6)
        rate = result.rates["rho"][place][j]
        assert slope == pytest.approx(rate / (8 * np.pi**2 * mode["frequency_Hz"]))
