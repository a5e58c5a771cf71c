"""The tyre stands on something that just holds it up: a soft pad, a bench, a road."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """A radial spring more from the tread to the ground; the tyre stays round."""
    if value < 0:
        raise ValueError("must be at least 0")
    spring = case.case.road_spring
    stiffer = with_part(spring, radial_N_per_m=spring.radial_N_per_m + value)
    return changed(case, road_spring=stiffer)


EFFECT = Effect(
    id="road_contact",
    place=240,
    title="Light contact with the road",
    symbol="k",
    unit="N/m",
    low=0.0,
    high=3e5,
    changes=("*SPRING",),
    signature=(
        "the member of each doublet that is symmetric about the patch rises: [c,0] by 3 to 5 % at "
        "0.3 MN/m, [c,1] by less than 1 %; the other one and both [0,0] stay"
    ),
    toggle="lift the tyre off, or turn it between two measurements",
    aliases=("spindle_radial",),
    add=add,
    needs="coupled",
)
