"""Tyre property files (.tir, TeimOrbit): the keys of MF-Swift that a tyre's structure determines.

    [SECTION]
    KEY = value      $ comment (or !)
    {pen fz}         a table

The files of programs differ: keys come in any order and case, some twice, some with a word in place
of a number, vendors add sections of their own units. A key counts in its own section, in the units
of [UNITS]. Of the tables [DEFLECTION_LOAD_CURVE] is read, which replaces VERTICAL_STIFFNESS.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan, pi
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import read_bytes
from ..simulate.modes.label import Label
from ..tyre.usual import USUAL_MEASUREMENTS
from ..units import INCH, POUND, POUND_FORCE
from .measurement import DAMPING_RATIO, PRESSURE_USUAL, SHARES_OF_NOMINAL, Measurement
from .mf_swift import FREQUENCIES, MFSwift

TIR_UNITS = {  # by the keys of [UNITS]: a word, and the SI unit's number of it
    "LENGTH": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "inch": INCH, "foot": 12 * INCH},
    "FORCE": {"n": 1.0, "kn": 1e3, "pound_force": POUND_FORCE},
    "ANGLE": {"rad": 1.0, "deg": pi / 180},
    "MASS": {"kg": 1.0, "g": 1e-3, "pound": POUND, "pound_mass": POUND},
    "TIME": {"s": 1.0, "ms": 1e-3},
    "PRESSURE": {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "bar": 1e5, "psi": 6894.757293168},
}
UNIT_SYNONYMS = {
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre"), "mm"),
    **dict.fromkeys(("centimeter", "centimeters"), "cm"),
    **dict.fromkeys(("kilometer", "kilometers"), "km"),
    **dict.fromkeys(("in", "inches"), "inch"),
    **dict.fromkeys(("ft", "feet"), "foot"),
    **dict.fromkeys(("newton", "newtons"), "n"),
    **dict.fromkeys(("kilonewton", "knewton"), "kn"),
    **dict.fromkeys(("lbf", "pound force"), "pound_force"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("degree", "degrees"), "deg"),
    **dict.fromkeys(("kilogram", "kilograms"), "kg"),
    **dict.fromkeys(("gram", "grams"), "g"),
    **dict.fromkeys(("second", "seconds", "sec"), "s"),
    **dict.fromkeys(("millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("pascal", "pascals"), "pa"),
}
KEYS_OF_SECTIONS = {  # structural keys and their dimensions: exponents of the keys of [UNITS]
    "MODEL": "FITTYP; LONGVL LENGTH/TIME",
    "DIMENSION": "UNLOADED_RADIUS LENGTH; WIDTH LENGTH; ASPECT_RATIO; RIM_RADIUS LENGTH;"
    " RIM_WIDTH LENGTH",
    "OPERATING_CONDITIONS": "INFLPRES PRESSURE; NOMPRES PRESSURE",
    "TIRE_CONDITIONS": "IP PRESSURE; IP_NOM PRESSURE",
    "INERTIA": "MASS MASS; IXX MASS*LENGTH*LENGTH; IYY MASS*LENGTH*LENGTH; BELT_MASS MASS;"
    " BELT_IXX MASS*LENGTH*LENGTH; BELT_IYY MASS*LENGTH*LENGTH",
    "VERTICAL": "FNOMIN FORCE; VERTICAL_STIFFNESS FORCE/LENGTH; Q_RE0; Q_FZ2; PFZ1; BREFF; DREFF;"
    " FREFF",
    "STRUCTURAL": "LONGITUDINAL_STIFFNESS FORCE/LENGTH; LATERAL_STIFFNESS FORCE/LENGTH;"
    " YAW_STIFFNESS FORCE*LENGTH/ANGLE; PCFX1; PCFX2; PCFX3; PCFY1; PCFY2; PCFY3; PCMZ1;"
    " FREQ_LONG; FREQ_LAT; FREQ_YAW; FREQ_WINDUP; DAMP_LONG; DAMP_LAT; DAMP_YAW; DAMP_WINDUP",
    "CONTACT_PATCH": "Q_RA1; Q_RA2; Q_RB1; Q_RB2; Q_A1; Q_A2",
}
SECTION_OF = {
    (words := entry.split())[0]: (section, words[1] if len(words) > 1 else "")
    for section, entries in KEYS_OF_SECTIONS.items()
    for entry in entries.split(";")
}
FREQUENCY_LABELS = {
    "FREQ_LONG": Label(1, 0),
    "FREQ_LAT": Label(0, 0, "axial"),
    "FREQ_YAW": Label(1, 1),
    "FREQ_WINDUP": Label(0, 0, "torsional"),
}
# values of a template that was not identified, as files of programs have them
PLACEHOLDERS = (
    dict(zip(FREQUENCIES, (80, 40, 50, 70), strict=True)),
    dict.fromkeys(("DAMP_LONG", "DAMP_LAT", "DAMP_YAW", "DAMP_WINDUP"), 0.04),
    {"VERTICAL_STIFFNESS": 2e5, "LONGITUDINAL_STIFFNESS": 3e5, "LATERAL_STIFFNESS": 1e5},
    {"Q_RA1": 0.5, "Q_RA2": 1, "Q_RB1": 1, "Q_RB2": -1},
)
ON_ROAD = {  # a key, and the measured quantity that it and others give over the load
    "VERTICAL_STIFFNESS": ("vertical_stiffness_N_per_m", MFSwift.vertical),
    "Q_RA1": ("contact_length_m", MFSwift.patch_length),
    "Q_A1": ("contact_length_m", MFSwift.patch_length),
    "Q_RB1": ("contact_width_m", MFSwift.patch_width),
}
ABOVE_ZERO = ("UNLOADED_RADIUS", "WIDTH", "FNOMIN", "VERTICAL_STIFFNESS")
OTHER_STIFFNESSES = ("LONGITUDINAL_STIFFNESS", "LATERAL_STIFFNESS", "YAW_STIFFNESS")
CURVE = "DEFLECTION_LOAD_CURVE"
MIN_OF_CURVE = 4  # rows of a cubic spline
KEY_AND_VALUE = re.compile(r"(\w+)\s*=\s*('[^']*'|\"[^\"]*\"|[^$!]*)")


@dataclass
class PropertyFile:
    """Contents of a tyre property file."""

    path: Path
    model: MFSwift  # structural keys, SI
    lines: dict[str, int]  # number of the line of each structural key
    is_SI: bool = True  # whether its units are those of SI
    # lines of each section as they are, by its name in capitals, without the section's own line
    sections: dict[str, list[str]] = field(default_factory=dict)
    curve: np.ndarray | None = None  # (n, 2) deflection, m, and load, N, rising

    def place(self, key: str) -> str:
        """File, line and name of a key, for messages."""
        return f"{self.path}, line {self.lines[key]}: {key}"


def read_property_file(path: Path) -> PropertyFile:
    """Raises InputError for a number that is none, a unit that is not known, a key with two values,
    and a curve that does not rise; OSError."""
    sections: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    texts: defaultdict[str, list[tuple[str, str, int]]] = defaultdict(list)
    section = ""
    for number, raw in enumerate(read_bytes(path).decode("latin-1").splitlines(), start=1):
        line = raw.strip()
        if match := re.match(r"\[\s*(\w+)\s*\]", line):
            section = match[1].upper()
            sections.setdefault(section, [])
            continue
        sections.setdefault(section, []).append(raw.rstrip())
        if not (match := KEY_AND_VALUE.match(line)):
            continue
        key, text = match[1].upper(), match[2].strip().strip("'\"").strip()
        if section == "UNITS":
            units[key] = text
        elif key in SECTION_OF and text:
            texts[key].append((section, text, number))
    factors = {
        name: _unit(path, name, text) for name, text in units.items() if text and name in TIR_UNITS
    }
    if "PRESSURE" not in factors:
        factors["PRESSURE"] = factors.get("FORCE", 1.0) / factors.get("LENGTH", 1.0) ** 2
    keys, lines = dict[str, float](), dict[str, int]()
    for key, entries in texts.items():
        own, dimension = SECTION_OF[key]
        # a word without a digit is a unit, or stands for what was not measured
        entries = [each for each in entries if re.search(r"\d", each[1])]
        if not (entries := [each for each in entries if each[0] == own] or entries):
            continue
        values = [_number(path, key, text, line) for _, text, line in entries]
        if len(set(values)) > 1:
            raise InputError(
                f"{path}, line {entries[-1][2]}: {key} is {entries[-1][1]}, and"
                f" {entries[0][1]} in line {entries[0][2]}; take one away"
            )
        keys[key] = values[0]
        for sign, unit in re.findall(r"(^|[*/])([A-Z]+)", dimension):
            keys[key] *= factors.get(unit, 1.0) ** (-1 if sign == "/" else 1)
        lines[key] = entries[0][2]
    curve = _curve(path, sections.get(CURVE, ()), factors)
    return PropertyFile(path, MFSwift(keys), lines, {*factors.values()} == {1.0}, sections, curve)


def _curve(path: Path, lines: Sequence[str], factors: Mapping[str, float]) -> np.ndarray | None:
    """Deflection, m, and load, N, of the rows of a table; None where it has none."""
    rows = [re.split(r"[$!]", line)[0].split() for line in lines]
    rows = [row for row in rows if row and re.match(r"[-+.\d]", row[0])]
    if not rows:
        return None
    try:
        curve = np.array(rows, float) * [factors.get(key, 1.0) for key in ("LENGTH", "FORCE")]
    except ValueError:
        raise InputError(f"{path}: [{CURVE}] must have rows of two numbers") from None
    if len(curve) < MIN_OF_CURVE or (np.diff(curve, axis=0) <= 0).any():
        raise InputError(
            f"{path}: [{CURVE}] must have {MIN_OF_CURVE} rows or more, rising in both columns"
        )
    return curve


def _unit(path: Path, name: str, text: str) -> float:
    known, word = TIR_UNITS[name], text.lower()
    if (factor := known.get(UNIT_SYNONYMS.get(word, word))) is None:
        raise InputError(
            f"{path}: {name} in [UNITS] is '{text}', must be one of {', '.join(known)}"
        )
    return factor


def _number(path: Path, key: str, text: str, line: int) -> float:
    try:
        value = float(text.lower().replace("d", "e"))
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise InputError(f"{path}, line {line}: {key} is '{text}', must be a number")
    return value


def property_measurements(
    path: Path, pressure_kPa: float | None = None
) -> tuple[list[Measurement], list[str]]:
    """Measurements of a tyre property file, and notes on what is in it besides.

    Frequencies with damping ratios, and the mass; vertical stiffness, length and width of the patch
    at half, once and one and a half times FNOMIN, the stiffness of a curve as far as it goes. All
    at NOMPRES (INFLPRES in old versions), or at ``pressure_kPa`` where the file states none. Raises
    InputError; OSError.
    """
    file = read_property_file(path)
    keys, notes = dict(file.model.keys), list[str]()
    for template in PLACEHOLDERS:
        if template.items() <= keys.items():
            notes.append(
                f"{path}: left out {', '.join(template)}: they are the defaults of a template, not"
                " those of a tyre"
            )
            keys = {key: value for key, value in keys.items() if key not in template}
    if CURVE in file.sections and keys.pop("VERTICAL_STIFFNESS", 0):
        notes.append(f"{path}: left out VERTICAL_STIFFNESS: [{CURVE}] replaces it")
    for key in (each for each in ABOVE_ZERO if not keys.get(each, 1.0) > 0):
        raise InputError(f"{file.place(key)} is {keys[key]:g}, must be greater than 0")
    for key in (each.replace("FREQ", "DAMP") for each in FREQUENCY_LABELS):
        if refusal := keys.get(key) and USUAL_MEASUREMENTS[DAMPING_RATIO].refusal(keys[key]):
            raise InputError(f"{file.place(key)} is {keys[key]:g}: {refusal}")
    pressure = _pressure(file, pressure_kPa)

    def measured(key: str, quantity: str, value: float, load: float = 0.0) -> Measurement:
        place = file.place(key) if key in file.lines else f"{path}, [{key}]"
        damping = keys.get(key.replace("FREQ", "DAMP")) if key in FREQUENCY_LABELS else None
        return Measurement(
            quantity,
            FREQUENCY_LABELS.get(key),
            "",
            0.0 if quantity == "mass_kg" else pressure,
            load,
            value,
            run=f"{path}",
            place=place,
            damping_ratio=damping or nan,
        )

    tyre = MFSwift(keys)
    rows = [measured(key, "frequency_Hz", keys[key]) for key in FREQUENCY_LABELS if key in keys]
    for key, (quantity, curve) in ON_ROAD.items() if "FNOMIN" in keys else ():
        for load in (share * keys["FNOMIN"] for share in SHARES_OF_NOMINAL if key in keys):
            try:
                rows.append(measured(key, quantity, float(curve(tyre, load)), load))
            except KeyError as error:
                notes.append(f"{file.place(key)}: left out, as it needs {error.args[0]} too")
                break
            except ValueError as error:
                raise InputError(f"{path}: {error}") from None
    if "FNOMIN" not in keys:
        left = [file.place(key) for key in ON_ROAD if key in keys]
        notes += [f"{place}: left out, as it needs FNOMIN too" for place in left]
    elif file.curve is not None:
        from scipy.interpolate import CubicSpline  # slow to import

        deflections, forces = file.curve.T
        compliance = CubicSpline(forces, deflections).derivative()
        for load in (share * keys["FNOMIN"] for share in SHARES_OF_NOMINAL):
            if forces[0] <= load <= forces[-1]:
                stiffness = 1 / float(compliance(load))
                rows.append(measured(CURVE, "vertical_stiffness_N_per_m", stiffness, load))
    if "MASS" in keys:
        rows.append(measured("MASS", "mass_kg", keys["MASS"]))
    if not rows:
        raise InputError(
            f"{path}: no key states a frequency, a stiffness, a patch or the mass, such as"
            " FREQ_LONG or VERTICAL_STIFFNESS"
        )
    for row in rows:
        if mistake := row.mistake:
            raise InputError(f"{row.place}: {mistake}")
    others = [key for key in OTHER_STIFFNESSES if key in keys]
    if others:
        values = ", ".join(f"{key} {keys[key]:.6g}" for key in others)
        notes.append(f"{path}: not measurements: {values}; compare with 'tyrecal stiffness'")
    return rows, notes


def _pressure(file: PropertyFile, pressure_kPa: float | None) -> float:
    """The pressure of a file's keys, kPa. Raises InputError."""
    keys = file.model.keys
    key = next((key for key in ("NOMPRES", "INFLPRES", "IP_NOM", "IP") if keys.get(key)), None)
    if key:
        stated = keys[key] / 1e3
        if refusal := PRESSURE_USUAL.refusal(stated):
            raise InputError(f"{file.place(key)} is {stated:g} kPa: {refusal}")
        return stated
    if pressure_kPa is None:
        raise InputError(f"{file.path}: no NOMPRES or INFLPRES; give --pressure-kPa")
    return pressure_kPa
