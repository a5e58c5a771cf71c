"""CalculiX's result files, as version 2.20 writes them: eigenvalues and mass from .dat, shapes from
.frd."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import RunFailed

Array = np.ndarray
SAME = 1e-4  # relative difference of the two eigenvalues of a pair, at most
MASS = r"total mass for set {} and time\s+\S+\s+(\S+)"


@dataclass
class Fields:
    """Contents of a .frd file, in the deck's units."""

    nodes: Array  # (k,) numbers
    points: Array  # (k, 3) x, y, z
    # in the file's order: mode number (0 of a static step), name (DISP, or DISPI for an imaginary
    # part), values (k, 3) on the nodes
    blocks: list[tuple[int, str, Array]]


def read_eigenvalues(path: Path, diameter: int | None, expected: int | None) -> Array:
    """omega^2 (expected,) in 1/s2, ascending, from the .dat, of a nodal diameter of a sector; None:
    of a whole tyre, or as many as there are. Raises RunFailed: ``no_results`` unless there are as
    many as asked, ``unstable`` where one is not positive."""
    which = "" if diameter is None else f" +{diameter}"
    row = re.compile(rf"^{which} +(\d+)((?: +\S+){{4}}) *$", re.M)
    last = _text(path).rpartition("E I G E N V A L U E   O U T P U T")[2]
    table = last.partition("P A R T I C I P A T I O N")[0]
    rows = [(int(m[1]), _number(m[2].split()[0], path)) for m in row.finditer(table)]
    count = len(rows) if expected is None else expected
    if not rows or [number for number, _ in rows] != list(range(1, count + 1)):
        raise RunFailed("no_results", f"{path.name} has {len(rows)} of {expected or 'any'} modes")
    values = np.array([value for _, value in rows])
    if not values.any():
        raise RunFailed("no_results", f"{path.name}: all eigenvalues are 0")
    if (values <= 0).any():
        raise RunFailed(
            "unstable", f"{path.name}: an eigenvalue is {values.min():g}: the state is unstable"
        )
    return values


def read_mass(path: Path, elements: str = "EVERYTHING") -> float:
    """Mass of a set of elements, in the deck's unit, as last printed. Raises RunFailed
    (``no_results``)."""
    matches = re.findall(MASS.format(re.escape(elements)), _text(path))
    if not matches:
        raise RunFailed("no_results", f"{path.name} has no mass of {elements}")
    return _number(matches[-1], path)


def pairs(eigenvalues: Array, name: str) -> Array:
    """One eigenvalue (m,), 1/s2, of each pair. Raises RunFailed (``no_results``) where two do not
    match."""
    first, second = eigenvalues[::2], eigenvalues[1::2]
    if len(first) != len(second) or (abs(second - first) > SAME * second).any():
        raise RunFailed("no_results", f"{name}: modes do not come in pairs")
    return (first + second) / 2


def read_fields(path: Path, static: bool = True) -> Fields:
    """Fields of a .frd file; static: of its static steps too. Raises RunFailed (``no_results``)
    where it is cut, doubled or empty.

    Columns have a fixed width and may touch."""
    lines = _text(path).splitlines()
    if not lines or lines[-1].strip() != "9999":
        raise RunFailed("no_results", f"{path.name} is cut off")
    if sum(line.strip() in ("9999", "1C") for line in lines) != 2:
        raise RunFailed("no_results", f"{path.name} holds the results of two runs")
    nodes: dict[int, list[float]] = {}
    kept: list[tuple[int, list[float]]] = []
    blocks: list[tuple[int, str, dict[int, list[float]]]] = []
    mode, name = 0, ""
    for line in lines:
        key = line[:6].strip()
        if key == "2C":
            name = "nodes"
        elif line.startswith("    1PMODE"):
            mode = int(line.split()[1])
        elif line.startswith(" -4"):
            name = line.split()[1]
        elif line.startswith(" -1") and name:
            numbers = [_number(line[i : i + 12], path) for i in (13, 25, 37)]
            kept.append((int(line[3:13]), numbers))
        elif line.startswith(" -3"):
            if name == "nodes":
                nodes = dict(kept)
            elif name.startswith("DISP") and (mode or static):
                blocks.append((mode, name, dict(kept)))
            name, kept = "", []
    labels = [n for n in nodes if blocks and n in blocks[0][2]]
    if not labels or any(list(block) != labels for _, _, block in blocks):
        raise RunFailed("no_results", f"{path.name}: nodes are missing")
    return Fields(
        np.array(labels),
        np.array([nodes[n] for n in labels]),
        [(mode, name, np.array(list(block.values()))) for mode, name, block in blocks],
    )


def _number(text: str, path: Path) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RunFailed("no_results", f"{path.name}: '{text.strip()}' is not a number")
    return value


def _text(path: Path) -> str:
    if not path.exists() or not path.stat().st_size:
        raise RunFailed("no_results", f"CalculiX left no {path.name}")
    return path.read_text(encoding="utf-8", errors="replace")
