"""Is there a gap, and in which measurements is it?

    P = S^-1 - S^-1 J (J^T S^-1 J + Sx^-1)^-1 J^T S^-1        what calibration cannot absorb
    T = r^T P r + splits ~ chi2(n - v + n_split)               if there is no gap

r (n,) = y - eta: residuals of the plain fit, ln measured less ln computed, of n rows; S (n, n):
their covariance before the fit (repeatability, errors of the model, uncertain constants); J (n, v)
= d eta / dx by the v variables; Sx (v, v): covariance of the prior of x. splits: chi2 of the
n_split measured distances between the two modes of a pair (`inference.splits`).

The residuals of the fit have covariance C = S P S; a group G of them, r_G^T C_GG^-1 r_G ~ chi2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtrc, ndtr

from ..inference.inverse_problem import InverseProblem
from ..inference.observations import Observable

Array = np.ndarray
OWN_RIM = "as the case"  # how the rim is held
FAMILY_NAMES = {"in-plane": "in-plane", "out-of-plane": "lateral"}


@dataclass(frozen=True)
class ResidualGroup:
    """Test of the residuals of some rows: whether they are larger than expected."""

    kind: str  # family, harmonic, pressure, rim or mass
    name: str  # of the group among its kind, such as "in-plane" or "240" (kPa)
    rms_percent: float  # of residuals, 100 (ln measured - ln model)
    chi2: float
    freedom: int  # degrees of freedom of chi2
    p_value: float
    corrected: float  # p-value corrected for the number of groups (Holm)


@dataclass(frozen=True)
class Contrast:
    """A combination of residuals in per cent with its standard deviation."""

    name: str  # in words, see `_contrasts`
    percent: float  # weighted sum of residuals, 100 (ln measured - ln model)
    sigma_percent: float  # its standard deviation without a gap

    @property
    def p_value(self) -> float:
        """Two-sided p-value of the contrast without a gap."""
        return float(2 * ndtr(-abs(self.percent) / self.sigma_percent))


@dataclass(frozen=True)
class Gap:
    """Gap that the plain fit leaves."""

    chi2: float  # T
    freedom: int  # degrees of freedom of T
    p_value: float  # probability of a larger T without a gap
    residuals: Array = field(repr=False)  # (n,) r = ln measured - ln model
    # (n,) their standard deviation without a gap, the root of C's diagonal
    spread: Array = field(repr=False)
    groups: tuple[ResidualGroup, ...]
    contrasts: tuple[Contrast, ...] = field(repr=False)
    # by effect: share of its squared shift, in standard deviations, that a fit hides
    absorbed: Mapping[str, float] = field(repr=False)
    # by variable and effect: change of the fitted variable by the effect at the end of its range
    bias_percent: Mapping[str, Mapping[str, float]] = field(repr=False)

    @property
    def rms_percent(self) -> float:
        """RMS of all residuals, per cent."""
        return float(100 * np.sqrt(np.mean(self.residuals**2)))


def projection(problem: InverseProblem, d: Array) -> tuple[Array, Array, Array]:
    """P (n, n), S^-1 (n, n), and the change of x by that of y, (J^T S^-1 J + Sx^-1)^-1 J^T S^-1
    (v, n), at x = x0 + d with d (v,)."""
    _, J = problem.plain(d)
    inverse = np.linalg.inv(problem.sigma)
    absorbing = np.linalg.solve(J.T @ inverse @ J + np.diag(problem.spread**-2.0), J.T @ inverse)
    P = inverse - inverse @ J @ absorbing
    return (P + P.T) / 2, inverse, absorbing


def find_gap(problem: InverseProblem, d: Array, variables: tuple[str, ...]) -> Gap:
    """The gap that the plain fit leaves at x = x0 + d, d (v,); variables: names of x."""
    P, inverse, absorbing = projection(problem, d)
    sigma = problem.sigma
    C = sigma @ P @ sigma
    # toggled runs: the effect that was switched on purpose changes eta and J
    shift, tilt, *_ = problem.added({}, 1)
    eta, _ = problem.plain(d)
    r = problem.observations.y - eta - shift[0] - tilt[0] @ d
    total = float(r @ P @ r) + problem.splits.chi2()
    freedom = max(1, len(r) - len(d) + problem.splits.count)
    absorbed: dict[str, float] = {}
    bias: dict[str, dict[str, float]] = {name: {} for name in variables}
    for id, nodes in problem.expansion.nodes.items():
        e = np.array([max(nodes.reach, key=abs)])  # the farther end of what has a solution
        g = problem.added({id: e}, 1).shift[0] - shift[0]
        whole = g @ inverse @ g
        absorbed[id] = float(1 - g @ P @ g / whole) if whole > 0 else 0.0
        for name, change in zip(variables, absorbing @ g, strict=True):
            bias[name][id] = float(100 * np.expm1(change))
    rows = problem.observations.rows
    return Gap(
        total,
        freedom,
        chi2_tail(total, freedom),
        r,
        np.sqrt(np.diag(C)),
        tuple(_corrected(_groups(rows, r, C))),
        tuple(_contrasts(rows, r, C)),
        absorbed,
        bias,
    )


def _groups(rows: tuple[Observable, ...], r: Array, C: Array) -> list[ResidualGroup]:
    """Every group of residuals r (n,) with their covariance C (n, n), not yet corrected."""
    kinds = {
        "family": [family(row) for row in rows],
        "harmonic": [str(row.label.c) if row.label else None for row in rows],
        "pressure": [f"{row.pressure_kPa:g}" if row.label else None for row in rows],
        "mass": [None if row.label else "mass" for row in rows],
    }
    if any(row.rim for row in rows):
        kinds["rim"] = [(row.rim or OWN_RIM) if row.label else None for row in rows]
    result = []
    for kind, names in kinds.items():
        for name in sorted({n for n in names if n}, key=_as_number):
            G = np.array([n == name for n in names])
            value, freedom = _chi2(r[G], C[np.ix_(G, G)])
            p = chi2_tail(value, freedom) if freedom else 1.0
            rms = float(100 * np.sqrt(np.mean(r[G] ** 2)))
            result.append(ResidualGroup(kind, name, rms, value, freedom, p, p))
    return result


def family(row: Observable) -> str | None:
    """Family of a row's mode: in-plane, lateral (out-of-plane) or [0,0]; None of overtones and of
    the mass."""
    if row.label is None:
        return None
    return "[0,0]" if row.label.kind else FAMILY_NAMES.get(row.label.family or "")


def chi2_tail(value: float, freedom: int) -> float:
    """P(chi2 > ``value``) with ``freedom`` degrees of freedom; a form that rounds below 0 is 0."""
    return float(chdtrc(freedom, max(value, 0.0)))


def _chi2(r: Array, C: Array) -> tuple[float, int]:
    """r^T C^+ r and the rank of C: few residuals of a fit leave directions without scatter."""
    values, vectors = np.linalg.eigh(C)
    keep = values > 1e-6 * values.max(initial=1e-300)
    along = vectors[:, keep].T @ r
    return float((along**2 / values[keep]).sum()), int(keep.sum())


def _corrected(groups: list[ResidualGroup]) -> list[ResidualGroup]:
    """Holm: the i-th smallest of m p-values times m - i + 1, never falling."""
    order = sorted(range(len(groups)), key=lambda i: groups[i].p_value)
    running, result = 0.0, list(groups)
    for place, i in enumerate(order):
        running = max(running, min(1.0, groups[i].p_value * (len(groups) - place)))
        result[i] = replace(groups[i], corrected=running)
    return result


def _contrasts(rows: tuple[Observable, ...], r: Array, C: Array) -> list[Contrast]:
    """Weighted sums of the residuals r (n,), each with its standard deviation by C (n, n)."""
    modes = np.array([row.label is not None for row in rows])
    c = np.array([row.label.c if row.label else -1 for row in rows], float)
    lateral = np.array([family(row) == "lateral" for row in rows])
    plane = np.array([family(row) == "in-plane" for row in rows])
    ln_p = np.array([np.log(row.pressure_kPa) if row.label else 0.0 for row in rows])
    weights = {
        "all modes": _mean(modes),
        "slope over the harmonic, c = 4 over c = 1": _slope(modes & (c > 0), c, 3.0),
        "lateral less in-plane": _mean(lateral) - _mean(plane),
        "c = 1 less c of 2 and more": _mean(c == 1) - _mean(c >= 2),
        "c = 0 less the others": _mean(c == 0) - _mean(c >= 1),
        "growth with pressure, 320 over 160 kPa": _slope(modes, ln_p, np.log(2.0)),
    }
    result = []
    for name, w in weights.items():
        if np.isfinite(w).all() and w @ C @ w > 1e-14:
            result.append(Contrast(name, float(100 * w @ r), float(100 * np.sqrt(w @ C @ w))))
    return result


def _mean(mask: Array) -> Array:
    """Weights (n,) of a mean over rows; NaN if there are none."""
    return mask / mask.sum() if mask.any() else np.full(len(mask), np.nan)


def _slope(mask: Array, x: Array, span: float) -> Array:
    """Weights (n,) of the least-squares slope over x, times ``span``; NaN if all x are the same."""
    if not mask.any() or not np.ptp(x[mask]):
        return np.full(len(x), np.nan)
    off = np.where(mask, x - x[mask].mean(), 0.0)
    return off / (off @ off) * span


def _as_number(name: str) -> tuple[float, str]:
    """Key by which names that are numbers are sorted by value, the others by name."""
    try:
        return float(name), ""
    except ValueError:
        return 0.0, name
