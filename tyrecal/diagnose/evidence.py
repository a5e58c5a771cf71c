"""How probable each explanation is: evidence over design variables and effect parameters.

    ln Z(e) = -r^T S^-1 r / 2 - ln|2 pi S| / 2 - x^T x / 2 - ln|I + J^T S^-1 J| / 2 + ln p(splits)

at the re-fitted x, counted from its centre in units of its spread (Laplace's approximation;
MacKay, Information Theory, ch. 27-28); S: Sigma, and what the effect's law may be off. Then
Z = integral of Z(e) p(e) de, p(e) uniform over the range, by Gauss and Legendre's rule.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .covariance import alike
from .expansion import Nodes
from .problem import Problem

Array = np.ndarray
NONE, OUTSIDE = "none", "outside"
PRIOR_NONE, PRIOR_OUTSIDE, PRIOR_PAIRS = 0.25, 0.10, 0.03  # the singles share the rest
NODES, PAIR_NODES = 25, 15  # a parameter, and each of a pair
SHARP, ZOOMS = 2.0, 6  # fall of ln Z from the best node to its neighbours that asks for more nodes
STEPS = 6  # of Gauss and Newton, in a model that is quadratic and near its minimum
PARTNERS = 4  # singles that are tried with every other
UNKNOWN = (0.005, 0.01, 0.02, 0.04)  # shift of modes by what no catalogue holds
INFLATED = (2.0, 4.0)  # all of Sigma's standard deviations
MISREAD = 0.2  # of a frequency whose label is another mode's


@dataclass(frozen=True)
class Fitted:
    """Re-fits at parameters (q,): ln Z (q,), d = x - x0 (q, v), chi2 (q,) and the inverse of the
    posterior information about d, (q, v, v)."""

    ln_evidence: Array
    d: Array
    chi2: Array
    covariance: Array


@dataclass(frozen=True)
class Hypothesis:
    """An explanation: its key ("none", "outside", an id, "id1+id2"), prior probability, ln of its
    evidence, and over the grid of its parameters: values {id: (q,)}, ln of weight times prior
    density (q,), and the re-fits."""

    key: str
    prior: float
    ln_evidence: float
    values: Mapping[str, Array]
    ln_weights: Array
    fitted: Fitted | None
    words: str = ""

    @property
    def posterior(self) -> Array:
        """Probability (q,) of the grid's parameters."""
        assert self.fitted is not None
        ln = self.fitted.ln_evidence + self.ln_weights
        p = np.exp(ln - ln.max())
        return np.asarray(p / p.sum())

    @property
    def best(self) -> int:
        """The most probable parameters' place on the grid, its weights aside."""
        assert self.fitted is not None
        return int(np.argmax(self.fitted.ln_evidence))

    def mean(self) -> dict[str, float]:
        """Mean parameters."""
        return {id: float(self.posterior @ e) for id, e in self.values.items()}

    def quantile(self, id: str, share: float) -> float:
        """The parameter below which ``share`` of the probability lies."""
        order = np.argsort(self.values[id], kind="stable")
        e, p = self.values[id][order], self.posterior[order]
        return float(np.interp(share, np.cumsum(p) - p / 2, e))


def refit(
    problem: Problem,
    effects: Mapping[str, Array],
    count: int,
    extra: Array | None = None,
    sigma: Array | None = None,
) -> Fitted:
    """x re-fitted at each of ``count`` parameters. extra (n, n) or (q, n, n): more covariance."""
    y = problem.observations.y
    shift, tilt, split = problem.added(effects, count)
    S = (problem.sigma if sigma is None else sigma) + problem.law(shift)
    if extra is not None:
        S = S + extra
    inverse = np.linalg.inv(S)
    _, ln_det = np.linalg.slogdet(S)
    centre = problem.centre - problem.expansion.x0
    information = np.diag(problem.spread**-2.0)
    eta0, J0 = problem.plain(np.zeros_like(centre))
    H = problem.expansion.hessian[problem.places]
    by_variable = H.transpose(2, 0, 1).reshape(len(centre), -1)
    d = np.zeros((count, len(centre)))
    for step in range(STEPS + 1):
        bent = (d @ by_variable).reshape(tilt.shape)
        J = J0 + bent + tilt
        r = y - eta0 - shift - ((J0 + bent / 2 + tilt) @ d[:, :, None])[:, :, 0]
        weighted = inverse @ J
        normal = weighted.transpose(0, 2, 1) @ J + information
        if step == STEPS:
            break
        slope = (r[:, None, :] @ weighted)[:, 0] + (centre - d) @ information
        d = d + np.linalg.solve(normal, slope[:, :, None])[:, :, 0]
    chi2 = ((r[:, None, :] @ inverse)[:, 0] * r).sum(1)
    off = (d - centre) / problem.spread
    _, ln_normal = np.linalg.slogdet(normal * np.outer(problem.spread, problem.spread))
    n = len(y)
    ln_evidence = -(chi2 + ln_det + n * np.log(2 * np.pi) + (off**2).sum(1) + ln_normal) / 2
    return Fitted(ln_evidence + ln_splits(problem, split), d, chi2, np.linalg.inv(normal))


def ln_splits(problem: Problem, split: Array) -> Array:
    """ln p(splits) (q,) where pairs should be ``split`` (q, n) apart.

    Folded normal distribution: s = |N(split, tau^2)|, tau with the non-uniformity that every
    tyre has.
    """
    s = problem.observations.split
    seen = np.isfinite(s)
    tau = np.hypot(problem.observations.split_scatter[seen], problem.assumed.split)
    apart, s = split[:, seen], s[seen]
    ln = np.logaddexp(-(((s - apart) / tau) ** 2) / 2, -(((s + apart) / tau) ** 2) / 2)
    return np.asarray((ln - np.log(tau) - np.log(2 * np.pi) / 2).sum(1))


def weigh(
    problem: Problem, ids: Sequence[str] | None = None, pairs: bool = True
) -> list[Hypothesis]:
    """Every hypothesis with its evidence: none, outside, singles, pairs of the best with all."""
    ids = list(problem.expansion.nodes) if ids is None else list(ids)
    sigma = problem.sigma
    plain = refit(problem, {}, 1, sigma=sigma)
    none = Hypothesis(NONE, PRIOR_NONE, float(plain.ln_evidence[0]), {}, np.zeros(1), plain)
    singles = 1 - PRIOR_NONE - PRIOR_OUTSIDE - (PRIOR_PAIRS if len(ids) > 1 and pairs else 0)
    found = [single(problem, id, singles / len(ids), sigma=sigma) for id in ids]
    result = [none, outside(problem, sigma), *found]
    if pairs:
        result += _pairs(problem, found, sigma)
    return result


def probabilities(hypotheses: Sequence[Hypothesis]) -> dict[str, float]:
    """Posterior probability by key; they sum to 1."""
    ln = np.array([h.ln_evidence + np.log(h.prior) for h in hypotheses])
    p = np.exp(ln - ln.max())
    return {h.key: float(x) for h, x in zip(hypotheses, p / p.sum(), strict=True)}


def single(problem: Problem, id: str, prior: float, sigma: Array | None = None) -> Hypothesis:
    """One effect over its range."""
    return _hypothesis(problem, id, prior, [id], NODES, sigma)


def pair(
    problem: Problem, first: str, second: str, prior: float, sigma: Array | None = None
) -> Hypothesis:
    """Two effects at once; what they add is added up."""
    return _hypothesis(problem, f"{first}+{second}", prior, [first, second], PAIR_NODES, sigma)


def _pairs(problem: Problem, singles: Sequence[Hypothesis], sigma: Array) -> Iterable[Hypothesis]:
    """Forward stepping: the best singles, each with every other effect."""
    order = [h.key for h in singles]
    if len(order) < 2:
        return []
    best = sorted(singles, key=lambda h: -h.ln_evidence)[:PARTNERS]
    chosen = {h.key for h in best}
    tried = [two for two in combinations(order, 2) if chosen & set(two)]
    prior = PRIOR_PAIRS / (len(order) * (len(order) - 1) / 2)
    return [pair(problem, a, b, prior, sigma) for a, b in tried]


def outside(problem: Problem, sigma: Array | None = None) -> Hypothesis:
    """What the catalogue does not hold: half of it unknown effects, half errors of reading.

    Unknown effects shift modes by a random amount each, alike at all pressures, or all of Sigma
    is too small; an error of reading: one label is another mode's at all pressures. ``words``
    names the likeliest.
    """
    sigma = problem.sigma if sigma is None else sigma
    rows = problem.observations.rows
    same = alike(rows) * [row.label is not None for row in rows]
    unknown: list[tuple[str, Array]] = [
        (f"modes are off by {size:.1%} in a way of their own", size**2 * same) for size in UNKNOWN
    ]
    unknown += [(f"all scatter is {k:g} times as large", (k**2 - 1) * sigma) for k in INFLATED]
    reading: list[tuple[str, Array]] = []
    for label in sorted({row.label for row in rows if row.label}, key=str):
        hit = np.array([row.label == label for row in rows])
        reading.append((f"{label.said} is misread", MISREAD**2 * same * np.outer(hit, hit)))
    parts: list[tuple[float, str, Fitted]] = []
    for group in (unknown, reading):
        for words, extra in group:
            parts.append((0.5 / len(group), words, refit(problem, {}, 1, extra, sigma)))
    ln = np.array([np.log(p) + f.ln_evidence[0] for p, _, f in parts])
    best = int(np.argmax(ln))
    return Hypothesis(
        OUTSIDE,
        PRIOR_OUTSIDE,
        float(np.logaddexp.reduce(ln)),
        {},
        np.zeros(1),
        parts[best][2],
        parts[best][1],
    )


def _hypothesis(
    problem: Problem, key: str, prior: float, ids: list[str], count: int, sigma: Array | None
) -> Hypothesis:
    """One or two effects over their ranges; where a peak is narrow, nodes gather about it.

    The nodes within two places of the best one give way to a rule of their own on the box
    between, until ln Z falls gently from the best node to its neighbours.
    """
    box = [problem.expansion.nodes[id].reach for id in ids]
    ranges = [high - low for low, high in box]
    kept: list[tuple[Array, Array, Fitted]] = []
    for zoom in range(ZOOMS + 1):
        axes = [_rule(low, high, count) for low, high in box]
        mesh = np.meshgrid(*(points for points, _ in axes), indexing="ij")
        values = np.array([each.ravel() for each in mesh])
        weights = np.meshgrid(
            *(w / width for (_, w), width in zip(axes, ranges, strict=True)), indexing="ij"
        )
        ln_weights = np.log(np.prod(weights, axis=0)).ravel()
        fitted = refit(problem, dict(zip(ids, values, strict=True)), values.shape[1], sigma=sigma)
        ln = fitted.ln_evidence.reshape([count] * len(ids))
        best = np.unravel_index(int(np.argmax(ln)), ln.shape)
        inner = [slice(max(0, b - 1), b + 2) for b in best]
        cross = [
            ln[tuple(part if i == j else b for j, b in enumerate(best))]
            for i, part in enumerate(inner)
        ]
        if zoom == ZOOMS or max(ln[best] - each.min() for each in cross) < SHARP:
            kept.append((values, ln_weights, fitted))
            break
        for i, ((points, _), b) in enumerate(zip(axes, best, strict=True)):
            low, high = box[i]
            low = float(points[b - 2]) if b >= 2 else low
            box[i] = low, float(points[b + 2]) if b + 2 < count else high
        outside_box = ~np.all(
            [(v >= low) & (v <= high) for v, (low, high) in zip(values, box, strict=True)], axis=0
        )
        kept.append((values[:, outside_box], ln_weights[outside_box], _some(fitted, outside_box)))
    joined = Fitted(
        *(
            np.concatenate([getattr(f, name) for _, _, f in kept])
            for name in ("ln_evidence", "d", "chi2", "covariance")
        )
    )
    values = np.concatenate([v for v, _, _ in kept], axis=1)
    ln_weights = np.concatenate([w for _, w, _ in kept])
    total = float(np.logaddexp.reduce(joined.ln_evidence + ln_weights))
    return Hypothesis(key, prior, total, dict(zip(ids, values, strict=True)), ln_weights, joined)


def _some(fitted: Fitted, mask: Array) -> Fitted:
    return Fitted(
        fitted.ln_evidence[mask], fitted.d[mask], fitted.chi2[mask], fitted.covariance[mask]
    )


def _rule(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Gauss and Legendre's points and weights (count,) on an interval."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return low + (high - low) * (points + 1) / 2, weights * (high - low) / 2


def grid(nodes: Nodes, count: int = NODES) -> tuple[Array, Array]:
    """Parameters (count,) over the reach and ln of weight times density, which sum to 1."""
    low, high = nodes.reach
    points, weights = _rule(low, high, count)
    return points, np.log(weights / (high - low))
