"""Pairs of rows and columns with the largest total weight, to match modes with labels.

SciPy's `linear_sum_assignment` gives the same, but its import takes longer than most evaluations.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def assignment(weight: Array) -> list[tuple[int, int]]:
    """Pairs (row, column) by rising row, no row or column twice, of the largest sum of ``weight``
    (row, column); as many as the shorter side has.

    Shortest augmenting paths with prices (Kuhn, Munkres; Jonker and Volgenant, Computing 38 (1987)
    325): a row at a time enters, and the rows that it displaces move on along the path on which
    the total falls least. Prices u and v keep cost - u - v >= 0, and = 0 on every pair.
    """
    if weight.shape[0] > weight.shape[1]:
        return sorted((i, j) for j, i in assignment(weight.T))
    cost = -np.asarray(weight, float)
    rows, columns = cost.shape
    u, v = np.zeros(rows), np.zeros(columns)
    owner = np.full(columns, -1)
    for row in range(rows):
        distance, came_from = np.full(columns, np.inf), np.full(columns, -1)
        unvisited, at, i, reached = np.ones(columns, bool), -1, row, 0.0
        while i >= 0:
            through = reached + cost[i] - u[i] - v
            nearer = unvisited & (through < distance)
            distance[nearer], came_from[nearer] = through[nearer], at
            at = int(np.argmin(np.where(unvisited, distance, np.inf)))
            reached, unvisited[at], i = distance[at], False, owner[at]
        visited = ~unvisited
        u[row] += reached
        for j in np.flatnonzero(visited & (owner >= 0)):
            u[owner[j]] += reached - distance[j]
        v[visited] -= reached - distance[visited]
        while at >= 0:  # each on the path takes the column of the one before it
            before = int(came_from[at])
            owner[at] = owner[before] if before >= 0 else row
            at = before
    return sorted((int(owner[j]), int(j)) for j in np.flatnonzero(owner >= 0))
