"""The polynomial law of second order in I1bar - 3 and I2bar - 3 (Rivlin and Saunders, 1951):

Wbar = sum of C_ij (I1bar - 3)^i (I2bar - 3)^j, i + j = 1, 2
U = (J - 1)^2 / D1 + (J - 1)^4 / D2;   shear modulus 2 (C10 + C01)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .hyperelastic import even_powers
from .invariants import InvariantLaw, Slopes

Array = np.ndarray


@dataclass(frozen=True)
class PolynomialLaw(InvariantLaw):
    """C_ij and 1 / D_i, Pa."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("C10", "C01", "C20", "C11", "C02")
    bulk_moduli: ClassVar[tuple[str, ...]] = ("inverse_D1", "inverse_D2")

    C10: Array
    C01: Array
    C20: Array
    C11: Array
    C02: Array
    inverse_D1: Array
    inverse_D2: Array

    @property
    def needs_I2(self) -> bool:
        return True

    def of_invariants(self, I1: Array, I2: Array) -> Array:
        x, y = I1 - 3, I2 - 3
        return self.C10 * x + self.C01 * y + self.C20 * x * x + self.C11 * x * y + self.C02 * y * y

    def slopes(self, I1: Array, I2: Array) -> Slopes:
        x, y = I1 - 3, I2 - 3
        by_x = self.C10 + 2 * self.C20 * x + self.C11 * y
        return by_x, self.C01 + self.C11 * x + 2 * self.C02 * y

    def curvatures(self, I1: Array, I2: Array) -> tuple[Array, Array, Array]:
        zero = 0 * I1
        return 2 * self.C20 + zero, self.C11 + zero, 2 * self.C02 + zero

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        return even_powers(J, self.inverse_D1, self.inverse_D2)
