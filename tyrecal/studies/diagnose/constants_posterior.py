"""Constants that nobody calibrates, as the data describe them: reported, and never named as a
cause.

z: shifts of the constants in their standard deviations, with the prior N(0, 1); G (n, k): changes
of ln f by z = 1. Then E z = G^T S^-1 r, r the residual of the likeliest fit, which has weighed the
variables' prior. An effect that the case states as uncertain (``uncertainties``) is such a constant
up to `evidence.COVERAGE` of its standard deviations; only what is beyond is an effect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..inference.section_fields import SECTION
from .evidence import NONE
from .gap import projection

if TYPE_CHECKING:
    from .diagnosis import Diagnosis


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
