"""Rubber grows stiffer with frequency: low modes are softer than one modulus says, high stiffer."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import with_part, with_rubbers
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Each mode's shear modulus times (f / f_ref)^value, f its own frequency.

    f_ref is each rubber's ``reference_frequency_Hz`` (60 Hz): a tilt over the modes, no level.
    """
    return with_rubbers(
        case, lambda m: with_part(m, frequency_exponent=m.frequency_exponent + value)
    )


EFFECT = Effect(
    id="frequency_stiffening",
    title="Stiffening of rubber with frequency",
    symbol="beta",
    unit="",
    low=0.0,
    high=0.2,
    changes=("*VISCOELASTIC, FREQUENCY=TABULAR",),
    signature="SIG",
    toggle="a dynamic test of the compound from 20 to 150 Hz at small strain",
    aliases=("sidewall_gauge", "dynamic_stiffening"),
    add=add,
    needs="frequency_modulus",
)
