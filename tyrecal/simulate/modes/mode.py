"""A labelled mode [c, m] of the tyre."""

from __future__ import annotations

from dataclasses import dataclass

from ..evaluate.results import RawMode

FAMILIES = ("in-plane", "out-of-plane")
KNOWN = {
    (0, 0, "axial"): "lateral",
    (0, 0, "torsional"): "torsional",
    (1, 1, None): "pitch / yaw-camber",
    (1, 0, None): "vertical / fore-aft",
    (2, 0, None): "ovalisation",
}
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


@dataclass(frozen=True, order=True)
class Label:
    """[c, m]: c waves round the circumference; m nodal circles of the radial motion on the belt.

    m = 0 is in-plane, 1 out-of-plane (the belt tilts), 2 and more bend the belt across its width.
    The two [0, 0] modes move the belt as a rigid ring and differ in ``kind``: ``axial`` (along
    the axle) and ``torsional`` (about it); all others have kind None.
    """

    c: int
    m: int
    kind: str | None = None

    @property
    def family(self) -> str | None:
        """``in-plane``: [c,0] and [0,0] torsional; ``out-of-plane``: [c,1] and [0,0] axial, which
        move the belt likewise; None: overtones, and modes across the belt."""
        if self.c == 0:
            return {"torsional": FAMILIES[0], "axial": FAMILIES[1]}.get(self.kind or "")
        return FAMILIES[self.m] if self.m < 2 else None

    @property
    def said(self) -> str:
        """As people say it; files and options have the label itself: ``axial`` is lateral."""
        return str(self).replace("axial", "lateral")

    @property
    def motion(self) -> str:
        """What the tyre does: that of [2,1] is 'first out-of-plane bending'."""
        if (self.c, self.m, self.kind) in KNOWN:
            return KNOWN[self.c, self.m, self.kind]
        if self.m > 1:
            return "belt bends across its width"
        if self.c < 2:
            return "overtone"
        order = ORDINALS[self.c - 2] if self.c - 2 < len(ORDINALS) else f"{self.c - 1}th"
        return f"{order} {'out-of' if self.m else 'in'}-plane bending"

    def __str__(self) -> str:
        return f"[{self.c},{self.m}]" + (f" {self.kind}" if self.kind else "")


@dataclass(frozen=True)
class Mode:
    """A label on a solver's mode. ``clarity``: how far the label's share of the motion leads
    the next label's, 0 (a tie) to 1; ``position``: index in the evaluation's modes."""

    label: Label
    frequency_Hz: float
    multiplicity: int
    clarity: float
    position: int
    raw: RawMode
