"""Mooney and Rivlin's law, and neo-Hooke's, which is C01 = 0:

Wbar = C10 (I1bar - 3) + C01 (I2bar - 3),   U = (J - 1)^2 / D1;   shear modulus 2 (C10 + C01)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .hyperelastic import even_powers
from .invariants import InvariantLaw, Slopes

Array = np.ndarray


@dataclass(frozen=True)
class MooneyRivlin(InvariantLaw):
    """C10, C01 and 1 / D1, Pa."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("C10", "C01")

    C10: Array
    C01: Array
    inverse_D1: Array

    @property
    def needs_I2(self) -> bool:
        return bool(np.any(self.C01))

    def of_invariants(self, I1: Array, I2: Array) -> Array:
        return self.C10 * (I1 - 3) + self.C01 * (I2 - 3)

    def slopes(self, I1: Array, I2: Array) -> Slopes:
        return self.C10, self.C01 if self.needs_I2 else None

    def curvatures(self, I1: Array, I2: Array) -> None:
        return None

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        return even_powers(J, self.inverse_D1)
