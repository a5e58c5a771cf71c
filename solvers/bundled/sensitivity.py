"""Exact derivatives of eigenvalues by numbers of the deck, the preload's change included.

    d lambda/dp = phi^H (dK/dp + D_u K[v] - lambda dM/dp) phi,    v = -K0^-1 dr/dp

(Nelson's first-order formula about the equilibrium r(u, p) = 0.) All three terms come from one
complex step: the quadratic forms of the shape phi are evaluated on the model built from the deck
with its number p + i h dp, at the state u + i h v; no second derivative is written out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import cords, mechanics, pressure, rubber
from .band import Cholesky, Numbering
from .keywords import STEP
from .mechanics import Load
from .model import Model

Array = np.ndarray


def state_rate(
    model: Model, U: Array, loads: list[Load], numbering: Numbering, factor: Cholesky
) -> Array:
    """v = dU/dp (n, 3) of the equilibrium U; ``model``, ``loads`` carry p's tangent.

    ``factor``: of the real Newton tangent at U.
    """
    rate = np.imag(mechanics.residual(model, U, loads, numbering)) / STEP
    return numbering.spread(-factor.solve(rate))


Strains = dict[int, tuple[Array, tuple[Array, Array]]]


def eigenvalue_rates(
    model: Model,
    U: Array,
    V: Array,
    loads: list[Load],
    n: Array,
    shapes: Array,
    eigenvalues: Array,
    strains: Strains | None = None,
) -> Array:
    """d lambda/dp (m,) of modes with harmonics n (m,), shapes (m, nodes, 3), lambda (m,).

    ``model`` and ``loads`` carry the tangent of p, V = dU/dp. ``strains`` remembers the modes'
    displacement gradients in the rubber from one variable to the next; empty at first.
    """
    strains = {} if strains is None else strains
    state = U + 1j * STEP * V
    real, imag = shapes.real, shapes.imag
    total = np.zeros(len(n), complex)
    for r in model.rubbers:
        s = r.solids
        A = rubber.tangent(mechanics.deformation(s, state), r.material, s.weights.ravel())
        A = A.reshape(*s.weights.shape, 9, 9)
        key = id(s.B0)
        if key not in strains:
            strains[key] = s.B0, _gradients(s.B0, s.hoop, s.connectivity, real, imag, n)
        for H in strains[key][1]:
            total += _contract(A, H)
        if s.hourglass is not None:
            for part in (real, imag):
                strain = np.einsum("ea,meai->mei", s.hourglass, part[:, s.connectivity])
                total += (strain**2).sum(2) @ r.hourglass_stiffness
    for c in model.cords:
        D = cords.tangent(mechanics.cord_vectors(c, state), c.stiffness)
        D = D.reshape(*c.lines.R.shape, 3, 3) * (c.lines.weights * c.lines.R)[..., None, None]
        for q in _gradients(c.b0, c.hoop, c.lines.connectivity, real, imag, n):
            total += _contract(D, q)
    for load in loads:
        total += _pressure_form(model, state, load, n, real, imag)
    for connectivity, M in mechanics.mass_matrices(model):
        if np.iscomplexobj(M):
            rate = M.imag
            for part in (real, imag):
                u = part[:, connectivity]
                form = np.einsum("meai,meai->m", np.matmul(rate, u), u)
                total -= 1j * eigenvalues * form
    return total.imag / STEP


def _contract(A: Array, H: Array) -> Array:
    """sum over Gauss points of H.A.H per mode; A (e, g, k, k), H (e, g, k, m)."""
    return (np.matmul(A, H) * H).sum((0, 1, 2))


def _gradients(
    B0: Array, hoop: Array, connectivity: Array, real: Array, imag: Array, n: Array
) -> tuple[Array, Array]:
    """Real and imaginary part of (B0 + i n B1)(a + i b), each (e, g, k, m); k = 9 or 3."""
    e, g, k, d = B0.shape
    B = B0.reshape(e, g * k, d)
    fields = []
    for part in (real, imag):
        u = np.moveaxis(part[:, connectivity], 0, -1)  # (e, a, 3, m)
        H = (B @ u.reshape(e, d, -1)).reshape(e, g, k, -1)
        around = np.einsum("ega,eaim->egim", hoop, u) * n  # n u_i / R
        fields.append((H, around))
    rows = slice(1, None, 3) if k == 9 else slice(None)
    (H_real, around_real), (H_imag, around_imag) = fields
    H_real[:, :, rows] -= around_imag
    H_imag[:, :, rows] += around_real
    return H_real, H_imag


def _pressure_form(
    model: Model, state: Array, load: Load, n: Array, real: Array, imag: Array
) -> Array:
    """Second variation of -p V for each shape (m,); see `pressure`."""
    lines = load.lines
    x, dx = mechanics.surface_point(model.mesh.X, lines, state)
    y, d = x @ pressure.IN_PLANE, x @ pressure.SPIN.T
    u, du = [], []
    for part in (real, imag):
        nodal = part[:, lines.connectivity]
        u.append(np.einsum("ga,meai->megi", lines.N, nodal))
        du.append(np.einsum("ega,meai->megi", lines.slope, nodal))
    turn = n[:, None, None, None]
    Du = [u[0] @ pressure.SPIN.T - turn * u[1], u[1] @ pressure.SPIN.T + turn * u[0]]
    form: Any = 0.0
    for a, da, Da in zip(u, du, Du, strict=True):
        density = ((a @ pressure.IN_PLANE) * (pressure.cross(dx, Da) - pressure.cross(d, da))).sum(
            -1
        )
        density = density - (da * pressure.cross(y, Da)).sum(-1)
        form = form + (density * lines.weights).sum((1, 2))
    return -load.pressure * form
