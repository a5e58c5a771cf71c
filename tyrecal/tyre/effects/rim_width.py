"""The rim is wider or narrower than the one that the section was drawn on."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...errors import InputError
from ..case import LoadedCase
from ..section.section import Section
from .effect import Effect
from .parts import belt_edge, carcass_line, rim_edge

Array = np.ndarray


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Beads ``value`` further apart. The sidewall bends to them, and its carcass keeps its length.

    This is the shape of a mounted carcass that bends but does not stretch. The stresses of the
    bending are left out. With them, the frequencies of the fitted P235/75R17 differ by less than
    0.07 % at half an inch.
    """
    section = case.section
    line = section.names.index(carcass_line(case))
    free = section.points[line, belt_edge(case) : rim_edge(section) + 1]
    most = 0.2 * float(np.linalg.norm(free[-1] - free[0]))
    if not abs(value) / 2 < most:
        raise InputError(f"must be less than {2 * most:.3g} m either way")
    edges = belt_edge(case), rim_edge(section)
    return replace(case, drawn=_mounted(section, line, *edges, value / 2))


@lru_cache(maxsize=8)
def _mounted(section: Section, line: int, start: int, end: int, distance: float) -> Section:
    """The section with its stations from ``end`` on moved by ``distance``, m, along the axle.

    Between ``start`` and ``end`` the carcass, ``line``, bends as an inextensible strip of constant
    stiffness whose ends do not turn: its tangent turns by phi(s) with phi' = a + b r + c z, the
    moment of the forces at its ends; s, r and z over its length, r and z from their means. Points
    off the carcass turn with it.
    """
    carcass = section.points[line, start : end + 1]
    step = np.diff(carcass, axis=0)
    length = np.hypot(*step.T)
    middle = (carcass[1:] + carcass[:-1]) / 2
    lever = np.column_stack([np.ones(len(middle)), (middle - middle.mean(0)) / length.sum()])

    def turned(moment: Array) -> tuple[Array, Array]:
        """Angle at each station (n,), rad, and its displacement (n, 2), m; moment: a, b, c."""
        phi = np.concatenate([[0.0], np.cumsum(lever @ moment * length / length.sum())])
        new = _rotated(step, (phi[1:] + phi[:-1]) / 2)
        return phi, np.concatenate([np.zeros((1, 2)), np.cumsum(new - step, axis=0)])

    def miss(moment: Array) -> Array:
        """Error of the end (3,): its place over the length, r and z, and its angle, rad."""
        phi, moved = turned(moment)
        return np.append((moved[-1] - [0.0, distance]) / length.sum(), phi[-1])

    from scipy.optimize import root  # late: its import takes longer than an answer from the record

    solution = root(miss, np.zeros(3), tol=1e-13)
    if not abs(solution.fun).max() < 1e-9:
        raise InputError("must be smaller: the sidewall does not reach the rim")
    phi, moved = turned(solution.x)
    points = section.points.copy()
    offset = points[:, start : end + 1] - carcass
    points[:, start : end + 1] = carcass + moved + _rotated(offset, phi)
    points[:, end + 1 :, 1] += distance
    return replace(section, points=points)


def _rotated(vectors: Array, angle: Array) -> Array:
    """(r, z) vectors turned by an angle from r to z, one per station."""
    r, z = vectors[..., 0], vectors[..., 1]
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * r - sin * z, sin * r + cos * z], -1)


EFFECT = Effect(
    id="rim_width",
    place=120,
    title="Rim width",
    symbol="dB",
    unit="m",
    # rims approved for a size differ by half an inch from one to the next
    low=-0.0127,
    high=0.0127,
    changes=("*NODE",),
    signature=(
        "[0,0] lateral and [1,1] up 7 %, [2,1] up 4 %, [3,1] up 3 % at +12.7 mm, in-plane "
        "modes up 1 to 2 %; half of it remains after a re-fit"
    ),
    toggle="measure the rim between its flanges; mount the tyre on the next wider rim",
    aliases=("carcass_turn_up", "bead_seat"),
    add=add,
    # error of its shifts, relative: how the sidewall bends where the flange holds it
    response_error=0.05,
)
