"""What CalculiX 2.20 has nothing for of a section's deck that others honour, by its manual."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol, TypeVar

GENERATION = "it generates no mesh"
NO_PARTS = "it has no parts and instances"
NO_REBAR = "it has no rebar: cords are solids of a stiff direction there"
HOURGLASS = "its hourglass control has no stiffness to set"
LACKING = {
    **dict.fromkeys(("SYSTEM", "NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY"), GENERATION),
    **dict.fromkeys(("PART", "INSTANCE", "ASSEMBLY"), NO_PARTS),
    **dict.fromkeys(("SURFACE SECTION", "REBAR LAYER"), NO_REBAR),
    **dict.fromkeys(("HOURGLASS STIFFNESS", "SECTION CONTROLS"), HOURGLASS),
    "EMBEDDED ELEMENT": "it embeds no elements",
    "PARAMETER": "it has no parameters",
    "SYMMETRIC MODEL GENERATION": "it reflects and revolves nothing",
    "NO COMPRESSION": "its elastic law bears compression, and it passes over the keyword",
    "VISCOELASTIC": "its hyperelastic rubber does not relax",
}
ELEMENTS = {
    "CGAX": "its axisymmetric elements (CAX) do not twist, as belts make a tyre do",
    "SFMGAX": NO_REBAR,
    "RAX": "it has no rigid elements: *RIGID BODY takes a node set",
}


class Block(Protocol):
    """A keyword."""

    @property
    def name(self) -> str:
        """In upper case, single blanks."""

    @property
    def parameters(self) -> Mapping[str, str]:
        """By upper-case name."""


Keyword = TypeVar("Keyword", bound=Block)


def lacking(blocks: Sequence[Keyword]) -> Iterator[tuple[Keyword, str]]:
    """Keywords that CalculiX has nothing for and why, each reason where it is met first."""
    said = set()
    for block in blocks:
        why = LACKING.get(block.name)
        if block.name == "ELEMENT":
            kind = block.parameters.get("TYPE", "").upper()
            why = next((words for start, words in ELEMENTS.items() if kind.startswith(start)), None)
        if why and why not in said:
            said.add(why)
            yield block, why
