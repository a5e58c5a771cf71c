"""Posteriors of what no fit calibrates, reported and never named as a cause: constants of the case,
and errors of its section.

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

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..inference.section_fields import SECTION
from .evidence import NONE
from .gap import projection

if TYPE_CHECKING:
    from .diagnosis import Diagnosis
from collections.abc import Sequence

import numpy as np

from ...tyre.case import LoadedCase
from ...tyre.effects.parts import rim_edge, stations
from ..inference.section_fields import ALONG_CARCASS, FIELD_KINDS, filler_tip, rubber_parts
from ..inference.uncertainties import Source
from .diagnosis import Diagnosis
from .where import FieldValue

Array = np.ndarray


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
        if not name.startswith(SECTION)
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
