"""Sequential least-squares quadratic programming: SciPy's SLSQP, `scipy.optimize.minimize`.

SLSQP (Kraft, DFVLR-FB 88-28) starts with a unit matrix as Hessian. Here it minimises F^2 / (2
F0^2), F the objective and F0 at the start, by coordinates y with x = x0 + F0 L^-T y and L L^T =
J0^T J0, whose Hessian at the start x0 is the unit matrix but for the residuals' curvature. Without
this scaling its first steps lead to the bounds. The bounds and the crossing of the two [0, 0] modes
are linear inequalities.

A design that cannot be evaluated has an infinite objective, from which SLSQP's line search steps
back. It is started again, from the best design, where a step has found the crossing in its way, the
line search has come to an end, or J^T J there promises to halve F^2 and no step since the start
was too long: SLSQP sees the gradient alone, and creeps in a valley that the residuals' slopes show.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from ...simulate.evaluate.failure import EvaluationFailed
from .problem import Point, Problem
from .search import (
    AT_CROSSING,
    CONVERGED,
    DAMPING,
    EXACT,
    MAX_DESIGNS,
    MIN_DAMPING,
    MIN_OBJECTIVE_GAIN,
    NO_LOWER,
    USED_UP,
    CrossingWatch,
    Descent,
    has_nothing_to_gain,
    is_converged,
    promises_half,
    room_to_move,
)

Array = np.ndarray
MIN_CHANGE = 1e-15  # of F^2 / (2 F0^2), by which SLSQP stops: the gradient ends a search before


class _Run:
    """One run of SLSQP from ``best``, which it moves; ``left``: designs that it may evaluate;
    overshot: whether one of its designs was no lower, or could not be evaluated.

    ``objective`` and ``gradient`` end the run before SLSQP's own criteria do: they raise
    StopIteration with the reason in words, without one if another run may go on."""

    def __init__(
        self,
        problem: Problem,
        start: Point,
        tolerance: float,
        watch: CrossingWatch,
        left: int,
        damping: float,
    ):
        self.problem, self.tolerance, self.watch, self.left = problem, tolerance, watch, left
        self.start = self.best = start
        H = start.jacobian.T @ start.jacobian
        H[np.diag_indices(len(H))] += damping * np.trace(H) / len(H)
        self.F0 = max(start.objective, EXACT)
        self.T = self.F0 * np.linalg.inv(np.linalg.cholesky(H)).T  # dx/dy (variables, variables)
        self.edge = watch.edge
        self.now: Point | None = None
        self.overshot = False

    def descend(self) -> str:
        """Run SLSQP; why the search ends, "" where another run may go on from ``best``."""
        G, h = room_to_move(self.problem, self.start, self.edge)
        h = np.minimum(h, 0.0)  # the start is inside, whatever the crossing's model says
        inside = {"type": "ineq", "fun": lambda y: G @ self.T @ y - h, "jac": lambda y: G @ self.T}
        try:
            minimize(
                self.objective,
                np.zeros(len(self.start.x)),
                jac=self.gradient,
                method="SLSQP",
                constraints=[inside],
                options={"ftol": MIN_CHANGE, "maxiter": MAX_DESIGNS},
            )
        except StopIteration as stop:
            return str(stop.value or "")
        return ""

    def evaluate(self, y: Array) -> Point:
        """Raises EvaluationFailed."""
        x = self.start.x + self.T @ y
        return self.problem.evaluate(np.clip(x, self.problem.lower, self.problem.upper))

    def objective(self, y: Array) -> float:
        """F^2 / (2 F0^2). Raises StopIteration."""
        self.left -= 1
        try:
            point = self.evaluate(y)
        except EvaluationFailed:
            if self.left <= 0:
                raise StopIteration(USED_UP) from None
            self.overshot = True
            return np.inf
        end = self.watch.judge(self.best, point)
        self.overshot |= point.objective > self.best.objective
        self.best = min(self.best, point, key=lambda p: p.objective)
        if end or self.left <= 0:
            raise StopIteration(end or USED_UP)
        edge_moved = self.watch.edge is not self.edge
        if edge_moved or is_converged(self.problem, self.best, self.tolerance):
            raise StopIteration
        return 0.5 * (point.objective / self.F0) ** 2

    def gradient(self, y: Array) -> Array:
        """Gradient (v,) of (F / F0)^2 / 2 by y at a design that SLSQP accepts. Raises StopIteration
        if it is no lower than the one accepted before, or a run from there promises more."""
        try:
            point = self.evaluate(y)
        except EvaluationFailed:  # the line search has given up
            raise StopIteration from None
        if self.now and point.objective >= self.now.objective:
            raise StopIteration
        free = not self.edge and not self.overshot
        if self.now and free and promises_half(self.problem, point):
            raise StopIteration
        self.now = point
        return self.T.T @ point.jacobian.T @ point.residuals / self.F0**2


def descend(
    problem: Problem, point: Point, tolerance: float, known: Point | None = None
) -> Descent:
    """Lower the objective from ``point``; ``known``: see `CrossingWatch`."""
    watch, left, damping = CrossingWatch(problem, known), MAX_DESIGNS, DAMPING
    while not is_converged(problem, point, tolerance):
        run = _Run(problem, point, tolerance, watch, left, damping)
        end = run.descend()
        gain = point.objective**2 - run.best.objective**2
        point, left = run.best, run.left
        if is_converged(problem, point, tolerance):
            break
        if not end and watch.bounds(point):
            end = AT_CROSSING
        if not end and gain <= MIN_OBJECTIVE_GAIN * point.objective**2 and watch.edge is run.edge:
            end = CONVERGED if has_nothing_to_gain(problem, point) else NO_LOWER
        if end:
            return Descent(point, end, watch.edge)
        if not run.overshot:
            damping = max(0.1 * damping, MIN_DAMPING)
    return Descent(point, CONVERGED)
