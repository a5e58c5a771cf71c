"""A user's deck in the templates' words, and solvers' refusals in the user's places."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from ...tyre.own_deck.flat import REFERENCE_NODE, Flat
from ...tyre.own_deck.text import Block, OwnDeckError, Place
from ...tyre.resolve import Tyre

BEFORE = 3  # lines of the inflation's template before the mesh: heading, its text, *RESTART
PLACE = re.compile(r"^inflate\.inp, line (\d+): ")


def own_section(tyre: Tyre) -> dict[str, Any]:
    """What stands in the deck: all as the mesh's text."""
    flat = tyre.flat
    point = tyre.case.rim.reference_point_m
    return {
        "mesh": {
            "reference_node": REFERENCE_NODE,
            "reference_r": point.r,
            "reference_z": point.z,
            "radius": max(point[0] for point in flat.mesh.nodes.values()),
        },
        "mesh_block": flat.text,
        "sets": flat.set_names,
        "solids": [],
        "layers": [],
        "materials": [],
        "hourglass": None,
    }


def trial(flat: Flat) -> float:
    """The mass, kg, of the tyre that the bundled solver makes of a flat deck.

    Raises OwnDeckError where it refuses something.
    """
    bundled = import_module("tyrecal_solvers.bundled.adapter")
    found = bundled.examine(flat.text, flat.long_term)
    if isinstance(found, float):
        return found
    line, words = found
    raise OwnDeckError(_origin(flat, line - 1) or flat.origins[0], words)


def asked_by_abaqus(blocks: Sequence[Block]) -> dict[str, list[str]]:
    """What ABAQUS ``refuses`` of a user's deck by its manual, and what is ``unknown`` to our
    grammar of it: sentences with file and line."""
    check = import_module("tyrecal_solvers.abaqus.check")
    found: dict[str, list[str]] = {"refuses": [], "unknown": []}
    for each in check.findings(blocks):
        sentence = str(each.block.refused(each.words, each.row))
        found["refuses" if each.sure else "unknown"].append(sentence)
    return found


def _origin(flat: Flat, line: int) -> Place | None:
    """Where a line of the flat mesh and materials comes from."""
    return flat.origins[line] if 0 <= line < len(flat.origins) else None


def explained(tyre: Tyre, words: str, header_lines: int) -> str:
    """A solver's refusal with the line of the user's deck in place of that of the flat one."""
    found = PLACE.match(words)
    if not found or not tyre.case.deck:
        return words
    place = _origin(tyre.flat, int(found[1]) - header_lines - BEFORE - 1)
    return f"{place.file}, line {place.line}: {words[found.end() :]}" if place else words
