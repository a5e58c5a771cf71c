"""The section of a case: where it is drawn, its mesh, and what fills and reinforces it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from .parts import Degrees, Disagreement, Name, Part, Positive, Text, one_of

Element = Literal["CGAX8R", "CGAX8", "CGAX4R"]


class Gauge(Part):
    """A factor on the thickness between two lines, in some regions or in all."""

    between: Annotated[list[Text], Field(min_length=2, max_length=2)]
    regions: list[Text] | None = None
    factor: Annotated[float, Field(ge=0.1, le=10)]


class Outline(Part):
    """The outer and the inner curve (CSV), and what they do not show.

    ``belt_width_m``: of the wider belt, along the carcass; the rim holds what lies within
    ``rim_radius_m``. Depths: inner surface to carcass, to the first belt, to the second.
    """

    file: Text
    belt_width_m: Positive
    rim_radius_m: Positive
    carcass_depth_m: Positive = 1.2e-3
    belt_depth_m: Positive = 1.2e-3
    belt_spacing_m: Positive = 1.2e-3
    belt_step_m: Positive = 0.010


class SectionSource(Part):
    """``stations``: the station table, or ``outline``: two curves; CSV, relative to the case file.

    ``gauges`` scale it.
    """

    stations: Text | None = None
    outline: Outline | None = None
    gauges: list[Gauge] | None = None

    @property
    def file(self) -> str:
        """The CSV that the section is in."""
        return self.outline.file if self.outline else self.stations or ""

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        yield from one_of(values, "stations", "outline")


class Level(Part):
    """A mesh: elements per region of the half section, rows per gap between two lines.

    ``grading``: thickness of a row over that of the row inside it, per gap.
    """

    elements: dict[Name, Annotated[int, Field(ge=1, le=200)]]
    rows: list[Annotated[int, Field(ge=1, le=20)]]
    grading: list[Annotated[float, Field(ge=0.1, le=10)]] | None = None


class Mesh(Part):
    """Element type and the mesh levels by name; ``level`` is the one in use."""

    element: Element
    level: str
    levels: Annotated[dict[Name, Level], Field(min_length=1)]
    hourglass_stiffness_Pa: Positive | None = None


class Solid(Part):
    """A material in the whole section, or only in ``regions`` and/or ``between`` two lines."""

    material: str
    regions: Annotated[list[str], Field(min_length=1)] | None = None
    between: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None


class RebarLayer(Part):
    """Cords on a line of the section; ``angle_deg`` from the meridian, ``area_m2`` of one cord.

    Cords stand ``spacing_m`` apart or, with ``geometry: angular``, ``spacing_deg`` apart. The
    layer is as long as its line, or ends with some of its ``regions``.
    """

    line: str
    material: str
    area_m2: Positive
    geometry: Literal["constant", "angular"] = "constant"
    spacing_m: Positive | None = None
    spacing_deg: Annotated[float, Field(gt=0, le=360)] | None = None
    angle_deg: Degrees
    regions: Annotated[list[str], Field(min_length=1)] | None = None

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        geometry = values.get("geometry", "constant")
        pair = {"constant": ("spacing_m", "spacing_deg"), "angular": ("spacing_deg", "spacing_m")}
        if geometry in pair:
            needed, other = pair[geometry]
            if values.get(other) is not None:
                yield other, f"must be absent with geometry: {geometry}, which takes {needed}"
            if values.get(needed) is None:
                yield needed, f"must be given with geometry: {geometry}"
