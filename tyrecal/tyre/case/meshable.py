"""What must agree between a case and its section: lines, regions, rows, and a mesh that fits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from .mistakes import Keys, suggestion
from .parts import WRONG
from .shape import entries, table

if TYPE_CHECKING:
    from ..section.section import Section

Problems = Iterator[tuple[Keys, str]]
MOST_ELEMENTS = 20_000


def places(data: Mapping[str, Any], section: Section) -> Problems:
    """Lines and regions exist, and every part of the section has a material."""
    lines = list(section.names)
    regions = [name for name, _ in section.regions]
    for name, layer in table(data, "rebar_layers").items():
        line = layer.get("line") if isinstance(layer, dict) else None
        if isinstance(line, str) and line not in lines[1:-1]:
            hint = suggestion(line, lines[1:-1])
            yield ("rebar_layers", name, "line"), f"is not a line inside the section{hint}"
        for j, region in enumerate(entries(layer, "regions")):
            if isinstance(region, str) and region not in regions:
                hint = suggestion(region, regions)
                yield ("rebar_layers", name, "regions", j), f"is not a region of the section{hint}"
    for i, gauge in enumerate(entries(table(data, "section"), "gauges")):
        for key, known in (("regions", regions), ("between", lines)):
            for j, word in enumerate(entries(gauge, key)):
                if isinstance(word, str) and word not in known:
                    place = ("section", "gauges", i, key, j)
                    yield place, f"is not one of the section's{suggestion(word, known)}"
    bare = {(region, gap) for region in regions for gap in range(len(lines) - 1)}
    whole = True
    for i, solid in enumerate(entries(data, "solids")):
        where, between = entries(solid, "regions"), entries(solid, "between")
        whole &= isinstance(solid, dict) and WRONG not in solid.values()
        for j, region in enumerate(where):
            if isinstance(region, str) and region not in regions:
                hint = suggestion(region, regions)
                yield ("solids", i, "regions", j), f"is not a region of the section{hint}"
        unknown = [line for line in between if line not in lines]
        for j, line in enumerate(between):
            if isinstance(line, str) and line in unknown:
                hint = suggestion(line, lines)
                yield ("solids", i, "between", j), f"is not a line of the section{hint}"
        low, high = 0, len(lines) - 1
        if between:
            if unknown or len(between) != 2:
                whole = False
                continue
            low, high = lines.index(between[0]), lines.index(between[1])
            if low >= high:
                yield ("solids", i, "between"), "must name the inner line first, then the outer"
                whole = False
        bare -= {(r, gap) for r in where or regions for gap in range(low, high)}
    if bare and whole and isinstance(data.get("solids"), list):
        region, gap = min(bare, key=lambda place: (regions.index(place[0]), place[1]))
        yield (
            ("solids",),
            (
                f"must cover the section: region '{region}' has no material"
                f" between '{lines[gap]}' and '{lines[gap + 1]}'"
            ),
        )


def levels(data: Mapping[str, Any], section: Section) -> Problems:
    """Every mesh level fits the section."""
    gaps = len(section.names) - 1
    regions = [name for name, _ in section.regions]
    for name, level in table(table(data, "mesh"), "levels").items():
        here: Keys = ("mesh", "levels", name)
        elements = table(level, "elements")
        if isinstance(level, dict) and isinstance(level.get("elements"), dict):
            for region in elements:
                if region not in regions:
                    hint = suggestion(region, regions)
                    yield (*here, "elements", region), f"is not a region of the section{hint}"
            for region in regions:
                if region not in elements:
                    yield (*here, "elements", region), "must be given, the section has this region"
        for key in ("rows", "grading"):
            counts = level.get(key) if isinstance(level, dict) else None
            if isinstance(counts, list) and len(counts) != gaps:
                each = "one for each gap between two lines"
                yield (*here, key), f"must have {gaps} entries, {each}, got {len(counts)}"
        count = _sum(elements.values()) * _sum(entries(level, "rows"))
        if count > MOST_ELEMENTS:
            yield here, f"must have at most {MOST_ELEMENTS} elements, elements x rows is {count}"


def folds(data: Mapping[str, Any], section: Section) -> str | None:
    """Why the section cannot be meshed at the chosen level of ``data``, which is right so far."""
    import numpy as np

    from ..section.gauges import with_gauges
    from ..section.mesh import build_mesh

    mesh = data["mesh"]
    level = mesh["levels"][mesh["level"]]
    elements = [level["elements"][region] for region, _ in section.regions]
    gauges = tuple(
        (tuple(g.get("regions") or ()), tuple(g["between"]), float(g["factor"]))
        for g in data["section"].get("gauges") or ()
    )
    try:
        with np.errstate(all="ignore"):
            built = build_mesh(
                with_gauges(section, gauges),
                elements,
                level["rows"],
                "8" in mesh["element"],
                level.get("grading"),
            )
    except ValueError as error:
        return str(error)
    if not np.isfinite(list(built.nodes.values())).all():
        return "two lines of the section run through one point, no mesh fits between them"
    return None


def _sum(values: Iterable[Any]) -> int:
    return sum(v for v in values if isinstance(v, int))
