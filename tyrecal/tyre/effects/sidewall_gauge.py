"""The sidewall is thicker or thinner than drawn."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .deck_numbers import with_thickness
from .edit import with_gauge
from .effect import Effect
from .parts import sidewall


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Thickness of the sidewall, inner to outer surface, times 1 + value."""
    names = case.section.names
    return with_gauge(case, (names[0], names[-1]), sidewall(case), _factor(value))


def _factor(value: float) -> float:
    if not -0.9 <= value <= 9:
        raise InputError("must be between -0.9 and 9")
    return 1 + value


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: the thickness of ``deck.parts.sidewall`` outside the cords."""
    return with_thickness(case, "sidewall", _factor(value))


EFFECT = Effect(
    id="sidewall_gauge",
    place=110,
    title="Sidewall gauge",
    symbol="e",
    unit="",
    # 4 to 6 mm at the thinnest, over sizes and makers
    low=-0.15,
    high=0.15,
    changes=("*NODE",),
    signature=(
        "all down by the mass, [3,1] most: -1.7 % at +15 %, but [0,0] torsional up 0.4 %;"
        " a re-fit leaves [0,0] torsional 1.3 % too high and [3,1] 1 % too low"
    ),
    toggle="section a tyre of the same build, or probe the sidewall's thickness by ultrasound",
    aliases=("tread_density", "pressure_offset"),
    add=add,
    add_to_deck=add_to_deck,
    part="sidewall",
    # error of its shifts, relative: thicker in its upper or its lower half, inside or outside the
    # ply
    response_error=0.06,
)
