"""Masses and springs on a tyre: what they do to its modes, and which fields are enough to tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform import coupled
from tyrecal_solvers.bundled.section.point_elements import PointElements
from tyrecal_solvers.language.text import COMPLEX_STEP

from . import support
from .conftest import Inflated
from .contact import ring
from .support import COUNT, WAVES, frequencies, plain

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
