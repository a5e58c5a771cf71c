"""The belts' cords have another angle than stated: lift in the mould, or the cutter's setting."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .deck_numbers import with_angles
from .edit import with_layers, with_part
from .effect import Effect
from .parts import belts


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Every belt cord ``value`` degrees further from the circumference, on the side where it is."""
    moved = {}
    for name in belts(case):
        layer = case.case.rebar_layers[name]
        moved[name] = with_part(layer, angle_deg=_turned(name, layer.angle_deg, value))
    return with_layers(case, moved)


def _turned(name: str, angle_deg: float, value: float) -> float:
    """A belt cord's angle, degrees, ``value`` further from the circumference. Raises InputError."""
    angle = angle_deg % 180  # from the meridian; a cord has no head
    if not 0 < abs(90 - angle) + value < 90:
        raise InputError(
            f"must leave a belt cord between circumference and meridian, '{name}' is"
            f" {abs(90 - angle):g} degrees from the circumference"
        )
    return angle_deg + (value if angle > 90 else -value)


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: the layers of ``deck.parts.belts``."""
    return with_angles(case, "belts", lambda name, angle_deg: _turned(name, angle_deg, value))


EFFECT = Effect(
    id="belt_angle",
    place=70,
    title="Belt cord angle",
    symbol="da",
    unit="degrees",
    # a lift of 2 % in the mould turns cords from 20 to 17 degrees: cos a ~ R, a from the
    # circumference
    low=-3.0,
    high=3.0,
    changes=("*REBAR LAYER",),
    signature=(
        "all [c >= 1, 0], [2,1] and [3,1] down 1 to 2.4 % at 3 degrees off the "
        "circumference, [0,0] and [1,1] hardly moved; a re-fit leaves [0,0] torsional 2 %"
        " too high"
    ),
    toggle="peel the tread of a tyre of the same build and measure the angle, or X-ray it",
    aliases=("belt_width", "cap_ply", "bead_filler"),
    add=add,
    add_to_deck=add_to_deck,
    part="belts",
    # error of its shifts, relative: cords turn as a pantograph from crown to edge, where this turns
    # all alike
    response_error=0.06,
)
