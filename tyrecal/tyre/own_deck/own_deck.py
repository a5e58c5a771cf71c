"""A user's deck, read once: its numbers by name, and the flat deck that it is for any of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Literal

from . import numbers as numbers_of
from .classify import ClassifiedDeck, classify
from .gauge import Gauges, thickened
from .model import DeckModel, build
from .solver_deck import SolverDeck, translate
from .text import Block, OwnDeckError, Place, number_from, read_blocks, table

Units = Literal["m", "mm"]
UNIT_LENGTH = {"m": 1.0, "mm": 1e-3}  # of a unit of length, m
UNIT_MASS = {"m": 1.0, "mm": 1e3}  # of a unit of mass, kg: mm, t, s, MPa
# lowest and highest of tyres' materials: kg/m3, or t/mm3
DENSITIES: dict[Units, tuple[float, float]] = {"m": (300.0, 2e4), "mm": (3e-10, 2e-8)}
# keywords whose numbers change neither the mesh nor what holds or presses it
OF_NO_MESH = {*table.MATERIAL_OPTIONS, "REBAR LAYER", "PARAMETER", "AMPLITUDE"}


@dataclass(eq=False)
class OwnDeck:
    """The deck in ``path`` in its ``units``."""

    path: Path
    units: Units
    blocks: tuple[Block, ...]
    texts: Mapping[str, str]  # of its files, by name relative to its folder
    # the last filled block at each place, and the last models by the blocks of their mesh
    _filled: dict[int, Block] = field(default_factory=dict, repr=False)
    _models: dict[tuple[Block, ...], DeckModel] = field(default_factory=dict, repr=False)

    @cached_property
    def places(self) -> dict[str, tuple[int, int, int]]:
        """Paths of its plain numbers, to block, row and field; field -1: a *PARAMETER's value."""
        return numbers_of.paths(self.blocks)

    @cached_property
    def marks(self) -> dict[str, Block]:
        """Marks of the deck."""
        return numbers_of.marks(self.blocks)

    @cached_property
    def _marked(self) -> set[int]:
        """Places of the blocks whose numbers depend on marks or parameters."""
        return {k for k, block in enumerate(self.blocks) if numbers_of.is_marked(block)}

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Plain numbers of the deck by path, as the text has them."""
        rows = {path: (self.blocks[k].rows[i], j) for path, (k, i, j) in self.places.items()}
        return {
            path: number_from(numbers_of.assigned(row)[1] if j < 0 else row.text(j))
            for path, (row, j) in rows.items()
        }

    @cached_property
    def idle(self) -> dict[str, str]:
        """Paths of parameters that are no numbers of a case whose deck this is, and why."""
        acting = {f"PARAMETER / {name}" for name in numbers_of.acting_parameters(self.blocks)}
        given = [path for path in self.numbers if path.startswith("parameter / ")]
        idle = [path for path in given if path.upper() not in acting]
        return dict.fromkeys(idle, "sets only the pressure, or nothing: use pressure_kPa")

    @cached_property
    def section_numbers(self) -> dict[str, float]:
        """Its plain numbers that change the section."""
        return {path: x for path, x in self.numbers.items() if path not in self.idle}

    @cached_property
    def sha256(self) -> str:
        """Hash of all its content except plain numbers, independent of indentation and comments."""
        numbers = set(self.places.values())
        parts = []
        for k, block in enumerate(self.blocks):
            fields = [
                "" if (k, i, j) in numbers or (k, i, -1) in numbers else text
                for i, row in enumerate(block.rows)
                for j, text in enumerate(row.fields)
            ]
            if block.name not in table.OUTPUT_KEYWORDS:
                parts.append((block.name, sorted(block.parameters.items()), fields))
        return sha256(json.dumps([self.units, parts]).encode()).hexdigest()

    def with_numbers(self, numbers: Mapping[str, float]) -> list[Block]:
        """The blocks with all marks, parameters and numbers set. Raises OwnDeckError."""
        changes: dict[int, dict[tuple[int, int], float]] = {}
        for path, value in numbers.items():
            if path in self.places and value != self.numbers[path]:
                place, i, j = self.places[path]
                changes.setdefault(place, {})[i, j] = value
        known: numbers_of.Parameters = {}
        result = []
        for place, block in enumerate(self.blocks):
            if place in changes:
                block = numbers_of.replaced(block, changes[place])
            if place in self._marked:
                block = numbers_of.filled(block, numbers, known)
                last = self._filled.setdefault(place, block)
                if block.identity == last.identity:
                    block = last  # options and models know their blocks
                self._filled[place] = block
            if block.name == "PARAMETER":
                numbers_of.parameters(block, known)
            result.append(block)
        return result

    def model(self, deck: ClassifiedDeck) -> DeckModel:
        """The section of classified blocks, remembered while the mesh's own stay the same."""
        blocks = (*deck.model, *deck.inflation, *deck.contact)
        key = tuple(block for block in blocks if block.name not in OF_NO_MESH)
        if key not in self._models:
            while len(self._models) > 3:
                self._models.pop(next(iter(self._models)))
            self._models[key] = build(deck)
        return self._models[key]

    def flat(self, numbers: Mapping[str, float], gauges: Gauges = ()) -> SolverDeck:
        """The flat deck with numbers set and ``gauges`` of its parts, in SI units. Raises
        OwnDeckError."""
        deck = classify(self.with_numbers(numbers))
        model = thickened(self.model(deck), gauges) if gauges else self.model(deck)
        return translate(deck, model, UNIT_LENGTH[self.units], UNIT_MASS[self.units])


def read_own_deck(path: Path, units: Units | None = None) -> OwnDeck:
    """The deck, with units derived from its densities where they are not given. Raises
    OwnDeckError, OSError."""
    blocks, texts = read_blocks(path)
    if not blocks:
        raise OwnDeckError(Place(path.name, 1), "there is no keyword in it")
    return OwnDeck(path, units or recognised(blocks), tuple(blocks), texts)


def recognised(blocks: Sequence[Block]) -> Units:
    """The units that the densities are in. Raises OwnDeckError where these do not determine
    them."""
    rows = [(b, b.rows[0]) for b in blocks if b.name == "DENSITY" and b.rows]
    values = [(b, row.number(0)) for b, row in rows if not numbers_of.GIVEN.search(row.text(0))]
    outside = {
        units: [b for b, value in values if not low <= value <= high]
        for units, (low, high) in DENSITIES.items()
    }
    for units, others in outside.items():
        if values and not others:
            return units
    block = (min(outside.values(), key=len) or blocks)[0]  # the odd one
    raise block.refused("the units cannot be inferred from the densities: give --units m or mm")
