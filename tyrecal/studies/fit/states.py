"""Contribution of each state of a fit to the variables, and the state that would add most next.

Standard errors are those of the linearised fit (see `uncertainty`): without a state its rows of the
Jacobian are left out; with another one rows are added, of the same modes as the best measured
state has, with the same relative standard deviations, at the fitted design.

A residual of the fit is ``scale`` (model - target), ``scale`` being 1 / Hz or 1 / unit of the
target, 0 if the target does not count (`targets`). ``sigma`` are the targets' standard deviations.
The Jacobian has the derivatives of the residuals by the coordinates of the variables. ``point`` is
a `Point.plain`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...files import Json
from ...measured.measurement import DAMPING_RATIO
from ...simulate.modes.find import LabelledModes
from ...simulate.modes.label import Label
from ...tyre.state import RIMS, TyreState
from ...tyre.usual import USUAL
from .least_squares import fit_covariance
from .problem import Point, Problem
from .targets import Target, ValueTarget
from .uncertainty import FitUncertainty, standard_errors

Array = np.ndarray
STEP_OUT = 1.25  # factor on the highest measured pressure, and divisor of the lowest, to propose
ROUNDED_kPa = 10.0  # pressures that are proposed are multiples of it
# standard error by variable, in its own unit; None: the data do not determine it
Errors = dict[str, float | None]


@dataclass(frozen=True)
class StateReport:
    """A measured state, and the part of the fit that depends on it."""

    state: TyreState
    values: int  # number of its targets that count
    rms_sigmas: float | None  # rms deviation, in standard deviations; None: no sigma is stated
    standard_errors_without: Errors  # of a fit without the state


@dataclass(frozen=True)
class NextState:
    """A state that was not measured, and the gain of the fit by it."""

    state: TyreState
    standard_errors_with: Errors  # of a fit with the state
    ratio: float  # geometric mean over the variables: error with the state over error without


def state_reports(problem: Problem, point: Point, known: FitUncertainty) -> list[StateReport]:
    """Report on every measured state, in the order of the targets."""
    own = [None if t in (*problem.mass, *problem.known) else t.state for t in problem.measured]
    counts = problem.scale > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        off = point.residuals / problem.scale / known.sigma
    reports = []
    for state in dict.fromkeys(each for each in own if each):
        here = np.array([each == state for each in own])
        rest = counts & ~here
        errors = _named(
            problem,
            standard_errors(problem, point, *problem.covariance_by(point, known.sigma, rest)),
        )
        mean = float(np.mean(off[counts & here] ** 2)) if (counts & here).any() else np.nan
        rms = float(np.sqrt(mean)) if np.isfinite(mean) else None
        reports.append(StateReport(state, int((counts & here).sum()), rms, errors))
    return reports


def next_states(problem: Problem, point: Point, known: FitUncertainty) -> list[NextState]:
    """States of the unloaded tyre that were not measured, the smallest ratio first; none if the
    solver gives no exact sensitivities, prior knowledge enters the fit, or the data do not
    determine the variables as they are."""
    before = _named(problem, known.standard_errors)
    unknown = problem.difference_step is not None or problem.spread is not None
    if unknown or not all(before.values()):
        return []
    like = _best_measured(problem, known)
    states = _others(problem) if like else []
    names = tuple(v.name for v in problem.variables)
    questions = [problem.question(point.values, state, names) for state in states]
    answers = problem.modes_of(questions, [[t.label for t, _ in like]] * len(states))
    counts = problem.scale > 0
    J, root, sigma = point.jacobian[counts], problem.scale[counts], known.sigma[counts]
    proposals = []
    for state, answer in zip(states, answers, strict=True):
        if not isinstance(answer, LabelledModes):
            continue
        hertz = np.array([answer.wanted[t.label].frequency_Hz for t, _ in like])
        scattered = hertz * [relative for _, relative in like]  # sigma, Hz
        weight = np.sqrt([t.multiplicity for t, _ in like]) / scattered
        rows = weight[:, None] * problem.slopes(
            {state: answer}, [Target(t.label, 0.0, state=state) for t, _ in like], point.values
        )
        after = _errors(
            problem,
            point,
            np.vstack([J, rows]),
            np.concatenate([root, weight]),
            np.concatenate([sigma, scattered]),
        )
        both = [(before[v.name], after[v.name]) for v in problem.variables]
        gained = [np.log(with_it / without) for without, with_it in both if without and with_it]
        proposals.append(NextState(state, after, float(np.exp(np.mean(gained)))))
    return sorted(proposals, key=lambda each: each.ratio)


def _best_measured(problem: Problem, known: FitUncertainty) -> list[tuple[Target, float]]:
    """Targets, with relative sigmas, of the unloaded state that has most of them. If only loaded
    states were measured, of one of these, each mode once."""
    rows: dict[TyreState, dict[Label, tuple[Target, float]]] = {}
    for each, sigma in zip(problem.measured, known.sigma, strict=True):
        if isinstance(each, ValueTarget):
            if not each.member or each.quantity == DAMPING_RATIO:
                continue
            each = Target(each.member.label, each.value, state=each.state)
        if np.isfinite(sigma):
            own = rows.setdefault(each.state, {})
            own.setdefault(each.label, (each, float(sigma) / each.frequency_Hz))
    unloaded = [own for state, own in rows.items() if not state.load_N]
    return [*max(unloaded or rows.values(), key=len, default={}).values()]


def _others(problem: Problem) -> list[TyreState]:
    """Unloaded states in addition to those measured: their pressures, and one below and above, on
    every rim that the case can have."""
    measured_states = [
        state.with_defaults(problem.case) for state, labels in problem.labels.items() if labels
    ]
    measured = [
        t.state.with_defaults(problem.case)
        for t in problem.measured
        if t not in (*problem.mass, *problem.known)
    ]
    pressures = sorted(p for p in {state.pressure_kPa for state in measured} if p)
    ends = (pressures[0] / STEP_OUT, pressures[-1] * STEP_OUT)
    pressures += [ROUNDED_kPa * round(p / ROUNDED_kPa) for p in ends]
    wanted = [
        TyreState(p, 0.0, rim)
        for rim in RIMS
        for p in pressures
        if USUAL["pressure_kPa"].holds(p) and TyreState(p, 0.0, rim) not in measured_states
    ]
    return [state.of(problem.case) for state in wanted if is_possible(problem, state)]


def is_possible(problem: Problem, state: TyreState) -> bool:
    """Whether the case can be in a state, and the solver express it."""
    try:
        own = state.numbers(problem.case)
        design = problem.evaluator.design.at(own)
    except InputError:
        return False
    return problem.evaluator.solver.capabilities >= design.needs.keys()


def _errors(problem: Problem, point: Point, J: Array, root: Array, sigma: Array) -> Errors:
    """Standard errors by the Jacobian J (n, v), the scales ``root`` (n,) and sigma (n,) of its
    rows."""
    covariance, seen = fit_covariance(J, root, sigma)
    return _named(problem, standard_errors(problem, point, covariance, seen))


def _named(problem: Problem, errors: Sequence[float | None]) -> Errors:
    """Errors in the order of the problem's variables, by name."""
    return {v.name: error for v, error in zip(problem.variables, errors, strict=True)}


def plain(problem: Problem, state: TyreState) -> Json:
    """A state for result files: pressure, load and rim are stated, none is left to the case."""
    complete = state.with_defaults(problem.case)
    return {"pressure_kPa": complete.pressure_kPa, "load_N": complete.load_N, "rim": complete.rim}
