"""Units that measured data come in, as factors to the units of the measurements CSV."""

from __future__ import annotations

from math import pi

INCH, POUND, POUND_FORCE = 0.0254, 0.45359237, 4.4482216152605  # m, kg, N
QUANTITIES: dict[str, dict[str, float]] = {
    "frequency_Hz": {"hz": 1.0, "1/s": 1.0, "cps": 1.0, "khz": 1e3, "rad/s": 0.5 / pi,
                     "1/min": 1 / 60, "rpm": 1 / 60},
    "contact_area_m2": {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6, "in2": INCH**2, "sq.in": INCH**2},
    "vertical_stiffness_N_per_m": {"n/m": 1.0, "n_per_m": 1.0, "n/mm": 1e3, "kn/m": 1e3,
                                   "kn/mm": 1e6, "lbf/in": POUND_FORCE / INCH,
                                   "lb/in": POUND_FORCE / INCH, "kgf/mm": 9806.65},
    "mass_kg": {"kg": 1.0, "g": 1e-3, "lb": POUND, "lbs": POUND},
}  # fmt: skip
PRESSURE = {"kpa": 1.0, "bar": 100.0, "mbar": 0.1, "mpa": 1e3, "pa": 1e-3, "psi": 6.894757293168,
            "atm": 101.325, "kgf/cm2": 98.0665}  # fmt: skip
LOAD = {"n": 1.0, "kn": 1e3, "dan": 10.0, "kgf": 9.80665, "kg": 9.80665, "lbf": POUND_FORCE,
        "lb": POUND_FORCE, "lbs": POUND_FORCE}  # fmt: skip


def plain(unit: str) -> str:
    """A unit as the tables above spell it: 'N/mm', 'cm^2', 'cm²' become 'n/mm', 'cm2'."""
    text = unit.lower().replace("²", "2").replace("^", "").replace(" ", "")
    return text.removesuffix("(g)").removesuffix("gauge")
