"""Shrinkage of the errors on held-out data by an effect, and the shrinkage by chance alone.

A rule chooses the held-out rows; effect and variables are fitted to the other rows. G: rms of the
errors in ln f on the held-out rows, before and after the effect is added; R = 1 - G_after /
G_before. The placebo is R of tyres without any effect, drawn from the plain model and Sigma, each
with its likeliest effect.

The fits of a diagnosis attribute a part of the errors to the uncalibrated constants. A calibration
by least squares of ln f does not, and has smaller errors. So its errors are listed too, without the
effect and with the size that the diagnosis gives on the fitted rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..inference.inverse_problem import InverseProblem
from ..inference.observations import Observable
from ..inference.plain_fit import MAX_STEP
from .evidence import NONE, Hypothesis, explain, grid, refit

Array = np.ndarray
PLACEBOS, DRAWS = 200, 200  # simulated tyres without effects; sizes drawn from the posterior
LEAST_SQUARES_STEPS = 8  # Gauss-Newton steps
SHRINKAGE_SEED = 0  # of all that is drawn here, so that a diagnosis again has the same bytes


@dataclass(frozen=True)
class Shrinkage:
    """Errors of ln f on the held-out rows, rms, before and after the effect's fit."""

    held_out: str  # held-out values in words
    effect: str  # ids of the effects, joined by +
    before_percent: float  # rms error before the effect's fit
    after_percent: float  # rms error after the effect's fit
    fraction: float  # R = 1 - after / before
    low: float  # lower end of the 90 % interval of R
    high: float  # upper end of the 90 % interval of R
    placebo_95: float  # 95 % quantile of R on tyres without any effect
    floor_percent: float  # rms error that repeatability alone leaves
    before_sigma: float  # rms error before, over its own standard deviation
    after_sigma: float  # rms error after, over its own standard deviation
    least_squares_before_percent: float  # rms error before, of a calibration by plain least squares
    least_squares_after_percent: float  # rms error after, of a calibration by plain least squares
    each: Mapping[str, float] = field(default_factory=dict)  # R of an effect beside the others


def held_out(rows: Sequence[Observable]) -> tuple[Array, str]:
    """The rows to hold out (n,), by rule, and in words.

    Three pressures or more: the second highest; two: the lower; one: the highest harmonic of each
    family. All runs of a row go together; the mass is never held out.
    """
    pressures = sorted({row.pressure_kPa for row in rows if row.label})
    if len(pressures) > 1:
        chosen = pressures[-2]
        hold = [bool(row.label) and row.pressure_kPa == chosen for row in rows]
        return np.array(hold), f"all modes at {chosen:g} kPa"
    highest: dict[str | None, int] = {}
    for row in rows:
        if row.label and row.label.kind is None:
            name = row.label.family
            highest[name] = max(highest.get(name, 0), row.label.c)
    hold = [
        bool(row.label) and row.label.kind is None and row.label.c == highest[row.label.family]  # type: ignore[union-attr]
        for row in rows
    ]
    names = dict.fromkeys(str(row.label) for row, h in zip(rows, hold, strict=True) if h)
    return np.array(hold, bool), f"the highest harmonics, {' and '.join(names)}"


def shrink(problem: InverseProblem, key: str | None = None) -> Shrinkage | None:
    """Shrinkage by the effect ``key`` (None: the likeliest on the fitted rows); None where too
    few rows are left, or no effect is known."""
    hold, words = held_out(problem.observations.rows)
    keep, v = ~hold, len(problem.centre)
    if not problem.expansion.nodes or hold.sum() == 0 or keep.sum() <= v + 1:
        return None
    fitted = problem.only(keep)
    plain = refit(fitted, {}, 1)
    none = Hypothesis(NONE, 1.0, float(plain.ln_evidence[0]), {}, np.zeros(1), plain)
    candidates = [key.split("+")] if key else [[id] for id in problem.expansion.nodes]
    hypotheses = [explain(fitted, ids, prior=1.0) for ids in candidates]
    chosen = max(hypotheses, key=lambda h: h.ln_evidence)
    out = problem.only(hold)
    likeliest = lambda h: _errors(out, h, [int(np.argmax(h.posterior))])[0]
    before, after = _errors(out, none, [0])[0], likeliest(chosen)
    random = np.random.default_rng(SHRINKAGE_SEED)
    places = random.choice(len(chosen.posterior), DRAWS, p=chosen.posterior)
    normal = partial(random.multivariate_normal, method="cholesky")
    drawn = np.array([normal(chosen.fitted.d[i], chosen.fitted.covariance[i]) for i in places])
    samples = _errors(out, chosen, places, drawn)
    spread = np.sqrt(np.diag(out.sigma))
    rms = lambda e: np.sqrt(np.mean(np.square(e), axis=-1))
    several = list(chosen.values) if len(chosen.values) > 1 else []
    others = {id: [each for each in several if each != id] for id in several}
    each = {
        id: float(1 - rms(after) / rms(likeliest(explain(fitted, rest, prior=1.0))))
        for id, rest in others.items()
    }
    ratios = 1 - rms(samples) / rms(before)
    low, high = np.quantile(ratios, [0.05, 0.95])
    return Shrinkage(
        words,
        chosen.key,
        float(100 * rms(before)),
        float(100 * rms(after)),
        float(1 - rms(after) / rms(before)),
        float(low),
        float(high),
        _placebo(problem, hold, random),
        float(100 * rms(out.observations.scatter)),
        float(rms(before / spread)),
        float(rms(after / spread)),
        float(100 * rms(_least_squares(problem, hold, {}))),
        float(100 * rms(_least_squares(problem, hold, chosen.mean()))),
        each,
    )


def _least_squares(problem: InverseProblem, hold: Array, sizes: Mapping[str, float]) -> Array:
    """Errors in ln f on the held-out rows (n,) of run 0 after least squares of ln of its other
    frequencies, with effects of these sizes in the model. x has its prior as in all fits."""
    rows = problem.observations.rows
    used = ~hold & np.array([bool(row.label) and not row.run for row in rows])
    out = problem.only(hold & np.array([not row.run for row in rows]))
    effects = {id: np.array([e]) for id, e in sizes.items()}
    d, fitted = np.zeros(len(problem.centre)), problem.only(used)
    weight = 1 / np.sqrt(np.mean(fitted.observations.scatter**2))
    for _ in range(LEAST_SQUARES_STEPS):
        J = fitted.plain(d)[1] + fitted.added(effects, 1).tilt[0]
        errors = (fitted.observations.y - fitted.predicted(effects, d[None]))[0]
        tall = np.vstack([weight * J, np.diag(1 / problem.spread)])
        right = np.concatenate(
            [weight * errors, (problem.centre - problem.expansion.x0 - d) / problem.spread]
        )
        step = np.linalg.lstsq(tall, right, rcond=None)[0]
        d = d + step * min(1.0, MAX_STEP / max(abs(step).max(), 1e-300))
    return np.asarray(out.observations.y - out.predicted(effects, d[None]))[0]


def _errors(
    out: InverseProblem,
    hypothesis: Hypothesis,
    places: Sequence[int] | Array,
    d: Array | None = None,
) -> Array:
    """ln measured - ln predicted (q, n) on the held-out rows, at places (q,) of the hypothesis'
    grid; d (q, v): x - x0 there, if not the re-fitted ones."""
    effects = {id: e[places] for id, e in hypothesis.values.items()}
    zeta = float(hypothesis.fitted.zeta[int(np.argmax(hypothesis.posterior))])
    d = hypothesis.fitted.d[places] if d is None else d
    return np.asarray(out.observations.y - replace(out, zeta=zeta).predicted(effects, d))


def _placebo(problem: InverseProblem, hold: Array, random: np.random.Generator) -> float:
    """The 95 % quantile of R on tyres without any effect, linear in x about the plain fit."""
    keep = ~hold
    n, sigma, count = len(hold), problem.sigma, len(problem.centre)
    # by Cholesky's factor: the vectors of an SVD, the default, depend on the BLAS kernel
    noise = random.multivariate_normal(np.zeros(n), sigma, PLACEBOS, method="cholesky")
    _, J = problem.plain(np.zeros(count))
    best_ln, best = np.full(PLACEBOS, -np.inf), np.zeros((PLACEBOS, int(hold.sum())))
    information = np.diag(problem.spread**-2.0)

    def fitted(shift: Array, tilt: Array, error: Array | float) -> tuple[Array, Array]:
        """ln evidence up to a constant, and held-out errors, of the k placebos with an effect of
        this shift (n,), tilt (n, v) and covariance of its error (n, n)."""
        Je = J + tilt
        S = (sigma + error)[np.ix_(keep, keep)]
        inverse = np.linalg.inv(S)
        normal = Je[keep].T @ inverse @ Je[keep] + information
        r = noise - shift
        x = np.linalg.solve(normal, Je[keep].T @ inverse @ r[:, keep].T).T
        rest = r[:, keep] - x @ Je[keep].T
        ln = -np.einsum("kn,nm,km->k", rest, inverse, rest) / 2
        ln -= (np.linalg.slogdet(S)[1] + np.linalg.slogdet(normal)[1]) / 2
        return ln, r[:, hold] - x @ Je[hold].T

    zero, flat = np.zeros(n), np.zeros_like(J)
    _, before = fitted(zero, flat, 0.0)
    for id in problem.expansion.nodes:
        values, ln_weights = grid(problem.expansion.nodes[id])
        added = problem.added({id: values}, len(values))
        each = zip(added.shift, added.tilt, problem.response_covariance(added), strict=True)
        lns, errors = zip(*(fitted(*of_size) for of_size in each), strict=True)
        ln = np.logaddexp.reduce(np.array(lns) + ln_weights[:, None], axis=0)
        here = np.array(errors)[np.argmax(lns, axis=0), np.arange(PLACEBOS)]
        better = ln > best_ln
        best[better], best_ln = here[better], np.maximum(ln, best_ln)
    rms = lambda e: np.sqrt(np.mean(e**2, axis=1))
    return float(np.quantile(1 - rms(best) / rms(before), 0.95))
