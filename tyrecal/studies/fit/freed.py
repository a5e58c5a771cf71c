"""Numbers of a case that one fit frees, and what is known of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from ...tyre.case import LoadedCase
from ...tyre.case.schema import Variable


class FreedVariable(Variable):
    """A number, and others that move with it as their uncertainty states: the variable's value is
    the first number's."""

    starts: list[float]  # each number as it is known, in its own unit
    steps: list[float]  # change of each by one standard deviation

    @property
    def sd(self) -> float:
        """Standard deviation of the first number."""
        return abs(self.steps[0])

    def in_sd(self, value: float) -> float:
        """How far a value is from what is known, in standard deviations."""
        return (value - self.start) / self.steps[0]

    def numbers(self, value: float) -> list[float]:
        """Each number: as it is known, and as many of its standard deviations as the first."""
        z = self.in_sd(value)
        return [start + step * z for start, step in zip(self.starts, self.steps, strict=True)]

    def with_copies(self, copies: Callable[[str], Sequence[str]]) -> Self:
        """The variable that moves each of its numbers and the copies of it alike; copies: paths of
        a path's, which a compound has if it is split by region."""
        counts = [1 + len(copies(path)) for path in self.sets]
        starts, steps = (np.repeat(each, counts).tolist() for each in (self.starts, self.steps))
        more = super().with_copies(copies)
        return more.model_copy(update={"starts": starts, "steps": steps})


def freed_variables(case: LoadedCase) -> dict[str, FreedVariable]:
    """The numbers that `with_freed` made variables, by name."""
    variables = case.case.variables.items()
    return {name: each for name, each in variables if isinstance(each, FreedVariable)}
