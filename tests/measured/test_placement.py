"""Sensors that are placed on a case's tyre: a hundredth of the recorded study
(`tests/studies/placed.py`), and the shift by their mass against the exact one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured import placement
from tyrecal.measured.case_modes import CaseModes
from tyrecal.measured.correlation import mac_matrix
from tyrecal.measured.placement import at_places, mass_shifts, place_sensors, tread_places
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.sensors import place
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..chance import Chance
from ..cli.test_cli import CASE, run
from ..studies.placed import imported_share
from .tyres import CASES, HIGHEST, modes, shape_of

pytestmark = pytest.mark.numbers
GRAM = 1e-3


@pytest.mark.slow
def test_an_import_labels_as_often_as_stated(
    tmp_path: Path, chance: Chance, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tests of four sensors each, by universal files: within half a mode of ten, and six standard
    errors of the stated share. False failures: 1e-7."""
    monkeypatch.setattr(placement, "DRAWN_TESTS", 40)
    case, own = CaseModes(modes()), list(modes())
    placed = place(case, own, 4, "rtz", 0.005, 1)
    shares = [imported_share(case, own, placed, chance.random, tmp_path) for _ in range(8)]
    off = 0.05 + 6 * placed.labelled_error
    chance.mean(shares, placed.labelled - off, placed.labelled + off)


def test_placed_sensors_separate_modes_better_than_random_ones() -> None:
    """By the largest AutoMAC of 8 triaxial sensors."""
    case = CaseModes(modes())

    def largest(places: np.ndarray) -> float:
        planes = [case.signals(mode, at_places(places, "rtz")) for mode in modes()]
        return float((mac_matrix(planes, planes) - np.eye(len(planes))).max())

    every = tread_places(case.points)
    random = np.random.default_rng(1)
    others = [largest(every[random.choice(len(every), 8, replace=False)]) for _ in range(7)]
    sensors = place_sensors(case, modes(), 8, "rtz")
    assert len(sensors.points) == 24 and len(np.unique(sensors.points, axis=0)) == 8
    assert largest(sensors.points[::3]) < 0.85 * np.median(others)


def test_refused_without_a_mode_or_a_place_for_each_sensor() -> None:
    """Radial sensors see no mode without waves; two sensors have no place in common."""
    case, still = CaseModes(modes()), [mode for mode in modes() if not mode.label.c]
    with pytest.raises(InputError, match=r"along r see none of \[0,0\].*give --axes rtz"):
        place_sensors(case, still, 3, "r")
    count = len(tread_places(case.points))
    with pytest.raises(InputError, match=f"has {count} places, {count + 1} are too many"):
        place_sensors(case, modes(), count + 1, "rtz")


@pytest.mark.slow
def test_a_sensors_mass_shifts_what_the_solver_finds() -> None:
    """A gram on the middle of the tread, with the masses coupled to all harmonics: both members of
    each doublet, to the second order of the mass."""
    case = load_case(CASES / "p235_75r17.yaml")
    coarse = {f"mesh.levels.default.elements.{n}": 3 for n in ("crown", "upper_sidewall")}
    numbers = {"analysis.highest_harmonic": HIGHEST, "point_mass.mass_kg": GRAM, **coarse}
    heavy = with_values(case, numbers | {"mesh.levels.default.elements.lower_sidewall": 3})
    starts = {name: v.start for name, v in heavy.case.variables.items()}
    answer = Evaluator(TyreDesign(heavy)).evaluate(Question(starts))
    heavy_modes = {mode.label: mode.raw for mode in paired_labels(answer.modes)}
    light = CaseModes(modes())
    R, Z = shape_of(modes()[0]).points.T
    crown = int(np.argmax(R - 5 * np.abs(Z)))
    places = np.array([[R[crown], 0.0, Z[crown]]])
    for mode in modes():
        if mode.label.c > 3:
            continue
        heavy_mode = heavy_modes[mode.label]
        members = heavy_mode.members or (heavy_mode.frequency_Hz,)
        shifts = mass_shifts(light, mode, places, GRAM)
        exact = np.array(sorted(members)) / mode.frequency_Hz - 1
        assert exact == pytest.approx(shifts, abs=0.03 * abs(shifts).max())


def test_the_command_places_sensors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It writes places and shares; options of one use are refused in the other."""
    monkeypatch.setattr(placement, "DRAWN_TESTS", 4)
    given = ["measured", "sensors", CASE, "--place", "4", "--mesh", "coarse"]
    given += ["--highest-harmonic", "3", "--output", str(tmp_path)]
    assert run(*given, "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((tmp_path / "sensors.json").read_text())
    assert len(result["places"]) == 4 == len((tmp_path / "sensors.csv").read_text().split()) - 1
    assert {mode["c"] for mode in result["modes"]} == {0, 1, 2, 3}
    assert run(*given, "--axle", "y") == 2
    assert "--axle goes without --place" in capsys.readouterr().err
    assert run("measured", "sensors", CASE, "--axes", "r") == 2
    assert "--axes goes with --place" in capsys.readouterr().err
