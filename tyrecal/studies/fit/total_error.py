"""Standard errors of a fit that hold for the tyre, not for its measurement alone.

    cov x = B Q Sigma Q B^T,  B = (J^T J)^-1 J^T W^(1/2),  Q = diag(q)        (`uncertainty`)
    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T                    (diagnose/covariance)

q: fitted values; Sigma: covariance of ln q, as `diagnose` and `sample` have it. If chi^2 by Sigma
exceeds its degrees of freedom (`verdict`), cov x is multiplied by their ratio.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...tyre.case import LoadedCase
from ..inference.covariance import covariance, model_form
from ..inference.observations import Observable, Observations
from ..inference.uncertainties import Source, sources
from .problem import Point, Problem
from .responses import FitResponse, linear_answer
from .targets import Target, ValueTarget
from .uncertainty import FitUncertainty, fit_response, standard_errors

Array = np.ndarray
BY_MEASUREMENT, BY_MODEL, BY_SECTION = "measurement", "material laws and mesh", "section"
MIN_VARIANCE_SHARE = 0.01  # of the variance, below which a cause is not listed


@dataclass(frozen=True)
class TotalError:
    """Errors of a fit by all that is uncertain, and their causes."""

    of_values: Array  # (n, n) covariance of ln q of the targets that count
    of_coordinates: Array  # (v, v) covariance of the fitted coordinates, not scaled by chi^2
    shares: dict[str, Array]  # of their variances (v,) by cause, the largest first
    is_determined: Array  # (v,) whether the data determine a variable
    responses: list[FitResponse]  # how the fitted coordinates answer each target that counts

    def by_variable(
        self, problem: Problem, point: Point, chi2_per_dof: float | None
    ) -> dict[str, dict[str, Any]]:
        """Entries of fit.json about the total by variable; standard errors in each one's unit."""
        spread = self.of_coordinates * max(1.0, chi2_per_dof or 0.0)
        errors = standard_errors(problem, point, spread, self.is_determined)
        return {
            v.name: {
                "standard_error_total": errors[i],
                "variance_by_cause": {
                    cause: float(share[i])
                    for cause, share in self.shares.items()
                    if share[i] >= MIN_VARIANCE_SHARE
                },
            }
            for i, v in enumerate(problem.variables)
        }


def total_error(problem: Problem, point: Point, scatter: FitUncertainty) -> TotalError:
    """The whole uncertainty of the fitted variables at ``point``.

    scatter: that of the measurement alone. One more design is evaluated in every state. Raises
    DeckRefused if the solver has no exact sensitivities; EvaluationFailed; ValueError with the
    reason if targets are on the road or their standard deviation is unknown.
    """
    if problem.road:
        raise ValueError("it is not computed for targets on the road")
    counts = problem.scale > 0
    sigma, J = scatter.sigma[counts], point.jacobian[counts]
    if not np.isfinite(sigma).all():
        raise ValueError("the standard deviation of the measured values is not known")
    measured = [each for each, used in zip(problem.measured, counts, strict=True) if used]
    wanted = np.array([t.frequency_Hz if isinstance(t, Target) else t.value for t in measured])
    fitted = wanted + (point.residuals / problem.scale)[counts]
    rows = tuple(_row(problem.case, each) for each in measured)
    known, _ = sources(problem.case)
    _, by_constants, laws = linear_answer(
        problem.case, problem.evaluator, point.values, rows, known, problem.jobs
    )
    none = np.full(len(rows), np.nan)
    observed = Observations(rows, np.log(wanted), sigma / wanted, 0.0, none, none)
    whole = covariance(observed, by_constants, laws)
    response, is_determined = fit_response(J, problem.scale[counts])
    response = response * fitted  # d x / d ln q
    parts = _parts(response, sigma / wanted, model_form(rows, laws), by_constants, known)
    spread = response @ whole @ response.T
    responses = [
        _response(problem, each, float(relative), column)
        for each, relative, column in zip(measured, sigma / wanted, response.T, strict=True)
    ]
    return TotalError(whole, spread, parts, is_determined, responses)


def _response(
    problem: Problem, target: Target | ValueTarget, scatter: float, column: Array
) -> FitResponse:
    """column (v,): of the fitted coordinates by ln of the target."""
    names = (v.name for v in problem.variables)
    response = dict(zip(names, column.tolist(), strict=True))
    if not isinstance(target, Target):
        return FitResponse(scatter=scatter, response=response)
    state = target.state.with_defaults(problem.case)
    return FitResponse(
        **asdict(target.label),
        pressure_kPa=state.pressure_kPa or 0.0,
        rim=state.rim,
        scatter=scatter,
        response=response,
    )


def _row(case: LoadedCase, target: object) -> Observable:
    if not isinstance(target, Target):
        return Observable("mass_kg", None, 0.0)
    pressure = target.state.with_defaults(case).pressure_kPa or 0.0
    return Observable("frequency_Hz", target.label, pressure, rim=target.state.rim)


def _parts(
    response: Array, scatter: Array, form: Array, by_constants: Array, known: Sequence[Source]
) -> dict[str, Array]:
    """Shares (v,) of the variance by cause: the section is one, each constant its own."""
    moved = (response @ by_constants) ** 2
    parts = {
        BY_MEASUREMENT: response**2 @ scatter**2,
        BY_MODEL: np.einsum("vi,ij,vj->v", response, form, response),
    }
    for k, source in enumerate(known):
        cause = BY_SECTION if source.field else source.name.replace("_", " ")
        parts[cause] = parts.get(cause, 0.0) + moved[:, k]
    whole = np.sum([*parts.values()], 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = {cause: part / whole for cause, part in parts.items()}
    return dict(sorted(shares.items(), key=lambda item: -float(np.nanmean(item[1]))))
