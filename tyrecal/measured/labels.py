"""Labels [c, m] of measured shapes: the probability of each label on the sensors at hand.

A label says which motions are large: on the belt those of its order (``modes.label``: r P_m,
theta P_m, z P_m-1, cosines and sines of c Theta), on the sidewalls those that are symmetric about
the middle plane for even m, antisymmetric for odd m. The others are small, not absent. So the
signals u (k,) of a mode are normal about 0,

    u ~ N(0, s^2 (S + nu I)),    S = B diag(v) B^T,

B (k, terms): the motions at the sensors in their directions, v: their variances under the label,
nu: noise, over a grid, s: any size, p(s) ~ 1/s:

    ln p(u | label, nu) = -1/2 ln|S + nu I| - k/2 ln(u^T (S + nu I)^-1 u) + constant

and labels are judged by their shares of the sum of p(u | label). Two labels whose S are alike on
these sensors share the probability between them, whatever was measured: aliasing needs no rule.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from ..simulate.modes.label import (
    AXIAL_COLUMN,
    BELT,
    COLUMNS,
    DEGREE,
    HIGHEST_HARMONIC,
    PARITY,
    Label,
)
from .sensors import Sensors

Array = np.ndarray

MIN_LABEL_PROBABILITY = 0.9  # probability that a label needs to be told
MIN_LN_ODDS = 4.0  # expected logarithm of the odds below which sensors cannot tell two labels apart
SAME_PARITY, OTHER_PARITY = 0.03, 0.01  # variance of motions that are not the label's, of 1
OTHER_WAVES = 0.001  # likewise, of motions with another c: tyres are not uniform
SIDEWALL = 0.5  # variance of the sidewalls' motion; belts stand out, but sidewalls bulge
NOISE_VARIANCES = (1e-4, 1e-3, 1e-2, 5e-2, 0.2)  # variance, of the mean signal's
MIN_HALF_WIDTH = 0.2  # a belt's half width is at least this share of its radius
HEIGHTS = 2  # highest polynomial over a sidewall's height


@dataclass(frozen=True)
class Judged:
    """How a shape was judged."""

    label: Label | None  # the most probable one, None where it is not told
    probabilities: dict[Label, float]  # of all labels, the largest first
    why: str = ""  # it is not told, in a sentence

    @property
    def confidence(self) -> float:
        """Probability of the most probable label."""
        return next(iter(self.probabilities.values()))


class Labeller:
    """Judges shapes on one layout of sensors.

    highest: the largest c that is possible in the measured band; fewer leave less to confuse.
    """

    def __init__(self, sensors: Sensors, highest: int = HIGHEST_HARMONIC):
        self.sensors = sensors
        basis = [_motions(sensors, c) for c in range(highest + 1)]
        others = sum(B @ B.T for B in basis) / len(basis)
        self.labels, self.covariance = [], []
        for c, B in enumerate(basis):
            for column in range(5 if c == 0 else 4):
                v = np.tile(_variances(c, column), 1 if c == 0 else 2)
                S = (B * v) @ B.T + OTHER_WAVES * others
                self.labels.append(_label(c, column))
                self.covariance.append(S / np.trace(S) * len(S))
        self._spectra = [np.linalg.eigh(S) for S in self.covariance]

    def judge(self, shape: Array) -> Judged:
        """The label of a real shape (k,), a signal each, with its probability."""
        evidence = np.array(
            [self._evidence(values, vectors.T @ shape) for values, vectors in self._spectra]
        )
        p = np.exp(evidence - evidence.max())
        p /= p.sum()
        order = np.argsort(-p, kind="stable")
        probabilities = {self.labels[i]: float(p[i]) for i in order}
        if p[order[0]] >= MIN_LABEL_PROBABILITY:
            return Judged(self.labels[order[0]], probabilities)
        return Judged(None, probabilities, self._why(p, order))

    def _evidence(self, values: Array, parts: Array) -> float:
        """ln of the mean over nu of p(u | label, nu). values (k,), parts (k,): of S, of u."""
        v = np.maximum(values, 0.0) + np.array(NOISE_VARIANCES)[:, None]
        square = np.sum(parts**2 / v, axis=1)
        each = -0.5 * np.log(v).sum(1) - 0.5 * len(parts) * np.log(np.maximum(square, 1e-300))
        return float(np.logaddexp.reduce(each))

    def ln_evidence(self, shape: Array) -> float:
        """ln of the mean probability density of a real shape (k,) over all labels, but for a
        constant: comparable between readings of one shape's directions."""
        each = [self._evidence(values, vectors.T @ shape) for values, vectors in self._spectra]
        return float(np.logaddexp.reduce(each) - np.log(len(each)))

    def odds(self, i: int, j: int, nu: float = 1e-2) -> float:
        """Expected ln of the odds of label i against j on its own shapes, at noise nu:
        (tr(Sj^-1 Si) - k + ln|Sj| - ln|Si|) / 2."""
        k = len(self.covariance[i])
        Si, Sj = (self.covariance[n] + nu * np.eye(k) for n in (i, j))
        change = np.linalg.slogdet(Sj)[1] - np.linalg.slogdet(Si)[1]
        return float(np.trace(np.linalg.solve(Sj, Si)) - k + change) / 2

    def told_apart(self) -> dict[Label, list[Label]]:
        """Of each label the other ones that these sensors cannot tell from it, whatever noise."""
        every = range(len(self.labels))
        odds = [[self.odds(i, j) if i != j else np.inf for j in every] for i in every]
        alike = np.minimum(odds, np.transpose(odds)) < MIN_LN_ODDS
        return {self.labels[i]: [self.labels[j] for j in np.flatnonzero(alike[i])] for i in every}

    def _why(self, p: Array, order: Array) -> str:
        """Why no label is likely: c is open, or its order m. p: probabilities, order: sorted."""
        c = np.array([label.c for label in self.labels])
        first = order[0]
        others = order[c[order] != c[first]]
        open_waves = len(others) and p[c == c[first]].sum() < MIN_LABEL_PROBABILITY
        second = others[0] if open_waves else order[1]
        a, b = self.labels[first], self.labels[second]
        if min(self.odds(first, second), self.odds(second, first)) >= MIN_LN_ODDS:
            return f"the shape is between {a.said} and {b.said}: noise, or two modes mixed"
        if a.c != b.c:
            angles = np.round(np.degrees(self.sensors.points[:, 1])) % 360
            count = len(np.unique(angles))
            return (
                f"aliasing: sensors at {count} angle{'s' * (count > 1)}, spaced as they are, let"
                f" {min(a.c, b.c)} and {max(a.c, b.c)} waves look alike"
            )
        return f"sensors let {a.said} and {b.said} look alike: {_missing(self.sensors)}"


def _label(c: int, column: int) -> Label:
    if c == 0 and column in (0, AXIAL_COLUMN):
        return Label(0, 0, "axial" if column == AXIAL_COLUMN else "torsional")
    return Label(c, column)


def _missing(sensors: Sensors) -> str:
    """What a layout lacks to tell orders apart."""
    names = ("radial", "tangential", "axial")
    R, _, Z = sensors.points.T
    belt = R / R.max() > BELT
    measured = np.any(np.abs(sensors.directions[belt]) > 0.5, axis=0)
    lacking = [name for name, seen in zip(names, measured, strict=True) if not seen]
    if lacking:
        return f"nothing {' or '.join(lacking)} was measured on the tread"
    if np.ptp(Z[belt]) < MIN_HALF_WIDTH * R.max():
        return "they do not stand on both edges of the tread"
    return "there are too few on the tread"


def _motions(sensors: Sensors, c: int) -> Array:
    """B (k, terms): belt polynomials, then sidewall ones, by component; cosines, then sines."""
    R, angle, Z = sensors.points.T
    belt = R / R.max() > BELT
    half_width = max(np.abs(Z[belt]).max(), MIN_HALF_WIDTH * R.max())
    across = legvander(np.clip(Z / half_width, -1, 1), DEGREE) * belt[:, None]
    height = (R - R.min()) / (np.ptp(R) or 1.0) * 2 - 1
    up = legvander(height, HEIGHTS) * ~belt[:, None]
    side = np.hstack([up, up * np.sign(Z)[:, None]])  # alike on both sides, then opposite
    motions = [part * sensors.directions[:, [k]] for part in (across, side) for k in range(3)]
    B = np.hstack(motions)
    if c == 0:
        return B
    turn = c * angle[:, None]
    return np.hstack([B * np.cos(turn), B * np.sin(turn)])


def _variances(c: int, column: int) -> Array:
    """v (terms,) of `_motions`, under the label of ``column``."""
    columns = COLUMNS[c == 0]  # (3, DEGREE + 1, 5)
    small = [SAME_PARITY if PARITY[n] == PARITY[column] else OTHER_PARITY for n in range(5)]
    share = np.array(small)
    share[column] = 1.0
    belt = (columns @ share) * (2 * np.arange(DEGREE + 1) + 1)  # energy a^2 / (2 k + 1)
    even = PARITY[column] == 0
    sides = []
    for k in range(3):
        alike = even == (k < 2)  # r, theta even in Z and z odd: symmetric about the middle plane
        main, rest = SIDEWALL, SIDEWALL * OTHER_PARITY
        for value in (main, rest) if alike else (rest, main):
            sides += [value] * (HEIGHTS + 1)
    return np.concatenate([belt.ravel(), sides])
