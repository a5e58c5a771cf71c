"""The tyre in three dimensions: residual, tangent product and station tangents.

State U (k, n, 3) in m at the angles of a `Circumference`; the section's operators serve at every
Gauss station with the station's displacement and its derivative by the angle:

    F = 1 + B0 u + B1 du/dTheta,   q = a + b0 u + hoop du/dTheta
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from ..section.elements import Lines
from ..section.mechanics import Load
from ..section.model import Cords, Model, Rubber
from ..section.parts import cords, pressure, rubber
from .circumference import Circumference

Array = np.ndarray
Precision = type[np.floating[Any]]
Tangents = tuple[Array, Array, Array, Array]
FLATTEST = 0.2  # volume over the reference one: nearly incompressible rubber stays near 1


class Inverted(ArithmeticError):
    """An element turned inside out, or nearly so."""

    def __init__(self) -> None:
        super().__init__("elements turn inside out")


class Revolved:
    """Mechanics about the last state that `residual` was given."""

    def __init__(self, model: Model, loads: list[Load], around: Circumference):
        self.model, self.loads, self.around = model, loads, around
        nodes = len(model.mesh.X)
        self._parts: list[_Part] = [_RubberPart(r, nodes) for r in model.rubbers]
        self._parts += [_CordPart(c, nodes) for c in model.cords]
        self._parts += [_PressurePart(model.mesh.X, load) for load in loads]

    def _stations(self, U: Array) -> tuple[Array, Array]:
        """Displacement and its derivative by the angle at the stations (3n, s)."""
        flat = U.reshape(len(U), -1).T
        return flat @ self.around.N.T, flat @ self.around.slope.T

    def _nodes(self, forces: list[tuple[Array, Array]]) -> Array:
        """Nodal forces (k, n, 3) from each part's, by u and by du/dTheta (e, 3a, s)."""
        by_u, by_du = (
            sum(part.gather(f) for part, f in zip(self._parts, each, strict=True))
            for each in zip(*forces, strict=True)
        )
        weights = self.around.weights[:, None]
        result = by_u @ (weights * self.around.N) + by_du @ (weights * self.around.slope)
        return np.ascontiguousarray(result.T).reshape(len(result.T), -1, 3)

    def residual(self, U: Array) -> Array:
        """Internal force less that of the pressure (k, n, 3), N; the tangents follow U."""
        self._U = U
        u, du = self._stations(U)
        return self._nodes([p.force(u, du) for p in self._parts])

    def potential(self) -> float:
        """Strain energy less the pressure's work at the last state, J."""
        return sum(float(p.potential() @ self.around.weights) for p in self._parts)

    def product(self, V: Array) -> Array:
        """Tangent stiffness times V (k, n, 3), N."""
        u, du = self._stations(V)
        return self._nodes([p.product(u, du) for p in self._parts])

    def surface_shares(self, lines: Lines) -> Array:
        """Deformed area (k, n) that each node stands for on a surface, of half the tyre, m2."""
        u, du = self._stations(self._U)
        part = _PressurePart(self.model.mesh.X, Load(lines, 1.0))
        x, dx, around = part.place(u, du)
        density = np.linalg.norm(pressure.cross(dx, around + x @ pressure.SPIN.T), axis=-1)
        by_node = np.einsum("ega,eg,egs->eas", part.N, lines.weights, density)
        shares = np.zeros((len(self.model.mesh.X), u.shape[1]))
        np.add.at(shares, lines.connectivity, by_node)
        return np.asarray((shares * self.around.weights @ self.around.N).T)

    def tangents(self, precision: Precision = np.float64) -> list[Tangents]:
        """Per part: connectivity; d2W/du du, du dv and dv dv, v = du/dTheta, (s, e, 3a, 3a)."""
        return [p.tangents(precision) for p in self._parts]


class _Part:
    """What rubber, cords and pressure have in common: rows of F or q at Gauss points."""

    def __init__(self, connectivity: Array, nodes: int):
        self.dofs = (3 * connectivity[..., None] + np.arange(3)).reshape(len(connectivity), -1)
        size = self.dofs.size
        ones = (np.ones(size), (self.dofs.ravel(), np.arange(size)))
        self._assembly = csr_matrix(ones, shape=(3 * nodes, size))

    def gather(self, forces: Array) -> Array:
        """Sums (3n, s) at the nodes of the elements' forces (e, 3a, s)."""
        return np.asarray(self._assembly @ forces.reshape(self.dofs.size, -1))

    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        """By u and by du/dTheta (e, 3a, s), of u and du (3n, s)."""
        raise NotImplementedError

    def potential(self) -> Array:
        """At the stations (s,), J per radian."""
        raise NotImplementedError

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        raise NotImplementedError

    def tangents(self, precision: Precision) -> Tangents:
        raise NotImplementedError


class _RubberPart(_Part):
    def __init__(self, r: Rubber, nodes: int):
        super().__init__(r.solids.connectivity, nodes)
        self.r, s = r, r.solids
        self._A: Array | None = None
        self.e, self.g, _, self.d = s.B0.shape
        self.B0 = s.B0.reshape(self.e, self.g * 9, self.d)
        self.B1 = s.B1.reshape(self.e, self.g * 3, self.d)

    def _gradient(self, u: Array, du: Array) -> Array:
        """H = B0 u + B1 du (e, g, s, 9)."""
        H = (self.B0 @ u[self.dofs]).reshape(self.e, self.g, 9, -1)
        H[:, :, 1::3] += (self.B1 @ du[self.dofs]).reshape(self.e, self.g, 3, -1)
        return H.swapaxes(2, 3)

    def _hourglass(self, u: Array, h: Array) -> Array:
        """Hourglass strains (e, 3, s)."""
        at = u[self.dofs].reshape(self.e, -1, 3, u.shape[1])
        return np.asarray(np.einsum("ea,eais->eis", h, at))

    def _forces(self, P: Array, u: Array) -> tuple[Array, Array]:
        """From stresses times weights (e, g, s, 9), and the hourglass stiffness."""
        solids = self.r.solids
        P = P.swapaxes(2, 3)
        by_u = self.B0.swapaxes(1, 2) @ P.reshape(self.e, self.g * 9, -1)
        by_du = self.B1.swapaxes(1, 2) @ P[:, :, 1::3].reshape(self.e, self.g * 3, -1)
        if solids.hourglass is not None:
            h = solids.hourglass
            hold = self.r.hourglass_stiffness[:, None] * h
            by_u += np.einsum("ea,eis->eais", hold, self._hourglass(u, h)).reshape(by_u.shape)
        return by_u, by_du

    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        H = self._gradient(u, du)
        shape = H.shape
        F = (H + np.eye(3).ravel()).reshape(-1, 3, 3)
        J, _ = rubber.determinant(F)
        if not J.min() > FLATTEST:
            raise Inverted
        law = _at_stations(self.r.material, self.e * self.g, shape[2])
        weights = np.repeat(self.r.solids.weights.ravel(), shape[2])
        self._F, self._law, self._weights, self._A = F, law, weights, None
        P = rubber.stress(F, law).reshape(shape) * weights.reshape(*shape[:3], 1)
        self._u = u
        return self._forces(P, u)

    def potential(self) -> Array:
        s, h = self._u.shape[1], self.r.solids.hourglass
        W = (rubber.energy(self._F, self._law) * self._weights).reshape(-1, s).sum(0)
        if h is not None:
            W += self.r.hourglass_stiffness @ (self._hourglass(self._u, h) ** 2).sum(1) / 2
        return np.asarray(W)

    @property
    def A(self) -> Array:
        """First elasticity tensors times weights (e, g, s, 9, 9)."""
        if self._A is None:
            A = rubber.tangent(self._F, self._law, self._weights)
            self._A = A.reshape(self.e, self.g, -1, 9, 9)
        return self._A

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        H = self._gradient(u, du)
        return self._forces((self.A @ H[..., None])[..., 0], u)

    def tangents(self, precision: Precision) -> Tangents:
        s, e, g, d = self.A.shape[2], self.e, self.g, self.d
        A = self.A.transpose(2, 0, 1, 3, 4).astype(precision)
        B0, B1 = self.r.solids.B0.astype(precision), self.r.solids.B1.astype(precision)
        B0t, B1t = B0.reshape(e, g * 9, d).swapaxes(1, 2), B1.reshape(e, g * 3, d).swapaxes(1, 2)
        AB1 = A[..., 1::3] @ B1
        K0 = B0t @ (A @ B0).reshape(s, e, g * 9, d)
        if self.r.solids.hourglass is not None:
            h = self.r.solids.hourglass
            hold = self.r.hourglass_stiffness[:, None, None] * h[:, :, None] * h[:, None]
            K0 += np.einsum("eab,ij->eaibj", hold, np.eye(3)).reshape(e, d, d)
        K1 = B0t @ AB1.reshape(s, e, g * 9, d)
        K2 = B1t @ AB1[..., 1::3, :].reshape(s, e, g * 3, d)
        return self.r.solids.connectivity, K0, K1, K2


def _at_stations(law: rubber.MooneyRivlin, points: int, s: int) -> rubber.MooneyRivlin:
    """The law's constants per Gauss point, repeated for every station."""
    spread = lambda c: _spread(np.broadcast_to(c, points) if np.ndim(c) < 2 else c, s)
    optional = lambda c: None if c is None else spread(c)
    return replace(
        law,
        C10=spread(law.C10),
        C01=spread(law.C01),
        inverse_D1=spread(law.inverse_D1),
        shear_ratio=optional(law.shear_ratio),
        bulk_ratio=optional(law.bulk_ratio),
    )


def _spread(constant: Array, s: int) -> Array:
    """A constant per Gauss point (p,), or per Gauss point and station (p, s), as (p * s,)."""
    return constant.ravel() if constant.ndim == 2 else np.repeat(constant, s)


class _CordPart(_Part):
    def __init__(self, c: Cords, nodes: int):
        super().__init__(c.lines.connectivity, nodes)
        self.c = c
        self.e, self.g, _, self.d = c.b0.shape
        self.b0 = c.b0.reshape(self.e, self.g * 3, self.d)
        b1 = np.zeros((self.e, self.g, 3, self.d // 3, 3))
        for i in range(3):
            b1[:, :, i, :, i] = c.hoop
        self.b1 = b1.reshape(self.e, self.g * 3, self.d)
        self.weights = c.lines.weights * c.lines.R

    def _vectors(self, u: Array, du: Array) -> Array:
        """b0 u + hoop du (e, g, s, 3)."""
        q = self.b0 @ u[self.dofs] + self.b1 @ du[self.dofs]
        return q.reshape(self.e, self.g, 3, -1).swapaxes(2, 3)

    def _forces(self, q: Array) -> tuple[Array, Array]:
        q = (q * self.weights[..., None, None]).swapaxes(2, 3).reshape(self.e, self.g * 3, -1)
        return self.b0.swapaxes(1, 2) @ q, self.b1.swapaxes(1, 2) @ q

    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        q = self._vectors(u, du) + self.c.direction[:, :, None]
        shape = q.shape
        stiffness = _spread(self.c.stiffness, shape[2])
        self.D = cords.tangent(q.reshape(-1, 3), stiffness).reshape(*shape, 3)
        self._W = cords.energy(q.reshape(-1, 3), stiffness).reshape(shape[:3])
        return self._forces(cords.force(q.reshape(-1, 3), stiffness).reshape(shape))

    def potential(self) -> Array:
        return np.asarray((self._W * self.weights[..., None]).sum((0, 1)))

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        return self._forces((self.D @ self._vectors(u, du)[..., None])[..., 0])

    def tangents(self, precision: Precision) -> Tangents:
        s, e, g, d = self.D.shape[2], self.e, self.g, self.d
        D = (self.D * self.weights[..., None, None, None]).transpose(2, 0, 1, 3, 4)
        D, b0, b1 = D.astype(precision), self.b0.astype(precision), self.b1.astype(precision)
        D0, D1 = ((D @ b.reshape(e, g, 3, d)).reshape(s, e, g * 3, d) for b in (b0, b1))
        b0t, b1t = b0.swapaxes(1, 2), b1.swapaxes(1, 2)
        return self.c.lines.connectivity, b0t @ D0, b0t @ D1, b1t @ D1


class _PressurePart(_Part):
    """Potential -p V, V = 1/2 int (x_r, x_theta, 0) . (x' x (dx/dTheta + e_z x x))."""

    def __init__(self, X: Array, load: Load):
        super().__init__(load.lines.connectivity, len(X))
        self.load, lines = load, load.lines
        self.X = np.stack([X[:, 0], np.zeros(len(X)), X[:, 1]], -1)
        e, g, a = lines.slope.shape
        self.N = np.broadcast_to(lines.N, (e, g, a))
        self.weights = -load.pressure * lines.weights

    def _fields(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        """u, u', du (e, g, s, 3) on the surface."""
        lines, (e, g, a) = self.load.lines, self.N.shape
        at = lambda w, rows: (rows @ w[self.dofs].reshape(e, a, -1)).reshape(e, g, 3, -1)
        fields = at(u, self.N), at(u, lines.slope), at(du, self.N)
        return tuple(np.ascontiguousarray(f.swapaxes(2, 3)) for f in fields)  # type: ignore[return-value]

    def _forces(self, by_x: Array, by_dx: Array, by_around: Array) -> tuple[Array, Array]:
        lines = self.load.lines
        e, g, s, _ = by_x.shape
        w = self.weights[..., None, None]
        at = lambda rows, f: (
            rows.swapaxes(1, 2) @ (w * f).swapaxes(2, 3).reshape(e, g, 3 * s)
        ).reshape(e, -1, s)
        return at(self.N, by_x) + at(lines.slope, by_dx), at(self.N, by_around)

    def place(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        """Deformed x, x', dx/dTheta (e, g, s, 3) on the surface."""
        c, lines = self.load.lines.connectivity, self.load.lines
        x, dx, around = self._fields(u, du)
        x = x + (self.N @ self.X[c])[:, :, None]
        return x, dx + (lines.slope @ self.X[c])[:, :, None], around

    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        self.at = self.place(u, du)
        return self._forces(*pressure.first_around(*self.at))

    def potential(self) -> Array:
        density = pressure.density(*self.at) * self.weights[..., None]
        return np.asarray(density.sum((0, 1)))

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        return self._forces(*pressure.change(*self.at, *self._fields(u, du)))

    def tangents(self, precision: Precision) -> Tangents:
        """By the product with unit displacements of each element's own nodes."""
        lines = self.load.lines
        e, g, a = lines.slope.shape
        s = self.at[0].shape[2]
        K = np.zeros((3, s, e, 3 * a, 3 * a), precision)
        for b in range(a):
            for j in range(3):
                unit = np.zeros((e, g, s, 3))
                unit[..., j] = 1.0
                N, slope = self.N[:, :, b, None, None], lines.slope[:, :, b, None, None]
                zero = np.zeros_like(unit)
                by_u, _ = self._forces(*pressure.change(*self.at, unit * N, unit * slope, zero))
                mixed, _ = self._forces(*pressure.change(*self.at, zero, zero, unit * N))
                K[0, ..., 3 * b + j] = by_u.transpose(2, 0, 1)
                K[1, ..., 3 * b + j] = mixed.transpose(2, 0, 1)
        return lines.connectivity, K[0], K[1], K[2]
