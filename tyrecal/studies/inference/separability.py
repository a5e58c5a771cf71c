"""Effects that the data can see and distinguish.

    lambda_i    = |P^1/2 g_i|^2                                    detectability
    delta_ij^2  = min over e_j of |P^1/2 (g_i - g_j(e_j))|^2       distance of two effects

g_i: shift of all rows by the effect at a given size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .inverse_problem import InverseProblem

Array = np.ndarray
# least lambda of a visible effect, and least delta^2 between two that can be distinguished
VISIBLE, APART = 10.0, 9.0
GRID_POINTS = 81  # number of sizes of an effect


@dataclass(frozen=True)
class Separability:
    """Separability of the effects ``ids`` (m,)."""

    ids: tuple[str, ...]
    sizes: Mapping[str, float]  # parameter of each effect in lambda and delta
    lambdas: Mapping[str, float]  # lambda at those sizes
    full: Mapping[str, float]  # lambda at the far end of the range
    distances: Array  # (m, m) delta_ij^2, row i at its size
    smallest: Mapping[str, float | None]  # the parameter with lambda = 10; None beyond the range

    def groups(self) -> list[list[str]]:
        """Ids that these data cannot separate: linked by delta^2 < 9 from either side, each with
        lambda >= 9."""
        place = {id: i for i, id in enumerate(self.ids)}
        distances = np.minimum(self.distances, self.distances.T)
        near = lambda a, b: distances[place[a], place[b]] < APART
        left, result = [id for id in self.ids if self.lambdas[id] >= APART], []
        while left:
            group = [left.pop(0)]
            for member in group:
                more = [id for id in left if near(member, id)]
                group += more
                left = [id for id in left if id not in more]
            result.append(group)
        return [group for group in result if len(group) > 1]


def separate(problem: InverseProblem, P: Array, sizes: Mapping[str, float]) -> Separability:
    """Separability of the effects at their sizes, or at full size if one is not visible at its
    own. P (n, n): that of the plain fit."""
    ids = tuple(problem.expansion.nodes)
    grids, shifts, ends = {}, {}, {}
    for id in ids:
        low, high = problem.expansion.nodes[id].reach
        grids[id] = np.linspace(low, high, GRID_POINTS)
        shifts[id] = problem.added({id: grids[id]}, GRID_POINTS).shift - problem.added({}, 1).shift
        ends[id] = int(np.argmax(abs(grids[id])))
    length = {id: np.einsum("qn,nm,qm->q", shifts[id], P, shifts[id]) for id in ids}
    at = {}
    for id in ids:
        nearest = int(np.argmin(abs(grids[id] - sizes.get(id, 0.0))))
        at[id] = nearest if length[id][nearest] >= VISIBLE else ends[id]
    chosen = np.array([shifts[id][at[id]] for id in ids]).reshape(len(ids), len(P))
    distances = np.zeros((len(ids), len(ids)))
    for i in range(len(ids)):
        for j, b in enumerate(ids):
            if i != j:
                off = shifts[b] - chosen[i]
                distances[i, j] = np.einsum("qn,nm,qm->q", off, P, off).min()
    return Separability(
        ids,
        {id: float(grids[id][at[id]]) for id in ids},
        {id: float(length[id][at[id]]) for id in ids},
        {id: float(length[id][ends[id]]) for id in ids},
        distances,
        {id: smallest(grids[id], length[id]) for id in ids},
    )


def smallest(grid: Array, length: Array, least: float = VISIBLE) -> float | None:
    """The least parameter with that lambda, between points of the grid by its square root."""
    seen = np.flatnonzero(length >= least)
    if not len(seen):
        return None
    best = seen[np.argmin(abs(grid[seen]))]
    return float(grid[best] * np.sqrt(least / length[best]))
