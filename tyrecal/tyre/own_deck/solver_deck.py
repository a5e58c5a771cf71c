"""The flat deck of a user's one: in SI units, without parts, generated nodes and what only asks for
output, in the words that solvers honour; each of its lines knows where it comes from.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .classify import ClassifiedDeck
from .model import Assigned, DeckModel
from .numbers import written
from .solver_mesh import DeckLines, SolverMesh, solver_mesh
from .text import Block, Place, Row, fields, table

SECTION_OPTIONS = ("HOURGLASS STIFFNESS", "REBAR LAYER")


@dataclass(frozen=True, eq=False)
class RebarPly:
    """A rebar layer as it is found."""

    name: str
    set_name: str
    material: str
    area_m2: float
    spacing: float  # m, or degrees
    angular: bool
    angle_deg: float
    elements: tuple[int, ...]  # numbers in the flat deck


@dataclass(frozen=True, eq=False)
class SolverDeck:
    """The flat deck without its step; ``origins``: of each line."""

    mesh: SolverMesh
    lines: tuple[str, ...]
    origins: tuple[Place, ...]
    materials: tuple[str, ...]  # of the solid sections, by their place
    sections: tuple[str, ...]  # their sets, likewise
    plies: tuple[RebarPly, ...]
    pressure_Pa: float
    long_term: bool
    blocks: ClassifiedDeck
    model: DeckModel

    @property
    def set_names(self) -> list[str]:
        """Names of the element sets, rubber first."""
        count = len(self.model.solids), len(self.model.plies)
        words = zip(("SOLID", "PLY"), count, strict=True)
        return [f"{word}_{k + 1}" for word, n in words for k in range(n)]

    @property
    def static_moduli(self) -> str:
        """Moduli of the step that inflates, as a case names them."""
        return "long_term" if self.long_term else "instantaneous"

    @property
    def text(self) -> str:
        """The lines."""
        return "\n".join(self.lines)


def translate(deck: ClassifiedDeck, model: DeckModel, length: float, mass: float) -> SolverDeck:
    """The flat deck of a model whose units of length and mass are so many m and kg. Raises
    OwnDeckError."""
    mesh = solver_mesh(model, length)
    write = _Writer(length, mass)
    blocks = _materials(deck.model)
    options = _options(deck.model)
    used: dict[str, str] = {}
    rubbers, plies = [], list[RebarPly]()
    for k, section in enumerate(model.solids, start=1):
        name = _used(section.block, section.block.need("MATERIAL"), blocks, used)
        rubbers.append(section.block.get("MATERIAL"))
        controls = section.block.get("CONTROLS")
        more = f", CONTROLS={controls}" if controls else ""
        write.line(f"*SOLID SECTION, ELSET=SOLID_{k}, MATERIAL={name}{more}", section.block.place)
        for option in options[section.block]:
            if option.name != "HOURGLASS STIFFNESS":
                raise option.refused("does not belong under a *SOLID SECTION")
            write.block(option, "*HOURGLASS STIFFNESS")
        if any(row.text(0) for row in section.block.rows[1:]):
            raise section.block.refused("takes no more than one data line", section.block.rows[1])
    for k, section in enumerate(model.plies, start=1):
        is_membrane = section.block.name == "MEMBRANE SECTION"
        if is_membrane:
            name = _used(section.block, section.block.need("MATERIAL"), blocks, used)
            write.block(section.block, f"*MEMBRANE SECTION, ELSET=PLY_{k}, MATERIAL={name}")
        else:
            write.line(f"*SURFACE SECTION, ELSET=PLY_{k}", section.block.place)
        if section.block.rows and not is_membrane:
            raise section.block.refused("takes no data", section.block.rows[0])
        if not options[section.block] and not is_membrane:
            raise section.block.refused("has no *REBAR LAYER under it: give its cords")
        rebars = [_layer_of(block, row) for block, row in section.rebars]
        for option in [*options[section.block], *rebars]:
            plies += _layers(write, section, k, option, blocks, used, mesh, length)
    for block in deck.model:
        if block.name == "SECTION CONTROLS":
            head = f"*SECTION CONTROLS, NAME={block.need('NAME')}, HOURGLASS=STIFFNESS"
            if "HOURGLASS" not in block.parameters or block.rows:
                raise block.refused("only HOURGLASS=STIFFNESS is honoured of it")
            write.line(head, block.place)
    for name, plain_name in used.items():
        write.line(f"*MATERIAL, NAME={plain_name}", blocks[name][0].place)
        for option in blocks[name][1:]:
            values = "".join(
                f", {key}" + (f"={value}" if value else "")
                for key, value in option.parameters.items()
            )
            write.block(option, f"*{option.name}{values}")
    static = next(block for block in deck.inflation if block.name == "STATIC")
    block, row, i = model.pressure[0]
    stress = mass / length
    return SolverDeck(
        mesh,
        (*mesh.lines, *write.lines),
        (*mesh.origins, *write.origins),
        tuple(rubbers),
        tuple(section.name for section in model.solids),
        tuple(plies),
        row.number(i) * stress,
        "LONG TERM" in static.parameters,
        deck,
        model,
    )


class _Writer(DeckLines):
    """Lines with numbers in SI units."""

    def __init__(self, length: float, mass: float):
        super().__init__()
        self.length, self.mass = length, mass

    def scale(self, unit: str) -> float:
        """The factor to SI units on a field of a kind of unit."""
        L, M, _ = fields.DIMENSIONS.get(unit, (0, 0, 0))
        return self.length**L * self.mass**M

    def block(self, block: Block, head: str, angular: bool = False) -> None:
        """A keyword line, and the block's data."""
        self.line(head, block.place)
        scales = {(i, j): self.scale(field.unit) for field, i, j in fields.placed_fields(block)}
        for i, row in enumerate(block.rows):
            texts = list(row.fields)
            for j, text in enumerate(texts):
                scale = scales.get((i, j), 1.0)
                if angular and j == 2:
                    scale = 1.0
                if scale != 1.0 and text:
                    texts[j] = written(row.number(j) * scale)
            self.line(", ".join(texts), row.place)


def _options(blocks: Sequence[Block]) -> dict[Block, list[Block]]:
    """Options under each section keyword: *REBAR LAYER, or *HOURGLASS STIFFNESS."""
    options: dict[Block, list[Block]] = {}
    section: Block | None = None
    for block in blocks:
        if block.name in ("SOLID SECTION", "SURFACE SECTION", "MEMBRANE SECTION"):
            section = block
            options[section] = []
        elif section and block.name in SECTION_OPTIONS:
            options[section].append(block)
    return options


def _materials(blocks: Sequence[Block]) -> dict[str, list[Block]]:
    """*MATERIAL with its options, by name."""
    by_name: dict[str, list[Block]] = {}
    current: list[Block] = []
    for block in blocks:
        if block.name == "MATERIAL":
            name = block.need("NAME")
            if name in by_name:
                raise block.refused(f"the material {name} is defined twice")
            if block.rows:
                raise block.refused("takes no data")
            current = by_name[name] = [block]
        elif block.name in table.MATERIAL_OPTIONS:
            if any(each.name == block.name for each in current):
                raise block.refused(f"is given twice under {current[0].get('NAME')}")
            fields.fields_of(block)
            current.append(block)
    return by_name


def _used(
    block: Block, name: str, blocks: Mapping[str, Sequence[Block]], used: dict[str, str]
) -> str:
    """The flat deck's name of a material that is used."""
    if name not in blocks:
        raise block.refused(f"the material {name} is not defined")
    if not any(each.name == "DENSITY" for each in blocks[name]):
        raise blocks[name][0].refused(f"the material {name} needs a *DENSITY")
    if name not in used:
        simple = re.fullmatch(r"[A-Z][A-Z0-9_\-]{0,60}", name)
        used[name] = name if simple else f"MATERIAL_{len(used) + 1}"
    return used[name]


def _layers(
    write: _Writer,
    section: Assigned,
    k: int,
    option: Block,
    blocks: Mapping[str, Sequence[Block]],
    used: dict[str, str],
    mesh: SolverMesh,
    length: float,
) -> list[RebarPly]:
    if option.name != "REBAR LAYER":
        raise option.refused("does not belong under a *SURFACE SECTION")
    if not option.rows:
        raise option.refused("needs a data line: name, area, spacing, position, material, angle")
    angular = option.get("GEOMETRY") == "ANGULAR"
    rows, layers = [], []
    for row in option.rows:
        material = row.name(4)
        flat_name = _used(option, material, blocks, used)
        if any(row.fields[6:]):
            raise option.refused(
                f"data '{next(filter(None, row.fields[6:]))}' is not honoured", row
            )
        if row.number(3, 0.0):
            raise option.refused("the position of a layer in its surface element must be 0", row)
        for j, what in ((1, "area"), (2, "spacing")):
            if not row.number(j) > 0:
                raise option.refused(f"the {what} must be positive", row)
        name = re.sub(r"\W", "_", row.name(0)) or "LAYER"
        rows.append(Row(row.place, ",".join((name, *row.fields[1:4], flat_name, *row.fields[5:]))))
        layers.append(
            RebarPly(
                row.name(0),
                section.name,
                material,
                row.number(1) * length**2,
                row.number(2) * (1.0 if angular else length),
                angular,
                row.number(5, 0.0),
                tuple(mesh.element_at[n] for n in section.elements),
            )
        )
    head = "*REBAR LAYER" + (", GEOMETRY=ANGULAR" if angular else "")
    write.block(Block(option.name, option.place, option.parameters, tuple(rows)), head, angular)
    return layers


def _layer_of(block: Block, row: Row) -> Block:
    """A line of *REBAR as a *REBAR LAYER. A spacing that is measured at a radius grows in
    proportion to the radius, unless the cords lie round the tyre: it is an angle."""
    angle, radius, spacing = row.number(3, 0.0), row.number(4, 0.0), row.text(2, "1.")
    is_fanned = radius != 0 and abs(angle) % 180 != 90
    if is_fanned:
        spacing = written(float(np.degrees(row.number(2, 1.0) / radius)))
    name = re.sub(r"\W", "_", block.get("NAME")) or "LAYER"
    material = block.parameters.get("MATERIAL", "")
    fields = [name, row.text(1), spacing, "0.", material, row.text(3, "0.")]
    parameters = {"GEOMETRY": "ANGULAR"} if is_fanned else {}
    return Block("REBAR LAYER", block.place, parameters, (Row(row.place, ",".join(fields)),))
