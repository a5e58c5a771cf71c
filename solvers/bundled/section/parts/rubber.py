"""Mooney-Rivlin rubber, nearly incompressible (Holzapfel, Nonlinear Solid Mechanics, ch. 6).

    W = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + (J - 1)^2 / D1

Its rows are the deformation gradient F, row by row (p, 9).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from ...deck.keywords import DeckError, Keyword
from .. import shapes
from ..elements import Solids
from ..materials import Material
from . import hourglass
from .elastic import Elastic, EnergyLaw
from .part import Rows, SectionJob, TyrePart, consistent_mass

Array = np.ndarray
MIN_VOLUME_RATIO = 0.2  # over the reference volume: nearly incompressible rubber stays near 1


@dataclass(frozen=True)
class MooneyRivlin(EnergyLaw):
    """Constants per Gauss point, or one for all."""

    weighted_tangent: ClassVar[bool] = True

    C10: Array  # Pa
    C01: Array  # Pa
    inverse_D1: Array  # 1 / D1, Pa
    # of a small vibration, over the static ones; None: the same
    shear_ratio: Array | None = None
    bulk_ratio: Array | None = None
    # place in the model's modulus tables, -1 = none
    table: Array | None = None
    # not so: the tangent is without the initial stress, as that of a ratio has it
    stressed: bool = True

    def bears(self, z: Array) -> bool:
        return bool(determinant(_square(z))[0].min() > MIN_VOLUME_RATIO)

    def energy(self, z: Array) -> Array:
        """J/m3."""
        F = _square(z)
        J, _ = determinant(F)
        I1, I2, _ = second_invariant(F)
        return (
            self.C10 * (J ** (-2 / 3) * I1 - 3)
            + self.C01 * (J ** (-4 / 3) * I2 - 3)
            + (J - 1) ** 2 * self.inverse_D1
        )

    def force(self, z: Array) -> Array:
        """First Piola-Kirchhoff stress P = dW/dF, Pa."""
        F = _square(z)
        J, G = determinant(F)
        a = self.C10 * J ** (-2 / 3)
        I1 = (F * F).sum((1, 2))
        pressure = 2 * self.inverse_D1 * (J - 1) * J
        P = (2 * a)[:, None, None] * F + (pressure - 2 / 3 * a * I1)[:, None, None] * G
        if np.any(self.C01):
            P = P + _stress_C01(F, J, G, self.C01)
        return P.reshape(-1, 9)

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        """First elasticity tensor A = d2W/dFdF, Pa: material and geometric part in one.

        With ``shear_ratio`` the material part is scaled, the initial stress is not: a small
        vibration about the static state at the modulus of its own frequency.
        """
        if self.shear_ratio is not None:
            return self._dynamic_tangent(z, weights)
        if not self.stressed:
            whole = replace(self, stressed=True)
            return _less_stress(whole.tangent(z, weights), z, whole.force(z), weights)
        p, F = len(z), _square(z)
        J, G = determinant(F)
        a = self.C10 * J ** (-2 / 3) * weights
        I1 = (F * F).sum((1, 2))
        k = 2 * self.inverse_D1 * J * weights
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
        if np.any(self.C01):
            A += _tangent_C01(F, J, G, self.C01) * np.reshape(weights, (-1, 1, 1))
        return A

    def _dynamic_tangent(self, z: Array, weights: Array | float) -> Array:
        """Tangent at the dynamic moduli, less the initial stress that they would bring along."""
        assert self.shear_ratio is not None and self.bulk_ratio is not None
        dynamic = replace(self.scaled(self.shear_ratio, self.bulk_ratio), shear_ratio=None)
        more = dynamic.force(z) - self.force(z)
        return _less_stress(dynamic.tangent(z, weights), z, more, weights)

    def scaled(self, shear: Array | float, bulk: Array | float) -> Self:
        """With other moduli; factors."""
        C10, C01, inverse_D1 = self.C10 * shear, self.C01 * shear, self.inverse_D1 * bulk
        return replace(self, C10=C10, C01=C01, inverse_D1=inverse_D1)

    def stiffened(self, factor: float) -> Self:
        return self.scaled(factor, factor)

    def growing(self, table: int) -> Self:
        own = self.scaled(self.table == table, 0.0)
        return replace(own, shear_ratio=None, bulk_ratio=None, stressed=False)


def _square(z: Array) -> Array:
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


def second_invariant(F: Array) -> tuple[Array, Array, Array]:
    """I1, I2 (p,) and C = F^T F (p, 3, 3)."""
    C = F.swapaxes(1, 2) @ F
    I1 = np.einsum("pii->p", C)
    return I1, (I1**2 - (C * C).sum((1, 2))) / 2, C


def _stress_C01(F: Array, J: Array, G: Array, C01: Array) -> Array:
    I1, I2, C = second_invariant(F)
    b = C01 * J ** (-4 / 3)
    Y = 2 * (I1[:, None, None] * F - F @ C)  # dI2/dF
    return b[:, None, None] * (Y - (4 / 3 * I2)[:, None, None] * G)


def _tangent_C01(F: Array, J: Array, G: Array, C01: Array) -> Array:
    p = len(F)
    I1, I2, C = second_invariant(F)
    b = C01 * J ** (-4 / 3)
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


def _less_stress(A: Array, z: Array, P: Array, weights: Array | float) -> Array:
    """A (p, 9, 9) without the part of the initial stress P (p, 9)."""
    S = np.linalg.solve(_square(z), _square(P))  # second Piola-Kirchhoff
    A = A.reshape(-1, 3, 3, 3, 3)
    for i in range(3):
        A[:, i, :, i, :] -= S * np.reshape(weights, (-1, 1, 1))
    return A.reshape(-1, 9, 9)


@dataclass
class _Section:
    """A *SOLID SECTION's share of the elements of one type."""

    elements: Array  # rows of the type's block
    material: Material
    hourglass: complex | float | None  # Pa; None = by default


def read(job: SectionJob) -> list[TyrePart]:
    """The rubber of each element type, and its hourglass control. Raises DeckError."""
    parts: list[TyrePart] = []
    sections: dict[str, list[_Section]] = {}
    for kind, section in _sections(job):
        sections.setdefault(kind, []).append(section)
    for kind, own in sections.items():
        parts += _rubber(job, kind, own)
    for kind in job.mesh.blocks:
        if kind in shapes.solids() and kind not in sections:
            raise DeckError(0, f"the {kind} elements have no *SOLID SECTION")
    return parts


def _sections(job: SectionJob) -> Iterator[tuple[str, _Section]]:
    """Element types and sections of the deck."""
    keywords: list[Keyword | None] = [None, *job.keywords, None]
    controls = {k.need("NAME") for k in job.keywords if k.name == "SECTION CONTROLS"}
    for before, k, after in zip(keywords, job.keywords, keywords[2:], strict=False):
        if k.name == "SOLID SECTION":
            material = job.material(k, k.need("MATERIAL"))
            if material.C10 is None:
                raise DeckError(k.line, f"material {material.name} of a solid is not hyperelastic")
            control = k.get("CONTROLS")
            if control and control not in controls:
                raise DeckError(k.line, f"section controls {control} are not defined")
            given = after is not None and after.name == "HOURGLASS STIFFNESS"
            stiffness = after.only_row().number(0) if after and given else None
            for kind, rows in job.by_type(k, shapes.solids()).items():
                yield kind, _Section(rows, material, stiffness)
        elif k.name == "HOURGLASS STIFFNESS" and (before is None or before.name != "SOLID SECTION"):
            raise DeckError(
                k.line,
                "*HOURGLASS STIFFNESS must stand right under the *SOLID SECTION that it is of",
            )


def _rubber(job: SectionJob, kind: str, sections: list[_Section]) -> list[TyrePart]:
    solids = job.mesh.blocks[kind]
    assert isinstance(solids, Solids)
    e, g = solids.weights.shape
    owner = np.full(e, -1)
    table = []
    for i, section in enumerate(sections):
        if (owner[section.elements] >= 0).any():
            raise DeckError(0, f"a {kind} element has two *SOLID SECTION")
        owner[section.elements] = i
        material = section.material
        scale, bulk = material.static_scale(job.long_term)
        C10, C01, D = material.C10 or 0.0, material.C01, material.inverse_D1
        place = job.tables.index(material.table) if material.table in job.tables else -1
        ratio = (1.0, 1.0) if place >= 0 else material.dynamic_ratio(job.dynamic_Hz, job.long_term)
        hold = section.hourglass
        if hold is None:
            hold = hourglass.SHARE_OF_SHEAR_MODULUS * (2 * (C10 + C01) * scale)
        table.append([C10 * scale, C01 * scale, D * bulk, *ratio, material.density, hold, place])
    if (owner < 0).any():
        raise DeckError(0, f"{(owner < 0).sum()} {kind} elements have no *SOLID SECTION")
    C10, C01, D, shear, bulk, density, hold, place = np.array(table).T[:, owner]
    point = lambda values: np.repeat(values, g)
    still = job.dynamic_Hz is None or not (np.any(shear != 1) or np.any(bulk != 1))
    law = MooneyRivlin(
        point(C10),
        point(C01),
        point(D),
        None if still else point(shear),
        None if still else point(bulk),
        point(place.real.astype(int)) if job.tables else None,
    )
    rows = Rows(solids.B0, solids.hoop, slice(1, None, 3), np.eye(3).ravel(), solids.weights)
    mass = consistent_mass(solids.mass_N, density[:, None] * solids.mass_weights)
    rubber = Elastic(solids.connectivity, rows, law, mass)
    return [rubber] if solids.hourglass is None else [rubber, hourglass.control(solids, hold)]
