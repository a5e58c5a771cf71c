"""Static stiffnesses of the 205/60R15 over those of two published parameter sets of this size.

The tyre is that of `tyrecal fit cases/205_60r15.yaml --mesh coarse --fix A_belt`, at 220 kPa.
Set A: Pacejka, Tire and Vehicle Dynamics, App. 3; set B: TNO_car205_60R15.tir, an example of
MF-Tyre/MF-Swift 6.2 (TNO, 2013). By MF-Swift's formulas, dp = p/220 kPa - 1, df = F_z/4 kN - 1:

    C_y = C_y0 (1 + p_cfy1 df) (1 + p_cfy3 dp), C_x alike, C_psi = C_psi0

The ratios are those to set A.

    python -m tests.studies.stiffness coarse 2000,4000,6000
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from math import radians

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.stiffness import StiffnessRow, run
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES

FITTED = {"A_belt": 2.118683e-7, "A_carcass": 7.998e-7, "C10": 1.868e6}
# of set A at 220 kPa and 4 kN, N/m and N m/rad, and their relative growth with load and pressure
PUBLISHED = {
    "vertical_N_per_m": (209651.0, 0.114, 0.627),  # of the tangent
    "lateral_N_per_m": (102673.0, 0.16365, 0.24993),
    "longitudinal_N_per_m": (358066.0, 0.27504, 0.0),
    "torsional_Nm_per_rad": (4793.0, 0.0, 0.0),
}
SET_B = {  # its mass, vertical stiffness and patch are set A's
    **PUBLISHED,
    "lateral_N_per_m": (157632.5, 0.16365, 0.24993),
    "longitudinal_N_per_m": (381913.4, 0.18677, 0.0),
    "torsional_Nm_per_rad": (5000.0, 0.0, 0.0),
}


def published(
    load_N: float,
    pressure_kPa: float = 220.0,
    known: Mapping[str, tuple[float, float, float]] = PUBLISHED,
) -> dict[str, float]:
    """A set's stiffnesses at a load and a pressure."""
    df, dp = load_N / 4e3 - 1, pressure_kPa / 220 - 1
    return {name: C * (1 + a * df) * (1 + b * dp) for name, (C, a, b) in known.items()}


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
