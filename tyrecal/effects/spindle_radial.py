"""What holds the wheel gives way along any radius: the rim moves with its own mass."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import on_spindle
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Compliance ``value`` more; the wheel's mass and inertia are the case's (`rim`)."""
    return on_spindle(case, "radial_m_per_N", value)


EFFECT = Effect(
    id="spindle_radial",
    title="Radial compliance of the spindle",
    symbol="c_r",
    unit="m/N",
    low=0.0,
    high=1e-07,
    changes=("*SPRING", "*MASS", "*ROTARY INERTIA", "*BOUNDARY"),
    signature=(
        "[1,0] down, -7 % at 1e-7 m/N and 240 kPa, the more the higher the pressure; [1,1] "
        "hardly, no other mode; a re-fit hides two fifths"
    ),
    toggle="press on the hub radially and read a dial gauge; or use a stiffer clamp",
    aliases=("cavity_air",),
    add=add,
    needs="spindle",
)
