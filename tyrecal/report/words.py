"""Modes in an engineer's words."""

from __future__ import annotations

KNOWN = {
    (0, 0, "axial"): "lateral",
    (0, 0, "torsional"): "torsional",
    (1, 1, None): "pitch / yaw-camber",
    (1, 0, None): "vertical / fore-aft",
    (2, 0, None): "ovalisation",
}
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def motion(c: int, m: int, kind: str | None = None) -> str:
    """What the tyre does in mode [c, m]: ``motion(2, 1)`` is 'first out-of-plane bending'."""
    if (c, m, kind) in KNOWN:
        return KNOWN[c, m, kind]
    if m > 1:
        return "belt bends across its width"
    if c < 2:
        return "overtone"
    order = ORDINALS[c - 2] if c - 2 < len(ORDINALS) else f"{c - 1}th"
    return f"{order} {'out-of' if m else 'in'}-plane bending"
