"""What holds the wheel gives way about any diameter: the rim moves with its own mass."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import on_spindle
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Compliance ``value`` more; the wheel's mass and inertia are the case's (`rim`)."""
    return on_spindle(case, "tilt_rad_per_N_m", value)


EFFECT = Effect(
    id="spindle_tilt",
    title="Tilt compliance of the spindle",
    symbol="c_d",
    unit="rad/(N m)",
    low=0.0,
    high=4e-06,
    changes=("*SPRING", "*MASS", "*ROTARY INERTIA", "*BOUNDARY"),
    signature=(
        "[1,1] down, -9 % at 4e-6 rad/(N m) and 240 kPa, the more the higher the pressure; "
        "[1,0] hardly, no other mode; a re-fit hides a quarter"
    ),
    toggle="press on the flange sideways and read two dial gauges; or use a stiffer clamp",
    aliases=(),
    add=add,
    needs="spindle",
)
