"""The tyre touches a road lightly, with a small patch that sticks to it."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Additional springs from the tread to the ground, at the place of the case's ``road_spring``,
    as stiff along the road as vertically, because the patch sticks. The tyre stays round."""
    if value < 0:
        raise InputError("must be at least 0")
    spring = case.case.road_spring
    stiffer = with_part(
        spring,
        radial_N_per_m=spring.radial_N_per_m + value,
        lateral_N_per_m=spring.lateral_N_per_m + value,
        tangential_N_per_m=spring.tangential_N_per_m + value,
    )
    return changed(case, road_spring=stiffer)


EFFECT = Effect(
    id="road_contact",
    place=240,
    title="Light contact with the road",
    symbol="k",
    unit="N/m",
    # about twice that under a load of 100 N
    low=0.0,
    high=6e5,
    changes=("*SPRING",),
    signature=(
        "at 0.31 MN/m as under a load of 100 N: the member of [c,1] symmetric about the patch"
        " rises, [1,1] by 24 %, [2,1] by 11 %, the other does not move; both members of [c,0]"
        " rise, [1,0] by 4 "
        "and 8 %; [0,0] torsional by 16, lateral by 5 %"
    ),
    toggle="lift the tyre off, or turn it between two measurements",
    aliases=("bead_filler",),
    add=add,
    add_to_deck=add,
    needs="coupled",
    # error of its shifts, relative: the patch is no point, and sticks in part
    response_error=0.10,
)
