"""What holds the wheel gives way along the axle: the rim moves with its own mass."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import on_spindle
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Compliance ``value`` more; the wheel's mass and inertia are the case's (`rim`)."""
    return on_spindle(case, "lateral_m_per_N", value)


EFFECT = Effect(
    id="spindle_lateral",
    title="Lateral compliance of the spindle",
    symbol="c_y",
    unit="m/N",
    low=0.0,
    high=4e-07,
    changes=("*SPRING", "*MASS", "*ROTARY INERTIA", "*BOUNDARY"),
    signature=(
        "[0,0] lateral down, -10 % at 4e-7 m/N and 240 kPa, the more the higher the pressure; "
        "no other mode; a re-fit hides a quarter"
    ),
    toggle="press on the hub along the axle and read a dial gauge; or use a stiffer clamp",
    aliases=(),
    add=add,
    needs="spindle",
)
