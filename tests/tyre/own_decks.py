"""A small tyre written as an ABAQUS deck in the styles of people and pre-processors.

Its section is a ring from one bead to the other, two rows of elements thick, nodes on circles.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

CENTRE, INNER, OUTER, OPENING = 0.24, 0.085, 0.097, np.radians(120)
COLUMNS, ROWS = 24, 4  # half elements along and through: twelve by two elements of eight nodes
BELT = (8, 16)  # columns of the belt's ends
RIM = 2  # columns at each end that the rim holds
Row = tuple[int | float | str, ...]

MATERIALS = """*MATERIAL, NAME=RUBBER
*HYPERELASTIC, MOONEY-RIVLIN, MODULI=LONG TERM
{C10}, {C01}, {D1}
*VISCOELASTIC, TIME=PRONY
0.3, 0.0, 0.1
*DENSITY
{rho}
*MATERIAL, NAME=CORD
*ELASTIC
{E}, 0.3
*DENSITY
{cord}
"""
SI = {"C10": 8e5, "C01": 2e5, "D1": 5e-8, "rho": 1100.0, "E": 1e10, "cord": 1500.0}
MM = {"C10": 0.8, "C01": 0.2, "D1": 0.05, "rho": 1.1e-9, "E": 1e4, "cord": 1.5e-9}


def number(i: int, j: int) -> int:
    """Number of the node in row i from the inner surface and column j from the bead at -z."""
    return 1000 * (i + 1) + j + 1


def point(i: int, j: int) -> tuple[float, float]:
    """r, z of it."""
    angle = OPENING * (2 * j / COLUMNS - 1)
    a = INNER + (OUTER - INNER) * i / ROWS
    return float(CENTRE + a * np.cos(angle)), float(a * np.sin(angle))


def block(keyword: str, rows: list[Row]) -> str:
    """A keyword with data lines."""
    return "\n".join([keyword, *(", ".join(map(str, row)) for row in rows)]) + "\n"


@dataclass
class Tyre:
    """The tyre's tables, and texts of its parts."""

    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)
    solids: dict[int, list[int]] = field(default_factory=dict)
    plies: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    ply_row: int = 2

    def __post_init__(self) -> None:
        for j in range(COLUMNS + 1):
            for i in range(ROWS + 1):
                if not (i % 2 and j % 2):
                    self.nodes[number(i, j)] = point(i, j)
        for j in range(0, COLUMNS, 2):
            for i in range(0, ROWS, 2):
                corners = [(i, j), (i + 2, j), (i + 2, j + 2), (i, j + 2)]
                corners += [(i + 1, j), (i + 2, j + 1), (i + 1, j + 2), (i, j + 1)]
                self.solids[100 * i // 2 + j // 2 + 1] = [number(*c) for c in corners]
        line = lambda j: [number(self.ply_row, j + k) for k in range(3)]
        self.plies["CARCASS"] = {1001 + j // 2: line(j) for j in range(0, COLUMNS, 2)}
        self.plies["BELT"] = {2001 + j // 2: line(j) for j in range(*BELT, 2)}

    @property
    def rim(self) -> list[int]:
        ends = [*range(RIM + 1), *range(COLUMNS - RIM, COLUMNS + 1)]
        return [n for j in ends for i in range(ROWS + 1) if (n := number(i, j)) in self.nodes]

    @property
    def inside(self) -> list[int]:
        return [n for n in self.solids if n < 100]

    def mesh(self) -> str:
        return (
            block("*NODE, NSET=ALL", [(n, *map(repr, p)) for n, p in self.nodes.items()])
            + block("*NODE", [(900001, 0.0, 0.0)])
            + block("*ELEMENT, TYPE=CGAX8R, ELSET=SOLID", [(n, *e) for n, e in self.solids.items()])
            + "".join(
                block(f"*ELEMENT, TYPE=SFMGAX2, ELSET={name}", [(n, *e) for n, e in own.items()])
                for name, own in self.plies.items()
            )
            + block("*NSET, NSET=RIM", [(n,) for n in self.rim])
            + block("*ELSET, ELSET=LINER", [(n,) for n in self.inside])
            + "*SURFACE, NAME=CAVITY, TYPE=ELEMENT\nLINER, S4\n"
            + "*RIGID BODY, REF NODE=900001, TIE NSET=RIM\n"
        )


SECTIONS = """*SOLID SECTION, ELSET=SOLID, MATERIAL=RUBBER
*SURFACE SECTION, ELSET=CARCASS
*REBAR LAYER
CARCASS, 4.2E-07, 0.001, 0.0, CORD, 0.0
*SURFACE SECTION, ELSET=BELT
*REBAR LAYER
BELT_1, 2.1e-7, 1.16e-3, 0.0, CORD, 70.0
BELT_2, 2.1e-7, 1.16e-3, 0.0, CORD, 110.0
"""
STEP = """*STEP, NAME=INFLATE, NLGEOM=YES
*STATIC, LONG TERM
0.1, 1.0
*BOUNDARY
900001, 1, 6
*DSLOAD
CAVITY, P, 2.0E+05
*END STEP
"""


def plain(mesh: str = "", sections: str = SECTIONS, materials: str = "", step: str = STEP) -> str:
    """The reference: everything written out."""
    materials = materials or MATERIALS.format(**SI)
    return "*HEADING\na tyre\n" + (mesh or Tyre().mesh()) + sections + materials + step


def cae() -> str:
    """ABAQUS/CAE: a part, its instance, an assembly, internal sets, many requests for output."""
    tyre = Tyre()
    mesh = (
        block("*Node", [(n, *map(repr, p)) for n, p in tyre.nodes.items()])
        + block("*Element, type=CGAX8R", [(n, *e) for n, e in tyre.solids.items()])
        + block(
            "*Element, type=SFMGAX2", [(n, *e) for p in tyre.plies.values() for n, e in p.items()]
        )
        + "*Elset, elset=_PickedSet2, internal, generate\n1, 12, 1\n101, 112, 1\n"
        + "*Elset, elset=Carcass, generate\n1001, 1012, 1\n"
        "*Elset, elset=Belt, generate\n2005, 2008, 1\n"
        + block(
            "*Nset, nset=Rim", [tuple(tyre.rim[k : k + 16]) for k in range(0, len(tyre.rim), 16)]
        )
        + "** Section: Section-1\n"
        + SECTIONS.replace("ELSET=SOLID", "elset=_PickedSet2").replace(
            "MATERIAL=RUBBER", 'material="Rubber"'
        )
    )
    return (
        "*Heading\n** Job name: Job-1 Model name: Model-1\n"
        "*Preprint, echo=NO, model=NO, history=NO, contact=NO\n**\n** PARTS\n**\n"
        f"*Part, name=Part-1\n{mesh}*End Part\n**\n** ASSEMBLY\n**\n*Assembly, name=Assembly\n**\n"
        "*Instance, name=Part-1-1, part=Part-1\n*End Instance\n**\n"
        "*Node\n      1,           0.,           0.,           0.\n"
        "*Nset, nset=_PickedSet5, internal\n 1,\n"
        "*Elset, elset=_Surf-1_S4, internal, instance=Part-1-1, generate\n  1,  12,   1\n"
        "*Surface, type=ELEMENT, name=Surf-1\n_Surf-1_S4, S4\n"
        "** Constraint: Rim\n*Rigid Body, ref node=_PickedSet5, tie nset=Part-1-1.Rim\n"
        "*End Assembly\n"
        + MATERIALS.format(**SI).replace("NAME=RUBBER", "name=Rubber")
        + "** STEP: Step-1\n*Step, name=Step-1, nlgeom=YES\n"
        "*Static, long term\n0.1, 1., 1e-05, 1.\n"
        "*Boundary\n_PickedSet5, ENCASTRE\n*Dsload\nSurf-1, P, 200000.\n"
        "*Restart, write, frequency=0\n*Output, field, variable=PRESELECT\n"
        "*Output, history, variable=PRESELECT\n*End Step\n"
        "*Step, name=Step-2\n*Frequency, eigensolver=Lanczos\n20, , , , ,\n*End Step\n"
    )


def generated() -> str:
    """By hand: circles by *NGEN, the rest by *NFILL, elements by *ELGEN."""
    mesh = "*NODE\n"
    for i in (0, ROWS):
        for j in (0, COLUMNS // 2, COLUMNS):
            r, z = point(i, j)
            mesh += f"{number(i, j)}, {r!r}, {z!r}\n"
    mesh += f"900001, 0, 0\n900002, {CENTRE}, 0.\n"
    for name, i in (("IN", 0), ("OUT", ROWS)):
        mesh += f"*NGEN, NSET={name}, LINE=C\n"
        for a, b in ((0, COLUMNS // 2), (COLUMNS // 2, COLUMNS)):
            mesh += f"{number(i, a)}, {number(i, b)}, 1, 900002\n"
    mesh += f"*NFILL, NSET=ALL\nIN, OUT, {ROWS}, 1000\n"
    first = ", ".join(map(str, Tyre().solids[1]))
    mesh += f"*ELEMENT, TYPE=CGAX8R\n1, {first}\n*ELGEN, ELSET=SOLID\n1, 12, 2, 1, 2, 2000, 100\n"
    for name, own, count in (("CARCASS", 1001, 12), ("BELT", 2005, 4)):
        line = ", ".join(map(str, Tyre().plies[name][own]))
        mesh += f"*ELEMENT, TYPE=SFMGAX2\n{own}, {line}\n*ELGEN, ELSET={name}\n{own}, {count}, 2\n"
    mesh += "*NSET, NSET=RIM, GENERATE\n"
    for i in range(ROWS + 1):
        mesh += f"{number(i, 0)}, {number(i, RIM)}, 1\n"
        mesh += f"{number(i, COLUMNS - RIM)}, {number(i, COLUMNS)}, 1\n"
    mesh += "*ELSET, ELSET=LINER, GENERATE\n1, 12\n*SURFACE, NAME=CAVITY\nLINER, S4\n"
    return plain(mesh + "*RIGID BODY, REF NODE=900001, TIE NSET=RIM\n")


def half(whole: Tyre | None = None, more: str = "") -> str:
    """The half of positive z, reflected."""
    tyre = whole or Tyre()
    keep = {n for n, e in tyre.solids.items() if min(tyre.nodes[m][1] for m in e) > -1e-9}
    keep |= {
        n
        for own in tyre.plies.values()
        for n, e in own.items()
        if min(tyre.nodes[m][1] for m in e) > -1e-9
    }
    tyre.solids = {n: e for n, e in tyre.solids.items() if n in keep}
    tyre.plies = {
        name: {n: e for n, e in own.items() if n in keep} for name, own in tyre.plies.items()
    }
    nodes = {n for own in (tyre.solids, *tyre.plies.values()) for e in own.values() for n in e}
    tyre.nodes = {
        n: (p[0], 0.0 if abs(p[1]) < 1e-9 else p[1]) for n, p in tyre.nodes.items() if n in nodes
    }
    middle = [n for n, p in tyre.nodes.items() if p[1] == 0.0]
    mesh = tyre.mesh() + more + block("*NSET, NSET=MIDDLE", [(n,) for n in middle])
    mesh += "*SYMMETRIC MODEL GENERATION, REFLECT=LINE\n0., 0., 0., 1., 0., 0.\n"
    return plain(mesh, step=STEP.replace("900001, 1, 6\n", "900001, 1, 6\nMIDDLE, YSYMM\n"))


def embedded() -> str:
    """Plies on nodes of their own, laid into the rubber."""
    tyre = Tyre()
    copies: dict[int, int] = {}
    for own in tyre.plies.values():
        for n, nodes in own.items():
            own[n] = [copies.setdefault(m, m + 50000) for m in nodes]
    for m, copy in copies.items():
        tyre.nodes[copy] = tyre.nodes[m]
    return plain(tyre.mesh() + EMBEDDED)


def apart(count: int) -> Tyre:
    """The same with ``count`` elements of the carcass on nodes of their own along its circle, a
    third of it as many of the belts, wherever the rubber's nodes are."""
    tyre, a = Tyre(), INNER + (OUTER - INNER) * 2 / ROWS
    ends = {"CARCASS": (0, COLUMNS), "BELT": BELT}
    for first, (name, (start, end)) in zip((50_001, 60_001), ends.items(), strict=True):
        own = count if name == "CARCASS" else count // 3
        for k, j in enumerate(np.linspace(start, end, 2 * own + 1)):
            angle = OPENING * (2 * j / COLUMNS - 1)
            place = float(CENTRE + a * np.cos(angle)), float(a * np.sin(angle))
            tyre.nodes[first + k] = place
        along = range(first, first + 2 * own, 2)
        tyre.plies[name] = {n: [n, n + 1, n + 2] for n in along}
    return tyre


EMBEDDED = "*EMBEDDED ELEMENT, HOST ELSET=SOLID\nCARCASS, BELT\n"


def two_compounds() -> str:
    """The tread of a compound of its own, which is the other's."""
    sections = SECTIONS.replace(
        "*SOLID SECTION, ELSET=SOLID, MATERIAL=RUBBER\n",
        "*ELSET, ELSET=TREAD, GENERATE\n101, 112\n*ELSET, ELSET=BODY, GENERATE\n1, 12\n"
        "*SOLID SECTION, ELSET=TREAD, MATERIAL=TREAD\n"
        "*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER\n",
    )
    own = MATERIALS.format(**SI)
    again = own[: own.index("*MATERIAL, NAME=CORD")].replace("RUBBER", "TREAD")
    return plain(sections=sections, materials=own + again)


def compounds() -> str:
    """Tread, sidewalls and what the cords are in, each of a compound of its own, all the same."""
    sections = "*ELSET, ELSET=TREAD, GENERATE\n105, 108\n*ELSET, ELSET=BODY, GENERATE\n1, 12\n"
    sections += "*ELSET, ELSET=SIDEWALL, GENERATE\n101, 104\n109, 112\n"
    materials = MATERIALS.format(**SI)
    rubber = materials[: materials.index("*MATERIAL, NAME=CORD")]
    materials = materials.removeprefix(rubber)
    for name in ("TREAD", "SIDEWALL", "BODY"):
        sections += f"*SOLID SECTION, ELSET={name}, MATERIAL={name}\n"
        materials += rubber.replace("RUBBER", name)
    own = SECTIONS.replace("*SOLID SECTION, ELSET=SOLID, MATERIAL=RUBBER\n", sections)
    return plain(sections=own, materials=materials)


def inner_ply(spelled: bool = False) -> str:
    """The carcass on the inner surface; the pressure on the rubber's faces, or on the ply's."""
    text = plain(Tyre(ply_row=0).mesh())
    return text.replace("LINER, S4", "CARCASS, SPOS") if spelled else text


def free_format() -> str:
    """Lower case, blanks everywhere, comments, continued lines."""
    lines = []
    for line in plain().splitlines():
        if line.startswith("*ELEMENT"):
            line = line.replace(", ELSET", ",\n   elset")
        elif line.count(",") == 8:
            cut = line.split(",")
            line = ",".join(cut[:5]) + ",\n" + ",".join(cut[5:])
        lines += ["** a comment", line.replace(",", "  ,").lower()]
    return "\n\n".join(lines).replace("=", " = ") + "\n"


def gaps() -> str:
    """Node and element numbers with gaps, in no order."""
    moved = lambda n: (int(n) * 7919) % 100003 + 10 * (int(n) % 3)
    tyre = Tyre()
    number_of = {n: moved(n) for n in tyre.nodes}
    assert len(set(number_of.values())) == len(number_of)
    rim = tyre.rim
    tyre.nodes = {
        number_of[n]: p for n, p in sorted(tyre.nodes.items(), key=lambda x: number_of[x[0]])
    }
    tyre.solids = {n: [number_of[m] for m in e] for n, e in tyre.solids.items()}
    tyre.plies = {
        name: {3 * n: [number_of[m] for m in e] for n, e in own.items()}
        for name, own in tyre.plies.items()
    }
    mesh = tyre.mesh()
    mesh = re.sub(
        r"\*NSET, NSET=RIM\n", "*NSET, NSET=RIM\n" + "".join(f"{number_of[n]}\n" for n in rim), mesh
    )
    return plain(mesh)


def late_sets() -> str:
    """Sections and surfaces before the sets that they name; a surface called as its set."""
    mesh = Tyre().mesh()
    at = mesh.index("*ELSET, ELSET=LINER")
    sets = mesh[at:].replace("NAME=CAVITY", "NAME=LINER")
    surface = sets[sets.index("*SURFACE") :]
    listed = sets[: sets.index("*SURFACE")]
    return plain(
        surface + SECTIONS + MATERIALS.format(**SI) + mesh[:at],
        sections="*ELSET, ELSET=OTHER\nLINER\n" + listed,
        materials="** they stand above\n",
        step=STEP.replace("CAVITY", "liner"),
    )


def parameters() -> str:
    """*PARAMETER and expressions of it."""
    defined = (
        "*PARAMETER\nshear = 2.0e6\nshare = 0.4\nc10 = shear*share\nc01=shear/2.-c10\n"
        "p = 2*10**5\narea=2.1e-7 # of a cord\nname='RUBBER'\n"
    )
    text = plain().replace("800000.0, 200000.0", "<c10>, <c01>").replace("2.0E+05", "<p>")
    return defined + text.replace("2.1e-7", "<area>").replace("MATERIAL=RUBBER", "MATERIAL=<name>")


def millimetres() -> str:
    """mm, t, s, MPa."""
    tyre = Tyre()
    tyre.nodes = {n: (1e3 * r, 1e3 * z) for n, (r, z) in tyre.nodes.items()}
    sections = SECTIONS.replace("4.2E-07, 0.001", "0.42, 1.").replace(
        "2.1e-7, 1.16e-3", "0.21, 1.16"
    )
    return plain(tyre.mesh(), sections, MATERIALS.format(**MM), STEP.replace("2.0E+05", "0.2"))


def copied() -> str:
    """A half, its copy by *NCOPY and *ELCOPY."""
    text = half()
    text = text[: text.index("*SYMMETRIC")] + text[text.index("*SOLID SECTION") :]
    text = text.replace("MIDDLE, YSYMM\n", "").replace("ELSET=CARCASS\n1", "ELSET=CARCASS\n1")
    more = (
        "*NCOPY, OLD SET=ALL, CHANGE NUMBER=100000, REFLECT=LINE\n0., 0., 0., 1., 0., 0.\n"
        "*ELCOPY, OLD SET=SOLID, ELEMENT SHIFT=10000, SHIFT NODES=100000, REFLECT,\n"
        " NEW SET=SOLID_2\n"
        "*ELCOPY, OLD SET=CARCASS, ELEMENT SHIFT=10000, SHIFT NODES=100000, REFLECT,\n"
        " NEW SET=CARCASS_2\n"
        "*ELCOPY, OLD SET=BELT, ELEMENT SHIFT=10000, SHIFT NODES=100000, REFLECT,\n"
        " NEW SET=BELT_2\n"
        "*NSET, NSET=BOTH\nRIM, RIM_2\n*ELSET, ELSET=ALL_SOLID\nSOLID, SOLID_2\n"
        "*ELSET, ELSET=ALL_CARCASS\nCARCASS, CARCASS_2\n*ELSET, ELSET=ALL_BELT\nBELT, BELT_2\n"
        "*NCOPY, OLD SET=RIM, CHANGE NUMBER=100000, REFLECT=LINE, NEW SET=RIM_2\n"
        "0.,0.,0.,1.,0.,0.\n"
        "*SURFACE, TYPE=NODE, NAME=A\nMIDDLE\n*NSET, NSET=MIDDLE_2\n"
        + "".join(f"{100000 + number(i, COLUMNS // 2)}\n" for i in range(ROWS + 1))
        + "*SURFACE, TYPE=NODE, NAME=B\nMIDDLE_2\n*TIE, NAME=JOIN\nB, A\n"
        "*ELSET, ELSET=LINER_2, GENERATE\n10007, 10012\n"
    )
    text = text.replace("*SURFACE, NAME=CAVITY", more + "*SURFACE, NAME=CAVITY")
    text = text.replace("LINER, S4\n", "LINER, S4\nLINER_2, S1\n").replace(
        "TIE NSET=RIM", "TIE NSET=BOTH"
    )
    head, tail = text.split("*SOLID SECTION", 1)
    for name in ("SOLID", "CARCASS", "BELT"):
        tail = tail.replace(f"ELSET={name}\n", f"ELSET=ALL_{name}\n").replace(
            f"ELSET={name},", f"ELSET=ALL_{name},"
        )
    return head + "*SOLID SECTION" + tail


def rax_rim() -> str:
    """A rim of RAX2 elements that the bead's nodes are tied to."""
    tyre = Tyre()
    ends = [number(ROWS, 0), number(0, 0)], [number(0, COLUMNS), number(ROWS, COLUMNS)]
    points = {800001 + k: tyre.nodes[n] for k, n in enumerate((*ends[0], *ends[1]))}
    text = tyre.mesh() + block("*NODE", [(n, *map(repr, p)) for n, p in points.items()])
    text += "*ELEMENT, TYPE=RAX2, ELSET=RIM_ELEMENTS\n9001, 800001, 800002\n9002, 800003, 800004\n"
    text = text.replace("TIE NSET=RIM", "ELSET=RIM_ELEMENTS")
    text += "*SURFACE, NAME=BEAD, TYPE=NODE\nRIM\n*SURFACE, NAME=FLANGE\nRIM_ELEMENTS, SPOS\n"
    return plain(text + "*TIE, NAME=SEAT, ADJUST=NO, POSITION TOLERANCE=0.04\nBEAD, FLANGE\n")


STYLES: dict[str, Callable[[], str]] = {
    "cae": cae,
    "generated": generated,
    "half": half,
    "embedded": embedded,
    "two_compounds": two_compounds,
    "free_format": free_format,
    "gaps": gaps,
    "late_sets": late_sets,
    "parameters": parameters,
    "millimetres": millimetres,
    "copied": copied,
    "rax_rim": rax_rim,
}
