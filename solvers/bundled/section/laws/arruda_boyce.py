"""Arruda and Boyce's eight-chain law (1993), to the fifth term of the inverse Langevin function:

Wbar = mu sum of c_i / lambda_m^(2i - 2) (I1bar^i - 3^i), i = 1 .. 5
U = ((J^2 - 1) / 2 - ln J) / D
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .invariants import InvariantLaw, Slopes

Array = np.ndarray
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
