"""Masses and springs on a tyre: what they do to its modes, and which fields are enough to tell.

The turning tyre against the rotating ring, rigid bodies and the tyre at rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh, eigvalsh
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform import coupled, rotation
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import SPIN_AXIS
from tyrecal_solvers.bundled.section.point_elements import PointElements
from tyrecal_solvers.language.text import COMPLEX_STEP

from . import support
from .conftest import Inflated
from .contact import ring
from .support import COUNT, WAVES, Rubber, frequencies, plain

Array = np.ndarray


SECTORS = 6


def on_crown(inflated: Inflated, mass: float = 0.0, spring: float = 0.0) -> PointElements:
    """Mass (kg) in all three directions and a radial spring (N/m) on the node furthest out."""
    crown = int(np.argmax(inflated.model.mesh.X[:, 0]))
    stiffness = np.array([spring, 0.0, 0.0], complex)
    return PointElements(
        np.full(3, crown), np.arange(3), np.full(3, mass, complex), stiffness, SECTORS
    )


@pytest.mark.parametrize(("mass", "spring"), [(0.05, 0.0), (0.0, 5e4), (0.05, 5e4)])
def test_secular_equation(
    vibration: Vibration, inflated: Inflated, mass: float, spring: float
) -> None:
    """det(1 + (k - lambda m) H(lambda)) = 0 at every coupled eigenvalue, H the dynamic receptance
    p^T (K - lambda M)^-1 p summed over the harmonics, each solved directly: what Ritz's method
    leaves out of the basis is worth less than 1e-3 of the shift in lambda."""
    a = on_crown(inflated, mass, spring)
    modes = coupled.attached_modes(vibration, a, WAVES, COUNT)
    free = ~inflated.held.ravel()
    M = csr_array(np.kron(support.full(vibration.mass), np.eye(3))[free][:, free])
    whole = support.matrices(inflated.model, inflated.U, inflated.loads)
    K0, K1, K2 = (csr_array(K[free][:, free]) for K in whole)
    p = np.zeros((len(free), 3))
    p[3 * a.rows + a.components, range(3)] = 1.0
    p = p[free]
    change = lambda value: np.diag(a.stiffness.real - value * a.mass.real)

    def gap(value: float) -> float:
        """The eigenvalue of change^-1 + H nearest to zero, as a share of the largest."""
        H = np.zeros((3, 3))
        for n in range(SECTORS + 1):
            K = K0 + 1j * n * K1 + n * n * K2 - value * M
            x = splu(K.tocsc()).solve(p.astype(complex))
            H += (p.T @ x).real * a.share(n) ** 2 / (np.pi if n else 2 * np.pi)
        return float(np.sort(np.linalg.eigvals(np.eye(3) + change(value) @ H).real)[0])

    was = plain(vibration)
    values = frequencies(modes)
    moved = np.argsort(-abs(values / was - 1))[:2]
    for j in moved:
        step = 2e-3 * abs(values[j] - was[j])
        assert gap(values[j] - step) * gap(values[j] + step) < 0


def test_what_is_attached_leaves_shapes_of_unit_mass(
    vibration: Vibration, inflated: Inflated
) -> None:
    """Next to nothing on the tyre: each member of a doublet is as large as the plain mode."""
    modes = coupled.attached_modes(vibration, on_crown(inflated, 1e-9), WAVES, COUNT)
    mass = lambda u: float((u.conj() * (vibration.mass @ u)).real.sum())
    for n, harmonic in zip(WAVES, modes, strict=True):
        own = mass(vibration.modes(n, 1).shapes[0])
        assert [mass(u) for u in harmonic.shapes] == pytest.approx(
            [own] * len(harmonic.shapes), rel=1e-6
        )


def test_time_is_looked_at_for_every_harmonic_of_what_is_attached(
    vibration: Vibration, inflated: Inflated
) -> None:
    """The time limit is checked for harmonics of the sectors and for those requested beyond;
    fields of n = 0 are real."""
    looks: list[int] = []
    attached = on_crown(inflated, 0.05)
    coupled.attached_modes(vibration, attached, [0, 7], 1, lambda: looks.append(1))
    assert len(looks) == max(SECTORS, 7) + 1
    force = coupled._unit_forces(vibration.numbering, attached)
    families = [coupled._with_response(vibration, n, 1, force) for n in (0, 1)]
    assert [np.iscomplexobj(family.shapes) for family in families] == [False, True]


def test_mass_lowers_and_spring_raises(vibration: Vibration, inflated: Inflated) -> None:
    """Rayleigh: no frequency rises with a mass or falls with a spring. A radial spring, of rank 1,
    leaves one member of every doublet within a hair of where it was."""
    was = plain(vibration)
    heavier = frequencies(coupled.attached_modes(vibration, on_crown(inflated, 0.05), WAVES, COUNT))
    stiffer = coupled.attached_modes(vibration, on_crown(inflated, 0, 5e4), WAVES, COUNT)
    assert (heavier <= was * (1 + 1e-9)).all() and heavier.min() < 0.999 * was.max()
    assert (frequencies(stiffer) >= was * (1 - 1e-9)).all()
    for n, modes in zip(WAVES[1:], stiffer[1:], strict=True):
        lower, upper = modes.eigenvalues.reshape(-1, 2).T
        known = vibration.modes(n, COUNT).eigenvalues
        np.testing.assert_allclose(lower, known, rtol=1e-6)
        assert (upper > lower).all()
        assert modes.members is not None and modes.members.tolist() == [1, 2] * COUNT


@pytest.mark.parametrize("n", [1, 2, 3])
def test_small_mass_by_first_order_perturbation(
    vibration: Vibration, inflated: Inflated, n: int
) -> None:
    """The two members of a doublet under 1 mg: d lambda = -lambda m |p|^2 in the basis of the
    doublet that makes p^T p diagonal."""
    mass = 1e-6
    a = on_crown(inflated, mass)
    modes = coupled.attached_modes(vibration, a, WAVES, COUNT)[n]
    known = vibration.modes(n, COUNT)
    for k in range(COUNT):
        u = known.shapes[k][a.rows, a.components] / np.sqrt(np.pi) * a.share(n)
        p = np.stack([u.real, -u.imag], 1)
        shift = -known.eigenvalues[k] * mass * np.linalg.eigvalsh(p.T @ p)[::-1]
        change = modes.eigenvalues[2 * k : 2 * k + 2] - known.eigenvalues[k]
        np.testing.assert_allclose(change, shift, rtol=2e-3, atol=1e-9 * known.eigenvalues[k])


def test_slopes_by_masses_and_springs(random: np.random.Generator) -> None:
    """sum of (k' - lambda m') p^2 over the components."""
    k, m = random.normal(size=(2, 4))
    step = 1j * COMPLEX_STEP
    at = PointElements(np.arange(4), np.zeros(4, int), 1.0 + step * m, 2.0 + step * k, 9)
    values, p = np.array([3.0, 5.0]), random.normal(size=(4, 2))
    wanted = [sum((k - value * m) * p[:, j] ** 2) for j, value in enumerate(values)]
    assert at.rates(values, p) == pytest.approx(wanted)
    assert at.total_kg == pytest.approx(4 / 3)
    nothing = np.zeros(4)
    empty = PointElements(np.arange(4), np.zeros(4, int), nothing, nothing, 9)
    assert bool(at) and not empty
    assert replace(empty, mass=np.ones(4)) and replace(empty, stiffness=np.ones(4))


def test_few_fields_stand_for_those_far_above(random: np.random.Generator) -> None:
    """Masses and springs on 400 fields: those that stand for the high ones leave the lowest modes
    as they are, to ninefold's sixth power; all are orthonormal."""
    eigenvalues, p = np.linspace(1.0, 40.0, 400) ** 2, random.normal(size=(3, 400))
    low, high, rest = coupled._reduced(eigenvalues, p, 20)
    fewer = np.zeros((400, len(low) + rest.shape[1]))
    fewer[low, range(len(low))], fewer[high, len(low) :] = 1.0, rest
    assert fewer.shape[1] < 100
    np.testing.assert_allclose(fewer.T @ fewer, np.eye(fewer.shape[1]), atol=1e-12)
    mass, spring = np.diag([0.0, 1e-2, 1e-3]), np.diag([3.0, 0.0, 1.0])
    K, M = np.diag(eigenvalues) + p.T @ spring @ p, np.eye(400) + p.T @ mass @ p
    whole = eigh(K, M, eigvals_only=True)[:20]
    some = eigh(fewer.T @ K @ fewer, fewer.T @ M @ fewer, eigvals_only=True)[:20]
    assert abs(whole / eigenvalues[:20] - 1).max() > 1e-3
    np.testing.assert_allclose(some, whole, rtol=9.0**-6)


def test_the_response_to_what_is_attached_is_among_the_fields() -> None:
    """The response is among the fields for stiff rubber as for soft; two elements of one component
    have one."""
    for shear in (1e5, 1e15):
        work = ring((0.2, 0.21, 0.23), 0.02, 2, support.Rubber(C10=shear))
        still = Vibration(work.model, work.U, [], support.numbering(work.model, ~work.free), 0.0)
        outside = np.flatnonzero(work.model.mesh.X[:, 0] > 0.2299)[[0, 0, 1, 1]]
        nothing = np.zeros(4, complex)
        at = PointElements(outside, np.array([0, 2, 0, 0]), nothing, nothing, SECTORS)
        force = coupled._unit_forces(still.numbering, at)
        np.testing.assert_allclose(force.T @ force, np.eye(3), atol=1e-12)
        assert len(coupled._with_response(still, 1, 2, force).shapes) == 2 + 3
        assert len(coupled._with_response(still, 0, 0, force).shapes) == 3


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
