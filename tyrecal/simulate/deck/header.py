"""What a deck is of, as the comment that it begins with."""

from __future__ import annotations

from ...tyre.case import LoadedCase
from ...tyre.case.identity import tyre_sha256

LONGEST_NAME = 200  # of a case, as a line of a deck has at most 256 characters
FIRST = b"** Written by tyrecal: "
HEADER_LINES = 3


def header(case: LoadedCase) -> str:
    """The comment that every deck of a tyre begins with: what it is of.

    Nothing in it differs between two studies of one case and mesh, nor between editions of the
    tool; what else asks the same shares the record too, whose keys are of decks `without_header`.
    """
    c = case.case
    return (
        f"{FIRST.decode()}{c.name[:LONGEST_NAME]}\n"
        f"** tyre_sha256 {tyre_sha256(case)}, mesh {c.mesh.level}\n"
        "** SI units: m, kg, s, Pa; angles in degrees, of rebar layers from the meridian\n"
    )


def without_header(text: bytes) -> bytes:
    """A file of a run, a deck without what it is called: what the solver is asked."""
    return text.split(b"\n", HEADER_LINES)[-1] if text.startswith(FIRST) else text
