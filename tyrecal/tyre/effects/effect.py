"""An effect: a property that a plain tyre model leaves out, added to a case by one parameter."""

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
    """One entry of the catalogue."""

    id: str  # its name in files
    title: str  # its name in words
    symbol: str  # of the parameter
    unit: str  # of the parameter ("" = a number)
    # range of the parameter on passenger tyres, by judgement where its file names no source; a
    # diagnosis takes all values as equally probable
    low: float
    high: float
    changes: tuple[str, ...]  # keywords of the deck that it touches
    # which modes move, which way and how far: by this model, on the tyre of cases/p235_75r17.yaml
    # as fitted, at its pressure; a re-fit changes its variables A_belt, A_carcass and C10, and
    # absorbs all but an rms change of the frequencies
    signature: str
    toggle: str  # the experiment that would prove it
    aliases: tuple[str, ...]  # ids of effects that frequencies alone hardly distinguish from it
    # the case with the effect of that parameter (not 0) in it, written in the case's own numbers,
    # or ValueError ("must be ...")
    add: Callable[[LoadedCase, float], LoadedCase]
    needs: str = ""  # the capability that a solver must list to express it, "" = none
    # position in the catalogue: effects are listed and applied to a case in this order; effects of
    # installed packages come last, ordered by id
    place: int = 0
    # `add` for a case of a user's deck, None = it changes lines or regions of a section
    add_to_deck: Callable[[LoadedCase, float], LoadedCase] | None = None
    part: str = ""  # of ``deck.parts``, which a case of a user's deck must name for it, "" = none
    # standard deviation, by judgement, of the error of the effect's shift of a frequency over that
    # shift: a real tyre responds a little otherwise than this model of the effect
    response_error: float = 0.04
    # `add` with one standard deviation more of a second, uncertain number of the effect, such as
    # the height of a bead filler; a diagnosis integrates over it; None: there is none
    shape_uncertainty: Callable[[LoadedCase, float], LoadedCase] | None = None
    pressure_power: int = 0  # power of the tyre's pressure that its range scales with: `range_on`

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
        """The effect's `add` for a case. Raises ValueError where the case has nothing that it
        changes."""
        return case.kind.change_of(self, case.case)

    def within(self, capabilities: Collection[str]) -> bool:
        """Whether a solver with these capabilities can express it."""
        return not self.needs or self.needs in capabilities


class EffectRefused(InputError):
    """A parameter with which the effect, or the case, cannot be; ``reason``: "must be ..."."""

    def __init__(self, id: str, reason: str, value: float):
        super().__init__(f"effects.{id} {reason}, got {value:g}")
        self.id, self.reason = id, reason
