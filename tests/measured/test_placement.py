"""Sensors that are placed on a case's tyre: a hundredth of the recorded study
(`tests/studies/placed.py`), and the shift by their mass against the exact one.

Labels from rings of sensors: a hundredth of the recorded study (`tests/studies/rings.py`).
Geometry of sensors: axle, centre, directions, and places that are not on the tyre.
"""

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
from tyrecal.measured.sensors import _axle, real_part, sensors_of
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.sensors import place
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..chance import Chance
from ..cli.test_cli import CASE, run
from ..studies.placed import imported_share
from ..studies.rings import DIRECTIONS, GROUPS, draw_test, labels_given
from .tyres import CASES, HIGHEST, modes, shape_of

GRAM = 1e-3


@pytest.mark.numbers
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


@pytest.mark.numbers
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


@pytest.mark.numbers
def test_refused_without_a_mode_or_a_place_for_each_sensor() -> None:
    """Radial sensors see no mode without waves; two sensors have no place in common."""
    case, still = CaseModes(modes()), [mode for mode in modes() if not mode.label.c]
    with pytest.raises(InputError, match=r"along r see none of \[0,0\].*give --axes rtz"):
        place_sensors(case, still, 3, "r")
    count = len(tread_places(case.points))
    with pytest.raises(InputError, match=f"has {count} places, {count + 1} are too many"):
        place_sensors(case, modes(), count + 1, "rtz")


@pytest.mark.numbers
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


@pytest.mark.numbers
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


@pytest.mark.numbers
@pytest.mark.slow
def test_labels_from_rings_are_right_or_not_given(chance: Chance) -> None:
    """At most one in 200 of some 130 modes of the main tyre (coarse mesh) is wrong, and 19 in 20
    of those that `measured sensors` calls distinguishable have a label.

    False failures: 2e-7.
    """
    ordered = sorted(modes(), key=lambda mode: mode.frequency_Hz)
    wrong, labelled = [], []
    for rings, name in GROUPS:
        test = draw_test(ordered, rings, DIRECTIONS[name], chance.random)
        for true, given, can_tell in labels_given(test):
            wrong.append(given not in (None, true))
            labelled += [given is not None] * can_tell
    chance.often(wrong, 0.0, 0.005)
    chance.often(labelled, 0.95)


ANGLES = np.radians([3, 31, 65, 88, 124, 149, 187, 214, 246, 271, 303, 337])


def ring(radius: float = 0.35, half_width: float = 0.05, axle: int = 2, off: float = 0.0) -> dict:
    """Nodes round a tyre about the axle, whose middle is ``off`` from it."""
    x, y = (axle + 1) % 3, (axle + 2) % 3
    nodes = {}
    for k, angle in enumerate(ANGLES):
        place = np.zeros(3)
        place[[x, y]] = radius * np.cos(angle) + off, radius * np.sin(angle)
        place[axle] = half_width * (-1) ** k
        nodes[k + 1] = tuple(place)
    return nodes


SIGNALS = [(node, k) for node in range(1, 13) for k in (1, 2, 3)]


@pytest.mark.parametrize("axle", [0, 1, 2])
def test_the_axle_is_where_they_spread_least(axle: int) -> None:
    """Theta from the next axis in the order x, y, z, x; directions 1, 2, 3 along x, y, z are turned
    with it."""
    sensors = sensors_of(SIGNALS, ring(axle=axle))
    assert sensors.points[::3, 0] == pytest.approx(0.35)
    assert np.degrees(sensors.points[::3, 1]) % 360 == pytest.approx(np.degrees(ANGLES))
    assert sensors.points[::3, 2] == pytest.approx(0.05 * (-1) ** np.arange(12))
    x, y = (axle + 1) % 3, (axle + 2) % 3
    for k, angle in enumerate(ANGLES):
        three = sensors.directions[3 * k : 3 * k + 3]
        assert three[axle] == pytest.approx([0, 0, 1])
        assert three[x] == pytest.approx([np.cos(angle), -np.sin(angle), 0])
        assert three[y] == pytest.approx([np.sin(angle), np.cos(angle), 0])


def test_directions_may_be_the_sensors_own_and_turned_round() -> None:
    sensors = sensors_of([(1, 1), (1, -2), (1, 3)], ring(), cylindrical=True)
    assert sensors.directions.tolist() == [[1, 0, 0], [0, -1, 0], [0, 0, 1]]
    plain = sensors_of([(1, 1), (1, -1)], ring())
    assert plain.directions[1].tolist() == (-plain.directions[0]).tolist()


def test_places_as_wide_as_high_do_not_tell_the_axle() -> None:
    """A tyre is less than three quarters as wide as high."""
    assert _axle(np.array([[0.0, 0, 0], [1.0, 1.1, 0.74]])) == "z"
    with pytest.raises(InputError, match="give --axle"):
        _axle(np.array([[0.0, 0, 0], [1.0, 1.1, 0.76]]))
    assert sensors_of([(1, 1)], ring(0.3, 0.3), axle="z").points[0, 0] == pytest.approx(0.3)


@pytest.mark.parametrize(("radius", "tyre"), [(0.149, 0), (0.151, 1), (1.499, 1), (1.501, 0)])
def test_radii_are_a_tyres(radius: float, tyre: int) -> None:
    if tyre:
        assert len(sensors_of(SIGNALS, ring(radius)).points) == 36
    else:
        with pytest.raises(InputError, match="no tyre's"):
            sensors_of(SIGNALS, ring(radius))


@pytest.mark.parametrize(("off", "fine"), [(0.03, True), (0.04, False)])
def test_a_circle_stands_about_the_axle(off: float, fine: bool) -> None:
    """The circle is about the axle to a tenth of its radius; with a given centre it may be
    anywhere."""
    if fine:
        assert sensors_of(SIGNALS, ring(off=off))
    else:
        with pytest.raises(InputError, match=f"middle {off:g} m off the axle"):
            sensors_of(SIGNALS, ring(off=off))
    assert sensors_of(SIGNALS, ring(off=off), centre=(off, 0, 0)).points[:, 0] == pytest.approx(
        0.35
    )


def test_few_sensors_or_none_on_a_circle_do_not_tell_a_centre() -> None:
    """Three, a row, or places that lie on no circle within 6 %."""
    moved = ring(off=0.1)
    assert sensors_of([(1, 1), (5, 1), (9, 1)], moved)
    with pytest.raises(InputError, match="off the axle"):
        sensors_of([(1, 1), (4, 1), (7, 1), (10, 1)], moved)
    row = {k: (0.3, 0.02 * k, 0.01 * k) for k in range(1, 7)}
    assert sensors_of([(k, 1) for k in row], row, axle="z")
    for size, circle in ((0.05, True), (0.08, False)):
        nodes = {}
        for k, angle in enumerate(ANGLES):
            r = 0.35 * (1 + size * (-1) ** k)
            nodes[k + 1] = (r * np.cos(angle) + 0.1, r * np.sin(angle), 0.05 * (-1) ** (k // 2))
        if circle:
            with pytest.raises(InputError, match="off the axle"):
                sensors_of(SIGNALS, nodes)
        else:
            assert sensors_of(SIGNALS, nodes)


def test_a_node_without_a_place_is_named() -> None:
    with pytest.raises(InputError, match="node 13 has no coordinates"):
        sensors_of([(1, 1), (14, 1), (13, 1)], ring())


def test_a_shape_is_turned_to_be_real() -> None:
    """Collinearity 1 but for a factor, 0 in quadrature, (a^2 - b^2) / (a^2 + b^2) between."""
    u = np.array([1.0, -2.0, 0.5])
    for angle in (0.0, 0.4, 1.5):
        turned, collinear = real_part(u * np.exp(1j * angle))
        assert abs(turned) == pytest.approx(abs(u)) and collinear == pytest.approx(1.0)
    _, collinear = real_part(np.array([2.0, 1j]))
    assert collinear == pytest.approx(0.6)
    assert real_part(np.array([1.0, 1j]))[1] == pytest.approx(0.0)
    assert real_part(np.zeros(3))[1] == 0.0
