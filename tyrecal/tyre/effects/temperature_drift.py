"""The tyre warms or cools from one pressure of the run to the next."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from . import temperature
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """A temperature of value (p - p0) / 100 kPa, p0 being the pressure in the case file."""
    nominal = case.file_data["pressure_kPa"]
    kelvin = value * (case.case.pressure_kPa - nominal) / 100
    # `Effect.of`: the change of a section, or that of a user's deck
    try:
        return temperature.EFFECT.of(case)(case, kelvin)
    except InputError as error:
        raise InputError(f"gives {kelvin:g} K at this pressure, which {error}") from None


EFFECT = Effect(
    id="temperature_drift",
    place=150,
    title="Temperature drift over the run of pressures",
    symbol="dT'",
    unit="K per 100 kPa",
    # a few degrees of warming in a run from 160 to 320 kPa, and in a truck's from 480 to 960
    low=-5.0,
    high=5.0,
    pressure_power=-1,  # of the range: the same change of temperature over 2/3 to 4/3 of any p
    changes=("*HYPERELASTIC",),
    signature=(
        "no change at the case's pressure, below it all up, above it all down by the "
        "pattern of the temperature: [0,0] torsional -0.3 % at 320 kPa for 5 K per 100 "
        "kPa; the growth with pressure is a little too low"
    ),
    toggle="measure the first pressure once more at the end of the run",
    aliases=("carcass_fanning",),
    add=add,
    add_to_deck=add,
    # error of its shifts, relative: the tread is warmer than the sidewall, and warming levels off
    response_error=0.08,
)
