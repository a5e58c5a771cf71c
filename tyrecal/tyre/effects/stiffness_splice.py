"""Effect of a stiff sector: plies or tread overlap at a splice."""

from __future__ import annotations

from ..case import LoadedCase
from ..case.parts import Rubber
from .deck_numbers import stresses
from .edit import changed, with_part
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """The case with C10 and C01 of rubber and E of cords times 1 + value in one sector, which is
    ``splice.width_deg`` wide."""
    numbers = []
    for name, material in case.case.materials.items():
        rubber = isinstance(material, Rubber)
        keys = ("C10_Pa", "C01_Pa") if rubber else ("youngs_modulus_Pa",)
        numbers += [f"materials.{name}.{key}" for key in keys]
    return _with_sector(case, value, numbers)


def _with_sector(case: LoadedCase, value: float, numbers: list[str]) -> LoadedCase:
    """The case with the numbers at these paths times 1 + value in the sector."""
    if not value > -1:
        raise ValueError("must be greater than -1")
    splice = case.case.splice
    if splice.share:
        raise ValueError("must be 0 where the case has a splice already")
    return changed(case, splice=with_part(splice, share=value, numbers=numbers))


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """The case with all shear constants and moduli of the deck's materials times 1 + value in one
    sector."""
    return _with_sector(case, value, stresses(case))


EFFECT = Effect(
    id="stiffness_splice",
    place=220,
    title="Stiff sector (splice)",
    symbol="e",
    unit="",
    low=0.0,
    high=1.0,
    changes=("a second section deck, of the sector",),
    signature=(
        "all up by 0.2 to 0.4 % at e = 1, doublets split by 0.2 to 0.4 %, [c,1] most; calibration "
        "of C10 absorbs the means, the splits remain"
    ),
    toggle="find the sector by hand or X-ray; excite at it, then 90/c degrees from it",
    aliases=("point_mass",),
    add=add,
    add_to_deck=add_to_deck,
    needs="coupled",
    # plies and tread overlap over different widths, so a real splice differs from this one sector
    law=0.10,
)
