"""Exact derivatives of eigenvalues by numbers of the deck, the preload's change included.

    d lambda/dp = phi^H (dK/dp + D_u K[v] - lambda dM/dp) phi,    v = -K0^-1 dr/dp

(Nelson's first-order formula about the equilibrium r(u, p) = 0.) All three terms come from one
complex step: the quadratic forms of the shape phi are evaluated on the model built from the deck
with its number p + i h dp, at the state u + i h v; no second derivative is written out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import cords, mechanics, pressure, rubber
from .air import Air, coupling
from .band import Cholesky, Numbering
from .keywords import STEP
from .mechanics import Load
from .model import Model, Rubber
from .spectrum import stiffened
from .wheel import Wheel

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
    beside: Beside | None = None,
) -> Array:
    """d lambda/dp (m,) of modes with harmonics n (m,), shapes (m, nodes, 3), lambda (m,).

    ``model`` and ``loads`` carry the tangent of p, V = dU/dp. ``strains`` remembers the modes'
    displacement gradients in the rubber from one variable to the next; empty at first.
    ``beside``: the rim and the air that move along. Where the model has laws of frequency, lambda
    changes its own modulus: d lambda/dp = (d lambda/dp at that modulus) / (1 - d lambda/d rho
    d rho/d lambda).
    """
    strains = {} if strains is None else strains
    state = U + 1j * STEP * V
    real, imag = shapes.real, shapes.imag
    if beside and beside.wheel:
        real, imag = beside.carried(model.mesh.X, n, real, imag)
    total = np.zeros(len(n), complex)
    for r in model.rubbers:
        total += _rubber_form(r, state, n, real, imag, strains)
    own = 1.0
    for law, softer in zip(model.laws, stiffened(model), strict=True):
        form = sum(_rubber_form(r, state, n, real, imag, strains) for r in softer.rubbers)
        hertz = np.sqrt(eigenvalues) / (2 * np.pi)
        ratio = np.array([law.ratio(f) for f in hertz])
        total += (ratio - 1) * form
        # d rho / d lambda = rho (d ln rho / d ln f) / (2 lambda)
        slope = np.array([law.slope(f) for f in hertz])
        own = own - form.real * ratio.real * slope / (2 * eigenvalues)
    for c in model.cords:
        D = cords.tangent(mechanics.cord_vectors(c, state), c.stiffness)
        D = D.reshape(*c.lines.R.shape, 3, 3) * (c.lines.weights * c.lines.R)[..., None, None]
        for q in _gradients(c.b0, c.hoop, c.lines.connectivity, real, imag, n):
            total += _contract(D, q)
    for load in loads:
        total += _pressure_form(model, state, load, n, real, imag)
    for connectivity, M in mechanics.mass_matrices(model) if model.spin2 else ():
        for part in (real, imag):
            u = part[:, connectivity] @ pressure.IN_PLANE
            total -= model.spin2 * np.einsum("meai,meai->m", np.matmul(M, u), u)
    for connectivity, M in mechanics.mass_matrices(model):
        if np.iscomplexobj(M) or np.iscomplexobj(real):
            for part in (real, imag):
                u = part[:, connectivity]
                total -= eigenvalues * np.einsum("meai,meai->m", np.matmul(M, u), u)
    if beside:
        total += beside.forms(model, state, loads, n, real, imag, eigenvalues)
    return total.imag / STEP / own


@dataclass(frozen=True)
class Beside:
    """What moves beside the tyre: rim and air with p's tangent, and the modes' amplitudes of
    their motions, per mode (q,) and (w,)."""

    wheel: Wheel | None
    air: Air | None
    rim: list[Array]
    flow: list[Array]

    def carried(self, X: Array, n: Array, real: Array, imag: Array) -> tuple[Array, Array]:
        """The shapes with the rim's nodes where p's tangent takes them."""
        if not np.iscomplexobj(X) or self.wheel is None:
            return real, imag
        real, imag = real.astype(complex), imag.astype(complex)
        for j, q in enumerate(self.rim):
            a, b = (part[self.wheel.rim] for part in self.wheel.fields(int(n[j]), X))
            real[j, self.wheel.rim] = a @ q.real - b @ q.imag
            imag[j, self.wheel.rim] = a @ q.imag + b @ q.real
        return real, imag

    def forms(
        self,
        model: Model,
        state: Array,
        loads: list[Load],
        n: Array,
        real: Array,
        imag: Array,
        eigenvalues: Array,
    ) -> Array:
        """Their part of phi^H (K - lambda M) phi per mode, with the tangent of p."""
        total = np.zeros(len(n), complex)
        X = model.mesh.X
        forces = mechanics.gradient(model, state, loads) if self.wheel else state
        couplings = {m: coupling(self.air, X, state, m) for m in set(n.tolist()) if self.air}
        for j, m in enumerate(n.tolist()):
            if self.wheel:
                stiffness, inertia = self.wheel.own(m, X, forces)
                total[j] += (stiffness - eigenvalues[j] * inertia) @ abs(self.rim[j]) ** 2
            for part, w in ((real[j], self.flow[j].real), (imag[j], self.flow[j].imag)):
                if m in couplings:
                    air = couplings[m]
                    H = air.H[air.flowing, air.flowing]
                    swept = air.strain(part, w)
                    total[j] += swept @ np.linalg.solve(air.Q, swept)
                    total[j] -= eigenvalues[j] * (w @ H @ w)
        return total


def _rubber_form(
    r: Rubber, state: Array, n: Array, real: Array, imag: Array, strains: Strains
) -> Array:
    """phi^H K phi (m,) of a block of rubber."""
    s = r.solids
    A = rubber.tangent(mechanics.deformation(s, state), r.material, s.weights.ravel())
    A = A.reshape(*s.weights.shape, 9, 9)
    key = id(s.B0)
    if key not in strains:
        strains[key] = s.B0, _gradients(s.B0, s.hoop, s.connectivity, real, imag, n)
    total = sum(_contract(A, H) for H in strains[key][1])
    if s.hourglass is not None:
        for part in (real, imag):
            strain = np.einsum("ea,meai->mei", s.hourglass, part[:, s.connectivity])
            total = total + (strain**2).sum(2) @ r.hourglass_stiffness
    return np.asarray(total)


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
