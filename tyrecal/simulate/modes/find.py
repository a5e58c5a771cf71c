"""Labelled modes of designs; more modes are computed if a wanted label is not among the first.

Where the solver gives no exact sensitivities, they are differences to neighbouring designs."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..evaluate.evaluator import Evaluator, Question
from ..evaluate.failure import DeckRefused, EvaluationFailed
from ..evaluate.results import Evaluation
from .label import Label, Mode, paired_labels

Array = np.ndarray


Key = TypeVar("Key", bound=Hashable)
Reply = TypeVar("Reply")


def neighbours(
    sides: Mapping[Key, Sequence[float]], ask: Callable[[Mapping[Key, float]], Iterable[Reply]]
) -> dict[Key, tuple[float, Reply]]:
    """The neighbour of each number and what was answered there: on the first of its ``sides``, or
    on the next one if that has no solution.

    ask: answers for one neighbour of each number, in order. A failure is the answer if no side has
    a solution, or without a licence, because then the other side would fail, too.
    """
    left = {key: list(each) for key, each in sides.items()}
    known: dict[Key, tuple[float, Reply]] = {}
    while left:
        here = {key: each.pop(0) for key, each in left.items()}
        for (key, neighbour), answer in zip(here.items(), ask(here), strict=True):
            denied = getattr(answer, "denied", False)
            if not isinstance(answer, Exception) or denied or not left[key]:
                known[key] = neighbour, answer
                del left[key]
    return known


# per harmonic, one after the other, if a label is not among the modes first computed
MORE_MODES = (4, 8)
# labels that are wanted of a question, from its index and its modes
Wanted = Callable[[int, Sequence[Mode]], Sequence[Label]]


@dataclass(frozen=True)
class LabelledModes:
    """An evaluated design with its modes by label."""

    evaluation: Evaluation
    modes: list[Mode]  # all of them, harmonic by harmonic
    wanted: dict[Label, Mode]  # those that were asked for, no other

    @property
    def clarity(self) -> float:
        """The smallest clarity of a wanted mode, 0 (two labels fit equally well) to 1."""
        return margin(self.wanted)


ModesAnswer = LabelledModes | EvaluationFailed | DeckRefused


def find_modes(
    evaluator: Evaluator,
    questions: Sequence[Question],
    wanted: Sequence[Label] | Wanted,
    jobs: int = 1,
) -> Iterator[tuple[int, ModesAnswer]]:
    """Index and answer of each question, those that lack a wanted label evaluated again with more
    modes; with exact sensitivities as they are ready, else with differences, see `_with_rates`.

    wanted: labels, or a function that gives them.
    """
    step = evaluator.difference_step if any(q.gradients for q in questions) else None
    if step is None:
        yield from _find(evaluator, questions, wanted, jobs)
    else:
        bare = [replace(question, gradients=()) for question in questions]
        answers = dict(_find(evaluator, bare, wanted, jobs))
        yield from _with_rates(evaluator, questions, answers, wanted, jobs, step).items()


def _with_rates(
    evaluator: Evaluator,
    questions: Sequence[Question],
    answers: dict[int, ModesAnswer],
    wanted: Sequence[Label] | Wanted,
    jobs: int,
    step: float,
) -> dict[int, ModesAnswer]:
    """The answers with the sensitivities that the questions name, by one neighbour for each number:
    above, or below where that has no solution (the order of `decks.steps`); all neighbours of a
    side at once. NaN for modes whose label the neighbour lacks. If both have no solution, the
    failure is the answer.

    step: a share of the value, of a linear variable or an effect of its range (`decks.steps`)."""
    designs = {place: each for place, each in answers.items() if isinstance(each, LabelledModes)}
    sides = {
        (place, name): evaluator.design.steps(name, questions[place].values[name], step)
        for place in designs
        for name in questions[place].gradients
    }

    def ask(values: Mapping[tuple[int, str], float]) -> list[ModesAnswer]:
        """Answers of the designs with one number, by place and name, set to each value."""
        keys = list(values)
        near = [
            replace(questions[place], values={**questions[place].values, name: value}, gradients=())
            for (place, name), value in values.items()
        ]
        of_neighbour: Wanted = lambda i, modes: _labels(wanted, keys[i][0], modes)
        known = dict(_find(evaluator, near, of_neighbour, jobs))
        return [known[i] for i in range(len(keys))]

    # by place, then name: of the modes, Hz per unit, and of the mass, kg per unit
    rates: dict[int, tuple[dict[str, Array], dict[str, float]]] = {p: ({}, {}) for p in designs}
    for (place, name), (value, other) in neighbours(sides, ask).items():
        if not isinstance(other, LabelledModes):
            answers[place] = other
            continue
        centre, width = designs[place], value - questions[place].values[name]
        hertz = {mode.label: mode.frequency_Hz for mode in other.modes}
        # Hz per unit at each mode's `position`; of pairs joined to one the rest is not read
        rate = np.full(len(centre.evaluation.modes), np.nan)
        for mode in centre.modes:
            rise = hertz.get(mode.label, np.nan) - mode.frequency_Hz
            rate[mode.position] = rise / width
        rates[place][0][name] = rate
        rise = other.evaluation.mass_kg - centre.evaluation.mass_kg
        rates[place][1][name] = rise / width
    for place, (of_modes, of_mass) in rates.items():
        answer = answers[place]
        if isinstance(answer, LabelledModes):
            own = replace(answer.evaluation, gradients=of_modes, mass_gradients=of_mass)
            answers[place] = replace(answer, evaluation=own)
    return answers


def _labels(wanted: Sequence[Label] | Wanted, place: int, modes: Sequence[Mode]) -> Sequence[Label]:
    """The labels wanted of a question."""
    return wanted(place, modes) if callable(wanted) else wanted


def _find(
    evaluator: Evaluator, questions: Sequence[Question], wanted: Sequence[Label] | Wanted, jobs: int
) -> Iterator[tuple[int, ModesAnswer]]:
    """`find_modes` without differences."""
    lost = dict.fromkeys(range(len(questions)), EvaluationFailed("lost_label", ""))
    for count in (None, *MORE_MODES):
        places, lost = list(lost), {}
        repeats = [
            replace(
                questions[place], modes_per_harmonic=count or questions[place].modes_per_harmonic
            )
            for place in places
        ]
        answers = evaluator.answer_all(repeats, min(jobs, len(repeats)))
        for place, answer in zip(places, answers, strict=True):
            if not isinstance(answer, Evaluation):
                yield place, answer
                continue
            modes = paired_labels(answer.modes)  # the two modes of each pair as one
            try:  # `match` raises EvaluationFailed (lost_label)
                labels = _labels(wanted, place, modes)
                yield place, LabelledModes(answer, modes, match(modes, labels))
            except EvaluationFailed as error:
                lost[place] = error
        if not lost:
            break
    yield from lost.items()


def modes_in_order(
    evaluator: Evaluator,
    designs: Sequence[tuple[Mapping[str, float], tuple[str, ...]]],
    wanted: Sequence[Label] | Wanted,
    jobs: int = 1,
) -> list[ModesAnswer]:
    """An answer for each design in order: its values, and the names of its sensitivities."""
    questions = [Question(*each) for each in designs]
    answers = dict(find_modes(evaluator, questions, wanted, jobs))
    return [answers[place] for place in range(len(questions))]


def match(modes: Sequence[Mode], targets: Sequence[Label]) -> dict[Label, Mode]:
    """The mode of each target. Labels of one evaluation are unique: ``label_modes`` settled
    shared orders, the two [0,0] among them, by assignment.

    Raises EvaluationFailed (lost_label) naming every target that no mode carries.
    """
    by_label = {mode.label: mode for mode in modes}
    lost = [label for label in targets if label not in by_label]
    if lost:
        waves = {label.c for label in lost}
        near = [
            f"{mode.label.display} at {mode.frequency_Hz:.2f} Hz"
            for mode in sorted(modes, key=lambda mode: mode.frequency_Hz)
            if mode.label.c in waves
        ]
        raise EvaluationFailed(
            "lost_label",
            f"no mode is {', '.join(label.display for label in lost)}; with"
            f" {' or '.join(map(str, sorted(waves)))} waves round the circumference there"
            f" {'are ' + ', '.join(near) if near else 'is none'}",
        )
    return {label: by_label[label] for label in targets}


def margin(matched: dict[Label, Mode]) -> float:
    """The smallest clarity of the matched modes, 0 (some label is a tie) to 1."""
    return min((mode.clarity for mode in matched.values()), default=1.0)
