"""The calibration problem: design variables, targets, and the paper's objective, equation (1).

F = sqrt( sum over modes, doublets twice, of w (f_num - f_ref)^2 )

With standard deviations sigma, and footprint targets q (contact areas, vertical stiffnesses):

F = sqrt( sum over modes, doublets twice, of w ((f_num - f_ref) / sigma)^2
          + sum over footprint targets of w ((q_num - q_ref) / sigma)^2 )

A frequency without sigma counts as one of 1 Hz, so that without any F is equation (1) in Hz; with
some, F is a number of standard deviations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...simulate.evaluate.evaluator import Evaluator, Question
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
from ...simulate.modes.find import Found, ModesAnswer, find_modes
from ...simulate.modes.label import Label, Mode
from ...tyre.case import LoadedCase
from .differences import STEP, differences
from .footprint import MAX_SLOPE, PRESS_STEP, press, read_footprint_targets
from .variable import read_variable

Array = np.ndarray


@dataclass(frozen=True)
class Target:
    """A measured mode: frequency and standard deviation in Hz, weight in the objective."""

    label: Label
    frequency_Hz: float
    weight: float = 1.0
    sigma_Hz: float | None = None

    @property
    def multiplicity(self) -> int:
        """How many modes it stands for: doublets count twice."""
        return 2 if self.label.c else 1

    @property
    def scale(self) -> float:
        """Residual per Hz, sqrt(weight multiplicity) / sigma."""
        return math.sqrt(self.weight * self.multiplicity) / (self.sigma_Hz or 1.0)


@dataclass(frozen=True)
class Point:
    """One evaluated design: coordinates x, residuals sqrt(w) (q - q_ref) / sigma (a doublet's by
    sqrt 2), their Jacobian by x, the modes that were matched, and the label's margin; of each
    footprint target its quantity, in its own unit; by how much the objective may jump nearby, as
    nodes of the tread come to touch the road."""

    values: Mapping[str, float]
    x: Array
    residuals: Array
    jacobian: Array
    modes: dict[Label, Mode]
    clarity: float
    mass_kg: float
    footprint: Array
    roughness: float

    @property
    def objective(self) -> float:
        """F, Hz, or in standard deviations where targets have some."""
        return float(np.linalg.norm(self.residuals))

    @property
    def gradient(self) -> Array:
        """dF/dx, Hz."""
        return self.jacobian.T @ self.residuals / max(self.objective, 1e-300)


def objective(frequencies: Mapping[Label, float], targets: list[Target]) -> float:
    """F for frequencies by label: equation (1) in Hz where no target has a sigma."""
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
    many neighbours of a point are evaluated at a time, where the solver gives no slopes or presses.
    targets: the modes'; footprint: those of footprints, whose residuals follow the modes'.
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        fixed: Mapping[str, float] | None = None,
        notify: Callable[[int, Mapping[str, float], Point | EvaluationFailed], None] | None = None,
        jobs: int = 1,
    ):
        self.case, self.evaluator, self.notify, self.jobs = case, evaluator, notify, jobs
        self.fixed = dict(fixed or {})
        self.variables = [
            read_variable(name, v)
            for name, v in case.case.variables.items()
            if name not in self.fixed
        ]
        self.targets, self.footprint = read_targets(case), read_footprint_targets(case)
        modal, pressed = ([t.scale for t in each] for each in (self.targets, self.footprint))
        self.scale = np.array(modal + pressed)
        self.lower = np.array([v.scaled(v.lower) for v in self.variables])
        self.upper = np.array([v.scaled(v.upper) for v in self.variables])
        self.difference_step = (
            None if evaluator.has_gradients else getattr(evaluator.solver, "difference_step", STEP)
        )
        self.points: dict[tuple[float, ...], Point | EvaluationFailed] = {}

    def start(self) -> Array:
        """Coordinates of the case's start values."""
        return np.array([v.scaled(v.start) for v in self.variables])

    def values(self, x: Array) -> dict[str, float]:
        """Values of all variables, fixed ones included, at coordinates x."""
        free = {v.name: v.value(float(xi)) for v, xi in zip(self.variables, x, strict=True)}
        return {**self.fixed, **free}

    def evaluate(self, x: Array) -> Point:
        """The design at x with its Jacobian, from memory if it was asked for before.

        Raises EvaluationFailed.
        """
        values = self.values(x)
        key = tuple(values.values())
        if key not in self.points:
            try:
                self.points[key] = self._evaluate(values)
            except EvaluationFailed as failure:
                if failure.cause == "licence":  # says nothing about the design
                    raise SolverUnavailable(str(failure)) from None
                self.points[key] = failure
            if self.notify:
                self.notify(len(self.points), values, self.points[key])
        known = self.points[key]
        if isinstance(known, EvaluationFailed):
            raise known
        return known

    def _evaluate(self, values: dict[str, float]) -> Point:
        names = tuple(v.name for v in self.variables)
        exact = self.difference_step is None
        (answer,) = self.modes([values], names if exact else ())
        if isinstance(answer, EvaluationFailed):
            raise answer
        modes, gradients = answer.wanted, answer.evaluation.gradients
        order = [modes[t.label] for t in self.targets]
        frequencies = np.array([m.frequency_Hz for m in order])
        if exact:
            slopes = np.array([[gradients[n][m.position] for n in names] for m in order])
            slopes = slopes.reshape(len(order), len(names))
            slopes *= [v.slope(values[v.name]) for v in self.variables]
        else:
            step = self.difference_step or STEP
            slopes = differences(self.variables, values, step, self._frequencies, frequencies)[1]
        pressed = shares = np.empty(0)
        if self.footprint:
            ask = lambda designs: press(
                self.case, self.evaluator, self.footprint, designs, self.jobs
            )
            found, rises = differences(self.variables, values, PRESS_STEP, ask, steepest=MAX_SLOPE)
            pressed, shares = np.split(found, 2)
            slopes = np.vstack([slopes, rises[: len(pressed)]])
        wanted = [t.frequency_Hz for t in self.targets] + [t.value for t in self.footprint]
        x = np.array([v.scaled(values[v.name]) for v in self.variables])
        return Point(
            values,
            x,
            self.scale * (np.concatenate([frequencies, pressed]) - wanted),
            self.scale[:, None] * slopes,
            modes,
            answer.clarity,
            answer.evaluation.mass_kg,
            pressed,
            float(np.linalg.norm(self.scale[len(order) :] * pressed * shares)),
        )

    def _frequencies(
        self, designs: Sequence[Mapping[str, float]]
    ) -> Iterator[Array | EvaluationFailed]:
        """Frequencies (targets,) of each design, Hz, or its failure."""
        for answer in self.modes(designs):
            if isinstance(answer, EvaluationFailed):
                yield answer
            else:
                yield np.array([answer.wanted[t.label].frequency_Hz for t in self.targets])

    def modes(
        self, designs: Sequence[Mapping[str, float]], names: tuple[str, ...] = ()
    ) -> list[Found | EvaluationFailed]:
        """Of each design its target modes, or its failure. Raises DeckRefused."""
        found: list[Found | EvaluationFailed] = []
        for answer in self.modes_of([(design, names) for design in designs]):
            if isinstance(answer, DeckRefused):
                raise answer
            found.append(answer)
        return found

    def modes_of(
        self, wanted: Sequence[tuple[Mapping[str, float], tuple[str, ...]]]
    ) -> list[ModesAnswer]:
        """`modes` of designs, each with the names of its own slopes, refusals among them."""
        labels = [t.label for t in self.targets]
        questions = [Question(*each) for each in wanted]
        answers = dict(find_modes(self.evaluator, questions, labels, self.jobs))
        return [answers[place] for place in range(len(wanted))]


def objective_unit(case: LoadedCase) -> str:
    """``Hz``, or ``sigma`` where a target has a standard deviation: the objective counts them."""
    modal = any(target.sigma_Hz for target in read_targets(case))
    return "sigma" if modal or read_footprint_targets(case) else "Hz"


def read_targets(case: LoadedCase) -> list[Target]:
    """Target modes of a case; an empty list where it has none."""
    if case.case.targets is None:
        return []
    return [
        Target(Label(t.c, t.m, t.kind), t.frequency_Hz, t.weight, t.sigma_Hz)
        for t in case.case.targets.modes
    ]
