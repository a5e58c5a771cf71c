"""Exact derivatives of eigenvalues by numbers of the deck, the preload's change included.

    d lambda/dp = phi^H (dK/dp + D_u K[v] - lambda dM/dp) phi,    v = -K0^-1 dr/dp

(Nelson's first-order formula about the equilibrium r(u, p) = 0.) All three terms come from one
complex step: the quadratic forms of the shape phi are evaluated on the model built from the deck
with its number p + i h dp, at the state u + i h v; no second derivative is written out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

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


Strains = list[tuple[Array, Array, Array]]


@dataclass(frozen=True)
class Fields:
    """Shapes a + i b (p, nodes, 3) of harmonics n (p,): what the modes ``owner`` (p,), 0 to
    ``count`` less 1, are sums of."""

    n: Array
    real: Array
    imag: Array
    owner: Array
    count: int

    def of_each_mode(self) -> Iterator[tuple[int, Array, Array, Array]]:
        """Place of a mode; n, a and b of its parts."""
        for j in range(self.count):
            mine = np.flatnonzero(self.owner == j)
            yield j, self.n[mine], self.real[mine], self.imag[mine]


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
    owner: Array | None = None,
) -> Array:
    """d lambda/dp (m,) of modes lambda (m,), sums of shapes (p, nodes, 3) of harmonics n (p,).

    ``owner`` (p,): the mode that each is part of; None: each is a mode. ``model`` and ``loads``
    carry the tangent of p, V = dU/dp. ``strains`` remembers what the modes' gradients give from
    one variable to the next; empty at first.
    ``beside``: the rim and the air that move along. Where the model has laws of frequency, lambda
    changes its own modulus: d lambda/dp = (d lambda/dp at that modulus) / (1 - d lambda/d rho
    d rho/d lambda).
    """
    strains = [] if strains is None else strains
    state = U + 1j * STEP * V
    real, imag = shapes.real, shapes.imag
    if beside and beside.wheel:
        real, imag = beside.carried(model.mesh.X, n, real, imag)
    owner = np.arange(len(n)) if owner is None else owner
    fields = Fields(n, real, imag, owner, len(eigenvalues))
    total = np.zeros(len(eigenvalues), complex)
    for r in model.rubbers:
        total += _rubber_form(r, state, fields, strains)
    own = 1.0
    for law, softer in zip(model.laws, stiffened(model), strict=True):
        form = sum(_rubber_form(r, state, fields, strains) for r in softer.rubbers)
        hertz = np.sqrt(eigenvalues) / (2 * np.pi)
        ratio = np.array([law.ratio(f) for f in hertz])
        total += (ratio - 1) * form
        # d rho / d lambda = rho (d ln rho / d ln f) / (2 lambda)
        slope = np.array([law.slope(f) for f in hertz])
        own = own - form.real * ratio.real * slope / (2 * eigenvalues)
    for c in model.cords:
        D = cords.tangent(mechanics.cord_vectors(c, state), c.stiffness)
        D = D.reshape(*c.lines.R.shape, 3, 3) * (c.lines.weights * c.lines.R)[..., None, None]
        total += _contract(D, _products(c.b0, c.hoop, c.lines.connectivity, fields, strains))
    for load in loads:
        total += _pressure_form(model, state, load, fields)
    M = mechanics.mass(model)
    if any(map(np.iscomplexobj, (M.data, real, model.spin2))):
        for j, _, a, b in fields.of_each_mode():
            u = np.moveaxis(np.concatenate([a, b]), 0, -1)  # (nodes, 3, parts)
            energy = np.array([((M @ u[:, i]) * u[:, i]).sum() for i in range(3)])
            in_plane = energy @ np.diag(pressure.IN_PLANE)
            total[j] -= eigenvalues[j] * energy.sum() + model.spin2 * in_plane
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


def _rubber_form(r: Rubber, state: Array, fields: Fields, strains: Strains) -> Array:
    """phi^H K phi (m,) of a block of rubber."""
    s = r.solids
    A = rubber.tangent(mechanics.deformation(s, state), r.material, s.weights.ravel())
    A = A.reshape(*s.weights.shape, 9, 9)
    total = _contract(A, _products(s.B0, s.hoop, s.connectivity, fields, strains))
    if s.hourglass is not None:
        for j, _, a, b in fields.of_each_mode():
            for part in (a, b):
                strain = np.einsum("ea,meai->mei", s.hourglass, part[:, s.connectivity])
                total[j] += (strain**2).sum((0, 2)) @ r.hourglass_stiffness
    return total


def _contract(A: Array, G: Array) -> Array:
    """sum over Gauss points of A : G per mode; A (e, g, k, k), G (m, e, g, k, k)."""
    G, A = G.reshape(len(G), -1), A.reshape(-1)
    if np.iscomplexobj(G):
        return np.asarray(G @ A)
    return np.asarray(G @ A.real + 1j * (G @ A.imag))


def _products(
    B0: Array, hoop: Array, connectivity: Array, fields: Fields, strains: Strains
) -> Array:
    """G = sum of H H^T over a mode's parts, real and imaginary (m, e, g, k, k), H its gradients:
    the sum of all H^T A H is A : G. Operators with a tangent are one variable's, the others all's.
    """
    for operator, around, known in strains:
        if operator is B0 or (np.array_equal(operator, B0) and np.array_equal(around, hoop)):
            return known
    e, g, k, _ = B0.shape
    G = np.empty((fields.count, e, g, k, k), np.result_type(B0, hoop, fields.real))
    for j, n, a, b in fields.of_each_mode():
        H = np.concatenate(_gradients(B0, hoop, connectivity, a, b, n), -1)
        np.matmul(H, H.swapaxes(-1, -2), out=G[j])
    if not np.iscomplexobj(G):
        strains.append((B0, hoop, G))
    return G


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


def _pressure_form(model: Model, state: Array, load: Load, fields: Fields) -> Array:
    """phi^H K phi (m,) of a follower pressure; its K0 is symmetric, its K1 antisymmetric:
    (a - i b)^T (K0 + i n K1) (a + i b) = K0 : (a a^T + b b^T) + K1 : n (b a^T - a b^T)."""
    alone = replace(model, rubbers=[], cords=[], spin2=0.0)
    (_, K0), (_, K1) = (parts[0] for parts in mechanics.tangents(alone, state, [load], True)[:2])
    rows = load.lines.connectivity
    total = np.zeros(fields.count, complex)
    for j, n, real, imag in fields.of_each_mode():
        a, b = (
            np.moveaxis(part[:, rows].reshape(len(n), *K0.shape[:2]), 0, -1)
            for part in (real, imag)
        )
        at, bt = a.swapaxes(1, 2), b.swapaxes(1, 2)
        total[j] = (K0 * (a @ at + b @ bt)).sum() + (K1 * ((n * b) @ at - (n * a) @ bt)).sum()
    return total
