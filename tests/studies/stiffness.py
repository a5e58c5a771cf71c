"""Static stiffnesses of the 205/60R15 over those of two published parameter sets of this size.

The tyre is that of `tyrecal fit cases/205_60r15.yaml --mesh coarse --fix A_belt`, at 220 kPa. The
first set (C_x0, p_cfx1 and so on of an MF-Swift file) has stiffnesses over the load; of both the
ratios at 4 kN are known: C_x/C_z 1.71 and 1.82, C_y/C_z .49 and .75, C_psi 84 and 87 Nm/deg.

    python -m tests.studies.stiffness coarse 2000,4000,6000
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import radians

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.stiffness import StiffnessRow, run
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES

FITTED = {"A_belt": 2.118683e-7, "A_carcass": 7.998e-7, "C10": 1.868e6}
# of the first set at 4 kN, N/m and N m/rad, and their growth: d ln C / d (load / 4 kN)
PUBLISHED = {
    "vertical_N_per_m": (209651.0, 0.114),
    "lateral_N_per_m": (102673.0, 0.164),
    "longitudinal_N_per_m": (358066.0, 0.275),
    "torsional_Nm_per_rad": (4793.0, 0.0),
}


def published(load_N: float) -> dict[str, float]:
    """The first set's stiffnesses at a load."""
    return {name: C * (1 + rise * (load_N / 4e3 - 1)) for name, (C, rise) in PUBLISHED.items()}


def stiffnesses(level: str, loads_N: Sequence[float]) -> list[StiffnessRow]:
    """Rows of the fitted tyre on a mesh."""
    case = with_level(load_case(CASES / "205_60r15.yaml"), level)
    return run(case, Evaluator(TyreDesign(case)), {"fitted": FITTED}, loads_N, [220.0]).rows


def main(level: str = "coarse", loads: str = "2000,4000,6000") -> None:
    """Print each stiffness, and its ratio to the published one."""
    for row in stiffnesses(level, [float(load) for load in loads.split(",")]):
        cells = []
        for name, theirs in published(row.load_N).items():
            ours = getattr(row, name)
            unit = radians(1) if name.endswith("rad") else 1e-3
            cells.append(f"{name.split('_')[0]} {unit * ours:.1f} ({ours / theirs:.2f})")
        print(f"{row.load_N:g} N: {', '.join(cells)}; rolling {1e3 * row.rolling_radius_m:.1f} mm")


if __name__ == "__main__":
    main(*sys.argv[1:])
