"""A region of the section in several parts, so that a law can vary along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.effects.edit import changed, with_part

Array = np.ndarray


def divided(loaded: LoadedCase, region: str, parts: int) -> tuple[LoadedCase, list[str]]:
    """The same tyre with ``region`` in so many regions, and their names; the mesh is the same
    where its elements can be shared out evenly."""
    section, c = loaded.section, loaded.case
    count = dict(section.regions)[region]
    names = [f"{region}_{i}" for i in range(1, parts + 1)]
    ends = np.linspace(0, count, parts + 1).round().astype(int)
    pieces = list(zip(names, np.diff(ends).tolist(), strict=True))
    regions: list[tuple[str, int]] = []
    for name, size in section.regions:
        regions += pieces if name == region else [(name, size)]
    levels = {}
    for key, level in c.mesh.levels.items():
        elements: dict[str, int] = {}
        for name, size in level.elements.items():
            if name == region:
                shares = np.diff(np.linspace(0, max(size, parts), parts + 1).round().astype(int))
                elements |= dict(zip(names, shares.tolist(), strict=True))
            else:
                elements[name] = size
        levels[key] = with_part(level, elements=elements)
    solids = [with_part(s, regions=_named(s.regions, region, names)) for s in c.solids]
    layers = {
        name: with_part(layer, regions=_named(layer.regions, region, names))
        for name, layer in c.rebar_layers.items()
    }
    gauges = [
        with_part(g, regions=_named(g.regions, region, names)) for g in c.section.gauges or []
    ]
    made = changed(
        loaded,
        mesh=with_part(c.mesh, levels=levels),
        solids=solids,
        rebar_layers=layers,
        section=with_part(c.section, gauges=gauges or None),
    )
    return replace(made, drawn=replace(section, regions=tuple(regions))), names


def moved(loaded: LoadedCase, move: Callable[[Array], Array]) -> LoadedCase:
    """The case with the section's points (line, station, 2) replaced by ``move`` of them."""
    section = loaded.section
    return replace(loaded, drawn=replace(section, points=move(section.points.copy())))


def _named(regions: list[str] | None, region: str, names: list[str]) -> list[str] | None:
    if not regions:
        return regions
    return [new for old in regions for new in (names if old == region else [old])]
