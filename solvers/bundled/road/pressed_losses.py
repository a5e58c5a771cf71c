"""Losses of the pressed tyre: its parts with a loss factor, and how much these damp a mode.

    zeta_r = 1/2 sum_k eta_k(f_r) phi_r^T K_k phi_r / omega_r^2,   phi_r^T M phi_r = 1

zeta_r: damping ratio of mode r; eta_k: loss factors; K_k: the part of the tangent at U that is
proportional to a compound's shear or bulk modulus (`modes.damping`).
Initial stress, pressure, and what holds the patch have no losses.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..section.materials import LossFactor
from ..section.parts.part import TyrePart
from ..solid3d.revolved import Revolved
from .loaded_modes import LoadedModes

Array = np.ndarray


class PressedLosses:
    """The parts with losses of a tyre at the field U (k, n, 3), m."""

    def __init__(self, tyre: Revolved, U: Array):
        model = tyre.model
        by_loss: dict[tuple[LossFactor, int], list[TyrePart]] = {}
        for k, material in enumerate(model.lossy):
            assert material.loss  # as it is in ``lossy``
            for modulus in (0, 1):  # shear, bulk
                # without a table both moduli have one loss factor
                law = material.loss, modulus if material.loss.frequency_Hz else 0
                by_loss.setdefault(law, []).extend(model.material_parts(k, modulus))
        laws = {law: parts for law, parts in by_loss.items() if parts}
        self._laws = list(laws)
        self.parts = [
            Revolved(replace(model, parts=parts), [], tyre.around) for parts in laws.values()
        ]
        for part in self.parts:
            part.residual(U)  # sets the state of the tangents

    def factors(self, hertz: float) -> list[float]:
        """The loss factor of each of ``parts``."""
        at = np.array([hertz])
        return [float(loss.at(at)[modulus][0]) for loss, modulus in self._laws]

    def damping_ratios(self, modes: LoadedModes) -> Array:
        """zeta (m,) of modes about U."""
        # half the circumference stores half of the energy
        energies = np.array(
            [[2 * (V * part.product(V)).sum() for part in self.parts] for V in modes.shapes]
        )
        hertz = np.sqrt(modes.eigenvalues) / (2 * np.pi)
        losses = np.array([self.factors(f) for f in hertz])
        return np.asarray((losses * energies).sum(1) / modes.eigenvalues / 2)
