"""The text of a new case, with comments, for a section."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML

from ..section.curve import length_along
from ..section.section import Section
from ..templates import environment, render
from .made_of import ConstructionParts
from .mistakes import CaseData
from .parts import SectionOrigin

ELEMENTS_BY_LEVEL = {"coarse": 14, "default": 28, "refined": 56}  # along the half section
LETTERS_A_LINE = 118  # of a case
OUTER_ROWS = {"coarse": 1, "default": 3, "refined": 4}  # between the outermost line and the surface


@dataclass(frozen=True)
class NewCase:
    """A case whose section is ``section``, from ``file`` in the case's folder. Its fields are the
    names in templates/case/case.yaml.j2."""

    section: Section
    made: ConstructionParts
    file: str
    name: str
    size: str
    pressure_kPa: float
    known_from: SectionOrigin
    origin: str = ""  # a sentence for the heading
    outline: Mapping[str, float] | None = None  # the keys of ``section.outline`` but its file
    loads_N: Sequence[float] = ()  # on the road; none: the template's, as of passenger cars

    def text(self) -> str:
        """The case as YAML with comments."""
        env = environment("case", None)
        env.filters["text"], env.filters["flow"] = plain_text, flow
        names = {
            **vars(self),
            "lines": self.section.names,
            "regions": [r for r, _ in self.section.regions],
            "levels": {level: _level(self.section, level) for level in ELEMENTS_BY_LEVEL},
        }
        return render(env, "case.yaml.j2", names)


def plain_text(words: str) -> str:
    """Text as YAML has it: plain where it stays text, else in quotes."""
    plain = (
        re.fullmatch(r"\w[\w ./()-]*", words) and YAML(typ="safe", pure=True).load(words) == words
    )
    return words if plain else json.dumps(words)


def flow(part: Any, indent: int) -> str:
    """A part of a case on as few lines as it takes, ``indent`` blanks before all but the first."""
    held = _flow(part).replace(": ", ":\0")  # a key and its value stay on one line
    return textwrap.fill(
        held,
        LETTERS_A_LINE - indent,
        subsequent_indent=(indent + 1) * " ",
        break_long_words=False,
        break_on_hyphens=False,
    ).replace("\0", " ")


def _flow(part: Any) -> str:
    if isinstance(part, Mapping):
        return "{" + ", ".join(f"{key}: {_flow(value)}" for key, value in part.items()) + "}"
    if isinstance(part, Sequence) and not isinstance(part, str):
        return "[" + ", ".join(map(_flow, part)) + "]"
    return part if isinstance(part, str) else _short(part)


def _short(value: float) -> str:
    """A number or switch as one writes it: 0.3, 66.0, 1.9e+11, 2.42e-7, false."""
    if isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, int) or value == 0 or 1e-3 <= abs(value) < 1e5:
        return repr(value)
    mantissa, _, power = f"{value:.12e}".partition("e")
    digits = mantissa.rstrip("0")
    return f"{digits}{'0' if digits.endswith('.') else ''}e{int(power):+d}"


def flow_lines(data: CaseData) -> str:
    """Keys with their values, texts, numbers or tables, as lines of YAML."""

    def flow(value: Any) -> str:
        if isinstance(value, Mapping):
            return "{" + ", ".join(f"{key}: {flow(each)}" for key, each in value.items()) + "}"
        return plain_text(value) if isinstance(value, str) else f"{value:.13g}"

    return "\n".join(f"{key}: {flow(value)}" for key, value in data.items())


def _level(section: Section, level: str) -> dict[str, Any]:
    """A mesh level: ``elements`` by region, of about the same length on the inner surface; ``rows``
    between neighbouring lines; ``grading``: rows of the tread 0.7 times as thick as those inside,
    None: all alike."""
    inner = section.points[0]
    arc = length_along(inner)
    elements, start = {}, 0
    for region, count in section.regions:
        share = (arc[start + count] - arc[start]) / arc[-1]
        elements[region] = max(1, round(ELEMENTS_BY_LEVEL[level] * share))
        start += count
    rows = [1] * (len(section.names) - 2) + [OUTER_ROWS[level]]
    grading = [1.0] * (len(rows) - 1) + [0.7] if rows[-1] > 1 else None
    return {"elements": elements, "rows": rows, "grading": grading}
