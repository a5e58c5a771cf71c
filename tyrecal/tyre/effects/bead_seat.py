"""The bead is not seated: there is a gap between bead and rim, from the flange's top down."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...errors import InputError
from ..case import LoadedCase
from ..section.curve import CubicSpline, length_along
from ..section.section import Section, fill_lines
from .edit import changed, unused, with_part
from .effect import Effect
from .parts import carcass_line, held_regions, present, rim_edge, stations

# share of the held rest that is let go too, so that no gap is shorter: short elements are a finer
# mesh of the clamped edge, which alone moves [0,0] lateral by 0.4 %
LEAST = 0.02
GAP_ENDING = "_gap"  # with which the region's name ends


def add(case: LoadedCase, value: float) -> LoadedCase:
    """The rim does not hold a share ``value`` of the bead's length, and `LEAST` of the rest. That
    part is a separate region with the bead's rubbers and cords, and half as many elements."""
    if not 0 <= value < 1:
        raise InputError("must be at least 0 and less than 1")
    section = case.section
    bead, *others = held_regions(section)
    first, last = stations(section, bead)
    if others or first != rim_edge(section):
        raise InputError(f"must be 0: the rim must hold one region, '{bead}'")
    for name, there in zip(section.names, present(section)[:, first + 1 : last + 1], strict=True):
        if there.any() and not there.all():
            raise InputError(f"must be 0: line '{name}' ends within the bead")
    gap = unused(f"{bead}{GAP_ENDING}", [name for name, _ in section.regions])

    def wider(regions: list[str] | None) -> list[str] | None:
        return [*regions, gap] if regions and bead in regions else regions

    own = case.case
    return changed(
        replace(case, drawn=_let_go(section, carcass_line(case), bead, gap, value)),
        solids=[with_part(solid, regions=wider(solid.regions)) for solid in own.solids],
        rebar_layers={
            name: with_part(layer, regions=wider(layer.regions))
            for name, layer in own.rebar_layers.items()
        },
        section=with_part(
            own.section,
            gauges=[
                with_part(gauge, regions=wider(gauge.regions)) for gauge in own.section.gauges or []
            ],
        ),
        mesh=with_part(
            own.mesh,
            levels={
                name: with_part(
                    level, elements={**level.elements, gap: max(1, level.elements[bead] // 2)}
                )
                for name, level in own.mesh.levels.items()
            },
        ),
    )


@lru_cache(maxsize=8)
def _let_go(section: Section, carcass: str, bead: str, gap: str, share: float) -> Section:
    """The section with region ``gap`` above ``bead``, of a share of its length along the carcass,
    not held; both have as many stations as the bead had."""
    first, last = stations(section, bead)
    whole = fill_lines(section)[:, first : last + 1].swapaxes(0, 1)  # (station, line, 2)
    along = length_along(whole[:, section.names.index(carcass)])
    count = last - first
    edge = (share + LEAST * (1 - share)) * along[-1]
    at = np.concatenate(
        [np.linspace(0, edge, count + 1), np.linspace(edge, along[-1], count + 1)[1:]]
    )
    points = CubicSpline(along, whole)(at).swapaxes(0, 1)
    points[~present(section)[:, last]] = np.nan
    points[:, 0] = section.points[:, first]
    k = section.regions.index((bead, count))
    return replace(
        section,
        points=np.concatenate(
            [section.points[:, :first], points, section.points[:, last + 1 :]], 1
        ),
        regions=(*section.regions[:k], (gap, count), *section.regions[k:]),
        rigid=np.insert(section.rigid, first, np.zeros(count, bool)),
    )


EFFECT = Effect(
    id="bead_seat",
    place=125,
    title="Bead seat",
    symbol="g",
    unit="",
    # a bead that was mounted dry stops on its way up the rim; beyond half of it, it rolls so far
    # that turned-up cords wrinkle, and the mesh says how finely
    low=0.0,
    high=0.5,
    changes=("*NODE", "*ELEMENT", "*BOUNDARY"),
    signature=(
        "all down, [0,0] torsional and [1,1] by 2.6 % at g = 0.5, [0,0] lateral and [2,1] by 2 %,"
        " the rest by 1 %; a re-fit leaves [1,1] 1.2 % too low, [1,0] 1 % too high"
    ),
    toggle="let the air out, wet both beads with soap, inflate until they snap onto their seats,"
    " and check that the moulded line runs level with the flange all round",
    aliases=("rim_width",),
    add=add,
    # error of its shifts, relative: how far a bead rolls about its wires
    response_error=0.08,
)
