"""Files of all kinds to one set of measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..simulate.modes.label import Label
from .measurement import Measurement
from .modal import LabelledMode, Layout, ModalTest, measurements_of, read_modal_test
from .repeats import FLOOR, combined
from .tables import read_table
from .universal import Place, Universal, is_universal, read_universal

SAME_PLACE_m = 1e-6  # m
MIN_EXPLAINED = 0.98  # of the functions' mean square; less, and modes are missing


@dataclass(frozen=True)
class Gathered:
    """What several files measure together."""

    rows: list[Measurement]  # one value each with its sigma
    runs: list[ModalTest]  # of the universal files
    notes: list[str]  # what a user has to know


def gather(
    paths: Sequence[Path],
    pressure_kPa: float | None = None,
    layout: Layout | None = None,
    floor: float = FLOOR,
    assumed: float = 0.0,
) -> Gathered:
    """Measurements of several files; those of the same thing are repeats.

    pressure_kPa: of files that do not say theirs; floor, assumed: relative, see ``combined``.
    Raises InputError, OSError.
    """
    for k, path in enumerate(paths):
        if path.resolve() in [other.resolve() for other in paths[:k]]:
            raise InputError(f"{path}: is given twice; as its own repeat it would tell nothing")
    universal = [read_universal(path) for path in paths if is_universal(path)]
    nodes = all_nodes(universal)
    values: list[Measurement] = []
    runs: list[ModalTest] = []
    notes: list[str] = []
    for path in paths:
        file = next((each for each in universal if each.path == path), None)
        if file is None:
            values += read_table(path, pressure_kPa)
            continue
        notes += [f"{path}: {count} of {what} not used" for what, count in file.skipped.items()]
        if not file.shapes and not file.functions and file.nodes and len(universal) > 1:
            continue  # the geometry of the others
        if pressure_kPa is None:
            raise InputError(f"{path}: universal files hold no pressure; give --pressure-kPa")
        run = read_modal_test(file, nodes, layout or Layout())
        runs.append(run)
        if run.explained < MIN_EXPLAINED:
            notes.append(
                f"{path}: the modes make {run.explained:.0%} of the functions; one may be missing:"
                " look at the picture, try a narrower --band"
            )
        values += measurements_of(run, pressure_kPa)
    if not values:
        why = next((each.judged.why for run in runs for each in run.modes), "")
        raise InputError(f"{paths[0]}: no mode could be told: {why}")
    return Gathered(combined(values, floor, assumed), runs, notes)


def all_nodes(files: Sequence[Universal]) -> dict[int, Place]:
    """Coordinates of all files together. Raises InputError where two differ."""
    nodes: dict[int, Place] = {}
    for file in files:
        for number, place in file.nodes.items():
            known = nodes.setdefault(number, place)
            if max(abs(a - b) for a, b in zip(known, place, strict=True)) > SAME_PLACE_m:
                raise InputError(
                    f"{file.path}: node {number} stands elsewhere than in the files before"
                )
    return nodes


def result(gathered: Gathered) -> dict[str, Any]:
    """What ``tyrecal measured import --json`` prints."""
    return {
        "format": 1,
        "measurements": [
            {
                "quantity": row.quantity,
                **label_entry(row.label),
                "member": row.member,
                "pressure_kPa": row.pressure_kPa,
                "load_N": row.load_N,
                **({"rim": row.rim} if row.rim else {}),
                "value": row.value,
                "sigma": row.sigma,
            }
            for row in gathered.rows
        ],
        "modes": [_entry(run, mode) for run in gathered.runs for mode in run.modes],
    }


def label_entry(label: Label | None) -> dict[str, Any]:
    """c, m and kind, None where there is no label."""
    return asdict(label) if label else dict.fromkeys(("c", "m", "kind"))


def _entry(run: ModalTest, told: LabelledMode) -> dict[str, Any]:
    finite = lambda x: x if isfinite(x) else None
    return {
        "file": run.name,
        "frequency_Hz": told.mode.frequency_Hz,
        "sigma_Hz": finite(told.mode.sigma_Hz),
        "damping_ratio": finite(told.mode.damping),
        "collinearity": round(told.collinearity, 4),
        **label_entry(told.judged.label),
        "member": told.member,
        "confidence": round(told.judged.confidence, 4),
        "why": told.judged.why,
    }
