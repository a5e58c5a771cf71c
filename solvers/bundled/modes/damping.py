"""Modal damping from the energy that the materials with a loss factor store.

    zeta_r = 1/2 sum_k eta_k(f_r) S_rk,   S_rk = phi_r^H K_k phi_r / phi_r^H K phi_r

eta_k: loss factor of material k. K_k: the part of the tangent that is proportional to its moduli.
Initial stress and pressure are the rest of K, and have no loss. So S_rk = 2 d ln f_r / d ln G_k at
the fixed inflated state, G_k: modulus of material k. The complex eigenvalue problem differs from
this by the square of the loss factors.
"""

from __future__ import annotations

import numpy as np

from ..section.model import Model
from ..section.parts.part import ModeShapes

Array = np.ndarray


def loss_forms(model: Model, U: Array, fields: ModeShapes, eigenvalues: Array) -> Array:
    """sum_k eta_k(f) phi^H K_k phi (m,), 1/s2, of the modes ``fields``, phi^H M phi = 1, with the
    eigenvalues (2 pi f)^2 (m,), at the inflated state U (n, 3)."""
    hertz = np.sqrt(np.maximum(eigenvalues, 0.0)) / (2 * np.pi)
    total = np.zeros(len(eigenvalues))
    for compound, material in enumerate(model.lossy):
        assert material.loss is not None
        for modulus, loss in enumerate(material.loss.at(hertz)):
            parts = model.material_parts(compound, modulus)
            form = sum((part.form(U, fields).real for part in parts), np.zeros(len(eigenvalues)))
            if material.table in model.tables and not modulus:
                form = form * [np.real(material.table.ratio(f)) for f in hertz]
            total += model.mesh.symmetry.copies * loss * form
    return total
