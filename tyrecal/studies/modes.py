"""One evaluation, labelled: the content of modes.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..case import LoadedCase
from ..evaluate.results import Evaluation
from ..modes.find import labelled
from ..modes.mode import Mode


def modes_result(
    case: LoadedCase, values: Mapping[str, float], evaluation: Evaluation
) -> tuple[dict[str, Any], list[Mode]]:
    """The content of modes.json, and the labelled modes, both by rising frequency."""
    modes = labelled(evaluation)
    result = {
        "format": 1,
        "pressure_kPa": evaluation.pressure_kPa,
        "load_N": 0.0,
        "mass_kg": evaluation.mass_kg,
        "variables": dict(values),
        "modes": sorted(
            (entry for mode in modes for entry in _entries(mode)),
            key=lambda entry: entry["frequency_Hz"],
        ),
    }
    return result, modes


def _entries(mode: Mode) -> list[dict[str, Any]]:
    """A mode, or the two members of a doublet that is split."""
    if mode.raw.members is None:
        return [mode_entry(mode)]
    return [
        {**mode_entry(mode), "frequency_Hz": hertz, "multiplicity": 1, "member": member}
        for member, hertz in enumerate(mode.raw.members, start=1)
    ]


def mode_entry(mode: Mode) -> dict[str, Any]:
    """A mode as result files hold it; a doublet that is split at its mean."""
    return {
        "c": mode.label.c,
        "m": mode.label.m,
        "kind": mode.label.kind,
        "frequency_Hz": mode.frequency_Hz,
        "multiplicity": mode.multiplicity,
        "clarity": round(float(mode.clarity), 6),
    }
