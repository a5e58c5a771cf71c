"""Frequencies over inflation pressure, each mode followed by its shape."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..case import LoadedCase
from ..evaluate.evaluator import Evaluator, Question
from ..evaluate.failure import EvaluationFailed
from ..evaluate.results import Evaluation
from ..fit.problem import MORE_MODES, read_targets
from ..modes.label import paired_labels
from ..modes.match import LostLabel, match
from ..modes.mode import Label, Mode
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


Outcome = State | Failure


def sweep(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    pressures_kPa: Sequence[float],
    jobs: int = 1,
    notify: Callable[[Outcome], None] = lambda outcome: None,
) -> list[Outcome]:
    """Every design (name to values of the variables) at every pressure, in that order.

    Where a target's mode is not among the modes that the case asks for, more are asked for.
    Raises DeckRefused and what else ``Evaluator.evaluate`` raises for wrong input; an
    evaluation that fails is an outcome.
    """
    name = pressure_name(case)
    wanted = [target.label for target in read_targets(case)]
    gradients = (name,) if evaluator.has_gradients else ()
    places = waiting = [(design, p) for design in designs for p in pressures_kPa]
    outcomes: dict[tuple[str, float], Outcome] = {}
    for count in (None, *MORE_MODES):
        if not waiting:
            break
        questions = [Question({**designs[d], name: p}, gradients, count) for d, p in waiting]
        lost = []
        for place, answer in zip(waiting, evaluator.evaluate_all(questions, jobs), strict=True):
            outcomes[place] = outcome = _outcome(*place, answer, name, wanted)
            if isinstance(outcome, Failure) and outcome.failed.cause == "lost_label":
                lost.append(place)
            else:
                notify(outcome)
        waiting = lost
    for place in waiting:
        notify(outcomes[place])
    return [outcomes[place] for place in places]


def _outcome(
    design: str,
    pressure_kPa: float,
    answer: Evaluation | EvaluationFailed,
    name: str,
    wanted: Sequence[Label],
) -> Outcome:
    if isinstance(answer, EvaluationFailed):
        return Failure(design, pressure_kPa, answer)
    modes = sorted(paired_labels(answer.modes), key=lambda mode: mode.frequency_Hz)
    try:
        match(modes, wanted)
    except LostLabel as lost:
        return Failure(design, pressure_kPa, EvaluationFailed("lost_label", str(lost)))
    gradient = answer.gradients.get(name)
    exact = None
    if gradient is not None:
        scale = {m.label: pressure_kPa / m.frequency_Hz for m in modes}
        exact = {m.label: float(gradient[m.position]) * scale[m.label] for m in modes}
    return State(design, pressure_kPa, modes, exact)
