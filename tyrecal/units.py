"""Units: those that numbers come in, as factors to the tool's keys and columns, and those that
engineers say; files and formulas have SI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import pi

from .errors import InputError

INCH, POUND, POUND_FORCE = 0.0254, 0.45359237, 4.4482216152605  # m, kg, N
LENGTH = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inch": INCH, "in": INCH}
QUANTITIES: dict[str, dict[str, float]] = {
    "frequency_Hz": {
        "Hz": 1.0,
        "1/s": 1.0,
        "cps": 1.0,
        "kHz": 1e3,
        "rad/s": 0.5 / pi,
        "1/min": 1 / 60,
        "rpm": 1 / 60,
    },
    "contact_area_m2": {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6, "in2": INCH**2, "sq.in": INCH**2},
    "contact_length_m": LENGTH,
    "contact_width_m": LENGTH,
    "vertical_stiffness_N_per_m": {
        "N/m": 1.0,
        "N_per_m": 1.0,
        "N/mm": 1e3,
        "kN/m": 1e3,
        "kN/mm": 1e6,
        "lbf/in": POUND_FORCE / INCH,
        "lb/in": POUND_FORCE / INCH,
        "kgf/mm": 9806.65,
    },
    "mass_kg": {"kg": 1.0, "g": 1e-3, "lb": POUND, "lbs": POUND},
}
PRESSURE = {
    "kPa": 1.0,
    "bar": 100.0,
    "mbar": 0.1,
    "MPa": 1e3,
    "Pa": 1e-3,
    "psi": 6.894757293168,
    "atm": 101.325,
    "kgf/cm2": 98.0665,
}
LOAD = {
    "N": 1.0,
    "kN": 1e3,
    "daN": 10.0,
    "kgf": 9.80665,
    "kg": 9.80665,
    "lbf": POUND_FORCE,
    "lb": POUND_FORCE,
    "lbs": POUND_FORCE,
}
DAMPING_UNITS = {"%": 0.01, "1": 1.0, "-": 1.0}  # to fractions of critical
UNITS_BY_DIMENSION: dict[
    str, Mapping[str, float]
] = {  # units that a number on a command line may have
    "pressure": PRESSURE,
    "mass": QUANTITIES["mass_kg"],  # before loads, of which a kg may be one, too
    "load": LOAD,
    "length": LENGTH,
    "area": QUANTITIES["contact_area_m2"],
    "angle": {"degrees": 1.0, "deg": 1.0, "°": 1.0, "rad": 180 / pi},
    "frequency": QUANTITIES["frequency_Hz"],
    "stiffness": QUANTITIES["vertical_stiffness_N_per_m"],
    "density": {"kg/m3": 1.0, "g/cm3": 1e3, "t/m3": 1e3},
    "temperature difference": {"K": 1.0},
    "share": {"percent": 1.0, "%": 1.0},
}
UNIT_EXAMPLES = {  # of a number with another unit, by dimension
    "pressure": "2.4bar",
    "load": "4kN",
    "length": "17in",
    "area": "0.26mm2",
    "angle": "5deg",
    "frequency": "0.1kHz",
    "mass": "12g",
}
NUMBER_WITH_UNIT = re.compile(
    r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([^\d\s.,][^\s,]*)?", re.I
)
SAID = {  # SI unit: what people say, and how many of it one is
    "m": ("mm", 1e3),
    "m2": ("mm²", 1e6),
    "Pa": ("MPa", 1e-6),
    "m/N": ("mm/kN", 1e6),
    "N/m": ("N/mm", 1e-3),
    "rad/(N m)": ("mrad/(kN m)", 1e6),
}


def plain(unit: str) -> str:
    """A unit as it is compared: 'N/mm', 'cm^2', 'cm²' become 'n/mm', 'cm2'."""
    text = unit.lower().replace("²", "2").replace("^", "").replace(" ", "")
    return text.removesuffix("(g)").removesuffix("gauge")


def factor(table: Mapping[str, float], unit: str) -> float | None:
    """The factor of a `plain` unit, None where ``table`` does not have it."""
    return next((each for name, each in table.items() if plain(name) == unit), None)


def read_number(text: str, unit: str) -> float:
    """A number in ``unit``, which may be written with another unit of its dimension. Raises
    InputError.

    >>> read_number("2.4bar", "kPa"), read_number("240", "kPa"), read_number("17in", "mm")
    (240.0, 240.0, 431.8)
    """
    match = NUMBER_WITH_UNIT.fullmatch(text.strip())
    if not match:
        raise InputError(f"must be {number_words(unit)}")
    number, own = float(match[1]), match[2]
    if not own:
        return number
    units = next((each for each in UNITS_BY_DIMENSION.values() if unit in each), {})
    per_own = factor(units, plain(own))
    if per_own is None:
        what = next(
            (name for name, each in UNITS_BY_DIMENSION.items() if factor(each, plain(own))), ""
        )
        is_other = f"{own} is a unit of {what}" if what else f"there is no unit '{own}'"
        raise InputError(f"{is_other}: must be {number_words(unit)}")
    return float(f"{number * per_own / units[unit]:.12g}")


def number_words(unit: str, what: str = "a number") -> str:
    """Words for a number in ``unit``: 'a number in kPa, or as 2.4bar'."""
    name = next((name for name, each in UNITS_BY_DIMENSION.items() if unit in each), "")
    example = f", or as {UNIT_EXAMPLES[name]}" if name in UNIT_EXAMPLES else ""
    return what + (f" in {printed_unit(unit)}{example}" if unit else " without a unit")


def display_unit(unit: str) -> tuple[str, float]:
    """The unit that engineers use for one of the catalogue or the case, and the factor to it."""
    return SAID.get(unit, (unit, 1.0))


def printed_unit(unit: str) -> str:
    """A unit as people read it: 'kg/m3' becomes 'kg/m³'; keys of files keep their digits."""
    return re.sub(r"(?<=[a-z])[23]\b", lambda digit: {"2": "²", "3": "³"}[digit[0]], unit)


def in_engineers_units(value: float, unit: str, digits: int = 6) -> str:
    """``in_engineers_units(-0.00934, "m", 3)`` is '-9.34 mm'; 110 with two digits is '110'."""
    name, factor = display_unit(unit)
    rounded = float(f"{value * factor:.{digits}g}")
    return f"{rounded:.12g} {name}".rstrip()


def printed_value(value: float, unit: str) -> str:
    """A value of the case as a page prints it: ``printed_value(2.595e-7, "m2")`` is
    '0.2595 mm²'."""
    return printed_unit(in_engineers_units(value, unit, 4))


def signed(value: float, digits: int) -> str:
    """A number with its sign and so many decimals, in which what rounds to 0 is '+0'."""
    return f"{round(value, digits) + 0.0:+.{digits}f}"
