"""Residuals that are linear in a box, where every step of a search is known by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.fit.problem import Point
from tyrecal.studies.fit.targets import Target

from ..chance import generator

Array = np.ndarray


def point(x: Any, r: Any, J: Any, modes: dict | None = None) -> Point:
    x, r, J = (np.array(each, float) for each in (x, r, J))
    return Point({}, x, r, J, modes or {}, 1.0, 1.0, np.empty(0))


class Linear:
    """Residuals J x - y within a box; ``wall``: x that have no solution."""

    targets: tuple[Target, ...] = ()

    def __init__(self, J: Array, y: Array, box: float = 10.0):
        self.J, self.y = J, y
        self.asked: list[Array] = []
        self.lower, self.upper = np.full(J.shape[1], -box), np.full(J.shape[1], box)
        self.wall = lambda x: False
        self.added = lambda x: 0.0  # to the residuals, and to no slope

    def evaluate(self, x: Array) -> Point:
        self.asked.append(x)
        assert (x >= self.lower).all() and (x <= self.upper).all()
        if self.wall(x):
            raise EvaluationFailed("no_equilibrium", "beyond the wall")
        return point(x, self.J @ x - self.y + self.added(x), self.J)


def linear(key: object = 0, box: float = 10.0, rows: int = 7, columns: int = 3) -> Any:
    random = generator("linear", key)
    J = random.normal(size=(rows, columns))
    return Linear(J, J @ random.normal(size=columns) + 0.3 * random.normal(size=rows), box)
