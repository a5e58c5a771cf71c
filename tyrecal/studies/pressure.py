"""Frequencies over inflation pressure, each mode followed by its shape."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..simulate.evaluate.evaluator import Evaluator, Question
from ..simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ..simulate.modes.find import Found, find_modes, labelled
from ..simulate.modes.label import Label, Mode
from ..tyre.case import LoadedCase
from .fit.problem import read_targets
from .fitted import pressure_name


@dataclass(frozen=True)
class State:
    """A design at a pressure: all labelled modes by rising frequency and, where the solver has
    slopes, d ln f / d ln p by label (else None)."""

    design: str
    pressure_kPa: float
    modes: list[Mode]
    slopes: dict[Label, float] | None

    @property
    def frequencies(self) -> dict[Label, float]:
        """Hz by label."""
        return {mode.label: mode.frequency_Hz for mode in self.modes}


@dataclass(frozen=True)
class Failure:
    """A pressure at which a design could not be evaluated."""

    design: str
    pressure_kPa: float
    failed: EvaluationFailed


SweepOutcome = State | Failure


def sweep(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    pressures_kPa: Sequence[float],
    jobs: int = 1,
    notify: Callable[[SweepOutcome], None] = lambda outcome: None,
) -> list[SweepOutcome]:
    """Every design (name to values of the variables) at every pressure, in that order.

    Where a target's mode is not among the modes that the case asks for, more are asked for.
    Raises DeckRefused and what else ``Evaluator.evaluate`` raises for wrong input; an
    evaluation that fails is an outcome.
    """
    name = pressure_name(case)
    wanted = [target.label for target in read_targets(case)]
    gradients = (name,) if evaluator.has_gradients else ()
    places = [(design, p) for design in designs for p in pressures_kPa]
    questions = [Question({**designs[design], name: p}, gradients) for design, p in places]
    outcomes: dict[int, SweepOutcome] = {}
    for i, answer in find_modes(evaluator, questions, wanted, jobs):
        if isinstance(answer, DeckRefused):
            raise answer
        outcomes[i] = _outcome(*places[i], answer, name)
        notify(outcomes[i])
    return [outcomes[i] for i in range(len(places))]


def _outcome(
    design: str, pressure_kPa: float, answer: Found | EvaluationFailed, name: str
) -> SweepOutcome:
    if isinstance(answer, EvaluationFailed):
        return Failure(design, pressure_kPa, answer)
    modes = labelled(answer.evaluation)
    gradient = answer.evaluation.gradients.get(name)
    exact = None
    if gradient is not None:
        scale = {m.label: pressure_kPa / m.frequency_Hz for m in modes}
        exact = {m.label: float(gradient[m.position]) * scale[m.label] for m in modes}
    return State(design, pressure_kPa, modes, exact)
