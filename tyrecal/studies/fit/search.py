"""The part of the calibration loop that both methods share: when to stop, and the crossing.

A method is a function ``descend`` that lowers the objective from a design until it cannot.
`minimise` calls it, and calls it again on the other side of the crossing of the two [0, 0] modes if
that held up the first search: the labels change places there and the objective jumps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from ...simulate.evaluate.failure import EvaluationFailed
from .crossing import MIXED, TELLING, Crossing, crossing, gap, order, pair_clarity
from .problem import Point, Problem

Array = np.ndarray
MAX_DESIGNS = 100  # evaluated in one search
# Hz, or standard deviations: an objective below every measurement's resolution, an exact fit
EXACT = 1e-3
# standard deviations: what is left to gain moves a variable by this part of its standard error at
# most, and is not worth another design once a step has not halved it
NEGLIGIBLE = 0.05
MIN_OBJECTIVE_GAIN = 1e-9  # of the squared objective: a smaller gain is none
NO_GAIN = 1e-6  # share of the squared objective: below, a whole step gains nothing
DAMPING = 0.01  # share of the mean diagonal of J^T J that is added to it at the start of a search
MIN_DAMPING = 1e-6  # the same, at last
CROSSING_ROOM = 0.1  # of the [0, 0] modes' gap, from a bounded step to where labels change
STALL_RTOL = 3e-4  # of the objective, less than CROSSING_ROOM costs: not worth another step
ALONG_RTOL = 0.1  # of the gradient: as much along the crossing counts as none
CONVERGED = "converged"
NO_LOWER = "no lower objective along the search direction"
USED_UP = "designs used up"
AT_CROSSING = (
    "the two [0,0] modes meet: beyond it, labels change places and the objective is higher"
)
CAME_BACK = "came back over the crossing of the two [0,0] modes"


@dataclass(frozen=True)
class Descent:
    """The design where a search stopped, the reason in words, and the crossing that bounds it."""

    point: Point
    message: str
    edge: Crossing | None = None


Descend = Callable[[Problem, Point, float, Point | None], Descent]


def minimise(problem: Problem, start: Array, tolerance: float, descend: Descend) -> Descent:
    """Minimise the objective from coordinates ``start`` (variables,) by the method ``descend``
    until the norm of the projected gradient is below ``tolerance``, Hz or standard deviations per
    unit of x.

    Where the search ends with the two [0, 0] modes mixed, the other side of their crossing is
    searched too. Where that is higher, the design is a minimum: the jump bounds it.

    Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    best = descend(problem, problem.evaluate(start), tolerance, None)
    if pair_clarity(best.point) < MIXED:
        for across in _designs_beyond(problem, best.point, best.edge):
            try:
                there = problem.evaluate(across)
            except EvaluationFailed:
                continue
            other = descend(problem, there, tolerance, best.point)
            if other.message != CAME_BACK and other.point.objective < best.point.objective:
                best = other
                break
    return best


def projected_gradient(problem: Problem, point: Point) -> float:
    """Norm of dF/dx without what pushes against a bound, Hz per unit of x."""
    return float(np.linalg.norm(point.gradient[~_pushes_against_bound(problem, point)]))


def _pushes_against_bound(problem: Problem, point: Point) -> Array:
    """Which variables (variables,) are at a bound beyond which the objective is lower."""
    g = point.gradient
    below = (point.x <= problem.lower + 1e-9) & (g > 0)
    return np.asarray(below | (point.x >= problem.upper - 1e-9) & (g < 0))


def is_converged(problem: Problem, point: Point, tolerance: float) -> bool:
    """Whether no admissible change lowers the objective, or the fit is exact for all purposes."""
    return point.objective <= EXACT or projected_gradient(problem, point) <= tolerance


def has_nothing_to_gain(problem: Problem, point: Point) -> bool:
    """Whether a whole Gauss-Newton step, without what pushes against a bound, promises no gain. It
    tells a minimum where round-off hides how the objective falls."""
    J = point.jacobian[:, ~_pushes_against_bound(problem, point)]
    left = point.residuals - J @ np.linalg.lstsq(J, point.residuals, rcond=None)[0]
    return bool(point.objective**2 - left @ left <= NO_GAIN * point.objective**2)


def promises_half(problem: Problem, point: Point) -> bool:
    """Whether Gauss and Newton's step within the bounds promises to halve the squared objective."""
    room = problem.lower - point.x, problem.upper - point.x
    ahead = 2 * lsq_linear(point.jacobian, -point.residuals, room).cost
    return bool(ahead <= 0.5 * point.objective**2)


@dataclass
class CrossingWatch:
    """Judges each step of a search at the crossing of the two [0, 0] modes.

    known: the end of an earlier search on the other side; edge: the linear model of the crossing
    that bounds the next steps, None while nothing does.
    """

    problem: Problem
    known: Point | None
    edge: Crossing | None = None

    def judge(self, point: Point, there: Point) -> str:
        """Take in a step from ``point`` to ``there``; why the search ends with it, else ""."""
        reached = min(point, there, key=lambda p: p.objective)
        creeps = reached.objective > 0.5 * point.objective and (there.x != point.x).any()
        if creeps and point.objective <= NEGLIGIBLE and self.problem.in_sigmas:
            return CONVERGED
        side = order(self.problem, reached)
        back = self.known is not None and side == order(self.problem, self.known)
        if self.known and back and reached.objective >= (1 - STALL_RTOL) * self.known.objective:
            return CAME_BACK
        if side != order(self.problem, point):
            self.edge = None
        elif side != order(self.problem, there) and _are_mixed(point, there):
            self.edge = crossing(self.problem, (point, there), reached) or self.edge
        creeping = point.objective - reached.objective <= STALL_RTOL * point.objective
        return AT_CROSSING if creeping and self.bounds(reached) else ""

    def bounds(self, point: Point) -> bool:
        """Whether the labels are about to change places and the gradient is normal to where they
        do, as it is at any bound that holds."""
        if not self.edge or pair_clarity(point, self.edge.state) >= TELLING:
            return False
        normal = self.edge.slopes / max(float(np.linalg.norm(self.edge.slopes)), 1e-300)
        along = np.linalg.norm(point.gradient - (point.gradient @ normal) * normal)
        return bool(along <= ALONG_RTOL * np.linalg.norm(point.gradient))


def room_to_move(problem: Problem, point: Point, edge: Crossing | None) -> tuple[Array, Array]:
    """Steps d (variables,) from ``point`` within the bounds and on this side of ``edge``, as
    G d >= h with G (sides, variables) and h (sides,)."""
    n = len(point.x)
    G = np.vstack([np.eye(n), -np.eye(n)])
    h = np.concatenate([problem.lower - point.x, point.x - problem.upper])
    if edge:
        apart = gap(point, edge.state)
        side = np.sign(apart)
        G = np.vstack([G, side * edge.slopes])
        h = np.append(h, CROSSING_ROOM * abs(apart) - side * edge.at(point.x))
    return G, h


def _are_mixed(*points: Point) -> bool:
    return min(map(pair_clarity, points)) < MIXED


def _designs_beyond(
    problem: Problem, point: Point, edge: Crossing | None = None
) -> Iterator[Array]:
    """Designs x (v,) on the other side of the [0, 0] modes' crossing, the nearest in the metric
    H = J^T J first.

    d of the crossing, see `crossing`, is carried to the other side of 0 with the least change of
    the residuals: dx = -(d +- wanted) H^-1 grad d / (grad d . H^-1 grad d).
    """
    edge = edge or crossing(problem, [point], point)
    if edge is None:
        return
    side = np.sign(gap(point, edge.state))
    H = point.jacobian.T @ point.jacobian
    H[np.diag_indices(len(H))] += 1e-3 * np.trace(H) / len(H)  # so that it can be inverted
    direction = np.linalg.solve(H, edge.slopes)
    rise = float(edge.slopes @ direction)
    if rise < 1e-12 * (edge.slopes @ edge.slopes + 1e-300):
        return
    for wanted in (1.0, 2.0, 4.0):  # Hz beyond
        change = -(edge.at(point.x) + side * wanted) * direction / rise
        yield np.clip(point.x + change, problem.lower, problem.upper)
