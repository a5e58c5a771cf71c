"""One evaluation, labelled: the content of modes.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..case import LoadedCase
from ..evaluate.results import Evaluation
from ..modes.label import paired_labels
from ..modes.mode import Mode


def modes_result(
    case: LoadedCase, values: Mapping[str, float], evaluation: Evaluation
) -> tuple[dict[str, Any], list[Mode]]:
    """The content of modes.json, and the labelled modes, both by rising frequency."""
    modes = sorted(paired_labels(evaluation.modes), key=lambda mode: mode.frequency_Hz)
    result = {
        "format": 1,
        "pressure_kPa": evaluation.pressure_kPa,
        "load_N": 0.0,
        "mass_kg": evaluation.mass_kg,
        "variables": dict(values),
        "modes": [mode_entry(mode) for mode in modes],
    }
    return result, modes


def mode_entry(mode: Mode) -> dict[str, Any]:
    """A mode as result files hold it."""
    return {
        "c": mode.label.c,
        "m": mode.label.m,
        "kind": mode.label.kind,
        "frequency_Hz": mode.frequency_Hz,
        "multiplicity": mode.multiplicity,
        "clarity": round(float(mode.clarity), 6),
    }
