"""Rubber whose modulus grows with frequency: each mode at the modulus of its own frequency.

    K(f) = K + sum_l (rho_l(f) - 1) dK_l,    K(f_j) phi_j = lambda_j M phi_j,  lambda = (2 pi f)^2

rho_l: storage over static shear modulus of law l, from the deck's table, linear between its rows
in the logarithms of both. The j-th mode of a harmonic is the fixed point of the j-th eigenvalue.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .band import Cholesky
    from .border import Bordered
    from .harmonics import HarmonicModes, Vibration
    from .model import Model

Array = np.ndarray
Number = complex | float
START_HZ = 60.0  # amid the modes of a tyre
TOLERANCE = 1e-10  # of lambda
LONGEST = 20


class NotSelfConsistent(ArithmeticError):
    """No frequency was found at which a mode has the modulus of that frequency."""


@dataclass(frozen=True)
class Law:
    """Rows of the table: frequency (Hz, rising) and storage over static shear modulus."""

    frequency_Hz: tuple[float, ...]
    ratios: tuple[Number, ...]

    def ratio(self, frequency_Hz: float) -> Number:
        """rho, constant beyond the table's ends; complex where the table carries a tangent."""
        i, share = self._place(frequency_Hz)
        low, high = self.ratios[i : i + 2]
        return low * (high / low) ** share

    def slope(self, frequency_Hz: float) -> float:
        """d ln rho / d ln f."""
        i, share = self._place(frequency_Hz)
        if not 0.0 < share < 1.0:
            return 0.0
        low, high = np.real(self.ratios[i : i + 2])
        return float(np.log(high / low) / np.log(self.frequency_Hz[i + 1] / self.frequency_Hz[i]))

    def _place(self, frequency_Hz: float) -> tuple[int, float]:
        """The row before a frequency, and the share of the way to the next one."""
        table, f = np.log(self.frequency_Hz), np.log(max(frequency_Hz, 1e-12))
        i = int(np.clip(np.searchsorted(table, f) - 1, 0, len(table) - 2))
        return i, float(np.clip((f - table[i]) / (table[i + 1] - table[i]), 0.0, 1.0))


def stiffened(model: Model) -> list[Model]:
    """Per law a model with the tangent dK_l: the rubber's own, without its initial stress."""
    models = []
    for law in range(len(model.laws)):
        rubbers = []
        for r in model.rubbers:
            own, m = r.law == law, r.material
            shear = replace(
                m, C10=m.C10 * own, C01=m.C01 * own, inverse_D1=0.0 * m.inverse_D1,
                shear_ratio=None, bulk_ratio=None, stressed=False,
            )  # fmt: skip
            rubbers.append(replace(r, material=shear, hourglass_stiffness=0 * r.density))
        models.append(replace(model, rubbers=rubbers, cords=[]))
    return models


class SelfConsistent:
    """Modes of a vibration whose rubber follows the ``laws``."""

    def __init__(self, vibration: Vibration, laws: list[Law]):
        self.vibration, self.laws = vibration, laws

    def modes(self, n: int, count: int, factor: Cholesky | Bordered | None = None) -> HarmonicModes:
        """The ``count`` lowest modes of harmonic n, each at the modulus of its own frequency.

        By the secant method on ln lambda. ``factor`` serves a constant modulus only.
        Raises NotSelfConsistent; Unstable, eigen.NotConverged.
        """
        start = 2 * np.log(2 * np.pi * START_HZ)
        first = self._at(start, n, count)
        return joined(
            [
                self._settled(n, j, start, float(np.log(first.eigenvalues[j])))
                for j in range(len(first.eigenvalues))
            ]
        )

    def _at(self, log_value: float, n: int, count: int) -> HarmonicModes:
        frequency = np.exp(log_value / 2) / (2 * np.pi)
        ratios = [float(np.real(law.ratio(frequency))) for law in self.laws]
        return self.vibration.at(np.array(ratios)).modes(n, count)

    def _settled(self, n: int, j: int, before: float, x: float) -> HarmonicModes:
        """Mode j, from the ln lambda = x that the modulus of ln lambda = ``before`` gives it."""
        image_before = x
        for _ in range(LONGEST):
            found = self._at(x, n, j + 1)
            image = float(np.log(found.eigenvalues[j]))
            if abs(image - x) <= TOLERANCE:
                return found.where(slice(j, j + 1))
            slope = (image - image_before) / (x - before) if x != before else 0.0
            before, image_before = x, image
            x = (image - slope * x) / (1 - slope)
        raise NotSelfConsistent(f"the modulus of mode {j + 1} of harmonic {n} does not settle")


def joined(modes: list[HarmonicModes]) -> HarmonicModes:
    """Modes of one harmonic in one."""
    join = lambda name: np.concatenate([getattr(m, name) for m in modes])
    return replace(
        modes[0],
        eigenvalues=join("eigenvalues"),
        shapes=join("shapes"),
        rim=join("rim"),
        air=join("air"),
    )
