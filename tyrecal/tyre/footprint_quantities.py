"""The quantities of a tyre on the road that are measured and fitted to, each named once.

The case file, tables of measurements, the fit and the diagnosis read this table. Each name here is
a key of `units.QUANTITIES`, and a field of `case.schema.TargetFootprint`, as is its ``sigma``.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FootprintQuantity:
    """A quantity of the tyre at a load: area of the patch without grooves in the tread, its largest
    extent along or across the rolling direction, or tangent stiffness."""

    sigma: str  # key of its standard deviation in a case, in the same unit
    words: str  # its name in tables
    unit: str  # the one that tables show
    per_SI: float  # how many of that unit are one in SI
    row: str  # its key in a row of footprint.json
    slope: str  # its key in the solver's sensitivities


FOOTPRINT_QUANTITIES = {
    "contact_area_m2": FootprintQuantity(
        "sigma_m2", "contact area", "cm²", 1e4, "area_m2", "contact_area_m2"
    ),
    "contact_length_m": FootprintQuantity(
        "sigma_m", "contact length", "mm", 1e3, "length_m", "contact_length_m"
    ),
    "contact_width_m": FootprintQuantity(
        "sigma_m", "contact width", "mm", 1e3, "width_m", "contact_width_m"
    ),
    "vertical_stiffness_N_per_m": FootprintQuantity(
        "sigma_N_per_m",
        "vertical stiffness",
        "N/mm",
        1e-3,
        "vertical_stiffness_N_per_m",
        "stiffness_N_per_m",
    ),
}
