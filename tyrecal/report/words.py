"""Modes, and doubts about a fit, in an engineer's words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

KNOWN = {
    (0, 0, "axial"): "lateral",
    (0, 0, "torsional"): "torsional",
    (1, 1, None): "pitch / yaw-camber",
    (1, 0, None): "vertical / fore-aft",
    (2, 0, None): "ovalisation",
}
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")

CLOSE, FAR = 2.0, 5.0  # % of deviation from a target
FAR_OFF = 30.0  # % after a fit: no tyre is that far from its model


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


def fit_doubts(result: Mapping[str, Any]) -> list[str]:
    """What the user of a fit (the content of fit.json) must not overlook."""
    doubts = []
    if not result["moved"]:
        doubts.append("THE FIT DID NOT MOVE: every variable ended where it started")
    if not result["converged"]:
        doubts.append(
            f"not converged: {result['message']}; projected gradient"
            f" {result['projected_gradient_norm']:.3g} {result['objective_unit']}"
        )
    for name, variable in result["variables"].items():
        if variable["at_bound"]:
            seen = variable["standard_error"] is not None
            why = "the data want it beyond" if seen else "the data do not see it"
            doubts.append(f"{name} ended at a bound: {why}")
    if failed := result["failed_evaluations"]:
        designs = "1 design" if failed == 1 else f"{failed} designs"
        doubts.append(f"{designs} could not be evaluated; the search stepped back")
    if result["label_margin"] < 0.3:
        doubts.append(
            f"a mode is hard to name (margin {result['label_margin']:.2f} of 1): two modes have"
            " met; look at their pictures"
        )
    far = [mode for mode in result["modes"] if abs(mode["deviation_percent"] or 0) > FAR_OFF]
    if 2 * len(far) > len(result["modes"]):
        doubts.append(
            f"most modes are still more than {FAR_OFF:g} % off: are the targets in Hz, with the"
            " right labels, at this pressure?"
        )
    values = result["singular_values"]
    if values and values[-1] < 1e-3 * values[0]:
        doubts.append("the data do not determine all variables: see singular_values in fit.json")
    return doubts


def map_resolution(combinations: int) -> str:
    """What the map on the section can show: its effective rank in words."""
    if not combinations:
        return (
            "A change of 20 % in stiffness or 10 % in mass of any parts would stay within the"
            " scatter of these data: the map is a hint at most, of a larger change of one part."
        )
    return (
        f"The data see {combinations} independent combination{'s' if combinations > 1 else ''} of"
        " parts (changes of 20 % in stiffness, 10 % in mass, beyond their scatter)."
    )
