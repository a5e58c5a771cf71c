"""Part of the tread is worn off."""

from __future__ import annotations

from ..case import LoadedCase
from .deck_numbers import with_thickness
from .edit import with_gauge
from .effect import Effect
from .parts import crown, tread


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Gauge of the tread, outside belts and under-tread, times 1 - value."""
    return with_gauge(case, tread(case), crown(case), _factor(value))


def _factor(value: float) -> float:
    if not -1 <= value <= 0.9:
        raise ValueError("must be between -1 and 0.9 of the tread's gauge")
    return 1 - value


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """The same of ``deck.parts.tread``."""
    return with_thickness(case, "tread", _factor(value))


EFFECT = Effect(
    id="tread_wear",
    place=40,
    title="Tread wear",
    symbol="w",
    unit="",
    # new grooves are 7 to 10 mm deep, worn out at 1.6 mm: half of a 12 mm tread
    low=0.0,
    high=0.5,
    changes=("*NODE",),
    signature=(
        "all up: +13 to +18 % at w = 0.5, in-plane modes more than [2,1] and [3,1]; "
        "A_belt takes up all but 0.7 %"
    ),
    toggle="measure the groove depth; buff the tread by a known depth and measure again",
    aliases=("tread_density", "rim_width"),
    add=add,
    add_to_deck=add_to_deck,
    part="tread",
)
