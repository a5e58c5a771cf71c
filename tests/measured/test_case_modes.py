"""A case's modes in the labels of measured shapes."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.case_modes import CaseModes
from tyrecal.measured.labels import Labeller
from tyrecal.measured.modal import label_in_turn
from tyrecal.measured.sensors import MeasuredMode, Sensors
from tyrecal.simulate.modes.label import Label

from ..chance import generator
from .tyres import HIGHEST, measured, modes, shape_of

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


@pytest.mark.parametrize(("shares", "directions"), [((0.8,), "rtz"), ((0.5, 0.9), "r")])
def test_a_case_labels_what_sensors_alone_do_not(
    shares: tuple[float, ...], directions: str
) -> None:
    """No label is wrong, and at least five more of the fourteen are given, with frequencies 8 %
    above the case's and 3 % noise."""
    sensors, nodes = on_rings(shares, directions)
    rng = generator("case")
    ordered = sorted(modes(), key=lambda mode: mode.frequency_Hz)
    shapes = [measured(mode, sensors, nodes, rng, 0.03) for mode in ordered]
    right = []
    for case in (None, CaseModes(modes())):
        labeller = Labeller(sensors, HIGHEST, case)
        pairs = zip(ordered, shapes, strict=True)
        every = [(MeasuredMode(1.08 * m.frequency_Hz, u), labeller, "") for m, u in pairs]
        labels = [each.judged.label for each in label_in_turn(every)]
        true = [mode.label for mode in ordered]
        assert all(label in (None, own) for label, own in zip(labels, true, strict=True))
        right.append(sum(label is not None for label in labels))
    assert right[1] >= right[0] + 5


def test_a_belt_mode_far_below_the_cases_is_improbable() -> None:
    """A label that the case lacks is above the case's modes of that c."""
    case = CaseModes(modes())
    lateral = next(mode for mode in modes() if mode.label == Label(0, 0, "axial"))
    hertz = lateral.frequency_Hz
    assert case.likelihood(lateral.label, hertz) == 1
    assert case.likelihood(lateral.label, hertz * exp(0.15)) == pytest.approx(exp(-0.5))
    highest = max(mode.frequency_Hz for mode in modes() if mode.label.c == 2)
    assert case.likelihood(Label(2, 2), 3 * highest) == 1
    assert case.likelihood(Label(2, 2), 0.5 * highest) < 1e-4


def test_a_belt_is_as_wide_as_the_cases() -> None:
    assert CaseModes(modes()).half_width == pytest.approx(0.095, abs=0.003)


def test_a_sensor_off_the_tyre_is_refused() -> None:
    sensors, _ = on_rings((0.0,), "r")
    larger = Sensors(sensors.points + np.array([0.05, 0.0, 0.0]), sensors.directions)
    with pytest.raises(InputError, match="is 50 mm off the case's tyre"):
        Labeller(larger, 2, CaseModes(modes()))
