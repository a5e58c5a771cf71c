"""Units of a case's numbers, which their keys name."""

from __future__ import annotations

import re

from .effects import catalogue

EFFECT_PATH = "effects."
UNIT_BY_ENDING = {  # by a key's end, the longer first
    "kg_per_m3": "kg/m3",
    "kg_m2": "kg m2",
    "m_per_N": "m/N",
    "Pa_per_m": "Pa/m",
    "N_per_m": "N/m",
    "rad_per_N_m": "rad/(N m)",
    "rad_per_s": "rad/s",
    "kPa": "kPa",
    "N": "N",
    "Pa": "Pa",
    "deg": "degrees",
    "m": "m",
    "m2": "m2",
    "kg": "kg",
    "Hz": "Hz",
    "C": "C",
}


def unit_of(path: str) -> str:
    """The unit of the number at a dotted path, "" where it has none; a number in a list has that of
    the list's key."""
    path = re.sub(r"(\.\d+)+$", "", path)
    if path.startswith(EFFECT_PATH):
        effect = catalogue().get(path.removeprefix(EFFECT_PATH))
        return effect.unit if effect else ""
    if path.endswith(" / angle"):  # of a user's deck
        return "degrees"
    return next((unit for end, unit in UNIT_BY_ENDING.items() if path.endswith(f"_{end}")), "")
