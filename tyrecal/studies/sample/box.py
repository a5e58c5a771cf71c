"""The box of an emulator, grown until it holds the posterior."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from .chains import Chains, walk
from .posterior import Posterior, optima

Array = np.ndarray
EDGE = 0.05  # of half a box: what lies there is at its edge
AT_EDGE = 1e-3  # of the draws, that may
GROWTH, GROWTHS = 0.25, 8  # of a box, at a side; times
PROBE = 0.1  # of the draws, by which a box is tried
LIKELY = 10.0  # below the highest ln p: optima that walkers start from


@dataclass(frozen=True)
class Drawn:
    """A posterior with its draws. optima (o, v), ln p (o,) there; covariance (v, v): the linear one
    about the first; at_edge (v, 2): share of the draws at each edge of the box that is none of the
    bounds; boxes, evaluations: how many it took; stopped: why the box grew no more, "" where it
    holds the posterior."""

    posterior: Posterior
    optima: Array
    height: Array
    covariance: Array
    chains: Chains
    at_edge: Array
    boxes: int
    evaluations: int
    stopped: str


def drawn(posterior: Posterior, bounds: Array, count: int, seed: int) -> Drawn:
    """About ``count`` draws from all likely optima on; bounds (v, 2) of x."""
    best, height = optima(posterior)
    half = np.ptp(posterior.box, axis=1) / 2
    flat = np.diag(half**-2.0)  # what the data do not see is not wider than the box
    covariance = np.linalg.inv(posterior.information(best[:1])[0] + 1e-12 * flat)
    begin = np.linalg.inv(posterior.information(best[:1])[0] + flat)
    chains = walk(posterior, best[height > height[0] - LIKELY], begin, count, seed)
    edges = shares_at_edge(chains.flat, posterior.box, bounds)
    asked = posterior.emulator.evaluations + posterior.emulator.failed
    return Drawn(posterior, best, height, covariance, chains, edges, 1, asked, "")


def grown(
    ask: Callable[[Array], Posterior],
    box: Array,
    bounds: Array,
    tolerance: Array,
    count: int,
    seed: int,
    stage: Callable[[bool], None] = lambda sampling: None,
) -> Drawn:
    """Draws from a box (v, 2) with less than `AT_EDGE` of them at its edges, or from the last one
    that could be had.

    ask: the posterior on an emulator of a box; tolerance (n,): its largest errors, row by row;
    stage: hears whether sampling begins, or asking. Raises what ``ask`` does of the first box.
    """
    found: Drawn | None = None
    evaluations, boxes, stopped = 0, 0, f"it was made larger {GROWTHS} times"
    for _ in range(GROWTHS + 1):
        stage(False)
        try:
            posterior = ask(box)
        except EvaluationFailed as failure:
            if found is None:
                raise
            stopped = f"a larger box has no emulator: {failure}"
            break
        emulator = posterior.emulator
        evaluations += emulator.evaluations + emulator.failed
        error = emulator.stated_errors[posterior.rows[:, 1]]
        if found and (error > tolerance).any():
            stopped = f"the emulator of a larger box may be {100 * error.max():.2g} % off"
            break
        stage(True)
        boxes += 1
        found = drawn(posterior, bounds, ceil(PROBE * count), seed)
        if found.at_edge.sum() < AT_EDGE:
            found = drawn(posterior, bounds, count, seed)
        if found.at_edge.sum() < AT_EDGE:
            return replace(found, boxes=boxes, evaluations=evaluations)
        box = larger(box, bounds, found.at_edge)
    assert found
    found = drawn(found.posterior, bounds, count, seed)
    return replace(found, boxes=boxes, evaluations=evaluations, stopped=stopped)


def shares_at_edge(x: Array, box: Array, bounds: Array) -> Array:
    """Share (v, 2) of draws x (n, v) at each edge; 0 where it is a bound of the variable."""
    near = EDGE * np.ptp(box, axis=1) / 2
    low, high = (x < box[:, 0] + near).mean(0), (x > box[:, 1] - near).mean(0)
    inner = abs(box - bounds) > 1e-9 * np.ptp(bounds, axis=1)[:, None]
    return np.stack([low, high], 1) * inner


def larger(box: Array, bounds: Array, at_edge: Array) -> Array:
    """The box moved outwards where draws are at its edge, at most to the bounds."""
    out = GROWTH * np.ptp(box, axis=1)[:, None] * np.array([-1, 1])
    moved = np.where(at_edge >= AT_EDGE / at_edge.size, box + out, box)
    return np.clip(moved, bounds[:, :1], bounds[:, 1:])
