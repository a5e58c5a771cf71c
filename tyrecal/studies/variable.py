"""Design variables as the optimiser has them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError
from ..simulate.deck.tyre_design import NEAR_ZERO
from ..tyre.case import LoadedCase, start_values

# sd of ln of a start whose uncertainty the case does not state: 95 % within a factor of 2.7
START_SPREAD = 0.5


@dataclass(frozen=True)
class DesignVariable:
    """A design variable: bounds in its own unit; ``log`` scaled inside the optimiser or not;
    percent, sd: standard deviation of its start, sd in its own unit, None where it is not stated.

    >>> stiffness = DesignVariable("C10", start=1e6, lower=1e5, upper=1e7)
    >>> stiffness.value(stiffness.scaled(1e6)), round(stiffness.slope(2e6))
    (1000000.0, 2000000)
    """

    name: str
    start: float
    lower: float
    upper: float
    log: bool = True
    percent: float | None = None
    sd: float | None = None

    @property
    def spread(self) -> float:
        """Standard deviation of the coordinate about the start's, before any measurement; at most
        that of a uniform distribution within the bounds."""
        width = self.scaled(self.upper) - self.scaled(self.lower)
        if self.sd is not None:
            stated = self.sd / self.slope(self.start)
        elif self.percent is None:
            stated = START_SPREAD if self.log else width
        elif self.log:
            stated = math.log1p(self.percent / 100)
        else:
            stated = self.percent / 100 * abs(self.start) / (self.upper - self.lower)
        return min(stated, width / math.sqrt(12))

    def scaled(self, value: float) -> float:
        """The optimiser's coordinate of a value."""
        return math.log(value) if self.log else (value - self.lower) / (self.upper - self.lower)

    def value(self, x: float) -> float:
        """The value at an optimiser's coordinate, inside the bounds to the last bit."""
        if x == self.scaled(self.start):
            return self.start
        raw = math.exp(x) if self.log else self.lower + x * (self.upper - self.lower)
        return min(max(raw, self.lower), self.upper)

    def slope(self, value: float) -> float:
        """d value / d coordinate."""
        return value if self.log else self.upper - self.lower


def read_variables(case: LoadedCase) -> list[DesignVariable]:
    """All variables of the case, as `read_variable` has each. Raises InputError.

    >>> [v.name for v in read_variables(case)]
    ['A_belt', 'A_carcass', 'C10']
    """
    return [read_variable(case, name) for name in case.case.variables]


def read_variable(case: LoadedCase, name: str) -> DesignVariable:
    """A variable as the optimiser has it: next to 0 where it moves effects and a bound is 0, as
    most have no slope there, where their keywords leave the deck. Raises InputError where it starts
    outside its bounds."""
    v, start = case.case.variables[name], start_values(case)[name]
    if not v.lower <= start <= v.upper:
        raise InputError(
            f"variable '{name}' starts at {start:g}: it must start within its bounds,"
            f" {v.lower:g} to {v.upper:g}"
        )
    effect = all(path.startswith("effects.") for path in v.sets)
    least = NEAR_ZERO * max(abs(v.lower), abs(v.upper)) if effect else 0.0
    lower, upper = v.lower or least, v.upper or -least
    start = min(max(start, lower), upper)
    return DesignVariable(name, start, lower, upper, v.scale == "log", v.percent, v.sd)
