"""Designs at many points: ranges of numbers of a case, a grid or a Latin hypercube within them.

`sweep-pressure` is the sweep of the pressure alone. A study gives the points to `evaluate_points`
and keeps of each answer only what it writes, so that a sweep may have thousands of points.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import isfinite, prod

from ..errors import InputError
from ..files import Json
from ..simulate.evaluate.evaluator import Evaluator, Question
from ..simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ..simulate.modes.find import LabelledModes, find_modes
from ..simulate.modes.label import Label
from ..tyre.case import LoadedCase, parse_assignment
from ..tyre.own_deck.numbers import as_known
from ..tyre.state import pressure_name
from ..tyre.values import unit_named, unusual_value, with_values
from .fit.targets import target_labels
from .sensitivities.table import numbers_of
from .variable import read_variables

MAX_POINTS = 100_000  # of a grid
DEFAULT_REACH = 0.1  # of a variable's value, to either side, where no range is given
DEFAULT_POINTS = 10  # of a Latin hypercube, for each range, where their number is not given
RANGE_TEXT = re.compile(r"([^=]+)=([^:=]+):([^:=]+)(?::([^:=]+))?")
EXAMPLE = "such as C10=8e5:1.2e6:5"


@dataclass(frozen=True)
class SweptRange:
    """Values of one number, in its own unit: ``steps`` of them from ``low`` to ``high``.

    >>> SweptRange("C10", 8e5, 1.2e6, 3).values()
    [800000.0, 1000000.0, 1200000.0]
    """

    name: str  # of a variable, or path of a number
    low: float
    high: float
    steps: int = 2

    def values(self) -> list[float]:
        """Equidistant values, both ends among them."""
        return [self.at(i / (self.steps - 1)) for i in range(self.steps)]

    def at(self, share: float) -> float:
        """The value at a share of the way from ``low`` to ``high``, to 12 digits."""
        return float(f"{self.low + (self.high - self.low) * share:.12g}")


def read_ranges(
    case: LoadedCase, texts: Sequence[str], sampled: bool, allow_unusual: bool = False
) -> list[SweptRange]:
    """Ranges NAME=A:B:N of a grid or, if ``sampled``, NAME=A:B; without any, all variables about
    their values, within their bounds. Raises InputError, for ends that no tyre has too, unless
    they are allowed."""
    ranges = [_read_range(case, text, sampled) for text in texts] or _about_variables(case)
    known = [as_known(each.name, case.deck_numbers) for each in ranges]
    for name in known:
        if known.count(name) > 1:
            raise InputError(f"{name} has two ranges: give one")
    numbers_of(case, known)  # refuses a name that is none, or a number that a variable sets
    ranges = [replace(each, name=name) for each, name in zip(ranges, known, strict=True)]
    count = prod(each.steps for each in ranges)
    if not sampled and count > MAX_POINTS:
        raise InputError(
            f"the grid has {count} points, more than {MAX_POINTS}: give fewer, or a Latin hypercube"
        )
    # a point between the ends too: a key may take whole numbers alone
    tried = [(x, [x.low, x.high, x.at(0.5**0.5 if sampled else 1 / (x.steps - 1))]) for x in ranges]
    for name, value in ((each.name, value) for each, values in tried for value in values):
        try:
            with_values(case, {name: value})
        except InputError as error:
            raise InputError(f"{name}={value:g}: {error}") from None
        if texts and not allow_unusual and (message := unusual_value(case, name, value)):
            raise InputError(f"{name}={value:g}: {message}")
    return ranges


def _read_range(case: LoadedCase, text: str, sampled: bool) -> SweptRange:
    form, example = ("NAME=A:B", "such as C10=8e5:1.2e6") if sampled else ("NAME=A:B:N", EXAMPLE)
    match = RANGE_TEXT.fullmatch(text)
    if not match or (match[4] is None) != sampled:
        with_samples = " with a Latin hypercube" if sampled else ""
        raise InputError(f"'{text}' is no range{with_samples}: must be {form}, {example}")
    name = match[1].strip()
    ends = [
        parse_assignment(f"{name}={each}", partial(unit_named, case)) for each in match.group(2, 3)
    ]
    try:
        (_, low), (_, high), steps = *ends, int(match[4] or 2)
    except ValueError:
        raise InputError(f"'{text}': must be {form} with numbers, {example}") from None
    if not (isfinite(low) and isfinite(high) and low < high and steps > 1):
        raise InputError(f"'{text}': A must be less than B, and N at least 2, {example}")
    return SweptRange(name, low, high, steps)


def _about_variables(case: LoadedCase) -> list[SweptRange]:
    ranges = []
    for v in read_variables(case):
        reach = DEFAULT_REACH * abs(v.start)
        low, high = max(v.start - reach, v.lower), min(v.start + reach, v.upper)
        if low < high:
            ranges.append(SweptRange(v.name, low, high))
    if not ranges:
        raise InputError(f"the case has no variable to sweep: give a range NAME=A:B:N, {EXAMPLE}")
    return ranges


def swept_state(case: LoadedCase, ranges: Sequence[SweptRange]) -> Json:
    """Part of the state, for `provenance`, that the sweep sets: the ends of the pressure."""
    swept = {each.name: [each.low, each.high] for each in ranges}
    name = pressure_name(case)
    return {"pressure_kPa": swept[name]} if name in swept else {}


def grid(ranges: Sequence[SweptRange]) -> list[dict[str, float]]:
    """All combinations of the ranges' values, the last number changing first."""
    names = [each.name for each in ranges]
    return [
        dict(zip(names, values, strict=True))
        for values in product(*(each.values() for each in ranges))
    ]


def latin_hypercube(
    ranges: Sequence[SweptRange], count: int, seed: int
) -> tuple[list[dict[str, float]], float]:
    """Points uniform within the ranges, each number in ``count`` strata with one point each, spread
    for a low discrepancy; and their centred L2 discrepancy in the unit cube."""
    from scipy.stats import qmc  # late: its import takes seconds on a loaded machine

    shares = qmc.LatinHypercube(len(ranges), optimization="random-cd", rng=seed).random(count)
    points = [
        {each.name: each.at(share) for each, share in zip(ranges, own, strict=True)}
        for own in shares.tolist()
    ]
    return points, float(qmc.discrepancy(shares))


def evaluate_points(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    points: Sequence[Mapping[str, float]],
    use: Callable[[int, str, LabelledModes | EvaluationFailed], None],
    gradients: tuple[str, ...] = (),
    jobs: int = 1,
) -> None:
    """Evaluate every design (name to values of the variables) at every point (values of numbers).
    ``use`` takes each answer as it is ready: its place among designs times points, the design.

    Where a target's mode is not among the modes that the case asks for, more are asked for.
    Raises DeckRefused and what else ``Evaluator.evaluate`` raises for wrong input; an evaluation
    that fails is an answer.
    """
    names = [name for name in designs for _ in points]
    questions = [
        Question({**values, **point}, gradients) for values in designs.values() for point in points
    ]
    for place, answer in find_modes(evaluator, questions, target_labels(case), jobs):
        if isinstance(answer, DeckRefused):
            raise answer
        use(place, names[place], answer)


def swept_labels(case: LoadedCase, by_point: Iterable[Iterable[Label]]) -> list[Label]:
    """The case's targets and, up to its highest harmonic, all other labels with m <= 1 that every
    point has, sorted. by_point: labels of each point, of one at least."""
    everywhere = set.intersection(*map(set, by_point))
    more = {x for x in everywhere if x.m <= 1 and x.c <= case.case.analysis.highest_harmonic}
    return sorted({*target_labels(case), *more}, key=lambda x: (x.c, x.m, x.kind or ""))
