"""Places for sensors on a case's tyre, what they distinguish, and what their mass shifts:
sensors.json."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import numpy as np

from ..simulate.modes.label import Mode
from .result import NAME_COLUMNS, Column, Named, Result, ResultPart, Table, csv_text

if TYPE_CHECKING:  # those who read results need no SciPy
    from ..measured.case_modes import CaseModes

Array = np.ndarray


class SensorPlace(ResultPart):
    """A sensor's place on the tread."""

    sensor: Annotated[int, Column("sensor", ".0f")]  # number
    radius_m: Annotated[float, Column("R mm", ".1f", 1e3)]  # distance from the axle
    angle_deg: Annotated[float, Column("angle °", ".1f")]  # along the circumference, from any place
    z_m: Annotated[float, Column("Z mm", ".1f", 1e3)]  # along the axle, from the middle plane


class SensedMode(Named):
    """A mode of the case at the sensors."""

    labelled: Annotated[float, Column("labelled %", ".0f", 100)]  # share of drawn tests
    # shift of the frequency by the sensors' mass, mean of both of a doublet
    shift_percent: Annotated[float, Column("mass shift %", "+z.2f")]
    split_percent: Annotated[float, Column("split %", ".2f")]  # of a doublet by the mass


class SensorsResult(Result):
    """sensors.json"""

    study, stem, command, heading = "sensors", "sensors", "measured sensors", "Sensors"
    is_seldom = True

    axes: str  # directions that each sensor measures: r, t, z
    sensor_mass_kg: float  # mass of each sensor
    labelled: float  # share of the modes of all drawn tests
    labelled_error: float  # standard error of that by the number of tests
    chance_level: float  # lead of the best MAC over the next that chance reaches
    largest_auto_mac: float  # largest MAC of two modes at these sensors
    places: list[SensorPlace]  # places of the sensors
    modes: list[SensedMode]  # modes that they are to distinguish

    def csv(self) -> str:
        return csv_text([*SensorPlace.model_fields], (each.model_dump() for each in self.places))

    def tables(self) -> list[Table]:
        columns = [*NAME_COLUMNS, Column("Hz"), *SensedMode.columns().values()]
        rows = [[*m.named(), f"{m.frequency_Hz:.2f}", *m.cells()] for m in self.modes]
        places = [each.cells() for each in self.places]
        return [Table([*SensorPlace.columns().values()], places), Table(columns, rows, csv=None)]

    def sentences(self) -> list[str]:
        rare = [mode.label.display for mode in self.modes if mode.labelled < 0.9]
        return [
            f"{len(self.places)} sensors, each {self.axes}, {1e3 * self.sensor_mass_kg:g} g: a mode"
            f" gets its label in {100 * self.labelled:.0f} % of drawn tests"
            + (f", less than 90 % for {', '.join(rare)}" if rare else ""),
            f"largest AutoMAC of two modes {self.largest_auto_mac:.2f} (chance level"
            f" {self.chance_level:.2f})",
        ]


def place(
    case: CaseModes, modes: list[Mode], count: int, axes: str, mass_kg: float, seed: int
) -> SensorsResult:
    """``count`` sensors for modes of a case. Labels are those of an import that allows one wave
    more than the modes have; seed: of the drawn tests."""
    from ..measured.correlation import chance_level, mac_matrix
    from ..measured.placement import labelled_in_tests, mass_shifts, place_sensors

    sensors = place_sensors(case, modes, count, axes)
    places = sensors.points[:: len(axes)]
    highest, random = 1 + max(mode.label.c for mode in modes), np.random.default_rng(seed)
    is_right = labelled_in_tests(case, modes, sensors, highest, random)
    by_test = is_right.mean(1)
    planes = [case.signals(mode, sensors) for mode in modes]
    shifts = [mass_shifts(case, mode, places, mass_kg) for mode in modes]
    return SensorsResult(
        format=1,
        axes=axes,
        sensor_mass_kg=mass_kg,
        labelled=float(by_test.mean()),
        labelled_error=float(by_test.std() / len(by_test) ** 0.5),
        chance_level=chance_level(len(sensors.points)),
        largest_auto_mac=float((mac_matrix(planes, planes) - np.eye(len(planes))).max()),
        places=[
            SensorPlace(
                sensor=number, radius_m=float(R), angle_deg=float(np.degrees(angle)), z_m=float(Z)
            )
            for number, (R, angle, Z) in enumerate(places, 1)
        ],
        modes=[
            SensedMode(
                **asdict(mode.label),
                frequency_Hz=mode.frequency_Hz,
                labelled=float(share),
                shift_percent=100 * float(shift.mean()),
                split_percent=100 * float(np.ptp(shift)),
            )
            for mode, share, shift in zip(modes, is_right.mean(0), shifts, strict=True)
        ],
    )
