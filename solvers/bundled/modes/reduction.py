"""A few fields of a harmonic that represent its response to given forces up to a frequency.

They are the static responses to the forces, to the inertia of these responses, and so on (Krylov
vectors of K^-1 M). The first are exact for static forces; each round is right to a higher power of
the frequency. If there are losses, the responses to the losses of the modes are added, because
losses couple the modes and make them complex.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..section.kept_fields import Coordinates
from ..section.mechanics import OfElements
from ..section.sparse import assembled
from ..section.symmetry import Whole
from .harmonics import Vibration

Array = np.ndarray
FREQUENCIES_SETTLED = 1e-7  # relative change of omega^2 from one round to the next
SAME_VECTOR = 1e-10  # share of a vector's square, in the norm of M, below which others span it


class PartOfStiffness:
    """A part K_k(n) = K0 + i n K1 + n^2 K2 of the stiffness, from matrices of elements."""

    def __init__(self, three: tuple[OfElements, OfElements, OfElements], nodes: int):
        self._three: list[csr_array | None] = []
        for parts in three:
            dofs = [
                ((3 * c[..., None] + np.arange(3)).reshape(len(c), -1), matrices)
                for c, matrices in parts
            ]
            self._three.append(assembled(dofs, 3 * nodes) if dofs else None)

    def times(self, V: Array, n: int, numbering: Coordinates, symmetry: Whole) -> Array:
        """K_k(n) V (size, k) for k fields V (size, k), both in coordinates."""
        fields = numbering.spread(V)
        flat = fields.reshape(-1, V.shape[1])
        image = np.zeros(flat.shape, complex if n else flat.dtype)
        for factor, matrix in zip((1.0, 1j * n, n * n), self._three, strict=True):
            if matrix is not None and factor:
                image = image + factor * (matrix @ flat)
        return np.asarray(numbering.gather(symmetry.force(image.reshape(fields.shape))))


class ResponseBasis:
    """Fields V (size, k) of harmonic n, in coordinates: V^H M V = 1; ``K`` (k, k), 1/s2:
    V^H K(n) V."""

    def __init__(self, vibration: Vibration, n: int, forces: Array):
        """forces (size, p), in coordinates. Raises RunFailed."""
        self._solve, self._times_mass = vibration.factor(n).solve, vibration.times_mass
        self.V, self._MV, self._KV = (np.zeros((len(forces), 0)) for _ in range(3))
        self.K: Array = np.zeros((0, 0))
        self._newest = 0
        self.add(forces[:, np.abs(forces).max(0) > 0])

    def add(self, forces: Array) -> None:
        """Add static responses to forces (size, p), made orthogonal to the basis."""
        new, image = self._solve(forces), forces
        for _ in range(2):  # Gram and Schmidt, twice for round-off
            part = self._MV.conj().T @ new
            new, image = new - self.V @ part, image - self._KV @ part
        mass = self._times_mass(new)
        scale = 1 / np.sqrt(np.einsum("ij,ij->j", new.conj(), mass).real)
        size, turn = np.linalg.eigh((new * scale).conj().T @ (mass * scale))
        turn = (scale[:, None] * turn / np.sqrt(np.abs(size)))[:, size > SAME_VECTOR]
        self._newest = turn.shape[1]
        self.V = np.hstack([self.V, new @ turn])
        self._MV = np.hstack([self._MV, mass @ turn])
        self._KV = np.hstack([self._KV, image @ turn])
        K = self.V.conj().T @ self._KV
        self.K = (K + K.conj().T) / 2

    def settle(self, limit: float) -> None:
        """Add responses to the inertia of the newest fields until the basis' frequencies up to
        omega^2 = ``limit`` no longer change."""
        before: Array = np.zeros(0)
        while self._newest:
            values = np.linalg.eigvalsh(self.K)
            values = values[values < limit]
            is_first = len(self.K) == self._newest
            if not is_first and len(values) == len(before):
                moved = np.abs(values - before) / values
                if moved.max(initial=0.0) < FREQUENCIES_SETTLED:
                    return
            before = values
            self.add(self._MV[:, -self._newest :])

    def modes(self, limit: float) -> Array:
        """Modes (size, m) of the basis up to omega^2 = ``limit``."""
        values, vectors = np.linalg.eigh(self.K)
        return np.asarray(self.V @ vectors[:, values < limit])
