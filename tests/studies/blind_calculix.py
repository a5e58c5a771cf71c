"""CalculiX for the blind trials: an emulator of what it says, trained and confirmed by its own runs.

    python tests/studies/blind_calculix.py train 60      # runs CalculiX, goes on where it stopped
    python tests/studies/blind_calculix.py confirm 30    # runs with effects, by the makers' laws
    python tests/studies/blind_calculix.py table > table.md

    ln f_CalculiX = ln f_common + sum_k a_k q_k(x, p)

f_common: the bundled solver on the common problem (`calculix.common`) with the same mesh, which is
not the one that the diagnosis uses; q_k: monomials up to the second degree in the logarithms of
the design variables and of the pressure. Effects enter by f_common alone, the difference being
smooth and small. One line of JSON a run in RECORD.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from tyrecal.case import LoadedCase, load_case, start_values, with_values
from tyrecal.deck.calculix import PLY_THICKNESS_M
from tyrecal.evaluate.failure import EvaluationFailed

from .calculix import common, modes_of, split

Array = np.ndarray
ROOT = Path(__file__).parents[2]
RECORD = Path(__file__).parents[1] / "benchmarks" / "blind_calculix.jsonl"
ELEMENTS = {"crown": 10, "upper_sidewall": 9, "lower_sidewall": 9, "bead": 2}  # not the default
BOX = 0.38  # of ln of each variable: 40 %, and what a constant is worth
PRESSURES_kPa = (157.0, 323.0)


def meshed(case: LoadedCase) -> LoadedCase:
    """The case with the maker's own mesh."""
    level = case.case.mesh.levels["default"].model_copy(update={"elements": ELEMENTS})
    mesh = case.case.mesh.model_copy(update={"levels": {"default": level}, "level": "default"})
    return replace(case, case=case.case.model_copy(update={"mesh": mesh}))


def base() -> LoadedCase:
    """The tyre of the trials."""
    return meshed(load_case(ROOT / "cases" / "p235_75r17.yaml"))


def training(count: int) -> list[dict[str, float]]:
    """Designs and pressures, a Halton sequence: the first ones stay when more are wanted."""
    start = start_values(base())
    points = qmc.Halton(4, seed=5).random(count)
    low, high = PRESSURES_kPa
    return [
        {
            **{n: v * float(np.exp(BOX * (2 * u - 1))) for (n, v), u in zip(start.items(), p[:3], strict=True)},
            "pressure_kPa": float(low + (high - low) * p[3]),
        }
        for p in points
    ]  # fmt: skip


def common_problem(case: LoadedCase) -> dict[str, float]:
    """ln f by label, bundled solver on the common problem. Raises EvaluationFailed."""
    with common():
        modes = modes_of(split(case, PLY_THICKNESS_M), "bundled")
    return {key: float(np.log(mode.frequency_Hz)) for key, mode in modes.items()}


def calculix(case: LoadedCase) -> dict[str, float]:
    """ln f by label, CalculiX itself. Raises EvaluationFailed."""
    return {key: float(np.log(m.frequency_Hz)) for key, m in modes_of(case, "calculix").items()}


def run(case: LoadedCase, about: Mapping[str, Any]) -> None:
    """One run of both solvers on record."""
    try:
        entry = {**about, "calculix": calculix(case), "common": common_problem(case)}
    except EvaluationFailed as failure:
        entry = {**about, "failed": str(failure)}
    with RECORD.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")
    print(entry.get("failed") or entry["about"], flush=True)


def recorded(kind: str) -> list[dict[str, Any]]:
    """Runs on record of a kind, in the order in which they were made."""
    if not RECORD.exists():
        return []
    entries = [json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines()]
    return [entry for entry in entries if entry["about"] == kind]


def train(count: int) -> None:
    """Make the runs that are not on record."""
    known = [entry["values"] for entry in recorded("train")]
    for values in training(count):
        if values not in known:
            run(with_values(base(), values), {"about": "train", "values": values})


def main() -> None:
    if sys.argv[1] == "train":
        train(int(sys.argv[2]))


if __name__ == "__main__":
    main()
