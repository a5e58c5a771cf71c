"""The modes of a case at sensors, and how probable the shape of a measured mode is for each.

A mode's shape at the sensors is most of the covariance of its signals. A case that is not
calibrated has errors in its shapes, and sensors are not quite where they are noted. Both are in
proportion to the mode's motion over the whole section, of which the sensors may see little: then
errors are most of what they see, and the shape is no evidence.

`studies/labelling` weighs shapes together with all frequencies. A measured shape u (k,) has the
density of `labels.ln_density`, S being the covariance of the case's mode on these sensors: of a
doublet a plane. One shape in 50 (`SPOILT`), and half of those that the sensors hardly see, are like
no mode: two modes mixed, or noise alone. With S = I, a random shape,

    L = ln(((1 - e) p(u | S) + e p(u | I)) / p(u | I)),    e = SPOILT or 1/2

is the ln of the odds of the mode against a frequency that is no mode of the tyre. Modes that these
sensors cannot distinguish (`labels.groups_alike`) share their mean density, because what differs
there are the errors of the model's shapes. So all modes of a harmonic get the largest of their
errors by the sensors' places: a mode that is small and steep at them is refuted by no clean shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import KDTree

from ..errors import InputError
from ..simulate.evaluate.results import HarmonicShape
from ..simulate.modes.label import BELT, Mode, labelled
from .covariance import MIN_SEEN, label_covariances
from .labels import groups_alike, label_of_column, ln_density
from .sensors import Sensors

if TYPE_CHECKING:
    from ..simulate.evaluate.evaluator import Evaluator
    from ..tyre.case import LoadedCase

Array = np.ndarray


# mean square error of a shape of the case over its mean square: weight of its label's covariance
# without a case; assumed
SHAPE_OFF = 0.05
PLACE_OFF_m = 0.003  # standard deviation of a sensor's place, by judgement
NEIGHBOURS = 12  # nodes about a sensor, by which a motion's slope over the section is judged
SAME_PLACE_m = 1e-9  # nodes that are nearer to each other are one
MAX_OFF_TYRE = 0.03  # m, largest distance of a sensor from the nearest node in R, Z
PER_HARMONIC = 4  # modes evaluated of each harmonic c: m = 0 to 3


@dataclass(frozen=True)
class CaseModes:
    """Frequencies and shapes of a case's modes."""

    modes: Sequence[Mode]  # with harmonic shapes, the lowest mode of each label

    @property
    def half_width(self) -> float:
        """Half the width of the belt, m: the largest |Z| where R > `BELT` times the largest R."""
        R, Z = self.points.T
        return float(np.abs(Z[R / R.max() > BELT]).max())

    def covariance(self, mode: Mode, sensors: Sensors, S: Array) -> Array:
        """Covariance (k, k) of the signals of k sensors for a mode; the mean of its diagonal is 1.

        S (k, k): that of its label without a case. Raises InputError if a sensor is not on the
        tyre.
        """
        u = self.signals(mode, sensors)
        off = self._shape_error(mode, u)
        return (u @ u.T + off * S) / (np.sum(u**2) / len(u) + off)

    def _shape_error(self, mode: Mode, u: Array) -> float:
        """Mean square error of `signals` u by the case's shape, modes of a doublet together."""
        return SHAPE_OFF * max(float(np.sum(u**2)) / len(u), _mean_square(mode))

    @property
    def points(self) -> Array:
        """Nodes of the section, (n, 2): R, Z, m."""
        return _shape(self.modes[0]).points

    def signals(self, mode: Mode, sensors: Sensors) -> Array:
        """Motions along the sensors' directions in both modes of a doublet, (k, 2): real and
        imaginary part of amplitude exp(i c Theta), in components r, theta, z as the directions;
        for c = 0 in one, (k, 1).

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

    def noise_by_place(self, mode: Mode, sensors: Sensors) -> float:
        """Variance of the signals over that of `covariance`, because a sensor's place is not quite
        the noted one, nor that of the nearest node."""
        R, _, Z = sensors.points.T
        count = min(NEIGHBOURS, len(self.points))
        distance, nodes = KDTree(self.points).query(np.column_stack([R, Z]), count)
        # (k, n): motion of n nodes, the nearest first, along a sensor's direction
        near = np.einsum("kni,ki->kn", _shape(mode).amplitude[nodes], sensors.directions)
        apart = np.linalg.norm(self.points[nodes[:, 1:]] - self.points[nodes[:, :1]], axis=2)
        # nodes in the same place move alike
        slopes = np.abs(near[:, 1:] - near[:, :1]) / np.maximum(apart, SAME_PLACE_m)
        steepest = np.max(slopes, axis=1)
        off = np.mean((steepest * np.hypot(PLACE_OFF_m, distance[:, 0])) ** 2)
        u = self.signals(mode, sensors)
        return float(off / (np.sum(u**2) / len(u) + self._shape_error(mode, u)))

    def is_seen(self, mode: Mode, sensors: Sensors) -> bool:
        """Whether the mean square of a mode's signals at the sensors is at least `MIN_SEEN` of that
        of its motion in each direction over the section. Raises InputError as `signals` does."""
        u = self.signals(mode, sensors)
        return bool(np.sum(u**2) / len(u) >= MIN_SEEN * _mean_square(mode))


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
    require_harmonic_shapes(modes, evaluator.solver.name)
    return CaseModes(modes)


def require_harmonic_shapes(modes: Sequence[Mode], solver: str) -> None:
    """Raises InputError where modes have no shape for each number of waves."""
    if not all(isinstance(mode.raw.shape, HarmonicShape) for mode in modes):
        raise InputError(
            f"solver '{solver}' gives no shape for each number of waves; compare measured shapes"
            " with --solver bundled"
        )


def _mean_square(mode: Mode) -> float:
    """Mean over nodes and components of a mode's squared motion, both modes of a doublet added."""
    return float(np.mean(np.abs(_shape(mode).amplitude) ** 2))


def _shape(mode: Mode) -> HarmonicShape:
    assert isinstance(mode.raw.shape, HarmonicShape)
    return mode.raw.shape


SPOILT = 0.02  # share of shapes that are like no mode


def ln_shape_odds(case: CaseModes, sensors: Sensors, shapes: Array) -> Array:
    """L (n, m) of n real shapes (k, n) for the m modes of a case.

    Raises InputError where a sensor is not on the case's tyre.
    """
    k, highest = len(shapes), max(mode.label.c for mode in case.modes)
    general = {
        label_of_column(c, column): S
        for c, column, S, _ in label_covariances(sensors, highest, case.half_width)
    }
    covariance, noise = [], dict[int, float]()
    for mode in case.modes:
        c, off = mode.label.c, case.noise_by_place(mode, sensors)
        noise[c] = max(off, noise.get(c, 0.0))
    for mode in case.modes:
        # a label without a covariance, such as m = 4, has the mean of its c
        same_c = [S for label, S in general.items() if label.c == mode.label.c]
        S = general[mode.label] if mode.label in general else np.mean(same_c, axis=0)
        off = noise[mode.label.c]
        covariance.append((case.covariance(mode, sensors, S) + off * np.eye(k)) / (1 + off))
    spectra = [np.linalg.eigh(S) for S in covariance]
    by_chance = ln_density(np.ones(k), np.eye(k), shapes)
    odds = np.array([ln_density(*spectrum, shapes) for spectrum in spectra]).T - by_chance[:, None]
    groups = groups_alike(covariance, spectra)
    for row in odds:
        group = groups[int(np.argmax(row))]
        row[group] = np.logaddexp.reduce(row[group]) - np.log(len(group))
    spoilt = np.array([SPOILT if case.is_seen(mode, sensors) else 0.5 for mode in case.modes])
    return np.logaddexp(np.log(1 - spoilt) + odds, np.log(spoilt))
