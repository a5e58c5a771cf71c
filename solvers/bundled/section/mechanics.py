"""Potential, residual, tangents and mass of the inflated section, per radian.

State U (n, 3) in m: displacements in the frame of the reference angle (see `elements`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from .band import Numbering
from .elements import Lines, Solids
from .model import Cords, Model, Rubber
from .parts import cords, pressure, rubber

Array = np.ndarray
Parts = list[tuple[Array, Array]]


@dataclass
class Load:
    """A follower pressure (Pa) on the faces of a surface."""

    lines: Lines
    pressure: complex | float


def deformation(solids: Solids, U: Array) -> Array:
    """F = 1 + B0 u at all Gauss points (e * g, 3, 3)."""
    e, g, _, d = solids.B0.shape
    u = U[solids.connectivity].reshape(e, d, 1)
    return (solids.B0.reshape(e, g * 9, d) @ u).reshape(e * g, 3, 3) + np.eye(3)


def cord_vectors(layers: Cords, U: Array) -> Array:
    """q = F a at all Gauss points (e * g, 3)."""
    e, g, _, d = layers.b0.shape
    u = U[layers.lines.connectivity].reshape(e, d, 1)
    return (layers.direction + (layers.b0.reshape(e, g * 3, d) @ u).reshape(e, g, 3)).reshape(-1, 3)


def surface_point(mesh_X: Array, lines: Lines, U: Array) -> tuple[Array, Array]:
    """Deformed position x and its slope x' = dx/ds (e, g, 3) on a pressure surface."""
    x = U[lines.connectivity] + np.zeros(1, mesh_X.dtype)
    x[..., 0] += mesh_X[lines.connectivity, 0]
    x[..., 2] += mesh_X[lines.connectivity, 1]
    return lines.N @ x, lines.slope @ x


def potential(model: Model, U: Array, loads: list[Load]) -> float:
    """Strain energy minus the work of the pressure, J per radian."""
    total: Any = 0.0
    for r in model.rubbers:
        total += (
            rubber.energy(deformation(r.solids, U), r.material) * r.solids.weights.ravel()
        ).sum()
        if r.solids.hourglass is not None:
            strain = np.einsum("ea,eai->ei", r.solids.hourglass, U[r.solids.connectivity])
            total += (r.hourglass_stiffness * (strain**2).sum(1)).sum() / 2
    for c in model.cords:
        weights = (c.lines.weights * c.lines.R).ravel()
        total += (cords.energy(cord_vectors(c, U), c.stiffness) * weights).sum()
    for load in loads:
        x, dx = surface_point(model.mesh.X, load.lines, U)
        total -= load.pressure * pressure.volume(x, dx, load.lines.weights)
    for connectivity, M in _whirled(model):
        x = _turning(model, U, connectivity)
        total -= model.spin2 * np.einsum("eai,eab,ebi->", x, M, x) / 2
    return total


def residual(model: Model, U: Array, loads: list[Load], numbering: Numbering) -> Array:
    """Out-of-balance force (size,), N per radian: gradient of the potential."""
    return numbering.vector(_forces(model, U, loads))


def gradient(model: Model, U: Array, loads: list[Load]) -> Array:
    """Gradient of the potential by every component (n, 3), those that are held among them."""
    parts = _forces(model, U, loads)
    total = np.zeros(U.shape, np.result_type(*(v for _, v in parts)))
    for connectivity, values in parts:
        np.add.at(total, connectivity, values.reshape(*connectivity.shape, 3))
    return total


def _forces(model: Model, U: Array, loads: list[Load]) -> Parts:
    parts = []
    for r in model.rubbers:
        s = r.solids
        e, g, _, d = s.B0.shape
        P = rubber.stress(deformation(s, U), r.material).reshape(e, g, 9) * s.weights[..., None]
        force = (P.reshape(e, 1, g * 9) @ s.B0.reshape(e, g * 9, d))[:, 0]
        if s.hourglass is not None:
            strain = np.einsum("ea,eai->ei", s.hourglass, U[s.connectivity])
            hold = r.hourglass_stiffness[:, None, None] * s.hourglass[:, :, None] * strain[:, None]
            force = force + hold.reshape(e, d)
        parts.append((s.connectivity, force))
    for c in model.cords:
        e, g, _, d = c.b0.shape
        q = cords.force(cord_vectors(c, U), c.stiffness)
        q = q.reshape(e, g, 3) * (c.lines.weights * c.lines.R)[..., None]
        parts.append(
            (c.lines.connectivity, (q.reshape(e, 1, g * 3) @ c.b0.reshape(e, g * 3, d))[:, 0])
        )
    for load in loads:
        lines = load.lines
        x, dx = surface_point(model.mesh.X, lines, U)
        by_x, by_dx = pressure.first(x, dx)
        weights = -load.pressure * lines.weights
        force = lines.N.T @ (weights[..., None] * by_x)
        force = force + (weights[..., None] * lines.slope).swapaxes(1, 2) @ by_dx
        parts.append((lines.connectivity, force.reshape(len(force), -1)))
    for connectivity, M in _whirled(model):
        force = -model.spin2 * M @ _turning(model, U, connectivity)
        parts.append((connectivity, force.reshape(len(force), -1)))
    return parts


def _whirled(model: Model) -> Parts:
    """Element masses on which the centrifugal force acts: potential -Omega^2 M x^2 / 2."""
    return mass_matrices(model) if model.spin2 else []


def _turning(model: Model, U: Array, connectivity: Array) -> Array:
    """Deformed position (e, a, 3) in the plane of the wheel."""
    x = U[connectivity] @ pressure.IN_PLANE + np.zeros(1, model.mesh.X.dtype)
    x[..., 0] += model.mesh.X[connectivity, 0]
    return x


def tangents(
    model: Model, U: Array, loads: list[Load], harmonics: bool, tension: float = 0.0
) -> tuple[Parts, Parts, Parts]:
    """Element matrices of K(n) = K0 + i n K1 + n^2 K2, each as (connectivity, matrices).

    K0, K2 are symmetric, K1 antisymmetric. Without ``harmonics`` only K0 is formed, which is
    also the Newton tangent of the axisymmetric state. ``tension`` (N/m) is an artificial one in
    the cord layers that helps a Newton iteration to start.
    """
    K0: Parts = []
    K1: Parts = []
    K2: Parts = []
    for r in model.rubbers:
        _rubber_tangents(r, U, harmonics, K0, K1, K2)
    for c in model.cords:
        _cord_tangents(c, U, harmonics, tension, K0, K1, K2)
    for load in loads:
        _pressure_tangents(model.mesh.X, load, U, harmonics, K0, K1)
    for connectivity, M in _whirled(model):
        softening = np.einsum("eab,ij->eaibj", -model.spin2 * M, pressure.IN_PLANE)
        K0.append((connectivity, softening.reshape(len(M), 3 * M.shape[1], -1)))
    return K0, K1, K2


def _rubber_tangents(r: Rubber, U: Array, harmonics: bool, K0: Parts, K1: Parts, K2: Parts) -> None:
    s = r.solids
    e, g, _, d = s.B0.shape
    A = rubber.tangent(deformation(s, U), r.material, s.weights.ravel()).reshape(e, g, 9, 9)
    B = s.B0.reshape(e, g * 9, d)
    Bt = B.swapaxes(1, 2)
    matrices = Bt @ (A @ s.B0).reshape(e, g * 9, d)
    if s.hourglass is not None:
        hold = r.hourglass_stiffness[:, None, None] * s.hourglass[:, :, None] * s.hourglass[:, None]
        matrices = matrices + np.einsum("eab,ij->eaibj", hold, np.eye(3)).reshape(e, d, d)
    K0.append((s.connectivity, matrices))
    if harmonics:
        B1 = s.B1
        AB1 = A[..., 1::3] @ B1  # columns (r, theta, z; Theta) meet the rows of B1
        S = Bt @ AB1.reshape(e, g * 9, d)
        K1.append((s.connectivity, S - S.swapaxes(1, 2)))
        K2.append(
            (
                s.connectivity,
                B1.reshape(e, g * 3, d).swapaxes(1, 2) @ AB1[:, :, 1::3].reshape(e, g * 3, d),
            )
        )


def _cord_tangents(
    c: Cords, U: Array, harmonics: bool, tension: float, K0: Parts, K1: Parts, K2: Parts
) -> None:
    e, g, _, d = c.b0.shape
    D = cords.tangent(cord_vectors(c, U), c.stiffness).reshape(e, g, 3, 3)
    if tension:
        D[..., range(3), range(3)] += tension
    D *= (c.lines.weights * c.lines.R)[..., None, None]
    b = c.b0.reshape(e, g * 3, d)
    K0.append((c.lines.connectivity, b.swapaxes(1, 2) @ (D @ c.b0).reshape(e, g * 3, d)))
    if harmonics:
        b1 = np.zeros((e, g, 3, d // 3, 3))
        for i in range(3):
            b1[:, :, i, :, i] = c.hoop
        b1 = b1.reshape(e, g, 3, d)
        Db1 = (D @ b1).reshape(e, g * 3, d)
        S = b.swapaxes(1, 2) @ Db1
        K1.append((c.lines.connectivity, S - S.swapaxes(1, 2)))
        K2.append((c.lines.connectivity, b1.reshape(e, g * 3, d).swapaxes(1, 2) @ Db1))


def _pressure_tangents(
    X: Array, load: Load, U: Array, harmonics: bool, K0: Parts, K1: Parts
) -> None:
    lines = load.lines
    e, g, a = lines.slope.shape
    x, dx = surface_point(X, lines, U)
    xx, xd, linear = pressure.second(x, dx)
    weights = -load.pressure * lines.weights / 2
    N = np.broadcast_to(lines.N, (e, g, a))

    def blocks(left: Array, middle: Array, right: Array) -> Array:
        """sum over Gauss points of weights left_a middle_ij right_b as (e, 3a, 3a)."""
        pairs = (weights[..., None] * left)[..., :, None] * right[..., None, :]
        table = pairs.reshape(e, g, a * a).swapaxes(1, 2) @ middle.reshape(e, g, 9)
        return table.reshape(e, a, a, 3, 3).swapaxes(2, 3).reshape(e, 3 * a, 3 * a)

    Q = blocks(N, xx, N) + blocks(N, xd, lines.slope)
    K0.append((lines.connectivity, Q + Q.swapaxes(1, 2)))
    if harmonics:
        Q = blocks(N, linear[..., 0, :, :], N) + blocks(lines.slope, linear[..., 1, :, :], N)
        K1.append((lines.connectivity, Q - Q.swapaxes(1, 2)))


def mass(model: Model) -> csr_array:
    """Consistent mass (n, n), kg per radian, the same for each displacement component.

    Cords are added to the rubber that they run through.
    """
    n = len(model.mesh.X)
    rows, cols, values = [], [], []
    for connectivity, matrices in mass_matrices(model):
        a = connectivity.shape[1]
        rows.append(np.repeat(connectivity, a, 1).ravel())
        cols.append(np.tile(connectivity, (1, a)).ravel())
        values.append(matrices.ravel())
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))
    return csr_array(entries, (n, n))


def mass_matrices(model: Model) -> Parts:
    """Element masses (connectivity, (e, a, a)), kg per radian."""
    parts = []
    for r in model.rubbers:
        s = r.solids
        NN = s.mass_N[:, :, None] * s.mass_N[:, None, :]
        parts.append((s.connectivity, np.tensordot(r.density[:, None] * s.mass_weights, NN, 1)))
    for c in model.cords:
        NN = c.lines.N[:, :, None] * c.lines.N[:, None, :]
        parts.append(
            (c.lines.connectivity, np.tensordot(c.mass * c.lines.R * c.lines.weights, NN, 1))
        )
    return parts
