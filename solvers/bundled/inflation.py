"""Static equilibrium by Newton's method with an energy line search and adaptive load steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import mechanics
from .band import Cholesky, Indefinite, Numbering
from .mechanics import Load
from .model import Model

Array = np.ndarray
TOLERANCE = 1e-9  # out-of-balance force over pressure force; the next step is at round-off
SMALLEST_STEP = 1 / 256
LONGEST = 30  # iterations
SECTION_RADIUS = 0.3  # meridional radius of curvature over the section's height, for the start
RELEASE = 0.05  # factor on the artificial tension from one iteration to the next


class InflationFailed(ArithmeticError):
    """No stable equilibrium beyond ``reached`` times the load that was asked for."""

    def __init__(self, reached: float, pressure: float, why: str):
        super().__init__(
            f"inflation stopped at {reached * pressure / 1e3:.4g} of {pressure / 1e3:.4g} kPa: {why}"
        )
        self.reached_Pa = reached * pressure


@dataclass
class State:
    """An equilibrium: displacements U (n, 3), and what it cost."""

    U: Array
    factorisations: int


def equilibrium(
    model: Model,
    numbering: Numbering,
    loads: list[Load],
    start: Array,
    check: Callable[[], None] = lambda: None,
) -> State:
    """Equilibrium under ``loads``, reached from the displacements ``start``.

    The whole load is tried first. A slack membrane has no stiffness against the pressure yet, so
    the first tangents carry the tension p * rho that the cords are about to take up; this changes
    the path of the iteration, never its end. Where that fails the load comes in adaptive steps.

    ``check`` is called between load steps and may raise to stop.

    Raises InflationFailed with the pressure that was reached.
    """
    U, reached, step, count = start, 0.0, 1.0, 0
    full = max((abs(load.pressure) for load in loads), default=0.0)
    radius = SECTION_RADIUS * np.ptp(model.mesh.X[:, 0].real)
    why = ""
    while reached < 1.0:
        check()
        target = min(1.0, reached + step)
        part = [Load(load.lines, load.pressure * target) for load in loads]
        tension = (target - reached) * full * radius
        trial, used, why = _newton(model, numbering, part, U, tension)
        count += used
        if trial is None:
            step = min(step, 0.5) / 2
            if step < SMALLEST_STEP:
                raise InflationFailed(reached, full, why)
        else:
            U, reached = trial, target
            step *= 2
    return State(U, count)


def _newton(
    model: Model, numbering: Numbering, loads: list[Load], U: Array, tension: float
) -> tuple[Array | None, int, str]:
    scale = np.linalg.norm(_pressure_force(model, U, loads, numbering))
    energy = mechanics.potential(model, U, loads)
    force = mechanics.residual(model, U, loads, numbering)
    smallest = 1e-3 * tension
    for iteration in range(LONGEST):
        size = np.linalg.norm(force)
        if size <= TOLERANCE * scale:
            return U, iteration, ""
        K0, _, _ = mechanics.tangents(model, U, loads, harmonics=False, tension=tension)
        try:
            step = -Cholesky(numbering.assemble(K0)).solve(force)
        except Indefinite:
            return None, iteration + 1, "the tangent stiffness is no longer positive definite"
        slope = float(force @ step)
        field, length = numbering.spread(step), 1.0
        while True:
            trial = U + length * field
            with np.errstate(all="ignore"):
                lower = mechanics.potential(model, trial, loads)
                force = mechanics.residual(model, trial, loads, numbering)
            # near the solution the energy is flat to round-off and the force decides
            if np.linalg.norm(force) < 0.5 * size or lower <= energy + 1e-4 * length * slope:
                break
            length /= 2
            if length < 1e-4:
                return None, iteration + 1, "the line search found no lower energy"
        U, energy = trial, lower
        tension = tension * RELEASE if tension > smallest else 0.0
    return None, LONGEST, f"Newton's method did not converge in {LONGEST} iterations"


def _pressure_force(model: Model, U: Array, loads: list[Load], numbering: Numbering) -> Array:
    bare = Model(model.mesh, [], [])
    return mechanics.residual(bare, U, loads, numbering) if loads else np.ones(1)
