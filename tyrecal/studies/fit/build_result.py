"""The result of a fit from its starts, the best of them with its uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ...files import Json
from ...measured.measurement import Measurement
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.label import Label
from ...tyre.number_units import unit_of
from ...tyre.state import AS_THE_CASE
from ...tyre.values import with_values
from .judge import judge
from .problem import Point, Problem
from .result import DAMPING_COLUMNS, FitResult
from .result_parts import FittedFootprint, FittedMode, FittedVariable, FreedNumberFit
from .search import projected_gradient
from .states import next_states, plain, state_reports
from .targets import KNOWLEDGE, objective_unit
from .total_error import TotalError, total_error
from .uncertainty import FitUncertainty, uncertainty

MIN_STEP = 1e-6  # of a scaled variable, below which the fit did not move
NEAR_BEST_HZ = 0.05  # of the objective: the fit could have ended there


@dataclass
class StartReport:
    """One start of a fit: where it began and ended."""

    initial: dict[str, float]
    point: Point
    message: str  # the optimiser's own words
    converged: bool
    history: list[Json]  # one entry an evaluation


def fit_result(
    problem: Problem,
    initial: Point,
    reports: Sequence[StartReport],
    history: Sequence[Json],
    replaced: int,
    method: str,
    readings: Sequence[Measurement] = (),
) -> FitResult:
    """The result of a fit, that of its best start; ``replaced``: drawn starts that could not be
    evaluated; ``readings``: lines of the file that the targets are from."""
    best = min(reports, key=lambda report: report.point.objective)
    point = best.point.plain
    objectives = [row["objective_Hz"] for row in history]
    known = uncertainty(problem, point)
    names = [v.name for v in problem.variables]
    several = {t.state.unloaded for t in problem.measured} != {AS_THE_CASE}
    several = several or any(t.member for t in problem.road)
    others = _others(problem, initial, point, several)
    pressed = [each for each in others if each.quantity != "mass_kg"]
    mass = [each for each in others if each.quantity == "mass_kg"]
    moved = float(abs(point.x - initial.x).max()) > MIN_STEP
    total = _total_error(problem, point, known)
    correlations = known.correlations
    if problem.spread is not None and isinstance(total, TotalError):  # of the posterior
        sd = np.sqrt(np.diag(total.of_coordinates))
        correlations = total.of_coordinates / np.outer(sd, sd)
    good = best.converged and moved
    covariance = None if isinstance(total, str) else total.of_values
    judged = judge(problem, point, known, covariance, good, readings)
    sets = problem.case.case.variables
    fixed_units = {name: unit_of(sets[name].sets[0]) for name in problem.fixed if name in sets}
    content = {
        "format": 1,
        "method": method,
        **({} if problem.spread is None else {"prior": True}),
        "pressure_kPa": with_values(problem.case, point.values).case.pressure_kPa,
        "mass_kg": point.mass_kg,
        "objective_Hz": point.objective,
        "objective_unit": objective_unit(problem.case),
        "initial_objective_Hz": initial.plain.objective,
        "evaluations": len(history),
        "evaluations_to_0.05_Hz": next(
            i
            for i, f in enumerate(objectives, start=1)
            if f is not None and f < point.objective + NEAR_BEST_HZ
        ),
        "gradient_evaluations": sum(f is not None for f in objectives),
        "failed_evaluations": sum(f is None for f in objectives),
        "converged": best.converged,
        "moved": moved,
        "verdict": judged.verdict,
        "chi2_per_dof": judged.chi2_per_dof,
        "reason": judged.reason,
        "message": best.message,
        "projected_gradient_norm": projected_gradient(problem, best.point),
        "label_margin": point.clarity,
        "variables": _variables(problem, initial, point, known, total, judged.chi2_per_dof),
        "fixed": dict(problem.fixed),
        **({"fixed_units": fixed_units} if fixed_units else {}),
        **({"freed": _freed(problem, point)} if problem.freed else {}),
        "modes": _modes(problem, initial, point, several),
        **({"footprint": pressed} if pressed else {}),
        **({"mass": mass[0]} if mass else {}),
        **(_states(problem, point, known) if several else {}),
        "noise_Hz": known.noise_Hz,
        **(
            {"total_error_unknown": total}
            if isinstance(total, str)
            else {"responses": [] if problem.freed or problem.damping else total.responses}
        ),
        "correlations": {
            a: {b: _finite(correlations[i, j]) for j, b in enumerate(names)}
            for i, a in enumerate(names)
        },
        "singular_values": [float(s) for s in known.singular_values],
        "starts": [
            {
                "initial": r.initial,
                "objective_Hz": r.point.objective,  # what is minimised: with a prior, F of `prior`
                "converged": r.converged,
                "evaluations": len(r.history),
                "message": r.message,
                "values": dict(r.point.values),
            }
            for r in reports
        ],
        "replaced_starts": replaced,
    }
    return FitResult.model_validate(content)


def _total_error(problem: Problem, point: Point, known: FitUncertainty) -> TotalError | str:
    """The total uncertainty of the variables, or why it is not known."""
    try:
        return total_error(problem, point, known)
    except Exception as error:  # the fit has ended: what only comes after it must not lose it
        if isinstance(error, (ValueError, EvaluationFailed)):
            return str(error)
        return f"{type(error).__name__}: {error}"


def _variables(
    problem: Problem,
    initial: Point,
    point: Point,
    known: FitUncertainty,
    total: TotalError | str,
    chi2_per_dof: float | None,
) -> dict[str, FittedVariable]:
    variables = {}
    more = {} if isinstance(total, str) else total.by_variable(problem, point, chi2_per_dof)
    is_free = problem.is_free(point.x)
    for i, v in enumerate(problem.variables):
        variables[v.name] = FittedVariable(
            initial=initial.values[v.name],
            value=point.values[v.name],
            lower=problem.case.case.variables[v.name].lower,
            upper=problem.case.case.variables[v.name].upper,
            standard_error=known.standard_errors[i],
            **more.get(v.name, {}),
            at_bound=not is_free[i],
            unit=unit_of(problem.case.case.variables[v.name].sets[0]),
        )
    return variables


def _freed(problem: Problem, point: Point) -> dict[str, FreedNumberFit]:
    """The numbers that were freed."""
    return {
        name: FreedNumberFit(
            known=each.start,
            standard_deviation=each.sd,
            shift_in_sd=each.in_sd(point.values[name]),
            numbers=dict(zip(each.sets, each.numbers(point.values[name]), strict=True)),
        )
        for name, each in problem.freed.items()
    }


def _modes(problem: Problem, initial: Point, point: Point, several: bool) -> list[FittedMode]:
    """Modes of the unloaded tyre, then those on the road."""
    result = []
    for target in problem.targets:
        before, after = (p.states[target.state][target.label] for p in (initial, point))
        hertz = (before.frequency_Hz, after.frequency_Hz, target.frequency_Hz)
        of = _mode(target.label, after.multiplicity, hertz)
        own = plain(problem, target.state) | {"sigma_Hz": target.sigma_Hz}
        ratios = after.raw.damping_ratio, target.damping_ratio
        known = zip(DAMPING_COLUMNS, ratios, strict=True)
        of |= {key: ratio for key, ratio in known if ratio is not None}
        result.append(FittedMode.model_validate(of | (own if several else {})))
    for i, road in enumerate(problem.road):
        if road.member:
            hertz = (float(initial.others[i]), float(point.others[i]), road.value)
            own = plain(problem, road.state) | {"symmetry": road.member.symmetry}
            of = _mode(road.member.label, 1, hertz) | own | {"sigma_Hz": road.sigma}
            result.append(FittedMode.model_validate(of))
    return result


def _mode(label: Label, multiplicity: int, hertz: tuple[float, float, float]) -> Json:
    """Entry of a mode; hertz: initial, fitted, target."""
    initial, fitted, target = hertz
    return {
        **asdict(label),
        "frequency_Hz": fitted,
        "multiplicity": multiplicity,
        "initial_Hz": initial,
        "fitted_Hz": fitted,
        "target_Hz": target,
        "deviation_percent": 100 * (fitted / target - 1),
    }


def _others(problem: Problem, initial: Point, point: Point, several: bool) -> list[FittedFootprint]:
    """All but modes."""
    result = []
    for i, target in enumerate(problem.others):
        if target.member or target.quantity == KNOWLEDGE:
            continue
        fitted = float(point.others[i])
        of = {
            "load_N": target.state.load_N,
            "quantity": target.quantity,
            "initial": float(initial.others[i]),
            "fitted": fitted,
            "target": target.value,
            "sigma": target.sigma,
            "deviation_percent": 100 * (fitted / target.value - 1),
        }
        if target.quantity == "mass_kg":
            del of["load_N"]
        elif several:
            of |= plain(problem, target.state)
        result.append(FittedFootprint.model_validate(of))
    return result


def _states(problem: Problem, point: Point, known: FitUncertainty) -> Json:
    """Entries of what each state adds, and of the states that would add most next."""
    measured = [
        {
            **plain(problem, each.state),
            "values": each.values,
            "rms_sigmas": each.rms_sigmas,
            "standard_errors_without": each.standard_errors_without,
        }
        for each in state_reports(problem, point, known)
    ]
    try:
        proposals = next_states(problem, point, known)
    except Exception as error:  # the fit has ended: what only comes after it must not lose it
        return {"states": measured, "next_states_error": f"{type(error).__name__}: {error}"}
    more = [
        {
            **plain(problem, each.state),
            "standard_errors_with": each.standard_errors_with,
            "ratio": each.ratio,
        }
        for each in proposals
    ]
    return {"states": measured, "next_states": more}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
