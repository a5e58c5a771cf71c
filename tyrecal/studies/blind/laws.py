"""The laws by which the maker of blind trials writes effects into a tyre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.effects import catalogue

Frequencies = Mapping[Label, tuple[float, float]]
"""ln f of both members by label, equal where they do not split."""


@dataclass(frozen=True)
class EffectLaw:
    """How an effect, or what no catalogue holds, enters the tyre by one parameter."""

    low: float  # of the parameter's range, in its unit; 0: the range is on one side
    high: float
    add: Callable[[LoadedCase, float], LoadedCase]  # pure; ValueError where the tyre cannot be
    # what a laboratory reads, by pressure, of what is there and the parameter; None: just that
    read: Callable[[Mapping[float, Frequencies], float], Mapping[float, Frequencies]] | None = None

    def drawn(self, random: np.random.Generator, smallest: float) -> float:
        """A parameter, uniform over ``smallest`` to 1 of the range on a side drawn by chance."""
        ends = [end for end in (self.low, self.high) if end]
        return float(random.choice(ends) * random.uniform(smallest, 1.0))


def catalogue_laws(case: LoadedCase, capabilities: frozenset[str]) -> dict[str, EffectLaw]:
    """The catalogue's own, of effects that a solver with these capabilities can express."""
    return {
        id: EffectLaw(*e.range_on(case), e.add)
        for id, e in catalogue().items()
        if e.within(capabilities)
    }
