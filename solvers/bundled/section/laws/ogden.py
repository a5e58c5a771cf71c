"""Ogden's law (1972) to third order, of the stretches lambda_a J^(-1/3) = y_a:

    Wbar = sum over i of 2 mu_i / alpha_i^2 (y_1^alpha_i + y_2^alpha_i + y_3^alpha_i - 3)
    U = sum over i of (J - 1)^(2i) / D_i;   shear modulus: sum of mu_i

With x_a = lambda_a^2, s_a = 2 dWbar/dx_a (`principal`), Y_a = y_a^alpha and Y its mean,

    s_a x_a = sum of 2 mu / alpha (Y_a - Y).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .hyperelastic import even_powers
from .principal import PrincipalLaw, over, pairs_of

Array = np.ndarray


@dataclass(frozen=True)
class Ogden(PrincipalLaw):
    """mu_i, Pa; alpha_i; 1 / D_i, Pa. A term with mu = 0 is none."""

    shear_moduli: ClassVar[tuple[str, ...]] = ("mu1", "mu2", "mu3")
    bulk_moduli: ClassVar[tuple[str, ...]] = ("inverse_D1", "inverse_D2", "inverse_D3")
    numbers: ClassVar[tuple[str, ...]] = ("alpha1", "alpha2", "alpha3")

    mu1: Array
    alpha1: Array
    mu2: Array
    alpha2: Array
    mu3: Array
    alpha3: Array
    inverse_D1: Array
    inverse_D2: Array
    inverse_D3: Array

    @property
    def shear_modulus(self) -> Array:
        return self.mu1 + self.mu2 + self.mu3

    def _terms(self, x: Array) -> Iterator[tuple[Array, Array, Array, Array]]:
        """mu, alpha (p, 1), Y_a (p, 3) and Y (p, 1) of each term."""
        isochoric = x / np.prod(x, 1, keepdims=True) ** (1 / 3)
        for i in "123":
            mu, alpha = (np.reshape(getattr(self, name + i), (-1, 1)) for name in ("mu", "alpha"))
            if np.any(mu):
                Y = isochoric ** (alpha / 2)
                yield mu, alpha, Y, Y.mean(1, keepdims=True)

    def of_stretches(self, x: Array) -> Array:
        terms = (2 * mu / alpha**2 * (Y - 1) for mu, alpha, Y, _ in self._terms(x))
        return np.asarray(sum(terms)).sum(1)

    def stresses(self, x: Array) -> Array:
        terms = (2 * mu / alpha * (Y - mean) for mu, alpha, Y, mean in self._terms(x))
        return np.asarray(sum(terms) / x)

    def stiffnesses(self, x: Array) -> tuple[Array, Array]:
        """x_b dY_a/dx_b = alpha / 2 (delta_ab - 1/3) Y_a, that of Y is alpha / 6 (Y_b - Y)."""
        a, b, d = pairs_of(x)
        normal, shear, one = 0.0, 0.0, np.eye(3)
        for mu, alpha, Y, mean in self._terms(x):
            q = (alpha / 2)[..., None]
            at_a, at_b, middle = Y[:, :, None], Y[:, None, :], mean[..., None]
            rate = q * (one - 1 / 3) * at_a - q / 3 * (at_b - middle) - one * (at_a - middle)
            normal = normal + (4 * mu / alpha)[..., None] * rate / (a * b)
            # (x_a^(q - 1) - x_b^(q - 1)) / (x_a - x_b) over x_b^(q - 2)
            power = over(np.expm1((q - 1) * np.log1p(d)), d, q - 1)
            shear = shear + (2 * mu / alpha)[..., None] * (at_b * power / b**2 + middle / (a * b))
        return np.asarray(normal), np.asarray(shear)

    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        return even_powers(J, self.inverse_D1, self.inverse_D2, self.inverse_D3)
