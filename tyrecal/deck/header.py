"""What a deck is of, as the comment that it begins with."""

from __future__ import annotations

from ..case import LoadedCase
from ..case.identity import tyre_sha256

LONGEST_NAME = 200  # of a case, as a line of a deck has at most 256 characters


def header(case: LoadedCase) -> str:
    """The comment that every deck of a tyre begins with: what it is of.

    Nothing in it differs between two studies that ask the same, nor between editions of the tool:
    they share the record of its evaluation.
    """
    c = case.case
    return (
        f"** Written by tyrecal: {c.name[:LONGEST_NAME]}\n"
        f"** tyre_sha256 {tyre_sha256(case)}, mesh {c.mesh.level}\n"
        "** SI units: m, kg, s, Pa; angles in degrees, of rebar layers from the meridian\n"
    )
