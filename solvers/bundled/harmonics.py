"""Modes of the revolved tyre, one Hermitian problem per circumferential harmonic n.

u = Re[U(R, Z) exp(i n Theta)], U complex (n, 3): K(n) = K0 + i n K1 + n^2 K2 exactly, the limit
of infinitely many sectors. A mode with n >= 1 stands for a pair turned by a quarter wave.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from . import eigen, mechanics
from .band import Cholesky, Indefinite, Numbering
from .mechanics import Load
from .model import Model

Array = np.ndarray
MOST_HARMONICS = 60


class Unstable(ArithmeticError):
    """The inflated state is not stable: a harmonic of it buckles."""


@dataclass
class HarmonicModes:
    """Modes of one harmonic: omega^2 (m,) in 1/s2 and shapes (m, n, 3), u^H M u = 1.

    M is the mass per radian: over the whole circle the kinetic mass is 2 pi for n = 0, pi else.
    ``members`` (m,): None, or where each doublet has split into two modes, 1 and 2 in turn; the
    shape is then the part of harmonic n.
    """

    n: int
    eigenvalues: Array
    shapes: Array
    members: Array | None = None

    def below(self, frequency_Hz: float) -> HarmonicModes:
        """Those up to a frequency."""
        keep = self.eigenvalues <= (2 * np.pi * frequency_Hz) ** 2
        members = None if self.members is None else self.members[keep]
        return HarmonicModes(self.n, self.eigenvalues[keep], self.shapes[keep], members)


class Vibration:
    """The inflated tyre's small vibrations: factors per harmonic on demand."""

    def __init__(
        self, model: Model, U: Array, loads: list[Load], numbering: Numbering, shift: float
    ):
        self.numbering, self.shift = numbering, shift
        parts = mechanics.tangents(model, U, loads, harmonics=True)
        self._bands = [numbering.assemble(p) for p in parts]
        self.mass: csr_array = mechanics.mass(model)
        self._X = model.mesh.X.real
        self._shifted_mass = None
        if shift:
            masses = [
                (
                    c,
                    np.einsum("eab,ij->eaibj", m.real, np.eye(3)).reshape(
                        len(m), 3 * m.shape[1], -1
                    ),
                )
                for c, m in mechanics.mass_matrices(model)
            ]
            self._shifted_mass = numbering.assemble(masses)

    def factor(self, n: int) -> Cholesky:
        """Factor of K(n) - shift M. Raises Unstable."""
        K0, K1, K2 = self._bands
        if n == 0:
            band = K0.copy(order="F")
        else:
            band = np.empty(K0.shape, complex, order="F")
            band.real = K0 + n * n * K2
            band.imag = n * K1
        if self._shifted_mass is not None:
            band -= self.shift * self._shifted_mass
        try:
            return Cholesky(band)
        except Indefinite:
            raise Unstable(
                f"the inflated tyre is not stable: its stiffness for {n} waves round the"
                " circumference is not positive definite"
            ) from None

    def times_mass(self, x: Array) -> Array:
        """M x for (size,) or (size, b), per radian."""
        full = self.numbering.spread(x)
        image = self.mass @ full.reshape(len(full), -1)
        return self.numbering.gather(image.reshape(full.shape))

    def modes(self, n: int, count: int, factor: Cholesky | None = None) -> HarmonicModes:
        """The ``count`` lowest modes of harmonic n. Raises Unstable, eigen.NotConverged."""
        factor = factor or self.factor(n)
        start = self.numbering.gather(_start_fields(self._X, n))
        values, vectors = eigen.lowest(factor.solve, self.times_mass, start, count, self.shift)
        shapes = self.numbering.spread(vectors)  # (nodes, 3, modes)
        return HarmonicModes(n, values, np.moveaxis(shapes, -1, 0))


def _start_fields(X: Array, n: int) -> Array:
    """Smooth fields (nodes, 3, 3) that hold much of the lowest modes of harmonic n.

    Axial shift and tilt; spin for n = 0, else bending without stretching the circumference,
    u_r + i n u_theta = 0.
    """
    tilt = X[:, 1] / np.ptp(X[:, 1])
    lop = (
        0.0 if n else 0.3
    )  # lopsided, for all three are odd under z -> -z, theta -> -theta at n = 0
    fields = np.zeros((len(X), 3, 3), complex if n else float)
    fields[:, 2, 0] = 1.0 + lop * tilt
    fields[:, 0, 1] = tilt + lop
    fields[:, 0, 2] = 1.0 if n else 0.0
    fields[:, 1, 2] = 1j / n if n else X[:, 0] / X[:, 0].max() * (1.0 + lop * tilt)
    return fields


def lowest_of_all(
    vibration: Vibration, wanted: int, check: Callable[[], None]
) -> list[HarmonicModes]:
    """The ``wanted`` lowest modes over all harmonics, doublets counted twice.

    Harmonics are added until one starts above the highest mode kept; ``check`` may raise to stop.
    """
    found: list[HarmonicModes] = []
    for n in range(MOST_HARMONICS):
        check()
        count = 2
        while True:
            count = min(2 * count, wanted)
            modes = vibration.modes(n, count)
            limit = _highest_kept([*found, modes], wanted)
            if modes.eigenvalues[-1] > limit or count == wanted:
                break
        found.append(modes)
        if n >= 2 and modes.eigenvalues[0] > limit:
            break
    limit = _highest_kept(found, wanted)
    return [m.below(np.sqrt(limit) / (2 * np.pi) * (1 + 1e-12)) for m in found]


def _highest_kept(found: list[HarmonicModes], wanted: int) -> float:
    values = np.sort(np.concatenate([np.repeat(m.eigenvalues, 2 if m.n else 1) for m in found]))
    return float(values[wanted - 1]) if len(values) >= wanted else float("inf")
