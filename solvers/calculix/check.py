"""Keywords of a section's deck that CalculiX 2.20 lacks by its manual, although other solvers
honour them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..language.model_rules import NO_REBAR
from ..language.table import RULES
from ..language.text import Block

ELEMENTS = {
    "CGAX": "its axisymmetric elements (CAX) do not twist, as belts make a tyre do",
    "SFMGAX": NO_REBAR,
    "RAX": "it has no rigid elements: *RIGID BODY takes a node set",
}


def lacking(blocks: Sequence[Block]) -> Iterator[tuple[Block, str]]:
    """Keywords that CalculiX has nothing for and why, each reason where it is met first."""
    seen = set()
    for block in blocks:
        rule = RULES.get(block.name)
        why: str | None = rule.calculix if rule else ""
        if block.name == "ELEMENT":
            kind = block.parameters.get("TYPE", "").upper()
            why = next((words for start, words in ELEMENTS.items() if kind.startswith(start)), None)
        if why and why not in seen:
            seen.add(why)
            yield block, why
