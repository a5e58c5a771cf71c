"""Standard errors of a fit that hold for the tyre, not for its measurement alone.

    cov x = B Q Sigma Q B^T + left of what was known before,  Q = diag(q)   (`Problem.response`)
    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T                   (inference/covariance)

q: fitted values, with a prior measured ones; Sigma: covariance of ln q, as `diagnose` and `sample`
have it. If chi^2 by Sigma exceeds its degrees of freedom (`verdict`), cov x is multiplied by their
ratio; not with a prior, where cov x is the posterior, as in `sample`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ...files import Json
from .model_errors import ModelErrors, model_errors
from .prediction import FitResponse
from .prior import PriorProblem
from .problem import Point, Problem
from .targets import Target, ValueTarget
from .uncertainty import FitUncertainty, standard_errors

Array = np.ndarray
BY_MEASUREMENT, BY_MODEL, BY_SECTION = "measurement", "material laws and mesh", "section"
BY_START = "what was known of the variables before"
MAX_LINEAR_ERROR = 0.2  # sd of a coordinate: beyond, or next to a bound, no linear error holds
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
    ) -> dict[str, Json]:
        """Entries of fit.json about the total by variable; standard errors in each one's unit."""
        has_prior = problem.spread is not None
        spread = self.of_coordinates * (1.0 if has_prior else max(1.0, chi2_per_dof or 0.0))
        errors = standard_errors(problem, point, spread, self.is_determined)
        explained, at_bound = None, ~problem.is_free(point.x)
        holds = (np.diag(spread) <= MAX_LINEAR_ERROR**2) & ~at_bound.any()
        if problem.spread is not None:
            explained, holds = 1 - np.diag(spread) / problem.spread**2, ~at_bound
        return {
            v.name: {
                "standard_error_total": errors[i],
                "total_holds": bool(holds[i]),
                **({"explained_by_data": float(explained[i])} if explained is not None else {}),
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

    scatter: that of the measurement alone. One more design is evaluated in every state, unless a
    prior took its weights there. Raises what `model_errors` does; ValueError with the reason if the
    standard deviation of a target is unknown.
    """
    counts = problem.scale > 0
    sigma = scatter.sigma[counts]
    if not np.isfinite(sigma).all():
        raise ValueError("the standard deviation of the measured values is not known")
    known = problem.model if isinstance(problem, PriorProblem) else None
    errors = known or model_errors(problem, point)
    point = point.plain
    measured = problem.counted
    wanted = np.array([t.value for t in measured])
    fitted = wanted + point.residuals[counts] / problem.scale[counts]
    relative, at = sigma / wanted, fitted
    if problem.spread is not None:  # with weights in the variances, cov x is the posterior's
        relative, at = relative / np.sqrt([t.weight for t in measured]), wanted
    whole = errors.covariance(relative)
    response, is_determined = problem.response(point)
    response = response * at  # d x / d ln q
    unseen = problem.left_of_prior(point)
    parts = _parts(response, relative, errors, np.diag(unseen))
    spread = response @ whole @ response.T + unseen
    responses = [
        _response(problem, each, float(own), column)
        for each, own, column in zip(measured, relative, response.T, strict=True)
    ]
    return TotalError(whole, spread, parts, is_determined, responses)


def _response(
    problem: Problem, target: Target | ValueTarget, scatter: float, column: Array
) -> FitResponse:
    """column (v,): of the fitted coordinates by ln of the target."""
    names = (v.name for v in problem.variables)
    response = dict(zip(names, column.tolist(), strict=True))
    if not isinstance(target, Target):
        return FitResponse(scatter=scatter, response=response, load_N=target.state.load_N)
    state = target.state.with_defaults(problem.case)
    return FitResponse(
        **asdict(target.label),
        pressure_kPa=state.pressure_kPa or 0.0,
        rim=state.rim,
        scatter=scatter,
        response=response,
    )


def _parts(response: Array, scatter: Array, errors: ModelErrors, unseen: Array) -> dict[str, Array]:
    """Shares (v,) of the variance by cause: the section is one, each constant its own; unseen
    (v,): the variance that the data leave of what was known before."""
    moved = (response @ errors.by_constants) ** 2
    parts = {
        BY_MEASUREMENT: response**2 @ scatter**2,
        BY_MODEL: np.einsum("vi,ij,vj->v", response, errors.form, response),
        BY_START: unseen,
    }
    for k, source in enumerate(errors.known):
        cause = BY_SECTION if source.field else source.name.replace("_", " ")
        parts[cause] = parts.get(cause, 0.0) + moved[:, k]
    whole = np.sum([*parts.values()], 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = {cause: part / whole for cause, part in parts.items()}
    return dict(sorted(shares.items(), key=lambda item: -float(np.nanmean(item[1]))))
