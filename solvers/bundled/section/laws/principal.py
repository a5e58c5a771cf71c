"""Laws of the principal stretches, by C = F^T F = sum of x_a N_a N_a with x_a = lambda_a^2
(Holzapfel 2000, eqs. 6.47 and 6.180; Simo and Taylor 1991), products of vectors being dyads:

    s_a = 2 dWbar/dx_a,   P = sum of s_a n_a N_a,   n_a = F N_a
    A = sum of s_a 1 (N_a N_a) + sum of 2 ds_a/dx_b (n_a N_a)(n_b N_b)
        + sum over a != b of (s_a - s_b) / (x_a - x_b) ((n_a N_b)(n_a N_b) + (n_a N_b)(n_b N_a))

Principal directions are those of real numbers only: what F's imaginary part adds, the tangent of a
slope, is a difference along it.

Ogden's law (1972) to third order, of the stretches lambda_a J^(-1/3) = y_a:

    Wbar = sum over i of 2 mu_i / alpha_i^2 (y_1^alpha_i + y_2^alpha_i + y_3^alpha_i - 3)
    U = sum over i of (J - 1)^(2i) / D_i;   shear modulus: sum of mu_i

With Y_a = y_a^alpha and Y its mean,

    s_a x_a = sum of 2 mu / alpha (Y_a - Y).

Linear elasticity in logarithmic strains e_a = ln lambda_a (Hencky 1928). At small strains and
any rotation, as of a bead wire, it equals ``*ELASTIC`` of ABAQUS:

    Wbar = G sum of (e_a - e)^2,   U = K / 2 (ln J)^2,   e = ln J / 3
    s_a x_a = 2 G (e_a - e),   x_a = lambda_a^2
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .hyperelastic import Hyperelastic, even_powers

Array = np.ndarray


STRETCH_STEP = 1e-5  # of F, of a difference: its error is the step's square and round-off over it


@dataclass(frozen=True)
class PrincipalLaw(Hyperelastic):
    """A law is Wbar with s and its derivatives."""

    @abstractmethod
    def of_stretches(self, x: Array) -> Array:
        """Wbar (p,) of the squared stretches x (p, 3)."""

    @abstractmethod
    def stresses(self, x: Array) -> Array:
        """s_a (p, 3)."""

    @abstractmethod
    def stiffnesses(self, x: Array) -> tuple[Array, Array]:
        """2 ds_a/dx_b and, its diagonal without a meaning, (s_a - s_b) / (x_a - x_b) (p, 3, 3)."""

    def energy(self, z: Array) -> Array:
        return _with_slope(super().energy, z)

    def force(self, z: Array) -> Array:
        return _with_slope(super().force, z)

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        whole = super().tangent
        return _with_slope(lambda at: whole(at, weights), z)

    def isochoric_energy(self, F: Array, J: Array) -> Array:
        return self.of_stretches(_principal(F)[0])

    def isochoric_stress(self, F: Array, J: Array, G: Array, on_G: Array) -> Array:
        x, N = _principal(F)
        S = (N * self.stresses(x)[:, None]) @ N.swapaxes(1, 2)
        return F @ S + on_G[:, None, None] * G

    def isochoric_tangent(
        self, F: Array, J: Array, G: Array, on_GG: Array, on_swap: Array, weights: Array | float
    ) -> Array:
        """See `Hyperelastic`: from stresses and stiffnesses in the principal directions."""
        p, weights = len(F), np.reshape(weights, (-1, 1, 1))
        x, N = _principal(F)
        S = (N * self.stresses(x)[:, None]) @ N.swapaxes(1, 2) * weights
        normal, shear = (c * weights for c in self.stiffnesses(x))
        pairs = np.einsum("pia,pJb->pabiJ", F @ N, N).reshape(p, 3, 3, 9)  # n_a N_b
        along = np.einsum("paam->pam", pairs)
        A = along.swapaxes(1, 2) @ (normal @ along)
        off = (shear * (1 - np.eye(3))).reshape(p, 9, 1)
        both = (pairs + pairs.swapaxes(1, 2)).reshape(p, 9, 9)
        A = A + pairs.reshape(p, 9, 9).swapaxes(1, 2) @ (off * both)
        A = A + (on_GG[:, None] * G.reshape(p, 9))[:, :, None] * G.reshape(p, 1, 9)
        A5 = A.reshape(p, 3, 3, 3, 3)
        for i in range(3):
            A5[:, i, :, i, :] += S
        sG = on_swap[:, None, None] * G
        A5 -= sG[:, :, None, None, :] * G.swapaxes(1, 2)[:, None, :, :, None]  # G_iL G_kJ
        return A


def _principal(F: Array) -> tuple[Array, Array]:
    """x (p, 3), and N_a as columns (p, 3, 3)."""
    x, N = np.linalg.eigh(F.swapaxes(1, 2) @ F)
    return x, N


def _with_slope(function: Callable[[Array], Array], z: Array) -> Array:
    """The function at complex rows z (p, 9), to the first order of their imaginary parts."""
    if not np.iscomplexobj(z):
        return function(z)
    size = abs(z.imag).max()
    if size == 0.0:
        return function(z.real) + 0j
    way = STRETCH_STEP / size * z.imag
    change = function(z.real + way) - function(z.real - way)
    return function(z.real) + 1j * size * change / (2 * STRETCH_STEP)


def over(difference: Array, d: Array, limit: Array | float) -> Array:
    """``difference`` / d elementwise, and its ``limit`` where d is zero."""
    return np.where(d == 0.0, limit, difference / np.where(d == 0.0, 1.0, d))


def pairs_of(x: Array) -> tuple[Array, Array, Array]:
    """x_a, x_b and d = x_a / x_b - 1 (p, 3, 3) of all pairs a, b of squared stretches x (p, 3)."""
    a, b = x[:, :, None] + np.zeros(3), x[:, None, :] + np.zeros((3, 1))
    return a, b, (a - b) / b


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
