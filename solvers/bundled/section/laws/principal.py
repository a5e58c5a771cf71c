"""Laws of the principal stretches, by C = F^T F = sum of x_a N_a N_a with x_a = lambda_a^2
(Holzapfel 2000, eqs. 6.47 and 6.180; Simo and Taylor 1991), products of vectors being dyads:

    s_a = 2 dWbar/dx_a,   P = sum of s_a n_a N_a,   n_a = F N_a
    A = sum of s_a 1 (N_a N_a) + sum of 2 ds_a/dx_b (n_a N_a)(n_b N_b)
        + sum over a != b of (s_a - s_b) / (x_a - x_b) ((n_a N_b)(n_a N_b) + (n_a N_b)(n_b N_a))

Principal directions are those of real numbers only: what F's imaginary part adds, the tangent of a
slope, is a difference along it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .hyperelastic import Hyperelastic

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
