"""Hyperelastic laws from ABAQUS's ``*HYPERELASTIC``: the constants on its data lines, eight on
each. D = 0, or none, is incompressible rubber."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....language.text import Block, DeckError
from .arruda_boyce import ArrudaBoyce
from .hyperelastic import Hyperelastic
from .mooney_rivlin import MooneyRivlin
from .ogden import Ogden
from .polynomial import Polynomial
from .reduced_polynomial import ReducedPolynomial

Scalar = complex | float
ON_A_LINE = 8
LAWS: dict[tuple[str, str], tuple[type[Hyperelastic], str]] = {  # by the parameters' law and N
    ("NEO HOOKE", ""): (MooneyRivlin, "C10 D1"),
    ("MOONEY-RIVLIN", ""): (MooneyRivlin, "C10 C01 D1"),
    ("POLYNOMIAL", "1"): (MooneyRivlin, "C10 C01 D1"),
    ("POLYNOMIAL", "2"): (Polynomial, "C10 C01 C20 C11 C02 D1 D2"),
    ("REDUCED POLYNOMIAL", "1"): (MooneyRivlin, "C10 D1"),
    ("REDUCED POLYNOMIAL", "2"): (ReducedPolynomial, "C10 C20 D1 D2"),
    ("REDUCED POLYNOMIAL", "3"): (ReducedPolynomial, "C10 C20 C30 D1 D2 D3"),
    ("YEOH", ""): (ReducedPolynomial, "C10 C20 C30 D1 D2 D3"),
    ("ARRUDA-BOYCE", ""): (ArrudaBoyce, "mu lambda_m D1"),
    ("OGDEN", "1"): (Ogden, "mu1 alpha1 D1"),
    ("OGDEN", "2"): (Ogden, "mu1 alpha1 mu2 alpha2 D1 D2"),
    ("OGDEN", "3"): (Ogden, "mu1 alpha1 mu2 alpha2 mu3 alpha3 D1 D2 D3"),
}
LAW_NAMES = {name for name, _ in LAWS}


def read_law(k: Block) -> Hyperelastic:
    """The law of one ``*HYPERELASTIC``, its constants single numbers. Raises DeckError."""
    named = [name for name in k.parameters if name in LAW_NAMES] or ["POLYNOMIAL"]
    if len(named) > 1:
        raise DeckError(k.place, f"{named[0]} and {named[1]} are two laws")
    orders = [N for name, N in LAWS if name == named[0]]
    order = k.get("N") or ("1" if "1" in orders else "")
    if order not in orders:
        right = f"only N={' or '.join(orders)}" if orders[0] else "which has no N"
        raise DeckError(k.place, f"N={order} of {named[0]} is not honoured, {right}")
    law, layout = LAWS[named[0], order]
    given = dict(zip(layout.split(), _numbers(k, layout.split()), strict=True))
    if any(np.real(value) < 0 for name, value in given.items() if name[0] == "D"):
        raise DeckError(k.rows[-1].place, "D must not be negative; 0 is incompressible")
    if not np.real(given["D1"]) and any(v for name, v in given.items() if name[0] == "D"):
        raise DeckError(k.rows[-1].place, "D1 = 0 is incompressible: all D are 0 then")
    if any(not np.real(given[name]) for name in law.numbers if name in given):
        raise DeckError(k.rows[0].place, "an exponent, or a locking stretch, must not be 0")
    given |= {f"inverse_{name}": 1 / D if D else 0.0 for name, D in given.items() if name[0] == "D"}
    names = (*law.shear_moduli, *law.bulk_moduli, *law.numbers)
    constants: dict[str, Any] = {name: np.asarray(given.get(name, 0.0)) for name in names}
    found = law(**constants)
    if not np.real(found.shear_modulus) > 0:
        raise DeckError(k.rows[0].place, "the shear modulus of small strains must be positive")
    return found


def _numbers(k: Block, names: list[str]) -> list[Scalar]:
    """The constants in their order; those that are left out are 0."""
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
        place = i % ON_A_LINE if i // ON_A_LINE < len(k.rows) else ON_A_LINE
        numbers.append(row.value(place, 0.0))
    return numbers
