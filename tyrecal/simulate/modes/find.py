"""Labelled modes of designs; more modes are computed if a wanted label is not among the first."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ..evaluate.evaluator import Evaluator, Question
from ..evaluate.failure import DeckRefused, EvaluationFailed
from ..evaluate.results import Evaluation
from .label import Label, Mode, paired_labels
from .match import margin, match

MORE_MODES = (4, 8)  # per harmonic, if a label is not among the modes first computed
# labels that are wanted of a question, from its index and its modes
Wanted = Callable[[int, Sequence[Mode]], Sequence[Label]]


@dataclass(frozen=True)
class LabelledModes:
    """An evaluated design with its modes by label."""

    evaluation: Evaluation
    modes: list[Mode]  # all of them, harmonic by harmonic
    wanted: dict[Label, Mode]

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
    """Index and answer of each question as they are ready; those that lack a wanted label are
    evaluated again with more modes, and come last.

    wanted: labels, or a function that gives them.
    """
    lost = dict.fromkeys(range(len(questions)), EvaluationFailed("lost_label", ""))
    for count in (None, *MORE_MODES):
        places, lost = list(lost), {}
        repeats = [replace(questions[place], modes_per_harmonic=count) for place in places]
        answers = evaluator.answer_all(repeats, min(jobs, len(repeats)))
        for place, answer in zip(places, answers, strict=True):
            if not isinstance(answer, Evaluation):
                yield place, answer
                continue
            modes = paired_labels(answer.modes)  # the two modes of each pair as one
            try:
                labels = wanted(place, modes) if callable(wanted) else wanted
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
