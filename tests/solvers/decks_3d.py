"""A small tyre of rubber as decks in three dimensions, and its section as an axisymmetric deck.

Its section is an arc from one bead to the other, one row of elements of eight nodes; revolved,
bricks of twenty. The example in cases/ring_3d is written by python -m tests.solvers.decks_3d DIR.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

C10, D1, DENSITY, PRESSURE = 4.5e6, 1e-8, 1100.0, 5e4  # Pa, 1/Pa, kg/m3, Pa
OPENING, THICKNESS, CENTRE, RADIUS = np.radians(200), 0.012, 0.26, 0.06  # rad, m
ALONG, SECTORS, CROWN = 6, 16, 2  # elements; half elements from the middle
MARKED = "{{ C10 }}"


def number(i: int, j: int) -> int:
    """Number of the node in row i (0 to 2) through the thickness, column j along the arc."""
    return 1000 * i + j + 1


def section() -> tuple[dict[int, tuple[float, float]], list[list[int]]]:
    """r and z of the nodes, and nodes of the elements, corners first."""
    nodes = {}
    for j in range(2 * ALONG + 1):
        angle = OPENING * (j / (2 * ALONG) - 0.5)
        for i in range(0, 3, 1 + j % 2):
            a = RADIUS + THICKNESS * (i / 2 - 0.5)
            nodes[number(i, j)] = float(CENTRE + a * np.cos(angle)), float(a * np.sin(angle))
    places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    return nodes, [[number(i, j + k) for i, k in places] for j in range(0, 2 * ALONG, 2)]


def rim() -> list[int]:
    """Nodes at both ends of the arc."""
    return [number(i, j) for i in range(3) for j in (0, 2 * ALONG)]


def rows(values: Iterable[object], length: int = 8) -> str:
    """Data lines."""
    texts = list(map(str, values))
    return "\n".join(", ".join(texts[i : i + length]) for i in range(0, len(texts), length)) + "\n"


def material(c10: str) -> str:
    """Text of the material and the section."""
    return (
        "*SOLID SECTION, ELSET=RUBBER, MATERIAL=RUBBER\n*MATERIAL, NAME=RUBBER\n"
        f"*HYPERELASTIC, NEO HOOKE\n{c10}, {D1}\n*DENSITY\n{DENSITY}\n"
    )


def axisymmetric(c10: float = C10, pressure: float = PRESSURE) -> str:
    """The twin, a section deck."""
    nodes, elements = section()
    return (
        "*NODE\n"
        + "".join(f"{n}, {r:.9g}, {z:.9g}\n" for n, (r, z) in nodes.items())
        + "9999, 0.0, 0.0\n*ELEMENT, TYPE=CGAX8R, ELSET=RUBBER\n"
        + "".join(rows([i, *each], 9) for i, each in enumerate(elements, start=1))
        + f"*NSET, NSET=RIM\n{rows(rim())}*SURFACE, NAME=CAVITY\nRUBBER, S4\n"
        + f"*RIGID BODY, REF NODE=9999, TIE NSET=RIM\n{material(repr(c10))}"
        + "*BOUNDARY\n9999, 1, 6\n*STEP, NLGEOM=YES\n*STATIC\n1.0, 1.0\n"
        + f"*DSLOAD\nCAVITY, P, {pressure}\n*END STEP\n"
    )


def revolved() -> tuple[
    dict[int, tuple[float, float, float]], list[list[int]], dict[str, list[int]]
]:
    """Nodes and bricks round the axle x, and node sets."""
    nodes, elements = section()
    corners = {n for each in elements for n in each[:4]}
    known = {
        (k, n): i
        for i, (k, n) in enumerate(
            ((k, n) for k in range(2 * SECTORS) for n in nodes if not k % 2 or n in corners),
            start=1,
        )
    }
    places = {}
    for (k, n), i in known.items():
        (r, z), turn = nodes[n], -np.pi * k / SECTORS
        places[i] = (z, float(r * np.cos(turn)), float(r * np.sin(turn)))
    bricks = []
    for k in range(0, 2 * SECTORS, 2):
        front, middle, behind = (
            {n: known.get((m % (2 * SECTORS), n), 0) for n in nodes} for m in (k, k + 1, k + 2)
        )
        for each in elements:
            four, sides = each[:4], each[4:]
            bricks.append(
                [
                    *(front[n] for n in four),
                    *(behind[n] for n in four),
                    *(front[n] for n in sides),
                    *(behind[n] for n in sides),
                    *(middle[n] for n in four),
                ]
            )
    crown = [number(2, ALONG + j) for j in range(-CROWN, CROWN + 1)]
    sets = {
        "RIM": [known[k, n] for k in range(2 * SECTORS) for n in rim() if (k, n) in known],
        "CROWN": [known[k, n] for k in range(0, 2 * SECTORS, 2) for n in crown],
    }
    return places, bricks, sets


def mesh() -> str:
    """Nodes, elements, sets."""
    places, bricks, sets = revolved()
    return (
        "*NODE\n"
        + "".join(f"{n}, {x:.9g}, {y:.9g}, {z:.9g}\n" for n, (x, y, z) in places.items())
        + "*ELEMENT, TYPE=C3D20R, ELSET=RUBBER\n"
        + "".join(
            f"{rows([i, *each[:10]], 11).rstrip()},\n{rows(each[10:], 10)}"
            for i, each in enumerate(bricks, start=1)
        )
        + "".join(f"*NSET, NSET={name}\n{rows(members)}" for name, members in sets.items())
    )


def inflate() -> str:
    """The first job, its mesh in a file of its own."""
    return (
        "** Nodes, bricks, and the sets RIM and CROWN.\n*INCLUDE, INPUT=mesh.inp\n"
        + material(MARKED)
        + "*BOUNDARY\nRIM, 1, 3\n*STEP, NLGEOM, INC=100\n*STATIC\n1.0, 1.0\n"
        + f"*RESTART, WRITE, FREQUENCY=1\n*DLOAD\nRUBBER, P6, {PRESSURE}\n*END STEP\n"
    )


def modes(calculix: bool = True) -> str:
    """The second, which goes on from it."""
    half = (
        "** Half of it: CalculiX counts the stiffness of a pressure twice in this step.\n"
        f"*DLOAD\nRUBBER, P6, {PRESSURE / 2}\n"
    )
    return (
        "*RESTART, READ, STEP=1\n*STEP, PERTURBATION\n*FREQUENCY\n10\n"
        + half * calculix
        + "*END STEP\n"
    )


CASE = f"""# A ring of rubber that stands in decks in three dimensions, made up: no tyre is like it.
# cases/own_deck.md says more.
format: 1
name: a ring of rubber
size: P235/75R17
pressure_kPa: {PRESSURE / 1e3}          # counts in place of the decks'

deck:
  decks: [inflate.inp, modes.inp]   # in the order in which they are run
  units: m
  crown: CROWN                # nodes round the tyre, whose shapes name the modes

variables:
  C10: {{sets: [deck.numbers.C10], start: {C10}, lower: 1e6, upper: 2e7}}

targets:
  source: made up, the bundled solver's modes of the ring's section with 4 MPa
  modes:
    - {{c: 0, m: 0, kind: axial, frequency_Hz: 111.694}}
    - {{c: 1, m: 1, frequency_Hz: 114.077}}
    - {{c: 2, m: 1, frequency_Hz: 121.744}}

solver:
  name: calculix
  time_limit_s: 100
"""
FILES = {"mesh.inp": mesh(), "inflate.inp": inflate(), "modes.inp": modes(), "ring.yaml": CASE}

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    for file, text in FILES.items():
        (folder / file).write_text(text, encoding="utf-8", newline="")
