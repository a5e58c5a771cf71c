"""The air in the tyre has inertia and stiffness, in addition to its pressure."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """``value`` times the density and the bulk modulus of the gas; 1 = air at the stated
    pressure."""
    cavity = case.case.cavity
    return changed(case, cavity=with_part(cavity, share=cavity.share + value))


EFFECT = Effect(
    id="cavity_air",
    place=160,
    title="Air in the cavity",
    symbol="s",
    unit="",
    low=0.0,
    high=1.5,
    changes=("*ACOUSTIC MEDIUM", "*DENSITY", "*DSLOAD"),
    signature=(
        "[1,0] down most, -2.3 % at s = 1.5, other [c,0] -1.0 to -1.5 %, [0,0] lateral and "
        "[c,1] -0.4 to -0.6 %, [0,0] torsional not at all; grows with the pressure; a re-fit "
        "hides three quarters"
    ),
    toggle="inflate with helium (a seventh of the mass) or sulphur hexafluoride (five times)",
    aliases=("spindle_radial", "carcass_fanning"),
    add=add,
    add_to_deck=add,
    needs="cavity",
    # error of its shifts, relative: a gas in a hollow ring: both laws are known
    response_error=0.04,
)
