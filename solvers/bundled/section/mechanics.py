"""Potential, residual, tangents and mass of the section, per radian: sums over its parts.

State U (n, 3) in m: displacements in the frame of the reference angle (see `elements`). Of half a
model the sums are half of the tyre's (`symmetry`), except `total_mass`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from .band import Numbering
from .model import Model
from .parts.part import TyrePart
from .sparse import assembled

Array = np.ndarray
OfElements = list[tuple[Array, Array]]  # connectivities with vectors or matrices of elements


def potential(model: Model, U: Array, loads: Sequence[TyrePart]) -> Any:
    """Strain energy less the work of the loads, J per radian."""
    return sum(part.energy(U) for part in (*model.parts, *loads))


def residual(model: Model, U: Array, loads: Sequence[TyrePart], numbering: Numbering) -> Array:
    """Out-of-balance force (size,), N per radian: gradient of the potential."""
    return numbering.vector(_forces(model, U, loads))


def gradient(model: Model, U: Array, loads: Sequence[TyrePart]) -> Array:
    """Gradient of the potential by every component (n, 3), those that are held among them."""
    parts = _forces(model, U, loads)
    total = np.zeros(U.shape, np.result_type(*(v for _, v in parts)))
    for connectivity, values in parts:
        np.add.at(total, connectivity, values.reshape(*connectivity.shape, 3))
    return total


def _forces(model: Model, U: Array, loads: Sequence[TyrePart]) -> OfElements:
    return [(part.connectivity, part.force(U)) for part in (*model.parts, *loads)]


def tangents(
    model: Model, U: Array, loads: Sequence[TyrePart], harmonics: bool
) -> tuple[OfElements, OfElements, OfElements]:
    """Element matrices of K(n) = K0 + i n K1 + n^2 K2, n the harmonic.

    K0, K2 are symmetric, K1 antisymmetric. Without ``harmonics`` only K0 is formed, which is
    also the Newton tangent of the axisymmetric state.
    """
    three: tuple[OfElements, OfElements, OfElements] = [], [], []
    for part in (*model.parts, *loads):
        for K, matrices in zip(three, part.tangents(U, harmonics), strict=True):
            if matrices is not None:
                K.append((part.connectivity, matrices))
    return three


def mass(model: Model) -> csr_array:
    """Consistent mass (n, n), kg per radian, the same for each displacement component."""
    return assembled(mass_matrices(model), len(model.mesh.X))


def total_mass(model: Model) -> complex:
    """kg of the whole tyre; its imaginary part carries a number's tangent."""
    whole = sum(matrices.sum() for _, matrices in mass_matrices(model))
    return complex(2 * np.pi * model.mesh.symmetry.copies * whole)


def mass_matrices(model: Model) -> OfElements:
    """Element masses (e, a, a), kg per radian; cords' are added to those of their rubber."""
    return [(part.connectivity, part.mass) for part in model.parts if part.mass is not None]
