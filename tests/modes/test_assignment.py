"""The pairs of largest total weight, against all that there are."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from tyrecal.simulate.modes.assignment import assignment

from ..chance import generator


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (4, 1), (3, 3), (3, 5), (5, 3), (4, 4)])
@pytest.mark.parametrize("kind", ["any", "ties", "mostly nothing"])
def test_no_other_pairs_weigh_more(shape: tuple[int, int], kind: str) -> None:
    random = generator("assignment", *shape, kind)
    for _ in range(20):
        weight = random.normal(size=shape)
        if kind == "ties":
            weight = np.round(weight)
        elif kind == "mostly nothing":
            weight = np.maximum(weight - 0.5, 0)
        pairs = assignment(weight)
        rows, columns = zip(*pairs, strict=True)
        assert list(rows) == sorted(set(rows)) and len(set(columns)) == len(pairs) == min(shape)
        wide = weight if shape[0] <= shape[1] else weight.T
        best = max(
            sum(wide[i, j] for i, j in enumerate(chosen))
            for chosen in permutations(range(wide.shape[1]), wide.shape[0])
        )
        assert sum(weight[pair] for pair in pairs) == pytest.approx(best, abs=1e-12)


def test_as_scipy_where_all_cannot_be_tried() -> None:
    weight = generator("assignment").normal(size=(30, 40))
    assert assignment(weight) == list(
        zip(*linear_sum_assignment(weight, maximize=True), strict=True)
    )
    assert assignment(np.zeros((0, 3))) == []
