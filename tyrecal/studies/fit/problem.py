"""The calibration problem: design variables, targets, and the paper's objective, equation (1).

F = sqrt( sum over modes, doublets twice, of w (f_num - f_ref)^2 )

With standard deviations sigma, and other targets q (on the road contact areas, lengths,
widths, vertical stiffnesses and modes, the mass, and damping ratios):

F = sqrt( sum over modes, doublets twice, of w ((f_num - f_ref) / sigma)^2
          + sum over other targets of w ((q_num - q_ref) / sigma)^2 )

A frequency without sigma counts as one of 1 Hz, so that without any F is equation (1) in Hz; with
some, F is a number of standard deviations. What is known of a freed number counts as another target
(`free`). Each target has its state: a design is evaluated once in each state that has one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...simulate.evaluate.evaluator import DIFFERENCE_STEP, Evaluator
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
from ...simulate.modes.find import LabelledModes, ModesAnswer, modes_in_order
from ...simulate.modes.label import Label, Mode
from ...tyre.case import LoadedCase
from ...tyre.state import AS_THE_CASE, TyreState, without
from ..variable import read_variable
from .differences import differences
from .free import freed_variables
from .least_squares import fit_covariance, fit_response
from .road import PRESS_STEP, press, press_with_slopes
from .targets import (
    KNOWLEDGE_SIGMA,
    Target,
    ValueTarget,
    objective_unit,
    read_damping_targets,
    read_known,
    read_mass_targets,
    read_road_targets,
    read_targets,
)

Array = np.ndarray
BOUND_MARGIN = 1e-6  # of a scaled variable


@dataclass(frozen=True)
class Point:
    """One evaluated design."""

    values: Mapping[str, float]  # by variable, in its own unit
    x: Array  # (v,) coordinates of the free variables
    residuals: Array  # (n,) sqrt(w) (q - q_ref) / sigma of quantity q; of a pair times sqrt 2
    jacobian: Array  # (n, v) d residual / d x
    states: dict[TyreState, dict[Label, Mode]]  # modes that match the targets, by state
    clarity: float  # smallest `Mode.clarity` of the modes
    mass_kg: float
    others: Array  # quantities of the targets that are no unloaded modes, each in its own unit

    @property
    def plain(self) -> Point:
        """The design with the residuals above, whatever a fit minimises."""
        return self

    @property
    def modes(self) -> dict[Label, Mode]:
        """Modes of the case's own state, or of the first one that was measured."""
        return next(iter(self.states.values()), {})

    @property
    def objective(self) -> float:
        """F, Hz, or in standard deviations where targets have some."""
        return float(np.linalg.norm(self.residuals))

    @property
    def gradient(self) -> Array:
        """dF/dx (v,), Hz per unit of x."""
        return self.jacobian.T @ self.residuals / max(self.objective, 1e-300)


# called with (number of a design, its values, Point or failure)
FitNotify = Callable[[int, Mapping[str, float], Point | EvaluationFailed], None]


def objective(frequencies: Mapping[Label, float], targets: list[Target]) -> float:
    """F for frequencies by label: equation (1) in Hz where no target has a sigma.

    >>> from tyrecal.simulate.modes.label import Label
    >>> from .targets import Target
    >>> round(objective({Label(2, 0): 80.5}, [Target(Label(2, 0), 79.5)]), 4)
    1.4142
    """
    return math.sqrt(
        sum(
            t.weight
            * t.multiplicity
            * ((frequencies[t.label] - t.frequency_Hz) / (t.sigma_Hz or 1.0)) ** 2
            for t in targets
        )
    )


class Problem:
    """Evaluates designs for an optimiser, each distinct one once.

    notify: called with (number of the point, its values, Point or failure) as they come; jobs: how
    many states of a point are evaluated at a time, and how many neighbours, where the solver gives
    no slopes. measured: all targets, as their residuals stand: ``targets``, the unloaded
    tyre's modes, then ``others``, on the ``road``, the ``mass``, its ``damping`` and what is
    ``known``; labels: of modes by state.

    >>> problem = Problem(case, evaluator, fixed={"A_belt": 2e-7})
    >>> [v.name for v in problem.variables]
    ['A_carcass', 'C10']
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        fixed: Mapping[str, float] | None = None,
        notify: FitNotify | None = None,
        jobs: int = 1,
    ):
        self.case, self.evaluator, self.notify, self.jobs = case, evaluator, notify, jobs
        self.fixed = dict(fixed or {})
        self.variables = [
            read_variable(case, name) for name in case.case.variables if name not in self.fixed
        ]
        self.targets, self.road = read_targets(case), read_road_targets(case)
        self.mass, self.damping = read_mass_targets(case), read_damping_targets(case)
        self.freed, self.known = freed_variables(case), read_known(case)
        self.others = [*self.road, *self.mass, *self.damping, *self.known]
        self.measured: list[Target | ValueTarget] = [*self.targets, *self.others]
        self.scale = np.array([each.scale for each in self.measured])
        self.in_sigmas = objective_unit(case) == "sigma"  # the objective
        self.labels: dict[TyreState, list[Label]] = {}
        for target in self.targets:
            self.labels.setdefault(target.state, []).append(target.label)
        if not self.labels:  # for the mass, and to see that there is such a tyre
            self.labels[AS_THE_CASE] = []
        self.lower = np.array([v.scaled(v.lower) for v in self.variables])
        self.upper = np.array([v.scaled(v.upper) for v in self.variables])
        self.difference_step = evaluator.difference_step
        # how many of the road's targets, the first, have exact slopes: all but modes
        exact = self.road and self.difference_step is None
        exact = exact and "footprint_gradients" in evaluator.solver.capabilities
        self.exact_on_road = sum(not t.member for t in self.road) if exact else 0
        self.points: dict[tuple[float, ...], Point | EvaluationFailed] = {}
        # (v,) standard deviation of each coordinate about the start's, if it enters the fit
        self.spread: Array | None = None
        self.noise_Hz: float | None = None  # of frequencies without sigma, if it is known
        self.best: Point | None = None  # from whose state on the road the next design begins

    def start(self) -> Array:
        """Coordinates x (v,) of the case's start values."""
        return np.array([v.scaled(v.start) for v in self.variables])

    @property
    def counted(self) -> list[Target | ValueTarget]:
        """Targets that have a weight."""
        return [each for each, scale in zip(self.measured, self.scale, strict=True) if scale > 0]

    def again(self, evaluator: Evaluator, notify: FitNotify | None = None) -> Self:
        """The same problem, with its weights, without any design, evaluated by another
        evaluator."""
        other = copy(self)
        other.evaluator, other.notify, other.jobs = evaluator, notify, 1
        other.points, other.best = {}, None
        return other

    def is_settled(self, point: Point) -> bool:
        """Whether the weights hold at ``point``: here they are the same everywhere."""
        return True

    def weigh(self, point: Point) -> None:
        """Take the weights that hold at ``point``."""

    def response(self, point: Point) -> tuple[Array, Array]:
        """d x / d q (v, n) of the fitted coordinates by the n targets that count; which variables
        the data determine (v,)."""
        counts = self.scale > 0
        return fit_response(point.jacobian[counts], self.scale[counts])

    def covariance_by(self, point: Point, sigma: Array, used: Array) -> tuple[Array, Array]:
        """Covariance (v, v) of the coordinates by the scatter ``sigma`` of the targets of a mask
        ``used`` (targets,), as if only these were fitted; which variables they determine (v,)."""
        return fit_covariance(point.jacobian[used], self.scale[used], sigma[used])

    def left_of_prior(self, point: Point) -> Array:
        """Covariance (v, v) of the coordinates that the data leave of what was known of them
        before: 0, as nothing of it enters the fit."""
        return np.zeros((len(self.variables), len(self.variables)))

    def is_free(self, x: Array) -> Array:
        """Whether each variable (v,) is at no bound at coordinates x."""
        return np.minimum(x - self.lower, self.upper - x) >= BOUND_MARGIN

    def values(self, x: Array) -> dict[str, float]:
        """Values of all variables, fixed ones included, at coordinates x."""
        free = {v.name: v.value(float(xi)) for v, xi in zip(self.variables, x, strict=True)}
        return {**self.fixed, **free}

    def evaluate(self, x: Array) -> Point:
        """The design at x with its Jacobian, from memory if it was evaluated before.

        Raises EvaluationFailed.
        """
        values = self.values(x)
        key = tuple(values.values())
        if key not in self.points:
            try:
                self.points[key] = self._evaluate(values)
            except EvaluationFailed as failure:
                if failure.denied:
                    raise SolverUnavailable(str(failure)) from None
                self.points[key] = failure
            if self.notify:
                self.notify(len(self.points), values, self.points[key])
        known = self.points[key]
        if isinstance(known, Point) and (not self.best or known.objective < self.best.objective):
            self.best = known
        if isinstance(known, EvaluationFailed):
            raise known
        return known

    def _evaluate(self, values: dict[str, float]) -> Point:
        """Residuals and Jacobian at values of the variables. Raises EvaluationFailed."""
        names = tuple(v.name for v in self.variables)
        by_state = self._in_states(values, names)
        measured = self._measured(by_state)
        slopes = self.slopes(by_state, self.targets, values)
        if self.mass:
            slopes = np.vstack([slopes, self._mass_slopes(by_state, values)])
        if self.damping:  # no solver gives their sensitivities
            step = self.difference_step or DIFFERENCE_STEP
            rises = differences(self.variables, values, step, self._neighbours, measured)[1]
            slopes = np.vstack([slopes, rises[-len(self.damping) :]])
        modal = len(self.targets)
        pressed, rises = self._pressed(values)
        known, shifts = self._known(values)
        slopes = np.vstack([slopes[:modal], rises, slopes[modal:], shifts])
        others = np.concatenate([pressed, measured[modal:], known])
        wanted = [t.value for t in self.measured]
        x = np.array([v.scaled(values[v.name]) for v in self.variables])
        return Point(
            values,
            x,
            self.scale * (np.concatenate([measured[:modal], others]) - wanted),
            self.scale[:, None] * slopes,
            {state: answer.wanted for state, answer in by_state.items()},
            min(answer.clarity for answer in by_state.values()),
            _mass_kg(by_state),
            others,
        )

    def _pressed(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Quantities of the road's targets, and their slopes d q / d x (targets, variables)."""
        quantities, slopes = np.empty(0), np.empty((0, len(self.variables)))
        if patches := self.road[: self.exact_on_road]:
            names = [v.name for v in self.variables]
            base = self.best.values if self.best else values
            quantities, rates = press_with_slopes(
                self.case, self.evaluator, patches, values, names, base, self.jobs
            )
            slopes = rates * [v.slope(values[v.name]) for v in self.variables]
        if others := self.road[self.exact_on_road :]:
            ask = lambda designs: press(self.case, self.evaluator, others, designs, self.jobs)
            more = differences(self.variables, values, PRESS_STEP, ask)
            quantities, slopes = np.append(quantities, more[0]), np.vstack([slopes, more[1]])
        return quantities, slopes

    def _known(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """1 + 0.01 z of each freed number, z its shift in standard deviations, and d / d x (freed,
        variables)."""
        quantities = [1 + KNOWLEDGE_SIGMA * v.in_sd(values[n]) for n, v in self.freed.items()]
        slopes = [
            [
                KNOWLEDGE_SIGMA / each.steps[0] * v.slope(values[name]) * (v.name == name)
                for v in self.variables
            ]
            for name, each in self.freed.items()
        ]
        shape = len(self.freed), len(self.variables)
        return np.array(quantities, float), np.array(slopes, float).reshape(shape)

    def _measured(self, by_state: Mapping[TyreState, LabelledModes]) -> Array:
        """Frequencies (targets,) of a design, Hz, and behind them its mass and its damping ratios
        where they are targets. Raises DeckRefused where the solver gives no damping."""
        values = [by_state[t.state].wanted[t.label].frequency_Hz for t in self.targets]
        values += [_mass_kg(by_state) for _ in self.mass]
        for t in self.damping:
            assert t.member
            ratio = by_state[t.state].wanted[t.member.label].raw.damping_ratio
            if ratio is None:
                name = self.evaluator.solver.name
                raise DeckRefused(f"solver '{name}' computes no damping, which is a target")
            values.append(ratio)
        return np.array(values)

    def _neighbours(
        self, designs: Sequence[Mapping[str, float]]
    ) -> Iterator[Array | EvaluationFailed]:
        """`_measured` of each design, or its failure."""
        for values in designs:
            try:
                yield self._measured(self._in_states(values, ()))
            except EvaluationFailed as failure:
                yield failure

    def slopes(
        self,
        by_state: Mapping[TyreState, LabelledModes],
        targets: Sequence[Target],
        values: Mapping[str, float],
    ) -> Array:
        """d f / d x (targets, variables), Hz; a state's own numbers depend on no variable."""
        modes = [(by_state[t.state], by_state[t.state].wanted[t.label].position) for t in targets]
        rows = [[_slope(each, v.name, place) for v in self.variables] for each, place in modes]
        slopes = np.array(rows, float).reshape(len(rows), len(self.variables))
        return slopes * [v.slope(values[v.name]) for v in self.variables]

    def _mass_slopes(
        self, by_state: Mapping[TyreState, LabelledModes], values: Mapping[str, float]
    ) -> Array:
        """d mass / d x (variables,), kg. Raises DeckRefused where the solver does not give it."""
        known: dict[str, float] = {}
        for (
            each
        ) in by_state.values():  # a variable that one state sets moves the mass in the others
            known |= each.evaluation.mass_gradients
        if not known:
            name = self.evaluator.solver.name
            raise DeckRefused(
                f"solver '{name}' gives no sensitivities of the mass, which is a target"
            )
        slopes = [known.get(v.name, 0.0) * v.slope(values[v.name]) for v in self.variables]
        return np.array(slopes)

    def _in_states(
        self, values: Mapping[str, float], names: tuple[str, ...]
    ) -> dict[TyreState, LabelledModes]:
        """The design's target modes in every state, with sensitivities by ``names``; all are
        requested at once. Raises DeckRefused before EvaluationFailed."""
        wanted = [self.question(values, state, names) for state in self.labels]
        answers = self.modes_of(wanted, [*self.labels.values()])
        failures = [each for each in answers if not isinstance(each, LabelledModes)]
        for failure in sorted(failures, key=lambda each: isinstance(each, EvaluationFailed)):
            raise failure
        modes = (each for each in answers if isinstance(each, LabelledModes))
        return dict(zip(self.labels, modes, strict=True))

    def question(
        self, values: Mapping[str, float], state: TyreState, names: tuple[str, ...]
    ) -> tuple[dict[str, float], tuple[str, ...]]:
        """A design in a state, and those of the slopes ``names`` that it has there."""
        own = state.numbers(self.case)
        left = without(self.case, dict.fromkeys(names, 0.0), own)
        return state.design(self.case, values), tuple(left)

    def modes_of(
        self,
        wanted: Sequence[tuple[Mapping[str, float], tuple[str, ...]]],
        labels: Sequence[Sequence[Label]] = (),
    ) -> list[ModesAnswer]:
        """Modes of each design, with the names of its own slopes, by its ``labels``, by default
        those of all targets; failures and refusals among them."""
        every = [t.label for t in self.targets]
        tell = lambda place, modes: labels[place] if labels else every
        return modes_in_order(self.evaluator, wanted, tell, self.jobs)


def _mass_kg(by_state: Mapping[TyreState, LabelledModes]) -> float:
    """The tyre's, kg, the same in every state."""
    return next(iter(by_state.values())).evaluation.mass_kg


def _slope(labelled: LabelledModes, name: str, place: int) -> float:
    """d f / d variable of the mode at a place, Hz per unit of it; 0 where it sets nothing there."""
    gradient = labelled.evaluation.gradients.get(name)
    return 0.0 if gradient is None else float(gradient[place])
