"""The wheel of a case: the rigid rim, what holds it, and the gas between rim and tyre."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from .parts import Disagreement, NotNegative, Number, Part, Positive, number


class ReferencePoint(Part):
    """A point of the section's plane, m."""

    r: Number
    z: Number


def _values(part: Any) -> Mapping[str, Any]:
    """The values of a part, checked or as in the file; none where it is wrong."""
    if isinstance(part, Part):
        return part.__dict__
    return part if isinstance(part, Mapping) else {}


class Spindle(Part):
    """Compliance of what holds the wheel, at the rim's reference point; 0 = clamped."""

    lateral_m_per_N: NotNegative = 0.0
    radial_m_per_N: NotNegative = 0.0
    torsional_rad_per_N_m: NotNegative = 0.0
    tilt_rad_per_N_m: NotNegative = 0.0

    @property
    def gives_way(self) -> bool:
        """Whether the wheel moves on it."""
        return any(self.__dict__.values())


class Rim(Part):
    """The rigid rim; its reference point is the wheel's centre.

    In a vibration it moves on its ``spindle``, or is ``free``; its own mass and moments of
    inertia (polar: about the axle) are then those of wheel and hub, by default of steel, 17 inch.
    """

    reference_point_m: ReferencePoint
    mass_kg: Positive = 15.0
    polar_inertia_kg_m2: Positive = 0.43
    diametral_inertia_kg_m2: Positive = 0.27
    spindle: Spindle = Spindle()
    free: bool = False

    @property
    def moves(self) -> bool:
        """Whether it moves in a vibration."""
        return self.free or self.spindle.gives_way

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        spindle, point = (_values(values.get(key)) for key in ("spindle", "reference_point_m"))
        soft, free = any(number(spindle, key) for key in spindle), values.get("free") is True
        if soft and free:
            yield "free", "must be false where the spindle has a compliance"
        r = number(point, "r")
        if (soft or free) and r:
            yield "reference_point_m", f"must have r = 0 where the rim moves, got {r:g}"


class Cavity(Part):
    """The gas in the tyre as it moves with the walls; ``share`` of its mass and stiffness, 0 =
    a constant pressure only, 1 = the gas as it is."""

    gas: Literal["air", "helium", "sulphur_hexafluoride"] = "air"
    temperature_C: Annotated[float, Field(gt=-100, lt=300)] = 20.0
    share: Annotated[NotNegative, Field(le=100)] = 0.0
