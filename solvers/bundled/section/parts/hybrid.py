"""Solids with a polynomial of pressure in each element, condensed element by element: the mixed
method of Simo, Taylor and Pister (Computer Methods in Applied Mechanics 51, 1985), which does not
lock where rubber is nearly incompressible.

The volume ratio theta and the pressure p are, in each element, mean-square fits (projections Pi):

    W = sum of w (Wbar(F) + U(theta)),   theta = Pi J,   p = Pi U'(theta)
    dW = sum of w (dWbar/dF + p dJ/dF) : dF
    d2W = sum of w (dF : (d2Wbar/dFdF + p d2J/dFdF) : dF + U'' dtheta^2),   dtheta = Pi (dJ/dF : dF)

F: deformation gradient; J = det F; dJ/dF = J G, G = F^-T; w: weights of the Gauss points g; Wbar
and U: energies of shear and of volume.

With one term this is the mean dilatation of Nagtegaal, Parks and Rice (1974).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..laws.energy_law import EnergyLaw
from ..laws.hyperelastic import Hyperelastic, determinant, square
from .elastic import Elastic, ElasticAtStations
from .part import ModeShapes, Precision, Tangents

Array = np.ndarray


@dataclass(frozen=True, kw_only=True)
class Hybrid(Elastic):
    """Elements with a polynomial of pressure: e elements of a nodes and g Gauss points."""

    projection: Array  # Pi (e, g, g)

    @property
    def hyperelastic(self) -> Hyperelastic:
        """The law."""
        assert isinstance(self.law, Hyperelastic)
        return self.law

    def law_at(self, z: Array) -> EnergyLaw:
        _, pressure, _ = _volume(self.hyperelastic, determinant(square(z))[0], self.projection)
        return replace(self.hyperelastic, pressure=pressure.ravel())

    def energy(self, U: Array) -> Any:
        energy, _, _ = _volume(
            self.hyperelastic, determinant(square(self.at(U)))[0], self.projection
        )
        return super().energy(U) + (energy * self.rows.weights).sum()  # of the law Wbar alone

    def _of_volume(self, U: Array) -> tuple[Array, Array]:
        """dJ/dF (e, g, 9) and w U'' (e, g), dynamic if the law has a dynamic bulk modulus."""
        J, G = determinant(square(self.at(U)))
        _, _, curvature = _volume(self.hyperelastic, J, self.projection)
        e, g = self.rows.weights.shape
        return (J[:, None, None] * G).reshape(e, g, 9), curvature * self.rows.weights

    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        K0, K1, K2 = super().tangents(U, harmonics)
        by_F, stiffness = self._of_volume(U)
        d0, d1 = volume_rows(self, by_F)
        weighted = (stiffness[..., None] * d0).swapaxes(1, 2)
        K0 = K0 + weighted @ d0
        if K1 is None or K2 is None:
            return K0, K1, K2
        half = weighted @ d1
        around = (stiffness[..., None] * d1).swapaxes(1, 2) @ d1
        return K0, K1 + half - half.swapaxes(1, 2), K2 + around

    def form(self, U: Array, fields: ModeShapes) -> Array:
        total = super().form(U, fields)
        by_F, stiffness = self._of_volume(U)
        d0, d1 = volume_rows(self, by_F)
        a, b = (
            np.moveaxis(part[:, self.connectivity].reshape(len(fields.n), *d0.shape[::2]), 0, -1)
            for part in (fields.real, fields.imag)
        )
        real, imag = d0 @ a - fields.n * (d1 @ b), d0 @ b + fields.n * (d1 @ a)  # dtheta
        each = (stiffness[..., None] * (real**2 + imag**2)).sum((0, 1))
        return np.asarray(total + fields.summed(each))

    def at_stations(self, nodes: int) -> HybridAtStations:
        return HybridAtStations(self, nodes)


def _volume(law: Hyperelastic, J: Array, projection: Array) -> tuple[Array, Array, Array]:
    """U, p and U'' (e, g) or (e, g, s) of the volume ratios J (e g,) or (e g s,), which are in the
    order of the points of the law's constants."""
    e, g, _ = projection.shape
    theta = projection @ J.reshape(e, g, -1)
    U, slope, curvature = (v + 0 * theta.ravel() for v in law.volume(theta.ravel()))
    if law.bulk_ratio is not None:  # dynamic over static modulus of a small vibration
        curvature = law.bulk_ratio * curvature
    pressure = projection @ slope.reshape(theta.shape)
    values = U.reshape(theta.shape), pressure, curvature.reshape(theta.shape)
    return values if J.size > e * g else tuple(v[..., 0] for v in values)


def volume_rows(part: Hybrid, by_F: Array) -> tuple[Array, Array]:
    """dtheta/du and dtheta/(du/dTheta) (..., e, g, 3a) from dJ/dF (..., e, g, 9)."""
    rows = part.rows
    by_u = (by_F[..., None, :] @ rows.B0)[..., 0, :]
    by_around = rows.hoop[..., None] * by_F[..., None, rows.around]
    around = by_around.reshape(by_u.shape)
    return part.projection @ by_u, part.projection @ around


class HybridAtStations(ElasticAtStations):
    """Hybrid elements at s Gauss stations round the tyre; the polynomial is in the section."""

    def __init__(self, part: Hybrid, nodes: int):
        super().__init__(part, nodes)
        self.part = part

    def law_at(self, law: EnergyLaw) -> EnergyLaw:
        assert isinstance(law, Hyperelastic)
        J, G = determinant(square(self.z))
        shape = (self.e, self.g, len(J) // (self.e * self.g))
        U, pressure, curvature = (v.reshape(shape) for v in _volume(law, J, self.part.projection))
        self._U, self._stiffness = U, curvature * self.rows.weights[..., None]
        self._by_F = (J[:, None, None] * G).reshape(*shape, 9)
        return replace(law, pressure=pressure.ravel())

    def energy(self) -> Array:
        return super().energy() + (self._U * self.rows.weights[..., None]).sum((0, 1))

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        by_u, by_du = super().product(u, du)
        change = self.part.projection @ (self._by_F * self._change(u, du)).sum(-1)
        pressure = self.part.projection.swapaxes(1, 2) @ (self._stiffness * change)
        more_by_u, more_by_du = self._forces(pressure[..., None] * self._by_F)
        return by_u + more_by_u, by_du + more_by_du

    def tangents(self, precision: Precision) -> tuple[Array, Array, Array]:
        d0, d1 = volume_rows(self.part, self._by_F.transpose(2, 0, 1, 3))  # (s, e, g, 3a)
        stiffness = self._stiffness.transpose(2, 0, 1)[..., None]
        left, right = ((stiffness * d).swapaxes(2, 3) for d in (d0, d1))
        K = super().tangents(precision)
        more = left @ d0, left @ d1, right @ d1
        K0, K1, K2 = (a + b.astype(precision) for a, b in zip(K, more, strict=True))
        return K0, K1, K2
