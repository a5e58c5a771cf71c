"""Measured shapes and the modes of a case."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.case_modes import CaseModes
from tyrecal.measured.sensors import Sensors, real_part
from tyrecal.measured.shape_likelihood import SPOILT, ln_shape_odds
from tyrecal.simulate.modes.label import Label

from ..chance import Chance, generator
from .tyres import measured, modes, shape_of

pytestmark = pytest.mark.numbers


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
