"""The gauge reads wrong: the tyre's true pressure is the stated one plus an offset."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import changed
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """p = p_stated + value."""
    true = case.case.pressure_kPa + value
    if not true >= 0:
        raise ValueError(f"must leave a pressure of at least 0, this leaves {true:g} kPa")
    return changed(case, pressure_kPa=true)


EFFECT = Effect(
    id="pressure_offset",
    title="Pressure gauge error",
    symbol="dp",
    unit="kPa",
    low=-10.0,
    high=10.0,
    changes=("*DSLOAD",),
    signature="",
    toggle="check the gauge against a calibrated one, or measure again with another gauge",
    aliases=("tread_density",),
    add=add,
)
