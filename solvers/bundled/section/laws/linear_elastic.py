"""Linear elasticity by logarithmic strains e_a = ln lambda_a (Hencky 1928), which ABAQUS's
``*ELASTIC`` has at small strains of any rotation, and a bead wire stays at:

    Wbar = G sum of (e_a - e)^2,   U = K / 2 (ln J)^2,   e = ln J / 3
    s_a x_a = 2 G (e_a - e)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .principal import PrincipalLaw, apart, over

Array = np.ndarray


@dataclass(frozen=True)
class LinearElastic(PrincipalLaw):
    """G and K, Pa."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("G",)
    bulk_moduli: ClassVar[tuple[str, ...]] = ("K",)

    G: Array
    K: Array

    @property
    def shear_modulus(self) -> Array:
        return self.G

    def _deviator(self, x: Array) -> Array:
        e = np.log(x) / 2
        return e - e.mean(1, keepdims=True)

    def of_stretches(self, x: Array) -> Array:
        return self.G * (self._deviator(x) ** 2).sum(1)

    def stresses(self, x: Array) -> Array:
        return np.reshape(2 * self.G, (-1, 1)) * self._deviator(x) / x

    def stiffnesses(self, x: Array) -> tuple[Array, Array]:
        a, b, d = apart(x)
        one, twice = np.eye(3), np.reshape(2 * self.G, (-1, 1, 1))
        e = self._deviator(x)
        normal = twice * ((one - 1 / 3) - one * 2 * e[:, :, None]) / (a * b)
        logarithm = over(np.log1p(d), d, 1.0) / 2  # of ln x / 2, times b
        return normal, twice * (logarithm - e[:, None, :]) / (a * b)

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        log = np.log(J)
        return self.K / 2 * log**2, self.K * log / J, self.K * (1 - log) / J**2
