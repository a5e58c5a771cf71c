"""Posteriors that a diagnosis reports beside its causes: of variables, constants and the section.

Design variables as a diagnosis calibrates them, without an effect and with the likeliest.

Constants, z being their shifts in standard deviations, with the prior N(0, 1); G (n,
k): changes of ln f by z = 1. Then E z = G^T S^-1 r, r the residual of the likeliest fit, which has
weighed the variables' prior. An effect that the case states as uncertain (``uncertainties``) is
such a constant up to `evidence.COVERAGE` of its standard deviations; only what is beyond is an
effect.

Errors of the section (`section_fields`), of a tyre without effects, z being components of the
fields in standard deviations, with the prior N(0, 1); G (n, k): changes of ln f by z = 1. Then E z
= G^T S^-1 r, cov z = I - G^T P G; r: residuals of the plain calibration, P: the part of a residual
that it does not absorb. (S^-1 r is P times the residuals at the centre of the prior.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...files import Json
from ...tyre.case import LoadedCase
from ...tyre.effects.parts import rim_edge, stations
from ..inference.compressed_cords import COMPRESSION
from ..inference.inverse_problem import InverseProblem
from ..inference.model import ModelRow
from ..inference.observations import Observable, Observations
from ..inference.section_fields import ALONG_CARCASS, FIELD_KINDS, SECTION, filler_tip, rubber_parts
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source
from .diagnosis import Diagnosis
from .evidence import NONE, Hypothesis
from .gap import projection
from .where import FieldValue

Array = np.ndarray
SLOPE_STEP = 1e-6  # of x, for the slope of a variable in its own unit


def calibrated_variables(diagnosis: Diagnosis, model: TyreModel) -> Json:
    """``without`` and ``with`` (None where there is no gap): {variable: value, standard_error, both
    in ``unit``}.

    Values at the effect's likeliest size; standard errors over all sizes that are left open.
    """
    key = diagnosis.leading
    return {
        "without": _calibrated(diagnosis, model, NONE),
        "with": _calibrated(diagnosis, model, key) if key else None,
    }


def _calibrated(diagnosis: Diagnosis, model: TyreModel, key: str) -> dict[str, Json]:
    """Value, standard error and unit of each variable under the hypothesis ``key``."""
    hypothesis = diagnosis.hypothesis(key)
    p, d = hypothesis.posterior, hypothesis.fitted.d  # (q,), (q, v)
    apart = d - p @ d
    # mean of the covariances, and covariance of the means, over the parameters
    covariance = np.tensordot(p, hypothesis.fitted.covariance, 1) + (p[:, None] * apart).T @ apart
    x = diagnosis.problem.expansion.x0 + d[hypothesis.best]
    values = model.designs.values(x)
    above, below = (model.designs.values(x + step) for step in (SLOPE_STEP, -SLOPE_STEP))
    scatter = np.sqrt(np.diag(covariance)).tolist()  # of x
    return {
        name: {
            "value": values[name],
            "standard_error": scatter[i] * (above[name] - below[name]) / (2 * SLOPE_STEP),
            "unit": model.designs.unit(name),
        }
        for i, name in enumerate(values)
    }


def likeliest(
    problem: InverseProblem, hypothesis: Hypothesis, rows: Sequence[ModelRow], places: Array
) -> Array:
    """ln values (m,) of the rows with the indices ``places``, at the likeliest sizes and variables
    of an explanation, with constants as they are stated."""
    best = int(np.argmax(hypothesis.posterior))
    eta, unknown = problem.expansion.eta[places], np.full(len(places), np.nan)
    unseen = tuple(Observable.of(rows[i]) for i in places)
    observations = Observations(
        unseen, eta, 0 * eta, common=0.0, split=unknown, split_scatter=unknown
    )
    effects = {id: e[[best]] for id, e in hypothesis.values.items()}
    d, zeta = hypothesis.fitted.d[[best]], float(hypothesis.fitted.zeta[best])
    there = replace(problem, observations=observations, places=places, zeta=0.0)
    uncoupled = there.predicted(effects, d)[0]  # decides which of two near modes is the upper one
    return replace(there.measured(uncoupled), zeta=zeta).predicted(effects, d)[0]


@dataclass(frozen=True)
class ConstantShift:
    """A constant by its likeliest shift."""

    name: str  # name of the uncertainty
    shift_in_sd: float  # likeliest shift in standard deviations


def constants_posterior(diagnosis: Diagnosis) -> list[ConstantShift]:
    """Every source of error but the section's fields, with what is named or leads in the model;
    the largest shift first."""
    hypothesis = diagnosis.hypothesis(diagnosis.leading or NONE)
    best = hypothesis.best
    problem = replace(diagnosis.problem, zeta=float(hypothesis.fitted.zeta[best]))
    d = hypothesis.fitted.d[best]
    effects = {id: e[[best]] for id, e in hypothesis.values.items()}  # (1,) each
    r = problem.observations.y - problem.predicted(effects, d[None])[0]
    _, inverse, _ = projection(problem, d)  # S^-1
    # zeta: coupling of near modes; `mixed` takes changes of uncoupled modes to coupled ones
    G = problem.mixed @ problem.constants if problem.zeta else problem.constants
    shifts = [
        ConstantShift(name, float(z))
        for name, z in zip(diagnosis.sources, G.T @ inverse @ r, strict=True)
        if not name.startswith((SECTION, COMPRESSION))
    ]
    return sorted(shifts, key=lambda each: -abs(each.shift_in_sd))


FIELD_UNITS = dict.fromkeys(("meridian", *ALONG_CARCASS), ("mm", 1e3))  # the others in per cent


def section_posterior(
    case: LoadedCase, sources: Sequence[Source], diagnosis: Diagnosis
) -> list[FieldValue]:
    """Errors of meridian and gauges in the middle of each region, of the filler's tip, of the rim's
    hold, and of the compounds by part."""
    problem = diagnosis.bare
    columns = [k for k, source in enumerate(sources) if source.field]
    P, inverse, _ = projection(problem, diagnosis.hypothesis(NONE).fitted.d[0])
    G = problem.constants[:, columns]
    if problem.zeta:
        G = problem.mixed @ G
    mean, covariance = G.T @ inverse @ diagnosis.gap.residuals, np.eye(len(columns)) - G.T @ P @ G
    middles = {name: sum(stations(case.section, name)) // 2 for name, _ in case.section.regions}
    compounds = {name: i for i, name in enumerate(rubber_parts(case).values())}
    known = [source.field for source in sources if source.field]
    places = {"meridian": middles, "gauge": middles, "hold": {"rim": rim_edge(case.section)}}
    if (tip := filler_tip(case)) is not None:
        places["filler"] = {"tip": tip}
    result = []
    for kind in FIELD_KINDS:
        own = [i for i, field in enumerate(known) if field.kind == kind]
        # (fields, stations), or of compounds (fields, parts): `SectionField.values`
        values = np.array([known[i].values for i in own])
        unit, scale = FIELD_UNITS.get(kind, ("%", 100.0))
        for place, i in places.get(kind, compounds).items() if own else ():
            v = scale * values[:, i]
            spread = float(np.sqrt(max(v @ covariance[np.ix_(own, own)] @ v, 0.0)))
            before = float(np.linalg.norm(v))
            if before:
                result.append(FieldValue(kind, place, float(v @ mean[own]), spread, before, unit))
    return result
