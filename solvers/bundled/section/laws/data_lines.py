"""Hyperelastic laws from ABAQUS's ``*HYPERELASTIC``: the constants on its data lines, eight on
each. D = 0, or none, is incompressible rubber."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....language.fields import constants_of, law_of
from ....language.laws import LAW_CONSTANTS, MAX_ENERGY_ORDER, OF_ORDER_N, ON_A_LINE
from ....language.text import Block, DeckError
from .hyperelastic import Hyperelastic
from .polynomial import ArrudaBoyce, MooneyRivlin, PolynomialLaw, ReducedPolynomial
from .principal import Ogden

Scalar = complex | float
LAW_CLASSES: tuple[type[Hyperelastic], ...] = (  # the first that has all constants of a law
    MooneyRivlin,
    ReducedPolynomial,
    PolynomialLaw,
    ArrudaBoyce,
    Ogden,
)


def kind_of(law: str, order: int) -> type[Hyperelastic] | None:
    """The class that has all constants of a law of an order; None: no class has."""
    constants = set(LAW_CONSTANTS[law](order))
    for kind in LAW_CLASSES:
        bulk = (name.removeprefix("inverse_") for name in kind.bulk_moduli)
        if constants <= {*kind.shear_moduli, *bulk, *kind.numbers}:
            return kind
    return None


def read_law(k: Block) -> Hyperelastic:
    """The law of one ``*HYPERELASTIC``, its constants single numbers. Raises DeckError."""
    name, order = law_of(k)
    if "N" in k.parameters and name not in OF_ORDER_N:
        raise DeckError(k.place, f"N={order} of {name} is not honoured, which has no N")
    law = kind_of(name, order)
    if law is None:
        right = " or ".join(str(n) for n in range(1, MAX_ENERGY_ORDER) if kind_of(name, n))
        raise DeckError(k.place, f"N={order} of {name} is not honoured, only N={right}")
    names = constants_of(k)
    given = dict(zip(names, _numbers(k, names), strict=True))
    if any(np.real(value) < 0 for name, value in given.items() if name[0] == "D"):
        raise DeckError(k.rows[-1].place, "D must not be negative; 0 is incompressible")
    if not np.real(given["D1"]) and any(v for name, v in given.items() if name[0] == "D"):
        raise DeckError(k.rows[-1].place, "D1 = 0 is incompressible: all D are 0 then")
    if any(not np.real(given[name]) for name in law.numbers if name in given):
        raise DeckError(k.rows[0].place, "an exponent, or a locking stretch, must not be 0")
    given |= {f"inverse_{name}": 1 / D if D else 0.0 for name, D in given.items() if name[0] == "D"}
    own = (*law.shear_moduli, *law.bulk_moduli, *law.numbers)
    constants: dict[str, Any] = {name: np.asarray(given.get(name, 0.0)) for name in own}
    instance = law(**constants)
    if not np.real(instance.shear_modulus) > 0:
        raise DeckError(k.rows[0].place, "the shear modulus of small strains must be positive")
    return instance


def _numbers(k: Block, names: list[str]) -> list[Scalar]:
    """The constants in their order; those that are left out are 0. Raises DeckError."""
    lines = -(-len(names) // ON_A_LINE)
    if not 1 <= len(k.rows) <= lines:
        of = "one data line" if lines == 1 else f"up to {lines} data lines"
        raise DeckError(k.place, f"*{k.name} takes {of}, got {len(k.rows)}")
    for row, last in zip(k.rows, range(len(names), 0, -ON_A_LINE), strict=False):
        extra = [text for text in row.fields[min(last, ON_A_LINE) :] if text]
        if extra:
            raise DeckError(row.place, f"data '{extra[0]}' of *{k.name} is not honoured")
    numbers: list[Scalar] = []
    for i in range(len(names)):
        row = k.rows[min(i // ON_A_LINE, len(k.rows) - 1)]
        # beyond the last line: a field that no line has, so 0
        place = i % ON_A_LINE if i // ON_A_LINE < len(k.rows) else ON_A_LINE
        numbers.append(row.value(place, 0.0))
    return numbers
