"""Linear elasticity in logarithmic strains e_a = ln lambda_a (Hencky 1928). At small strains and
any rotation, as of a bead wire, it equals ``*ELASTIC`` of ABAQUS:

    Wbar = G sum of (e_a - e)^2,   U = K / 2 (ln J)^2,   e = ln J / 3
    s_a x_a = 2 G (e_a - e),   x_a = lambda_a^2

Stretches lambda_a, stresses s_a and the methods are those of `principal.PrincipalLaw`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .principal import PrincipalLaw, over, pairs_of

Array = np.ndarray


@dataclass(frozen=True)
class LinearElastic(PrincipalLaw):
    """Shear modulus G and bulk modulus K, Pa, one value or one per Gauss point (p,)."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("G",)
    bulk_moduli: ClassVar[tuple[str, ...]] = ("K",)

    G: Array
    K: Array

    @property
    def shear_modulus(self) -> Array:
        return self.G

    def _deviator(self, x: Array) -> Array:
        """e_a - e (p, 3)."""
        e = np.log(x) / 2
        return e - e.mean(1, keepdims=True)

    def of_stretches(self, x: Array) -> Array:
        return self.G * (self._deviator(x) ** 2).sum(1)

    def stresses(self, x: Array) -> Array:
        return np.reshape(2 * self.G, (-1, 1)) * self._deviator(x) / x

    def stiffnesses(self, x: Array) -> tuple[Array, Array]:
        """See `PrincipalLaw`: of the energy in logarithmic strains."""
        a, b, d = pairs_of(x)
        one, twice = np.eye(3), np.reshape(2 * self.G, (-1, 1, 1))
        e = self._deviator(x)
        normal = twice * ((one - 1 / 3) - one * 2 * e[:, :, None]) / (a * b)
        logarithm = over(np.log1p(d), d, 1.0) / 2  # (e_a - e_b) / (x_a - x_b) times x_b
        return normal, twice * (logarithm - e[:, None, :]) / (a * b)

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        log = np.log(J)
        return self.K / 2 * log**2, self.K * log / J, self.K * (1 - log) / J**2
