"""The materials of a case: rubber and cords."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from .parts import WRONG, Disagreement, Frequency, Number, Part, Positive, number

Moduli = Literal["long_term", "instantaneous"]
MOST_RELAXED = 0.999  # of a modulus: what is left must be a tyre's


class Prony(Part):
    """A term of the Prony series: shares of the shear and bulk modulus, relaxation time."""

    g: Annotated[float, Field(ge=0, lt=1)]
    k: Annotated[float, Field(ge=0, lt=1)]
    tau_s: Annotated[Positive, Field(ge=1e-9, le=1e9)]


class Rubber(Part):
    """Mooney-Rivlin: C10 (I1 - 3) + C01 (I2 - 3) + (J - 1)^2 / D1, with a Prony series.

    ``moduli`` says whether the constants are those of relaxed or of instantaneous rubber. In a
    mode of frequency f the shear modulus is (f / reference_frequency_Hz)^frequency_exponent times
    as large.
    """

    kind: Literal["rubber"]
    C10_Pa: Number
    C01_Pa: Number
    D1_per_Pa: Positive
    moduli: Moduli = "long_term"
    prony: list[Prony] = Field(default_factory=list)
    frequency_exponent: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    reference_frequency_Hz: Frequency = 60.0
    density_kg_per_m3: Positive

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        c10, c01 = number(values, "C10_Pa"), number(values, "C01_Pa")
        if c10 is not None and c01 is not None and not c10 + c01 > 0:
            yield "C10_Pa", f"must be greater than -C01_Pa, C10_Pa + C01_Pa is {c10 + c01:g}"
        for share in "gk":
            terms = values.get("prony")
            terms = terms if isinstance(terms, list) else []
            total = sum(number(dict(term), share) or 0 for term in terms if term is not WRONG)
            if total > MOST_RELAXED:
                least = f"must have a sum of all {share} of at most {MOST_RELAXED:g}"
                yield "prony", f"{least}, got {total:.9g}"


class Cord(Part):
    """A linear elastic cord."""

    kind: Literal["cord"]
    youngs_modulus_Pa: Positive
    poissons_ratio: Annotated[float, Field(ge=0, lt=0.5)]
    density_kg_per_m3: Positive
