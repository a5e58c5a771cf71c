"""The belts are wider or narrower than drawn."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...errors import InputError
from ..case import LoadedCase
from ..section.curve import CubicSpline, length_along
from ..section.section import Section, fill_lines
from .effect import Effect
from .parts import belt_edge, carcass_line, rim_edge, stations

Array = np.ndarray


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Both edges of all belts ``value``/2 further out, measured along the carcass."""
    section = case.section
    edge = belt_edge(case)
    ends = [stations(section, name)[1] for name, _ in section.regions]
    end = min((s for s in ends if s > edge), default=rim_edge(section))
    line = section.names.index(carcass_line(case))
    length = length_along(section.points[line])
    room = min(length[edge], length[end] - length[edge])
    if not abs(value) / 2 < 0.5 * room:
        raise InputError(f"must be less than {room:.3g} m either way")
    return replace(case, drawn=_slid(section, line, edge, end, value / 2))


@lru_cache(maxsize=8)
def _slid(section: Section, line: int, edge: int, end: int, distance: float) -> Section:
    """Stations slid along the section: not at the crown, ``distance`` (m) at ``edge``, not at
    ``end``, indices of stations; ``line``: index of the carcass' line, along which that is.

    Lines from end to end slide along themselves; what ends between them keeps its share of the
    distance from the carcass to the surface, so the tyre's shape and gauges stay.
    """
    filled = fill_lines(section)
    at = length_along(section.points[line])
    slid = at + distance * np.interp(at, [0, at[edge], at[end]], [0, 1, 0])
    whole = ~np.isnan(section.points).any((1, 2))
    move = np.zeros_like(filled)
    for k in np.flatnonzero(whole):
        move[k] = CubicSpline(at, filled[k])(slid) - filled[k]
    for k in np.flatnonzero(~whole):  # between the nearest whole lines
        inner, outer = np.flatnonzero(whole[:k])[-1], k + np.flatnonzero(whole[k:])[0]
        span = filled[outer] - filled[inner]
        share = np.sum((filled[k] - filled[inner]) * span, -1) / np.sum(span * span, -1)
        move[k] = move[inner] + share[:, None] * (move[outer] - move[inner])
    return replace(section, points=section.points + move)


EFFECT = Effect(
    id="belt_width",
    place=80,
    title="Belt width",
    symbol="db",
    unit="m",
    # belts are 0.75 to 0.80 of the section's width, the outer one 10 to 20 mm narrower
    low=-0.01,
    high=0.01,
    changes=("*NODE",),
    signature=(
        "[2,1] and [3,1] up 3 %, [c >= 1, 0] up 2 % at +10 mm, [0,0] and [1,1] hardly "
        "moved; a re-fit leaves [0,0] torsional 3 % too low"
    ),
    toggle="section a tyre of the same build, or X-ray it, and measure the belts",
    aliases=("cap_ply", "belt_angle", "bead_filler"),
    add=add,
    # error of its shifts, relative: belts end in steps, which move by their own amounts
    response_error=0.06,
)
