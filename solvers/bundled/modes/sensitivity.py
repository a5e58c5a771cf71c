"""Exact derivatives of eigenvalues by numbers of the deck, the preload's change included.

    d lambda/dp = phi^H (dK/dp + D_u K[v] - lambda dM/dp) phi,    v = -K0^-1 dr/dp

(Nelson's first-order formula about the equilibrium r(u, p) = 0.) All three terms come from one
complex step: the quadratic forms of the shape phi are evaluated on the model built from the deck
with its number p + i h dp, at the state u + i h v; no second derivative is written out.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ..deck.keywords import STEP
from ..section import mechanics
from ..section.band import Cholesky, Numbering
from ..section.mechanics import Load
from ..section.model import Model, Rubber, stiffened
from ..section.parts import cords, pressure, rubber
from .cavity import Air, coupling
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


class Fields:
    """Modes as sums of shapes a + i b (p, nodes, 3) of harmonics n (p,).

    ``owner`` (p,): the mode, from 0 on, that each is part of; None: each is a mode. What the
    modes' gradients give is remembered from one variable to the next.
    """

    def __init__(self, n: Array, shapes: Array, owner: Array | None = None):
        self.n, self.shapes = n, shapes
        self.owner = np.arange(len(n)) if owner is None else owner
        self._set(shapes.real, shapes.imag)

    def _set(self, real: Array, imag: Array) -> None:
        self.tangent = np.iscomplexobj(real)
        self.modes = []
        for j in range(self.owner.max() + 1):
            mine = self.owner == j
            self.modes.append((self.n[mine], real[mine], imag[mine]))
        self.known: list[tuple[Array, Array, Array]] = []

    def carried(self, beside: Beside | None, X: Array) -> Fields:
        """The shapes with the rim's nodes where p's tangent takes them."""
        if beside is None or beside.wheel is None or not np.iscomplexobj(X):
            return self
        moved = copy.copy(self)
        moved._set(*beside.carried(X, self.n, self.shapes.real, self.shapes.imag))
        return moved


def eigenvalue_rates(
    model: Model,
    U: Array,
    V: Array,
    loads: list[Load],
    fields: Fields,
    eigenvalues: Array,
    beside: Beside | None = None,
) -> Array:
    """d lambda/dp (m,) of the modes ``fields``, lambda (m,).

    ``model`` and ``loads`` carry the tangent of p, V = dU/dp; ``beside``: the rim and the air that
    move along. Where the model has laws of frequency, lambda changes its own modulus:
    d lambda/dp = (d lambda/dp at that modulus) / (1 - d lambda/d rho d rho/d lambda).
    """
    state = U + 1j * STEP * V
    fields = fields.carried(beside, model.mesh.X)
    total = np.zeros(len(eigenvalues), complex)
    for r in model.rubbers:
        total += _rubber_form(r, state, fields)
    own = 1.0
    for law, softer in zip(model.laws, stiffened(model), strict=True):
        form = sum(_rubber_form(r, state, fields) for r in softer.rubbers)
        hertz = np.sqrt(eigenvalues) / (2 * np.pi)
        ratio = np.array([law.ratio(f) for f in hertz])
        total += (ratio - 1) * form
        # d rho / d lambda = rho (d ln rho / d ln f) / (2 lambda)
        slope = np.array([law.slope(f) for f in hertz])
        own = own - form.real * ratio.real * slope / (2 * eigenvalues)
    for c in model.cords:
        D = cords.tangent(mechanics.cord_vectors(c, state), c.stiffness)
        D = D.reshape(*c.lines.R.shape, 3, 3) * (c.lines.weights * c.lines.R)[..., None, None]
        total += _contract(D, _products(c.b0, c.hoop, c.lines.connectivity, fields))
    for load in loads:
        total += _pressure_form(model, state, load, fields)
    M = mechanics.mass(model)
    total -= eigenvalues * _energies(M, fields).sum(1)
    if model.spin2:
        total -= _energies(model.spin2 * M, fields) @ np.diag(pressure.IN_PLANE)
    if beside:
        total += beside.forms(model, state, loads, fields, eigenvalues)
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
        assert self.wheel
        real, imag = real.astype(complex), imag.astype(complex)
        for j, q in enumerate(self.rim):
            a, b = (part[self.wheel.rim] for part in self.wheel.fields(int(n[j]), X))
            real[j, self.wheel.rim] = a @ q.real - b @ q.imag
            imag[j, self.wheel.rim] = a @ q.imag + b @ q.real
        return real, imag

    def forms(
        self, model: Model, state: Array, loads: list[Load], fields: Fields, eigenvalues: Array
    ) -> Array:
        """Their part of phi^H (K - lambda M) phi per mode, with the tangent of p."""
        total = np.zeros(len(eigenvalues), complex)
        X = model.mesh.X
        forces = mechanics.gradient(model, state, loads) if self.wheel else state
        couplings = {m: coupling(self.air, X, state, m) for m in set(fields.n.tolist()) if self.air}
        for j, ((m,), (real,), (imag,)) in enumerate(fields.modes):
            if self.wheel:
                stiffness, inertia = self.wheel.own(int(m), X, forces)
                total[j] += (stiffness - eigenvalues[j] * inertia) @ abs(self.rim[j]) ** 2
            for part, w in ((real, self.flow[j].real), (imag, self.flow[j].imag)):
                if m in couplings:
                    air = couplings[m]
                    H = air.H[air.flowing, air.flowing]
                    swept = air.strain(part, w)
                    total[j] += swept @ np.linalg.solve(air.Q, swept)
                    total[j] -= eigenvalues[j] * (w @ H @ w)
        return total


def _rubber_form(r: Rubber, state: Array, fields: Fields) -> Array:
    """phi^H K phi (m,) of a block of rubber."""
    s = r.solids
    A = rubber.tangent(mechanics.deformation(s, state), r.material, s.weights.ravel())
    A = A.reshape(*s.weights.shape, 9, 9)
    total = _contract(A, _products(s.B0, s.hoop, s.connectivity, fields))
    if s.hourglass is not None:
        for j, (_, a, b) in enumerate(fields.modes):
            for part in (a, b):
                strain = np.einsum("ea,meai->mei", s.hourglass, part[:, s.connectivity])
                total[j] += (strain**2).sum((0, 2)) @ r.hourglass_stiffness
    return total


def _energies(M: csr_array, fields: Fields) -> Array:
    """u^T M u (m, 3) per mode and component; of real shapes only p's tangent, imaginary."""
    energy = np.zeros((len(fields.modes), 3), complex)
    if not (fields.tangent or np.iscomplexobj(M.data)):
        return energy
    if not fields.tangent:
        M = csr_array((M.data.imag, M.indices, M.indptr), M.shape)
        M.eliminate_zeros()
    for j, (_, a, b) in enumerate(fields.modes):
        u = np.moveaxis(np.concatenate([a, b]), 0, -1)  # (nodes, 3, parts)
        energy[j] = ((M @ u.reshape(len(u), -1)).reshape(u.shape) * u).sum((0, 2))
    return energy if fields.tangent else 1j * energy


def _contract(A: Array, G: Array) -> Array:
    """sum over Gauss points of A : G per mode; A (e, g, k, k), G (m, e, g, k, k)."""
    G, A = G.reshape(len(G), -1), A.reshape(-1)
    if np.iscomplexobj(G):
        return np.asarray(G @ A)
    return np.asarray(G @ A.real + 1j * (G @ A.imag))


def _products(B0: Array, hoop: Array, connectivity: Array, fields: Fields) -> Array:
    """G = sum of H H^T over a mode's parts, real and imaginary (m, e, g, k, k), H its gradients:
    the sum of all H^T A H is A : G. Operators with a tangent are one variable's, the others all's.
    """
    for operator, around, known in fields.known:
        if operator is B0 or (np.array_equal(operator, B0) and np.array_equal(around, hoop)):
            return known
    e, g, k, _ = B0.shape
    G = np.empty((len(fields.modes), e, g, k, k), np.result_type(B0, hoop, fields.modes[0][1]))
    for j, (n, a, b) in enumerate(fields.modes):
        H = np.concatenate(_gradients(B0, hoop, connectivity, a, b, n), -1)
        np.matmul(H, H.swapaxes(-1, -2), out=G[j])
    if not np.iscomplexobj(G):
        fields.known.append((B0, hoop, G))
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
    total = np.zeros(len(fields.modes), complex)
    for j, (n, real, imag) in enumerate(fields.modes):
        a, b = (
            np.moveaxis(part[:, rows].reshape(len(n), *K0.shape[:2]), 0, -1)
            for part in (real, imag)
        )
        at, bt = a.swapaxes(1, 2), b.swapaxes(1, 2)
        total[j] = (K0 * (a @ at + b @ bt)).sum() + (K1 * ((n * b) @ at - (n * a) @ bt)).sum()
    return total
