"""Measurements that are not even near the model are refused: wrong units, or another tyre.

A measured frequency that is far off the model's is a slip of digit, unit, label or pressure. `fit`,
`diagnose` and `sample` look for both before they calibrate anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

from ...errors import InputError
from ...simulate.modes.label import in_words
from .inverse_problem import Toggle
from .model import Answer, Query
from .observations import Observations
from .tyre_model import TyreModel

MAX_FREQUENCY_RATIO = 2.0  # between measured and computed; beyond, something else was measured
SLIPS = (10.0, 0.1)  # factors of a decimal point in the wrong place
SLIP_FITS = 1.3  # ratio to the model at which such a slip explains the value


def far_off(what: str, measured_Hz: float, model_Hz: float) -> str:
    """Why ``what`` cannot have been measured at such a frequency, and what was probably meant;
    empty where it can."""
    ratio = measured_Hz / model_Hz
    if 1 / MAX_FREQUENCY_RATIO < ratio < MAX_FREQUENCY_RATIO:
        return ""
    meant = [f"{measured_Hz * f:.6g} Hz" for f in SLIPS if 1 / SLIP_FITS < ratio * f < SLIP_FITS]
    hint = f", or did you mean {meant[0]}" if meant else ""
    return (
        f"{what} was measured at {measured_Hz:.6g} Hz, {ratio:.2g} times the model's"
        f" {model_Hz:.4g} Hz; is it the right unit, mode and pressure{hint}?"
    )


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
