"""The tread weighs more or less than its rubber: voids of the pattern, another compound."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from .deck_numbers import with_compounds
from .edit import with_part, with_rubbers_at
from .effect import Effect
from .parts import crown, tread


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Density of the tread, outside belts and under-tread, times 1 + value."""
    if not value > -1:
        raise InputError("must be greater than -1")
    return with_rubbers_at(
        case,
        crown(case),
        tread(case),
        "tread",
        lambda m: with_part(m, density_kg_per_m3=(1 + value) * m.density_kg_per_m3),
    )


def as_voids(case: LoadedCase, value: float) -> LoadedCase:
    """The same by voids, which reduce the stiffness as much; a compound does not."""
    factor = 1 + value
    return with_rubbers_at(
        add(case, value),
        crown(case),
        tread(case),
        "voids",
        lambda m: with_part(
            m, C10_Pa=factor * m.C10_Pa, C01_Pa=factor * m.C01_Pa, D1_per_Pa=m.D1_per_Pa / factor
        ),
    )


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: the compounds of ``deck.parts.tread``."""
    if not value > -1:
        raise InputError("must be greater than -1")
    return with_compounds(case, "tread", "DENSITY", lambda _, number: (1 + value) * number)


EFFECT = Effect(
    id="tread_density",
    place=30,
    title="Tread density",
    symbol="e",
    unit="",
    # grooves take 26 to 37 % of the skid depth's rubber (measured void ratios), 15 to 25 % of the
    # tread; tread compounds weigh 1100 to 1200 kg/m3
    low=-0.25,
    high=0.1,
    changes=("*DENSITY", "*SOLID SECTION"),
    signature=(
        "all up alike as it gets lighter: +6 to +8 % at e = -0.25 and every pressure; "
        "A_belt resembles it by its mass, and absorbs all but 0.3 %"
    ),
    toggle="weigh the tyre; buff the tread smooth, weigh and measure again",
    aliases=("sidewall_gauge", "pressure_offset"),
    add=add,
    add_to_deck=add_to_deck,
    part="tread",
    # error of its shifts, relative: voids lie in the middle or at the shoulders; what stiffness
    # they take is integrated over
    response_error=0.08,
    shape_uncertainty=as_voids,
)
