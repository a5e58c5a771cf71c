"""Wanted labels found among the modes of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence

from ..evaluate.failure import EvaluationFailed
from .label import Label, Mode


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
