"""Rubber whose modulus grows with frequency: each mode at the modulus of its own frequency.

    K(f) = K + sum_l (rho_l(f) - 1) dK_l,    K(f_j) phi_j = lambda_j M phi_j,  lambda = (2 pi f)^2

dK_l: the part of K that is proportional to the shear modulus of law l. rho_l: its storage modulus
over its static one, from the deck's table; between its rows ln rho is linear in ln f. Mode j of a
harmonic is the fixed point of the j-th eigenvalue. Shapes have phi^H M phi = 1.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import RunFailed
from ..section.kept_fields import Factor
from ..section.materials import ModulusTable
from .bordered import Bordered
from .harmonics import HarmonicModes, Vibration

Array = np.ndarray
START_HZ = 60.0  # in the middle of the modes of a tyre
# relative change of a frequency at which iterations end: with a given shape, and from one shape to
# the next, whose square is the error that remains
FREQUENCY_RTOL = 1e-13
SHAPE_RTOL = 1e-4
MAX_SETTLING = 40  # iterations of a mode at its own modulus


class SelfConsistent:
    """Modes of a vibration whose rubber follows the ``tables``, one for each law l."""

    def __init__(self, vibration: Vibration, tables: list[ModulusTable]):
        self.vibration, self.tables = vibration, tables

    def modes(self, n: int, count: int, factor: Factor | Bordered | None = None) -> HarmonicModes:
        """The ``count`` lowest modes of harmonic n, each at the modulus of its own frequency.

        ``factor`` serves a constant modulus only. Raises RunFailed.
        """
        first = self._at(START_HZ, n, count)
        return joined([self._settled(first, j) for j in range(len(first.eigenvalues))])

    def _ratios(self, frequency_Hz: float) -> Array:
        """rho_l of each table."""
        return np.array([np.real(table.ratio(frequency_Hz)) for table in self.tables])

    def _at(self, frequency_Hz: float, n: int, count: int) -> HarmonicModes:
        """The lowest modes of harmonic n, all with the moduli of one frequency."""
        return self.vibration.at(self._ratios(frequency_Hz)).modes(n, count)

    def _settled(self, modes: HarmonicModes, j: int) -> HarmonicModes:
        """Mode j, from the modes at ``START_HZ``: the frequency at which the shape has its own
        modulus, then the shape there, until both agree. Raises RunFailed."""
        frequency = START_HZ
        for _ in range(MAX_SETTLING):
            before, frequency = frequency, self._own(modes, j, frequency)
            if abs(frequency / before - 1) <= SHAPE_RTOL:
                mode = modes.where(slice(j, j + 1))
                return replace(mode, eigenvalues=np.array([(2 * np.pi * frequency) ** 2]))
            modes = self._at(frequency, modes.n, j + 1)
        raise _unsettled(modes.n, j)

    def _own(self, modes: HarmonicModes, j: int, frequency_Hz: float) -> float:
        """f with (2 pi f)^2 = lambda + sum_l (rho_l(f) - rho_l(f_0)) phi^H dK_l phi for mode j of
        the modulus at f_0 = ``frequency_Hz``: Rayleigh's quotient, right to the square of the
        shape's change. Raises RunFailed."""
        forms = self.vibration.forms(modes.n, modes.shapes[j])
        start, value = self._ratios(frequency_Hz), float(modes.eigenvalues[j])
        f = np.sqrt(value) / (2 * np.pi)
        for _ in range(MAX_SETTLING):
            new = np.sqrt(value + (self._ratios(f) - start) @ forms) / (2 * np.pi)
            if abs(new / f - 1) <= FREQUENCY_RTOL:
                return float(new)
            f = new
        raise _unsettled(modes.n, j)


def _unsettled(n: int, j: int) -> RunFailed:
    return RunFailed("crashed", f"the modulus of mode {j + 1} of harmonic {n} does not settle")


def joined(modes: list[HarmonicModes]) -> HarmonicModes:
    """The modes of several objects of one harmonic in one object."""
    join = lambda name: np.concatenate([getattr(m, name) for m in modes])
    return replace(
        modes[0],
        eigenvalues=join("eigenvalues"),
        shapes=join("shapes"),
        rim=join("rim"),
        air=join("air"),
    )
