"""The modes of a case, which help to find the labels of measured shapes; ``labels`` calls this.

A mode's shape at the sensors is most of the covariance of its label, and its frequency a part of
the label's prior. A case that is not calibrated has errors: `FREQUENCY_OFF` of its frequencies, and
`SHAPE_OFF` of its shapes, which is the weight of the label's covariance without a case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, log
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import KDTree

from ..errors import InputError
from ..simulate.evaluate.results import HarmonicShape
from ..simulate.modes.label import BELT, Label, Mode, labelled
from .covariance import MIN_SEEN
from .sensors import Sensors

if TYPE_CHECKING:
    from ..simulate.evaluate.evaluator import Evaluator
    from ..tyre.case import LoadedCase

Array = np.ndarray

FREQUENCY_OFF = 0.15  # standard deviation of ln frequency
SHAPE_OFF = 0.05  # mean square error of a shape of the case over its mean square
MAX_OFF_TYRE = 0.03  # m, largest distance of a sensor from the case's tyre
PER_HARMONIC = 4  # modes evaluated of each harmonic c: m = 0 to 3


@dataclass(frozen=True)
class CaseModes:
    """Frequencies and shapes of the labels that a case has."""

    modes: Sequence[Mode]  # with harmonic shapes, the lowest mode of each label

    @property
    def half_width(self) -> float:
        """Half the width of the belt, m: the largest |Z| where R > `BELT` times the largest R."""
        R, Z = self.points.T
        return float(np.abs(Z[R / R.max() > BELT]).max())

    def covariance(self, label: Label, sensors: Sensors, S: Array) -> Array:
        """Covariance (k, k) of the signals of k sensors for a label; the mean of its diagonal is 1.

        S (k, k): the covariance without a case. Raises InputError if a sensor is not on the tyre.
        """
        mode = self._by_label.get(label)
        if mode is None:
            return S
        u = self.signals(mode, sensors)
        whole = float(np.sum(u**2)) / len(u)
        return (u @ u.T / whole + SHAPE_OFF * S) / (1 + SHAPE_OFF) if whole else S

    def likelihood(self, label: Label, frequency_Hz: float) -> float:
        """Likelihood of a frequency for a label, at most 1. A label that the case does not have is
        expected above the case's modes of the same c."""
        mode = self._by_label.get(label)
        above = [each.frequency_Hz for each in self.modes if each.label.c == label.c]
        expected = mode.frequency_Hz if mode else max(above, default=frequency_Hz)
        off = log(frequency_Hz / expected) / FREQUENCY_OFF
        return 1.0 if mode is None and off > 0 else exp(-0.5 * off**2)

    def expected_Hz(self, label: Label | None) -> float | None:
        """The case's frequency of a label, None if it has none."""
        mode = self._by_label.get(label) if label else None
        return mode.frequency_Hz if mode else None

    @cached_property
    def _by_label(self) -> dict[Label, Mode]:
        return {mode.label: mode for mode in self.modes}

    @property
    def points(self) -> Array:
        """Nodes of the section, (n, 2): R, Z, m."""
        return _shape(self.modes[0]).points

    def signals(self, mode: Mode, sensors: Sensors) -> Array:
        """Motions along the sensors' directions in both modes of a doublet, (k, 2); for c = 0 in
        one, (k, 1). Both have components r, theta, z.

        Raises InputError if a sensor is not on the tyre.
        """
        R, angle, Z = sensors.points.T
        distance, node = KDTree(self.points).query(np.column_stack([R, Z]))
        if distance.max() > MAX_OFF_TYRE:
            k = int(np.argmax(distance))
            raise InputError(
                f"a sensor at R {1e3 * R[k]:.0f} mm, Z {1e3 * Z[k]:.0f} mm is"
                f" {1e3 * distance[k]:.0f} mm off the case's tyre; at most"
                f" {1e3 * MAX_OFF_TYRE:.0f} mm are right: another size, or another --centre"
            )
        shape = _shape(mode)
        turned = shape.amplitude[node] * np.exp(1j * shape.n * angle)[:, None]
        u = np.sum(turned * sensors.directions, axis=1)
        return np.column_stack([u.real, u.imag] if shape.n else [u.real])

    def is_seen(self, mode: Mode, sensors: Sensors) -> bool:
        """Whether the mean square of a mode's signals at the sensors is at least `MIN_SEEN` of that
        of its motion in each direction over the section. Raises InputError as `signals` does."""
        u, amplitude = self.signals(mode, sensors), _shape(mode).amplitude
        return bool(np.sum(u**2) / len(u) >= MIN_SEEN * np.mean(np.abs(amplitude) ** 2))


def evaluate_case_modes(
    case: LoadedCase, evaluator: Evaluator, values: dict[str, float], highest: int
) -> CaseModes:
    """The modes of a case with variables ``values``, up to ``highest`` waves.

    Raises InputError where its modes are no harmonic shapes; EvaluationFailed; DeckRefused.
    """
    from ..simulate.deck.tyre_design import TyreDesign
    from ..simulate.evaluate.evaluator import Question

    case.kind.require_section(
        f"{case.path}: its shapes belong to a deck in three dimensions, which is not supported"
    )
    analysis = case.case.analysis.model_copy(update={"highest_harmonic": highest})
    wide = replace(case, case=case.case.model_copy(update={"analysis": analysis}))
    count = max(case.case.analysis.modes_per_harmonic, PER_HARMONIC)
    answer = evaluator.of(TyreDesign(wide)).evaluate(Question(values, (), count))
    modes = labelled(answer)
    if not all(isinstance(mode.raw.shape, HarmonicShape) for mode in modes):
        raise InputError(
            f"solver '{evaluator.solver.name}' gives no shape for each number of waves; label"
            " universal files with --solver bundled"
        )
    return CaseModes(modes)


def _shape(mode: Mode) -> HarmonicShape:
    assert isinstance(mode.raw.shape, HarmonicShape)
    return mode.raw.shape
