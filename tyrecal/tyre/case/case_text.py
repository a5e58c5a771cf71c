"""The text of a new case, with comments, for a section."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from ..section.section import Section, SectionError
from ..templates import environment, render

ELEMENTS_BY_LEVEL = {"coarse": 14, "default": 28, "refined": 56}  # along the half section, by level
OUTER_ROWS = {"coarse": 1, "default": 3, "refined": 4}  # between the outermost line and the surface


def new_case(
    section: Section,
    file: str,
    name: str,
    size: str,
    pressure_kPa: float,
    origin: str = "",
    outline: Mapping[str, float] | None = None,
    carcass_plies: int = 1,
) -> str:
    """YAML of a case whose section is ``section``, from ``file`` in the case's folder.

    Lines from the crown to the bead become the carcass (each of ``carcass_plies`` layers), lines
    that end at the shoulder the belts. origin: a sentence for the heading; outline: the keys of
    ``section.outline`` but its file. Raises SectionError where no line can be the carcass.
    """
    there = ~np.isnan(section.points).any(-1)
    inside = list(zip(section.names, there, strict=True))[1:-1]
    plies = [line for line, present in inside if present.all() for _ in range(carcass_plies)]
    belts = [line for line, present in inside if present[0] and not present.all()]
    if not plies:
        raise SectionError(
            "no line between the surfaces runs from the crown to the bead: the carcass needs one"
        )
    env = environment("case", None)
    env.filters["text"] = plain_text
    names: dict[str, Any] = {
        "file": file,
        "name": name,
        "size": size,
        "pressure_kPa": pressure_kPa,
        "origin": origin,
        "outline": outline,
        "lines": section.names,
        "regions": [r for r, _ in section.regions],
        "levels": {level: _level(section, level) for level in ELEMENTS_BY_LEVEL},
        "carcass": _numbered("carcass", plies),
        "belts": _numbered("belt", belts, always=True),
    }
    return render(env, "case.yaml.j2", names)


def plain_text(words: str) -> str:
    """As YAML has it: plain where it stays text, else in quotes."""
    plain = (
        re.fullmatch(r"\w[\w ./()-]*", words) and YAML(typ="safe", pure=True).load(words) == words
    )
    return words if plain else json.dumps(words)


def _numbered(word: str, lines: list[str], always: bool = False) -> dict[str, str]:
    """Layers by name, each with its line."""
    if len(lines) == 1 and not always:
        return {word: lines[0]}
    return {f"{word}_{i}": line for i, line in enumerate(lines, start=1)}


def _level(section: Section, level: str) -> dict[str, Any]:
    """Elements of about the same length, at least one a region; rows thinner towards the road."""
    middle = section.points[0]
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle, axis=0).T))])
    elements, start = {}, 0
    for region, count in section.regions:
        share = (arc[start + count] - arc[start]) / arc[-1]
        elements[region] = max(1, round(ELEMENTS_BY_LEVEL[level] * share))
        start += count
    rows = [1] * (len(section.names) - 2) + [OUTER_ROWS[level]]
    grading = [1.0] * (len(rows) - 1) + [0.7] if rows[-1] > 1 else None
    return {"elements": elements, "rows": rows, "grading": grading}
