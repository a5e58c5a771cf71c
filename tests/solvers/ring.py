"""A ring of rubber in plane strain, inflated: the smallest decks that CalculiX's runner takes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

SECTORS = 60
# corners, then middles of the edges, of a C3D20R in (r, theta, z) from 0 to 2
PLACES = "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021"


def sector(C10: float = 1e8, inner: float = 0.30, outer: float = 0.315, width: float = 0.02) -> str:
    """Sector with one element through the thickness; m, Pa."""
    lines = ["*NODE, NSET=EVERY"]
    for number, place in enumerate(PLACES.split(), start=1):
        a, b, c = (int(digit) / 2 for digit in place)
        r, angle = inner + a * (outer - inner), (b - 1) * 2 * np.pi / SECTORS
        xyz = (r * np.cos(angle), r * np.sin(angle), c * width)
        lines.append(f"{number}, " + ", ".join(f"{x:.12f}" for x in xyz))
    sides = {
        name: ", ".join(str(i) for i, p in enumerate(PLACES.split(), start=1) if p[1] == theta)
        for name, theta in (("SECTION", "2"), ("BEHIND", "0"))
    }
    free = ", ".join(str(i) for i, p in enumerate(PLACES.split(), start=1) if p[1] != "0")
    return (
        "\n".join(lines)
        + f"""
*ELEMENT, TYPE=C3D20R, ELSET=EVERYTHING
1, {", ".join(map(str, range(1, 16)))},
16, 17, 18, 19, 20
*SOLID SECTION, ELSET=EVERYTHING, MATERIAL=RUBBER
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
{C10:g}, 5.085e-10
*DENSITY
1100.0
*ELSET, ELSET=CAVITY
1
*NSET, NSET=SECTION
{sides["SECTION"]}
*NSET, NSET=BEHIND
{sides["BEHIND"]}
*NSET, NSET=FREE
{free}
*SURFACE, NAME=FRONT, TYPE=NODE
SECTION
*SURFACE, NAME=BACK, TYPE=NODE
BEHIND
*TIE, NAME=SECTORS, CYCLIC SYMMETRY, POSITION TOLERANCE=1e-6
BACK, FRONT
*CYCLIC SYMMETRY MODEL, N={SECTORS}, TIE=SECTORS
0.0, 0.0, 0.0, 0.0, 0.0, 1.0
*BOUNDARY
FREE, 3, 3
"""
    )


INFLATE = """*INCLUDE, INPUT=sector.inp
*STEP, NLGEOM, INC=1000
*RESTART, WRITE, OVERLAY, FREQUENCY=1
*STATIC
0.5, 1.0
*BOUNDARY
20, 2, 2
*DLOAD
CAVITY, P6, 240000
*NODE FILE, NSET=SECTION, FREQUENCY=1000
U
*EL PRINT, ELSET=EVERYTHING, TOTALS=ONLY, FREQUENCY=1000
EMAS
*END STEP
"""
MODES = """*RESTART, READ, STEP=1
*STEP, PERTURBATION
*FREQUENCY
2
*SELECT CYCLIC SYMMETRY MODES, NMIN=2, NMAX=2
*BOUNDARY, OP=NEW
FREE, 3, 3
*DLOAD
CAVITY, P6, 120000
*NODE FILE, NSET=SECTION
U
*END STEP
"""


def write_ring(folder: Path, **changed: str) -> Path:
    """The ring's decks in a new ``folder``; ``sector``, ``inflate``, ``modes_2`` replace one."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in {"sector": sector(), "inflate": INFLATE, "modes_2": MODES, **changed}.items():
        (folder / f"{name}.inp").write_text(text)
    (folder / "calculix.json").write_text('{"parallel": 1}')
    return folder
