"""How probable each explanation is: evidence over design variables and effect parameters.

    ln Z(e) = -r^T S^-1 r / 2 - ln|2 pi S| / 2 - x^T x / 2 - ln|I + J^T S^-1 J| / 2 + ln p(splits)

plus ln p(damping ratios) (`inference.damping`), at the re-fitted x, here less its centre, over its
spread (Laplace's approximation; MacKay, Information Theory, ch. 27-28). r: residual in ln f; S: the
problem's Sigma plus the covariance of the effect's shift by `Effect.response_error` and
`Effect.shape_uncertainty`. Then Z = integral of Z(e) p(e) de by the Gauss-Legendre rule, p(e)
uniform over the range.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from ..inference.covariance import between_runs, of_one_mode
from ..inference.expansion import EffectResponse
from ..inference.inverse_problem import Added, InverseProblem
from ..inference.observations import Observable
from ..inference.veering import rule
from .gap import family

Array = np.ndarray
NONE: Final = "none"
OUTSIDE: Final = "outside"
PRIOR_OUTSIDE: Final = 0.10  # prior of a cause that no effect of the catalogue explains
RULE_POINTS = {1: 25, 2: 15, 3: 9}  # points of the rule in each parameter, by number of effects
FEW_POINTS = {2: 7, 3: 5}  # fewer points, with ln Z within 0.5, to find the sets that matter
COVERAGE = 2.0  # standard deviations within which a stated number may be off (GUM, k = 2)
SHARP_FALL = 2.0  # fall of ln Z from the best point to a neighbour above which points are added
MAX_ZOOMS = 6  # refinements of a grid about its best point
REFIT_STEPS = 16  # Gauss-Newton steps, halved if the misfit rises, of a model quadratic in x
COUPLED_STEPS = 8  # further steps if near modes are coupled
REFITS_AT_ONCE = 256  # that share each step: more would take memory and no less time
REFITTED = 1e-6  # expected fall of the misfit below which a re-fit has converged
FAR_BELOW, ABOVE_POINTS = 20.0, 1.0  # limits of a spline in ln Z: below and above its best point
# standard deviations of shifts of ln f by causes outside the catalogue
UNKNOWN = (0.005, 0.01, 0.02, 0.04)
UNKNOWN_ALIKE = 0.9  # correlation of such a shift of a mode in two states
SMOOTH_HARMONICS, SMOOTH_LN_F = 2.0, 0.5  # correlation lengths of smooth shifts, in c and in ln f
INFLATION = (2.0, 4.0)  # factors on all standard deviations of Sigma
MISREAD = 0.2  # standard deviation of ln f of a frequency that has the label of another mode


class Fitted(NamedTuple):
    """Re-fits of the variables x at each of q parameters, integrated over zeta of `veering`."""

    ln_evidence: Array  # (q,)
    d: Array  # x - x0 (q, v), at the likeliest zeta
    chi2: Array  # (q,)
    covariance: Array  # of d (q, v, v): the inverse of its posterior information
    # (q, k) posterior density, times a factor, at each zeta of `veering.rule`; k = 0: no coupled
    # modes
    coupled: Array

    @property
    def zeta(self) -> Array:
        """The likeliest zeta (q,), the coupling of near modes; 0 if none are coupled."""
        count, points = self.coupled.shape
        return rule()[0][self.coupled.argmax(1)] if points else np.zeros(count)


@dataclass(frozen=True)
class Hypothesis:
    """An explanation of the data, over a grid of q parameters."""

    key: str  # "none", "outside", an id, "id1+id2", "id1+id2+id3"
    prior: float  # probability before the data
    ln_evidence: float  # ln Z
    values: Mapping[str, Array]  # parameters (q,) by id
    ln_weights: Array  # ln of weight times prior density (q,)
    fitted: Fitted
    words: str = ""  # description for people
    # first and last parameter of the whole grid by id: ``values`` may be a part of it
    ends: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    prior_sd: Mapping[str, float] = field(default_factory=dict)  # by id, see `EffectRange.prior_sd`
    few: bool = False  # whether its grid has `FEW_POINTS`

    @property
    def posterior(self) -> Array:
        """Probability (q,) of the grid's parameters."""
        ln = self.fitted.ln_evidence + self.ln_weights
        p = np.exp(ln - ln.max())
        return np.asarray(p / p.sum())

    @property
    def best(self) -> int:
        """Index of the parameters with the largest evidence; weights of the grid do not count."""
        return int(np.argmax(self.fitted.ln_evidence))

    @property
    def at_bound(self) -> list[str]:
        """Effects that would fit better, by more than chance, at a size beyond the grid's end: by
        the parabola through ln Z there, the best size is `COVERAGE` standard deviations beyond."""
        bounded, ln = [], self.fitted.ln_evidence
        for id, values in self.values.items():
            e = values[self.best]
            low, high = self.ends.get(id, (values.min(), values.max()))
            if low < high and ((e == high and e > 0) or (e == low and e < 0)):
                inwards = np.unique(abs(e - values))
                profile = np.array([ln[abs(e - values) == each].max() for each in inwards])
                near = (profile > profile[0] - COVERAGE) | (np.arange(len(profile)) < 3)
                parabola = np.polyfit(inwards[near], profile[near], 2) if near.sum() > 2 else [0, 0]
                bend, slope = parabola[:2]
                if bend >= 0 or -slope > COVERAGE * np.sqrt(-2 * bend):
                    bounded.append(id)
        return bounded

    def shares(self, p: Array) -> dict[str, float]:
        """Share of ``p`` (q,) over the grid by key: a size within `COVERAGE` standard deviations of
        what the case states is that constant's, and no effect."""
        ids = self.key.split("+")
        off = [abs(self.values[id]) > COVERAGE * sd for id, sd in self.prior_sd.items()]
        by_key: dict[str, float] = {}
        for beyond in product((True, False), repeat=len(off)):
            here = [x == y for x, y in zip(off, beyond, strict=True)]
            within = {id for id, far in zip(self.prior_sd, beyond, strict=True) if not far}
            key = "+".join(id for id in ids if id not in within) or NONE
            by_key[key] = float(p[np.all(here, axis=0)].sum()) if here else float(p.sum())
        return by_key

    def typical(self, count: int) -> dict[str, Array]:
        """Equally probable parameters (count,)."""
        below = np.cumsum(self.posterior)
        at = np.searchsorted(below, below[-1] * (np.arange(count) + 0.5) / count)
        return {id: e[at] for id, e in self.values.items()}

    def mean(self) -> dict[str, float]:
        """Mean parameters."""
        return {id: float(self.posterior @ e) for id, e in self.values.items()}

    def quantile(self, id: str, share: float) -> float:
        """The parameter below which ``share`` of the probability lies."""
        return quantile(self.values[id], self.posterior, share)


def quantile(values: Array, p: Array, share: float) -> float:
    """The value below which ``share`` of the probabilities p (q,) lies."""
    order = np.argsort(values, kind="stable")
    values, p = values[order], p[order]
    return float(np.interp(share, np.cumsum(p) - p / 2, values))


def refit(
    problem: InverseProblem,
    effects: Mapping[str, Array],
    count: int,
    extra: Array | None = None,
    among: Mapping[int, float] | None = None,
    near: Array | None = None,
) -> Fitted:
    """x re-fitted at each of ``count`` parameters, integrated over the coupling zeta of near modes.

    extra (n, n) or (q, n, n): more covariance; among: {index in `veering.rule`: share of Z}, to use
    only these points of the rule (`coupled_most`); near: x - x0 (q, v) to start from.
    """
    added = problem.added(effects, count)
    if near is None or not problem.integrand:
        start = np.zeros((count, len(problem.centre))) if near is None else near
        plain = refit_at(problem, [problem], added, extra, start, REFIT_STEPS)
        if not problem.integrand:
            return Fitted(*(part[0] for part in plain))
        near = plain.d[0]
    points = list(among) if among else list(range(len(problem.integrand)))
    at = [problem.integrand[k] for k in points]
    ln, d, chi2, covariance, _ = refit_at(problem, at, added, extra, near, COUPLED_STEPS)
    zeta, total = rule()[0], over_zeta(ln, among)
    ln_prior = -(zeta[points, None] ** 2) / 2
    best, every = np.argmax(ln + ln_prior, axis=0), np.arange(count)
    p = np.exp(ln + ln_prior - np.logaddexp.reduce(ln + ln_prior))
    apart = d - d[best, every]
    spread = covariance + apart[..., :, None] * apart[..., None, :]
    coupled = np.zeros((count, len(zeta)))
    coupled[:, points] = np.exp(ln + ln_prior - total).T
    pooled = np.einsum("kq,kqvw->qvw", p, spread)
    return Fitted(total, d[best, every], chi2[best, every], pooled, coupled)


def over_zeta(ln: Array, among: Mapping[int, float] | None = None) -> Array:
    """ln of the integral (q,) over zeta of an integrand, from its logarithms ln (k, q) at the
    points of `veering.rule`, or at those of ``among`` only."""
    zeta, between, ln_weights = rule()
    if among:
        ln_prior = -(zeta[list(among), None] ** 2) / 2
        return np.asarray(np.logaddexp.reduce(ln + ln_prior) - np.log(sum(among.values())))
    lifted = np.maximum(ln, ln.max(0) - FAR_BELOW)
    finer = np.minimum(between @ lifted, ln.max(0) + ABOVE_POINTS)
    return np.asarray(np.logaddexp.reduce(finer + ln_weights[:, None]))


def model_of(
    problem: InverseProblem, at: Sequence[InverseProblem], added: Added
) -> Callable[[Array], tuple[Array, Array, Array]]:
    """The model as a function of d = x - x0 (k, q, v): eta (k, q, n), d eta / dx (k, q, n, v) and
    ln p of the labels (k, q).

    Effects are ``added`` to uncoupled modes; then modes are coupled with the zeta of each of the k
    problems ``at``.
    """
    eta0, J0 = problem.plain(np.zeros_like(problem.centre))
    H = problem.expansion.hessian[problem.places]
    by_variable = H.transpose(2, 0, 1).reshape(len(problem.centre), -1)
    zeta = np.array([each.zeta for each in at])[:, None, None]

    def model(d: Array) -> tuple[Array, Array, Array]:
        bent = (d @ by_variable).reshape(len(d), *added.tilt.shape)
        eta = eta0 + added.shift + ((J0 + bent / 2 + added.tilt) @ d[..., None])[..., 0]
        return problem.veering.coupled(eta, J0 + bent + added.tilt, zeta)

    return model


def refit_at(
    problem: InverseProblem,
    at: Sequence[InverseProblem],
    added: Added,
    extra: Array | None,
    d: Array,
    steps: int,
) -> Fitted:
    """x re-fitted from x0 + d (q, v) at the zeta of each of k problems ``at``, some of these in the
    same steps; all arrays with k before q; other arguments as in `model_of`."""
    most = max(REFITS_AT_ONCE // len(d), 1)
    if len(at) > most:
        groups = [at[i : i + most] for i in range(0, len(at), most)]
        fitted = [refit_at(problem, some, added, extra, d, steps) for some in groups]
        return Fitted(*map(np.concatenate, zip(*fitted, strict=True)))
    y, model = problem.observations.y, model_of(problem, at, added)
    S = np.stack([p.sigma + problem.response_covariance(p.with_mixed_laws(added)) for p in at])
    if extra is not None:
        S = S + extra
    inverse = np.linalg.inv(S)
    _, ln_det = np.linalg.slogdet(S)
    centre = problem.centre - problem.expansion.x0
    information = np.diag(problem.spread**-2.0)
    best: tuple[Array, ...] | None = None
    d = np.broadcast_to(d, (len(at), *d.shape))
    share = np.ones(d.shape[:2])
    while True:
        eta, J, ln_label = model(d)
        r = y - eta
        weighted = inverse @ np.concatenate([J, r[..., None]], -1)
        both = weighted.swapaxes(-1, -2) @ J
        chi2, off = (weighted[..., -1] * r).sum(-1), (d - centre) / problem.spread
        slope = both[..., -1, :] - off / problem.spread
        misfit = chi2 + (off**2).sum(-1)
        normal = both[..., :-1, :] + information
        here: tuple[Array, ...] = (misfit, d, chi2, ln_label, normal, slope)
        if best is not None:  # where the misfit rose, from the best point half as far
            rose = here[0] > best[0]
            share = np.where(rose, share / 2, 1.0)
            for new, old in zip(here, best, strict=True):
                new[rose] = old[rose]
        best = here
        _, d, chi2, ln_label, normal, slope = best
        step = share[..., None] * np.linalg.solve(normal, slope[..., None])[..., 0]
        if not steps or (step * slope).sum(-1).max() < REFITTED:
            break
        d, steps = d + step, steps - 1
    off = (d - centre) / problem.spread
    _, ln_normal = np.linalg.slogdet(normal * np.outer(problem.spread, problem.spread))
    n = len(y)
    ln_evidence = -(chi2 + ln_det + n * np.log(2 * np.pi) + (off**2).sum(-1) + ln_normal) / 2
    ln_evidence += problem.splits.ln_likelihood(added.split) + ln_label
    if problem.damping:
        damping = added.damping
        ln_evidence += [
            problem.damping.ln_likelihood(damping, *each) for each in zip(d, normal, strict=True)
        ]
    return Fitted(ln_evidence, d, chi2, np.linalg.inv(normal), np.zeros((*chi2.shape, 0)))


class Family(NamedTuple):
    """A family of errors that the catalogue does not have."""

    words: str  # for the verdict
    extra: Array  # (n, n) additional covariance of ln f
    reading: bool = False  # whether it is an error of reading, and not of the model


def outside(problem: InverseProblem) -> Hypothesis:
    """Hypothesis that the cause is outside the catalogue; ``words`` names the likeliest family."""
    known = families(problem)
    fitted = refit(problem, {}, len(known), np.array([each.extra for each in known]))
    ln = fitted.ln_evidence + ln_shares(known)
    total, k = float(np.logaddexp.reduce(ln)), int(np.argmax(ln))
    best = Fitted(*(part[k : k + 1] for part in fitted))
    return Hypothesis(OUTSIDE, PRIOR_OUTSIDE, total, {}, np.zeros(1), best, known[k].words)


def families(problem: InverseProblem) -> list[Family]:
    """Unknown effects and errors of reading.

    Unknown effects shift modes by a random amount each, or smoothly over the harmonic, each family
    by itself, or smoothly over the frequency, alike in all states; or all of Sigma is too small.
    An error of reading: one label is another mode's at all pressures.
    """
    rows = problem.observations.rows
    between = np.array([[1.0 if a.state == b.state else UNKNOWN_ALIKE for b in rows] for a in rows])
    same = (
        of_one_mode(rows) * between * between_runs(rows) * [row.label is not None for row in rows]
    )
    result = [
        Family(f"modes are off by {100 * size:.1f} % in a way of their own", size**2 * same)
        for size in UNKNOWN
    ]
    for over, together in _smooth(rows, problem.observations.y):
        words = f"smoothly over {over}"
        result += [
            Family(f"modes are off by {100 * size:.1f} %, {words}", size**2 * between * together)
            for size in UNKNOWN
        ]
    result += [
        Family(f"all scatter is {k:g} times as large", (k**2 - 1) * problem.sigma)
        for k in INFLATION
    ]
    for label in sorted({row.label for row in rows if row.label}, key=str):
        hit = np.array([row.label == label for row in rows])
        misread = MISREAD**2 * same * np.outer(hit, hit)
        result.append(Family(f"{label.display} is misread", misread, reading=True))
    return result


def ln_shares(known: Sequence[Family]) -> Array:
    """ln of the prior of each family (k,): half for unknown effects, half for errors of reading."""
    reading = np.array([each.reading for each in known])
    return np.asarray(-np.log(2 * np.where(reading, reading.sum(), (~reading).sum())))


def _smooth(rows: Sequence[Observable], y: Array) -> list[tuple[str, Array]]:
    """Correlations (n, n) of modes, y = ln f, by trends, with words for each."""
    kinds, modal = [family(row) for row in rows], np.array([row.label is not None for row in rows])
    c = np.array([row.label.c if row.label else 0.0 for row in rows])
    same = np.array([[a is not None and a == b for b in kinds] for a in kinds])
    near = lambda x, length: np.exp(-((x[:, None] - x) ** 2) / (2 * length**2))
    return [
        ("the harmonic, each family by itself", same * near(c, SMOOTH_HARMONICS)),
        ("the frequency", np.outer(modal, modal) * near(y, SMOOTH_LN_F)),
    ]


def explain(
    problem: InverseProblem,
    ids: Sequence[str],
    prior: float,
    among: Mapping[int, float] | None = None,
    few: bool = False,
) -> Hypothesis:
    """Hypothesis of one to three effects over their ranges; their contributions are added.

    If the peak of ln Z is narrow, the grid is refined: the points within two places of the best one
    are replaced by a new rule on their box, until ln Z falls gently from the best point to its
    neighbours. ``among``: see `refit`; few: use `FEW_POINTS`.
    """
    box = [problem.expansion.nodes[id].reach for id in ids]
    widths = [high - low for low, high in box]
    count, kept = (FEW_POINTS if few else RULE_POINTS)[len(ids)], []
    for zoom in range(MAX_ZOOMS + 1):
        rules = [_rule(low, high, count) for low, high in box]
        values = _grid([points for points, _ in rules])
        shares = _grid([w / width for (_, w), width in zip(rules, widths, strict=True)])
        ln_weights = np.log(np.prod(shares, axis=0))
        effects = dict(zip(ids, values, strict=True))
        fitted = refit(problem, effects, values.shape[1], among=among)
        ln = fitted.ln_evidence.reshape([count] * len(ids))
        best = [int(b) for b in np.unravel_index(int(np.argmax(ln)), ln.shape)]
        outer = np.ones(values.shape[1], bool)
        if narrow := zoom < MAX_ZOOMS and _fall(ln, best) >= SHARP_FALL:
            for i, ((points, _), b, (low, high)) in enumerate(zip(rules, best, box, strict=True)):
                low = float(points[b - 2]) if b >= 2 else low
                box[i] = low, float(points[b + 2]) if b + 2 < count else high
            ends = np.array(box)
            outer = ~np.all((values >= ends[:, :1]) & (values <= ends[:, 1:]), axis=0)
        kept.append((values[:, outer], ln_weights[outer], *(part[outer] for part in fitted)))
        if not narrow:
            break
    values = np.concatenate([each[0] for each in kept], axis=1)
    ln_weights, *parts = map(np.concatenate, zip(*(each[1:] for each in kept), strict=True))
    joined = Fitted(*parts)
    total = float(np.logaddexp.reduce(joined.ln_evidence + ln_weights))
    by_id = dict(zip(ids, values, strict=True))
    return Hypothesis(
        "+".join(ids),
        prior,
        total,
        by_id,
        ln_weights,
        joined,
        ends={id: (float(e.min()), float(e.max())) for id, e in by_id.items()},
        prior_sd={id: problem.ranges[id].prior_sd for id in ids if problem.ranges[id].prior_sd},
        few=few,
    )


def _fall(ln: Array, best: Sequence[int]) -> float:
    """The largest fall from the best point of a grid to a neighbour along an axis."""
    lowest = []
    for axis, b in enumerate(best):
        line = np.moveaxis(ln, axis, -1)[(*best[:axis], *best[axis + 1 :])]
        lowest.append(line[max(0, b - 1) : b + 2].min())
    return float(ln[tuple(best)] - min(lowest))


def _grid(axes: Sequence[Array]) -> Array:
    """All combinations (axes, q) of the values on the axes."""
    return np.array([each.ravel() for each in np.meshgrid(*axes, indexing="ij")])


def _rule(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Points and weights (count,) of Gauss-Legendre quadrature on an interval."""
    points, weights = _gauss_legendre(count)
    return low + (high - low) * (points + 1) / 2, weights * (high - low) / 2


@lru_cache
def _gauss_legendre(count: int) -> tuple[Array, Array]:
    """Points and weights (count,) on -1 to 1, kept: callers must not change them."""
    return np.polynomial.legendre.leggauss(count)


def grid(nodes: EffectResponse) -> tuple[Array, Array]:
    """Parameters (q,) over the range of an effect, and ln of their prior weights, which sum to
    1."""
    low, high = nodes.reach
    points, weights = _rule(low, high, RULE_POINTS[1])
    return points, np.log(weights / (high - low))
