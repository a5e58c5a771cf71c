"""The analysis of a case: what is computed, by which solver, and the road it is pressed on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Field

from .materials import Moduli
from .parts import Disagreement, Frequency, Name, NotNegative, Part, Positive

LEAST_LOAD_N, LARGEST_LOAD_N = 1.0, 1e6  # outside, no tyre finds its balance on a road
Load = Annotated[Positive, Field(ge=LEAST_LOAD_N, le=LARGEST_LOAD_N)]


class Analysis(Part):
    """What is computed: the inflation, then modes up to ``highest_harmonic``."""

    static_moduli: Moduli = "long_term"
    static_increments: Annotated[int, Field(ge=1, le=1000)] = 10
    vibration_frequency_Hz: Frequency | None = None
    sectors: Annotated[int, Field(ge=8, le=1000)] = 60
    highest_harmonic: Annotated[int, Field(ge=0, le=20)] = 4
    modes_per_harmonic: Annotated[int, Field(ge=1, le=10)] = 2


class Road(Part):
    """The flat, rigid road that a tyre is pressed on, and the mesh round the tyre for it.

    ``stiffness_Pa_per_m``: contact pressure over overclosure; ``elastic_slip_m``: slip before
    friction is full; ``element_angles_deg``: lengths from the patch's middle to the top.
    """

    friction: NotNegative = 0.5
    stiffness_Pa_per_m: Positive = 1e10
    elastic_slip_m: Annotated[float, Field(ge=1e-6)] = 1e-4
    element_angles_deg: Annotated[list[Positive], Field(min_length=1, max_length=200)] = Field(
        default_factory=lambda: [4.0] * 3 + [5.0, 8.0, 17.0, 45.0, 93.0]
    )
    loads_N: Annotated[list[Load], Field(min_length=1, max_length=100)] = Field(
        default_factory=lambda: [500.0, *(1000.0 * kN for kN in (1, 2, 3, 4, 5, 6, 8))]
    )

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        angles, loads = _numbers(values, "element_angles_deg"), _numbers(values, "loads_N")
        if angles and abs(sum(angles) - 180) > 1e-6:
            yield "element_angles_deg", f"must have the sum 180, got {sum(angles):g}"
        if any(after <= before for before, after in pairwise(loads)):
            yield "loads_N", "must rise from one to the next"


def _numbers(values: Mapping[str, Any], key: str) -> list[float]:
    """The list at ``key``; empty where there is none, or one with a wrong entry."""
    value = values.get(key)
    right = isinstance(value, list) and all(isinstance(x, int | float) for x in value)
    return value if right and value else []


class SolverChoice(Part):
    """Which solver runs, how long one run (of footprints: a load) may take, its own options."""

    name: Name
    time_limit_s: Positive
    options: dict[str, Any] = Field(default_factory=dict)
