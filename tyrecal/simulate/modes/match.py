"""Wanted labels found among the modes of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence

from .mode import Label, Mode


class LostLabel(Exception):
    """No mode carries one or more of the wanted labels.

    labels: those not found; found: (label, Hz) of all modes there were, by frequency.
    """

    def __init__(self, labels: Sequence[Label], modes: Sequence[Mode]):
        self.labels = tuple(labels)
        ordered = sorted(modes, key=lambda mode: mode.frequency_Hz)
        self.found = tuple((mode.label, mode.frequency_Hz) for mode in ordered)
        waves = {label.c for label in labels}
        near = [f"{label.said} at {f:.2f} Hz" for label, f in self.found if label.c in waves]
        super().__init__(
            f"no mode is {', '.join(label.said for label in labels)}; with"
            f" {_listed(sorted(waves))} waves round the circumference there"
            f" {'are ' + ', '.join(near) if near else 'is none'}"
        )

    def __reduce__(self) -> tuple[object, ...]:
        # a process pool rebuilds the error from its fields, for which __init__ wants modes
        return _rebuilt, (self.labels, self.found, str(self))


def match(modes: Sequence[Mode], targets: Sequence[Label]) -> dict[Label, Mode]:
    """The mode of each target. Labels of one evaluation are unique: ``label_modes`` settled
    shared orders, the two [0,0] among them, by assignment.

    Raises LostLabel naming every target that no mode carries.
    """
    by_label = {mode.label: mode for mode in modes}
    lost = [label for label in targets if label not in by_label]
    if lost:
        raise LostLabel(lost, modes)
    return {label: by_label[label] for label in targets}


def margin(matched: dict[Label, Mode]) -> float:
    """The smallest clarity of the matched modes, 0 (some label is a tie) to 1."""
    return min((mode.clarity for mode in matched.values()), default=1.0)


def _listed(numbers: Sequence[int]) -> str:
    return " or ".join(map(str, numbers))


def _rebuilt(
    labels: tuple[Label, ...], found: tuple[tuple[Label, float], ...], text: str
) -> LostLabel:
    error = LostLabel.__new__(LostLabel)
    error.labels, error.found, error.args = labels, found, (text,)
    return error
