"""Numbers that a fit frees within what is known of them: variables of that fit alone.

Each is bounded by three of its standard deviations. What is known of it stays a value like those
that were measured, so that the fit weighs both: q = 1 + 0.01 (x - x0) / s, known to be 1 with a
standard deviation of 0.01. Its residual is (x - x0) / s, x the number itself, x0 what is known of
it and s the standard deviation of that; 1 and 0.01 make it a target above 0 in any unit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from ...errors import InputError
from ...files import Json
from ...tyre.case import LoadedCase, number_at
from ...tyre.case.mistakes import suggestion
from ...tyre.case.schema import Variable
from ...tyre.number_units import EFFECT_PATH, unit_of
from ...tyre.own_deck.numbers import as_known
from ..inference.uncertainties import Source, sources


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


FREED_WITHIN = 3.0  # standard deviations of what is known


def with_freed(case: LoadedCase, names: Sequence[str]) -> LoadedCase:
    """The case with uncertain numbers, by the name of their uncertainty or by path, as further
    variables. Raises InputError."""
    variables: Json = dict(case.case.variables)
    # uncertain fields of the section set no number
    known = [source for source in sources(case)[0] if not source.field]
    for name in dict.fromkeys(names):
        source = _uncertainty(case, name, known)
        if source.name in case.case.variables:
            raise InputError(f"{source.name} is an uncertainty and a variable: rename one of them")
        variables[source.name] = _variable(case, source)
    return replace(case, case=case.case.model_copy(update={"variables": variables}))


def without_freed(case: LoadedCase) -> LoadedCase:
    """The case as its file has it, with its own variables alone."""
    freed = freed_variables(case)
    own = {name: each for name, each in case.case.variables.items() if name not in freed}
    return replace(case, case=case.case.model_copy(update={"variables": own}))


def _uncertainty(case: LoadedCase, name: str, known: Sequence[Source]) -> Source:
    """The uncertainty that has this name or sets this path. Raises InputError."""
    path = as_known(name, case.deck_numbers)
    for source in known:
        if name == source.name or path in source.steps:
            return source
    if name in case.case.variables:
        raise InputError(f"{name} is a variable of the case, which the fit changes already")
    names = [source.name for source in known]
    try:
        number_at(case, name)
    except InputError:
        raise InputError(
            f"there is no uncertain number '{name}'{suggestion(name, names)}"
        ) from None
    for own, variable in case.case.variables.items():
        if path in variable.sets:
            raise InputError(
                f"{name} is set by the variable '{own}', which the fit changes already"
            )
    raise InputError(
        f"nothing is known of {name}: state its standard deviation in the case, as in"
        f" uncertainties: {{my_number: {{sets: [{name}], percent: 5}}}}"
    )


def _variable(case: LoadedCase, source: Source) -> FreedVariable:
    """The variable of an uncertainty. Raises InputError where it is 0."""
    starts = [float(number_at(case, path)) for path in source.steps]
    start, sd = starts[0], abs(next(iter(source.steps.values())))
    if not sd:
        raise InputError(
            f"{source.name} is stated in percent of a number that is 0: state its standard"
            " deviation as absolute in uncertainties to free it"
        )
    lower, upper = start - FREED_WITHIN * sd, start + FREED_WITHIN * sd
    if start > 0 >= lower and not _is_signed(next(iter(source.steps))):
        lower = start / (1 + sd / start) ** FREED_WITHIN  # as many factors of one deviation below
    return FreedVariable(
        sets=list(source.steps),
        start=start,
        lower=lower,
        upper=upper,
        percent=100 * sd / abs(start) if start else None,
        scale="log" if lower > 0 else "linear",
        starts=starts,
        steps=list(source.steps.values()),
    )


def _is_signed(path: str) -> bool:
    """Whether the number may be below 0."""
    return path.startswith(EFFECT_PATH) or unit_of(path) == "degrees"
