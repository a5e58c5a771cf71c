"""Contents of the columns of a table, derived from their headings and the units in them.

A table has a column for each quantity, or the name of a row's quantity in the column ``quantity``
and its number in ``value``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .. import units
from ..errors import InputError

HEADINGS = {  # headings of each meaning, as `_heading` returns their names
    "frequency_Hz": "frequency freq f fn eigenfrequency natural_frequency resonance_frequency"
    " frequenz eigenfrequenz frequence frequence_propre",
    "contact_area_m2": "contact_area area footprint_area kontaktflache aufstandsflache",
    "contact_length_m": "contact_length patch_length footprint_length kontaktlange aufstandslange"
    " latschlange longueur_de_contact",
    "contact_width_m": "contact_width patch_width footprint_width kontaktbreite aufstandsbreite"
    " latschbreite largeur_de_contact",
    "vertical_stiffness_N_per_m": "vertical_stiffness radial_stiffness stiffness kz"
    " vertikalsteifigkeit federrate",
    "mass_kg": "mass tyre_mass tire_mass weight masse gewicht",
    "damping_ratio": "damping damping_ratio modal_damping modal_damping_ratio zeta \u03b6 xi \u03be"
    " dampfung modale_dampfung dampfungsgrad dampfungsmass amortissement smorzamento",
    "loss_factor": "loss_factor eta \u03b7 verlustfaktor",
    "label": "label mode mode_shape mode_name modus modo moda shape form eigenform modenform"
    " bezeichnung",
    "c": "c n circumferential circumferential_order circumferential_harmonic waves harmonic"
    " wave_number umfangsordnung",
    "m": "m meridional meridional_order lateral_order querordnung",
    "kind": "kind type art",
    "member": "member half doublet",
    "pressure": "pressure inflation inflation_pressure p druck innendruck fulldruck reifendruck"
    " luftdruck pression",
    "load": "load vertical_load wheel_load fz last radlast charge",
    "sigma": "sigma std stdev stddev sd std_dev standard_deviation uncertainty unsicherheit"
    " standardabweichung scatter streuung \u03c3",
    "rim": "rim wheel support felge rad",
    "run": "run repeat repetition test messung wiederholung",
    "quantity": "quantity",
    "value": "value",
}
MEANING = {name: meaning for meaning, names in HEADINGS.items() for name in names.split()}
BRACKETED = re.compile(r"^(.*?)\s*(?:[\[(](.*?)[\])]\s*)?$")  # name [unit]
ENDING = re.compile(  # name and unit without brackets, as "load / kN" or "frequency_Hz"
    r"^(.+?)(?:\s*/\s*|\s+in\s+|[\s_]|(?=%))(%|hz|kpa|bar|psi|n|m2|n[\s_]per[\s_]m|kg|kn|lbf|kgf|dan|percent)$"
)
LENGTH_ENDING = re.compile(r"^(.+)[\s_](m|mm|cm|in|inch)$")  # 'mode m' ends in no unit
DAMPING_RATIO_OF = {"damping_ratio": 1.0, "loss_factor": 0.5}  # damping ratio per unit of each
# headings whose numbers are fractions where they state no unit
FRACTIONS = {"damping_ratio", "modal_damping_ratio", *HEADINGS["loss_factor"].split()}
TABLES = {"pressure": units.PRESSURE, "load": units.LOAD, **units.QUANTITIES}
TABLES |= dict.fromkeys(DAMPING_RATIO_OF, units.DAMPING_UNITS)
NUMBER_MEANINGS = {*TABLES, "sigma", "value"}  # of columns whose numbers may have a decimal mark
LENGTHS = {name for name, table in units.QUANTITIES.items() if table is units.LENGTH}


@dataclass(frozen=True)
class TableColumn:
    """The column of a table that holds one meaning, a key of `HEADINGS`."""

    index: int  # from 0
    # from the unit in the heading to that of the meaning's name; pressure: kPa, load: N
    factor: float = 1.0
    percent: bool = False  # whether a sigma is in % of the value
    # quantities that the unit of a sigma fits, as frequency_Hz for 'sigma [Hz]'; () without a unit
    # and for %
    of: tuple[str, ...] = ()


def meaning_of(heading: str) -> str | None:
    """Meaning of a column by its heading; None for remarks and the like."""
    return MEANING.get(_heading(heading)[0])


def unit_of(heading: str) -> str:
    """The unit in a heading, as it is compared; empty where there is none."""
    return _heading(heading)[1]


def is_unit(text: str) -> bool:
    """Whether a text is one of the units that tables have, or no dimension: '-' and '1'."""
    known = {units.plain(name) for table in TABLES.values() for name in table}
    return units.plain(text) in known | {"%", "-", "1"}


def read_columns(
    headings: Sequence[str], place: str, pressure_kPa: float | None
) -> dict[str, TableColumn]:
    """Columns by meaning, of those that have one; ``pressure_kPa``: where none gives it.

    Raises InputError at ``place``.
    """
    columns: dict[str, TableColumn] = {}
    for index, heading in enumerate(headings):
        name, unit = _heading(heading)
        meaning = MEANING.get(name)
        if meaning is None:
            _refuse_state(heading, unit, place)
            continue  # remarks and the like
        if meaning in columns:
            raise InputError(f"{place}: two columns are the {meaning}; rename one")
        try:
            columns[meaning] = _column(index, heading, meaning, unit)
        except InputError as error:
            raise InputError(f"{place}: '{heading}'{error}") from None
    held = columns.keys()
    if not held & units.QUANTITIES.keys() and not {"quantity", "value"} <= held:
        raise InputError(
            f"{place}: no column holds a frequency; headings must be like"
            " 'c; m; pressure [bar]; frequency [Hz]'"
        )
    if "pressure" not in held and pressure_kPa is None and held & {"frequency_Hz", "quantity"}:
        raise InputError(f"{place}: no column holds the pressure; give --pressure-kPa")
    return columns


def _refuse_state(heading: str, unit: str, place: str) -> None:
    """Raises InputError for a heading that is not known but has the unit of a load or a pressure:
    what was measured at a load must not be read as unloaded."""
    for meaning, table in (("load", units.LOAD), ("pressure", units.PRESSURE)):
        if unit and units.factor(table, unit):
            raise InputError(
                f"{place}: '{heading}' has a unit of {meaning}, but its name is not known: call the"
                f" column '{meaning} [{next(iter(table))}]', or take it away if it is none"
            )


def _column(index: int, heading: str, meaning: str, unit: str) -> TableColumn:
    """Raises InputError with what is wrong with the unit."""
    if table := TABLES.get(meaning):
        if not unit and meaning != "frequency_Hz" and _heading(heading)[0] not in FRACTIONS:
            raise InputError(f" has no unit; write it as '{heading} [{next(iter(table))}]'")
        factor = units.factor(table, unit) if unit else 1.0  # frequencies without a unit: Hz
        if factor is None:
            raise InputError(f": the unit must be one of {', '.join(table)}")
        return TableColumn(index, factor)
    if meaning == "sigma" and unit and unit != "%":
        factors = {
            quantity: factor
            for quantity, table in units.QUANTITIES.items()
            if (factor := units.factor(table, unit))
        }
        if not factors:
            raise InputError(": unknown unit")
        # quantities that have one unit in common have all the same units and factors
        return TableColumn(index, next(iter(factors.values())), of=tuple(factors))
    if meaning == "value" and unit:
        raise InputError(": values are in the unit of their quantity, as Hz of frequency_Hz")
    return TableColumn(index, percent=unit == "%")


def _heading(text: str) -> tuple[str, str]:
    """Name and unit of a heading: 'Frequency [Hz]' and 'frequency_Hz' -> 'frequency', 'hz'."""
    match = BRACKETED.match(text.strip())
    name, unit = (match[1], match[2] or "") if match else (text, "")
    name = name.lower().translate(str.maketrans("éèêüäö", "eeeuao")).strip(" .:")
    if not unit and (match := ENDING.match(name)):
        name, unit = match[1], re.sub(r"\s", "_", match[2])
    elif not unit and (match := LENGTH_ENDING.match(name)) and _is_length(match[1]):
        name, unit = match[1], match[2]
    unit = "%" if unit == "percent" else unit
    return _words(name), units.plain(unit)


def _is_length(name: str) -> bool:
    return MEANING.get(_words(name)) in {*LENGTHS, "sigma"}


def _words(name: str) -> str:
    """Words of a heading, joined by underscores."""
    return re.sub(r"[\s\-_.]+", "_", name).strip("_")
