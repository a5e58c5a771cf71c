"""The case file as typed data; attributes are named as the file's keys, units as in the names."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from ..plugins import IDS
from .analysis import Analysis, Road, SolverChoice
from .calibration import Targets, Uncertainty, Variable
from .materials import Cord, Rubber
from .nonuniform import PointMass, RoadSpring, Splice
from .parts import Name, NotNegative, Number, Part, Text
from .section import Mesh, RebarLayer, SectionSource, Solid
from .wheel import Cavity, Rim


def _every_effect(given: dict[str, float]) -> dict[str, float]:
    """Those not given are absent: 0."""
    return {**dict.fromkeys(IDS, 0.0), **given}


class Case(Part):
    """One tyre, its mesh and analysis, what may vary and what was measured.

    ``spin_rad_per_s``: the tyre turns about its axle, not touching a road. ``effects``: parameters
    of effects that are in it, by id, in the effect's unit.
    """

    format: Annotated[int, Field(ge=1, le=1)]  # Literal[1] would take true
    name: Text
    size: Text
    pressure_kPa: Annotated[Number, Field(ge=0, lt=2000)]
    section: SectionSource
    mesh: Mesh
    materials: Annotated[
        dict[Name, Annotated[Rubber | Cord, Field(discriminator="kind")]], Field(min_length=1)
    ]
    solids: Annotated[list[Solid], Field(min_length=1)]
    rebar_layers: dict[Name, RebarLayer] = Field(default_factory=dict)
    rim: Rim
    cavity: Cavity = Cavity()
    spin_rad_per_s: Annotated[NotNegative, Field(le=1e4)] = 0.0
    point_mass: PointMass = PointMass()
    road_spring: RoadSpring = RoadSpring()
    splice: Splice = Splice()
    analysis: Analysis
    road: Road = Road()
    effects: Annotated[dict[str, Number], AfterValidator(_every_effect)] = Field(
        default_factory=lambda: dict.fromkeys(IDS, 0.0)
    )
    variables: dict[Name, Variable] = Field(default_factory=dict)
    targets: Targets = Targets()
    uncertainties: dict[Name, Uncertainty] = Field(default_factory=dict)
    solver: SolverChoice
    templates: Text | None = None

    def plain(self) -> dict[str, Any]:
        """The case as plain data, defaults and all."""
        return self.model_dump(exclude_none=True)

    @property
    def loads_N(self) -> list[float]:
        """Loads at which the tyre is pressed, rising: the road's and those with a target."""
        return sorted({*self.road.loads_N, *self.targets.loads_N})
