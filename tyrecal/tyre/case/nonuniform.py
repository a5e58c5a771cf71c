"""What makes the tyre of a case differ round its circumference: a mass, a splice, a road."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from .parts import NotNegative, Number, Part, Positive, Text


class PointMass(Part):
    """A lumped mass on the tread, at the angle 0 and the height z over the middle."""

    mass_kg: NotNegative = 0.0
    z_m: Number = 0.0


class RoadSpring(Part):
    """A road that barely touches: springs from the tread to the ground at the angle 0, over
    ``width_m`` about the middle; the deflection by the static load is left out."""

    radial_N_per_m: NotNegative = 0.0
    lateral_N_per_m: NotNegative = 0.0
    tangential_N_per_m: NotNegative = 0.0
    width_m: Positive = 0.08

    @property
    def stiffnesses(self) -> dict[str, float]:
        """Those that are there, N/m, by direction."""
        named = {
            "radial": self.radial_N_per_m,
            "lateral": self.lateral_N_per_m,
            "tangential": self.tangential_N_per_m,
        }
        return {direction: stiffness for direction, stiffness in named.items() if stiffness}


class Splice(Part):
    """A sector about the angle 0 in which numbers of the case are larger by ``share`` of
    themselves: materials, layers and densities, but no geometry."""

    share: Annotated[float, Field(gt=-1, le=10)] = 0.0
    width_deg: Annotated[float, Field(gt=0, le=180)] = 10.0
    numbers: Annotated[list[Text], Field(min_length=1)] = Field(
        default_factory=lambda: ["materials.rubber.C10_Pa"]
    )
