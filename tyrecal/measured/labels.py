"""Labels [c, m] of measured shapes: the probability of each label on the given sensors.

The signals u (k,) of a mode are normal about 0,

    u ~ N(0, s^2 (S + nu I)),

S (k, k): the covariance of a label with a mean diagonal of 1 (``covariance``), nu: variance of the
noise, over a grid; s: any size, p(s) ~ 1/s:

    ln p(u | label, nu) = -1/2 ln|S + nu I| - k/2 ln(u^T (S + nu I)^-1 u) + constant

A label's probability is its share of the sum of prior p(u | label). The prior contains that [c,m+2]
is above [c,m]: it is small for [c,m+2] if [c,m] was not found below it. Labels that these sensors
cannot distinguish share their probability by their priors alone, because there the shape has no
information about the order. A label whose own motions have less than `MIN_SEEN` of the mean square
of all motions on these sensors is not seen, and never given. A column is the index of an order m
among those of a harmonic (``covariance``): m itself from 0 to 3, on c = 0 also AXIAL_COLUMN, 4, of
[0,0] axial. BELT is the radius, over the largest one, from which a sensor is on the belt;
HALF_WIDTHS are half widths of narrow and wide belts over it. With a case, `studies/labelling`
judges shapes and frequencies together instead.

``modal`` judges the shapes of a file with it, lowest frequency first. `Labeller.looks_like` draws
shapes and judges them the same way, so it says what an import will do.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ..simulate.modes.label import AXIAL_COLUMN, BELT, MAX_SAMPLED_HARMONIC, Label
from .covariance import HALF_WIDTHS, MIN_SEEN, label_covariances
from .sensors import Sensors

Array = np.ndarray

MIN_LABEL_PROBABILITY = 0.9  # probability from which a label is given
MIN_LN_ODDS = 5.0  # expected ln of the odds below which sensors do not distinguish two labels
ODDS_NOISE = 0.02  # nu for that expectation
NOISE_VARIANCES = (1e-4, 1e-3, 1e-2, 5e-2, 0.2)  # nu, over the mean variance of a label's signals
WITHOUT_LOWER = 0.02  # prior of [c,m+2] without [c,m] below it, over that with it
SHAPES_DRAWN, DRAWN_NOISE = 64, 0.01  # shapes drawn of each label, and their nu
MIN_LABELLED = 0.9  # share of a label's shapes that must get it, for the sensors to recognise it
MIN_TAKEN = 0.03  # mean probability from which a rival label is listed


@dataclass(frozen=True)
class Judged:
    """How a shape was judged."""

    label: Label | None  # the most probable one; None if it is too uncertain
    probabilities: dict[Label, float]  # of all labels, the largest first
    why: str = ""  # reason, in a sentence, if there is no label

    @property
    def confidence(self) -> float:
        """Probability of the most probable label, 0 where none was looked for."""
        return next(iter(self.probabilities.values()), 0.0)


class Labeller:
    """Finds the label of shapes on one layout of sensors, and its probability.

    highest: the largest c that is possible in the measured band; fewer leave less to confuse.
    """

    def __init__(self, sensors: Sensors, highest: int = MAX_SAMPLED_HARMONIC):
        self.sensors = sensors
        every = label_covariances(sensors, highest)
        self.labels = [label_of_column(c, column) for c, column, *_ in every]
        self.covariance = [S for *_, S, _ in every]
        self.is_seen = np.array([seen >= MIN_SEEN for *_, seen in every])
        self._spectra = [np.linalg.eigh(S) for S in self.covariance]  # eigenvalues, -vectors
        self._groups = groups_alike(self.covariance, self._spectra)

    def judge(self, shape: Array, below: Collection[Label] = ()) -> Judged:
        """The label of a real shape (k,), a signal each, with its probability.

        below: labels found in the same file at lower frequencies.
        """
        p = self._probabilities(shape[:, None], below)[:, 0]
        order = np.argsort(-p, kind="stable")
        first = order[0]
        probabilities = {self.labels[i]: float(p[i]) for i in order}
        if p[first] < MIN_LABEL_PROBABILITY:
            return Judged(None, probabilities, self._why(p, order))
        if not self.is_seen[first]:
            why = f"the sensors hardly see {self.labels[first].display}: {_missing(self.sensors)}"
            return Judged(None, probabilities, why)
        return Judged(self.labels[first], probabilities)

    def _probabilities(self, shapes: Array, below: Collection[Label] = ()) -> Array:
        """Probability of each label for shapes (k, n): (labels, n)."""
        evidence = np.array([ln_density(*spectrum, shapes) for spectrum in self._spectra])
        prior = self._prior(below)
        p = np.exp(evidence - evidence.max(0)) * prior[:, None]
        p /= p.sum(0)
        for n, first in enumerate(np.argmax(p, axis=0)):
            group = self._groups[first]
            p[group, n] = p[group, n].sum() * prior[group] / prior[group].sum()
        return p

    def ln_evidence(self, shape: Array) -> float:
        """ln of the mean probability density of a real shape (k,) over all labels, but for a
        constant: comparable between assumptions on which way the sensors of one shape point."""
        each = [ln_density(*spectrum, shape[:, None])[0] for spectrum in self._spectra]
        return float(np.logaddexp.reduce(each) - np.log(len(each)))

    def _prior(self, below: Collection[Label]) -> Array:
        """Prior (labels,), not normalised, given the labels ``below`` in the same file."""
        lower_labels = [_lower(label) for label in self.labels]
        expected = (None, *below)
        return np.array([1.0 if lower in expected else WITHOUT_LOWER for lower in lower_labels])

    def looks_like(self) -> dict[Label, list[Label]]:
        """For each label the other labels that its shapes look like on these sensors, the likeliest
        first; none where at least `MIN_LABELLED` of the shapes drawn of it get it, in a file in
        which the mode that has to be below it was found."""
        k, random = len(self.sensors.points), np.random.default_rng(0)
        result: dict[Label, list[Label]] = {}
        for i, (values, vectors) in enumerate(self._spectra):
            parts = random.standard_normal((k, SHAPES_DRAWN))
            size = np.sqrt(np.maximum(values, 0.0) + DRAWN_NOISE)
            lower = _lower(self.labels[i])
            below = [lower] if lower else []
            p = self._probabilities(vectors @ (size[:, None] * parts), below)
            rivals = p.mean(1)
            rivals[i] = 0.0
            order = [int(j) for j in np.argsort(-rivals) if rivals[j] > MIN_TAKEN]
            is_recognised = (
                self.is_seen[i] and np.mean(p[i] >= MIN_LABEL_PROBABILITY) >= MIN_LABELLED
            )
            order = order or [int(np.argmax(rivals))]
            result[self.labels[i]] = [] if is_recognised else [self.labels[j] for j in order]
        return result

    def _why(self, p: Array, order: Array) -> str:
        """Why no label is likely: c is open, or its order m. p: probabilities, order: sorted."""
        c = np.array([label.c for label in self.labels])
        first = order[0]
        others = order[c[order] != c[first]]
        open_waves = len(others) and p[c == c[first]].sum() < MIN_LABEL_PROBABILITY
        second = others[0] if open_waves else order[1]
        a, b = self.labels[first], self.labels[second]
        if second not in self._groups[first] and first not in self._groups[second]:
            return f"the shape is between {a.display} and {b.display}: noise, or two modes mixed"
        if a.c != b.c:
            angles = np.round(np.degrees(self.sensors.points[:, 1])) % 360
            count = len(np.unique(angles))
            return (
                f"aliasing: sensors at {count} angle{'s' * (count > 1)}, spaced as they are, let"
                f" {min(a.c, b.c)} and {max(a.c, b.c)} waves look alike"
            )
        return f"sensors let {a.display} and {b.display} look alike: {_missing(self.sensors)}"


def groups_alike(
    covariance: Sequence[Array], spectra: Sequence[tuple[Array, Array]]
) -> list[Array]:
    """For each covariance, with its eigenvalues and -vectors, those that look like it: the expected
    ln of the odds of i against j on i's own shapes is less than `MIN_LN_ODDS`,

    (tr(Sj^-1 Si) - k + ln|Sj| - ln|Si|) / 2.
    """
    k = len(covariance[0])
    noise = ODDS_NOISE * np.eye(k)
    odds = np.zeros((len(covariance), len(covariance)))
    sizes = np.array([np.log(np.maximum(v, 0.0) + ODDS_NOISE).sum() for v, _ in spectra])
    for j, rival in enumerate(covariance):
        inverse = np.linalg.inv(rival + noise)
        trace = [np.vdot(inverse, S) + ODDS_NOISE * np.trace(inverse) for S in covariance]
        odds[:, j] = (np.array(trace) - k + sizes[j] - sizes) / 2
    return [np.flatnonzero(row < MIN_LN_ODDS) for row in odds]


def ln_density(values: Array, vectors: Array, shapes: Array) -> Array:
    """ln of the mean over nu of p(u | label, nu), but for a constant, (n,), of shapes (k, n).
    values (k,), vectors (k, k): of S."""
    v = np.maximum(values, 0.0) + np.array(NOISE_VARIANCES)[:, None]
    square = np.maximum((1 / v) @ (vectors.T @ shapes) ** 2, 1e-300)
    each = -0.5 * np.log(v).sum(1)[:, None] - 0.5 * len(values) * np.log(square)
    return np.asarray(np.logaddexp.reduce(each))


def label_of_column(c: int, column: int) -> Label:
    """The label of an order: column m, and on c = 0 the two modes [0,0]."""
    if c == 0 and column in (0, AXIAL_COLUMN):
        return Label(0, 0, "axial" if column == AXIAL_COLUMN else "torsional")
    return Label(c, column)


def _lower(label: Label) -> Label | None:
    """The lower mode that a mode with bending of the belt implies: of the same c, even or odd
    about the mid-plane like it. Every tyre has it."""
    if label.m < 2 and not (label.c == 0 and label.m == 1):
        return None
    if label.c == 0:
        return Label(0, 0, "axial" if label.m % 2 else "torsional")
    return Label(label.c, label.m - 2)


def _missing(sensors: Sensors) -> str:
    """Measurements that a layout lacks to distinguish orders."""
    names = ("radial", "tangential", "axial")
    R, _, Z = sensors.points.T
    belt = R / R.max() > BELT
    measured = np.any(np.abs(sensors.directions[belt]) > 0.5, axis=0)
    lacking = [name for name, seen in zip(names, measured, strict=True) if not seen]
    if lacking:
        return f"nothing {' or '.join(lacking)} was measured on the tread"
    if np.ptp(Z[belt]) < HALF_WIDTHS[0] * R.max():
        return "they are not on both edges of the tread"
    return "there are too few on the tread"
