"""Frequency-response functions to modes, with the standard deviation of each frequency.

Poles by least squares in the complex frequency domain (LSCF, a common-denominator model in z, by
sdypy-EMA) for rising polynomial orders. A pole that comes again from one order to the next is
stable; stable poles within 1 % of each other are one mode, whose frequency and damping are their
medians. Residues, and so shapes, by least squares in the frequency domain with one term for the
modes below the band and one for those above.

No library states how far such a frequency is off. The delete-one-group jackknife over the
sensors tells what noise does, and the spread s over the orders (1.48 times the median deviation)
what the model's order does: with theta_j from all groups of points but j,

    sigma^2 = (g - 1) / g sum_j (theta_j - mean theta)^2 + s^2
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from .sensors import BadMeasuredData, MeasuredMode

Array = np.ndarray

ORDER, LINES = 40, 5  # highest order of the polynomials, in pole pairs, and lines for each pair
SAME_FREQUENCY, SAME_DAMPING = 0.01, 0.2  # relative, of a pole and its like one order below
LOW = 3  # the lowest third of the orders is too low to hold all modes, and biased
SPAN = 0.01  # relative width of one mode's poles
OFTEN = 0.4  # share of the orders in which a mode's pole has to be stable
DAMPINGS = (0.002, 0.2)  # ratios that a tyre's mode can have
DEVIATION = 1.4826  # standard deviation of a normal variable over its median deviation
GROUPS = 10  # of the jackknife, at most
FORMS = ("receptance", "mobility", "accelerance")


class LabMissing(RuntimeError):
    """The optional package that identifies modes is not installed."""


@dataclass(frozen=True)
class Responses:
    """Frequency-response functions of one excitation.

    frequency_Hz (n,): evenly spaced; values (k, n) complex, a signal each; form: receptance,
    mobility or accelerance; points (k,): of each signal, the number of its point.
    """

    frequency_Hz: Array
    values: Array
    form: str
    points: Array


@dataclass(frozen=True)
class Identified:
    """modes: by rising frequency, their amplitudes (k,) the residues; fitted (k, n): the
    functions that they make, NaN outside the band."""

    modes: tuple[MeasuredMode, ...]
    fitted: Array


def identify(measured: Responses, low_Hz: float, high_Hz: float) -> Identified:
    """Modes between two frequencies.

    Raises BadMeasuredData where the functions hold no mode, or lie at uneven frequencies;
    LabMissing.
    """
    measured = _from_above_0(measured)
    f = measured.frequency_Hz
    if len(f) < 50 or not np.allclose(np.diff(f), f[1] - f[0], rtol=1e-3):
        raise BadMeasuredData("functions must hold 50 evenly spaced frequencies or more")
    every = np.arange(len(measured.values))
    model = _model(measured, every, low_Hz, high_Hz)
    poles = _modes(model.all_poles, low_Hz, high_Hz)
    if not len(poles):
        raise BadMeasuredData(f"no mode is stable between {low_Hz:g} and {high_Hz:g} Hz")
    hertz, z, spread = poles.T
    sigma = np.hypot(_jackknife(measured, hertz, low_Hz, high_Hz), spread)
    w = 2 * np.pi * hertz
    chosen = SimpleNamespace(
        all_poles=[-z * w + 1j * w * np.sqrt(1 - z**2)], pole_ind=[(0, i) for i in range(len(w))]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the band's end is the grid's
        fitted, residues = model.get_constants(whose_poles=chosen)
    modes = tuple(
        MeasuredMode(float(f_k), amplitude, float(z_k), float(sigma_k))
        for f_k, z_k, amplitude, sigma_k in zip(hertz, z, residues.T, sigma, strict=True)
    )
    first = round(f[0] / (f[1] - f[0]))
    whole = np.full(measured.values.shape, np.nan, complex)
    whole[:, : fitted.shape[1] - first] = fitted[:, first:]
    whole /= _to_mobility(measured)
    whole[:, (f < low_Hz) | (f > high_Hz)] = np.nan
    return Identified(modes, whole)


def _from_above_0(measured: Responses) -> Responses:
    """Without the line at 0 Hz, where nothing moves or everything drifts."""
    keep = measured.frequency_Hz > 0
    return Responses(
        measured.frequency_Hz[keep], measured.values[:, keep], measured.form, measured.points
    )


def _to_mobility(measured: Responses) -> Array:
    """Factor (n,) to velocity over force, whose modes are about as high at all frequencies, so
    that least squares heed them alike."""
    return (2j * np.pi * measured.frequency_Hz) ** (1 - FORMS.index(measured.form))


def _model(measured: Responses, rows: Array, low_Hz: float, high_Hz: float) -> SimpleNamespace:
    """The library's model of some signals, with poles of all orders."""
    try:
        from sdypy import EMA
    except ImportError:
        raise LabMissing(
            "frequency-response functions need the package sdypy-EMA: pip install 'tyrecal[lab]'"
        ) from None
    f, H = measured.frequency_Hz, measured.values[rows] * _to_mobility(measured)
    step = f[1] - f[0]
    first = round(f[0] / step)  # the library needs the grid from 0 Hz on
    f = np.arange(first + len(f)) * step
    H = np.hstack([np.zeros((len(H), first)), H])
    lines = np.sum((f >= low_Hz) & (f <= high_Hz))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = EMA.Model(
            H, f, lower=max(low_Hz, f[max(first, 1)]), upper=min(high_Hz * 1.05, f[-1]),
            pol_order_high=int(np.clip(lines // LINES, 4, ORDER)), frf_form="mobility",
        )  # fmt: skip
        model.get_poles("lscf", show_progress=False)
    return model


def _modes(poles: list[Array], low_Hz: float, high_Hz: float) -> Array:
    """Frequency (Hz), damping and spread (Hz) over the orders of each mode (modes, 3), by rising
    frequency."""
    stable: list[tuple[float, float]] = []
    before = np.empty((0, 2))
    high = poles[len(poles) // LOW :]
    for each in high:
        w = np.abs(each)
        found = np.column_stack([w / (2 * np.pi), -each.real / w])
        right = (each.imag > 0) & (found[:, 0] >= low_Hz) & (found[:, 0] <= high_Hz)
        right &= (found[:, 1] > DAMPINGS[0]) & (found[:, 1] < DAMPINGS[1])
        found = found[right]
        change = np.abs(before[None] / found[:, None] - 1)
        again = (change < (SAME_FREQUENCY, SAME_DAMPING)).all(2).any(1)
        stable += [tuple(row) for row in found[again]]
        before = found
    stable.sort()
    rest, modes = np.array(stable).reshape(-1, 2), []
    while len(rest):  # the most crowded place first
        near = np.abs(rest[:, None, 0] / rest[None, :, 0] - 1) < SPAN / 2
        centre = np.median(rest[near[np.argmax(near.sum(1))]], axis=0)
        mine = np.abs(rest[:, 0] / centre[0] - 1) < SPAN
        if mine.sum() < OFTEN * len(high):
            break
        middle = np.median(rest[mine], axis=0)
        spread = DEVIATION * np.median(np.abs(rest[mine, 0] - middle[0]))
        modes.append((*middle, spread))
        rest = rest[~mine]
    return np.array(sorted(modes)).reshape(-1, 3)


def _jackknife(measured: Responses, frequencies: Array, low_Hz: float, high_Hz: float) -> Array:
    """Standard deviation of each frequency, Hz; NaN where fewer than three groups saw it."""
    points = np.unique(measured.points)
    count = min(GROUPS, len(points))
    found = np.full((count, len(frequencies)), np.nan)
    for j in range(count if count > 2 else 0):
        rows = np.flatnonzero(~np.isin(measured.points, points[j::count]))
        modes = _modes(_model(measured, rows, low_Hz, high_Hz).all_poles, low_Hz, high_Hz)
        for i, hertz in enumerate(frequencies):
            change = np.abs(modes[:, 0] / hertz - 1)
            if len(change) and change.min() < 2 * SPAN:
                found[j, i] = modes[np.argmin(change), 0]
    seen = np.isfinite(found).sum(0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of modes that no group saw
        spread = np.nanvar(found, axis=0) * (seen - 1)
    return np.where(seen > 2, np.sqrt(spread), np.nan)
