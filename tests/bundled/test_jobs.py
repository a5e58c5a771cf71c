"""Pairs of jobs as the tool writes them, edited: what is refused, held, or above a limit."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.keywords import DataLine, DeckError
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.frequency_step import FrequencyStep
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.results import StepResult, write
from tyrecal_solvers.bundled.section.boundary import rim_freedoms
from tyrecal_solvers.bundled.section.model import build
from tyrecal_solvers.bundled.section.point_elements import read_point_elements
from tyrecal_solvers.errors import RunFailed

from ..effects.support import CASE, decks

PLAIN: tuple[tuple[str, float], ...] = ()
WHEEL, TURNING, MASS = (("wheel_free", 0.1),), (("rotation", 5.0),), (("point_mass", 0.1),)
SPRING = (("wheel_free", 0.1), ("spindle_lateral", 1e6))


@cache
def texts(effects: tuple[tuple[str, float], ...]) -> dict[str, str]:
    """inflate and modes."""
    written = decks(CASE, **dict(effects))
    return {name: written[f"{name}.inp"] for name in ("inflate", "modes")}


def run(effects: tuple[tuple[str, float], ...], *edits: tuple[str, str], **request: Any) -> list:
    """Results of the pair with (old, new) edits, the revolve job's where it stands in both."""
    pair = dict(texts(effects))
    for old, new in edits:
        name = "modes" if old in pair["modes"] else "inflate"
        assert old in pair[name]
        pair[name] = pair[name].replace(old, new, 1)
    return Job(Deck(pair, "modes", "inflate"), Request(**request)).run()


FREQUENCY = "*FREQUENCY, EIGENSOLVER=LANCZOS, NORMALIZATION=MASS\n20\n"
RELEASED = "*BOUNDARY, OP=NEW\n"
SPRING_ON = "*ELEMENT, TYPE=SPRING1, ELSET=K\n999000009, 900001\n*SPRING, ELSET=K\n"
STEP = "*STEP, NAME=EQUILIBRIUM"


@pytest.mark.parametrize(
    ("effects", "old", "new", "words"),
    [
        (PLAIN, "*SYMMETRIC RESULTS TRANSFER, STEP=1, INC=10\n", "", "needs *SYMMETRIC RESULTS"),
        (PLAIN, "*FREQUENCY", "*STATIC\n1., 1.\n*FREQUENCY", "a step needs one *STATIC, *FREQ"),
        (
            PLAIN,
            "CAVITY, P, 160000\n*END STEP\n*STEP, NAME=MODES\n",
            "CAVITY, P, 160000\n*END STEP\n*STEP, NAME=MODES, PERTURBATION\n*STATIC\n",
            "a step needs one",
        ),
        (PLAIN, "DIRECT\n0.1, 1.0\n", "DIRECT\n0.1, 1.0\n0.1, 1.0\n", "takes one data line"),
        (PLAIN, STEP, f"*BOUNDARY\nNOWHERE, 1\n{STEP}", "node set NOWHERE is not defined"),
        (PLAIN, STEP, f"*BOUNDARY\n77, 1\n{STEP}", "node set 77 is not defined"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 2, 2, 0.1\n{STEP}", "only zero displacements"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 4, 6\n{STEP}", "freedom 4 to 6 of a set cannot"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 1\n{STEP}", "freedom 1 to 1 of a set cannot"),
        (PLAIN, "TIE NSET=RIM\n*STEP", "TIE NSET=BEAD\n*STEP", "it must be restated"),
        (
            PLAIN,
            "REF NODE=900001, TIE NSET=RIM\n*SOLID",
            "REF NODE=5, TIE NSET=RIM\n*SOLID",
            "node 5 or node set RIM is not defined",
        ),
        (
            PLAIN,
            "*END STEP\n*STEP, NAME=MODES\n*FREQUENCY",
            "*END STEP\n*STEP, NAME=MODES\n*COMPLEX FREQUENCY",
            "not honoured",
        ),
        (PLAIN, FREQUENCY, "*COMPLEX FREQUENCY\n20\n", "no ROTDYNF"),
        (TURNING, "CENTRIF, 25", "CENTRIF, 26", "must be one for all elements"),
        (TURNING, "ROTDYNF, 5,", "ROTDYNF, 6,", "must be one for all elements"),
        (TURNING, "SOLID_1, CENTRIF, 25, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0\n", "", "is left out of"),
        (TURNING, "PLY, CENTRIF", "PLIES, CENTRIF", "element set PLIES of the step's *DLOAD"),
        (TURNING, "PLY, CENTRIF", "PLY, GRAV", "load type 'GRAV' of *DLOAD"),
        (TURNING, "25, 0.0, 0.0, 0.0, 0.0, 1.0", "25, 0.0, 0.0, 0.0, 1.0, 0.0", "about its axle"),
        (WHEEL, "999000001, 900001", "999000001, 5", "node 5 is no node of the tyre"),
        (WHEEL, "*MASS, ELSET=WHEEL_MASS", "*MASS, ELSET=WHEEL_INERTIA", "no set of MASS"),
        (WHEEL, "0.18, 0.2866666666667, 0.18", "0.18, 0.28, 0.19", "body of revolution"),
        (WHEEL, RELEASED, f"{RELEASED}900001, 1\n", "are free together"),
        (WHEEL, "WELL, P, 160000\n", "", "which is free along the axle"),
        (WHEEL, "REFERENCE\n900001, 0, 0\n", "REFERENCE\n900001, 0.1, 0\n", "stands on the axle"),
        (WHEEL, STEP, f"{SPRING_ON}1\n{STEP}", "*SPRING takes two lines"),
        (WHEEL, STEP, f"{SPRING_ON}1\n1E6\n{STEP}", "degrees of freedom (1, 3) of the rim"),
        (WHEEL, STEP, f"{SPRING_ON}2\n-1E6\n{STEP}", "are not negative"),
        (WHEEL, STEP, f"{SPRING_ON}7\n1E6\n{STEP}", "degrees of freedom 1 to 6"),
        (MASS, "ELSET=POINT_MASS\n0.1", "ELSET=POINT_MASS\n-0.1", "*MASS must be positive"),
        (MASS, "ELSET=POINT_MASS\n0.1", "ELSET=POINT_MASS\n0.1\n0.1", "*MASS takes 1 data line"),
    ],
)
def test_a_pair_that_means_something_else_is_refused(
    effects: tuple[tuple[str, float], ...], old: str, new: str, words: str
) -> None:
    with pytest.raises(DeckError) as error:
        run(effects, (old, new))
    assert words in str(error.value)


SECTION_ROWS = "*STATIC, LONG TERM, DIRECT\n0.1, 1.0\n*BOUNDARY\n900001, 1, 6\n"
LAW = "*VISCOELASTIC, FREQUENCY=TABULAR\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("STEP=1, INC=10", "STEP=2, INC=10", "ends with STEP=1, INC=10"),
        ("STEP=1, INC=10", "STEP=1, INC=9", "ends with STEP=1, INC=10"),
        ("DIRECT\n0.1, 1.0", "DIRECT\n0.3, 1.0", "ends with STEP=1, INC=4"),
        ("DIRECT\n0.1, 1.0", "DIRECT\n0.1, 1.05", "ends with STEP=1, INC=11"),
        ("LONG TERM, DIRECT", "LONG TERM", "must be fixed (DIRECT)"),
        ("360.0, 60", "359.9, 60", "revolved by 360 degrees"),
        ("360.0, 60", "180.0, 30, 1.0, G\n180.1, 30", "revolved by 360 degrees"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.1, 0.0, 0.0, 0.0, 1.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.1, 1.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, 1.0, 0.1", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, 0.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, -1.0, 0.0", "about the second axis"),
        (SECTION_ROWS, f"*FREQUENCY\n3\n{SECTION_ROWS[41:]}".replace("0.1, 1.0\n", ""), "one step"),
        ("INFLATE, NLGEOM=YES", "INFLATE", "needs NLGEOM=YES"),
        ("INFLATE, NLGEOM=YES", "INFLATE, NLGEOM=YES, PERTURBATION", "no linear PERTURBATION"),
        ("CAVITY, P, 160000\n*END STEP\n*STEP", "CAVITY, HP, 160000\n*END STEP\n*STEP", "only P"),
        (
            "900001, 1, 6\n*DSLOAD\nCAVITY, P, 160000\n*END STEP\n*STEP",
            "900001, 1, 5\n*DSLOAD\nCAVITY, P, 160000\n*END STEP\n*STEP",
            "must be held in 1, 6",
        ),
        ("*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n", f"{LAW}0., 0.3, 0., 0., 10.\n", "two rows"),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0., 10.\n0., 0.2, 0., 0., 10.\n",
            "their frequencies rise",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0., 0.\n0., 0.2, 0., 0., 10.\n",
            "their frequencies rise",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 1.0, 0., 0., 1.\n0., 0.2, 0., 0., 10.\n",
            "are positive",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0.1, 1.\n0., 0.2, 0., 0., 10.\n",
            "the bulk modulus stays",
        ),
        ("0.3, 0, 0.1\n", "0.3, 0, 0.1, 0.2\n", "a term of a Prony series is g, k and tau"),
    ],
)
def test_what_a_transfer_or_a_table_may_not_be(old: str, new: str, words: str) -> None:
    """Read alone, without a solution: what stands there would mean another state."""
    with pytest.raises(DeckError, match=re.escape(words)):
        run(PLAIN, (old, new))


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


def test_a_section_alone_has_the_modes_without_waves() -> None:
    """Its *FREQUENCY step, whatever harmonics a request would have."""
    text = texts(PLAIN)["inflate"] + f"*STEP\n{FREQUENCY.replace('20', '4')}*END STEP\n"
    for request in (Request(), Request(harmonics=[0, 1, 2])):
        (found,) = Job(Deck({"inflate": text}, "inflate", None), request).run()
        assert [m.n for m in found.modes] == [0]
        assert len(found.modes[0].eigenvalues) == request.modes_per_harmonic


def test_slopes_take_the_static_tangent_whatever_the_vibration_has() -> None:
    """Neither its shift nor its moduli: the factor of Newton's method at the inflated state."""
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
    np.testing.assert_array_equal(plain._newton().solve(right), wanted)
    np.testing.assert_array_equal(shifted._newton().solve(right), wanted)
    assert not np.allclose(shifted.factor.solve(right), wanted, rtol=1e-9, atol=0)


def test_as_many_modes_of_each_harmonic_as_the_fullest_has() -> None:
    """Of a tyre that is not the same all round, whose harmonics *FREQUENCY's number finds."""
    few = (FREQUENCY, FREQUENCY.replace("20", "9"))
    plain, split = (run(effects, few)[0].modes for effects in (PLAIN, MASS))
    most = max(len(m.eigenvalues) for m in plain)
    assert most > min(len(m.eigenvalues) for m in plain)
    assert [m.n for m in split] == [m.n for m in plain]
    assert [len(m.eigenvalues) for m in split] == [(2 if m.n else 1) * most for m in plain]


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


def test_a_revolve_job_alone_is_refused() -> None:
    pair = dict(texts(PLAIN))
    with pytest.raises(DeckError, match="name that with --oldjob"):
        Deck({"modes": pair["modes"]}, "modes", None)


def test_masses_and_springs_stand_in_their_components() -> None:
    """A mass in all three; springs along 1, 2 and 3 radially, along the axle, round it; two on one
    node add up; the mean over a sector of one of 60."""
    pair = dict(texts(MASS))
    springs = (
        "*ELEMENT, TYPE=SPRING1, ELSET=K{0}\n99910001{0}, {1}\n*SPRING, ELSET=K{0}\n{0}\n{2}\n"
    )
    more = "".join(
        springs.format(i, n, k) for i, n, k in ((1, 21009, 1e3), (2, 21009, 2e3), (3, 19009, 3e3))
    )
    pair["modes"] = pair["modes"].replace("*STEP, NAME=EQ", more + "*STEP, NAME=EQ")
    deck = Deck(pair, "modes", "inflate")
    model = Job(deck, Request()).model
    _, revolve, _ = deck.read([])
    found = read_point_elements(revolve, model.mesh)
    at = {
        (int(r), int(c)): (m, k)
        for r, c, m, k in zip(
            found.rows, found.components, found.mass, found.stiffness, strict=True
        )
    }
    one, other = model.mesh.index[21009], model.mesh.index[19009]
    assert at == {
        (one, 0): (0.1, 1e3),
        (one, 1): (0.1, 0.0),
        (one, 2): (0.1, 2e3),
        (other, 1): (0.0, 3e3),
    }
    assert found.total_kg == pytest.approx(0.1) and found.sectors == found.highest == 60
    angle = np.linspace(-np.pi / 60, np.pi / 60, 2001)
    for n in (0, 1, 7):
        assert found.share(n) == pytest.approx(np.mean(np.cos(n * angle)), rel=1e-3)
    for n in (0, 1):
        assert found.share(n) == pytest.approx(np.trapezoid(np.cos(n * angle), angle) * 30 / np.pi)
    bad = springs.format(4, 21009, 1e3)
    pair["modes"] = pair["modes"].replace("*STEP, NAME=EQ", bad + "*STEP, NAME=EQ")
    _, revolve, _ = Deck(pair, "modes", "inflate").read([])
    with pytest.raises(DeckError, match="a spring acts along 1, 2 or 3, got 4"):
        read_point_elements(revolve, model.mesh)


def test_what_holds_other_nodes_does_not_hold_the_rim() -> None:
    """Named by its number or by a set of it alone; a row without an end is of one freedom."""
    mesh: Any = SimpleNamespace(node_sets={"RIM_REFERENCE": [9], "CROWN": [1, 9], "ONE": [1]})

    def free(*rows: str) -> set[int]:
        held = [DataLine(1, [f.strip() for f in row.split(",")]) for row in rows]
        return rim_freedoms(mesh, SimpleNamespace(held=held), 9)  # type: ignore[arg-type]

    assert free("9, 1, 6") == set() and free() == {1, 2, 3, 4, 5, 6}
    assert free("9, 1, 3", "CROWN, 1, 6", "ONE, 1, 6", "1, 1, 6") == {4, 5, 6}
    assert free("9, 2", "Rim_Reference, 4, 5") == {1, 3, 6}


def test_the_mass_is_the_sections_and_what_is_attached() -> None:
    """Volume by Pappus's rule times density, the plies' thickness being none, and 0.1 kg."""
    plain, more = (Job(Deck(texts(e), "modes", "inflate"), Request()) for e in (PLAIN, MASS))
    whole = build(Deck(texts(PLAIN), "modes", "inflate").read([])[0], None, True)
    rubber, cords = (part.mass.sum() for part in whole.parts)
    assert plain.mass_kg == pytest.approx(2 * np.pi * (rubber + cords), rel=1e-9)
    assert 10 < plain.mass_kg < 16
    assert more.mass_kg - plain.mass_kg == pytest.approx(0.1)


def test_a_job_without_a_frequency_step_ends_with_its_static_state() -> None:
    """And one whose time has passed does not begin."""
    text = texts(PLAIN)["inflate"]
    (found,) = Job(Deck({"inflate": text}, "inflate", None), Request()).run()
    assert (found.step, found.pressure_Pa, found.modes) == (1, 160000.0, [])
    assert 1e-4 < abs(found.U).max() < 0.02 and found.factorisations > 1
    late = Job(Deck({"inflate": text}, "inflate", None), Request(), time.monotonic() - 1e-3)
    with pytest.raises(RunFailed, match="the time limit passed"):
        late.run()


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


def test_the_adapter_writes_the_decks_and_what_they_cannot_say(tmp_path: Path) -> None:
    """Harmonics up to the highest, and of the rest what the tool asks for; a pressed tyre's deck
    says all but the slopes."""
    tangents = {"p": [("modes", 3, 0, 1.0)]}
    decks: Any = SimpleNamespace(
        request={"highest_harmonic": 3, "modes_per_harmonic": 4, "own_frequency": True, "other": 1},
        loads_N=(),
        start=None,
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
    """With both frequencies, the mean of them and of their slopes, and the first one's shape."""
    density = texts(MASS)["inflate"].splitlines().index("*DENSITY") + 2
    asked = {"p": [("inflate", density, 0, 1.0)]}
    job = Job(Deck(texts(MASS), "modes", "inflate"), Request([0, 1], 2, asked))
    (result,) = job.run()
    write(tmp_path / "modes", job.model, [result])
    found = Bundled().read(tmp_path)
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
    assert len(found["modes"]) == len(wanted) == 4
    for mode, slope in zip(found["modes"], found["gradients"]["p"], strict=True):
        place = min(wanted, key=lambda f, mode=mode: abs(f - mode["frequency_Hz"]))
        n, size, members, own, shape = wanted[place]
        assert mode["frequency_Hz"] == pytest.approx(place) and slope == pytest.approx(own)
        assert (mode["n"], mode["multiplicity"]) == (n, size)
        assert mode.get("members", members) == pytest.approx(members)
        assert ("members" in mode) == (n > 0)
        np.testing.assert_array_equal(mode["amplitude"], shape)
    assert (found["mass_kg"], found["pressure_Pa"]) == (job.mass_kg, 160e3)
    np.testing.assert_array_equal(found["displacement"], result.U)
    np.testing.assert_array_equal(found["points"], job.model.mesh.X)
    assert found["nodes"].tolist() == list(job.model.mesh.index)


def test_modes_are_written_by_rising_frequency(tmp_path: Path) -> None:
    """With their shapes and slopes, whatever their harmonics."""
    lines = texts(PLAIN)["inflate"].splitlines()
    density = lines.index("*DENSITY") + 2
    deck = Deck(texts(PLAIN), "modes", "inflate")
    asked = {"rho": [("inflate", density, 0, 1.0)]}
    analysis = Job(deck, Request(harmonics=[2, 0, 1], sensitivities=asked))
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
    asked = {"p": [("inflate", density, 0, 1.0)]}
    (first, *_) = run(effects, harmonics=[0, 1, 2], sensitivities=asked)
    whole = first.modes
    hertz = np.sort(np.sqrt(np.concatenate([m.eigenvalues for m in whole]))) / (2 * np.pi)
    limit = (hertz[2] + hertz[3]) / 2
    edit = FREQUENCY, f"{FREQUENCY[:-1]}, , {float(limit)!r}\n"
    cut = run(effects, edit, harmonics=[0, 1, 2], sensitivities=asked)
    left = cut[0].modes
    slopes = zip(cut[0].rates["p"], first.rates["p"], strict=True)
    for few, many, (own, all_) in zip(left, whole, slopes, strict=True):
        below = np.sqrt(many.eigenvalues) < 2 * np.pi * limit
        np.testing.assert_array_equal(few.eigenvalues, many.eigenvalues[below])
        np.testing.assert_array_equal(few.shapes, many.shapes[below])
        np.testing.assert_allclose(own, all_[below], rtol=1e-9)
    assert sum(len(m.eigenvalues) for m in left) == 3


@pytest.mark.parametrize("effects", [PLAIN, TURNING, WHEEL], ids=["plain", "turning", "wheel"])
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

        asked = {"p": [("inflate", line + 1, field, scale)]}
        result = run(effects, harmonics=[0, 1, 2], sensitivities=asked)[-1]
        h = 5e-3
        wanted = (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)
        got = np.concatenate(result.rates["p"])
        assert abs(got - wanted).max() <= 1e-5 * abs(wanted).max()
