"""Five decks as tyre makers' pre-processors and ABAQUS/CAE write them, and the same tyres our way.

python -m tests.tyre.maker_decks writes them to tests/data/makers. All are one small tyre: a ring
from bead to bead, four-node elements with triangles at the beads, a carcass, two belts and a cap
ply. They differ in units, in how plies are given and in what holds the bead.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parents[1] / "data" / "makers"
CENTRE, INNER, OUTER, OPENING = 0.26, 0.08, 0.095, np.radians(125)  # m, m, m, rad
COLUMNS, ROWS, BELT, BEAD = 20, 3, 6, 1  # elements along and through; free of the belt; held
LIFTED_FROM = 0.2  # m: radius at which the carcass has its spacing
REFERENCE = 9999
Row = Sequence[int | float | str]
RUBBERS = {  # C10, C20, C30 in MPa, D1 in 1/MPa
    "BODY": (0.6, -0.1, 0.02, 0.06),
    "TREAD": (0.7, -0.12, 0.03, 0.06),
    "APEX": (1.8, -0.2, 0.05, 0.02),
}
TOPPING = 0.8, 0.05  # of the membranes' compound: C10, MPa, and D1
CORDS = {"POLYESTER": (4.0e9, 1380.0), "STEEL": (1.0e11, 7800.0), "NYLON": (2.5e9, 1140.0)}  # Pa
GAUGE = 1e-3  # m, of membranes


@dataclass(frozen=True)
class Layer:
    """Cords of a ply: material, area in m2, spacing in m, angle in degrees from the meridian."""

    name: str
    cord: str
    area: float
    spacing: float
    angle: float


@dataclass
class Tyre:
    """Tables of the tyre, m."""

    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)
    solids: dict[str, dict[int, tuple[int, ...]]] = field(default_factory=dict)  # by set
    plies: dict[str, dict[int, tuple[int, int]]] = field(default_factory=dict)
    lifted: bool = False  # each element of the carcass has a spacing of its own

    def __post_init__(self) -> None:
        for i in range(ROWS + 1):
            for j in range(COLUMNS + 1):
                self.nodes[number(i, j)] = point(i, j)
        self.solids = {"BODY": {}, "TREAD": {}, "APEX": {}}
        for j in range(COLUMNS):
            for i in range(ROWS):
                nodes = (number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1))
                own = 100 * (i + 1) + j + 1
                at_bead = min(j, COLUMNS - 1 - j) == BEAD
                if i == 1 and at_bead:  # a filler of triangles, at both beads its half turn
                    nodes = nodes if 2 * j >= COLUMNS else nodes[1:] + nodes[:1]
                    self.solids["APEX"][own] = nodes[:3]
                    self.solids["APEX"][own + 50] = (nodes[0], nodes[2], nodes[3])
                else:
                    is_tread = i == ROWS - 1 and BELT <= j < COLUMNS - BELT
                    self.solids["TREAD" if is_tread else "BODY"][own] = nodes
        ends = {"C01": (1, 0), "BT1": (2, BELT), "BT2": (2, BELT + 1), "JFC1": (2, BELT)}
        for k, (name, (i, start)) in enumerate(ends.items()):
            self.plies[name] = {
                1000 * (k + 1) + j: (number(i, j), number(i, j + 1))
                for j in range(start, COLUMNS - start)
            }

    @property
    def bead(self) -> list[int]:
        """Nodes of the elements that the rim holds."""
        columns = [*range(BEAD + 1), *range(COLUMNS - BEAD, COLUMNS + 1)]
        return [number(i, j) for j in columns for i in range(ROWS + 1)]

    @property
    def inside(self) -> list[int]:
        """Elements of the inner surface, whose face 4 is under pressure."""
        return [101 + j for j in range(COLUMNS)]

    def layers(self, ply: str, element: int) -> list[Layer]:
        """Cords in an element."""
        spacing = 0.0009
        if self.lifted:
            r = sum(self.nodes[n][0] for n in self.plies["C01"][element]) / 2 if ply == "C01" else 1
            spacing = float(f"{0.0009 * r / LIFTED_FROM:.6e}")
        return {
            "C01": [Layer("C01", "POLYESTER", 2.5e-7, spacing, 0.0)],
            "BT1": [Layer("BT1", "STEEL", 2.0e-7, 0.0012, 66.0)],
            "BT2": [Layer("BT2", "STEEL", 2.0e-7, 0.0012, -66.0)],
            "JFC1": [Layer("JFC1", "NYLON", 1.5e-7, 0.001, 90.0)],
        }[ply]


def number(i: int, j: int) -> int:
    """The node in row i from the inner surface, in column j from the bead at -z."""
    return 100 * (i + 1) + j + 1


def point(i: int, j: int) -> tuple[float, float]:
    """r, z of a node, m, to 1e-8."""
    angle = OPENING * (2 * j / COLUMNS - 1)
    a = INNER + (OUTER - INNER) * i / ROWS
    return round(float(CENTRE + a * np.cos(angle)), 8), round(float(a * np.sin(angle)), 8)


def block(keyword: str, rows: Iterable[Row] = ()) -> str:
    return "\n".join([keyword, *(", ".join(map(str, row)) for row in rows)]) + "\n"


def in_rows(numbers: Sequence[int], width: int = 10) -> list[Row]:
    return [numbers[k : k + width] for k in range(0, len(numbers), width)]


def nodes(tyre: Tyre, length: float = 1.0, head: str = "*NODE, NSET=ALL") -> str:
    digits = 8 if length == 1.0 else 5
    return block(
        head,
        [
            (f"{n:8d}", f"{r * length:.{digits}f}", f"{z * length:.{digits}f}")
            for n, (r, z) in tyre.nodes.items()
        ],
    )


def solids(tyre: Tyre) -> str:
    """Elements by type, then their sets."""
    kinds: dict[int, list[Row]] = {3: [], 4: []}
    for own in tyre.solids.values():
        for n, e in own.items():
            kinds[len(e)].append((n, *e))
    text = block("*ELEMENT, TYPE=CGAX4H", kinds[4]) + block("*ELEMENT, TYPE=CGAX3H", kinds[3])
    for name, own in tyre.solids.items():
        text += block(f"*ELSET, ELSET={name}", in_rows([*own]))
    return text


def membranes(tyre: Tyre, kind: str = "MGAX1", names: Iterable[str] = ()) -> str:
    text = ""
    for name in names or tyre.plies:
        rows = [(n, *e) for n, e in tyre.plies[name].items()]
        text += block(f"*ELEMENT, TYPE={kind}, ELSET={name}", rows)
    return text


def materials(unit: str = "m") -> str:
    """Compounds and cords, in Pa and kg/m3 or in MPa and t/mm3."""
    pressure, density = (1e6, 1.0) if unit == "m" else (1.0, 1e-12)
    text = ""
    for name, (c10, c20, c30, d1) in RUBBERS.items():
        constants = [f"{c * pressure:.6g}" for c in (c10, c20, c30)]
        compliances = [f"{d1 / pressure:.6g}", *["0."] * 2]
        text += block(f"*MATERIAL, NAME={name}_RUBBER")
        text += block("*HYPERELASTIC, YEOH, MODULI=LONG TERM", [(*constants, *compliances)])
        text += block("*VISCOELASTIC, TIME=PRONY", [("0.2", "0.", "0.05")])
        text += block("*DENSITY", [(f"{1120.0 * density:.6g}",)])
    c10, d1 = TOPPING
    text += block("*MATERIAL, NAME=TOPPING")
    text += block("*HYPERELASTIC, NEO HOOKE", [(f"{c10 * pressure:.6g}", f"{d1 / pressure:.6g}")])
    text += block("*DENSITY", [(f"{1150.0 * density:.6g}",)])
    for name, (modulus, rho) in CORDS.items():
        text += block(f"*MATERIAL, NAME={name}")
        text += block("*DENSITY", [(f"{rho * density:.6g}",)])
        text += block("*ELASTIC", [(f"{modulus / 1e6 * pressure:.6g}", "0.3")])
    return text


def solid_sections(tyre: Tyre) -> str:
    return "".join(
        f"*SOLID SECTION, ELSET={name}, MATERIAL={name}_RUBBER\n" for name in tyre.solids
    )


def rebar_tables(tyre: Tyre) -> str:
    """Membranes of compound, m; each element of a lifted carcass has a *REBAR of its own."""
    text = ""
    for name, own in tyre.plies.items():
        text += block(f"*MEMBRANE SECTION, ELSET={name}, MATERIAL=TOPPING", [(f" {GAUGE}",)])
        alone = tyre.lifted and name == "C01"
        for target in own if alone else [name]:
            for layer in tyre.layers(name, target if alone else next(iter(own))):
                rebar = f"{layer.name}_{target}" if alone else layer.name
                text += block(
                    f"*REBAR, ELEMENT=AXIMEMBRANE, MATERIAL={layer.cord}, GEOM=SKEW, NAME={rebar}",
                    [(target, f"{layer.area:g} ", f"{layer.spacing:g} ", f"{layer.angle:g}")],
                )
    return text


def step(name: str, pressure: str, boundary: str = "", more: str = "") -> str:
    return (
        f"*STEP, NAME={name}, INC=100, NLGEOM=YES\n*STATIC, LONG TERM\n 0.1, 1.0, 1.E-5, 1.0\n"
        + boundary
        + f"*DSLOAD\n PRESS, P, {pressure}\n{more}"
        + "*OUTPUT, FIELD, FREQUENCY=99\n*NODE OUTPUT\n U,\n*END STEP\n"
    )


def press(tyre: Tyre) -> str:
    return block("*SURFACE, TYPE=ELEMENT, NAME=PRESS", [(n, "S4") for n in tyre.inside])


def lifted_membranes() -> dict[str, str]:
    """SI; a maker's pre-processor: MGAX1, *REBAR of each element, three steps of inflation."""
    tyre, star = Tyre(lifted=True), "*" * 74 + "\n"
    hold = f"*BOUNDARY, OP=NEW\n {REFERENCE}, 1, 6\n"
    text = "*HEADING\n SECTION BY PRE-PROCESSOR\n" + star
    text += nodes(tyre, head="*NODE, SYSTEM=R") + f"*NODE, NSET=NRIM\n {REFERENCE}, 0.0, 0.0, 0.0\n"
    text += solids(tyre) + membranes(tyre) + star + press(tyre)
    text += (
        block("*NSET, NSET=BEAD", in_rows(tyre.bead))
        + "*RIGID BODY, REF NODE=NRIM, TIE NSET=BEAD\n"
    )
    text += star + solid_sections(tyre) + rebar_tables(tyre) + star + materials() + star
    text += step("INFLATION_100", "220000.0", hold) + step("DEFLATION_10", "22000.0", hold)
    return {"lifted_membranes.inp": text + step("INFLATION_AGAIN", "220000.0", hold)}


def included_files() -> dict[str, str]:
    """mm, t, MPa; mesh, materials and rebar tables in files of their own, belts in one membrane."""
    tyre = Tyre()
    width = tyre.plies["BT1"].keys() - {min(tyre.plies["BT1"]), max(tyre.plies["BT1"])}
    edges = [n for n in tyre.plies["BT1"] if n not in width]
    mesh = nodes(tyre, 1e3) + solids(tyre) + membranes(tyre, names=("C01", "BT1"))
    mesh += block("*ELSET, ELSET=BELTS", in_rows(sorted(width)))
    mesh += block("*ELSET, ELSET=EDGES", in_rows(edges)) + press(tyre)
    mesh += block("*NSET, NSET=BEAD", in_rows(tyre.bead, 16))
    tables = f"*MEMBRANE SECTION, ELSET=C01, MATERIAL=TOPPING\n {GAUGE * 1e3:g},\n"
    tables += "*REBAR LAYER\n" + mm_row(tyre, "C01")
    for name, plies in (("BELTS", ("BT1", "BT2", "JFC1")), ("EDGES", ("BT1", "JFC1"))):
        # one membrane as thick as those of its plies
        tables += f"*MEMBRANE SECTION, ELSET={name}, MATERIAL=TOPPING\n"
        tables += f" {GAUGE * 1e3 * len(plies):g},\n*REBAR LAYER\n"
        tables += "".join(mm_row(tyre, ply) for ply in plies)
    text = "*HEADING\n Tyre 1, units mm t s\n*PREPRINT, ECHO=NO, MODEL=NO, HISTORY=NO\n"
    text += "*PARAMETER\n bar = 0.1\n inflation = 2.2*bar\n"
    text += "*INCLUDE, INPUT=included_mesh.inc\n" + solid_sections(tyre)
    text += "*INCLUDE, INPUT=included_tables.inc\n*INCLUDE, INPUT=included_materials.inc\n"
    text += "*BOUNDARY\n BEAD, ENCASTRE\n" + step("INFLATE", "<inflation>")
    return {
        "included.inp": text,
        "included_mesh.inc": mesh,
        "included_tables.inc": tables,
        "included_materials.inc": materials("mm"),
    }


def mm_row(tyre: Tyre, ply: str) -> str:
    """A line of *REBAR LAYER in mm."""
    (layer,) = tyre.layers(ply, next(iter(tyre.plies[ply])))
    area, spacing = layer.area * 1e6, layer.spacing * 1e3
    return f"{layer.name}, {area:g}, {spacing:g}, 0., {layer.cord}, {layer.angle:g}\n"


def parts_of_cae() -> dict[str, str]:
    """SI; ABAQUS/CAE: a part of rubber, parts of plies laid into it, all the same nodes twice."""
    tyre = Tyre()
    rubber = nodes(tyre, head="*Node") + solids(tyre).replace("*ELEMENT, TYPE", "*Element, type")
    rubber += block("*Elset, elset=_Press_S4, internal", in_rows(tyre.inside, 16))
    rubber += "*Surface, type=ELEMENT, name=Press\n_Press_S4, S4\n"
    rubber += block("*Nset, nset=Bead", in_rows(tyre.bead, 16)) + "** Section: Rubber\n"
    rubber += solid_sections(tyre).replace("MATERIAL=", "material=")
    text = "*Heading\n** Job name: tyre Model name: section\n**\n** PARTS\n**\n"
    text += f"*Part, name=Rubber\n{rubber}*End Part\n**\n"
    for name, own in tyre.plies.items():
        used = dict.fromkeys(n for e in own.values() for n in e)
        plain = {n: k for k, n in enumerate(used, start=1)}
        rows = [(k, f"{tyre.nodes[n][0]:.8f}", f"{tyre.nodes[n][1]:.8f}") for n, k in plain.items()]
        elements = [(k, *(plain[n] for n in e)) for k, e in enumerate(own.values(), start=1)]
        (layer,) = tyre.layers(name, next(iter(own)))
        text += f"*Part, name={name}\n" + block("*Node", rows)
        text += block("*Element, type=MGAX1", elements)
        text += block("*Elset, elset=All, generate", [(1, len(own), 1)])
        text += f"*Membrane Section, elset=All, material=TOPPING\n{GAUGE},\n*Rebar Layer\n"
        text += f"{name}, {layer.area:g}, {layer.spacing:g}, 0., {layer.cord}, {layer.angle:g}\n"
        text += "*End Part\n**\n"
    text += "** ASSEMBLY\n**\n*Assembly, name=Assembly\n**\n"
    for name in ("Rubber", *tyre.plies):
        text += f"*Instance, name={name}-1, part={name}\n*End Instance\n**\n"
    text += "*Node\n      1,           0.,           0.,           0.\n*Nset, nset=Rp\n 1,\n"
    for name in tyre.plies:
        text += f"*Elset, elset=_M-{name}, internal, instance={name}-1, generate\n"
        text += f" 1, {len(tyre.plies[name])}, 1\n"
        text += f"*Embedded Element, host elset=Rubber-1.BODY\n_M-{name}\n"
    text += (
        "*Rigid Body, ref node=Rp, tie nset=Rubber-1.Bead\n*End Assembly\n**\n** MATERIALS\n**\n"
    )
    text += materials() + "** STEP: Inflate\n"
    hold = "*Boundary\nRp, ENCASTRE\n"
    return {
        "parts_of_cae.inp": text
        + step("Inflate", "220000.", hold).replace("PRESS", "Rubber-1.Press")
    }


def half_section() -> dict[str, str]:
    """mm, t, MPa; half of the section, reflected; a spacing that is measured at a radius."""
    tyre = Tyre()
    middle = COLUMNS // 2
    keep = lambda table: {
        n: e for n, e in table.items() if min(tyre.nodes[m][1] for m in e) > -1e-9
    }
    tyre.solids = {name: keep(own) for name, own in tyre.solids.items()}
    tyre.plies = {name: keep(own) for name, own in tyre.plies.items()}
    tyre.nodes = {n: p for n, p in tyre.nodes.items() if p[1] > -1e-9}
    bead = [n for n in tyre.bead if n in tyre.nodes]
    text = "*HEADING\n HALF SECTION, MM TONNE SECOND\n" + nodes(tyre, 1e3)
    text += f"*NODE, NSET=HUB\n {REFERENCE}, 0., 0.\n" + solids(tyre) + membranes(tyre)
    text += block("*NSET, NSET=CENTRE", [(number(i, middle),) for i in range(ROWS + 1)])
    text += block("*NSET, NSET=BEAD", in_rows(bead))
    text += "*RIGID BODY, REFNODE=HUB, TIE NSET=BEAD\n"
    text += block(
        "*SURFACE, NAME=PRESS", [(n, "S4") for n in tyre.inside if n in tyre.solids["BODY"]]
    )
    text += "*SYMMETRIC MODEL GENERATION, REFLECT=LINE\n 0., 0., 0., 1., 0., 0.\n"
    text += solid_sections(tyre)
    for name, own in tyre.plies.items():
        (layer,) = tyre.layers(name, next(iter(own)))
        fanned = f", {LIFTED_FROM * 1e3:g}" if name == "C01" else ""
        text += f"*MEMBRANE SECTION, ELSET={name}, MATERIAL=TOPPING\n {GAUGE * 1e3:g}\n"
        text += f"*REBAR, ELEMENT=AXIMEMBRANE, MATERIAL={layer.cord}, NAME={name}\n"
        text += f" {name}, {layer.area * 1e6:g}, {layer.spacing * 1e3:g}, {layer.angle:g}{fanned}\n"
    text += materials("mm")
    hold = "*BOUNDARY\n HUB, 1, 6\n CENTRE, YSYMM\n"
    return {"half_section.inp": text + step("INFLATE", "0.22", hold)}


def rim_in_contact() -> dict[str, str]:
    """SI; a maker's pre-processor: two flanges that move into the beads, then the inflation."""
    tyre = Tyre(lifted=True)
    text = "*HEADING\n SECTION ON ITS RIM\n" + nodes(tyre) + solids(tyre) + membranes(tyre)
    text += press(tyre) + solid_sections(tyre) + rebar_tables(tyre) + materials()
    for side, letter, node in ((1, "L", 3998), (-1, "R", 3999)):
        column = COLUMNS if side > 0 else 0
        chafer = [100 * (i + 1) + (COLUMNS if side > 0 else 1) for i in range(ROWS)]
        (r0, z0), (r1, z1) = (tyre.nodes[number(i, column)] for i in (0, ROWS))
        along = np.array([r1 - r0, z1 - z0]) / np.hypot(r1 - r0, z1 - z0)
        normal = np.array([along[1], -along[0]]) * side  # towards the tyre
        seat_end = np.array([r0, z0]) - 0.01 * along
        bend = np.array([r1, z1]) + 0.004 * along
        centre = bend - 0.006 * normal
        arc_end = centre + 0.006 * along
        text += block(f"*ELSET, ELSET=RIC_{letter}", in_rows(chafer))
        text += f"*SURFACE, TYPE=ELEMENT, NAME=RIC_{letter}\n RIC_{letter}\n"
        text += f"*NODE, NSET=N{letter}FLANGE\n {node}, 0.0, 0.0, 0.0\n"
        text += f"*SURFACE, TYPE=SEGMENT, NAME={letter}FLANGE\n"
        seat, corner, top, middle = (
            f"{r:.8f}, {z + 0.1 * side:.8f}" for r, z in (seat_end, bend, arc_end, centre)
        )
        profile = f"START, {top}\nCIRCL, {corner}, {middle}\nLINE, {seat}\n"
        if side < 0:  # the tyre on the left there, too
            profile = f"START, {seat}\nLINE, {corner}\nCIRCL, {top}, {middle}\n"
        text += profile
        text += f"*RIGID BODY, ANALYTICAL SURFACE={letter}FLANGE, REF NODE=N{letter}FLANGE\n"
        text += (
            f"*CONTACT PAIR, INTERACTION=RIM{letter}, HCRIT=1.0e-3\nRIC_{letter}, {letter}FLANGE\n"
        )
        text += f"*SURFACE INTERACTION, NAME=RIM{letter}\n"
        text += "*SURFACE BEHAVIOR, AUGMENTED LAGRANGE\n ,0.0,1.0\n*FRICTION\n 0.015\n"
    mount = "*STEP, NAME=MOUNTING, INC=200, NLGEOM=YES\n*STATIC, STABILIZE=1.E-6\n 0.01, 1.0\n"
    mount += "*BOUNDARY\n NLFLANGE, 2, 2, -0.1\n NRFLANGE, 2, 2, 0.1\n"
    mount += " NLFLANGE, 1, 1\n NRFLANGE, 1, 1\n NLFLANGE, 5, 6\n NRFLANGE, 5, 6\n"
    mount += "*CONTACT CONTROLS, STABILIZE\n*END STEP\n"
    return {"rim_in_contact.inp": text + mount + step("INFLATION", "220000.0")}


def our_way(tyre: Tyre, held: Sequence[int] = (), fanned: bool = False) -> str:
    """The same tyre in SI with SFMGAX1 and *REBAR LAYER. A membrane's mass is that of a layer of
    limp cords; ``fanned``: the carcass has a constant angle between its cords."""
    text = "*HEADING\nour way\n" + nodes(tyre) + f"*NODE\n{REFERENCE}, 0., 0.\n" + solids(tyre)
    text += membranes(tyre, "SFMGAX1") + press(tyre)
    text += block("*NSET, NSET=BEAD", in_rows(held or tyre.bead))
    text += f"*RIGID BODY, REF NODE={REFERENCE}, TIE NSET=BEAD\n" + solid_sections(tyre)
    for name, own in tyre.plies.items():
        for n in own:
            (layer,) = tyre.layers(name, n)
            spacing, geometry = layer.spacing, ""
            if fanned and name == "C01":
                spacing, geometry = float(np.degrees(spacing / LIFTED_FROM)), ", GEOMETRY=ANGULAR"
            text += f"*ELSET, ELSET=E{n}\n{n}\n*SURFACE SECTION, ELSET=E{n}\n"
            text += f"*REBAR LAYER{geometry}\n"
            text += f"{name}_{n}, {layer.area!r}, {spacing!r}, 0., {layer.cord}, {layer.angle!r}\n"
            text += f"*REBAR LAYER\nMASS_{n}, {GAUGE * 1e-3!r}, 0.001, 0., LIMP, 0.\n"
    text += materials() + "*MATERIAL, NAME=LIMP\n*ELASTIC\n1., 0.\n*DENSITY\n1150.\n"
    return text + step("INFLATE", "220000.0", f"*BOUNDARY\n{REFERENCE}, 1, 6\n")


def softened(text: str) -> str:
    """A deck whose membranes' compound has a thousandth of its modulus."""
    for unit in (1e6, 1.0):
        c10, d1 = TOPPING[0] * unit, TOPPING[1] / unit
        text = text.replace(
            f"NEO HOOKE\n{c10:.6g}, {d1:.6g}\n", f"NEO HOOKE\n{c10 / 1e3:.6g}, {d1 * 1e3:.6g}\n"
        )
    return text


DECKS = {
    "lifted_membranes": lifted_membranes,
    "included": included_files,
    "parts_of_cae": parts_of_cae,
    "half_section": half_section,
    "rim_in_contact": rim_in_contact,
}
OUR_WAY = {
    "lifted_membranes": our_way(Tyre(lifted=True)),
    "included": our_way(Tyre()),
    "parts_of_cae": our_way(Tyre()),
    "half_section": our_way(Tyre(), fanned=True),
    "rim_in_contact": our_way(
        Tyre(lifted=True), [number(i, j) for j in (0, COLUMNS) for i in range(ROWS + 1)]
    ),
}


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for deck in DECKS.values():
        for name, text in deck().items():
            (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
