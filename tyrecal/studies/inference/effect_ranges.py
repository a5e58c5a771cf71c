"""Effects that a solver can express on a case, with their ranges."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from ...tyre.case.mistakes import suggestion
from ...tyre.effects import Effect, catalogue
from ...tyre.number_units import EFFECT_PATH
from .model import EffectRange
from .uncertainties import sources


def effect_ranges(
    case: LoadedCase, evaluator: Evaluator, ids: Sequence[str] | None = None
) -> tuple[dict[str, EffectRange], dict[str, str]]:
    """Effects that the evaluator's solver can express, and why it cannot the others, or a case of a
    user's deck cannot have them. Raises InputError where one of ``ids`` is no effect; InputError
    for decks in three dimensions.
    """
    case.kind.require_section(
        "a diagnosis needs a section, and this tyre is given by decks in three dimensions"
    )
    able: dict[str, EffectRange] = {}
    unable: dict[str, str] = {}
    stated = {path: abs(step) for each in sources(case)[0] for path, step in each.steps.items()}
    for id in ids or ():
        if id not in catalogue():
            raise InputError(f"'{id}' is not one of the effects{suggestion(id, catalogue())}")
    for id, effect in catalogue().items():
        if ids is not None and id not in ids:
            continue
        if not effect.within(evaluator.solver.capabilities):
            unable[id] = "this solver cannot express it"
        elif why := _lacking(case, effect):
            unable[id] = why
        else:
            base, words = case.case.effects.get(id, 0.0), (effect.unit, effect.title, effect.toggle)
            low, high = effect.range_on(case)
            able[id] = EffectRange(
                low - base,
                high - base,
                *words,
                base,
                response_error=effect.response_error,
                prior_sd=stated.get(EFFECT_PATH + id, 0.0),
                has_shape_uncertainty=case.kind.shape_uncertainty(effect) is not None,
            )
    return able, unable


def _lacking(case: LoadedCase, effect: Effect) -> str:
    """Reason why a case of a user's deck cannot have an effect, "" = none."""
    try:
        case.kind.check_effect(effect, case)
    except ValueError as error:  # an effect from outside may raise one
        return str(error)
    return ""
