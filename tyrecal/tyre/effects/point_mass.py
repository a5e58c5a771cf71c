"""Something heavy on the tread: an accelerometer, a balance weight, a stone."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """An additional mass on the middle of the tread."""
    if value < 0:
        raise InputError("must be at least 0")
    point = case.case.point_mass
    return changed(case, point_mass=with_part(point, mass_kg=point.mass_kg + value))


EFFECT = Effect(
    id="point_mass",
    place=230,
    title="Mass on the tread",
    symbol="m",
    unit="kg",
    low=0.0,
    high=0.1,
    changes=("*MASS",),
    signature=(
        "one member of each pair falls, the other hardly does: -1.1 to -2.5 % and 0 at 0.1 kg, "
        "in plane by up to -0.9 %; both [0,0] -0.6 %; the re-fit leaves 0.2 % of the means"
    ),
    toggle="measure again without it, or with twice the mass",
    aliases=("tread_density",),
    add=add,
    add_to_deck=add,
    needs="coupled",
    # error of its shifts, relative: a mass is a mass; it may sit beside the middle
    response_error=0.04,
)
