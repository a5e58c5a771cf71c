"""An effect: what a plain model leaves out, as a change of the case with one parameter."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...errors import InputError

if TYPE_CHECKING:
    from ..case import LoadedCase

PASSENGER_kPa = 240.0  # of the tyres that the catalogue's ranges are of


@dataclass(frozen=True)
class Effect:
    """One entry of the catalogue.

    id, title: its name in files and in words; place: where it comes among the tool's own, as they
    are listed and applied to a case (those of installed packages follow, by their ids); symbol,
    unit: of the parameter ("" = a number); low, high: the parameter's range on passenger tyres,
    taken as equally likely throughout; changes: the keywords of the deck that it touches;
    signature: which modes move, which way and how far, as this model says; toggle: the experiment
    that would prove it; aliases: ids of effects that frequencies alone hardly tell from it; add:
    the case with the effect of that parameter (not 0) in it, written in the case's own numbers, or
    ValueError ("must be ...");
    needs: what a solver must list among its capabilities to express it, "" = nothing;
    add_to_deck: `add` for a case of a user's deck, None = it changes lines or regions of a section;
    part: of ``deck.parts``, which such a case must name for it, "" = none;
    law: by how much of its shift of a mode a real one's may be off, as a standard deviation;
    pressure_power: of the tyre's own pressure, with which its range goes: see `range_on`;
    beside: `add` with one standard deviation more of what else its nature leaves open, as a
    filler's height, or None: a diagnosis integrates over it.
    """

    id: str
    title: str
    symbol: str
    unit: str
    low: float
    high: float
    changes: tuple[str, ...]
    signature: str
    toggle: str
    aliases: tuple[str, ...]
    add: Callable[[LoadedCase, float], LoadedCase]
    needs: str = ""
    place: int = 0
    add_to_deck: Callable[[LoadedCase, float], LoadedCase] | None = None
    part: str = ""
    law: float = 0.04
    beside: Callable[[LoadedCase, float], LoadedCase] | None = None
    pressure_power: int = 0

    def __repr__(self) -> str:
        return (
            f"Effect({self.id}: {self.title}, {self.low:g} to {self.high:g} {self.unit}".rstrip()
            + ")"
        )

    def range_on(self, case: LoadedCase) -> tuple[float, float]:
        """low, high on this tyre: with its pressure to the power of `pressure_power` over that of a
        passenger tyre, whose stiffness goes with it. So a compliance of the clamp (-1) takes the
        same share of a mode's frequency, a gauge (1) is off by the same share, and a run from two
        thirds to four thirds of the pressure warms the tyre as much (K per 100 kPa, -1)."""
        pressure = case.file_data["pressure_kPa"] or PASSENGER_kPa
        times = (pressure / PASSENGER_kPa) ** self.pressure_power
        return times * self.low, times * self.high

    def of(self, case: LoadedCase) -> Callable[[LoadedCase, float], LoadedCase]:
        """Its `add` for a case. Raises ValueError where the case has nothing that it changes."""
        if case.decks:
            raise ValueError("changes a section, and the tyre stands in decks in three dimensions")
        if case.deck is None or case.case.deck is None:
            return self.add
        if self.add_to_deck is None:
            raise ValueError("changes lines or regions of a section or a law, not a deck's numbers")
        if self.part and not case.case.deck.sets(self.part):
            raise ValueError(f"needs the sets of {self.part}: name them in deck.parts.{self.part}")
        return self.add_to_deck

    def within(self, capabilities: Collection[str]) -> bool:
        """Whether a solver with these capabilities can express it."""
        return not self.needs or self.needs in capabilities


class EffectRefused(InputError):
    """A parameter with which the effect, or the case, cannot be."""

    def __init__(self, id: str, reason: str, value: float):
        super().__init__(f"effects.{id} {reason}, got {value:g}")
        self.id, self.reason = id, reason
