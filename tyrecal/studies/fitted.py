"""The design that a fit found, read back from fit.json for a study of the same case."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from ..case import LoadedCase, start_values, with_values
from ..evaluate.door import Door, Question
from ..modes.label import paired_labels
from ..modes.mode import Label

ALIKE = 0.01  # of a frequency: meshes and solvers differ by less, other tyres by more


class NotThisFit(ValueError):
    """The file is no result of a fit of this case."""


def read_fitted(path: Path, case: LoadedCase, solver: str = "") -> dict[str, float]:
    """Fitted values of the case's variables (in the units of the numbers they set) in fit.json.

    One evaluation makes sure that the fit is this case's: its frequencies have to come out again
    within 1 %, as far as the case's own number of modes reaches. Raises NotThisFit in one
    sentence; OSError; EvaluationFailed and what else ``Door.evaluate`` raises.
    """
    try:
        fit = json.loads(path.read_text(encoding="utf-8"))
        found = {name: v["value"] for name, v in fit["variables"].items()} | fit["fixed"]
        told = {_label(mode): float(mode["fitted_Hz"]) for mode in fit["modes"]}
        pressure = float(fit["pressure_kPa"])
    except (ValueError, KeyError, TypeError, AttributeError):
        raise NotThisFit(f"'{path}' is not the fit.json that 'tyrecal fit' writes") from None
    names = set(start_values(case))
    for name in [*sorted(names - set(found)), *sorted(set(found) - names)]:
        where = "is missing from" if name in names else "of this case is not known, but stands in"
        raise NotThisFit(
            f"variable '{name}' {where} '{path}'; give a fit of this case, which has"
            f" {', '.join(sorted(names))}"
        )
    for name, value in found.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise NotThisFit(f"variable '{name}' is {value!r} in '{path}', must be a finite number")
    values = {name: float(found[name]) for name in start_values(case)}
    design = dict(values)
    if pressure_name(case) == "pressure_kPa":
        design["pressure_kPa"] = pressure  # else its variable stands among the others
    try:
        with_values(case, design)
    except ValueError as error:
        raise NotThisFit(f"'{path}' holds a design that this case cannot have: {error}") from None
    evaluation = Door(case, solver).evaluate(Question(design))
    ours = {mode.label: mode.frequency_Hz for mode in paired_labels(evaluation.modes)}
    for label, frequency in told.items():
        if label in ours and not abs(ours[label] - frequency) <= ALIKE * frequency:
            raise NotThisFit(
                f"'{path}' is a fit of another case: {label} has {frequency:.2f} Hz there, here"
                f" {ours[label]:.2f} Hz with the same variables; give the case, --set and --mesh"
                " that it was fitted with"
            )
    return values


def pressure_name(case: LoadedCase) -> str:
    """What sets the pressure: the case's variable that does so, else its path."""
    for name, variable in case.case.variables.items():
        if "pressure_kPa" in variable.sets:
            return name
    return "pressure_kPa"


def _label(mode: Mapping[str, Any]) -> Label:
    return Label(mode["c"], mode["m"], mode["kind"])
