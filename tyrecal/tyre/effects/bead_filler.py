"""A stiffer filler (apex) above the bead; a tyre of one rubber has none."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from ..section.curve import length_along
from .deck_numbers import stiffer, with_compounds
from .edit import with_part, with_rubbers_at
from .effect import Effect
from .parts import carcass_line, held_regions, lower_sidewall, sidewall, stations, turned_up

# standard deviation of a filler's height: fillers of one size reach 30 to 60 mm above the rim, all
# heights alike 30 mm / sqrt(12) = 9
HIGHER_m = 0.010


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Shear and bulk modulus of the rubber of lower sidewall and bead times 1 + value. If the
    carcass has a turn-up, only the rubber between the two is meant. If the rim holds only the
    bead's surface, the filler within the bead deforms."""
    if not value > -1:
        raise InputError("must be greater than -1")
    return _stiffer(case, _place(case)[0], 1 + value)


def higher(case: LoadedCase, value: float) -> LoadedCase:
    """The same with a filler that reaches `HIGHER_m` further up: the region above gets stiffer by
    the share of its length that the filler covers. Raises InputError if no region is above."""
    top = stations(case.section, _place(case)[0][0])[0]  # first station of the upper region
    above = [name for name in sidewall(case) if stations(case.section, name)[1] == top]
    if not above:
        raise InputError("must be 0: no region of the sidewall is above the filler")
    line = case.section.points[case.section.names.index(carcass_line(case))]
    first, last = stations(case.section, above[0])
    length = float(length_along(line[first : last + 1])[-1])
    return _stiffer(add(case, value), above, 1 + value * min(HIGHER_m / length, 1.0))


def _place(case: LoadedCase) -> tuple[list[str], tuple[str, str]]:
    """The filler's regions, from the upper one down, and its inner and outer line."""
    regions = [*lower_sidewall(case), *held_regions(case.section)]
    if turn_up := turned_up(case):
        line, up = turn_up
        return [region for region in regions if region in up], (carcass_line(case), line)
    return regions, (case.section.names[0], case.section.names[-1])


def _stiffer(case: LoadedCase, regions: list[str], factor: float) -> LoadedCase:
    """The case with shear and bulk modulus (C10, C01, 1 / D1) of the filler in ``regions`` times
    ``factor``."""
    return with_rubbers_at(
        case,
        regions,
        _place(case)[1],
        "filler",
        lambda m: with_part(
            m, C10_Pa=factor * m.C10_Pa, C01_Pa=factor * m.C01_Pa, D1_per_Pa=m.D1_per_Pa / factor
        ),
    )


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """The same factor on the compounds that ``deck.parts.bead_filler`` of a case of your own deck
    names."""
    if not value > -1:
        raise InputError("must be greater than -1")
    return with_compounds(case, "bead_filler", "HYPERELASTIC", stiffer(1 + value, bulk=True))


EFFECT = Effect(
    id="bead_filler",
    place=50,
    title="Bead filler",
    symbol="e",
    unit="",
    # filler compounds are 3 to 10 times as stiff as sidewalls', but fill part of the region only
    low=0.0,
    high=3.0,
    changes=("*HYPERELASTIC", "*SOLID SECTION"),
    signature=(
        "all up, [0,0] torsional most: +16 % at e = 3, [1,1] +6 %, the rest +3 to +6 %; "
        "C10 hides most of it, but leaves [0,0] torsional 6 % and [1,1] 2 % too high"
    ),
    toggle="section a tyre of the same build and measure the hardness above the bead",
    aliases=("cap_ply", "belt_width", "belt_angle"),
    add=add,
    add_to_deck=add_to_deck,
    part="bead_filler",
    # error of its shifts, relative: large, because a filler gets softer towards its tip; a
    # diagnosis integrates over its height
    response_error=0.08,
    shape_uncertainty=higher,
)
