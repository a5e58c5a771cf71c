"""TYDEX 1.3 files: the load against the deflection of a tyre that is pressed on a road.

    **CONSTANTS       name (10 columns), description (30), unit (10), value
    **MEASURCHANNELS  name (10 columns), description (30), unit (10), factor, two offsets (10 each)
    **MEASURDATA      a record of one number for each channel, on one line or several

``!`` begins a comment, NOTAVAIL is a missing number. A number times the factor is in the unit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from math import nan, pi
from pathlib import Path

import numpy as np

from .. import units
from ..errors import InputError
from ..files import read_bytes
from .measurement import PRESSURE_USUAL, SHARES_OF_NOMINAL, Measurement

Array = np.ndarray
CELL = 10  # columns of a number
NOT_AVAILABLE = "NOTAVAIL"
ANGLE_UNITS = {"rad": 1.0, "deg": pi / 180, "degree": pi / 180, "\u00b0": pi / 180}
SPEED_UNITS = {
    "m/s": 1.0,
    "km/h": 1 / 3.6,
    "kph": 1 / 3.6,
    "mph": 0.44704,
    "rad/s": 1.0,
    "1/s": 1.0,
}
LOAD_CHANNELS, DEFLECTION_CHANNELS = (
    ("FZW", "FZH", "FZC", "FZ"),
    ("TYREDEFW", "DSTGRWHC"),
)  # channels, best first
SPEED_CHANNELS = ("LONGVEL", "TRAJVELW", "TRAJVELH", "WHROTSPD")
MAX_TILT = 0.5 * pi / 180  # rad, of SLIPANGL and INCLANGL
MAX_PRESSURE_CHANGE = 0.03  # relative
MIN_PRESSED = 0.1  # of the largest: below it the patch is not whole
MIN_RECORDS = 6
MISFIT_NOTED = 0.02  # of the largest load
SHARES_OF_LARGEST = (0.25, 0.5, 0.75)  # where no nominal load is stated


@dataclass
class TydexFile:
    """Contents of a TYDEX file. Numbers are in the unit next to them."""

    path: Path
    constants: dict[str, tuple[str, str]] = field(default_factory=dict)  # unit and value
    channels: dict[str, tuple[str, float]] = field(default_factory=dict)  # unit and factor
    records: Array = field(default_factory=lambda: np.empty((0, 0)))  # (n, channels); NaN: missing

    def constant(self, name: str, table: dict[str, float]) -> float | None:
        """A constant times its unit's factor; None if it is absent. Raises InputError."""
        unit, text = self.constants.get(name, ("", NOT_AVAILABLE))
        if text.upper() == NOT_AVAILABLE:
            return None
        try:
            return float(text) * self._factor(name, unit, table)
        except ValueError:
            raise InputError(f"{self.path}: {name} is '{text}', must be a number") from None

    def channel(self, name: str, table: dict[str, float]) -> Array | None:
        """A channel times its factors (n,); None if it is absent or empty. Raises InputError."""
        if name not in self.channels:
            return None
        unit, factor = self.channels[name]
        values = self.records[:, [*self.channels].index(name)] * factor
        if np.isnan(values).all():
            return None
        return np.asarray(values * self._factor(name, unit, table))

    def first(self, names: Iterable[str], table: dict[str, float]) -> tuple[str, Array]:
        """Name and values of the first channel that is there. Raises InputError."""
        for name in names:
            if (values := self.channel(name, table)) is not None:
                return name, values
        raise InputError(
            f"{self.path}: no channel {' or '.join(names)}; it has {', '.join(self.channels)}"
        )

    def _factor(self, name: str, unit: str, table: dict[str, float]) -> float:
        factor = units.factor(table, units.plain(unit))
        if factor is None:
            raise InputError(
                f"{self.path}: the unit of {name} is '{unit}', must be one of {', '.join(table)}"
            )
        return factor


def read_tydex(path: Path) -> TydexFile:
    """Raises InputError with the line; OSError."""
    file, section, count = TydexFile(path), "", None
    cells: list[float] = []
    records: list[list[float]] = []
    for number, raw in enumerate(read_bytes(path).decode("latin-1").splitlines(), start=1):
        line, place = raw.expandtabs().rstrip(), f"{path}, line {number}"
        if line.startswith("**"):
            section, _, rest = line[2:].partition(" ")
            section = section.upper()
            if section == "MEASURDATA" and rest.strip().isdigit():
                count = int(rest)
        elif not line.strip() or line.lstrip().startswith("!"):
            continue
        elif section == "CONSTANTS":
            name, unit, text = _entry(line)
            file.constants[name] = unit, text.strip()
        elif section == "MEASURCHANNELS":
            name, unit, text = _entry(line)
            if name in file.channels:
                raise InputError(f"{place}: channel {name} is given twice")
            file.channels[name] = unit, _conversion(place, name, text)
        elif section == "MEASURDATA":
            cells += _cells(place, line)
            if len(cells) > len(file.channels):
                raise InputError(
                    f"{place}: {len(cells)} numbers, the channels are {len(file.channels)}"
                )
            if len(cells) == len(file.channels):
                records.append(cells)
                cells = []
    if cells or (count is not None and count != len(records)):
        stated = f", the file states {count}" if count is not None else ""
        raise InputError(f"{path}: {len(records)} complete lines of data{stated}; it is cut off")
    file.records = np.array(records).reshape(len(records), len(file.channels))
    return file


def _entry(line: str) -> tuple[str, str, str]:
    """Name, unit, and what follows, of a constant or a channel."""
    return line[:10].strip().upper(), line[40:50].strip(), line[50:]


def _in_columns(text: str) -> list[str]:
    return [text[k : k + CELL].strip() for k in range(0, len(text), CELL)]


def _conversion(place: str, name: str, text: str) -> float:
    """The factor of a channel. Raises InputError for one that is none, or an offset."""
    for texts in (_in_columns(text or "1"), text.split()):
        with suppress(ValueError):
            factor, *offsets = (float(number) for number in texts if number)
            break
    else:
        raise InputError(
            f"{place}: {name} has '{text.strip()}' from column 51 on, must be the factor and two"
            " offsets, 10 columns each"
        )
    if any(offsets):
        raise InputError(
            f"{place}: channel {name} has an offset, which programs apply differently; apply it"
            " to the data, and write 0"
        )
    return factor


def _cells(place: str, line: str) -> list[float]:
    """The numbers of a line, separated by blanks or in columns of 10. Raises InputError."""
    words = line.split()
    for texts in (words, _in_columns(line)):
        with suppress(ValueError):
            return [nan if text.upper() == NOT_AVAILABLE else float(text) for text in texts]
    wrong = next((word for word in words if not re.fullmatch(r"[-+.\deE]+", word)), line.strip())
    raise InputError(f"{place}: '{wrong}' is not a number")


def tydex_measurements(
    path: Path, pressure_kPa: float | None = None
) -> tuple[list[Measurement], list[str]]:
    """Vertical stiffnesses of a TYDEX file, and notes on its curve and radius.

    The curve is a parabola through all records, at half, once and one and a half times FNOMIN, as
    far as they were measured. ``pressure_kPa``: where the file states none. Raises InputError;
    OSError.
    """
    file = read_tydex(path)
    _, load = file.first(LOAD_CHANNELS, units.LOAD)
    name, way = file.first(DEFLECTION_CHANNELS, units.LENGTH)
    deflection = -way if name == "DSTGRWHC" else way
    measured = np.isfinite(load) & np.isfinite(deflection)
    load, deflection = load[measured], deflection[measured]
    load = load if not len(load) or np.median(load) >= 0 else -load
    pressing = load >= MIN_PRESSED * load.max(initial=0.0)
    load, deflection = load[pressing], deflection[pressing]
    if len(load) < MIN_RECORDS or not np.ptp(load) >= load.max() / 2 > 0:
        raise InputError(
            f"{path}: {len(load)} records of load and deflection from {load.min(initial=0.0):g} to"
            f" {load.max(initial=0.0):g} N; a curve needs {MIN_RECORDS}, from half the load or less"
        )
    if not np.ptp(deflection):
        raise InputError(
            f"{path}: all values of {name} are {deflection[0]:g} m; a curve needs others"
        )
    _refuse_tilt(file)
    pressure, notes = _pressure(file, pressure_kPa)
    curve = np.polynomial.Polynomial.fit(deflection, load, 2)
    misfit = float(np.abs(curve(deflection) - load).max() / load.max())
    if misfit > MISFIT_NOTED:
        notes.append(f"{path}: the load is up to {100 * misfit:.1f} % off a parabola")
    if speeds := [name for name in SPEED_CHANNELS if np.any(file.channel(name, SPEED_UNITS))]:
        notes.append(f"{path}: measured while the tyre rolled ({', '.join(speeds)})")
    if radius := file.constant("RFREE", units.LENGTH):
        notes.append(f"{path}: not a measurement: free radius {1e3 * radius:.4g} mm")
    nominal = file.constant("FNOMIN", units.LOAD)
    shares, whole = (SHARES_OF_NOMINAL, nominal) if nominal else (SHARES_OF_LARGEST, load.max())
    rows = []
    for wanted in (share * whole for share in shares):
        if not load.min() <= wanted <= load.max():
            continue
        roots = (curve - wanted).roots()
        near = [float(x.real) for x in roots if deflection.min() <= x.real <= deflection.max()]
        slope = float(curve.deriv()(near[0])) if near else 0.0
        place = f"{path}, channels {name} and load"
        row = Measurement(
            "vertical_stiffness_N_per_m", None, "", pressure, wanted, slope, nan, f"{path}", place
        )
        if mistake := row.mistake:
            raise InputError(f"{place}: {mistake}")
        rows.append(row)
    if not rows:
        raise InputError(
            f"{path}: FNOMIN is {nominal:g} N, the loads are {load.min():g} to {load.max():g} N"
        )
    return rows, notes


def _refuse_tilt(file: TydexFile) -> None:
    """Raises InputError where the tyre was measured at an angle."""
    for name in ("SLIPANGL", "INCLANGL"):
        stated = file.constant(name, ANGLE_UNITS) or 0.0
        channel = file.channel(name, ANGLE_UNITS)
        largest = np.nanmax(np.abs([stated, *(channel if channel is not None else ())]))
        if largest > MAX_TILT:
            raise InputError(
                f"{file.path}: {name} goes to {np.degrees(largest):.3g} degrees; give a file of the"
                " upright wheel"
            )


def _pressure(file: TydexFile, pressure_kPa: float | None) -> tuple[float, list[str]]:
    """The pressure, kPa, and a note where it is the nominal one. Raises InputError."""
    channel = file.channel("INFLPRES", units.PRESSURE)
    constant = file.constant("INFLPRES", units.PRESSURE)
    notes: list[str] = []
    if channel is not None:
        low, high = np.nanmin(channel), np.nanmax(channel)
        pressure = float(np.nanmean(channel))
        if high - low > MAX_PRESSURE_CHANGE * pressure:
            raise InputError(
                f"{file.path}: INFLPRES goes from {low:g} to {high:g} kPa; give a file for each"
                " pressure"
            )
    elif constant is not None or pressure_kPa is not None:
        pressure = constant if constant is not None else float(pressure_kPa or 0.0)
    elif nominal := file.constant("NOMPRES", units.PRESSURE):
        pressure = nominal
        notes = [f"{file.path}: no INFLPRES; taken as measured at NOMPRES, {pressure:g} kPa"]
    else:
        raise InputError(f"{file.path}: no INFLPRES or NOMPRES; give --pressure-kPa")
    if refusal := PRESSURE_USUAL.refusal(pressure):
        raise InputError(f"{file.path}: the pressure is {pressure:g} kPa: {refusal}")
    return pressure, notes
