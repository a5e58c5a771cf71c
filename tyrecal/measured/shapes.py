"""Measured shapes in a file next to the measurements that were imported with them.

`measured import` writes it, and a fit to those measurements compares the shapes with the fitted
ones (`correlation`).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from ..errors import InputError
from ..files import json_text, read_json
from ..simulate.modes.label import Label
from .sensors import Sensors

if TYPE_CHECKING:  # readers of shapes identify no modes
    from .modal import ModalTest

Array = np.ndarray
Vector = tuple[float, float, float]
SAME_PRESSURE_kPa = 0.5  # pressures that differ by less are one
SAME_MODE = 0.01  # largest relative distance of a frequency, a mean of repeats, from its shape's


class ShapeOfMode(BaseModel):
    """A measured mode: its label, None if it has none, and a real value for each signal, the
    largest 1."""

    model_config = ConfigDict(allow_inf_nan=False, frozen=True)

    c: int | None
    m: int | None
    kind: str | None
    member: str  # 1 or 2 if both modes of a doublet were measured
    frequency_Hz: float
    values: list[float]

    @property
    def name(self) -> str:
        """Label, or else the frequency."""
        if self.c is None or self.m is None:
            return f"{self.frequency_Hz:.2f} Hz"
        return str(Label(self.c, self.m, self.kind))


class SensorShapes(BaseModel):
    """Modes of one test on one layout of sensors."""

    model_config = ConfigDict(allow_inf_nan=False, frozen=True)

    file: str
    pressure_kPa: float
    signals: list[str]  # channels, as `--leave-out` has them
    points: list[Vector]  # R (m), Theta (rad), Z (m) of each
    directions: list[Vector]  # in r, theta, z
    modes: list[ShapeOfMode]

    @property
    def sensors(self) -> Sensors:
        """Layout of the sensors."""
        return Sensors(np.array(self.points), np.array(self.directions), tuple(self.signals))

    def nearest(self, hertz: Array, kPa: Array) -> dict[int, int]:
        """Index of the mode nearest to each of n frequencies (n,), measured at pressures (n,), by
        the frequency's index; none farther than `SAME_MODE`, or measured at another pressure."""
        off = abs(np.divide.outer(hertz, [mode.frequency_Hz for mode in self.modes]) - 1)
        off[abs(kPa - self.pressure_kPa) > SAME_PRESSURE_kPa] = np.inf
        return {i: j for i, j in enumerate(off.argmin(1).tolist()) if off[i, j] < SAME_MODE}

    def spans(self) -> dict[str, Array]:
        """Shapes (k, 1) by name, and both of a doublet together, (k, 2)."""
        columns: dict[str, list[list[float]]] = {}
        for mode in self.modes:
            columns.setdefault(mode.name, []).append(mode.values)
        return {name: np.array(values).T for name, values in columns.items()}


class _ShapesFile(BaseModel):
    format: Literal[1] = 1
    tests: list[SensorShapes]


def shapes_of(run: ModalTest, pressure_kPa: float) -> Iterator[SensorShapes]:
    """Shapes of a test, apart for each layout of sensors."""
    own = lambda each: each.sensors.names
    for names, modes in groupby(sorted(run.modes, key=own), own):
        members = sorted(modes, key=lambda each: each.mode.frequency_Hz)
        yield SensorShapes(
            file=Path(run.name).name,
            pressure_kPa=pressure_kPa,
            signals=list(names),
            points=members[0].sensors.points.tolist(),
            directions=members[0].sensors.directions.tolist(),
            modes=[
                ShapeOfMode(
                    c=label.c if (label := each.judged.label) else None,
                    m=label.m if label else None,
                    kind=label.kind if label else None,
                    member=each.member,
                    frequency_Hz=each.mode.frequency_Hz,
                    values=each.shape.tolist(),
                )
                for each in members
            ],
        )


def shapes_path(measured: Path) -> Path:
    """Place of the shapes that were imported with a file of measurements."""
    return measured.with_name(f"{measured.stem}_at_sensors.json")


def shapes_text(tests: list[SensorShapes]) -> str:
    """Text of a file of shapes."""
    return json_text(_ShapesFile(tests=tests).model_dump())


def read_shapes(measured: Path) -> list[SensorShapes]:
    """Shapes that were imported with a file of measurements; none where there is no such file.

    Raises InputError, OSError.
    """
    path = shapes_path(measured)
    if not path.is_file():
        return []
    try:
        tests = _ShapesFile.model_validate(read_json(path)).tests
    except (ValidationError, ValueError):
        tests = None
    if tests is None or not all(_is_whole(each) for each in tests):
        raise InputError(
            f"{path}: is no file of measured shapes; write it again with 'tyrecal measured import'"
        )
    return tests


def _is_whole(test: SensorShapes) -> bool:
    """Whether there are modes, and each signal has a place, a direction and a value of each."""
    counts = {len(test.points), len(test.directions), *(len(each.values) for each in test.modes)}
    return bool(test.modes) and counts == {len(test.signals)}
