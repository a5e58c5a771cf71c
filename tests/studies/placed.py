"""Sensors that `measured sensors CASE --place N` places: are labels given as often as it states?

    python -m tests.studies.placed [tests] [seed]

Triaxial sensors on three tyres (`rings.TYRES`) for the modes [c,0] and [c,1] below 170 Hz. Each
drawn test is a universal file of shapes, one mode of each doublet at any angle, with 5 % noise and
sensors 2 mm off their places, which `measured import` labels without a case.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.measured.test_universal import units, write
from tests.studies.rings import TYRES, tyre_modes
from tyrecal.measured.case_modes import CaseModes
from tyrecal.measured.gather import gather
from tyrecal.measured.modal import Layout
from tyrecal.measured.placement import at_places
from tyrecal.simulate.modes.label import Mode
from tyrecal.studies.sensors import SensorsResult, place

Array = np.ndarray
COUNTS, EDGE_Hz, NOISE, OFF_m = (3, 4, 6, 8), 170.0, 0.05, 0.002


def imported_share(
    case: CaseModes,
    modes: Sequence[Mode],
    placed: SensorsResult,
    random: np.random.Generator,
    folder: Path,
) -> float:
    """Share of the modes that the import of one drawn test labels right."""
    noted = np.array([[p.radius_m, np.radians(p.angle_deg), p.z_m] for p in placed.places])
    R, angle, Z = noted.T
    off = OFF_m * random.standard_normal(noted.shape) / [1.0, R.max(), 1.0]
    sensors, numbers = at_places(noted + off, "rtz"), np.arange(1, len(noted) + 1)
    zero = 0 * numbers
    nodes = {"type": 2411, "node_nums": numbers, "x": R * np.sin(angle), "y": Z}
    nodes |= {"z": R * np.cos(angle), "def_cs": zero, "disp_cs": zero, "color": zero + 1}
    sets = []
    for number, mode in enumerate(modes, 1):
        both = case.signals(mode, sensors)
        u = both @ random.standard_normal(both.shape[1])
        u += NOISE * np.sqrt(np.mean(u**2)) * random.standard_normal(len(u))
        own = {"type": 55, "model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8}
        own |= {"load_case": 1, "mode_n": number, "freq": mode.frequency_Hz, "modal_damp_his": 0.04}
        parts = {f"r{k + 1}": u.reshape(-1, 3)[:, k] for k in range(3)}
        sets.append(own | {"node_nums": numbers} | parts)
    file = write(folder / "test.uff", units(), nodes, *sets)
    highest = 1 + max(mode.label.c for mode in modes)
    layout = Layout("y", directions="cylindrical", highest=highest)
    (run,) = gather([file], 240.0, layout, assumed=0.01).runs
    labels = {round(each.mode.frequency_Hz, 1): each.judged.label for each in run.modes}
    return float(np.mean([labels[round(m.frequency_Hz, 1)] == m.label for m in modes]))


def main(tests: int = 200, seed: int = 1) -> None:
    """Print a line for each tyre and number of sensors."""
    random = np.random.default_rng(seed)
    print("tyre | sensors | stated | imported | standard errors apart", flush=True)
    for tyre in TYRES:
        case = CaseModes(tyre_modes(tyre))
        modes = [m for m in case.modes if m.label.m < 2 and m.frequency_Hz < EDGE_Hz]
        for count in COUNTS:
            placed = place(case, modes, count, "rtz", 0.005, seed)
            with TemporaryDirectory() as folder:
                own = (case, modes, placed, random, Path(folder))
                shares = [imported_share(*own) for _ in range(tests)]
            error = max(np.hypot(np.std(shares) / tests**0.5, placed.labelled_error), 1e-6)
            apart = (np.mean(shares) - placed.labelled) / error
            name = tyre.removesuffix(".yaml")
            print(
                f"{name} | {count} | {placed.labelled:.1%} | {np.mean(shares):.1%} | {apart:+.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
