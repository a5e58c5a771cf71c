"""MAC and COMAC of measured shapes: a hundredth of the recorded study
(`tests/studies/mac_pairing.py`), and sensors with a known fault.

Measured shapes and the modes of a case.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import log
from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.case_modes import SPOILT, CaseModes, ln_shape_odds
from tyrecal.measured.correlation import auto_mac, auto_mac_words, chance_level
from tyrecal.measured.sensors import Sensors, real_part
from tyrecal.measured.shapes import SensorShapes, ShapeOfMode, read_shapes, shapes_path, shapes_text
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.correlation import correlate

from ..chance import Chance, generator
from ..studies.mac_pairing import SIGNALS, draw_pairing, draw_sensors
from .tyres import measured, modes, shape_of

pytestmark = pytest.mark.numbers
KINDS = "axial", "torsional"


def test_the_chance_level_is_exceeded_by_one_random_shape_in_twenty(chance: Chance) -> None:
    """By the MAC with a plane of 8 signals. False failures: 1e-7."""
    assert [round(chance_level(n), 2) for n in (2, 8, 20, 200)] == [1, 0.63, 0.28, 0.03]
    u = chance.random.standard_normal((8, 4000))
    mac = np.sum(u[:2] ** 2, axis=0) / np.sum(u**2, axis=0)  # with the plane of the first two
    chance.often(mac > chance_level(8), 0.05, 0.05)


@pytest.mark.slow
def test_pairs_are_right_or_undecided(chance: Chance) -> None:
    """At 8 to 200 signals with 5 % noise no pair is wrong, and of random shapes at most one in 20
    has a pair; 50 signals or more at any places decide all. False failures: 3e-7."""
    wrong, decided, random = [], [], []
    for count in SIGNALS[::2]:
        for is_ring in (False, True):
            for true, given in draw_pairing(modes(), count, is_ring, chance.random):
                if true == "random":
                    random.append(given is not None)
                    continue
                wrong.append(given not in (None, true))
                decided += [given is not None] * (count >= 50 and not is_ring)
    chance.often(wrong, 0.0, 1e-3)
    chance.often(random, 0.0, 0.05)
    chance.often(decided, 0.98)


def drawn_test(random: np.random.Generator) -> tuple[SensorShapes, CaseModes]:
    """A member of each mode at 40 signals, with 2 % noise and labels."""
    case = CaseModes(modes())
    sensors = draw_sensors(shape_of(modes()[0]).points, 40, False, random)
    shapes = []
    for mode in case.modes:
        both = case.signals(mode, sensors)
        u = both @ random.standard_normal(both.shape[1])
        u += 0.02 * np.sqrt(np.mean(u**2)) * random.standard_normal(40)
        own = {"c": mode.label.c, "m": mode.label.m, "kind": mode.label.kind, "member": ""}
        shapes.append(ShapeOfMode(**own, frequency_Hz=mode.frequency_Hz, values=u.tolist()))
    test = SensorShapes(
        file="run1.uff",
        pressure_kPa=240,
        signals=[f"{k}:1" for k in range(40)],
        points=sensors.points.tolist(),
        directions=sensors.directions.tolist(),
        modes=shapes,
    )
    return test, case


def spoilt(test: SensorShapes, signal: int, factor: float, noise: float = 0.0) -> SensorShapes:
    """The test with a wrong gain at a signal, and with a cable that gives noise."""
    own = generator("cable")
    each = []
    for mode in test.modes:
        u = np.array(mode.values)
        u[signal] = factor * u[signal] + noise * np.abs(u).max() * own.standard_normal()
        each.append(mode.model_copy(update={"values": u.tolist()}))
    return test.model_copy(update={"modes": each})


def test_a_sensor_that_is_turned_round_or_broken_agrees_least() -> None:
    """ECOMAC shows both, COMAC the broken one only: it ignores gain and sign."""
    test, case = drawn_test(generator("sensors"))
    signal = int(np.argmax(np.mean([np.array(m.values) ** 2 for m in test.modes], axis=0)))
    sound = correlate(test, case)
    assert all(p.decided and p.computed == p.measured and p.mac > 0.99 for p in sound.pairs)
    assert min(s.comac for s in sound.sensors) > 0.9
    turned = correlate(spoilt(test, signal, -1.0), case).sensors
    assert max(turned, key=lambda s: s.ecomac).signal == f"{signal}:1"
    broken = correlate(spoilt(test, signal, 0.0, 0.3), case)
    assert min(broken.sensors, key=lambda s: s.comac).signal == f"{signal}:1"
    assert f"agree least are {signal}:1" in broken.sentences()[-1]


def test_both_of_a_doublet_are_a_plane() -> None:
    """Whatever two shapes of the plane were measured: in the AutoMAC, and against the case."""
    test, case = drawn_test(generator("plane"))
    mode = next(m for m in case.modes if m.label == Label(2, 0))
    plane = case.signals(mode, test.sensors)
    pair = [
        ShapeOfMode(c=2, m=0, kind=None, member=str(k), frequency_Hz=80, values=u.tolist())
        for k, u in ((1, plane @ [1.0, 0.2]), (2, plane @ [0.5, 1.0]))
    ]
    both = test.model_copy(update={"modes": pair})
    entry = auto_mac(both)
    assert entry["modes"] == ["[2,0]"] and entry["auto_mac"] == [[1.0]]
    pairs = correlate(both, case).pairs
    assert [p.plane_mac for p in pairs] == pytest.approx([1.0, 1.0])
    words = auto_mac_words(auto_mac(test))
    assert words.startswith("run1.uff: largest AutoMAC of two modes 0.") and "0.15)" in words


def test_shapes_come_back_from_their_file(tmp_path: Path) -> None:
    """Only whole ones: a signal without a value is refused, and a test without modes."""
    test, _ = drawn_test(generator("file"))
    measured = tmp_path / "measured.csv"
    assert read_shapes(measured) == []
    shapes_path(measured).write_text(shapes_text([test]))
    assert read_shapes(measured) == [test]
    content = json.loads(shapes_text([test]))
    content["tests"][0]["modes"][0]["values"].pop()
    for tests in (content["tests"], [test.model_dump() | {"modes": []}]):
        shapes_path(measured).write_text(json.dumps({"format": 1, "tests": tests}))
        with pytest.raises(InputError, match=r"at_sensors\.json: is no file of measured shapes"):
            read_shapes(measured)


def on_rings(shares: Sequence[float], directions: str) -> tuple[Sensors, np.ndarray]:
    """Sixteen sensors on each ring of the main tyre, at shares of the tread's half width; and their
    nodes."""
    R, Z = shape_of(modes()[0]).points.T
    width = np.abs(Z[0.95 * R.max() < R]).max()
    nodes = [int(np.argmax(R - 5 * abs(Z - share * width))) for share in shares]
    rows = [
        (node, 2 * np.pi * k / 16, "rtz".index(d))
        for node in nodes
        for k in range(16)
        for d in directions
    ]
    points = np.array([[R[node], turn, Z[node]] for node, turn, _ in rows])
    sensors = Sensors(points, np.eye(3)[[d for *_, d in rows]])
    return sensors, np.array([node for node, *_ in rows])


@pytest.mark.parametrize(("shares", "directions"), [((0.0, 0.8), "rtz"), ((0.5, 0.9), "r")])
def test_a_shape_is_likeliest_for_its_own_mode(shares: tuple[float, ...], directions: str) -> None:
    """With 3 % noise, of all modes that the sensors see; and likelier than a random shape."""
    sensors, nodes = on_rings(shares, directions)
    rng, case = generator("case"), CaseModes(modes())
    seen = [mode for mode in modes() if case.is_seen(mode, sensors)]
    shapes = [real_part(measured(mode, sensors, nodes, rng, 0.03))[0] for mode in seen]
    odds = ln_shape_odds(case, sensors, np.array(shapes).T)
    own = odds[range(len(seen)), [modes().index(mode) for mode in seen]]
    assert own == pytest.approx(odds.max(1)) and own.min() > 5


def test_modes_that_sensors_cannot_distinguish_are_as_likely() -> None:
    """On a radial ring away from the crown [c,0] and [c,1] look alike: small errors of the case's
    shapes must not decide."""
    sensors, nodes = on_rings((0.8,), "r")
    labels, case = [mode.label for mode in modes()], CaseModes(modes())
    mode = modes()[labels.index(Label(3, 1))]
    shape = real_part(measured(mode, sensors, nodes, generator("alike"), 0.03))[0]
    (odds,) = ln_shape_odds(case, sensors, shape[:, None])
    assert odds[labels.index(Label(3, 0))] == odds[labels.index(Label(3, 1))] == odds.max() > 5


@pytest.mark.parametrize("kind", ["axial", "torsional"])
def test_a_shape_that_sensors_hardly_see_is_no_evidence(kind: str) -> None:
    """Radial sensors see a hundredth of [0,0], mostly what is mixed into it, here a tenth of the
    other mode. So [0,0] lateral and torsional are as likely."""
    sensors, nodes = on_rings((-0.8, 0.1, 0.9), "r")
    both = {k: modes()[[m.label for m in modes()].index(Label(0, 0, k))] for k in KINDS}
    other = both[KINDS[kind == KINDS[0]]]
    own, mixed = (np.asarray(shape_of(each).amplitude) for each in (both[kind], other))
    u = (own + 0.1 * mixed * np.linalg.norm(own) / np.linalg.norm(mixed))[nodes, 0].real
    u = u + 0.03 * np.sqrt(np.mean(u**2)) * generator("weak").standard_normal(len(u))
    (odds,) = ln_shape_odds(CaseModes(modes()), sensors, u[:, None])
    assert odds[modes().index(both[kind])] == odds[modes().index(other)] == odds.max()


def test_errors_of_places_matter_where_a_motion_is_small_and_steep() -> None:
    """Near the crown [3,1], antisymmetric, changes its sign, and [3,0] hardly changes."""
    sensors, case = on_rings((0.15,), "r")[0], CaseModes(modes())
    noise = {mode.label: case.noise_by_place(mode, sensors) for mode in modes()}
    assert noise[Label(3, 0)] < 1e-3 and noise[Label(3, 1)] > 5 * noise[Label(3, 0)]


def test_a_random_shape_is_like_a_mode_by_chance_alone(chance: Chance) -> None:
    """The odds are a ratio of densities: a random shape has odds of 10 for a mode in at most one of
    10 cases. Of any size: size is no evidence. False failures: 1e-7."""
    sensors, _ = on_rings((0.0,), "r")
    shapes = chance.random.standard_normal((len(sensors.points), 300))
    odds = ln_shape_odds(CaseModes(modes()), sensors, shapes)
    assert ln_shape_odds(CaseModes(modes()), sensors, 1e3 * shapes) == pytest.approx(odds)
    assert odds.min() >= log(SPOILT) - 1e-9
    chance.often(odds[:, 3] > log(10), 0.0, 0.1)


def test_a_belt_is_as_wide_as_the_cases() -> None:
    assert CaseModes(modes()).half_width == pytest.approx(0.095, abs=0.003)


def test_a_sensor_off_the_tyre_is_refused() -> None:
    sensors, _ = on_rings((0.0,), "r")
    larger = Sensors(sensors.points + np.array([0.05, 0.0, 0.0]), sensors.directions)
    with pytest.raises(InputError, match="is 50 mm off the case's tyre"):
        ln_shape_odds(CaseModes(modes()), larger, np.ones((len(larger.points), 1)))
