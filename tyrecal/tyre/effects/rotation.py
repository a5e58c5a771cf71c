"""The tyre rotates: its waves run forward and backward at different frequencies."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .edit import changed
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """A higher speed of rotation."""
    if value < 0:
        raise InputError("must be at least 0: both senses of rotation give the same frequencies")
    return changed(case, spin_rad_per_s=case.case.spin_rad_per_s + value)


EFFECT = Effect(
    id="rotation",
    place=250,
    title="Rotation",
    symbol="Omega",
    unit="rad/s",
    low=0.0,
    high=80.0,
    changes=("*DLOAD", "*COMPLEX FREQUENCY"),
    signature=(
        "pairs split by +-(n - 2 n/(n^2 + 1)) Omega in plane, +-0.96 Omega for [1,1]; the mean "
        "of the two rises by 1 to 8 % at 80 rad/s, least [1,0] and [0,0] torsional"
    ),
    toggle="measure again at another speed, or at rest",
    aliases=("pressure_offset",),
    add=add,
    add_to_deck=add,
    needs="rotation",
    # error of its shifts, relative: Coriolis' forces are exact; the tread's heating is not in them
    response_error=0.04,
)
