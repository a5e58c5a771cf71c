"""Cords that bear no compression, against CalculiX's inflated state.

CalculiX's plies are thin solids, stiff in tension and compression alike. A state is right for
cords that may go slack if all of them are taut in it, so the adapter checks it after the run. The
sector deck has a comment for each such ply, written by the tool's template:

    ** no compression: {"layer": ..., "region": ..., "material": ..., "angle_deg": ...,
                        "ends": [[a, b], [c, d]]}

in one line; a cord runs between the middles of the nodes a, b and c, d at Theta = 0.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import RunFailed
from .results import Fields

Array = np.ndarray
STRIP_COMMENT = re.compile(r"^\*\* no compression: (\{.*\})$", re.M)
TAUT = -1e-6  # strain above which a cord counts as taut: round-off of the result file
MAX_PLACES = 3  # in the message


@dataclass(frozen=True)
class Strip:
    """A ply of tension-only cords in one element: where it is, its cord's angle in degrees from
    the meridian towards theta, and the two pairs of nodes that it runs between."""

    layer: str
    region: str
    material: str
    angle_deg: float
    ends: list[list[int]]  # node numbers, of the end towards -z first


def read_strips(sector: Path) -> list[Strip]:
    """Plies in the sector deck whose cords must be taut."""
    text = sector.read_text(encoding="utf-8")
    return [Strip(**json.loads(comment)) for comment in STRIP_COMMENT.findall(text)]


def refuse_slack(strips: list[Strip], inflated: Fields) -> None:
    """Raises RunFailed (``unstable``) if a cord that bears no compression is compressed."""
    strain = np.log(stretches(strips, inflated))
    worst: dict[tuple[str, str, str], float] = {}
    for strip, value in zip(strips, strain.tolist(), strict=True):
        place = strip.layer, strip.region, strip.material
        worst[place] = min(value, worst.get(place, 0.0))
    slack = sorted((value, *place) for place, value in worst.items() if value < TAUT)
    if not slack:
        return
    places = [f"{layer} in {region} by {-100 * value:.2g} %" for value, layer, region, _ in slack]
    named = ", ".join(places[:MAX_PLACES]) + (" and elsewhere" if places[MAX_PLACES:] else "")
    raise RunFailed(
        "unstable",
        f"CalculiX's inflated tyre compresses cords that bear no compression: {named}; its plies"
        " do not go slack: take --solver bundled or abaqus, a higher pressure, or set"
        f" materials.{slack[0][3]}.bears_compression: true",
    )


def stretches(strips: list[Strip], inflated: Fields) -> Array:
    """Length over undeformed length (strip,) of the cords: chords of the displaced section, whose
    x, y, z at Theta = 0 are r, theta, z."""
    row = {number: i for i, number in enumerate(inflated.nodes.tolist())}
    ends = np.vectorize(row.__getitem__)(np.array([strip.ends for strip in strips]))
    X = inflated.points[ends].mean(2)  # (strip, end, 3)
    u = inflated.blocks[0][2][ends].mean(2)  # DISP of the inflated state, the only block
    tangent, slope = X[:, 1] - X[:, 0], u[:, 1] - u[:, 0]
    length = np.linalg.norm(tangent, axis=1)[:, None]
    place, moved = X.mean(1), u.mean(1)
    hoop = np.stack([-moved[:, 1], place[:, 0] + moved[:, 0], np.zeros(len(X))], -1)
    angle = np.radians([strip.angle_deg for strip in strips])[:, None]
    # as `cords.cord_rows`: cos d/ds + sin / R d/dTheta of the place
    cord = np.cos(angle) * (tangent + slope) / length + np.sin(angle) * hoop / place[:, :1]
    return np.asarray(np.linalg.norm(cord, axis=1))
