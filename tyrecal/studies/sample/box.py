"""The box of an emulator, grown until it holds the posterior."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from .chains import Chains, walk
from .posterior import Posterior

Array = np.ndarray
EDGE = 0.05  # of half a box: what lies there is at its edge
AT_EDGE = 1e-3  # of the draws, that may
GROWTH, GROWTHS = 0.25, 8  # of a box, at a side; times
PROBES = 10_000  # by which a box is tried
PROBE_FREEDOM = 4  # of their distribution, whose tails are wider than the posterior's
LIKELY = 10.0  # below the highest ln p: optima that walkers start from


@dataclass(frozen=True)
class Draws:
    """A posterior with its draws."""

    posterior: Posterior
    optima: Array  # (o, v) coordinates x of the o optima of the density
    height: Array  # (o,) ln p at the optima
    covariance: Array  # (v, v) the linear one about the first optimum
    chains: Chains
    at_edge: Array  # (v, 2) share of the draws at each edge of the box that is none of the bounds
    boxes: int  # how many it took
    evaluations: int  # how many it took
    stopped: str  # why the box grew no more, "" where it holds the posterior


def sample_box(posterior: Posterior, bounds: Array, count: int, seed: int) -> Draws:
    """About ``count`` draws from all likely optima on; bounds (v, 2) of x."""
    best, height = posterior.optima
    information, flat = posterior.information(best[:1])[0], _flat(posterior.box)
    covariance = np.linalg.inv(information + 1e-12 * flat)  # of what the data see
    likely = best[height > height[0] - LIKELY]
    chains = walk(posterior, likely, np.linalg.inv(information + flat), count, seed)
    edges = shares_at_edge(chains.flat, posterior.box, bounds)
    evaluations = posterior.evaluations
    return Draws(posterior, best, height, covariance, chains, edges, 1, evaluations, "")


def _flat(box: Array) -> Array:
    """Information (v, v) in addition to that of the data: what they do not see is not wider than a
    box."""
    return np.diag((np.ptp(box, axis=1) / 2) ** -2.0)


def edge_probability(posterior: Posterior, bounds: Array, seed: int) -> Array:
    """Forecast of `shares_at_edge` (v, 2) of the posterior's draws by importance sampling: draws of
    Student's t about the likely optima, each weighted by the posterior's density over theirs."""
    best, height = posterior.optima
    best = best[height > height[0] - LIKELY]  # (o, v); the n draws x are `PROBES` in all
    size, count = best.shape[1], -(-PROBES // len(best))
    random = np.random.default_rng([seed, 2])
    roots = np.linalg.cholesky(posterior.information(best) + _flat(posterior.box))  # (o, v, v)
    z = random.normal(size=(len(best), count, size))
    z /= np.sqrt(random.chisquare(PROBE_FREEDOM, (len(best), count, 1)) / PROBE_FREEDOM)
    x = (best[:, None] + z @ np.linalg.inv(roots)).reshape(-1, size)
    away = ((x[:, None] - best)[:, :, None] @ roots)[:, :, 0]  # (n, o, v)
    tail = (1 + (away**2).sum(2) / PROBE_FREEDOM) ** (-(PROBE_FREEDOM + size) / 2)
    theirs = tail @ np.prod(np.einsum("ovv->ov", roots), axis=1)
    ln_p = posterior(x)
    return shares_at_edge(x, posterior.box, bounds, np.exp(ln_p - ln_p.max()) / theirs)


def grow_box(
    ask: Callable[[Array], Posterior],
    box: Array,
    bounds: Array,
    tolerance: Array,
    count: int,
    seed: int,
    stage: Callable[[bool], None] = lambda sampling: None,
) -> Draws:
    """Draws from a box (v, 2) with less than `AT_EDGE` of them at its edges, or from the last one
    that could be had.

    ask: the posterior on an emulator of a box, each one larger than the last. tolerance (n,): its
    largest rms errors of ln f, row by row. stage: called with True if sampling begins, with False
    if evaluating. Raises what ``ask`` does of the first box.
    """
    last: Posterior | None = None
    evaluations, boxes, stopped = 0, 0, f"it was made larger {GROWTHS} times"
    for _ in range(GROWTHS + 1):
        stage(False)
        try:
            posterior = ask(box)
        except EvaluationFailed as failure:
            if last is None:
                raise
            stopped = f"a larger box has no emulator: {failure}"
            break
        evaluations = posterior.evaluations  # those of smaller boxes among them
        error = np.sqrt(np.diag(posterior.emulator_covariance))
        if last and (error > tolerance).any():
            stopped = f"the emulator of a larger box is {100 * error.max():.2g} % (rms) off"
            break
        stage(True)
        boxes, last = boxes + 1, posterior
        at_edge = edge_probability(posterior, bounds, seed)
        if at_edge.sum() < AT_EDGE:
            result = sample_box(posterior, bounds, count, seed)
            if result.at_edge.sum() < AT_EDGE:
                return replace(result, boxes=boxes, evaluations=evaluations)
            at_edge = result.at_edge
        box = larger(box, bounds, at_edge)
    assert last
    result = sample_box(last, bounds, count, seed)
    return replace(result, boxes=boxes, evaluations=evaluations, stopped=stopped)


def shares_at_edge(x: Array, box: Array, bounds: Array, weights: Array | None = None) -> Array:
    """Share (v, 2) of draws x (n, v), which count by ``weights`` (n,), at each edge; 0 where it is
    a bound of the variable."""
    near = EDGE * np.ptp(box, axis=1) / 2
    share = lambda there: np.average(there, 0, weights)
    low, high = share(x < box[:, 0] + near), share(x > box[:, 1] - near)
    inner = abs(box - bounds) > 1e-9 * np.ptp(bounds, axis=1)[:, None]
    return np.stack([low, high], 1) * inner


def larger(box: Array, bounds: Array, at_edge: Array) -> Array:
    """The box (v, 2) moved outwards where draws are at its edge, at most to the bounds."""
    out = GROWTH * np.ptp(box, axis=1)[:, None] * np.array([-1, 1])
    moved = np.where(at_edge >= AT_EDGE / at_edge.size, box + out, box)
    return np.clip(moved, bounds[:, :1], bounds[:, 1:])
