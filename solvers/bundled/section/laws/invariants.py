"""Laws of the invariants of C / J^(2/3) (Holzapfel 2000, eqs. 6.109 to 6.112):

Wbar(I1bar, I2bar),   I1bar = J^(-2/3) I1,   I2bar = J^(-4/3) I2

dI1bar/dF = J^(-2/3) (2 F - 2/3 I1 G),   dI2bar/dF = J^(-4/3) (2 (I1 F - F C) - 4/3 I2 G)

C = F^T F, G = F^-T.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from .hyperelastic import Hyperelastic

Array = np.ndarray
Slopes = tuple[Array, Array | None]


@dataclass(frozen=True)
class InvariantLaw(Hyperelastic):
    """A law is Wbar with its derivatives by the invariants. `Hyperelastic` defines on_G, on_GG and
    on_swap of its stress and tangent."""

    @abstractmethod
    def of_invariants(self, I1: Array, I2: Array) -> Array:
        """Wbar (p,) of I1bar, I2bar."""

    @abstractmethod
    def slopes(self, I1: Array, I2: Array) -> Slopes:
        """dWbar/dI1bar, dWbar/dI2bar, (p,) each; None: it is zero."""

    @abstractmethod
    def curvatures(self, I1: Array, I2: Array) -> tuple[Array, Array, Array] | None:
        """d2Wbar/dI1bar2, d2Wbar/dI1bar dI2bar, d2Wbar/dI2bar2, (p,) each; None: they are zero."""

    @property
    def needs_I2(self) -> bool:
        """Whether Wbar depends on I2bar; if it does not, I2bar is not formed."""
        return False

    @property
    def shear_modulus(self) -> Array:
        three = np.full(1, 3.0)
        W1, W2 = self.slopes(three, three)
        return 2 * (W1 if W2 is None else W1 + W2)

    def isochoric_energy(self, F: Array, J: Array) -> Array:
        I1, I2, _ = second_invariant(F)
        return self.of_invariants(J ** (-2 / 3) * I1, J ** (-4 / 3) * I2)

    def _invariants(self, F: Array, J: Array) -> tuple[Array, Array, Array]:
        """J^(-2/3), I1, and I2 or a number that does not count, (p,) each."""
        I1 = (F * F).sum((1, 2))
        return J ** (-2 / 3), I1, second_invariant(F)[1] if self.needs_I2 else I1

    def isochoric_stress(self, F: Array, J: Array, G: Array, on_G: Array) -> Array:
        J23, I1, I2 = self._invariants(F, J)
        W1, W2 = self.slopes(J23 * I1, J23**2 * I2)
        a = W1 * J23
        P = (2 * a)[:, None, None] * F + (on_G - 2 / 3 * a * I1)[:, None, None] * G
        return P if W2 is None else P + _stress_I2(F, J, G, W2)

    def isochoric_tangent(
        self, F: Array, J: Array, G: Array, on_GG: Array, on_swap: Array, weights: Array | float
    ) -> Array:
        """See `Hyperelastic`: from the derivatives of Wbar by the invariants."""
        p = len(F)
        J23, I1, I2 = self._invariants(F, J)
        of = J23 * I1, J23**2 * I2
        W1, W2 = self.slopes(*of)
        a = W1 * J23 * weights
        f, g = F.reshape(p, 9), G.reshape(p, 9)
        swap = 2 / 3 * a * I1 - on_swap
        gg = 4 / 9 * a * I1 + on_GG
        af = (-4 / 3 * a)[:, None] * f
        # (af g + g af + gg g g)_ab as a product of p matrices 9 x 2 and 2 x 9
        left = np.stack([g, af + gg[:, None] * g], -1)
        A = left @ np.stack([af, g], 1)
        A5 = A.reshape(p, 3, 3, 3, 3)
        sG = swap[:, None, None] * G
        A5 += sG[:, :, None, None, :] * G.swapaxes(1, 2)[:, None, :, :, None]  # G_iL G_kJ
        A.reshape(p, 81)[:, ::10] += (2 * a)[:, None]  # the diagonals
        if W2 is not None:
            A += _tangent_I2(F, J, G, W2) * np.reshape(weights, (-1, 1, 1))
        if (curved := self.curvatures(*of)) is not None:
            one = np.ones(p, F.dtype)
            by_I1 = J23[:, None] * (2 * f - (2 / 3 * I1)[:, None] * g)
            by_I2 = _stress_I2(F, J, G, one).reshape(p, 9) if self.needs_I2 else by_I1
            W11, W12, W22 = (W * weights for W in curved)
            one_two = np.stack([by_I1, by_I2], -1)
            W = np.stack([np.stack([W11, W12], -1), np.stack([W12, W22], -1)], -1)
            A = A + one_two @ (W @ one_two.swapaxes(1, 2))
        return A


def second_invariant(F: Array) -> tuple[Array, Array, Array]:
    """I1, I2 (p,) and C = F^T F (p, 3, 3)."""
    C = F.swapaxes(1, 2) @ F
    I1 = np.einsum("pii->p", C)
    return I1, (I1**2 - (C * C).sum((1, 2))) / 2, C


def _stress_I2(F: Array, J: Array, G: Array, W2: Array) -> Array:
    """W2 dI2bar/dF (p, 3, 3); W2 (p,): dWbar/dI2bar."""
    I1, I2, C = second_invariant(F)
    b = W2 * J ** (-4 / 3)
    Y = 2 * (I1[:, None, None] * F - F @ C)  # dI2/dF
    return b[:, None, None] * (Y - (4 / 3 * I2)[:, None, None] * G)


def _tangent_I2(F: Array, J: Array, G: Array, W2: Array) -> Array:
    """W2 d2I2bar/dFdF (p, 9, 9)."""
    p = len(F)
    I1, I2, C = second_invariant(F)
    b = W2 * J ** (-4 / 3)
    B = F @ F.swapaxes(1, 2)
    f, g = F.reshape(p, 9), G.reshape(p, 9)
    y = 2 * (I1[:, None, None] * F - F @ C).reshape(p, 9)
    one = np.eye(3)
    H = 4 * f[:, :, None] * f[:, None, :] + 2 * I1[:, None, None] * np.eye(9)
    H5 = H.reshape(p, 3, 3, 3, 3)
    H5 -= 2 * one[None, :, None, :, None] * C[:, None, :, None, :]
    H5 -= 2 * F[:, :, None, None, :] * F.swapaxes(1, 2)[:, None, :, :, None]
    H5 -= 2 * B[:, :, None, :, None] * one[None, None, :, None, :]
    H -= 4 / 3 * (y[:, :, None] * g[:, None, :] + g[:, :, None] * y[:, None, :])
    H += (16 / 9 * I2)[:, None, None] * g[:, :, None] * g[:, None, :]
    sG = (4 / 3 * I2)[:, None, None] * G
    H5 += sG[:, :, None, None, :] * G.swapaxes(1, 2)[:, None, :, :, None]
    return b[:, None, None] * H
