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

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from .coupled import Family, ritz, split
from .harmonics import HarmonicModes, Vibration
from .pressure import SPIN

Array = np.ndarray
MORE = 4  # modes in the basis beyond those wanted
ROUNDS = 2  # of responses to the Coriolis force added to the basis


def waves(vibration: Vibration, spin: float, n: int, count: int) -> HarmonicModes:
    """The two waves of each of the ``count`` lowest modes of harmonic n, as a fixed sensor sees
    them: eigenvalues are (omega - n Omega)^2, the lower of two first; for n = 0 the one mode.

    spin: Omega, rad/s; ``vibration``: with the centrifugal terms. Raises as `Vibration.modes`.
    """
    family = _basis(vibration, spin, n, count + MORE)
    gyroscopic = _coriolis(vibration, spin, family)
    omega, U = _quadratic(family.eigenvalues, gyroscopic)
    held = abs(U[:count]) ** 2 / (abs(U) ** 2).sum(0)
    values, shapes = [], []
    signs = (1, -1) if n else (1,)
    for sign in signs:
        pick = np.flatnonzero(np.sign(omega) == sign)
        pick = pick[np.argsort(abs(omega[pick]))]
        _, taken = linear_sum_assignment(held[:, pick], maximize=True)
        chosen = pick[taken]
        values.append((omega[chosen] - n * spin) ** 2)
        size = np.sqrt((abs(U[:, chosen]) ** 2).sum(0))
        shapes.append(np.tensordot((U[:, chosen] / size).T, family.shapes, 1))
    if not n:
        return HarmonicModes(n, values[0], shapes[0])
    order = np.argsort(values, axis=0)
    fixed = np.take_along_axis(np.array(values), order, 0)
    shape = np.take_along_axis(np.array(shapes), order[..., None, None], 0)
    whole = shape.swapaxes(0, 1).reshape(2 * count, *shape.shape[2:])
    return split(n, fixed.T.ravel(), whole)


def _basis(vibration: Vibration, spin: float, n: int, count: int) -> Family:
    """Modes at rest in the turning frame, and responses to the Coriolis forces of each other."""
    factor, numbering = vibration.factor(n), vibration.numbering
    modes = vibration.modes(n, count, factor)
    vectors = numbering.gather(np.moveaxis(modes.shapes, 0, -1))
    images = vibration.times_mass(vectors) * modes.eigenvalues
    newest = vectors
    for _ in range(ROUNDS):
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
    """e_z x u for (size, b)."""
    full = vibration.numbering.spread(x)
    return vibration.numbering.gather(np.einsum("ij,njb->nib", SPIN, full))


def _coriolis(vibration: Vibration, spin: float, family: Family) -> Array:
    """C = 2 i Omega M S on the basis."""
    x = vibration.numbering.gather(np.moveaxis(family.shapes, 0, -1))
    return 2j * spin * (x.conj().T @ vibration.times_mass(_turned(vibration, x)))


def _quadratic(K: Array, C: Array) -> tuple[Array, Array]:
    """omega (2k,) and U (k, 2k) of (K + omega C - omega^2) U = 0, K (k,) diagonal, as

    [[-C, 1], [1, 0]] x = (1 / omega) [[K, 0], [0, 1]] x,   x = (U, omega U).
    """
    one = np.eye(len(K))
    left = np.block([[-C, one], [one, 0 * one]])
    inverse, x = eigh(left, np.diag(np.concatenate([K, np.ones(len(K))])))
    return 1 / inverse, x[: len(K)]
