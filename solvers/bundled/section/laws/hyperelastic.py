"""Isotropic hyperelastic laws: an isochoric part and a volumetric one (Holzapfel, Nonlinear Solid
Mechanics, ch. 6).

    W = Wbar(F / J^(1/3)) + U(J)

The rows are the deformation gradient F, row by row (p, 9); G is its inverse transpose F^-T.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from .energy_law import EnergyLaw

Array = np.ndarray
MIN_VOLUME_RATIO = 0.2  # over the reference volume: nearly incompressible rubber stays near 1
# of bulk over shear modulus, which stands for none at all in hybrid elements: Poisson's ratio
# 0.4995. A thick tube then grows by 0.06 % more. At 2000 the single precision of a footprint's
# factors does not suffice any longer, and Newton's method takes the longer, the larger.
INCOMPRESSIBLE = 1e3


@dataclass(frozen=True, kw_only=True)
class Hyperelastic(EnergyLaw):
    """Constants per Gauss point, or one for all, in the order of ABAQUS's data line, with 1 / D
    for D; then what a vibration, or an element, makes of them."""

    weighted_tangent: ClassVar[bool] = True
    shear_moduli: ClassVar[tuple[str, ...]]  # the constants, Pa, that Wbar is proportional to
    # the constants, Pa, that U is proportional to
    bulk_moduli: ClassVar[tuple[str, ...]] = ("inverse_D1",)
    numbers: ClassVar[tuple[str, ...]] = ()  # the constants without a unit

    # of a small vibration, over the static ones; None: the same
    shear_ratio: Array | None = None
    bulk_ratio: Array | None = None
    # place in the model's modulus tables, -1 = none
    table: Array | None = None
    # place among the model's materials with a loss factor, -1 = none; None: there are none
    compound: Array | None = None
    # False: the tangent is without the initial stress, which no modulus of a vibration scales
    stressed: bool = True
    # dU/dJ as a hybrid element has it, Pa, which does not change with J; None: the law's own
    pressure: Array | None = None

    @property
    @abstractmethod
    def shear_modulus(self) -> Array:
        """Shear modulus of small strains, Pa."""

    @abstractmethod
    def volume(self, J: Array) -> tuple[Array, Array, Array]:
        """U (p,) in J/m3, dU/dJ and d2U/dJ2 in Pa."""

    @abstractmethod
    def isochoric_energy(self, F: Array, J: Array) -> Array:
        """Wbar (p,), J/m3, of F (p, 3, 3) and J (p,)."""

    @abstractmethod
    def isochoric_stress(self, F: Array, J: Array, G: Array, on_G: Array) -> Array:
        """dWbar/dF + on_G G (p, 3, 3), Pa; G (p, 3, 3), on_G (p,)."""

    @abstractmethod
    def isochoric_tangent(
        self, F: Array, J: Array, G: Array, on_GG: Array, on_swap: Array, weights: Array | float
    ) -> Array:
        """weights d2Wbar/dFdF + on_GG G_iJ G_kL - on_swap G_iL G_kJ (p, 9, 9)."""

    @classmethod
    def of_points(cls, laws: Sequence[Self], owner: Array) -> Self:
        """One law of many points, each of which has the constants of one of ``laws``: owner
        (p,)."""
        names = (*cls.shear_moduli, *cls.bulk_moduli, *cls.numbers)
        constants = [[np.ravel(getattr(law, name))[0] for law in laws] for name in names]
        table = np.array(constants)[:, owner]
        return cls(**dict(zip(names, table, strict=True)))

    @property
    def incompressible(self) -> bool:
        """Whether U is zero."""
        return not any(np.any(getattr(self, name)) for name in self.bulk_moduli)

    def nearly_incompressible(self) -> Self:
        """A law without U (`incompressible`) with the bulk modulus 2 / D1 of `INCOMPRESSIBLE`:
        the equations need a finite one, in hybrid elements and across a membrane."""
        own: dict[str, Any] = {self.bulk_moduli[0]: INCOMPRESSIBLE / 2 * self.shear_modulus}
        return replace(self, **own)

    def bears(self, z: Array) -> bool:
        return bool(determinant(square(z))[0].min() > MIN_VOLUME_RATIO)

    def _volume(self, J: Array) -> tuple[Array, Array, Array]:
        """As `volume`; of U with a hybrid element's pressure only the slope."""
        if self.pressure is None:
            return self.volume(J)
        return 0 * J, self.pressure, 0 * J

    def energy(self, z: Array) -> Array:
        """W (p,), J/m3."""
        F = square(z)
        J, _ = determinant(F)
        return self.isochoric_energy(F, J) + self._volume(J)[0]

    def force(self, z: Array) -> Array:
        """First Piola-Kirchhoff stress P = dW/dF (p, 9), Pa; dJ/dF = J G."""
        F = square(z)
        J, G = determinant(F)
        return self.isochoric_stress(F, J, G, self._volume(J)[1] * J).reshape(-1, 9)

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        """First elasticity tensor A = d2W/dFdF (p, 9, 9), Pa: material and geometric part in one.

        With ``shear_ratio`` the material part is scaled, the initial stress is not: a small
        vibration about the static state at the modulus of its own frequency.
        """
        if self.shear_ratio is not None:
            return self._dynamic_tangent(z, weights)
        if not self.stressed:
            whole = replace(self, stressed=True)
            return _less_stress(whole.tangent(z, weights), z, whole.force(z), weights)
        F = square(z)
        J, G = determinant(F)
        _, slope, curvature = self._volume(J)
        slope = slope * J * weights  # d2U/dFdF = (U'' J^2 + U' J) G G - U' J (G G swapped)
        return self.isochoric_tangent(
            F, J, G, curvature * J**2 * weights + slope, slope, weights
        ).reshape(-1, 9, 9)

    def _dynamic_tangent(self, z: Array, weights: Array | float) -> Array:
        """Tangent (p, 9, 9) at the dynamic moduli, less the initial stress that they would bring
        along."""
        assert self.shear_ratio is not None and self.bulk_ratio is not None  # they are set together
        dynamic = replace(self.scaled(self.shear_ratio, self.bulk_ratio), shear_ratio=None)
        more = dynamic.force(z) - self.force(z)
        return _less_stress(dynamic.tangent(z, weights), z, more, weights)

    def scaled(self, shear: Array | complex, bulk: Array | complex) -> Self:
        """The law with its moduli multiplied by factors, one each or (p,)."""
        own = {name: getattr(self, name) * shear for name in self.shear_moduli}
        own |= {name: getattr(self, name) * bulk for name in self.bulk_moduli}
        if self.pressure is not None:
            own["pressure"] = self.pressure * bulk
        return replace(self, **own)

    def stiffened(self, factor: float) -> Self:
        return self.scaled(factor, factor)

    @property
    def bulk_over_shear(self) -> Array:
        """Bulk over shear modulus of small strains, (p,) or (1,)."""
        return np.asarray((self.volume(np.ones(1))[2] / self.shear_modulus).real)

    def eased(self, ratio: float) -> Self:
        return self.scaled(1.0, np.minimum(1.0, ratio / self.bulk_over_shear))

    def frequency_dependent_part(self, table: int) -> Self:
        own = self.scaled(self.table == table, 0.0)
        return replace(own, shear_ratio=None, bulk_ratio=None, stressed=False)

    def material_part(self, compound: int, modulus: int) -> Self | None:
        if self.compound is None or compound not in self.compound:
            return None
        share = [self.compound == compound, np.zeros(1)]
        ratios = [1.0 if r is None else r for r in (self.shear_ratio, self.bulk_ratio)]
        shear, bulk = (
            r * s for r, s in zip(ratios, share if not modulus else share[::-1], strict=True)
        )
        own = self.scaled(shear, bulk)
        return replace(own, shear_ratio=None, bulk_ratio=None, stressed=False)


def even_powers(J: Array, *inverse_D: Array) -> tuple[Array, Array, Array]:
    """U = sum over i of (J - 1)^(2i) / D_i, dU/dJ and d2U/dJ2, (p,) each."""
    x, power = J - 1, np.ones(1)
    U, slope, curvature = (np.zeros(1) for _ in range(3))
    for i, of in enumerate(inverse_D, start=1):
        U = U + power * x**2 * of
        slope = slope + 2 * i * of * x * power
        curvature = curvature + 2 * i * (2 * i - 1) * of * power
        power = power * x**2
    return U, slope, curvature


def square(z: Array) -> Array:
    """F (p, 3, 3)."""
    return z.reshape(-1, 3, 3)


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


def _less_stress(A: Array, z: Array, P: Array, weights: Array | float) -> Array:
    """A (p, 9, 9) without the part of the initial stress P (p, 9)."""
    S = np.linalg.solve(square(z), square(P))  # second Piola-Kirchhoff
    A = A.reshape(-1, 3, 3, 3, 3)
    for i in range(3):
        A[:, i, :, i, :] -= S * np.reshape(weights, (-1, 1, 1))
    return A.reshape(-1, 9, 9)
