"""Data fields of a keyword by name, with units and defaults, as its record has them."""

from __future__ import annotations

from collections.abc import Iterator

from .laws import LAW_CONSTANTS, LAWS_NOT_READ, MAX_ENERGY_ORDER, ON_A_LINE
from .rule import Field
from .table import RULES
from .text import Block

# exponents of the units of length and mass in those of fields; time is in seconds
DIMENSIONS: dict[str, tuple[int, int]] = {
    "stress": (-1, 1),
    "compliance": (1, -1),
    "density": (-3, 1),
    "area": (2, 0),
    "length": (1, 0),
}


def law_of(block: Block) -> tuple[str, int]:
    """Name and order of a *HYPERELASTIC's law. Raises the error of its place for two laws."""
    given = [law for law in LAW_CONSTANTS if law in block.parameters] or ["POLYNOMIAL"]
    if len(given) > 1:
        raise block.refused(f"{given[0]} and {given[1]} are two laws")
    order = block.parameters.get("N", "1")
    if order not in map(str, range(1, MAX_ENERGY_ORDER + 1)):
        raise block.refused(f"N={order} is no order from 1 to {MAX_ENERGY_ORDER}")
    return given[0], int(order)


def constants_of(block: Block) -> list[str]:
    """Names of the constants of a *HYPERELASTIC in their order; none if they are not on its lines.
    Raises the error of its place."""
    if {"TEST DATA INPUT", *LAWS_NOT_READ} & block.parameters.keys():
        return []
    law, order = law_of(block)
    return LAW_CONSTANTS[law](order)


def fields_of(block: Block) -> list[Field]:
    """The named data fields of each line of a block; of *HYPERELASTIC, of all lines together."""
    if block.name == "HYPERELASTIC":
        units = {"C": "stress", "m": "stress", "D": "compliance"}  # of C10, mu1, D1: first letters
        return [Field(name, units.get(name[0], ""), 0.0) for name in constants_of(block)]
    rule = RULES.get(block.name)
    return rule.fields_of(block.parameters) if rule else []


def placed_fields(block: Block) -> Iterator[tuple[Field, int, int]]:
    """Each named number that a block gives: field, row and place in the row."""
    fields = fields_of(block)
    for i, row in enumerate(block.rows):
        of_all = block.name == "HYPERELASTIC"
        own = fields[ON_A_LINE * i : ON_A_LINE * (i + 1)] if of_all else fields
        for j, field in enumerate(own):
            if row.text(j) and not field.name.startswith("_"):
                yield field, i, j
