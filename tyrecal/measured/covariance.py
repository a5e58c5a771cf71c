"""Covariance of the k signals of a mode under each label [c, m], on one layout of sensors.

A label says which motions are large. On the belt they are those of its order m: radial and
tangential ones as P_m(Z / half width), lateral ones as P_(m-1), P_m being Legendre's polynomials
across the belt, each times cos and sin of c Theta. On the sidewalls they are symmetric about the
middle plane for even m, antisymmetric for odd m. The others are small, not absent:

    S = own / |own| + a same / |same| + b other / |other| + w all / |all|

a, b, w: SAME_PARITY, OTHER_PARITY, OTHER_WAVES. own, same, other (k, k): covariances of unit
motions of the label's order, of the other orders of its parity, and of the other parity; all: of
every c; |A|: the mean of the diagonal, at least MIN_SEEN of that of the three together. So no order
has cleaner shapes than another. A belt's half width is known from a case, or not: then S is the
mean over HALF_WIDTHS of the radius. The variances are assumed.

A column is the index of an order among the five of a harmonic in `modes.label`: COLUMNS has the
motions of each, PARITY whether it is even (0) or odd (1). DEGREE is the highest polynomial, BELT
the radius, over the largest one, from which a sensor is on the belt.

``labels`` judges with these covariances; they say nothing about frequencies.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander

from ..simulate.modes.label import BELT, COLUMNS, DEGREE, PARITY
from .sensors import Sensors

Array = np.ndarray

SAME_PARITY, OTHER_PARITY = 0.08, 0.01  # variance of motions that are not the label's, of 1
OTHER_WAVES = 0.001  # likewise, of motions with another c: tyres are not uniform
SIDEWALL = 0.5  # variance of the sidewalls' motion, the belt's being 1: they bulge with it
HALF_WIDTHS = (0.18, 0.40)  # of a belt's half width over its radius: motorcycles' tyres have others
WIDTHS = 6  # half widths averaged over
WIDER = 1.05  # a belt reaches beyond its outermost sensor by up to this factor, at least
HEIGHTS = 2  # highest polynomial over a sidewall's height
MIN_SEEN = 0.1  # share of all motions' mean square from which sensors see a label's own motions


def label_covariances(
    sensors: Sensors, highest: int, half_width: float | None = None
) -> list[tuple[int, int, Array, float]]:
    """(c, column, S (k, k), share) for each label with up to ``highest`` waves.

    S: covariance with a unit mean diagonal; share: of the mean square of all motions, the part that
    the label's own motions have on these sensors. half_width: of the belt (m); None: not known.
    """
    widths = half_widths(sensors, half_width)
    bases = [
        np.hstack([_motions(sensors, c, width) for width in widths]) for c in range(highest + 1)
    ]
    every = _unit(sum(B @ B.T for B in bases))
    result = []
    for c, B in enumerate(bases):
        square = np.mean(B**2, axis=0)
        for column in range(5 if c == 0 else 4):
            variances = [np.tile(v, len(widths)) for v in _variances(c, column)]
            seen = np.array([v @ square for v in variances])
            shares = (1.0, SAME_PARITY, OTHER_PARITY) / np.maximum(seen, MIN_SEEN * seen.sum())
            v = shares @ variances
            S = _unit((B * v) @ B.T) + OTHER_WAVES * every
            result.append((c, column, _unit(S), float(seen[0] / seen.sum())))
    return result


def half_widths(sensors: Sensors, known: float | None = None) -> Array:
    """Half widths (k,), m, that the belt may have, each as likely: the one known, or `WIDTHS`
    between those of narrow and wide tyres, none narrower than the sensors on the belt."""
    R, _, Z = sensors.points.T
    outermost = float(np.abs(Z[R / R.max() > BELT]).max())
    if known is not None:
        return np.array([max(known, outermost)])
    narrow, wide = (share * R.max() for share in HALF_WIDTHS)
    low, high = max(narrow, outermost), max(wide, WIDER * outermost)
    return low + (high - low) * (np.arange(WIDTHS) + 0.5) / WIDTHS


def _unit(S: Array) -> Array:
    """S (k, k) scaled to a mean diagonal of 1."""
    return S * (len(S) / max(np.trace(S), 1e-300))


def _motions(sensors: Sensors, c: int, half_width: float) -> Array:
    """B (k, terms): belt polynomials, then sidewall ones, each of r, theta, z in turn; all these
    times cosines, then times sines."""
    R, angle, Z = sensors.points.T
    belt = R / R.max() > BELT
    across = legvander(np.clip(Z / half_width, -1, 1), DEGREE) * belt[:, None]
    height = (R - R.min()) / (np.ptp(R) or 1.0) * 2 - 1  # -1 to 1 from the least radius on
    up = legvander(height, HEIGHTS) * ~belt[:, None]
    side = np.hstack([up, up * np.sign(Z)[:, None]])  # alike on both sides, then opposite
    motions = [part * sensors.directions[:, [k]] for part in (across, side) for k in range(3)]
    B = np.hstack(motions)
    if c == 0:
        return B
    turn = c * angle[:, None]
    return np.hstack([B * np.cos(turn), B * np.sin(turn)])


def _variances(c: int, column: int) -> tuple[Array, Array, Array]:
    """Variances (terms,) of `_motions`: own, other orders of its parity, the other parity."""
    orders = np.arange(5)
    is_same = np.array(PARITY) == PARITY[column]
    own, same, other = (
        (COLUMNS[c == 0] @ chosen.astype(float)).ravel()
        for chosen in (orders == column, is_same & (orders != column), ~is_same)
    )
    even = PARITY[column] == 0
    # r and theta even in Z, z odd: symmetric about the middle plane; alike on both sides, opposite
    alike = np.array([even == (k < 2) for k in range(3)])
    main = SIDEWALL * np.repeat(np.column_stack([alike, ~alike]).ravel(), HEIGHTS + 1)
    none = np.zeros_like(main)
    parts = ((own, main), (same, none), (other, SIDEWALL - main))
    repeat = 1 if c == 0 else 2
    return tuple(np.tile(np.concatenate(part), repeat) for part in parts)  # type: ignore[return-value]
