"""The nearest point of a polyhedron, by its conditions and against SciPy's optimiser.

The learnt curvature by its defining properties, and the step by its first-order conditions.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from tyrecal.studies.fit.curvature import (
    curved_step,
    foreseen,
    nearest,
    quadratic_step,
    with_secant,
)

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


Array = np.ndarray


def drawn(key: int) -> tuple[Array, Array, Array]:
    """Slopes J (6, 3), residuals r and curvatures C (6, 3, 3), symmetric."""
    random = generator("curvature", key)
    C = random.normal(size=(6, 3, 3))
    return random.normal(size=(6, 3)), random.normal(size=6), 0.1 * (C + C.swapaxes(1, 2))


def test_a_secant_holds_and_changes_as_little_as_it_must() -> None:
    """C' s = change and C' = C'^T; C' - C is normal to every symmetric matrix with A s = 0."""
    for key in range(5):
        change, _, C = drawn(key)
        random = generator("secant", key)
        s = random.normal(size=3)
        new = with_secant(C, s, change)
        assert new @ s == pytest.approx(change) and new == pytest.approx(new.swapaxes(1, 2))
        across = random.normal(size=3)
        across -= across @ s / (s @ s) * s
        assert np.einsum("mij,i,j->m", new - C, across, across) == pytest.approx(0, abs=1e-12)


def test_curvatures_of_quadratics_are_found_after_as_many_steps_as_variables() -> None:
    """Conjugate to none, along the axes: each step tells a column for good."""
    _, _, C = drawn(0)
    curvature = np.zeros_like(C)
    for s in np.eye(3):
        curvature = with_secant(curvature, s, C @ s)
    assert curvature == pytest.approx(C)


def test_a_step_without_curvature_is_the_damped_one() -> None:
    for key in range(5):
        J, r, C = drawn(key)
        G, h = np.vstack([np.eye(3), -np.eye(3)]), np.full(6, -0.3)
        d = curved_step(J, r, 0 * C, 0.2, G, h)
        H = J.T @ J + 0.2 * np.sum(J**2) / 3 * np.eye(3)
        damped = quadratic_step(H, J.T @ r, float(np.linalg.norm(r)), G, h)
        assert d == pytest.approx(damped, abs=1e-7)
        assert foreseen(J, r, 0 * C, d) == pytest.approx(r + J @ d)


@pytest.mark.parametrize("bound", [10.0, 0.2])
def test_a_curved_step_is_a_minimum_of_its_model(bound: float) -> None:
    """Inside, the gradient of |r(x + d)|^2 + mu |d|^2 tr(J^T J) / 3 vanishes; where a side holds it
    pushes against it."""
    held = 0
    for key in range(5):
        J, r, C = drawn(key)
        G, h = np.vstack([np.eye(3), -np.eye(3)]), np.full(6, -bound)
        d = curved_step(J, r, C, 0.2, G, h)
        at = foreseen(J, r, C, d)
        assert at == pytest.approx(
            [ri + Ji @ d + d @ Ci @ d / 2 for ri, Ji, Ci in zip(r, J, C, strict=True)]
        )
        g = (J + C @ d).T @ at + 0.2 * np.sum(J**2) / 3 * d
        low, high = d <= -bound + 1e-9, d >= bound - 1e-9
        held += int((low | high).sum())
        assert abs(g[~low & ~high]).max(initial=0) < 1e-4
        assert (g[low] > 0).all() and (g[high] < 0).all()
    assert (held > 0) == (bound < 1)
