"""The inflated tyre pressed on the road: Newton's method for its displacements and the road's
height at a given load, preconditioned GMRES inside, loads one after the other.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ...errors import Indefinite, Inverted, NoEquilibrium
from ..section.parts.cords import NOT_COMPRESSED, CordsAtStations
from ..solid3d.revolved import Revolved
from .contact import Bound, Contact, FlatRoad
from .contact_tangent import MAX_GMRES, Equations, Tangent, solve
from .contact_update import ContactUpdate
from .half_turn_symmetry import HalfTurn
from .multifrontal import Elimination, Factor

Array = np.ndarray
log = logging.getLogger("tyrecal_solvers")
CONTACT_FORCE_RTOL = 1e-8  # out-of-balance force over the load
MAX_NEWTON = 40  # Newton iterations a load
# GMRES iterations of a step, after which the preconditioner is formed anew
MAX_GMRES_BEFORE_NEW_FACTOR = 8
NEAR_LOAD = 2.0  # of a load, up to which Coulomb's friction is tried at once
SAME_FACTOR = 1.1  # of a load, up to which its preconditioner is worth keeping
LINEAR_RTOL = 1e-2  # residual of the linear problem, relative
SMOOTH_RTOL = 1e-5  # the same of derivatives, by which a fit descends
UNIT_RTOL = 1e-4  # the same of the vertical stiffness, which is off by about its square
MAX_UNIT_RESIDUAL = 1e-3  # of the same
ROUGH_LINEAR_RTOL = 0.3  # residual of the linear problem as long as the contact changes much
MAX_LINEAR_RESIDUAL = 0.5  # more is left only of a tangent that is far from a stable one
STEADIED_STEPS = 8  # steps with a steadied tangent, before the true one is tried
MAX_UNSTABLE = 16  # states on the way to a load that are not stable, before it is given up
MAX_SETBACKS = 5  # steps that may fail to halve the residual, with Coulomb's friction
COULOMB_RTOL = 1e-2  # residual over the load, before Coulomb's friction is tried
FRICTION_BOUND_RTOL = 0.1  # the same, before the friction's bounds are taken anew
SOFT_ELASTIC_SLIP = 1e-4  # m: an elastic slip that is no obstacle
ELASTIC_SLIP_FACTOR = 0.3  # from one elastic slip to the next smaller one
MIN_STEP_LENGTH = 1 / 64  # step of the line search
# the same with Coulomb's friction, which has no energy: there a larger residual is borne, as stick
# and slip change
MIN_COULOMB_LENGTH = 1 / 4
FIRST_COMPLIANCE = 1e-6  # m/N of deflection to begin with: it must touch, and stay small
# logarithmic compression above which cords are named as the cause: a truck's belt of 72 degrees
# gives way at 6e-4
NAMED_STRAIN = 2e-4
MIN_LOAD_STEP = 1 / 16  # share of a load's increase, below which it counts as unreachable
# of the way down to the rim that a load would need at the last one's stiffness, beyond which it is
# not tried: no tyre stiffens as much
MAX_PREDICTED_WAY = 4.0
# of the way down to the rim, at which the first load begins at most
MAX_FIRST_DEFLECTION = 0.1


@dataclass
class PressedState:
    """An equilibrium."""

    parts: Array  # (2, f, q, 3) of the displacements, m
    height: float  # the road's, m
    contact: Contact
    stiffness: float  # vertical, of the tangent, dF / d(deflection), N/m
    # displacements' parts and rise of the road, m/N, by a unit of half the road's force
    unit: tuple[Array, float]
    # parts and rise of each of the derivatives that were wanted with it
    derivatives: list[tuple[Array, float]]


@dataclass(frozen=True)
class FirstGuess:
    """Where a load begins."""

    parts: Array  # (2, f, q, 3), m
    deflection: float  # m


class Imbalance(NamedTuple):
    """The forces that are out of balance at a state."""

    force: Array  # on the parts (2, f, q, 3), N
    lacking: float  # half the load less the contact's, N
    contact: Contact

    @property
    def size(self) -> float:
        return float(np.hypot(np.linalg.norm(self.force), self.lacking))


class ContactNewton:
    """Presses a tyre from its inflated state ``U`` (k, n, 3) to rising loads; ``settled`` is called
    with each state that slip is to count from, solved with the equations that ``wanted`` gave for
    its contact. ``guesses``: where loads (N) begin."""

    def __init__(
        self,
        tyre: Revolved,
        symmetry: HalfTurn,
        road: FlatRoad,
        U: Array,
        check: Callable[[], None],
        settled: Callable[[ContactNewton, PressedState], None] = lambda work, state: None,
        wanted: Callable[[ContactNewton, Contact], list[Equations]] = lambda work, contact: [],
    ):
        self.tyre, self.symmetry, self.check = tyre, symmetry, check
        self.settled, self.wanted = settled, wanted
        self.free_radius = road.height
        self.flat = self._flat_height(tyre.model.mesh.X, np.flatnonzero(~symmetry.free.any(1)))
        self.road = road
        tyre.residual(U)
        self.parts = symmetry.parts(U)
        self.height = self.free_radius
        self.load = 0.0
        self._bound = road.forces(U, self.free_radius).bound(1.0)
        self.guesses: dict[float, FirstGuess] = {}
        self._order: Elimination | None = None  # from the tangents of the first preconditioner
        self._factor: ContactUpdate | None = None
        self._used = 0
        self._stale = False  # the preconditioner is of a load that was much smaller
        self._formed_at = 0.0  # its load, N
        self._steadied = False  # the tangent is without what lets cords buckle
        self._unstable_left = MAX_UNSTABLE  # that may still come on the way to the load
        self._slope: tuple[Array, float] | None = None  # of parts and height by the load
        self.factorisations = self.iterations = 0

    def to(self, load: float) -> PressedState:
        """The equilibrium at ``load`` (N), in smaller steps where need be.

        Raises NoEquilibrium, also where the road has come to the rim.
        """
        self._check_reach(load)
        # no step is larger than what would press the stiffest tyre flat
        step = min(load - self.load, (self.free_radius - self.flat) / FIRST_COMPLIANCE)
        smallest = MIN_LOAD_STEP * step
        self._unstable_left = MAX_UNSTABLE
        while True:
            self.check()
            target, known = min(self.load + step, load), (self._bound, self._slope)
            try:
                state = self._newton(target)
            except (NoEquilibrium, Indefinite, Inverted) as error:
                step /= 2
                self._factor, (self._bound, self._slope) = None, known
                if step < smallest or not self._unstable_left:
                    raise NoEquilibrium(
                        f"no equilibrium between {self.load:.4g} and {target:.4g} N"
                        f"{self.depth()}: {self._buckling() or error}"
                    ) from None
                continue
            self.parts, self.height, self.load = state.parts, state.height, target
            if self.height <= self.flat:
                raise NoEquilibrium(f"the tyre is flat on its rim at {target:.4g} N{self.depth()}")
            self.settled(self, state)
            self.road = self.road.settled(state.contact)
            if target == load:
                return state
            self._check_reach(load)
            log.info("%g of %g N are reached%s", target, load, self.depth())

    def _check_reach(self, load: float) -> None:
        """Raises NoEquilibrium where the stiffness leaves no hope of ``load``."""
        if self._slope:
            down = self.free_radius - self.height - (load - self.load) * self._slope[1]
            if down > MAX_PREDICTED_WAY * (self.free_radius - self.flat):
                raise NoEquilibrium(
                    f"no equilibrium between {self.load:.4g} and {load:.4g} N{self.depth()}:"
                    f" at its stiffness there it would go down by {1e3 * down:.0f} mm"
                )

    @property
    def _cords(self) -> list[CordsAtStations]:
        return [part for part in self.tyre.parts if isinstance(part, CordsAtStations)]

    def _buckling(self) -> str:
        """The cords that are compressed most at the last state, in words; "": none by much."""
        lowest = min(
            (part.most_compressed() for part in self._cords),
            key=attrgetter("strain"),
            default=NOT_COMPRESSED,
        )
        if lowest.strain > -NAMED_STRAIN:
            return ""
        return lowest.in_words(self.tyre.model.mesh.X)

    def depth(self) -> str:
        """How far down the last load reached has pressed the tyre, in words; "" before any."""
        down, most = self.free_radius - self.height, self.free_radius - self.flat
        return f" ({1e3 * down:.0f} of {1e3 * most:.0f} mm down to the rim)" if self.load else ""

    def progress(self) -> str:
        """After which load, and with which cords buckled on the way on, in words; "" at first."""
        reached = f" after {self.load:.4g} N{self.depth()}" if self.load else ""
        buckled = self._buckling() if self._unstable_left < MAX_UNSTABLE else ""
        return f"{reached}: {buckled}" if buckled else reached

    @staticmethod
    def _flat_height(X: Array, held: Array) -> float:
        """The road's height, m, at which the crown lies on the rim: points X (n, 3) at rest; the
        rim's are those with the indices ``held``."""
        rim = float(X[held, 0].max(initial=0.0))
        z = np.where(X[:, 0] > rim, np.abs(X[:, 1]), np.inf)
        return rim + float(np.ptp(X[z <= z.min() + 1e-9, 0]))

    def release_factor(self) -> ContactUpdate | None:
        """The preconditioner near the last state, which is now the caller's: the next load forms
        its own, as two at a time would double the memory."""
        factor, self._factor = self._factor, None
        return factor

    def _state(self, parts: Array, height: float, load: float, bound: Bound | None) -> Imbalance:
        U = self.symmetry.spread(parts)
        forces = self.tyre.residual(U)
        contact = self.road.forces(U, height, bound)
        force = self.symmetry.gather(forces + contact.field)
        return Imbalance(force, (load - contact.force) / 2, contact)

    def _energy(self, contact: Contact, load: float, height: float) -> float:
        """Potential of half the tyre, its road and its load at the last state, J."""
        return self.tyre.potential() + contact.energy + load / 2 * height

    def _newton(self, load: float) -> PressedState:
        """Solve from the guess for a load or, without a good one, from where the last load's
        stiffness points."""
        state = self._from_first_guess(load)
        if not state:
            parts, height = self.parts, self.height
            self._stale = self._factor is not None and load > SAME_FACTOR * self._formed_at
            if self._slope:
                parts = parts + (load - self.load) * self._slope[0]
                height += (load - self.load) * self._slope[1]
            else:
                deepest = MAX_FIRST_DEFLECTION * (self.free_radius - self.flat)
                height -= min(FIRST_COMPLIANCE * load, deepest)
            near = load <= NEAR_LOAD * self.load
            state = self._with_friction(parts, height, load, self._bound, near)
        parts, height, contact = state
        self._bound = contact.bound(1.0)
        if self._unstable_left < MAX_UNSTABLE:
            self._factor = None  # what comes after an unstable state must be stable: formed anew
        unit, *derivatives = self._derivatives(contact)
        self._slope = -unit[0] / 2, -unit[1] / 2
        return PressedState(parts, height, contact, 2 / unit[1], unit, derivatives)

    def _from_first_guess(self, load: float) -> tuple[Array, float, Contact] | None:
        """The equilibrium from the guess for a load; None where there is none, or it is a bad
        one."""
        guess = self.guesses.pop(load, None)
        if guess is None:
            return None
        self._factor = None
        # past an unstable state it may come to another equilibrium than the path from the last load
        left, self._unstable_left = self._unstable_left, 0
        try:
            height = self.free_radius - guess.deflection
            contact = self.road.forces(self.symmetry.spread(guess.parts), height)
            return self._with_friction(guess.parts, height, load, self._limit(contact), near=True)
        except (NoEquilibrium, Indefinite, Inverted):
            log.info("%g N: no stable state from the start, loaded from the state before", load)
            self._factor = None
            return None
        finally:
            self._unstable_left = left

    def _limit(self, contact: Contact) -> Bound:
        """Limit of the friction of a step to a contact."""
        return contact.bound(self.road.share(contact.points, contact.height)[0])

    def _with_friction(
        self, parts: Array, height: float, load: float, bound: Bound, near: bool
    ) -> tuple[Array, float, Contact]:
        """The equilibrium with Coulomb's friction, tried at once where it is ``near``; where that
        does not converge, Tresca's friction, with the last normal forces, comes to where it
        does. Past a state that is not stable a steadied tangent leads."""
        self._steady(False)
        if near and (state := self._by_coulomb(parts, height, load)):
            return state
        reached = FRICTION_BOUND_RTOL
        for _ in range(MAX_NEWTON):
            parts, height, contact = self._solve_tresca(parts, height, load, bound, reached)
            bound = self._limit(contact)
            if reached > COULOMB_RTOL:
                reached = COULOMB_RTOL  # what newly touches had no friction yet
                continue
            if state := self._by_coulomb(parts, height, load):
                return state
            if self._steadied and reached < 2 * CONTACT_FORCE_RTOL:
                raise Indefinite("the tangent stiffness is not positive definite")
            reached = max(0.1 * reached, CONTACT_FORCE_RTOL)
        raise NoEquilibrium("the friction did not settle")

    def _by_coulomb(
        self, parts: Array, height: float, load: float
    ) -> tuple[Array, float, Contact] | None:
        """The equilibrium; None where Newton's method does not converge from there, or the true
        tangent is not positive definite: then the steadied one is on. Raises Indefinite where it
        may not be."""
        self._steady(False)
        try:
            return self._iterate(parts, height, load, None, CONTACT_FORCE_RTOL)
        except Indefinite:
            self._steady(True)
        except NoEquilibrium:
            pass
        return None

    def _steady(self, on: bool) -> None:
        """Go on with the tangent that lets no cord buckle, or with the true one. Raises Indefinite
        where no more unstable states may come."""
        if on == self._steadied:
            return
        if on:
            if not self._unstable_left:
                raise Indefinite("the tangent stiffness is not positive definite")
            self._unstable_left -= 1
        for part in self._cords:
            part.steady(on)
        self._steadied, self._factor = on, None  # a preconditioner belongs to its tangent

    def _solve_tresca(
        self, parts: Array, height: float, load: float, bound: Bound, tolerance: float
    ) -> tuple[Array, float, Contact]:
        """Solve with Tresca's friction; a hard stick is approached by softer ones."""
        road = self.road
        slips = [road.elastic_slip]
        while slips[0] < SOFT_ELASTIC_SLIP:
            slips.insert(0, slips[0] / ELASTIC_SLIP_FACTOR)
        try:
            for slip in slips:
                self.road = replace(road, elastic_slip=slip)
                parts, height, contact = self._iterate(parts, height, load, bound, tolerance)
        finally:
            self.road = road
        return parts, height, contact

    def _iterate(
        self, parts: Array, height: float, load: float, bound: Bound | None, tolerance: float
    ) -> tuple[Array, float, Contact]:
        """Newton's method, with a line search of the energy where the friction is bounded; with
        Coulomb's friction, of the residual, and left as soon as it does not converge. Raises
        Indefinite: with Coulomb's friction at once, else where the steadied tangent is so, too."""
        here, setbacks = self._state(parts, height, load, bound), 0
        first, steadied_at = 1.0, self.iterations
        for _ in range(MAX_NEWTON):
            self.check()
            if here.size <= tolerance * load:
                return parts, height, here.contact
            if self._steadied and self.iterations >= steadied_at + STEADIED_STEPS:
                self._steady(False)
            rough = here.size > COULOMB_RTOL * load
            self.iterations += 1
            residual = here.size / load
            log.debug("%g N: Newton iteration %d, residual %.2g", load, self.iterations, residual)
            energy = self._energy(here.contact, load, height) if bound else 0.0
            try:
                if bound is None and self._stale and not rough:
                    self._form(here.contact)
                step, rise = self._step(here, ROUGH_LINEAR_RTOL if rough else LINEAR_RTOL)
            except Indefinite:
                if bound is None or self._steadied:
                    raise
                self._steady(True)
                steadied_at = self.iterations
                continue
            slope = float((here.force * step).sum() + here.lacking * rise)
            # away from a saddle the energy falls faster with every step: by ever longer ones
            length = first if self._steadied else 1.0
            while True:
                ahead = parts + length * step, height + length * rise
                try:
                    there = self._state(*ahead, load, bound)
                    if there.size < 0.5 * here.size:
                        break
                    if bound:
                        low = energy + 1e-4 * length * slope
                        enough = self._energy(there.contact, load, ahead[1]) <= low
                    else:
                        enough = there.size < here.size or length <= MIN_COULOMB_LENGTH
                    if enough:
                        break
                except Inverted:
                    pass
                length /= 2
                if length < MIN_STEP_LENGTH:
                    raise NoEquilibrium("the line search found no lower energy")
            parts, height = ahead
            first = 2 * length if self._steadied else 1.0
            setbacks += there.size > 0.5 * here.size
            here = there
            if bound is None and setbacks > MAX_SETBACKS:
                break
        raise NoEquilibrium(f"Newton's method did not converge in {MAX_NEWTON} iterations")

    def _step(self, here: Imbalance, tolerance: float) -> tuple[Array, float]:
        """Newton's step of the parts and of the road's height."""
        fresh = self._factor is None or self._used > MAX_GMRES_BEFORE_NEW_FACTOR
        if fresh:
            self._form(here.contact)
        tangent = Tangent.of(here.contact, self.symmetry)
        equations = [Equations(tangent, -here.force, -here.lacking)]
        steps, rises, self._used, left = self._solve(equations, tolerance)
        if not fresh and not left[0] <= MAX_LINEAR_RESIDUAL:
            self._form(here.contact)
            steps, rises, self._used, left = self._solve(equations, tolerance)
        if not left[0] <= MAX_LINEAR_RESIDUAL:
            raise NoEquilibrium("the tangent is too far from a stable one")
        return steps[0], rises[0]

    def _solve(
        self, equations: Sequence[Equations], tolerance: float
    ) -> tuple[list[Array], list[float], int, list[float]]:
        """`solve` with the preconditioner at hand, or else one of this state."""
        factor = self._factor or self._form(equations[0].tangent.contact)
        return solve(self.tyre, self.symmetry, factor, equations, tolerance)

    def _form(self, contact: Contact) -> ContactUpdate:
        """The preconditioner at the last state. Raises Indefinite; the one before is gone, as two
        at a time would double the memory."""
        self.factorisations += 1
        self._stale, self._factor, self._formed_at, self._used = False, None, self.load, 0
        stiffness = self.symmetry.fold(contact.matrix(positive=True))
        tangents = self.tyre.tangents(np.float32)
        self._order = self._order or Elimination(tangents, self.symmetry)
        self._factor = ContactUpdate(Factor(self._order, tangents, stiffness))
        return self._factor

    def _derivatives(self, contact: Contact) -> list[tuple[Array, float]]:
        """Displacements' parts and rise of the road, m/N, by a unit of half the road's force, and
        the solutions of the equations that are wanted; the former the same whatever is wanted."""
        tangent = Tangent.of(contact, self.symmetry)
        unit, left = self._solved([Equations(tangent, 0 * self.parts, 1.0)], UNIT_RTOL)
        if left > MAX_UNIT_RESIDUAL:
            raise NoEquilibrium(f"the vertical stiffness was not found in {MAX_GMRES} iterations")
        wanted, left = self._solved(self.wanted(self, contact), SMOOTH_RTOL)
        if left > SMOOTH_RTOL:
            raise NoEquilibrium(f"a derivative was not found in {MAX_GMRES} iterations")
        return [*unit, *wanted]

    def _solved(
        self, equations: Sequence[Equations], tolerance: float
    ) -> tuple[list[tuple[Array, float]], float]:
        """Parts and rises that solve equations, and the largest residual, with a preconditioner of
        this state where that of another one does not reach the ``tolerance``."""
        if not equations:
            return [], 0.0
        parts, rises, _, left = self._solve(equations, tolerance)
        if max(left) > tolerance:
            self._form(equations[0].tangent.contact)
            parts, rises, _, left = self._solve(equations, tolerance)
        return list(zip(parts, rises, strict=True)), max(left)
