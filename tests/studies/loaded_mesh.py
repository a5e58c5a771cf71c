"""Frequencies under a load against finer meshes round the tyre, of the case's section.

    python -m tests.studies.loaded_mesh LEVEL LOADS_N

The main case, initial variables, at LOADS_N (as in 1000,4000): how far the modes are from those
with waves to 12 beyond elements to 69 degrees, ``far`` on the same mesh near the patch, ``all``
with its elements halved to 25 degrees; of the patch that sticks and of the one that slides.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from unittest import mock

import numpy as np
from tyrecal_solvers.bundled.road import footprint_job
from tyrecal_solvers.bundled.solid3d.circumference import half_circle, waves_beyond

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.loaded import LoadedTyre, load_tyres
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES

BEYOND = [4.0] * 6 + [5.0] * 4  # from 25 degrees on
FINER = {
    "far": [4.0, 4.0, 4.0, 5.0, 4.0, 4.0, *BEYOND],
    "all": [2.0] * 6 + [2.5, 2.5, 4.0, 4.0, *BEYOND],
}
WAVES = 12
Table = dict[tuple[float, Member], tuple[float, float]]  # sticks, slides, Hz


def frequencies(case: LoadedCase, loads_N: list[float], finer: str = "") -> Table:
    """Frequencies of every named mode at every load, on the case's own mesh or on one of
    `FINER`."""
    around = lambda lengths: (
        half_circle(np.radians(FINER[finer]), WAVES) if finer else waves_beyond(lengths)
    )
    with mock.patch.object(footprint_job, "waves_beyond", around):
        tyre = load_tyres(case, Evaluator(TyreDesign(case)), {"initial": {}}, loads_N)["initial"]
    if not isinstance(tyre, LoadedTyre):
        raise tyre
    assert not tyre.failed, tyre.failed
    return {
        (each.load_N, mode.member): (mode.frequency_Hz, mode.sliding_Hz or np.nan)
        for each in tyre.loads
        for mode in each.modes
    }


def main(level: str, loads_N: list[float]) -> None:
    """Print all, and the worst."""
    case = with_level(load_case(CASES / "p235_75r17.yaml"), level)
    tables = {}
    for name in ("", *FINER):
        began = time.process_time()
        tables[name] = frequencies(case, loads_N, name)
        print(f"{name or 'own'}: {time.process_time() - began:.0f} s", flush=True)
    own = tables.pop("")
    for name, finer in tables.items():
        off = {key: 1e4 * (np.array(own[key]) / finer[key] - 1) for key in own}
        print(f"\n{name}: off by 1e-4 of itself, sticks and slides")
        for (load, member), (sticks, slides) in off.items():
            print(f"{load:6.0f} N {member.label!s:15} {member.symmetry:13}", end=" ")
            print(f"{sticks:+6.2f} {slides:+6.2f}")
        for load in loads_N:
            worst = np.nanmax([abs(v) for (at, _), v in off.items() if at == load], axis=0)
            print(f"{load:6.0f} N, worst: {worst[0]:.2f} {worst[1]:.2f}")


if __name__ == "__main__":
    main(sys.argv[1], [float(each) for each in sys.argv[2].split(",")])
