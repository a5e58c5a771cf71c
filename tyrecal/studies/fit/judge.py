"""A finished fit judged: its verdict, chi2 per degree of freedom, and the likeliest reason."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...measured.measurement import Measurement
from ...simulate.modes.label import Label
from .alternatives import other_states
from .problem import Point, Problem
from .targets import Target, ValueTarget
from .uncertainty import FitUncertainty
from .verdict import DOES_NOT_FIT, FitReason, FitVerdict, Remainder, fit_verdict, likeliest_reason

Array = np.ndarray


@dataclass(frozen=True)
class Judgement:
    """See `verdict`; chi2_per_dof: None if nothing states a scatter, the covariance of the model is
    not known, or there are no more values than variables; reason: None if nothing looks odd."""

    verdict: FitVerdict
    chi2_per_dof: float | None
    reason: FitReason | None


def judge(
    problem: Problem,
    point: Point,
    known: FitUncertainty,
    covariance: Array | None,
    is_good: bool,
    readings: Sequence[Measurement] = (),
) -> Judgement:
    """The fit that ended at ``point``, a `Point.plain`.

    covariance: of ln of all values that count (`TotalError`), None if that is not known; is_good:
    it converged and moved; readings: lines of the file that its targets are from. Other states are
    evaluated if the model does not fit.
    """
    rows, keep, is_stated = measured_rows(problem, readings), problem.scale > 0, False
    stated = np.array([bool(t.sigma) for t in problem.measured])
    counted = keep
    if (keep & stated).any():
        keep, is_stated = keep & stated, covariance is not None
    if not (np.isfinite(known.sigma[keep]) & (known.sigma[keep] > 0)).all():
        return Judgement(fit_verdict(is_good, None), None, None)
    values = np.array([row.value for row in rows])[keep]
    model = values + point.residuals[keep] / problem.scale[keep]
    slopes = (
        point.jacobian[keep][:, problem.is_free(point.x)]
        / problem.scale[keep][:, None]
        / model[:, None]
    )
    if covariance is None:
        of_values = np.diag((known.sigma[keep] / values) ** 2)
    else:
        of_values = covariance[np.ix_(keep[counted], keep[counted])]
    deviation = np.log(values / model)
    if problem.spread is not None:  # what was known before is a measurement of each variable
        J = point.plain.jacobian[keep] / problem.scale[keep][:, None] / model[:, None]
        deviation = deviation + J @ (point.x - problem.start())
        of_values = of_values + (J * problem.spread**2) @ J.T
        slopes = slopes[:, :0]
    left = Remainder(
        [row for row, kept in zip(rows, keep, strict=True) if kept],
        deviation,
        of_values,
        slopes,
        is_stated,
    )
    verdict = fit_verdict(is_good, left.chi2_per_dof)
    shifts = []
    if verdict == DOES_NOT_FIT:
        try:
            shifts = other_states(problem, point, keep)
        except Exception:  # the fit has ended: what only comes after it must not lose it
            shifts = []
    return Judgement(verdict, left.chi2_per_dof, likeliest_reason(left, shifts))


def measured_rows(problem: Problem, readings: Sequence[Measurement] = ()) -> list[Measurement]:
    """The targets (n,) as they were measured, with their states, and file and line of the first
    reading of each; without readings the case file."""
    case, places = problem.case, dict[tuple[object, ...], str]()
    for each in readings:
        # without a load both members of a pair are one target
        key = (each.quantity, each.label, each.load_N and each.member, each.state.of(case))
        places.setdefault(key, each.place)
    rows = []
    for target in problem.measured:
        quantity = target.quantity
        label, member = _label(target)
        state = target.state.with_defaults(case)
        is_mass = quantity == "mass_kg"
        key = (quantity, label, state.load_N and member, target.state)
        rows.append(
            Measurement(
                quantity,
                label,
                member,
                0.0 if is_mass else state.pressure_kPa or 0.0,
                state.load_N,
                target.value,
                target.sigma or np.nan,
                place=places.get(key, str(case.path)),
                rim=None if is_mass else state.rim,
            )
        )
    return rows


def _label(target: Target | ValueTarget) -> tuple[Label | None, str]:
    """The label of a frequency, and its symmetry under load."""
    if isinstance(target, Target):
        return target.label, ""
    return (target.member.label, target.member.symmetry) if target.member else (None, "")
