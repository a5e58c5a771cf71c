"""The nearest point of a polyhedron, by its conditions and against SciPy's optimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from tyrecal.studies.fit.curvature import nearest, quadratic_step

from ..chance import generator


def test_the_nearest_point_is_that_of_its_conditions() -> None:
    """y - to = G^T u with u >= 0 that vanish where G y > h: pushed by the sides that hold alone."""
    held = set()
    for key in range(40):
        random = generator("nearest", key)
        G, to = random.normal(size=(7, 3)), 2 * random.normal(size=3)
        h = G @ random.normal(size=3) - random.uniform(0, 1, 7)  # one point at least is inside
        y = nearest(to, G, h)
        slack = G @ y - h
        assert slack.min() > -1e-9
        on = slack < 1e-9
        held.add(int(on.sum()))
        u = np.linalg.lstsq(G[on].T, y - to, rcond=None)[0]
        assert G[on].T @ u == pytest.approx(y - to, abs=1e-9) and (u > -1e-9).all()
    assert {0, 1, 2} <= held


def test_no_step_is_taken_where_no_point_is_inside() -> None:
    """y >= 1 and y <= -1."""
    assert nearest(np.array([3.0]), np.array([[1.0], [-1.0]]), np.ones(2)).tolist() == [0.0]


@pytest.mark.parametrize("key", range(5))
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_a_step_is_the_first_of_slsqp(size: float, key: int) -> None:
    """The step is in the metric of its own matrix, for residuals of any size and bounds on both
    sides."""
    random = generator("first of slsqp", key)
    J, r = random.normal(size=(7, 3)), random.normal(size=7)
    H = J.T @ J + 0.2 * np.trace(J.T @ J) / 3 * np.eye(3)
    G, h = np.vstack([np.eye(3), -np.eye(3)]), -random.uniform(0, 0.5, 6)
    turn = np.linalg.inv(np.linalg.cholesky(H)).T
    value = lambda y: (0.5 * y @ y + (turn.T @ J.T @ r) @ y, y + turn.T @ J.T @ r)
    inside = {"type": "ineq", "fun": lambda y: G @ turn @ y - h, "jac": lambda y: G @ turn}
    first = minimize(
        value,
        np.zeros(3),
        jac=True,
        method="SLSQP",
        constraints=[inside],
        options={"maxiter": 1, "ftol": 1e-15},
    )
    step = quadratic_step(H * size**2, J.T @ r * size**2, size * np.linalg.norm(r), G, h)
    assert step == pytest.approx(turn @ first.x, abs=1e-9)
