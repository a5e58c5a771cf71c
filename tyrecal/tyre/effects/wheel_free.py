"""The wheel is not fixed: it is suspended in soft cords and moves with its mass."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Nothing holds the rim; its mass is 1 / ``value``, kg, its radii of gyration are the case's.

    At value -> 0 the wheel is so heavy that it does not move.
    """
    rim = case.case.rim
    if value < 0:
        raise InputError("must be at least 0")
    if rim.moves:
        raise InputError("must be 0 where the rim moves already: a free wheel has no spindle")
    scale = 1 / (value * rim.mass_kg)
    return changed(
        case,
        rim=with_part(
            rim,
            free=True,
            mass_kg=rim.mass_kg * scale,
            polar_inertia_kg_m2=rim.polar_inertia_kg_m2 * scale,
            diametral_inertia_kg_m2=rim.diametral_inertia_kg_m2 * scale,
        ),
    )


EFFECT = Effect(
    id="wheel_free",
    place=210,
    title="Free wheel",
    symbol="1/m",
    unit="1/kg",
    # a wheel of 10 kg or more
    low=0.0,
    high=0.1,
    changes=("*BOUNDARY", "*MASS", "*ROTARY INERTIA"),
    signature=(
        "[0,0] lateral +37 %, [0,0] torsional +114 %, [1,1] +105 %, [1,0] +33 % with a wheel of "
        "10 kg, at any pressure alike; modes of c >= 2 do not change"
    ),
    toggle="bolt the hub to a heavy block, or suspend the wheel in soft cords: the other support",
    aliases=("bead_filler",),
    add=add,
    add_to_deck=add,
    needs="spindle",  # solvers that can move the rim
    # error of its shifts, relative: the wheel is a rigid mass; cords add at most 1 to 2 Hz
    response_error=0.04,
)
