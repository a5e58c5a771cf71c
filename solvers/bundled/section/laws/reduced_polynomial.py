"""The reduced polynomial law to third order, which is Yeoh's (1993):

Wbar = sum of C_i0 (I1bar - 3)^i, U = sum of (J - 1)^(2i) / D_i, i = 1, 2, 3;   shear modulus 2 C10
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .hyperelastic import even_powers
from .invariants import InvariantLaw, Slopes

Array = np.ndarray


@dataclass(frozen=True)
class ReducedPolynomial(InvariantLaw):
    """C_i0 and 1 / D_i, Pa."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("C10", "C20", "C30")
    bulk_moduli: ClassVar[tuple[str, ...]] = ("inverse_D1", "inverse_D2", "inverse_D3")

    C10: Array
    C20: Array
    C30: Array
    inverse_D1: Array
    inverse_D2: Array
    inverse_D3: Array

    def of_invariants(self, I1: Array, I2: Array) -> Array:
        x = I1 - 3
        return x * (self.C10 + x * (self.C20 + x * self.C30))

    def slopes(self, I1: Array, I2: Array) -> Slopes:
        x = I1 - 3
        return self.C10 + x * (2 * self.C20 + 3 * x * self.C30), None

    def curvatures(self, I1: Array, I2: Array) -> tuple[Array, Array, Array]:
        return 2 * self.C20 + 6 * self.C30 * (I1 - 3), 0 * I1, 0 * I1

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        return even_powers(J, self.inverse_D1, self.inverse_D2, self.inverse_D3)
