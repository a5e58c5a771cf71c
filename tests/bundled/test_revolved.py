"""The tyre in three dimensions: functions round the circumference, forces, tangents, harmonics."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.solid3d.circumference import (
    Circumference,
    functions,
    half_circle,
    waves_beyond,
)
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import Inverted

from ..chance import generator
from . import support
from .conftest import Inflated
from .contact import ring

Array = np.ndarray
UNEVEN = np.array([0.02, 0.1, 0.3, 0.5, 0.7, 0.9])
UNEVEN = UNEVEN / UNEVEN.sum() * np.pi


def fields(tyre: Revolved, random: np.random.Generator, size: float) -> Array:
    return size * random.normal(size=(tyre.around.N.shape[1], len(tyre.model.mesh.X), 3))


def turned(around: Circumference, Q: Array, shift: Array, X: Array) -> Array:
    """Displacements (k, n, 3) in the frame of the reference angle of x -> Q x + shift."""
    U = []
    for angle in around.angles:
        c, s = np.cos(angle), np.sin(angle)
        frame = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])  # to components r, theta, z
        place = np.insert(X, 1, 0.0, 1)
        U.append((place @ frame @ Q.T + shift) @ frame.T - place)
    return np.array(U)


@pytest.mark.parametrize("lengths", [UNEVEN, np.full(2, np.pi / 2), np.full(200, np.pi / 200)])
def test_functions_hold_circles_and_rigid_bodies(lengths: Array) -> None:
    """Partition of unity; 1, cos, sin and their derivatives are exact at any length; weights and
    shares sum to pi; the resultant of a uniform pressure, int cos, vanishes to 1e-9."""
    around = half_circle(lengths)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    assert len(around.angles) == 2 * len(lengths) + 1
    assert around.angles[0] == 0.0 and around.angles[-1] == pytest.approx(np.pi, abs=1e-12)
    place = np.empty(len(around.weights))
    for start, length, piece in zip(starts, lengths, around.pieces, strict=False):
        rows = piece.stations
        x, w = np.polynomial.legendre.leggauss(rows.stop - rows.start)
        place[rows] = start + (x + 1) * length / 2
        np.testing.assert_allclose(around.weights[rows], w * length / 2, rtol=1e-14)
    for f, slope in (
        (np.ones_like, np.zeros_like),
        (np.cos, lambda t: -np.sin(t)),
        (np.sin, np.cos),
    ):
        np.testing.assert_allclose(around.N @ f(around.angles), f(place), atol=1e-9)
        np.testing.assert_allclose(around.slope @ f(around.angles), slope(place), atol=1e-9)
    np.testing.assert_allclose(around.N.sum(1), 1.0, atol=1e-12)
    assert around.weights.sum() == pytest.approx(np.pi, rel=1e-12)
    assert around.shares.sum() == pytest.approx(np.pi, rel=1e-12)
    assert abs(around.weights @ np.cos(place)) < 1e-9
    assert abs(around.shares @ np.cos(around.angles)) < 1e-9


JOIN = 0.6


@pytest.mark.parametrize("highest", [2, 6])
def test_waves_beyond_the_elements(highest: int) -> None:
    """Even functions are all cos j x, odd ones sin j x, from the join to the top. Both continue
    where the last element ends and are orthonormal, except for the one that is not zero there;
    sums over the stations are integrals."""
    around = half_circle(np.array([0.1, 0.2, 0.3]), highest)
    fine, w = np.polynomial.legendre.leggauss(200)
    beyond, w = JOIN + (np.pi - JOIN) * (1 + fine) / 2, (np.pi - JOIN) * w / 2
    before, after = around.at(np.array([JOIN * (1 - 1e-12), JOIN]))
    np.testing.assert_allclose(before, after, atol=1e-9)
    x, h = np.pi - beyond, 1e-6
    slope = (around.at(beyond + h) - around.at(beyond - h)) / (2 * h)
    far = around.stations > JOIN
    for rows, wave in ((around.even, np.cos), (around.odd, np.sin)):
        own = rows[around.pieces[-1].functions]
        values = around.at(beyond)[:, own]
        waves = wave(np.multiply.outer(x, np.arange(highest + 1) + (wave is np.sin)))
        left = waves - values @ np.linalg.lstsq(values, waves, rcond=None)[0]
        assert len(own) == highest + 1 and abs(left).max() < 1e-9
        assert after[own].tolist() == pytest.approx([1.0] + [0.0] * highest, abs=1e-12)
        gram = values.T @ (w[:, None] * values)
        np.testing.assert_allclose(gram[1:, 1:], np.eye(highest), atol=1e-9)
        np.testing.assert_allclose(gram[0, 1:], 0.0, atol=1e-9)
        summed = around.N[far][:, own].T @ (around.weights[far, None] * around.N[far][:, own])
        np.testing.assert_allclose(summed, gram, atol=1e-9)
        slopes = around.slope[far][:, own].T @ (
            around.weights[far, None] * around.slope[far][:, own]
        )
        exact = slope[:, own].T @ (w[:, None] * slope[:, own])
        np.testing.assert_allclose(slopes, exact, rtol=1e-7, atol=1e-7)


def test_what_waves_stand_for() -> None:
    """The elements up to the first beyond 10 degrees, 45 degrees away at the farthest, and one more
    of the last one's length; 9 waves, or 5 more than elements of the deck hold; none where no
    element is short."""
    deck = np.radians([4, 4, 4, 5, 8, 17, 45, 93])
    around = waves_beyond(deck)
    ends = np.degrees(around.ends)
    np.testing.assert_allclose(ends, [0, 4, 8, 12, 17, 25, 33])
    assert len(around.even) == 12 + 10
    fine = waves_beyond(np.radians([5.0] * 36))
    assert fine.ends[-1] == pytest.approx(np.radians(50.0)) and len(fine.even) == 20 + 9 + 5 + 1
    assert not waves_beyond(np.radians([20.0] * 9)).waves.size


def test_coefficients_of_harmonics() -> None:
    """Coefficients of exp(i n theta): exact all round for n < 2, beyond the elements up to the
    highest wave, and the nearest sum of waves above."""
    around = half_circle(np.array([0.1, 0.2, 0.3]), 4)
    far = around.stations > JOIN
    for n in range(5):
        error = abs(around.N @ around.turn(n) - np.exp(1j * n * around.stations))
        assert error.max() < (1e-9 if n < 2 else 1e-2) and error[far].max() < 1e-9
    assert abs(around.slope @ around.turn(1) - 1j * np.exp(1j * around.stations)).max() < 1e-9
    error = abs(around.N @ around.turn(5) - np.exp(5j * around.stations))
    best = error[far] ** 2 @ around.weights[far]
    rows = around.odd[around.pieces[-1].functions]
    for row in (*around.even[around.pieces[-1].functions][1:], *rows[1:]):
        other = around.turn(5)
        other[row] += 1e-3 * (1j if row in rows else 1.0)
        worse = abs(around.N @ other - np.exp(5j * around.stations))[far] ** 2
        assert worse @ around.weights[far] > best


def test_functions_are_one_at_their_own_node() -> None:
    for half in (1e-3, 0.1, 1.0):
        values, _ = functions(np.array([-half, 0.0, half]), half)
        np.testing.assert_allclose(values, np.eye(3), atol=1e-9)


@pytest.fixture(
    scope="module", params=[(True, 0), (False, 0), (True, 3)], ids=["Q8", "Q4", "waves"]
)
def small(request) -> tuple[Revolved, Array]:
    """A small tyre between rest and inflation, out of balance, three elements round half of it, or
    two and waves."""
    quadratic, waves = request.param
    tyre = support.tyre((2, 2, 2, 1), quadratic=quadratic)
    m = support.model_of(tyre.deck)
    lengths = np.array([0.4, 1.0] if waves else [0.4, 1.0, np.pi - 1.4])
    work = Revolved(m, support.cavity(m, 240e3), half_circle(lengths, waves))
    return work, fields(work, generator(3), 2e-5)


def test_residual_is_the_potentials_gradient(
    small: tuple[Revolved, Array], random: np.random.Generator
) -> None:
    """r . phi = d/de potential(U + e phi), fourth-order difference, hourglass patterns included."""
    tyre, U = small
    phi, e = fields(tyre, random, 1.0), 1e-6

    def potential(step: float) -> float:
        tyre.residual(U + step * phi)
        return tyre.potential()

    wanted = (8 * (potential(e) - potential(-e)) - potential(2 * e) + potential(-2 * e)) / (12 * e)
    assert (tyre.residual(U) * phi).sum() == pytest.approx(wanted, rel=1e-6)


def test_product_is_the_residuals_derivative(
    small: tuple[Revolved, Array], random: np.random.Generator
) -> None:
    """The product agrees with a fourth-order difference, follower pressure and hourglass
    patterns included."""
    tyre, U = small
    phi = fields(tyre, random, 1.0)
    e = 2e-7
    one, two = (tyre.residual(U + s * e * phi) - tyre.residual(U - s * e * phi) for s in (1, 2))
    tyre.residual(U)
    product = tyre.product(phi)
    wanted = (8 * one - two) / (12 * e)
    np.testing.assert_allclose(product, wanted, rtol=0, atol=1e-7 * abs(product).max())


def test_product_is_symmetric(inflated: Inflated, random: np.random.Generator) -> None:
    """psi K phi = phi K psi where the pressure's open ends, at the rim and in the half circle's
    two planes, are held."""
    around = half_circle(UNEVEN)
    tyre = Revolved(inflated.model, inflated.loads, around)
    tyre.residual(np.repeat(inflated.U[None], len(around.angles), 0))
    phi, psi = fields(tyre, random, 1.0), fields(tyre, random, 1.0)
    for field in (phi, psi):
        field[:, inflated.held] = 0.0
        field[[0, -1]] = 0.0
    one, other = (psi * tyre.product(phi)).sum(), (phi * tyre.product(psi)).sum()
    scale = np.linalg.norm(tyre.product(phi)) * np.linalg.norm(psi)
    assert abs(one - other) <= 1e-12 * scale
    assert abs(one) > 1e-6 * scale


def test_tangents_of_the_stations_give_the_product(
    small: tuple[Revolved, Array], random: np.random.Generator
) -> None:
    tyre, U = small
    tyre.residual(U)
    phi = fields(tyre, random, 1.0)
    around, n = tyre.around, len(tyre.model.mesh.X)
    v, dv = (np.einsum("sk,knj->snj", w, phi) for w in (around.N, around.slope))
    total = np.zeros_like(phi)
    for c, K0, K1, K2 in tyre.tangents():
        s, e = len(v), len(c)
        np.testing.assert_allclose(K0, K0.swapaxes(-1, -2), atol=1e-10 * abs(K0).max())
        np.testing.assert_allclose(K2, K2.swapaxes(-1, -2), atol=1e-10 * abs(K0).max())
        at = lambda w, c=c, s=s, e=e: w[:, c].reshape(s, e, -1, 1)
        by_v = K0 @ at(v) + K1 @ at(dv)
        by_dv = K1.swapaxes(-1, -2) @ at(v) + K2 @ at(dv)
        for operator, force in ((around.N, by_v), (around.slope, by_dv)):
            nodal = np.zeros((s, n, 3))
            for station in range(s):
                np.add.at(nodal[station], c, force[station].reshape(e, -1, 3))
            total += np.einsum("sk,s,snj->knj", operator, around.weights, nodal)
    product = tyre.product(phi)
    np.testing.assert_allclose(total, product, atol=1e-12 * abs(product).max())


def test_axisymmetric_state_is_the_sections(inflated: Inflated) -> None:
    """Forces summed over the angles are pi times the section's; the potential too; and on the
    inflated tyre no free component is out of balance at any angle."""
    around = half_circle(UNEVEN)
    tyre = Revolved(inflated.model, inflated.loads, around)
    for share in (0.0, 0.7, 1.0):
        U = share * inflated.U
        force = tyre.residual(np.repeat(U[None], len(around.angles), 0))
        number = support.numbering(inflated.model)
        section = number.spread(mechanics.residual(inflated.model, U, inflated.loads, number))
        np.testing.assert_allclose(force.sum(0), np.pi * section, atol=1e-9 * abs(section).max())
        energy = mechanics.potential(inflated.model, U, inflated.loads)
        assert tyre.potential() == pytest.approx(np.pi * energy, rel=1e-12)
    scale = abs(force[:, inflated.held]).max()
    assert abs(force[1:-1][:, ~inflated.held]).max() <= 1e-7 * scale


@pytest.mark.parametrize("quadratic", [True, False], ids=["Q8", "Q4"])
def test_rigid_bodies_cost_nothing(quadratic: bool) -> None:
    """A shift by half a tyre's radius with a spin by 1.1 rad: no force and no energy; and the
    unloaded tyre has no stiffness against small shifts and turns about any axis."""
    m = support.model_of(support.tyre((2, 2, 2, 1), quadratic=quadratic).deck)
    around = half_circle(UNEVEN)
    tyre = Revolved(m, [], around)
    spin = np.eye(3) + np.sin(1.1) * _axis(2) + (1 - np.cos(1.1)) * _axis(2) @ _axis(2)
    shift = np.array([0.2, -0.1, 0.05])
    none = np.zeros(3)
    still = turned(around, np.eye(3), none, m.mesh.X)
    assert abs(still).max() < 1e-12
    tyre.residual(still)
    stiff = fields(tyre, generator(1), 1.0)
    scale = np.linalg.norm(tyre.product(stiff)) / np.linalg.norm(stiff)
    for motion in range(6):
        if motion < 3:
            u = turned(around, np.eye(3), np.eye(3)[motion], m.mesh.X)
        else:
            u = turned(around, np.eye(3) + _axis(motion - 3), none, m.mesh.X)
        assert np.linalg.norm(tyre.product(u)) <= 1e-11 * scale * np.linalg.norm(u)
    moved = turned(around, spin, shift, m.mesh.X)
    force = tyre.residual(moved)
    assert np.linalg.norm(force) <= 1e-10 * scale * np.linalg.norm(moved)
    assert abs(tyre.potential()) <= 1e-12 * scale * np.linalg.norm(moved) ** 2


def _axis(i: int) -> Array:
    W = np.zeros((3, 3))
    j, k = (i + 1) % 3, (i + 2) % 3
    W[j, k], W[k, j] = -1.0, 1.0
    return W


@pytest.mark.parametrize("n", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (0, 2, 3))])
def test_harmonics_are_the_limit_of_many_elements(inflated: Inflated, n: int) -> None:
    """u = Re[phi exp(i n Theta)] and its quarter wave together cost pi phi^H K(n) phi (half the
    circle; twice that for n = 0). Exact for n < 2, to fourth order in the elements' length else."""
    K0, K1, K2 = support.matrices(inflated.model, inflated.U, inflated.loads)
    K = K0 + 1j * n * K1 + n * n * K2
    X = inflated.model.mesh.X
    Z = X[:, 1] / 0.1
    phi = np.stack([1 + Z, 1j * (1 + Z**2) / max(n, 1), 0.3 - Z + 0.2j], -1)
    phi[inflated.held] = 0.0
    wanted = np.pi * (phi.ravel().conj() @ K @ phi.ravel()).real
    errors = []
    for elements in (8, 16, 32):
        around = half_circle(np.full(elements, np.pi / elements))
        tyre = Revolved(inflated.model, inflated.loads, around)
        tyre.residual(np.repeat(inflated.U[None], len(around.angles), 0))
        wave = np.exp(1j * n * around.angles)[:, None, None] * phi
        energy = sum((u * tyre.product(u)).sum() for u in (wave.real, wave.imag))
        errors.append(energy / wanted - 1)
    if n < 2:
        assert abs(np.array(errors)).max() < 1e-9
    else:
        assert support.order(errors)[-1] == pytest.approx(4.0, abs=0.5)
        assert abs(errors[-1]) < 2e-4 * n**2


def test_flattened_elements_are_refused() -> None:
    work = ring((0.2, 0.25, 0.3), 0.02, 2, support.Rubber())
    tyre = work.tyre(half_circle(np.full(3, np.pi / 3)))
    U = np.zeros((7, len(work.U), 3))
    U[3, :, 0] = -3.0 * (work.model.mesh.X[:, 0] - 0.2)
    with pytest.raises(Inverted):
        tyre.residual(U)
