"""Frequency-response functions to modes, with the standard deviation of each frequency.

Poles by least squares in the complex frequency domain (LSCF): H(z) D(z) = N(z) with a common
denominator D for all signals, for rising orders of D. A pole that two successive orders have is
stable; stable poles within 1 % of each other are one mode, whose frequency and damping are their
medians. Residues, and so shapes, by least squares in the frequency domain with one term for the
modes below the band and one for those above.

Powers of z = exp(-i w T) with real coefficients, from 0 Hz on, are nearly dependent over a narrow
band: over 70 to 90 Hz rounding decided which mode was found. So only the band, shifted, is mapped
to three quarters of the unit circle, with complex coefficients (the condition of 40 powers is then
about cos(pi / 8)^-40 = 24). The denominator follows from the data by QR, not from normal equations,
which would square the condition. RIDGE times the norm of the data limits the effect of rounding if
the order is higher than the number of modes.

The error of a frequency has two parts: noise, by the delete-one-group jackknife over the sensors,
and the order, by the spread s over the orders (1.48 times the median deviation). With the frequency
theta_j from all of g groups of points except j,

    sigma^2 = (g - 1) / g sum_j (theta_j - mean theta)^2 + s^2
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from ..errors import InputError
from .sensors import MeasuredMode

Array = np.ndarray

MAX_ORDER, LINES_PER_ORDER = 40, 5  # highest order of the denominators, and lines for each order
ARC, RIDGE = 0.75, 1e-8  # share of the unit circle that the band takes; ridge, relative
BAND_MARGIN = 1.05  # lines up to here times the band's end are used
SAME_FREQUENCY, SAME_DAMPING = 0.01, 0.2  # relative, of a pole and its like one order below
LOW_ORDERS = 3  # the lowest third of the orders is too low to hold all modes, and biased
MODE_WIDTH = 0.01  # relative width of one mode's poles
MIN_STABLE_SHARE = 0.4  # share of the orders in which a mode's pole has to be stable
DAMPING_RANGE = (0.002, 0.2)  # ratios that a tyre's mode can have
DEVIATION = 1.4826  # standard deviation of a normal variable over its median deviation
MAX_GROUPS = 10  # largest number of groups of the jackknife
FORMS = ("receptance", "mobility", "accelerance")


@dataclass(frozen=True)
class Responses:
    """Frequency-response functions of one excitation."""

    frequency_Hz: Array  # (n,) evenly spaced
    values: Array  # (k, n) complex, one row per signal, all in one unit (its choice has no effect)
    form: str  # receptance, mobility or accelerance
    points: Array  # (k,) number of the point where each signal was measured


@dataclass(frozen=True)
class Identified:
    """Modes that were identified from measured functions."""

    modes: tuple[MeasuredMode, ...]  # by rising frequency, their amplitudes the residues
    fitted: Array  # (k, n) the functions of these modes, NaN outside the band


def identify(measured: Responses, low_Hz: float, high_Hz: float) -> Identified:
    """Modes between two frequencies.

    Raises InputError where the functions hold no mode, fewer than 50 lines or uneven ones.
    """
    above_0 = measured.frequency_Hz > 0  # at 0 Hz sensors show no motion, or drift
    f, points = measured.frequency_Hz[above_0], measured.points
    # velocity over force: peaks of all modes are about equally high, so that least squares weigh
    # them alike
    to_mobility = (2j * np.pi * f) ** (1 - FORMS.index(measured.form))
    mobility = measured.values[:, above_0] * to_mobility
    if len(f) < 50 or not np.allclose(np.diff(f), f[1] - f[0], rtol=1e-3):
        raise InputError("functions must hold 50 evenly spaced frequencies or more")
    used = (f >= low_Hz) & (f <= BAND_MARGIN * high_Hz)
    order = int(np.clip(np.sum(used & (f <= high_Hz)) // LINES_PER_ORDER, 4, MAX_ORDER))
    distinct = np.unique(points)
    count = min(MAX_GROUPS, len(distinct))
    groups = [np.isin(points, distinct[j::count]) for j in range(count)]
    triangles = np.array([_triangle(mobility[group][:, used], order) for group in groups])
    modes = _modes(_poles(triangles, f[used]), low_Hz, high_Hz)
    if not len(modes):
        raise InputError(f"no mode is stable between {low_Hz:g} and {high_Hz:g} Hz")
    hertz, damping, spread = modes.T
    others = [np.delete(triangles, j, axis=0) for j in range(count if count > 2 else 0)]
    again = [_modes(_poles(each, f[used]), low_Hz, high_Hz) for each in others]
    sigma = np.hypot(_jackknife(again, hertz), spread)
    inside = (f >= low_Hz) & (f <= high_Hz)
    residues, fitted = _residues(f, mobility, inside, _pole(hertz, damping))
    fitted[:, ~inside] = np.nan
    rows = zip(hertz, damping, residues, sigma, strict=True)
    found_modes = [MeasuredMode(float(h), u, float(d), float(s)) for h, d, u, s in rows]
    return Identified(tuple(found_modes), fitted / to_mobility)


def _triangle(H: Array, order: int) -> Array:
    """Triangle (order + 1, order + 1) of the least squares for D's coefficients, |triangle a|
    smallest, of some signals (k, n) evenly spaced in frequency: N, free for each signal, is
    eliminated."""
    z = np.exp(-2j * np.pi * ARC * np.arange(H.shape[1]) / H.shape[1])
    powers = z[:, None] ** np.arange(order + 1)
    basis = np.linalg.qr(powers)[0]
    triangle = np.zeros((0, order + 1))
    for h in H:
        rows = h[:, None] * powers
        rows -= basis @ (basis.conj().T @ rows)
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, rows]), mode="r"))
    return triangle


def _poles(triangles: Array, f: Array) -> list[Array]:
    """Poles (order,), rad/s, of each order from 1 on; the highest coefficient is 1, so that those
    which only follow the noise are unstable."""
    size = triangles.shape[-1]
    ridge = RIDGE * np.linalg.norm(triangles) / np.sqrt(size) * np.eye(size)
    R = np.asarray(np.linalg.qr(np.vstack([*triangles, ridge]), mode="r"))
    T = ARC / (len(f) * (f[1] - f[0]))
    result = []
    for j in range(1, size):
        below = solve_triangular(R[:j, :j], -R[:j, j])
        s = -np.log(np.roots(np.append(1.0, below[::-1]))) / T
        # the logarithm returns angles from -pi to pi, but the band has those from 0 to 2 pi ARC:
        # angles below the middle of the free arc are those above pi
        turns = np.where(s.imag * T < -np.pi * (1 - ARC), 2 * np.pi / T, 0)
        result.append(s + 1j * (turns + 2 * np.pi * f[0]))
    return result


def _pole(hertz: Array, damping: Array) -> Array:
    """Poles (modes,), rad/s, of frequencies and damping ratios."""
    return 2 * np.pi * hertz * (-damping + 1j * np.sqrt(1 - damping**2))


def _residues(f: Array, mobility: Array, inside: Array, poles: Array) -> tuple[Array, Array]:
    """Residues (modes, k) of the displacement, from mobilities (k, n) at the lines inside, and the
    mobilities that they and what lies outside the band make, at all lines."""
    s = 2j * np.pi * f[:, None]
    one, other = s / (s - poles), s / (s - poles.conj())
    beyond = np.hstack([1 / s, 1j / s, s, 1j * s])  # rigid below, flexible above
    terms = np.hstack([one + other, 1j * (one - other), beyond])
    size = np.linalg.norm(terms[inside], axis=0)
    tall = lambda a: np.vstack([a.real, a.imag])
    x = np.linalg.lstsq(tall(terms[inside] / size), tall(mobility.T[inside]), rcond=None)[0]
    x /= size[:, None]
    count = len(poles)
    return x[:count] + 1j * x[count : 2 * count], (terms @ x).T


def _modes(poles: list[Array], low_Hz: float, high_Hz: float) -> Array:
    """Frequency (Hz), damping and spread (Hz) over the orders of each mode (modes, 3), by rising
    frequency."""
    stable: list[tuple[float, float]] = []
    before = np.empty((0, 2))
    high = poles[len(poles) // LOW_ORDERS :]
    for each in high:
        w = np.abs(each)
        candidates = np.column_stack([w / (2 * np.pi), -each.real / w])
        right = (each.imag > 0) & (candidates[:, 0] >= low_Hz) & (candidates[:, 0] <= high_Hz)
        right &= (candidates[:, 1] > DAMPING_RANGE[0]) & (candidates[:, 1] < DAMPING_RANGE[1])
        candidates = candidates[right]
        change = np.abs(before[None] / candidates[:, None] - 1)
        again = (change < (SAME_FREQUENCY, SAME_DAMPING)).all(2).any(1)
        stable += [tuple(row) for row in candidates[again]]
        before = candidates
    stable.sort()
    rest, modes = np.array(stable).reshape(-1, 2), []
    while len(rest):  # the frequency with the most stable poles first
        near = np.abs(rest[:, None, 0] / rest[None, :, 0] - 1) < MODE_WIDTH / 2
        centre = np.median(rest[near[np.argmax(near.sum(1))]], axis=0)
        mine = np.abs(rest[:, 0] / centre[0] - 1) < MODE_WIDTH
        if mine.sum() < MIN_STABLE_SHARE * len(high):
            break
        middle = np.median(rest[mine], axis=0)
        spread = DEVIATION * np.median(np.abs(rest[mine, 0] - middle[0]))
        modes.append((*middle, spread))
        rest = rest[~mine]
    return np.array(sorted(modes)).reshape(-1, 3)


def _jackknife(again: list[Array], frequencies: Array) -> Array:
    """Standard deviation of each frequency (modes,), Hz, from the modes (modes, 3) found without
    each group; NaN, not known, if fewer than three of these sets have the mode."""
    nearest = np.full((len(again), len(frequencies)), np.nan)
    for j, modes in enumerate(again):
        for i, hertz in enumerate(frequencies):
            change = np.abs(modes[:, 0] / hertz - 1)
            if len(change) and change.min() < 2 * MODE_WIDTH:
                nearest[j, i] = modes[np.argmin(change), 0]
    seen = np.isfinite(nearest).sum(0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of modes that no group saw
        spread = np.nanvar(nearest, axis=0) * (seen - 1)
    return np.where(seen > 2, np.sqrt(spread), np.nan)
