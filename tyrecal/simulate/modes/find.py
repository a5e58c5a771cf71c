"""Labelled modes of designs; more modes are computed where a wanted label is not among them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from ..evaluate.evaluator import Evaluator, Question
from ..evaluate.failure import DeckRefused, EvaluationFailed
from ..evaluate.results import Evaluation
from .label import Label, Mode, paired_labels
from .match import margin, match

MORE_MODES = (4, 8)  # per harmonic, where a label is not among the modes first asked for
Wanted = Callable[[int, Sequence[Mode]], Sequence[Label]]  # of a question's place, and its modes


@dataclass(frozen=True)
class LabelledModes:
    """An evaluated design with its modes by label."""

    evaluation: Evaluation
    modes: list[Mode]  # all of them, harmonic by harmonic
    wanted: dict[Label, Mode]

    @property
    def clarity(self) -> float:
        """The smallest of the wanted modes', 0 (some label is a tie) to 1."""
        return margin(self.wanted)


ModesAnswer = LabelledModes | EvaluationFailed | DeckRefused


def find_modes(
    evaluator: Evaluator,
    questions: Sequence[Question],
    wanted: Sequence[Label] | Wanted,
    jobs: int = 1,
) -> Iterator[tuple[int, ModesAnswer]]:
    """Place and answer of each question as they come, those without a wanted label at the end.

    wanted: labels, or what tells them from a question's place and its modes.
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
            modes = paired_labels(answer.modes)
            try:
                labels = wanted(place, modes) if callable(wanted) else wanted
                yield place, LabelledModes(answer, modes, match(modes, labels))
            except EvaluationFailed as error:
                lost[place] = error
        if not lost:
            break
    yield from lost.items()
