"""Where the parts of a tyre are in its section: carcass, belt, tread, sidewall, bead.

The lengths of the lines tell them apart: the carcass runs from bead to bead, belts end before.

A `Section` is half a cross-section, from the crown to the bead. Its lines go from the inner surface
(first) to the outer one (last), its stations from the crown (first) to the bead (last): ``points``
(line, station, 2) are r and z in m, NaN where a line is absent. Regions are runs of stations with a
name, the first one at the crown. ``rigid`` (station,) are the stations that the rim holds.
"""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ..case import LoadedCase
from ..section.section import Section

Array = np.ndarray


def present(section: Section) -> Array:
    """Whether a line is present at a station, (line, station)."""
    there: Array = ~np.isnan(section.points).any(-1)
    return there


def carcass_line(case: LoadedCase) -> str:
    """The innermost line of cords that runs from bead to bead. Raises InputError."""
    used = {layer.line for layer in case.case.rebar_layers.values()}
    for name, there in zip(case.section.names, present(case.section), strict=True):
        if there.all() and name in used:
            return name
    raise InputError("must be 0: no layer of cords runs from bead to bead in this case")


def carcass(case: LoadedCase) -> list[str]:
    """Names of the cord layers on the carcass line. Raises InputError."""
    line = carcass_line(case)
    return [name for name, layer in case.case.rebar_layers.items() if layer.line == line]


def belt_lines(case: LoadedCase) -> list[str]:
    """Lines of cords that start at the crown and end before the bead, from inside to outside.

    Raises InputError.
    """
    there = present(case.section)
    used = {layer.line for layer in case.case.rebar_layers.values()}
    lines = [
        name
        for name, stations in zip(case.section.names, there, strict=True)
        if name in used and stations[0] and not stations.all()
    ]
    if not lines:
        raise InputError("must be 0: this case has no belt, no layer of cords ends at the shoulder")
    return lines


def belts(case: LoadedCase) -> list[str]:
    """Names of the cord layers on the belts' lines at the crown, from inside to outside. Raises
    InputError.

    Left out are layers round the tyre (90 degrees), such as cap plies, and turn-ups, which are on
    the same line but not at the crown.
    """
    layers = case.case.rebar_layers
    top = case.section.regions[0][0]
    names = [
        name
        for line in belt_lines(case)
        for name, layer in layers.items()
        if layer.line == line and top in (layer.regions or [top]) and layer.angle_deg % 180 != 90
    ]
    if not names:
        raise InputError("must be 0: this case has no belt, all layers at the crown go round it")
    return names


def tread(case: LoadedCase) -> tuple[str, str]:
    """Inner and outer line of the tread: outside all cords, of one rubber. Raises InputError."""
    names, top = case.section.names, case.section.regions[0][0]
    inner = names.index(belt_lines(case)[-1])
    owner = None
    for solid in case.case.solids:
        low, high = solid.between or (names[0], names[-1])
        if high == names[-1] and top in (solid.regions or [top]):
            owner = names.index(low)
    return names[max(inner, owner or 0)], names[-1]


def turned_up(case: LoadedCase) -> tuple[str, list[str]] | None:
    """Line and regions of the carcass' turn-up; None if there is none.

    Raises InputError.
    """
    line = carcass_line(case)
    own = {case.case.rebar_layers[name].material for name in carcass(case)}
    for layer in case.case.rebar_layers.values():
        held = set(layer.regions or ()) & set(held_regions(case.section))
        if layer.line != line and layer.material in own and held:
            return layer.line, list(layer.regions or ())
    return None


def held_regions(section: Section) -> list[str]:
    """Names of the regions that end at a station that the rim holds."""
    edge = rim_edge(section)
    return [name for name, _, last in _regions(section) if last > edge]


def belt_edge(case: LoadedCase) -> int:
    """Index of the station at which the widest belt ends. Raises InputError."""
    there = present(case.section)
    places = [case.section.names.index(line) for line in belt_lines(case)]
    return int(max(np.flatnonzero(np.logical_and.accumulate(there[k]))[-1] for k in places))


def crown(case: LoadedCase) -> list[str]:
    """Names of the regions whose middle is within the widest belt. Raises InputError."""
    edge = belt_edge(case)
    return [name for name, first, last in _regions(case.section) if (first + last) / 2 < edge]


def sidewall(case: LoadedCase) -> list[str]:
    """Names of the regions whose middle is between belt and rim. Raises InputError."""
    edge, held = belt_edge(case), rim_edge(case.section)
    return [
        name for name, first, last in _regions(case.section) if edge <= (first + last) / 2 < held
    ]


def lower_sidewall(case: LoadedCase) -> list[str]:
    """Names of the regions of the sidewall below the widest point of the carcass. Raises
    InputError."""
    line = case.section.points[case.section.names.index(carcass_line(case))]
    widest = int(np.argmax(line[:, 1]))
    middle = {name: (first + last) / 2 for name, first, last in _regions(case.section)}
    names = [name for name in sidewall(case) if middle[name] > widest]
    if not names:
        raise InputError("must be 0: no region of this case is a lower half of the sidewall")
    return names


def rim_edge(section: Section) -> int:
    """Index of the first station that the rim holds."""
    return int(np.flatnonzero(section.rigid)[0])


def stations(section: Section, region: str) -> tuple[int, int]:
    """Indices of the first and last station of a region; neighbours share one."""
    return next((first, last) for name, first, last in _regions(section) if name == region)


def _regions(section: Section) -> list[tuple[str, int, int]]:
    """Name, first and last station of each region."""
    ends = np.cumsum([0, *(count for _, count in section.regions)])
    return [(name, int(ends[i]), int(ends[i + 1])) for i, (name, _) in enumerate(section.regions)]
