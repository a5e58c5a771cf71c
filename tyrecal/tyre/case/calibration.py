"""The calibration of a case: what may vary, what was measured, and what may be off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from .analysis import Load
from .parts import (
    WRONG,
    Disagreement,
    Frequency,
    NotNegative,
    Number,
    Part,
    Positive,
    Text,
    number,
    one_of,
)

MEASURED_SIGMA = {"contact_area_m2": "sigma_m2", "vertical_stiffness_N_per_m": "sigma_N_per_m"}
"""What a footprint target can hold, and the key of its standard deviation."""
Weight = Annotated[NotNegative, Field(le=1e6)]


def cannot_fit(weights: Sequence[float], free: int) -> str | None:
    """Why targets of these weights are none to fit ``free`` variables to; None where they are."""
    count = sum(weight > 0 for weight in weights)
    if not count:
        return "every target has the weight 0: there is nothing to fit to"
    if count < free:
        targets = "1 target" if count == 1 else f"{count} targets"
        return (
            f"{targets} cannot determine {free} free variables: give more, or hold variables with"
            " --fix"
        )
    return None


class Variable(Part):
    """A design variable: the numbers it sets (dotted paths), its start and its bounds."""

    sets: Annotated[list[str], Field(min_length=1)]
    start: Number
    lower: Number
    upper: Number
    scale: Literal["log", "linear"] = "log"

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        start, lower, upper = (number(values, key) for key in ("start", "lower", "upper"))
        if lower is not None and upper is not None and not lower < upper:
            yield "upper", f"must be greater than lower, {lower:g}"
        elif start is not None and lower is not None and start < lower:
            yield "start", f"must be at least lower, {lower:g}"
        elif start is not None and upper is not None and start > upper:
            yield "start", f"must be at most upper, {upper:g}"
        if lower is not None and lower <= 0 and values.get("scale", "log") == "log":
            yield "lower", "must be greater than 0, or the variable needs scale: linear"


class TargetMode(Part):
    """A measured mode [c, m]; ``kind`` tells the two [0, 0] apart; ``sigma_Hz``, its standard
    deviation, counts as 1 Hz where it is not known."""

    c: Annotated[int, Field(ge=0, le=20)]
    m: Annotated[int, Field(ge=0, le=3)]  # beyond, the belt's motion has no clear order
    kind: Literal["axial", "torsional"] | None = None
    frequency_Hz: Frequency
    weight: Weight = 1.0
    sigma_Hz: Positive | None = None

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        c, m, kind = number(values, "c"), number(values, "m"), values.get("kind")
        if c is None or m is None:
            return
        if c == m == 0 and kind is None:
            yield "kind", "must be axial or torsional for the mode [0,0]"
        if (c or m) and kind is not None:
            yield "kind", f"must be absent: only [0,0] has a kind, this mode is [{c},{m}]"


class TargetFootprint(Part):
    """A measured contact area, or tangent vertical stiffness, at a load, with its sigma."""

    load_N: Load
    contact_area_m2: Positive | None = None
    sigma_m2: Positive | None = None
    vertical_stiffness_N_per_m: Positive | None = None
    sigma_N_per_m: Positive | None = None
    weight: Weight = 1.0

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        given = [key for key in MEASURED_SIGMA if values.get(key) is not None]
        if not given and WRONG in values.values():  # a misspelt key, which is reported
            return
        if not given:
            both = " or ".join(MEASURED_SIGMA)
            yield "load_N", f"must come with what was measured at this load, {both}"
        elif len(given) > 1:
            yield given[1], f"must be a target of its own: this one holds {given[0]} already"
        else:
            for key, sigma in MEASURED_SIGMA.items():
                if key in given and values.get(sigma) is None:
                    yield sigma, f"must be given: the standard deviation of {key}, in its unit"
                if key not in given and values.get(sigma) is not None:
                    yield sigma, f"must be absent: it is of {key}, this target is {given[0]}"


class Targets(Part):
    """What was measured, and where it comes from."""

    source: Text = ""
    modes: list[TargetMode] = Field(default_factory=list)
    footprint: list[TargetFootprint] = Field(default_factory=list)

    @property
    def loads_N(self) -> list[float]:
        """Loads at which something was measured, rising."""
        return sorted({target.load_N for target in self.footprint})

    @property
    def weights(self) -> list[float]:
        """The weight of each."""
        return [t.weight for t in self.modes] + [t.weight for t in self.footprint]


class Uncertainty(Part):
    """A source of error: numbers nobody calibrates, all off together by a standard deviation.

    ``percent`` of each number or ``absolute``, in its unit; ``signs``: -1 for those that fall
    where the others rise.
    """

    sets: Annotated[list[Text], Field(min_length=1)]
    percent: Positive | None = None
    absolute: Positive | None = None
    signs: list[Annotated[int, Field(ge=-1, le=1)]] | None = None

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        yield from one_of(values, "percent", "absolute")
        sets, signs = values.get("sets"), values.get("signs")
        if isinstance(sets, list) and isinstance(signs, list) and len(signs) != len(sets):
            yield "signs", f"must have {len(sets)} entries, one for each of sets"
