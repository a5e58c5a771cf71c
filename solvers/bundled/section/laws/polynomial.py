"""Laws that are polynomials of the invariants. Of I1bar - 3 and I2bar - 3 are that of second order
(Rivlin and Saunders, 1951),

Wbar = sum of C_ij (I1bar - 3)^i (I2bar - 3)^j, i + j = 1, 2
U = (J - 1)^2 / D1 + (J - 1)^4 / D2;   shear modulus 2 (C10 + C01)

Mooney and Rivlin's, and neo-Hooke's, which is C01 = 0,

Wbar = C10 (I1bar - 3) + C01 (I2bar - 3),   U = (J - 1)^2 / D1;   shear modulus 2 (C10 + C01)

and the reduced one of third order, which is Yeoh's (1993),

Wbar = sum of C_i0 (I1bar - 3)^i, U = sum of (J - 1)^(2i) / D_i, i = 1, 2, 3;   shear modulus 2 C10

Of I1bar alone is Arruda and Boyce's eight-chain law (1993), to the fifth term of the inverse
Langevin function:

Wbar = mu sum of c_i / lambda_m^(2i - 2) (I1bar^i - 3^i), i = 1 .. 5
U = ((J^2 - 1) / 2 - ln J) / D
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


CHAIN_TERMS = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)  # c_i


@dataclass(frozen=True)
class ArrudaBoyce(InvariantLaw):
    """mu, Pa; the locking stretch lambda_m; 1 / D, Pa. The initial shear modulus is
    mu (1 + 3 / (5 lambda_m^2) + ...)."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("mu",)
    numbers: ClassVar[tuple[str, ...]] = ("lambda_m",)

    mu: Array
    lambda_m: Array
    inverse_D1: Array

    def _terms(self) -> list[tuple[int, Array]]:
        return [
            (i, self.mu * c / self.lambda_m ** (2 * i - 2))
            for i, c in enumerate(CHAIN_TERMS, start=1)
        ]

    def of_invariants(self, I1: Array, I2: Array) -> Array:
        return np.asarray(sum(c * (I1**i - 3**i) for i, c in self._terms()))

    def slopes(self, I1: Array, I2: Array) -> Slopes:
        return np.asarray(sum(i * c * I1 ** (i - 1) for i, c in self._terms())), None

    def curvatures(self, I1: Array, I2: Array) -> tuple[Array, Array, Array]:
        own = sum(i * (i - 1) * c * I1 ** (i - 2) for i, c in self._terms()[1:])
        return np.asarray(own), 0 * I1, 0 * I1

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        of = self.inverse_D1
        return of * ((J**2 - 1) / 2 - np.log(J)), of * (J - 1 / J), of * (1 + 1 / J**2)
