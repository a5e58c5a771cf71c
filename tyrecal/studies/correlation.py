"""Measured shapes compared with those of a design: which mode each belongs to by its MAC, how well
the sensors separate the modes, and which sensors agree least."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np

from ..simulate.modes.label import in_words
from ..simulate.modes.rings import squared_cosines
from .result import Column, ResultPart, Table

if TYPE_CHECKING:  # those who read results need no SciPy
    from ..measured.case_modes import CaseModes
    from ..measured.shapes import SensorShapes

Array = np.ndarray
COMPARED_UP_TO = 1.5  # times the highest measured frequency, of a mode of the design
MAX_SENSORS_SHOWN = 10
NO_PAIR = "undecided"


class ShapePair(ResultPart):
    """A measured shape and the mode of the design that it is most like."""

    measured: str  # label of the measured shape
    member: str  # 1 or 2 if both modes of a doublet were measured, else empty
    frequency_Hz: float  # measured
    computed: str | None  # None if the sensors see no mode
    mac: float  # of the shape with that mode, 0 to 1
    rival: str | None  # the mode that it is like next
    rival_mac: float  # of the shape with that one
    decided: bool  # whether the first leads by more than the chance level
    # least squared cosine between the planes of the measured doublet and the mode; None: only one
    # of its modes was measured
    plane_mac: float | None


class SensorAgreement(ResultPart):
    """Agreement of a signal over all decided pairs."""

    signal: Annotated[str, Column("sensor", "")]  # sensor and its direction
    comac: Annotated[float, Column("COMAC", ".3f")]  # 1: measured and computed are proportional
    ecomac: Annotated[float, Column("ECOMAC", ".3f")]  # 0: they are equal


class ShapeCorrelation(ResultPart):
    """Shapes of a test against those of a design at the test's pressure."""

    file: str  # the file with the shapes
    pressure_kPa: float
    signals: int  # number of measured signals
    chance_level: float  # lead of the best MAC over the next that chance reaches
    measured: list[str]  # rows of ``auto_mac``: doublets are planes
    auto_mac: list[list[float]]  # MAC of the measured shapes with each other
    computed: list[str]  # columns of ``mac``: doublets are planes
    unseen: list[str]  # modes of the design that hardly move the sensors: not compared
    auto_mac_computed: list[list[float]]  # MAC of the computed modes with each other
    mac: list[list[float]]  # a row for each of ``pairs``
    pairs: list[ShapePair]  # each measured shape with its mode
    sensors: list[SensorAgreement]  # agreement by signal

    def table(self) -> Table:
        """The pairs."""
        names = ("measured", "Hz", "mode", "MAC", "next", "its MAC")
        columns = [
            Column(name, "" if name in ("measured", "mode", "next") else ".2f") for name in names
        ]
        rows = [
            [
                in_words(each.measured) + f" member {each.member}" * bool(each.member),
                f"{each.frequency_Hz:.2f}",
                in_words(each.computed or "") if each.decided else NO_PAIR,
                f"{each.mac:.3f}",
                in_words(each.rival or ""),
                f"{each.rival_mac:.3f}",
            ]
            for each in self.pairs
        ]
        title = f"Shapes of {self.file}, {self.pressure_kPa:g} kPa"
        return Table(columns, rows, title, self._level, csv=None)

    def sensors_table(self) -> Table:
        """The signals that agree least."""
        columns = list(SensorAgreement.columns().values())
        least = sorted(self.sensors, key=lambda each: -each.ecomac)[:MAX_SENSORS_SHOWN]
        title = f"Sensors of {self.file} that agree least"
        return Table(columns, [each.cells() for each in least], title, csv=None)

    def sentences(self) -> list[str]:
        """Undecided shapes, and sensors that agree least."""
        decided = sum(each.decided for each in self.pairs)
        words = [f"{self.file}: MAC decides {decided} of {len(self.pairs)} shapes"]
        if self.unseen:
            hidden = in_words(", ".join(self.unseen))
            words.append(f"{self.file}: the sensors hardly see {hidden}: not compared")
        least = sorted(self.sensors, key=lambda each: -each.ecomac)[:3]
        if least:
            signals = ", ".join(f"{each.signal} (COMAC {each.comac:.2f})" for each in least)
            words.append(f"{self.file}: sensors that agree least are {signals}")
        return words

    @property
    def _level(self) -> str:
        return (
            f"chance level {self.chance_level:.2f} ({self.signals} signals): a shape has a mode"
            " where its MAC leads the next by more"
        )


def correlate(test: SensorShapes, case: CaseModes) -> ShapeCorrelation:
    """Shapes of a test against those of the modes of a case at the test's pressure (the caller sees
    to that), up to `COMPARED_UP_TO`.

    Raises InputError if a sensor is not on the tyre.
    """
    from ..measured.correlation import chance_level, mac_matrix

    sensors, level = test.sensors, chance_level(len(test.signals))
    limit = COMPARED_UP_TO * max(mode.frequency_Hz for mode in test.modes)
    possible = [mode for mode in case.modes if mode.frequency_Hz <= limit]
    possible.sort(key=lambda mode: mode.frequency_Hz)
    seen = [mode for mode in possible if case.is_seen(mode, sensors)]
    planes = {str(mode.label): case.signals(mode, sensors) for mode in seen}
    names, measured = list(planes), test.spans()
    shapes = [np.array(mode.values)[:, None] for mode in test.modes]
    table = mac_matrix(shapes, list(planes.values()))
    pairs = []
    for mode, row in zip(test.modes, table, strict=True):
        likeliest = [names[i] for i in np.argsort(-row, kind="stable")] + [None, None]
        first, second = likeliest[:2]
        mac, rival_mac = (row[names.index(each)] if each else 0.0 for each in (first, second))
        own = measured[mode.name]
        both = squared_cosines(own, planes[first]) if first and own.shape[1] == 2 else None
        pairs.append(
            ShapePair(
                measured=mode.name,
                member=mode.member,
                frequency_Hz=mode.frequency_Hz,
                computed=first,
                mac=float(mac),
                rival=second,
                rival_mac=float(rival_mac),
                decided=bool(mac - rival_mac > level),
                plane_mac=None if both is None else float(both.min(initial=1.0)),
            )
        )
    return ShapeCorrelation(
        file=test.file,
        pressure_kPa=test.pressure_kPa,
        signals=len(test.signals),
        chance_level=level,
        measured=list(measured),
        auto_mac=_rounded(mac_matrix(list(measured.values()), list(measured.values()))),
        computed=names,
        unseen=[str(mode.label) for mode in possible if mode not in seen],
        auto_mac_computed=_rounded(mac_matrix(list(planes.values()), list(planes.values()))),
        mac=_rounded(table),
        pairs=pairs,
        sensors=_sensors(test, pairs, planes),
    )


def _sensors(
    test: SensorShapes, pairs: list[ShapePair], planes: dict[str, Array]
) -> list[SensorAgreement]:
    """Agreement of the signals over the decided pairs; none without a pair."""
    from ..measured.correlation import closest_shape, sensor_agreement

    shapes = [
        (np.array(mode.values), planes[pair.computed])
        for mode, pair in zip(test.modes, pairs, strict=True)
        if pair.decided and pair.computed
    ]
    if not shapes:
        return []
    measured = np.column_stack([shape / np.linalg.norm(shape) for shape, _ in shapes])
    computed = np.column_stack([closest_shape(shape, plane) for shape, plane in shapes])
    values = zip(test.signals, *sensor_agreement(measured, computed), strict=True)
    return [
        SensorAgreement(signal=signal, comac=float(comac), ecomac=float(ecomac))
        for signal, comac, ecomac in values
    ]


def _rounded(matrix: Array) -> list[list[float]]:
    return [[round(float(value), 6) for value in row] for row in matrix]
