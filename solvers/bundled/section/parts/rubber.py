"""Mooney-Rivlin rubber, nearly incompressible (Holzapfel, Nonlinear Solid Mechanics, ch. 6).

    W = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + (J - 1)^2 / D1

in terms of the deformation gradient F (p, 3, 3); every function also takes complex F and
constants, which is how sensitivities are formed. Constants are scalars or (p,) arrays, in Pa.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class MooneyRivlin:
    """C10, C01 (Pa), inverse_D1 = 1/D1 (Pa), per Gauss point.

    ``shear_ratio``: instantaneous-over-static modulus of a small vibration; 1 = none.
    Not ``stressed``: the tangent without the initial stress, as that of a ratio has it.
    """

    C10: Array
    C01: Array
    inverse_D1: Array
    shear_ratio: Array | None = None
    bulk_ratio: Array | None = None
    stressed: bool = True


def determinant(F: Array) -> tuple[Array, Array]:
    """J = det F (p,) and the inverse transpose F^-T (p, 3, 3), from the cofactors."""
    c = np.empty_like(F)
    for i in range(3):
        a, b = F[:, (i + 1) % 3], F[:, (i + 2) % 3]
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            c[:, i, k] = a[:, m] * b[:, n] - a[:, n] * b[:, m]
    J = (F[:, 0] * c[:, 0]).sum(-1)
    return J, c / J[:, None, None]


def second_invariant(F: Array) -> tuple[Array, Array, Array]:
    """I1, I2 (p,) and C = F^T F (p, 3, 3)."""
    C = F.swapaxes(1, 2) @ F
    I1 = np.einsum("pii->p", C)
    return I1, (I1**2 - (C * C).sum((1, 2))) / 2, C


def energy(F: Array, m: MooneyRivlin) -> Array:
    """W (p,), J/m3."""
    J, _ = determinant(F)
    I1, I2, _ = second_invariant(F)
    return (
        m.C10 * (J ** (-2 / 3) * I1 - 3)
        + m.C01 * (J ** (-4 / 3) * I2 - 3)
        + (J - 1) ** 2 * m.inverse_D1
    )


def stress(F: Array, m: MooneyRivlin) -> Array:
    """First Piola-Kirchhoff stress P = dW/dF (p, 3, 3), Pa."""
    J, G = determinant(F)
    a = m.C10 * J ** (-2 / 3)
    I1 = (F * F).sum((1, 2))
    pressure = 2 * m.inverse_D1 * (J - 1) * J
    P = (2 * a)[:, None, None] * F + (pressure - 2 / 3 * a * I1)[:, None, None] * G
    if np.any(m.C01):
        P = P + _stress_C01(F, J, G, m)
    return P


def _stress_C01(F: Array, J: Array, G: Array, m: MooneyRivlin) -> Array:
    I1, I2, C = second_invariant(F)
    b = m.C01 * J ** (-4 / 3)
    Y = 2 * (I1[:, None, None] * F - F @ C)  # dI2/dF
    return b[:, None, None] * (Y - (4 / 3 * I2)[:, None, None] * G)


def tangent(F: Array, m: MooneyRivlin, weights: Array | float = 1.0) -> Array:
    """First elasticity tensor A = d2W/dFdF (p, 9, 9), Pa: material and geometric part in one.

    ``weights`` (p,) multiply it. With ``shear_ratio`` the material part is scaled, the initial
    stress is not: a small vibration about the static state at the modulus of its own frequency.
    """
    if m.shear_ratio is not None:
        return _dynamic_tangent(F, m, weights)
    if not m.stressed:
        whole = replace(m, stressed=True)
        return _less_stress(tangent(F, whole, weights), F, stress(F, whole), weights)
    p = len(F)
    J, G = determinant(F)
    a = m.C10 * J ** (-2 / 3) * weights
    I1 = (F * F).sum((1, 2))
    k = 2 * m.inverse_D1 * J * weights
    f, g = F.reshape(p, 9), G.reshape(p, 9)
    swap = 2 / 3 * a * I1 - k * (J - 1)
    gg = 4 / 9 * a * I1 + k * (2 * J - 1)
    af = (-4 / 3 * a)[:, None] * f
    # (af g + g af + gg g g)_ab as a product of p matrices 9 x 2 and 2 x 9
    left = np.stack([g, af + gg[:, None] * g], -1)
    A = left @ np.stack([af, g], 1)
    A5 = A.reshape(p, 3, 3, 3, 3)
    sG = swap[:, None, None] * G
    A5 += sG[:, :, None, None, :] * G.swapaxes(1, 2)[:, None, :, :, None]  # G_iL G_kJ
    diagonal = np.arange(9)
    A[:, diagonal, diagonal] += (2 * a)[:, None]
    if np.any(m.C01):
        A += _tangent_C01(F, J, G, m) * np.reshape(weights, (-1, 1, 1))
    return A


def _dynamic_tangent(F: Array, m: MooneyRivlin, weights: Array | float) -> Array:
    """Tangent at the dynamic moduli, less the initial stress that they would bring along."""
    dynamic = replace(
        m,
        C10=m.C10 * m.shear_ratio,
        C01=m.C01 * m.shear_ratio,
        inverse_D1=m.inverse_D1 * m.bulk_ratio,
        shear_ratio=None,
    )
    more = stress(F, dynamic) - stress(F, m)
    return _less_stress(tangent(F, dynamic, weights), F, more, weights)


def _less_stress(A: Array, F: Array, P: Array, weights: Array | float) -> Array:
    """A (p, 9, 9) without the part of the initial stress P (p, 3, 3)."""
    S = np.linalg.solve(F, P)  # second Piola-Kirchhoff
    A = A.reshape(-1, 3, 3, 3, 3)
    for i in range(3):
        A[:, i, :, i, :] -= S * np.reshape(weights, (-1, 1, 1))
    return A.reshape(-1, 9, 9)


def _tangent_C01(F: Array, J: Array, G: Array, m: MooneyRivlin) -> Array:
    p = len(F)
    I1, I2, C = second_invariant(F)
    b = m.C01 * J ** (-4 / 3)
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
