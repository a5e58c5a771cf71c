"""The measurement worth making next: what each would add to telling the explanations apart.

Gain of a choice: the rise of sum over explanations i, j of p_i p_j min(delta_ij^2, 40) for a cost
of one, where delta_ij^2 = |P^1/2 (g_i - g_j)|^2, "none" having g = 0. (A distance beyond 40 is as
good as certain.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .evidence import NONE, OUTSIDE
from .gap import projection
from .observations import Observations
from .problem import Change, Problem

Array = np.ndarray
ENOUGH = 40.0
LIKELY = 0.02  # probability below which an explanation is not worth a measurement
# hours of a laboratory, as an orientation
COSTS = {"toggle": 4.0, "check": 1.0, "repeat": 2.0}
CHECKED = 0.25  # a constant measured by itself: what is left of its standard deviation
REPEATED = 4  # times, each after dismounting


@dataclass(frozen=True)
class Choice:
    """A measurement, its cost in hours (an orientation), and its gain per hour."""

    what: str
    hours: float
    gain: float


def rank(
    problem: Problem,
    d: Array,
    probabilities: Mapping[str, float],
    sizes: Mapping[str, Mapping[str, float]],
    names: tuple[list[str], Mapping[str, str]],
) -> list[Choice]:
    """The menu by falling gain. sizes: parameters by explanation and id; names: of the sources of
    error, and of each effect's toggle experiment."""
    likely = {key: p for key, p in probabilities.items()
              if p > LIKELY and key != OUTSIDE and (key == NONE or key in sizes)}  # fmt: skip
    if len(likely) < 2:
        return []
    before = _apart(problem, d, likely, sizes)
    choices = []
    sources, toggles = names
    for k, source in enumerate(sources):
        better = replace(problem, reduced={**problem.reduced, k: CHECKED})
        choices.append((f"measure {source.replace('_', ' ')} itself", COSTS["check"], better))
    observations = problem.observations
    finer = replace(observations, scatter=observations.scatter / np.sqrt(REPEATED),
                    common=observations.common / np.sqrt(REPEATED))  # fmt: skip
    words = f"repeat all {REPEATED} times, dismounted in between"
    choices.append((words, COSTS["repeat"] * (REPEATED - 1), replace(problem, observations=finer)))
    for id in dict.fromkeys(id for key in likely if key != NONE for id in sizes[key]):
        words = toggles.get(id) or f"measure again without {id}"
        choices.append((words, COSTS["toggle"], _switched(problem, id)))
    gains = [
        Choice(what, hours, (_apart(other, d, likely, sizes) - before) / hours)
        for what, hours, other in choices
    ]
    return sorted(gains, key=lambda choice: -choice.gain)


def _switched(problem: Problem, id: str) -> Problem:
    """The problem with one run more, in which the effect is absent."""
    run = 1 + len(problem.changes)
    first = np.array([row.run == 0 for row in problem.observations.rows])
    o = problem.observations
    join = lambda values: np.concatenate([values, values[first]])
    rows = (*o.rows, *(replace(row, run=run) for row in o.only(first).rows))
    both = Observations(rows, join(o.y), join(o.scatter), o.common, join(o.split),
                        join(o.split_scatter))  # fmt: skip
    changes = (*problem.changes, Change(id, 0.0))
    return replace(problem, observations=both, places=join(problem.places), changes=changes)


def _apart(
    problem: Problem,
    d: Array,
    likely: Mapping[str, float],
    sizes: Mapping[str, Mapping[str, float]],
) -> float:
    P, _, _ = projection(problem, d)
    g = [
        problem.added({id: np.array([e]) for id, e in sizes.get(key, {}).items()}, 1)[0][0]
        for key in likely
    ]
    p = list(likely.values())
    total = 0.0
    for i in range(len(p)):
        for j in range(i):
            off = g[i] - g[j]
            total += 2 * p[i] * p[j] * min(float(off @ P @ off), ENOUGH)
    return total
