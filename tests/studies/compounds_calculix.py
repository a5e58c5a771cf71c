"""A tyre of six compounds, each of another law, in the bundled solver and in CalculiX.

    python -m tests.studies.compounds_calculix [RECORD] > table.md

The common problem is that of `calculix`, which says how it is made and what RECORD is; the case's
rubbers have their *HYPERELASTIC line and numbers replaced in both solvers' decks.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.studies.calculix import Row, compare, rewritten
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.parts import Solid
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

ROOT = Path(__file__).parents[2]
PRESSURES = (160.0, 240.0, 320.0)  # kPa
# name: law, constants, density in kg/m3; a D of 1 stands for a term that is not there. More curved
# than rubber is: at the few per cent of strain of an inflated tyre all laws are else neo-Hooke's.
LAWS = {
    "skim": ("ARRUDA-BOYCE", "8.E5, 1.02, 5.E-8", 1130.0),
    "tread": ("YEOH", "6.E5, 2.E7, 1.E9, 6.E-8, 1., 1.", 1150.0),
    "sidewall": ("POLYNOMIAL, N=2", "3.E5, 1.E5, 1.E7, 5.E6, 5.E6, 1.E-7, 1.", 1110.0),
    "filler": ("OGDEN, N=2", "1.E6, 25., 1.E6, -15., 4.E-8, 1.", 1200.0),
    "rim_strip": ("NEO HOOKE", "1.5E6, 4.E-8", 1160.0),
    "liner": ("MOONEY-RIVLIN", "3.E5, 1.E5, 1.E-7", 1120.0),
}
PLACES: list[dict[str, Any]] = [  # later ones override earlier ones
    {"material": "skim"},
    {"material": "sidewall", "regions": ["upper_sidewall"]},
    {"material": "filler", "regions": ["lower_sidewall"]},
    {"material": "rim_strip", "regions": ["bead"]},
    {"material": "liner", "between": ["inner", "ply"]},
    {"material": "tread", "regions": ["crown"], "between": ["belt2", "outer"]},
]


def compounded(pressure: float, level: str) -> LoadedCase:
    """The shipped tyre with its rubber dealt out, and bead rubber of another law for each."""
    loaded = load_case(ROOT / "cases" / "p235_75r17.yaml")
    loaded = with_values(loaded, {"pressure_kPa": pressure})
    case = loaded.case
    rubber = case.materials["rubber"]
    materials = {name: own for name, own in case.materials.items() if name != "rubber"}
    for name, (_, _, density) in LAWS.items():
        own = {"density_kg_per_m3": density, "prony": []}
        materials[name] = rubber.model_copy(update=own)
    solids = [Solid(**place) for place in PLACES]
    mesh = case.mesh.model_copy(update={"level": level})
    update = {"materials": materials, "solids": solids, "mesh": mesh, "variables": {}}
    return replace(loaded, case=case.model_copy(update=update))


def lawed(text: str) -> str:
    """A deck with each compound's own law."""
    for name, (law, numbers, _) in LAWS.items():
        text = re.sub(
            rf"(\*MATERIAL, NAME={name}\n\*HYPERELASTIC, )MOONEY-RIVLIN([^\n]*)\n[^\n]*\n",
            rf"\g<1>{law}\2\n{numbers}\n",
            text,
            flags=re.IGNORECASE,
        )
    return text


def main(store: Store | None, level: str = "default") -> None:
    every: list[Row] = []
    print("| kPa | mode | CalculiX, Hz | common problem | MAC | as shipped |\n" + 6 * "|---" + "|")
    with rewritten(lawed):
        for pressure in PRESSURES:
            try:
                rows = compare(compounded(pressure, level), store)
            except EvaluationFailed as failure:
                print(f"| {pressure:g} | {failure} | | | | |", flush=True)
                continue
            for r in rows:
                print(
                    f"| {pressure:g} | {r.mode} | {r.frequency_Hz:.3f} | {r.common:+.3f} %", end=""
                )
                print(f" | {r.mac:.5f} | {r.shipped:+.2f} % |", flush=True)
            every += rows
    print(
        f"\n{len(every)} modes; largest deviation from the common problem"
        f" {max(abs(r.common) for r in every):.3f} %, smallest MAC {min(r.mac for r in every):.5f}"
    )


if __name__ == "__main__":
    main(Store(Path(sys.argv[1])) if len(sys.argv) > 1 else None)
