"""Compliance of the spindle that holds the wheel: the rim moves with its mass."""

from __future__ import annotations

from typing import Any

from ..case import LoadedCase
from .edit import changed, on_spindle, with_part
from .effect import Effect

# of wheel and hub, times what is stated, one standard deviation by judgement: how much of a hub
# goes along is seldom weighed; it is near the axle
HUB_MASS, HUB_INERTIA = 1.2, 1.1


def heavier(case: LoadedCase) -> LoadedCase:
    """The case with one standard deviation more of the hub moving with the wheel."""
    rim = case.case.rim
    more = with_part(
        rim,
        mass_kg=HUB_MASS * rim.mass_kg,
        polar_inertia_kg_m2=HUB_INERTIA * rim.polar_inertia_kg_m2,
        diametral_inertia_kg_m2=HUB_INERTIA * rim.diametral_inertia_kg_m2,
    )
    return changed(case, rim=more)


def _spindle(key: str, along: str, **entry: Any) -> Effect:
    """The effect of the compliance ``key`` of `rim.spindle`; along: its direction in words; entry:
    the other fields of `Effect`."""
    direction = key.partition("_")[0]

    def add(case: LoadedCase, value: float) -> LoadedCase:
        return on_spindle(case, key, value)

    add.__doc__ = (
        f"Compliance ``value`` more {along}; the wheel's mass and inertia are the case's (`rim`)."
    )
    return Effect(
        title=f"{direction.capitalize()} compliance of the spindle",
        low=0.0,
        pressure_power=-1,  # of the range: the same share of the tyre's compliance at any pressure
        changes=("*SPRING", "*MASS", "*ROTARY INERTIA", "*BOUNDARY"),
        add=add,
        add_to_deck=add,
        needs="spindle",
        response_error=0.04,  # springs in series; `heavier` has the uncertain mass
        shape_uncertainty=lambda case, value: heavier(add(case, value)),
        **entry,
    )


EFFECTS = (
    _spindle(
        "lateral_m_per_N",
        "along the axle",
        id="spindle_lateral",
        place=170,
        symbol="c_y",
        unit="m/N",
        high=4e-07,
        signature="[0,0] lateral down, -10 % at 4e-7 m/N and 240 kPa, more at higher pressure; no"
        " other mode; a re-fit hides a quarter",
        toggle="press on the hub along the axle and read a dial gauge; or use a stiffer clamp",
        aliases=(),
    ),
    _spindle(
        "radial_m_per_N",
        "along any radius",
        id="spindle_radial",
        place=180,
        symbol="c_r",
        unit="m/N",
        high=1e-07,
        signature="[1,0] down, -7 % at 1e-7 m/N and 240 kPa, more at higher pressure;"
        " [1,1] hardly, no other mode; a re-fit hides two fifths",
        toggle="press on the hub radially and read a dial gauge; or use a stiffer clamp",
        aliases=("cavity_air",),
    ),
    _spindle(
        "torsional_rad_per_N_m",
        "about the axle",
        id="spindle_torsional",
        place=190,
        symbol="c_t",
        unit="rad/(N m)",
        high=2e-06,
        signature="[0,0] torsional down, -6 % at 2e-6 rad/(N m) and 240 kPa, more at higher"
        " pressure; no other mode; a re-fit hides a quarter",
        toggle="turn the locked hub with a torque wrench and read a dial gauge;"
        " or lock it elsewhere",
        aliases=("belt_width", "cap_ply", "temperature", "frequency_stiffening"),
    ),
    _spindle(
        "tilt_rad_per_N_m",
        "about any diameter",
        id="spindle_tilt",
        place=200,
        symbol="c_d",
        unit="rad/(N m)",
        high=4e-06,
        signature="[1,1] down, -9 % at 4e-6 rad/(N m) and 240 kPa, more at higher pressure; [1,0]"
        " hardly, no other mode; a re-fit hides a quarter",
        toggle="press on the flange sideways and read two dial gauges; or use a stiffer clamp",
        aliases=(),
    ),
)
