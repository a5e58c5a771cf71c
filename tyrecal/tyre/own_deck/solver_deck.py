"""The flat deck of a user's one: in SI units, without parts, generated nodes and what only asks for
output, in the words that solvers honour; each of its lines knows where it comes from.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from .classify import ClassifiedDeck
from .model import Assigned, DeckModel
from .numbers import written
from .solver_mesh import Line, SolverMesh, solver_mesh
from .text import Block, Place, Row, fields


@dataclass(frozen=True, eq=False)
class RebarPly:
    """A rebar layer of the user's deck, with its names there."""

    name: str
    set_name: str  # of its section's elements
    material: str
    area_m2: float  # of a cord
    spacing: float  # m, across the cords; degrees round the axle if angular
    angular: bool
    angle_deg: float  # from the meridian, in the order of an element's nodes, towards Theta
    elements: tuple[int, ...]  # numbers in the flat deck


@dataclass(frozen=True, eq=False)
class SolverDeck:
    """The flat deck without its step."""

    mesh: SolverMesh
    lines: tuple[Line, ...]
    materials: tuple[str, ...]  # the user's names, of the solid sections in order
    sections: tuple[str, ...]  # the user's sets of these sections, likewise
    plies: tuple[RebarPly, ...]
    pressure_Pa: float
    long_term: bool  # whether the moduli of the step that inflates are
    blocks: ClassifiedDeck  # the user's, in the deck's own units, as is the model
    model: DeckModel

    @property
    def set_names(self) -> list[str]:
        """Names of the element sets, rubber first."""
        groups = {"SOLID": self.model.solids, "PLY": self.model.plies}
        return [f"{word}_{k + 1}" for word, group in groups.items() for k in range(len(group))]

    @property
    def static_moduli(self) -> str:
        """Moduli of the step that inflates, as a case names them."""
        return "long_term" if self.long_term else "instantaneous"

    @property
    def text(self) -> str:
        """The lines."""
        return "\n".join(text for text, _ in self.lines)


def translate(deck: ClassifiedDeck, model: DeckModel, length: float, mass: float) -> SolverDeck:
    """The flat deck of a model whose units of length and mass are so many m and kg. Raises
    OwnDeckError."""
    mesh = solver_mesh(model, length)
    write = _Writer(deck, mesh, length, mass)
    plies = list[RebarPly]()
    for k, section in enumerate(model.solids, start=1):
        block = section.block
        name = write.used(block, block.need("MATERIAL"))
        more = f", CONTROLS={controls}" if (controls := block.get("CONTROLS")) else ""
        write.line(f"*SOLID SECTION, ELSET=SOLID_{k}, MATERIAL={name}{more}", block.place)
        for option in deck.options.get(block, ()):
            write.block(option, "*HOURGLASS STIFFNESS")
        if any(row.text(0) for row in block.rows[1:]):
            raise block.refused("takes no more than one data line", block.rows[1])
    for k, section in enumerate(model.plies, start=1):
        block, layers = section.block, deck.options.get(section.block, [])
        if block.name == "MEMBRANE SECTION":
            name = write.used(block, block.need("MATERIAL"))
            write.block(block, f"*MEMBRANE SECTION, ELSET=PLY_{k}, MATERIAL={name}")
        else:
            write.line(f"*SURFACE SECTION, ELSET=PLY_{k}", block.place)
            if not layers:
                raise block.refused("has no *REBAR LAYER under it: give its cords")
        for option in [*layers, *(_layer_of(*rebar) for rebar in section.rebars)]:
            plies += write.layers(section, option)
    for block in deck.model:
        if block.name == "SECTION CONTROLS":
            head = f"*SECTION CONTROLS, NAME={block.need('NAME')}, HOURGLASS=STIFFNESS"
            if "HOURGLASS" not in block.parameters or block.rows:
                raise block.refused("only HOURGLASS=STIFFNESS is honoured of it")
            write.line(head, block.place)
    write.materials()
    static = next(block for block in deck.inflation if block.name == "STATIC")
    _, row, i = model.pressure[0]
    return SolverDeck(
        mesh,
        (*mesh.lines, *write.lines),
        tuple(section.block.get("MATERIAL") for section in model.solids),
        tuple(section.name for section in model.solids),
        tuple(plies),
        row.number(i) * mass / length,  # units of mass / (length s^2) to Pa
        "LONG TERM" in static.parameters,
        deck,
        model,
    )


class _Writer:
    """Lines with numbers in SI units, and the materials that they use."""

    def __init__(self, deck: ClassifiedDeck, mesh: SolverMesh, length: float, mass: float):
        self.deck, self.mesh, self.length, self.mass = deck, mesh, length, mass
        self.lines = list[Line]()
        self.defined = _materials(deck)
        self.names: dict[str, str] = {}  # in the flat deck, of those that are used

    def line(self, text: str, place: Place) -> None:
        """Add a line."""
        self.lines.append((text, place))

    def block(self, block: Block, head: str, angular: bool = False) -> None:
        """A keyword line, and the block's data in SI units; angular: a spacing stays in degrees."""
        self.line(head, block.place)
        scales = {}
        for field, i, j in fields.placed_fields(block):
            L, M = fields.DIMENSIONS.get(field.unit, (0, 0))  # powers of length and mass
            scales[i, j] = self.length**L * self.mass**M
        for i, row in enumerate(block.rows):
            texts = list(row.fields)
            for j, text in enumerate(texts):
                scale = 1.0 if angular and j == 2 else scales.get((i, j), 1.0)
                if scale != 1.0 and text:
                    texts[j] = written(row.number(j) * scale)
            self.line(", ".join(texts), row.place)

    def used(self, block: Block, name: str) -> str:
        """The flat deck's name of a material that a block uses."""
        if name not in self.defined:
            raise block.refused(f"the material {name} is not defined")
        material = self.defined[name]
        if not any(each.name == "DENSITY" for each in self.deck.options.get(material, ())):
            raise material.refused(f"the material {name} needs a *DENSITY")
        if name not in self.names:
            simple = re.fullmatch(r"[A-Z][A-Z0-9_\-]{0,60}", name)
            self.names[name] = name if simple else f"MATERIAL_{len(self.names) + 1}"
        return self.names[name]

    def materials(self) -> None:
        """Those that are used, with their options."""
        for name, plain_name in self.names.items():
            self.line(f"*MATERIAL, NAME={plain_name}", self.defined[name].place)
            for option in self.deck.options[self.defined[name]]:
                given = option.parameters.items()
                values = (f", {key}" + (f"={value}" if value else "") for key, value in given)
                self.block(option, f"*{option.name}{''.join(values)}")

    def layers(self, section: Assigned, option: Block) -> list[RebarPly]:
        """Write a *REBAR LAYER of a section; returns its layers."""
        if option.name != "REBAR LAYER":
            raise option.refused(f"is not honoured of a *{section.block.name}")
        if not option.rows:
            raise option.refused("needs a line: name, area, spacing, position, material, angle")
        angular = option.get("GEOMETRY") == "ANGULAR"
        rows, layers = [], []
        for row in option.rows:
            flat_name = self.used(option, row.name(4))
            if row.number(3, 0.0):
                raise option.refused("the position of a layer in its element must be 0", row)
            for j, what in ((1, "area"), (2, "spacing")):
                if not row.number(j) > 0:
                    raise option.refused(f"the {what} must be positive", row)
            name = re.sub(r"\W", "_", row.name(0)) or "LAYER"
            texts = (name, *row.fields[1:4], flat_name, *row.fields[5:])
            rows.append(Row(row.place, ",".join(texts)))
            layers.append(
                RebarPly(
                    row.name(0),
                    section.name,
                    row.name(4),
                    row.number(1) * self.length**2,
                    row.number(2) * (1.0 if angular else self.length),
                    angular,
                    row.number(5, 0.0),
                    tuple(self.mesh.element_at[n] for n in section.elements),
                )
            )
        head = "*REBAR LAYER" + (", GEOMETRY=ANGULAR" if angular else "")
        self.block(replace(option, rows=rows), head, angular)
        return layers


def _materials(deck: ClassifiedDeck) -> dict[str, Block]:
    """*MATERIAL by name."""
    by_name: dict[str, Block] = {}
    for block in deck.model:
        if block.name == "MATERIAL":
            name = block.need("NAME")
            if name in by_name:
                raise block.refused(f"the material {name} is defined twice")
            by_name[name] = block
            options = deck.options.get(block, [])
            for k, option in enumerate(options):
                if option.name in (each.name for each in options[:k]):
                    raise option.refused(f"is given twice under {name}")
                fields.fields_of(option)
    return by_name


def _layer_of(block: Block, row: Row) -> Block:
    """A line of *REBAR (elements, area, spacing, angle, radius) as a *REBAR LAYER. A spacing that
    is measured at a radius grows in proportion to the radius, unless the cords lie round the tyre:
    it is an angle."""
    angle, radius, spacing = row.number(3, 0.0), row.number(4, 0.0), row.text(2, "1.")
    is_fanned = radius != 0 and abs(angle) % 180 != 90
    if is_fanned:
        spacing = written(float(np.degrees(row.number(2, 1.0) / radius)))
    name = re.sub(r"\W", "_", block.get("NAME")) or "LAYER"
    material = block.parameters.get("MATERIAL", "")
    fields = [name, row.text(1), spacing, "0.", material, row.text(3, "0.")]
    parameters = {"GEOMETRY": "ANGULAR"} if is_fanned else {}
    return Block("REBAR LAYER", block.place, parameters, (Row(row.place, ",".join(fields)),))
