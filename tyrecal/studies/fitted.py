"""The design that a fit found, read back from fit.json for a study of the same case."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Final

from ..errors import InputError
from ..files import Json, read_json
from ..tyre.case import LoadedCase, as_written, start_values, with_level
from ..tyre.case.identity import is_of_tyre, tyre_sha256
from ..tyre.state import pressure_name
from ..tyre.values import overridden, with_values
from .result import AnyResult

NOT_CONVERGED: Final = "not_converged"  # folder of a fit that may not take a better one's place


def read_fitted(path: Path, case: LoadedCase) -> tuple[dict[str, float], list[str]]:
    """Fitted values of the case's variables (in the units of the numbers they set) in fit.json,
    of numbers that the fit freed by path, and in which ways the fit was made otherwise, in
    sentences: on another mesh.

    The fit has to be of the same tyre, whatever its targets, state, mesh or solver. Raises
    InputError in one sentence; OSError.
    """
    try:
        fit = read_json(path)
        fitted_values = {name: v["value"] for name, v in fit["variables"].items()} | fit["fixed"]
        freed: Json = {}
        for name, each in fit.get("freed", {}).items():
            freed |= each["numbers"]
            del fitted_values[name]
        pressure = float(fit["pressure_kPa"])
        of = fit.get("provenance", {})
        tyre, theirs = of.get("tyre_sha256"), dict(of.get("overrides", {}))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(f"'{path}' is not the fit.json that 'tyrecal fit' writes") from None
    names = set(start_values(case))
    for name in [*sorted(names - set(fitted_values)), *sorted(set(fitted_values) - names)]:
        where = "is missing from" if name in names else "of this case is not known, but is in"
        raise InputError(
            f"variable '{name}' {where} '{path}'; give a fit of this case, which has"
            f" {', '.join(sorted(names))}"
        )
    if tyre is None:
        raise InputError(
            f"'{path}' does not state its tyre, because an older tyrecal wrote it; run"
            f" 'tyrecal fit {case.path}' again"
        )
    if tyre != tyre_sha256(case):
        raise InputError(f"'{path}' is a fit of another tyre: {_difference(theirs, case)}")
    for name, value in {**fitted_values, **freed}.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise InputError(f"variable '{name}' is {value!r} in '{path}', must be a finite number")
    values = {name: float(fitted_values[name]) for name in start_values(case)}
    values |= {path: float(value) for path, value in freed.items()}
    design = dict(values)
    if pressure_name(case) == "pressure_kPa":
        design["pressure_kPa"] = pressure  # else its variable stands among the others
    try:
        with_values(case, design)
    except InputError as error:
        raise InputError(f"'{path}' has a design that this case cannot have: {error}") from None
    return values, _made_otherwise(of, case)


def as_fitted(path: Path, case: LoadedCase) -> LoadedCase:
    """The case as the fit in fit.json left it: on the fit's mesh, with what its command set, and
    with the fitted values as the starts of its variables. ``case``: as its file has it. Raises as
    `read_fitted` does."""
    try:
        of = dict(read_json(path).get("provenance", {}))
        settings, mesh = dict(of.get("overrides", {})), of.get("mesh")
    except (ValueError, TypeError, AttributeError):
        raise InputError(f"'{path}' is not the fit.json that 'tyrecal fit' writes") from None
    case = as_set(case, settings, mesh)
    return overridden(case, read_fitted(path, case)[0])


def as_set(case: LoadedCase, settings: Json, mesh: str | None) -> LoadedCase:
    """The case on a mesh level with what a command set, except for variables. Raises as
    `overridden` does."""
    if mesh is not None:
        case = with_level(case, mesh)
    starts = start_values(case)
    return overridden(case, {name: x for name, x in settings.items() if name not in starts})


def read_result(
    path: Path, case: LoadedCase, kind: type[AnyResult]
) -> tuple[LoadedCase, AnyResult]:
    """A study's result of a case, and the case as the study evaluated it: with the command's
    settings, on its mesh. ``case``: as its file has it. Raises InputError for another tyre, or a
    file that is none; OSError."""
    try:
        result = kind.model_validate(read_json(path))
        of = result.provenance
    except ValueError:
        of = None
    if of is None:
        raise InputError(f"'{path}' is not the {kind.stem}.json that 'tyrecal {kind.study}' writes")
    loaded = as_set(case, of.overrides, of.mesh)
    if of.tyre_sha256 != tyre_sha256(loaded):
        raise InputError(
            f"'{path}' is of another tyre than '{case.path}': run 'tyrecal {kind.study}' again"
        )
    return loaded, result


def _difference(theirs: Json, case: LoadedCase) -> str:
    """Difference between the tyre of the fit and that of the case, as far as it is known."""
    ours = case.overrides
    differences = []
    for name in sorted({*theirs, *ours}):
        if not is_of_tyre(name) or theirs.get(name) == ours.get(name):
            continue
        sets = [
            f"{maker} with --set {name}={as_written(given[name])}"
            if name in given
            else f"{maker} without --set {name}"
            for maker, given in (("the fit was made", theirs), ("this command runs", ours))
        ]
        differences.append(", ".join(sets))
    return "; ".join(differences) or (
        f"'{case.path}', or a file that it names, has been edited since the fit; run 'tyrecal fit'"
        " again"
    )


def _made_otherwise(of: Json, case: LoadedCase) -> list[str]:
    """Sentences on what differs between a provenance ``of`` a fit and the case."""
    mesh = case.case.mesh.level
    if of.get("mesh") == mesh:
        return []
    return [f"the fit was made on the mesh '{of.get('mesh')}', this study uses '{mesh}'"]


def is_good(fit: Json) -> bool:
    """Whether a fit, the content of fit.json, converged, and its variables left their starts."""
    return bool(fit["converged"] and fit["moved"])


def has_good(path: Path) -> bool:
    """Whether the file is a fit.json that `is_good`; a link in a folder of results is not followed
    (`files`)."""
    try:
        return is_good(read_json(path, follow=False))
    except (OSError, ValueError, KeyError, TypeError):
        return False
