"""The turning tyre against the rotating ring, rigid bodies and the tyre at rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigvalsh
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform import rotation
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import SPIN_AXIS

from . import support
from .conftest import Inflated
from .support import Rubber

Array = np.ndarray
STIFF = Rubber(C10=1e8, D1=5.085e-10)


def turning(m: Model, mask: Array, loads: list, spin: float) -> tuple[Model, Array, Vibration]:
    """The model at a speed, its state and its vibrations; ``mask`` without rigid spin."""
    m = support.turning(m, spin)
    held = mask.copy()
    held[0, 1] = True
    U = support.inflate(m, held, loads)
    return m, U, Vibration(m, U, loads, support.numbering(m, mask), 0.0)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_rotating_ring(n: int) -> None:
    """An inextensible ring in its plane (Soedel, Vibrations of Shells and Plates, ch. 16; the
    fixed frame's are these less n Omega): with u_r = -dv/dTheta

        (n^2 + 1) omega^2 - 4 n Omega omega - n^2 (n^2 - 1)^2 EI / (rho h R^4)
            - Omega^2 n^2 (n^2 - 3) = 0

    of which the last term is the centrifugal tension less the softening by the spin. Left out is
    (h/R)^2, so the deviation falls fourfold when h halves."""
    R, E, deviations = 0.3, STIFF.plane_strain, []
    for parts in (20, 40):
        h = R / parts
        bending = E * h**2 / 12 / STIFF.density / R**4
        spin = 0.5 * np.sqrt(36 * bending / 5)  # half of the frequency for n = 2 at rest
        b = support.block((R - h / 2, R + h / 2, 1), (0.0, 0.01, 1), True)
        m = support.model_of(support.deck(b.X, b.solids, STIFF, (), b.inner))
        _, _, vibration = turning(m, support.held(m, axial=True), [], spin)
        got = rotation.waves(vibration, spin, n, 1)
        rest = n**2 * (n * n - 1) ** 2 * bending + spin**2 * n * n * (n * n - 3)
        omega = np.roots([n * n + 1, -4 * n * spin, -rest]).real
        fixed = np.sort(abs(omega - n * spin))
        assert got.members is not None and got.members.tolist() == [1, 2]
        deviations.append(np.sqrt(got.eigenvalues) / fixed - 1)
    ratio = np.array(deviations[0]) / np.array(deviations[1])
    assert abs(deviations[1]).max() < 1e-3 * n * n
    np.testing.assert_allclose(ratio, 4.0, rtol=0.15)


def test_free_ring_stands_still_in_the_ground_frame() -> None:
    """A rigid translation, at rest on the ground, is a wave n = 1 with omega = Omega for the
    turning frame, whatever the centrifugal growth: (K + Omega C - Omega^2 M) U = 0 to round-off."""
    spin = 400.0
    b = support.block((0.28, 0.3, 2), (0.0, 0.05, 2), True)
    m = support.model_of(support.deck(b.X, b.solids, STIFF, (), b.inner))
    held = support.held(m)
    held[0, 2] = True
    m, U, _ = turning(m, held, [], spin)
    assert abs(U).max() > 1e-5
    K0, K1, K2 = support.matrices(m, U, [])
    K = K0 + 1j * K1 + K2
    M = np.kron(support.full(mechanics.mass(m)), np.eye(3))
    C = 2j * spin * np.kron(support.full(mechanics.mass(m)), SPIN_AXIS)
    shift = np.tile([1.0, 1j, 0.0], len(U))
    left = (K + spin * C - spin**2 * M) @ shift
    assert np.linalg.norm(left) < 1e-12 * np.linalg.norm(K) * np.linalg.norm(shift)
    axial = np.tile([0.0, 0.0, 1.0], len(U))
    assert np.linalg.norm(K0 @ axial) < 1e-12 * np.linalg.norm(K) * np.linalg.norm(axial)


@pytest.mark.parametrize("n", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_waves_are_the_lowest(inflated: Inflated, n: int) -> None:
    """K + omega C - omega^2 M has as many negative eigenvalues as there are waves between 0 and
    omega (K is positive definite, and every wave crosses once): counted by LAPACK just below and
    just above each wave found, in both directions, none is missed and all are right to 1e-6."""
    spin = 60.0
    m = support.turning(inflated.model, spin)
    U = support.inflate(m, inflated.held, inflated.loads)
    vibration = Vibration(m, U, inflated.loads, support.numbering(m, inflated.held), 0.0)
    got = rotation.waves(vibration, spin, n, 2)
    assert isinstance(got.combination, rotation.Whirl)
    free = ~inflated.held.ravel()
    K0, K1, K2 = support.matrices(m, U, inflated.loads)
    K = (K0 + 1j * n * K1 + n * n * K2)[free][:, free]
    mass = support.full(mechanics.mass(m))
    M, C = np.kron(mass, np.eye(3)), 2j * spin * np.kron(mass, SPIN_AXIS)
    M, C = M[free][:, free], C[free][:, free]
    for sign in (1, -1):
        waves = np.sort(abs(got.combination.omega[np.sign(got.combination.omega) == sign]))
        for j, omega in enumerate(sign * waves):
            for side, below in ((1 - 1e-6, j), (1 + 1e-6, j + 1)):
                values = eigvalsh(K + side * omega * C - (side * omega) ** 2 * M)
                assert (values < 0).sum() == below


def test_slow_spin_by_first_order_perturbation(inflated: Inflated) -> None:
    """The members are at omega0 -+ (n - g) Omega at 1e-3 rad/s, g = U^H i M S U of the mode at
    rest: g = 2 n / (n^2 + 1) for an inextensible ring in its plane, 0 for axial motion."""
    spin = 1e-3
    m = support.turning(inflated.model, spin)
    number = support.numbering(m, inflated.held)
    vibration = Vibration(m, inflated.U, inflated.loads, number, 0.0)
    for n in (1, 2, 3, 4):
        got = rotation.waves(vibration, spin, n, 2).eigenvalues.reshape(-1, 2)
        split = np.diff(np.sqrt(got), axis=1)[:, 0] / (2 * spin)
        for k, shape in enumerate(vibration.modes(n, 2).shapes):
            image = vibration.mass @ (shape @ SPIN_AXIS.T)
            g = (1j * (shape.conj() * image).sum()).real
            assert split[k] == pytest.approx(abs(n - g), rel=1e-5)
            assert abs(g) < 2 * n / (n * n + 1) + 0.05
