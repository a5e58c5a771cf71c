"""A splice: plies or tread overlap in a sector, which is stiffer than the rest."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from ..case.parts import Rubber
from .deck_numbers import stresses
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Stiffness of rubber (C10, C01) and cords (E) times 1 + value, in the sector that the case's
    ``splice`` places."""
    numbers = []
    for name, material in case.case.materials.items():
        rubber = isinstance(material, Rubber)
        keys = ("C10_Pa", "C01_Pa") if rubber else ("youngs_modulus_Pa",)
        numbers += [f"materials.{name}.{key}" for key in keys]
    return _spliced(case, value, numbers)


def _spliced(case: LoadedCase, value: float, numbers: list[str]) -> LoadedCase:
    if not value > -1:
        raise InputError("must be greater than -1")
    splice = case.case.splice
    if splice.share:
        raise InputError("must be 0 where the case has a splice already")
    return changed(case, splice=with_part(splice, share=value, numbers=numbers))


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: all shear constants and moduli of its materials."""
    return _spliced(case, value, stresses(case))


EFFECT = Effect(
    id="stiffness_splice",
    place=220,
    title="Stiff sector (splice)",
    symbol="e",
    unit="",
    # 1: all materials lie twice in the sector
    low=0.0,
    high=1.0,
    changes=("the section of the sector, next to the deck",),
    # of a sector of 10 degrees, the default of ``splice``
    signature=(
        "all up by 0.2 to 0.4 % at e = 1, pairs split by 0.2 to 0.4 %, [c,1] most; C10 absorbs the"
        " means, the splits remain"
    ),
    toggle="find the sector by hand or X-ray; excite at the sector and next to it to measure each"
    " member alone",
    aliases=("point_mass",),
    add=add,
    add_to_deck=add_to_deck,
    needs="coupled",
    # error of its shifts, relative: plies and tread overlap by widths of their own
    response_error=0.10,
)
