"""The gauge has an error: the tyre's true pressure is the stated one plus an offset."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .edit import changed
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """p = p_stated + value."""
    true = case.case.pressure_kPa + value
    if not true >= 0:
        raise InputError(f"must leave a pressure of at least 0, this leaves {true:g} kPa")
    return changed(case, pressure_kPa=true)


EFFECT = Effect(
    id="pressure_offset",
    place=130,
    title="Pressure gauge error",
    symbol="dp",
    unit="kPa",
    # workshop gauges are within 10 kPa; 1 kPa a degree between inflation and test
    low=-10.0,
    high=10.0,
    pressure_power=1,  # of the range: a gauge is off by the same share of any pressure
    changes=("*DSLOAD",),
    signature=(
        "all up alike: +1.4 to +1.7 % at +10 kPa and 240 kPa, +2.3 % at 160 kPa, +1.1 % "
        "at 320 kPa; A_belt hides it at one pressure, all but 0.2 %"
    ),
    toggle="check the gauge against a calibrated one, or measure again with another gauge",
    aliases=("tread_density", "sidewall_gauge"),
    add=add,
    add_to_deck=add,
    # error of its shifts, relative: the same pressure everywhere; a gauge may be off by a share,
    # too
    response_error=0.04,
)
