"""The carcass is turned round the bead and ends outside, part of the way up the sidewall."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...errors import InputError
from ..case import LoadedCase
from ..section.section import Section, fill_lines
from .edit import unused, with_layers, with_part
from .effect import Effect
from .parts import carcass, carcass_line, held_regions, lower_sidewall, present, stations, turned_up


def add(case: LoadedCase, value: float) -> LoadedCase:
    """The carcass once more, ``value`` times as stiff and heavy, up to the widest point.

    It is on the line next to the outer surface, and this line continues to the bead; other layers
    on it stay where they were.
    """
    if not value > 0:
        raise InputError("must be at least 0")
    if turned_up(case):
        raise InputError("must be 0: the carcass of this case is turned up already, as a layer")
    section, names = case.section, case.section.names
    line = carcass_line(case)
    outside = names[-2]
    regions = [*lower_sidewall(case), *held_regions(section)]
    layers = dict(case.case.rebar_layers)
    if outside != line:
        elsewhere = [name for name, _ in section.regions if name not in regions]
        for name, layer in layers.items():
            if layer.line == outside:
                own = [region for region in layer.regions or elsewhere if region not in regions]
                layers[name] = with_part(layer, regions=own)
        case = replace(case, drawn=_continued(section, outside, tuple(regions)))
    for name in carcass(case):
        layer = layers[name]
        layers[unused(f"{name}_turn_up", layers)] = with_part(
            layer,
            line=outside,
            regions=regions,
            area_m2=value * layer.area_m2,
            angle_deg=0.0 - layer.angle_deg,  # the ply is folded over
        )
    return with_layers(case, layers)


@lru_cache(maxsize=8)
def _continued(section: Section, line: str, regions: tuple[str, ...]) -> Section:
    """The section with a line that is there in ``regions`` too, at the points that `fill_lines`
    gives it in a mesh."""
    place = section.names.index(line)
    points, filled = section.points.copy(), fill_lines(section)
    where = np.zeros(points.shape[1], bool)
    for region in regions:
        first, last = stations(section, region)
        where[first : last + 1] = True
    where &= ~present(section)[place]
    points[place, where] = filled[place, where]
    return replace(section, points=points)


EFFECT = Effect(
    id="carcass_turn_up",
    place=100,
    title="Carcass turn-up",
    symbol="e",
    unit="",
    # 1: the turn-up is the same ply
    low=0.0,
    high=1.0,
    changes=("*REBAR LAYER", "*ELEMENT", "*SURFACE SECTION"),
    signature=(
        "all up, [0,0] lateral and [1,1] most: +3 % at e = 1 and a soft carcass (0.7 MN/m),"
        " [c,0] +1 to +2 %; A_carcass absorbs all but 0.4 %"
    ),
    toggle="section a tyre of the same build and measure the height at which the turn-up ends",
    aliases=("rim_width",),
    add=add,
    # error of its shifts, relative: it ends anywhere from the filler's tip to the shoulder
    response_error=0.10,
)
