"""The studies of a batch: what each writes for a case, and the numbers that are compared.

Result files are those of the command of the same name. Where a batch fits, the pressure sweep and
the footprint study the fitted design beside the initial one, as with their --fitted.

The numbers are named ``KIND`` or ``KIND WHERE``: ``mass_kg``, ``fitted_Hz [2,1]``,
``area_m2 fitted 4000 N``; units are in the kind's name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..case import LoadedCase
from ..deck.tyre_design import TyreDesign
from ..evaluate.evaluator import Evaluator, Question
from ..evaluate.pressed import Pressed
from ..files import json_text
from ..fit.calibrate import calibrate, history_csv
from ..provenance import provenance, stamped
from ..report.table import fit_csv, footprint_csv, sweep_csv
from ..studies.fitted import NOT_CONVERGED
from ..studies.footprint import footprint_result, press
from ..studies.modes import modes_result
from ..studies.pressure import Failure, sweep
from ..studies.pressure_result import sweep_result

Numbers = dict[str, float]


@dataclass(frozen=True)
class Asked:
    """Of each study, beside the case. loads_N: of the footprint, None for the case's own;
    pressures_kPa: of the sweep."""

    loads_N: tuple[float, ...] | None
    pressures_kPa: tuple[float, ...]


@dataclass
class Studied:
    """A case under study. designs: values of the variables by name of the design, ``fitted`` once
    a fit has it; no_fit: a fit was asked for and has no result."""

    case: LoadedCase
    evaluator: Evaluator
    designs: dict[str, dict[str, float]]
    asked: Asked
    no_fit: bool = False


@dataclass
class Outcome:
    """What came of a study (see `case`), its numbers, and its result files, name to text."""

    status: str = "good"
    cause: str | None = None
    words: str | None = None
    quantities: Numbers = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)


def fit(state: Studied) -> Outcome:
    """Calibrate from the case's own start. Raises what `calibrate` does."""
    state.no_fit = True
    found = calibrate(state.case, state.evaluator)
    result = found.result
    state.no_fit = False
    state.designs["fitted"] = {name: found.fitted.values[name] for name in state.designs["initial"]}
    numbers = {"objective": result["objective_Hz"], "mass_kg": result["mass_kg"]}
    numbers |= {f"variable {name}": each["value"] for name, each in result["variables"].items()}
    numbers |= {f"fitted_Hz {_label(mode)}": mode["fitted_Hz"] for mode in result["modes"]}
    for each in result.get("footprint", ()):
        numbers[f"fitted_{each['quantity']} {each['load_N']:g} N"] = each["fitted"]
    files = {
        "fit.json": _json(state, result, load_N=state.case.case.targets.loads_N or 0.0),
        "fit.csv": fit_csv(result),
        "fit_history.csv": history_csv(found.history),
    }
    if result["converged"] and result["moved"]:
        return Outcome(quantities=numbers, files=files)
    words = result["message"] if result["moved"] else "the fit did not move"
    return Outcome("failed", NOT_CONVERGED, f"not converged: {words}", numbers, files)


def modes(state: Studied) -> Outcome:
    """Evaluate the case's own design. Raises what `Evaluator.evaluate` does."""
    values = state.designs["initial"]
    result, _ = modes_result(state.case, values, state.evaluator.evaluate(Question(values)))
    numbers = {"mass_kg": result["mass_kg"]}
    numbers |= {f"frequency_Hz {_label(mode)}": mode["frequency_Hz"] for mode in result["modes"]}
    return Outcome(quantities=numbers, files={"modes.json": _json(state, result)})


def sweep_pressure(state: Studied) -> Outcome:
    """Every design over the pressure. Raises what `sweep` does."""
    outcomes = sweep(state.case, state.evaluator, state.designs, state.asked.pressures_kPa)
    failures = [each for each in outcomes if isinstance(each, Failure)]
    if len(failures) == len(outcomes):
        raise failures[0].failed
    result = sweep_result(state.case, state.designs, outcomes)
    numbers = {
        f"frequency_Hz {row['design']} {row['pressure_kPa']:g} kPa {_label(mode)}": (
            mode["frequency_Hz"]
        )
        for row in result["rows"]
        for mode in row["modes"]
    }
    files = {
        "pressure_sweep.json": _json(state, result, pressure_kPa=state.asked.pressures_kPa),
        "pressure_sweep.csv": sweep_csv(result["rows"]),
    }
    places = [f"{each['design']}, {each['pressure_kPa']:g} kPa" for each in result["failed"]]
    return _with_failed(result, places, numbers, files)


def footprint(state: Studied) -> Outcome:
    """Every design at rising loads. Raises what `press` does."""
    state.evaluator.needs_road()
    loads = state.asked.loads_N or state.case.case.loads_N
    outcomes = press(state.evaluator, state.designs, loads)
    pressed = {name: each for name, each in outcomes.items() if isinstance(each, Pressed)}
    for outcome in outcomes.values():
        if not pressed and not isinstance(outcome, Pressed):
            raise outcome
    meshes = {name: TyreDesign(state.case, state.designs[name]).tyre.mesh for name in pressed}
    result = footprint_result(state.designs, loads, outcomes, meshes)
    numbers = {
        f"{kind} {row['design']} {row['load_N']:g} N": value
        for row in result["rows"]
        for kind, value in row.items()
        if kind not in ("design", "load_N")
    }
    files = {
        "footprint.json": _json(state, result, load_N=loads),
        "footprint.csv": footprint_csv(result["rows"]),
    }
    places = [f"{each['design']}, {each['load_N']:g} N" for each in result["failed"]]
    return _with_failed(result, places, numbers, files)


STUDIES: dict[str, Callable[[Studied], Outcome]] = {  # in the order in which they are done
    "fit": fit,
    "modes": modes,
    "sweep-pressure": sweep_pressure,
    "footprint": footprint,
}
OF_FITTED = ("sweep-pressure", "footprint")  # they want the fitted design where there is a fit


def study(name: str, state: Studied) -> Outcome:
    """One study; skipped where it wants a fit that has no result. Raises what the study does."""
    if state.no_fit and name in OF_FITTED:
        return Outcome("skipped", None, "the fit before it has no result")
    return STUDIES[name](state)


def _with_failed(
    result: Mapping[str, Any], places: list[str], numbers: Numbers, files: dict[str, str]
) -> Outcome:
    """Good, or failed at the first of some places."""
    if not places:
        return Outcome(quantities=numbers, files=files)
    first = result["failed"][0]
    words = f"{places[0]}: {first['words']}"
    if len(places) > 1:
        words += f" (and {len(places) - 1} more)"
    return Outcome("failed", first["cause"], words, numbers, files)


def _label(mode: Mapping[str, Any]) -> str:
    words = [f"[{mode['c']},{mode['m']}]", mode["kind"] or ""]
    words.append(f"member {mode['member']}" if "member" in mode else "")
    return " ".join(word for word in words if word)


def _json(state: Studied, result: dict[str, Any], **of: Any) -> str:
    """A result file with its provenance, whose state is the case's but for ``of``."""
    return json_text(stamped(result, provenance(state.case, state.evaluator.solver, **of)))
