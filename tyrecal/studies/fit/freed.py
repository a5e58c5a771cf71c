"""Numbers of a case that one fit frees, and what is known of them."""

from __future__ import annotations

from ...tyre.case import LoadedCase
from ...tyre.case.parts import Positive
from ...tyre.case.schema import Variable


class FreedVariable(Variable):
    """A number, or several that move together, with the standard deviation of what is known of
    it, in its own unit."""

    sd: Positive

    def in_sd(self, value: float) -> float:
        """How far a value is from what is known, in standard deviations."""
        return (value - self.start) / self.sd


def freed_variables(case: LoadedCase) -> dict[str, FreedVariable]:
    """The numbers that `with_freed` made variables, by name."""
    variables = case.case.variables.items()
    return {name: each for name, each in variables if isinstance(each, FreedVariable)}
