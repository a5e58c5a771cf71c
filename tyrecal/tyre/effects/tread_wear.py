"""Part of the tread is worn off."""

from __future__ import annotations

from dataclasses import replace

from ...errors import InputError
from ..case import LoadedCase
from ..section.section import fill_lines
from .deck_numbers import with_thickness
from .edit import with_gauge
from .effect import Effect
from .parts import crown, stations, tread

# share of the wear: less by it in the middle, twice that more at the shoulders: of 3 mm, 2.4 to 4.2
UNEVEN = 0.2


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Gauge of the tread, outside belts and under-tread, times 1 - value."""
    return with_gauge(case, tread(case), crown(case), _factor(value))


def _factor(value: float) -> float:
    if not -1 <= value <= 0.9:
        raise InputError("must be between -1 and 0.9 of the tread's gauge")
    return 1 - value


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: the gauge of ``deck.parts.tread``."""
    return with_thickness(case, "tread", _factor(value))


def at_shoulders(case: LoadedCase, value: float) -> LoadedCase:
    """The same wear on average, distributed by a parabola: 1.4 times at the tread's edges and 0.8
    in its middle."""
    section, worn = case.section, add(case, value)
    # the drawn section is not worn: its gauge factor 1 - value acts on it afterwards, so that
    # (1 - value) times ``left`` is 1 - value (1 + UNEVEN across)
    last = max(stations(section, name)[1] for name in crown(case))
    inner = section.names.index(tread(case)[0])
    base = fill_lines(section)[inner, : last + 1]
    across = 3 * (base[:, 1] / base[-1, 1]) ** 2 - 1  # of z over the edge's: its mean is 0
    left = 1 - UNEVEN * value / (1 - value) * across
    points = section.points.copy()
    points[inner + 1 :, : last + 1] = (
        base + (points[inner + 1 :, : last + 1] - base) * left[:, None]
    )
    return replace(worn, drawn=replace(section, points=points))


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
        "A_belt absorbs all but 0.7 %"
    ),
    toggle="measure the groove depth; buff the tread by a known depth and measure again",
    aliases=("tread_density", "rim_width"),
    add=add,
    add_to_deck=add_to_deck,
    part="tread",
    # error of its shifts, relative: not in it: heel and toe, blocks; the profile across is
    # `shape_uncertainty`
    response_error=0.06,
    shape_uncertainty=at_shoulders,
)
