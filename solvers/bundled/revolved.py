"""The tyre in three dimensions: residual, tangent product and station tangents.

State U (k, n, 3) in m at the angles of a `Circumference`; the section's operators serve at every
Gauss station with the station's displacement and its derivative by the angle:

    F = 1 + B0 u + B1 du/dTheta,   q = a + b0 u + hoop du/dTheta
"""

from __future__ import annotations

import numpy as np

from . import cords, pressure, rubber
from .circumference import Circumference
from .mechanics import Load
from .model import Cords, Model, Rubber
from .section import Lines

Array = np.ndarray
FLATTEST = 0.2  # volume over the reference one: nearly incompressible rubber stays near 1


class Inverted(ArithmeticError):
    """An element turned inside out, or nearly so."""

    def __init__(self) -> None:
        super().__init__("elements turn inside out")


class Revolved:
    """Mechanics about the last state that `residual` was given."""

    def __init__(self, model: Model, loads: list[Load], around: Circumference):
        self.model, self.loads, self.around = model, loads, around
        self._parts: list[_Part] = [_RubberPart(r) for r in model.rubbers]
        self._parts += [_CordPart(c) for c in model.cords]
        self._parts += [_PressurePart(model.mesh.X, load) for load in loads]

    def _stations(self, U: Array) -> tuple[Array, Array]:
        """Displacement and its derivative by the angle at the stations (s, n, 3)."""
        flat = U.reshape(len(U), -1)
        return (
            (self.around.N @ flat).reshape(-1, *U.shape[1:]),
            (self.around.slope @ flat).reshape(-1, *U.shape[1:]),
        )

    def _nodes(self, forces: list[tuple[Array, Array, Array]]) -> Array:
        """Nodal forces (k, n, 3) from (connectivity, by u, by du/dTheta), each (e, s, a, 3)."""
        s, n = len(self.around.weights), len(self.model.mesh.X)
        total = np.zeros((2, n, s, 3))
        for connectivity, by_u, by_du in forces:
            for slot, force in enumerate((by_u, by_du)):
                np.add.at(total[slot], connectivity, force.swapaxes(1, 2))
        total *= self.around.weights[:, None]
        by_u, by_du = total.swapaxes(1, 2).reshape(2, s, -1)
        result = self.around.N.T @ by_u + self.around.slope.T @ by_du
        return np.asarray(result.reshape(-1, n, 3))

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
        shares = np.zeros((len(self.model.mesh.X), len(u)))
        np.add.at(shares, lines.connectivity, by_node)
        return np.asarray((shares * self.around.weights @ self.around.N).T)

    def tangents(self) -> list[tuple[Array, Array, Array, Array]]:
        """Per part: connectivity; d2W/du du, du dv and dv dv, v = du/dTheta, (s, e, 3a, 3a)."""
        return [p.tangents() for p in self._parts]


class _Part:
    """What rubber, cords and pressure have in common: rows of F or q at Gauss points."""

    def force(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        raise NotImplementedError

    def potential(self) -> Array:
        """At the stations (s,), J per radian."""
        raise NotImplementedError

    def product(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        raise NotImplementedError

    def tangents(self) -> tuple[Array, Array, Array, Array]:
        raise NotImplementedError


def _columns(connectivity: Array, u: Array) -> Array:
    """Element displacements (e, 3a, s) from the stations' (s, n, 3)."""
    s, (e, a) = len(u), connectivity.shape
    return np.ascontiguousarray(u[:, connectivity].reshape(s, e, 3 * a).transpose(1, 2, 0))


def _rows(forces: Array) -> Array:
    """Element forces (e, 3a, s) as (e, s, a, 3)."""
    e, d, s = forces.shape
    return forces.swapaxes(1, 2).reshape(e, s, d // 3, 3)


class _RubberPart(_Part):
    def __init__(self, r: Rubber):
        self.r, s = r, r.solids
        self._A: Array | None = None
        self.e, self.g, _, self.d = s.B0.shape
        self.B0 = s.B0.reshape(self.e, self.g * 9, self.d)
        self.B1 = s.B1.reshape(self.e, self.g * 3, self.d)

    def _gradient(self, u: Array, du: Array) -> Array:
        """H = B0 u + B1 du (e, g, s, 9)."""
        c = self.r.solids.connectivity
        H = (self.B0 @ _columns(c, u)).reshape(self.e, self.g, 9, -1)
        H[:, :, 1::3] += (self.B1 @ _columns(c, du)).reshape(self.e, self.g, 3, -1)
        return H.swapaxes(2, 3)

    def _forces(self, P: Array, u: Array) -> tuple[Array, Array, Array]:
        """From stresses times weights (e, g, s, 9), and the hourglass stiffness."""
        solids = self.r.solids
        P = P.swapaxes(2, 3)
        by_u = self.B0.swapaxes(1, 2) @ P.reshape(self.e, self.g * 9, -1)
        by_du = self.B1.swapaxes(1, 2) @ P[:, :, 1::3].reshape(self.e, self.g * 3, -1)
        by_u = _rows(by_u)
        if solids.hourglass is not None:
            h = solids.hourglass
            strain = np.einsum("ea,seai->esi", h, u[:, solids.connectivity])
            by_u += (self.r.hourglass_stiffness[:, None] * h)[:, None, :, None] * strain[:, :, None]
        return solids.connectivity, by_u, _rows(by_du)

    def force(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
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
        s = len(self._u)
        W = (rubber.energy(self._F, self._law) * self._weights).reshape(-1, s).sum(0)
        solids = self.r.solids
        if solids.hourglass is not None:
            strain = np.einsum("ea,seai->sei", solids.hourglass, self._u[:, solids.connectivity])
            W += (self.r.hourglass_stiffness * (strain**2).sum(-1)).sum(-1) / 2
        return W

    @property
    def A(self) -> Array:
        """First elasticity tensors times weights (e, g, s, 9, 9)."""
        if self._A is None:
            A = rubber.tangent(self._F, self._law, self._weights)
            self._A = A.reshape(self.e, self.g, -1, 9, 9)
        return self._A

    def product(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        H = self._gradient(u, du)
        return self._forces((self.A @ H[..., None])[..., 0], u)

    def tangents(self) -> tuple[Array, Array, Array, Array]:
        s, e, g, d = self.A.shape[2], self.e, self.g, self.d
        A = self.A.transpose(2, 0, 1, 3, 4)
        B0, B1 = self.r.solids.B0, self.r.solids.B1
        B0t, B1t = self.B0.swapaxes(1, 2), self.B1.swapaxes(1, 2)
        AB1 = A[..., 1::3] @ B1
        K0 = B0t @ (A @ B0).reshape(s, e, g * 9, d)
        if self.r.solids.hourglass is not None:
            h = self.r.solids.hourglass
            hold = self.r.hourglass_stiffness[:, None, None] * h[:, :, None] * h[:, None]
            K0 = K0 + np.einsum("eab,ij->eaibj", hold, np.eye(3)).reshape(e, d, d)
        K1 = B0t @ AB1.reshape(s, e, g * 9, d)
        K2 = B1t @ AB1[..., 1::3, :].reshape(s, e, g * 3, d)
        return self.r.solids.connectivity, K0, K1, K2


def _at_stations(law: rubber.MooneyRivlin, points: int, s: int) -> rubber.MooneyRivlin:
    """The law's constants per Gauss point, repeated for every station."""
    spread = lambda c: _spread(np.broadcast_to(c, points) if np.ndim(c) < 2 else c, s)
    return rubber.MooneyRivlin(spread(law.C10), spread(law.C01), spread(law.inverse_D1))


def _spread(constant: Array, s: int) -> Array:
    """A constant per Gauss point (p,), or per Gauss point and station (p, s), as (p * s,)."""
    return constant.ravel() if constant.ndim == 2 else np.repeat(constant, s)


class _CordPart(_Part):
    def __init__(self, c: Cords):
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
        n = self.c.lines.connectivity
        q = self.b0 @ _columns(n, u) + self.b1 @ _columns(n, du)
        return q.reshape(self.e, self.g, 3, -1).swapaxes(2, 3)

    def _forces(self, q: Array) -> tuple[Array, Array, Array]:
        q = (q * self.weights[..., None, None]).swapaxes(2, 3).reshape(self.e, self.g * 3, -1)
        by_u, by_du = self.b0.swapaxes(1, 2) @ q, self.b1.swapaxes(1, 2) @ q
        return self.c.lines.connectivity, _rows(by_u), _rows(by_du)

    def force(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        q = self._vectors(u, du) + self.c.direction[:, :, None]
        shape = q.shape
        stiffness = _spread(self.c.stiffness, shape[2])
        self.D = cords.tangent(q.reshape(-1, 3), stiffness).reshape(*shape, 3)
        self._W = cords.energy(q.reshape(-1, 3), stiffness).reshape(shape[:3])
        return self._forces(cords.force(q.reshape(-1, 3), stiffness).reshape(shape))

    def potential(self) -> Array:
        return np.asarray((self._W * self.weights[..., None]).sum((0, 1)))

    def product(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        return self._forces((self.D @ self._vectors(u, du)[..., None])[..., 0])

    def tangents(self) -> tuple[Array, Array, Array, Array]:
        s, e, g, d = self.D.shape[2], self.e, self.g, self.d
        D = (self.D * self.weights[..., None, None, None]).transpose(2, 0, 1, 3, 4)
        b0, b1 = self.b0.reshape(e, g, 3, d), self.b1.reshape(e, g, 3, d)
        D0, D1 = (D @ b0).reshape(s, e, g * 3, d), (D @ b1).reshape(s, e, g * 3, d)
        b0t, b1t = self.b0.swapaxes(1, 2), self.b1.swapaxes(1, 2)
        return self.c.lines.connectivity, b0t @ D0, b0t @ D1, b1t @ D1


class _PressurePart(_Part):
    """Potential -p V, V = 1/2 int (x_r, x_theta, 0) . (x' x (dx/dTheta + e_z x x))."""

    def __init__(self, X: Array, load: Load):
        self.load, lines = load, load.lines
        self.X = np.stack([X[:, 0], np.zeros(len(X)), X[:, 1]], -1)
        e, g, a = lines.slope.shape
        self.N = np.broadcast_to(lines.N, (e, g, a))
        self.weights = -load.pressure * lines.weights

    def _fields(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        """u, u', du (e, g, s, 3) on the surface."""
        c, lines = self.load.lines.connectivity, self.load.lines
        shape = (*self.N.shape[:2], len(u), 3)
        at = lambda w, rows: (rows @ _flat(c, w)).reshape(shape)
        return at(u, self.N), at(u, lines.slope), at(du, self.N)

    def _forces(self, by_x: Array, by_dx: Array, by_around: Array) -> tuple[Array, Array, Array]:
        lines = self.load.lines
        e, g, s, _ = by_x.shape
        w = self.weights[..., None, None]
        at = lambda rows, f: rows.swapaxes(1, 2) @ (w * f).reshape(e, g, s * 3)
        shape = lambda f: f.reshape(e, -1, s, 3).swapaxes(1, 2)
        by_u = at(self.N, by_x) + at(lines.slope, by_dx)
        return lines.connectivity, shape(by_u), shape(at(self.N, by_around))

    def place(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        """Deformed x, x', dx/dTheta (e, g, s, 3) on the surface."""
        c, lines = self.load.lines.connectivity, self.load.lines
        x, dx, around = self._fields(u, du)
        x = x + (self.N @ self.X[c])[:, :, None]
        return x, dx + (lines.slope @ self.X[c])[:, :, None], around

    def force(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        self.at = self.place(u, du)
        return self._forces(*pressure.first_around(*self.at))

    def potential(self) -> Array:
        density = pressure.density(*self.at) * self.weights[..., None]
        return np.asarray(density.sum((0, 1)))

    def product(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        return self._forces(*pressure.change(*self.at, *self._fields(u, du)))

    def tangents(self) -> tuple[Array, Array, Array, Array]:
        """By the product with unit displacements of each element's own nodes."""
        lines = self.load.lines
        e, g, a = lines.slope.shape
        s = self.at[0].shape[2]
        K = np.zeros((3, s, e, 3 * a, 3 * a))
        for b in range(a):
            for j in range(3):
                unit = np.zeros((e, g, s, 3))
                unit[..., j] = 1.0
                N, slope = self.N[:, :, b, None, None], lines.slope[:, :, b, None, None]
                zero = np.zeros_like(unit)
                _, by_u, _ = self._forces(*pressure.change(*self.at, unit * N, unit * slope, zero))
                _, mixed, _ = self._forces(*pressure.change(*self.at, zero, zero, unit * N))
                K[0, ..., 3 * b + j] = by_u.swapaxes(0, 1).reshape(s, e, 3 * a)
                K[1, ..., 3 * b + j] = mixed.swapaxes(0, 1).reshape(s, e, 3 * a)
        return lines.connectivity, K[0], K[1], K[2]


def _flat(connectivity: Array, u: Array) -> Array:
    """Stations' vectors (s, n, 3) at the elements' nodes, (e, a, s * 3)."""
    e, a = connectivity.shape
    return u[:, connectivity].transpose(1, 2, 0, 3).reshape(e, a, -1)
