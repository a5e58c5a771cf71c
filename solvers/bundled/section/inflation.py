"""Static equilibrium by Newton's method with an energy line search and adaptive load steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from operator import attrgetter, methodcaller

import numpy as np

from ...errors import Indefinite, NoEquilibrium
from . import mechanics
from .band import Cholesky, Numbering
from .laws.hyperelastic import Hyperelastic
from .model import Model
from .parts.cords import NOT_COMPRESSED, Cords
from .parts.elastic import Elastic
from .parts.part import TyrePart
from .parts.pressure import Pressure

Array = np.ndarray
FORCE_RTOL = 1e-9  # out-of-balance force over pressure force; the next step is at round-off
ROUND_OFF_RTOL = 1e-6  # accepted where round-off lets the force fall no further
MIN_PRESSURE_STEP = 1 / 256  # share of the pressure
MAX_ITERATIONS = 30  # of Newton's method
MAX_QUICK_ITERATIONS = 18  # iterations after which another path is likely to be shorter
STIFFENING = 8.0  # multiple of the rubber's stiffness that inflates without trouble
SECTION_RADIUS = 0.3  # meridional radius of curvature over the section's height, for the start
EASED = 300.0  # largest bulk over shear modulus of rubber that inflates in few iterations
MIN_INERTIA, MAX_INERTIA = 4e5, 4e15  # of the inertia that holds back a wrinkling path, rad2/s2
BUCKLING_STRAIN = 1e-3  # logarithmic compression above which cords are named as the cause
TENSION_FACTOR = 0.05  # factor on the artificial tension from one iteration to the next


def equilibrium(
    model: Model,
    numbering: Numbering,
    loads: Sequence[TyrePart],
    start: Array,
    check: Callable[[], None] = lambda: None,
    guess: Array | None = None,
) -> tuple[Array, int]:
    """Displacements (n, 3) in equilibrium under ``loads``, reached from the displacements
    ``start``, and how many factorisations they took. Of half a model: valid on z >= 0.

    A ``guess`` (n, 3), the shape of a similar tyre, if any, is tried first, then the whole load
    from ``start``. If that takes long, because soft rubber between stiff cords wrinkles on the way,
    the rubber is stiffened and softened again step by step. If that fails too, the load is applied
    in steps. All paths lead to the same equilibrium. ``check`` is called between steps and may
    raise to stop.

    Nearly incompressible rubber first gets a lower bulk modulus (`EASED`), because Newton's
    straight steps change its volume.

    Raises NoEquilibrium with the pressure that was reached.
    """
    solve = _Solver(model, numbering, loads)
    parts = [part for part in model.parts if isinstance(part, Elastic)]
    laws = [part.law for part in parts if isinstance(part.law, Hyperelastic)]
    tight = any((law.bulk_over_shear > EASED).any() for law in laws)
    if tight and guess is None and start.any():
        guess = start
    if guess is not None:
        held = numbering.spread(numbering.gather(guess))  # 0 at the rim
        U = solve(held, 1.0, 1.0, MAX_QUICK_ITERATIONS)
        if U is not None:
            return U, solve.factorisations
    if tight:
        solve.model = model.with_laws(methodcaller("eased", EASED))
        start, solve.model = _reached(solve, start, check), model
    return _reached(solve, start, check), solve.factorisations


def _reached(solve: _Solver, start: Array, check: Callable[[], None]) -> Array:
    """Equilibrium U (n, 3) by the first of three paths that reaches it: the whole load at once, by
    stiffened rubber, in load steps. Raises NoEquilibrium."""
    U = solve(start, 1.0, 1.0, MAX_QUICK_ITERATIONS if solve.pressures else MAX_ITERATIONS)
    if U is None:
        check()
        U = _by_stiffness(solve, start, check)
    if U is None:
        U = _by_pressure(solve, start, check)
    return U


def stopped(reached: float, pressure: float, why: str) -> NoEquilibrium:
    """Error of an inflation that has no stable equilibrium beyond ``reached`` times the requested
    ``pressure``, Pa."""
    full, reached_kPa = pressure / 1e3, reached * pressure / 1e3
    return NoEquilibrium(f"inflation stopped at {reached_kPa:.4g} of {full:.4g} kPa: {why}")


def buckled_cords(model: Model, U: Array) -> str:
    """The cords that bear compression and are compressed most at U (n, 3), in words; "" if none is
    compressed enough to buckle."""
    parts = [part for part in model.parts if isinstance(part, Cords)]
    lowest = min(
        (part.most_compressed(U) for part in parts),
        key=attrgetter("strain"),
        default=NOT_COMPRESSED,
    )
    return lowest.in_words(model.mesh.X) if lowest.strain < -BUCKLING_STRAIN else ""


class _Solver:
    """Newton solutions at a share of the load and a multiple of the rubber's stiffness."""

    def __init__(self, model: Model, numbering: Numbering, loads: Sequence[TyrePart]):
        self.model, self.numbering, self.loads = model, numbering, loads
        self.pressures = [abs(load.pressure) for load in loads if isinstance(load, Pressure)]
        self.full = max(self.pressures, default=0.0)
        # N/m. A slack membrane has no stiffness against pressure, so the first tangents from rest
        # have the tension p rho that the pressure will give the cords (rho: radius of curvature)
        self.tension = self.full * SECTION_RADIUS * np.ptp(model.mesh.X[:, 0].real)
        self.factorisations = 0
        self.why = ""

    @cached_property
    def mass(self) -> Array:
        """Lumped mass (size,) of each equation, kg per radian: the diagonal of the consistent one,
        because row sums are negative at the corners of eight-node elements."""
        lumped = mechanics.mass(self.model).diagonal()
        return self.numbering.gather(np.repeat(lumped[:, None], 3, 1))

    def __call__(self, U: Array, share: float, stiffness: float, longest: int) -> Array | None:
        """Equilibrium (n, 3) from the start U in at most ``longest`` iterations; None, and the
        reason in ``why``, if it fails. share: of the load; stiffness: factor on the rubber's."""
        model = self.model.with_laws(methodcaller("stiffened", stiffness))
        loads = [
            Pressure(load.lines, load.pressure * share) if isinstance(load, Pressure) else load
            for load in self.loads
        ]
        tension = 0.0 if U.any() else share * self.tension
        solution, used, self.why = _newton(
            model, self.numbering, loads, lambda: self.mass, U, tension, longest
        )
        self.factorisations += used
        return solution


def _by_stiffness(solve: _Solver, start: Array, check: Callable[[], None]) -> Array | None:
    """U (n, 3) inflated from rubber ``STIFFENING`` times as stiff down to its own stiffness, in
    adaptive factors; None if that fails."""
    stiffness, factor = STIFFENING, STIFFENING
    U = solve(start, 1.0, stiffness, MAX_ITERATIONS)
    while U is not None and stiffness > 1.0:
        check()
        target = max(1.0, stiffness / factor)
        softer = solve(U, 1.0, target, MAX_QUICK_ITERATIONS)
        if softer is None:
            factor = factor**0.5
            if factor < 1.1:
                return None
        else:
            U, stiffness = softer, target
    return U


def _by_pressure(solve: _Solver, start: Array, check: Callable[[], None]) -> Array:
    """U (n, 3) inflated in adaptive load steps, which show how far the tyre can be inflated. Raises
    NoEquilibrium."""
    U, reached, step = start, 0.0, 0.25
    while reached < 1.0:
        check()
        target = min(1.0, reached + step)
        further = solve(U, target, 1.0, MAX_ITERATIONS)
        if further is None:
            step /= 2
            if step < MIN_PRESSURE_STEP:
                cords = buckled_cords(solve.model, U)
                raise stopped(reached, solve.full, f"{solve.why}; {cords}" if cords else solve.why)
        else:
            U, reached = further, target
            step *= 2
    return U


def _newton(
    model: Model,
    numbering: Numbering,
    loads: Sequence[TyrePart],
    mass: Callable[[], Array],
    U: Array,
    tension: float,
    longest: int,
) -> tuple[Array | None, int, str]:
    """Equilibrium (n, 3) by Newton's method from U, None if it failed; number of factorisations;
    and why it failed.

    mass: lumped (size,), which holds back a wrinkling path; tension: artificial tension of the
    cords at first, N/m, which vanishes on the way; longest: most iterations.
    """
    scale = np.linalg.norm(_load_force(model, U, loads, numbering))
    with np.errstate(all="ignore"):  # a guess may turn elements inside out
        energy = mechanics.potential(model, U, loads)
        force = mechanics.residual(model, U, loads, numbering)
    if not (np.isfinite(energy) and np.isfinite(force).all()):
        return None, 0, "the start is no shape that the tyre can have"
    smallest, used, inertia, before = 1e-3 * tension, 0, 0.0, float("inf")
    for iteration in range(longest + 1):
        size = float(np.linalg.norm(force))
        if size <= FORCE_RTOL * scale or (size <= ROUND_OFF_RTOL * scale and size > 0.5 * before):
            return U, used, ""
        if iteration == longest:
            break
        before = size
        taut = model.with_laws(methodcaller("tautened", tension))
        band = numbering.assemble(mechanics.tangents(taut, U, loads, harmonics=False)[0])
        while True:
            used += 1
            held = band.copy(order="F")
            if inertia:
                held[0] += inertia * mass()  # row 0 of the lower band: the diagonal
            try:
                step = -Cholesky(held).solve(force)
                break
            except Indefinite:  # it wrinkles on the way: hold it back by its inertia, 1 / dt^2
                inertia = max(10 * inertia, MIN_INERTIA)
                if inertia > MAX_INERTIA:
                    return None, used, "the tangent stiffness is not positive definite"
        inertia = inertia / 10 if inertia > MIN_INERTIA else 0.0
        slope = float(force @ step)
        field, length = numbering.spread(step), 1.0
        while True:
            trial, lower = U + length * field, None
            with np.errstate(all="ignore"):
                force = mechanics.residual(model, trial, loads, numbering)
                # near the solution the energy is flat to round-off and the force decides
                if np.linalg.norm(force) < 0.5 * size:
                    break
                lower = mechanics.potential(model, trial, loads)
                energy = mechanics.potential(model, U, loads) if energy is None else energy
            if lower <= energy + 1e-4 * length * slope:  # Armijo's condition
                break
            length /= 2
            if length < 1e-4:
                return None, used, "the line search found no lower energy"
        U, energy = trial, lower
        tension = tension * TENSION_FACTOR if tension > smallest else 0.0
    return None, used, f"Newton's method did not converge in {longest} iterations"


def _load_force(model: Model, U: Array, loads: Sequence[TyrePart], numbering: Numbering) -> Array:
    """Force (size,), N per radian, of the pressure alone, of at least 1 Pa, or of the spin if there
    is no pressure: the out-of-balance force is small compared with it."""
    pressures = [load for load in loads if isinstance(load, Pressure)]
    felt = [Pressure(p.lines, max(float(np.real(p.pressure)), 1.0)) for p in pressures]
    if not loads:
        return np.ones(1)
    bare = Model(model.mesh, [])
    return mechanics.residual(bare, U if felt else 0 * U, felt or loads, numbering)
