"""Measurements of any file that a study may be given; fits and diagnoses call this."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..tyre.case import LoadedCase
from .measurement import Measurement
from .shapes import SensorShapes, read_shapes
from .targets import readings_of
from .universal import is_universal


def readings_with_shapes(
    case: LoadedCase, path: Path
) -> tuple[list[Measurement], list[SensorShapes]]:
    """Measurements of a file, with or without labels, and the shapes measured with them: of a
    universal file at the case's pressure `unlabelled`, else those that were imported with the file.

    Raises InputError, OSError.
    """
    if not is_universal(path):
        return readings_of(case, path, labelled=False), read_shapes(path)
    from .gather import unlabelled  # which identifies modes: SciPy is slow to import

    try:
        readings, shapes, _ = unlabelled(path, case.case.pressure_kPa)
    except InputError as error:
        way = "'tyrecal measured import --no-labels' has options for universal files"
        raise InputError(f"{error}; {way}") from None
    return readings, shapes
