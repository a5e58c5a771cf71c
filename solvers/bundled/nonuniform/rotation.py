"""Waves of the turning tyre: forward and backward ones have different frequencies.

In the frame that turns with the tyre at Omega about its axle, with S = e_z x,

    M u'' + 2 Omega M S u' + K u = 0,    u = Re[U exp(i (n Theta + omega t))]
    (K(n) + omega C - omega^2 M) U = 0,  C = 2 i Omega M S  (Hermitian),

where K holds the centrifugal tension of the inflated state and, as -Omega^2 M in the plane of the
wheel, the softening by the spin. omega > 0 is a wave that travels backward in the tyre, omega < 0
a forward one. A sensor that stands still at theta = Theta + Omega t sees omega - n Omega.
(Geradin and Kill, Engineering Computations 1, 1984; Huang and Soedel, J. Sound and Vibration 115,
1987.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...language.text import COMPLEX_STEP
from ..modes.harmonics import HarmonicModes, SeededTyre, Vibration
from ..section.mechanics import mass_matrices
from ..section.parts.part import SPIN_AXIS
from .coupled import HarmonicFamily, assigned, ritz, split

Array = np.ndarray
SPARE_MODES = 4  # modes in the basis beyond those wanted
CORIOLIS_ROUNDS = 2  # of responses to the Coriolis force added to the basis


def waves(vibration: Vibration, spin: float, n: int, count: int) -> HarmonicModes:
    """The two waves of each of the ``count`` lowest modes of harmonic n, as a fixed sensor sees
    them: eigenvalues are (omega - n Omega)^2, the lower of two first; for n = 0 the one mode.

    spin: Omega, rad/s; ``vibration``: with the centrifugal terms. Raises as `Vibration.modes`.
    """
    family = _basis(vibration, spin, n, count + SPARE_MODES)
    gyroscopic = _coriolis(vibration, spin, family)
    omega, U = _quadratic(family.eigenvalues, gyroscopic)
    held = abs(U[:count]) ** 2 / (abs(U) ** 2).sum(0)
    chosen: list[Array] = []
    for sign in (1, -1) if n else (1,):
        pick = np.flatnonzero(np.sign(omega) == sign)
        pick = pick[np.argsort(abs(omega[pick]))]
        chosen.append(pick[assigned(held[:, pick])])  # to each mode at rest the wave like it
    both = np.array(chosen).T  # (count, 1 or 2)
    fixed = (omega[both] - n * spin) ** 2
    mine = np.take_along_axis(both, np.argsort(fixed, axis=1), 1).ravel()
    x = U[:, mine] / np.sqrt((abs(U[:, mine]) ** 2).sum(0))
    shapes = np.tensordot(x.T, family.shapes, 1)
    turned = np.einsum("im,ij,jm->m", x.conj(), gyroscopic, x).real
    whirl = Whirl(n, spin, omega[mine], shapes, turned)
    return split(n, whirl.fixed**2, shapes, whirl)


@dataclass
class Whirl:
    """Waves (m,) of harmonic n; U^H M U = 1."""

    n: int
    spin: float  # Omega, rad/s
    omega: Array  # (m,) in the turning frame, rad/s
    shapes: Array  # U (m, nodes, 3)
    coriolis: Array  # U^H C U (m,)

    @property
    def fixed(self) -> Array:
        """omega - n Omega (m,): as a sensor that stands still sees them, rad/s."""
        return self.omega - self.n * self.spin

    def forms(self) -> tuple[Array, Array, Array, Array]:
        """As `HarmonicModes.forms`, for the eigenvalues lambda = omega^2."""
        modes = len(self.omega)
        return np.full(modes, self.n), self.shapes, np.arange(modes), self.omega**2

    def rates(self, forms: Array, change: SeededTyre) -> Array:
        """d lambda (m,) of lambda = `fixed`^2, from omega' = U^H (K' + omega C' - omega^2 M') U /
        (2 omega - U^H C U); forms (m,): U^H (K' - omega^2 M') U."""
        faster = np.imag(change.spin) / COMPLEX_STEP  # Omega'
        by_spin = self.coriolis * faster / self.spin
        for connectivity, M in mass_matrices(change.model):
            if np.iscomplexobj(M):
                u = self.shapes[:, connectivity]
                turned = np.einsum(
                    "meai,eab,ij,mebj->m", u.conj(), M.imag / COMPLEX_STEP, SPIN_AXIS, u
                )
                copies = change.model.mesh.symmetry.copies
                by_spin = by_spin + copies * (2j * self.spin * turned).real
        slope = (forms + self.omega * by_spin) / (2 * self.omega - self.coriolis)
        return np.asarray(2 * self.fixed * (slope - self.n * faster))

    def where(self, keep: Array | slice) -> Whirl:
        """Some of them."""
        return Whirl(self.n, self.spin, self.omega[keep], self.shapes[keep], self.coriolis[keep])


def _basis(vibration: Vibration, spin: float, n: int, count: int) -> HarmonicFamily:
    """Modes at rest in the turning frame, and responses to the Coriolis forces of each other."""
    factor, numbering = vibration.factor(n), vibration.numbering
    modes = vibration.modes(n, count, factor)
    vectors = numbering.gather(np.moveaxis(modes.shapes, 0, -1))
    images = vibration.times_mass(vectors) * modes.eigenvalues  # K times the vectors
    newest = vectors
    for _ in range(CORIOLIS_ROUNDS):
        forces = [vibration.times_mass(_turned(vibration, newest))]
        if newest is not vectors:
            forces.append(vibration.times_mass(newest))
        right = np.hstack(forces)
        newest = factor.solve(right)
        size = np.linalg.norm(newest, axis=0)
        newest, right = newest / size, right / size
        vectors, images = np.hstack([vectors, newest]), np.hstack([images, right])
    return ritz(vibration, n, vectors, images)


def _turned(vibration: Vibration, x: Array) -> Array:
    """i e_z x u for (size, b); without i where fields are real, to which `_coriolis` adds it."""
    full = vibration.numbering.spread(x)
    i = 1j if np.iscomplexobj(full) else 1.0
    return vibration.numbering.gather(np.einsum("ij,njb->nib", i * SPIN_AXIS, full))


def _coriolis(vibration: Vibration, spin: float, family: HarmonicFamily) -> Array:
    """C = 2 i Omega M S (m, m) on the basis; S: turn by 90 degrees in the wheel's plane."""
    x = vibration.numbering.gather(np.moveaxis(family.shapes, 0, -1))
    i = 1.0 if np.iscomplexobj(vibration.numbering.spread(x)) else 1j
    return 2 * i * spin * (x.conj().T @ vibration.times_mass(_turned(vibration, x)))


def _quadratic(K: Array, C: Array) -> tuple[Array, Array]:
    """omega (2k,) and U (k, 2k) of (K + omega C - omega^2) U = 0, K (k,) diagonal, as

    [[-C, 1], [1, 0]] x = (1 / omega) [[K, 0], [0, 1]] x,   x = (U, omega U).
    """
    one = np.eye(len(K))
    left = np.block([[-C, one], [one, 0 * one]])
    from scipy.linalg import eigh  # late: a tyre that stands needs none of it

    inverse, x = eigh(left, np.diag(np.concatenate([K, np.ones(len(K))])))
    return 1 / inverse, x[: len(K)]
