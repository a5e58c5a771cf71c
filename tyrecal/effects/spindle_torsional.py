"""What holds the wheel gives way about the axle: the rim moves with its own mass."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import on_spindle
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Compliance ``value`` more; the wheel's mass and inertia are the case's (`rim`)."""
    return on_spindle(case, "torsional_rad_per_N_m", value)


EFFECT = Effect(
    id="spindle_torsional",
    title="Torsional compliance of the spindle",
    symbol="c_t",
    unit="rad/(N m)",
    low=0.0,
    high=2e-06,
    changes=("*SPRING", "*MASS", "*ROTARY INERTIA", "*BOUNDARY"),
    signature=(
        "[0,0] torsional down, -6 % at 2e-6 rad/(N m) and 240 kPa, the more the higher the "
        "pressure; no other mode; a re-fit hides a quarter"
    ),
    toggle="turn the locked hub with a torque wrench and read a dial gauge; or lock it elsewhere",
    aliases=("belt_width", "cap_ply", "temperature", "frequency_stiffening"),
    add=add,
    needs="spindle",
)
