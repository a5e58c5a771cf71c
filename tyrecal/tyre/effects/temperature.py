"""The rubber is warmer or colder than at the calibration of its modulus: softer or stiffer."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .deck_numbers import stiffer, with_compounds
from .edit import with_part, with_rubbers
from .effect import Effect

PER_KELVIN = -0.0075  # of the shear modulus; filled tread rubbers at 20 to 60 C: -0.005 to -0.01


def add(case: LoadedCase, value: float) -> LoadedCase:
    """C10 and C01 times 1 - 0.0075 value; the bulk modulus 2 / D1 is unchanged."""
    factor = _factor(value)
    return with_rubbers(
        case, lambda m: with_part(m, C10_Pa=factor * m.C10_Pa, C01_Pa=factor * m.C01_Pa)
    )


def _factor(value: float) -> float:
    factor = 1 + PER_KELVIN * value
    if not factor > 0:
        raise InputError(f"must be less than {-1 / PER_KELVIN:g} K")
    return factor


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: the shear constants of all compounds."""
    return with_compounds(case, "", "HYPERELASTIC", stiffer(_factor(value), bulk=False))


EFFECT = Effect(
    id="temperature",
    place=140,
    title="Rubber temperature",
    symbol="dT",
    unit="K",
    # of the room and of the tyre's own heat
    low=-15.0,
    high=15.0,
    changes=("*HYPERELASTIC",),
    signature=(
        "all down, [0,0] torsional most: -1.5 % at +15 K, [2,1] and [3,1] -1 %, [0,0] "
        "lateral least; as with C10"
    ),
    toggle="measure again with the tyre soaked at another temperature, at the same pressure "
    "(sealed, 15 K warmer, it gains 17 kPa at 240 kPa: +2.5 %)",
    aliases=("dynamic_stiffening", "sidewall_gauge"),
    add=add,
    add_to_deck=add_to_deck,
    # error of its shifts, relative: the tread is warmer than the sidewall, or colder
    response_error=0.08,
)
