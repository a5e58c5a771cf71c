"""Behaves as ``abaqus job=JOB [oldjob=JOB] interactive``: runs the bundled solver on the decks in
its folder and writes .fil, .dat, .sta and a log as ABAQUS would. STANDIN_FAULT makes it fail."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tyrecal_solvers.bundled import job as bundled
from tyrecal_solvers.language.text import Block, read_keywords

FAULT, _, AMOUNT = os.environ.get("STANDIN_FAULT", "").partition(":")
DENIED = "Abaqus Error: Abaqus/Standard license check out failed: FLEXnet error -4,132."
GRANTED = """Begin Analysis Input File Processor
Abaqus License Manager checked out the following licenses:
Abaqus/Standard checked out 5 tokens from Flexnet server nowhere.
<49 out of 54 licenses remain available>."""
DONE = " THE ANALYSIS HAS COMPLETED SUCCESSFULLY\n"
CUT = " THE ANALYSIS HAS NOT BEEN COMPLETED\n"
TURN = 0.7  # rad, by which every pair is turned: a 3-D solver leaves that to chance
SPLIT = 1e-6  # of a pair's eigenvalues: a 3-D mesh splits them


def main(arguments: list[str]) -> int:
    given = dict(word.partition("=")[::2] for word in arguments)
    job, oldjob = given["job"], given.get("oldjob")
    assert "interactive" in given
    if _is_denied():
        print(DENIED)
        return 1
    print(GRANTED, flush=True)
    if FAULT == "hang" and oldjob:
        time.sleep(600)
    if FAULT == "crash" and oldjob:
        Path(f"{job}.dat").write_text(" ***ERROR: ELEMENT 7 IS TOO ODD\n")
        Path(f"{job}.sta").write_text(CUT)
        print("Abaqus Error: the analysis exited with an error")
        return 1
    if FAULT == "diverge":
        Path(f"{job}.msg").write_text(" ***ERROR: TOO MANY ATTEMPTS MADE FOR THIS INCREMENT\n")
        return 1
    if FAULT == "nothing":
        return 0
    if oldjob is None:
        bundled.Deck({job: Path(f"{job}.inp").read_text()}, job, None).read([])
        Path(f"{job}.res").write_text("restart")
    else:
        assert Path(f"{oldjob}.res").exists(), "the old job left no restart file"
        _modes(job, oldjob)
    Path(f"{job}.sta").write_text(CUT if FAULT == "aborted" else DONE)
    print(f"Abaqus JOB {job} COMPLETED")
    return 0


def _is_denied() -> bool:
    if FAULT != "licence":
        return False
    counter = Path("denials")
    count = len(counter.read_text()) if counter.exists() else 0
    counter.write_text("x" * (count + 1))
    return count < float(AMOUNT)


def _modes(job: str, oldjob: str) -> None:
    deck = read_keywords(Path(f"{job}.inp").read_text())
    wanted = next(k for k in deck if k.name == "FREQUENCY").rows[0].integer(0)
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        for each in (job, oldjob):
            shutil.copy(f"{each}.inp", room)
        bundled.run(room, job, oldjob)
        step = json.loads((room / f"{job}.json").read_text())["steps"][-1]
        with np.load(room / f"{job}.npz") as arrays:
            known = dict(arrays)
    shapes = known[f"shapes_{step['step']}"]
    sectors = next(k for k in deck if k.name == "SYMMETRIC MODEL GENERATION").rows[-1].integer(1)
    angles = 2 * np.pi * np.arange(sectors) / sectors
    crown = _crown(read_keywords(Path(f"{oldjob}.inp").read_text()), known["nodes"])
    modes = []
    for mode, shape in zip(step["modes"], shapes, strict=True):
        for half in range(mode["multiplicity"]):
            phase = (TURN + half * np.pi / 2) if mode["n"] else 0.0
            u = (shape[crown] * np.exp(1j * (mode["n"] * angles[:, None, None] + phase))).real
            split = SPLIT * (half - 0.5) * (mode["n"] > 0)
            modes.append((mode["eigenvalue"] * (1 + split), _cartesian(u, angles)))
    modes = modes[: wanted - (FAULT == "few")]
    values = _spoilt([value for value, _ in modes])
    R, Z = known["points"][crown].T
    rest = np.stack([R, 0 * R, Z], -1)[None] * np.ones((sectors, 1, 1))
    text = fil(_cartesian(rest, angles), values, [u for _, u in modes])
    printed = [1.1 * value for value in values] if FAULT == "other_dat" else values
    table = dat(printed, step["mass_kg"])
    Path(f"{job}.dat").write_text(table.replace("TOTAL MASS", "") if FAULT == "no_mass" else table)
    if FAULT != "no_fil":
        _write_fil(Path(f"{job}.fil"), text)


def _write_fil(path: Path, text: str) -> None:
    if FAULT == "truncated":
        lines = text.splitlines()
        text = "\n".join(lines[: len(lines) // 2]) + "\n"
    elif FAULT == "disc_full":  # in the middle of a number
        text = text[: text.rindex("D-", 0, 2 * len(text) // 3)]
    elif FAULT == "doubled":
        text += text
    path.write_text(text)
    if FAULT == "stale":
        os.utime(path, (1e9, 1e9))


def _spoilt(values: list[float]) -> list[float]:
    if FAULT == "zeros":
        return [0.0] * len(values)
    if FAULT == "nan":
        return [math.nan, *values[1:]]
    return [-values[0], *values[1:]] if FAULT == "negative" else values


def _crown(section: list[Block], nodes: np.ndarray) -> list[int]:
    members = [
        int(text)
        for k in section
        if k.name == "NSET" and k.get("NSET") == "CROWN"
        for row in k.rows
        for text in row.fields
        if text
    ]
    place = {int(node): i for i, node in enumerate(nodes)}
    return [place[node] for node in members]


def _cartesian(u: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(r, theta, z) at (sector, node) to x, y, z, the section turned about +y: (sectors * k, 3)."""
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    r, theta, z = np.moveaxis(u, -1, 0)
    return np.stack([r * cos - theta * sin, z, -r * sin - theta * cos], -1).reshape(-1, 3)


def fil(points: np.ndarray, values: list[float], shapes: list[np.ndarray]) -> str:
    records: list[list[object]] = [[1921, "6.14-1  ", "21-Nov-2", "026     ", 1, len(points), 0.01]]
    records += [[1901, i, *map(float, p)] for i, p in enumerate(points, start=1)]
    records.append([2000, 1.0, 1.0, 0.0, 0.0, 41, 3, 1, 1, 0.0, 0.0, 1.0, *["modes   "] * 10])
    for number, (value, u) in enumerate(zip(values, shapes, strict=True), start=1):
        records.append([1980, number, value, 1.0, 0.0, *[0.0] * 12])
        records.append([1911, 1, "CROWN   ", "        "])
        records += [[101, i, *map(float, v)] for i, v in enumerate(u, start=1)]
        records += [[107, i, *map(float, p)] for i, p in enumerate(points, start=1)]
    data = "".join(_record(items) for items in records) + "*I 12I 42001"
    data = data.ljust(-(-len(data) // 80) * 80) + " " * 80
    return "".join(data[i : i + 80] + "\n" for i in range(0, len(data), 80))


def _record(items: list[object]) -> str:
    return "*" + "".join(_items([len(items) + 1, *items]))


def _items(items: list[object]) -> Iterator[str]:
    for item in items:
        if isinstance(item, str):
            yield "A" + item
        elif isinstance(item, int):
            yield f"I{len(str(item)):2d}{item}"
        else:
            yield "D" + re.sub("E", "D", f"{item:22.15E}")


def dat(values: list[float], mass: float) -> str:
    lines = [
        f"\n   TOTAL MASS OF MODEL\n      {mass:.6E}\n",
        "                 E I G E N V A L U E    O U T P U T\n",
        " MODE NO      EIGENVALUE              FREQUENCY         GENERALIZED MASS"
        "   COMPOSITE MODAL DAMPING",
        "                             (RAD/TIME)   (CYCLES/TIME)\n\n",
    ]
    for number, value in enumerate(values, start=1):
        omega = math.sqrt(max(value, 0.0))
        row = (value, omega, omega / (2 * math.pi), 1.0, 0.0)
        lines.append(f"{number:8d}" + "".join(f"{x:16.5G}" for x in row))
    lines.append("\n     P A R T I C I P A T I O N   F A C T O R S\n")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
