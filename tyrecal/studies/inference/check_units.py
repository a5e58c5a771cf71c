"""Measurements that are not even near the model are refused: wrong units, or another tyre."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

from ...errors import InputError
from ...simulate.modes.label import in_words
from ..far_off import far_off
from .inverse_problem import Toggle
from .model import Answer, Query
from .observations import Observations
from .tyre_model import TyreModel

# measured mass over the model's, from which it is refused: with its rim a tyre weighs twice as much
MAX_MASS_RATIO = 1.5


def check_units(
    model: TyreModel,
    observations: Observations,
    runs: Sequence[str],
    changes: Sequence[Toggle] = (),
) -> None:
    """Raise InputError if a measured value is not even near the model at its start (`far_off`), or
    if the model has no answer with an effect that a toggled run switched; what the model answered
    where it has none without.

    runs: names of the files, by number of the run; changes: the effect switched in each.
    """
    set_to = [c for c in changes if not c.times and c.value != c.base]
    points = [Query(model.start, {c.id: c.value - c.base}) for c in set_to]
    answer, *others = model.answers([Query(model.start, constants=True), *points])
    if not isinstance(answer, Answer):
        raise answer
    for change, other in zip(set_to, others, strict=True):
        if isinstance(other, Exception):
            raise InputError(f"'{change.id}={change.value:g}' cannot be evaluated: {other}")
    at = dict(zip(model.rows, answer.eta.tolist(), strict=True))
    values = zip(observations.rows, observations.y, strict=True)
    for row, y in sorted(values, key=lambda each: each[0].label is None):  # frequencies first
        ratio = exp(y - at[row.row])
        if row.label and (words := far_off(in_words(str(row)), exp(y), exp(at[row.row]))):
            raise InputError(f"{runs[row.run]}: {words}")
        if not row.label and not 1 / MAX_MASS_RATIO < ratio < MAX_MASS_RATIO:
            raise InputError(
                f"{runs[row.run]}: the mass is {ratio:.2g} times the model's; is it in kg, and of"
                " the tyre without its rim?"
            )
