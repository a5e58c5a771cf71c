"""A quarter of the tyre for the whole: parts of a field, their forces, what is refused.

Fields that the half turn keeps: their coordinates, and matrices and forces on half a section.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import random_array as random_matrix
from tyrecal_solvers.bundled.road.half_turn_symmetry import HalfTurn
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.kept_fields import KeptCholesky
from tyrecal_solvers.bundled.section.parts.part import of_each_component
from tyrecal_solvers.bundled.section.symmetry import MIRROR_SIGNS, mirror_images
from tyrecal_solvers.bundled.solid3d.circumference import HalfCircle, half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import Indefinite, Refused

from . import support
from .conftest import Inflated
from .contact import ring
from .support import Halves

Array = np.ndarray
AROUND = half_circle(np.full(3, np.pi / 3))
WAVES = half_circle(np.array([0.2, 0.5]), 4)


@pytest.fixture(
    scope="module",
    params=[(AROUND, 1), (AROUND, -1), (WAVES, 1), (WAVES, -1)],
    ids=["kept", "reversed", "kept, waves", "reversed, waves"],
)
def symmetry(request, inflated: Inflated) -> HalfTurn:
    return HalfTurn(inflated.model.mesh, ~inflated.held, *request.param)


def masked(symmetry: HalfTurn, random: np.random.Generator) -> Array:
    return random.normal(size=symmetry.mask.shape) * symmetry.mask


@pytest.mark.numbers
def test_parts_of_what_was_spread(symmetry: HalfTurn, random: np.random.Generator) -> None:
    x = masked(symmetry, random)
    np.testing.assert_allclose(symmetry.parts(symmetry.spread(x)), x, atol=1e-14)


@pytest.mark.numbers
def test_gather_is_the_transpose_of_spread(symmetry: HalfTurn, random: np.random.Generator) -> None:
    """F . spread(x) = gather(F) . x, so energies and forces on the parts belong together; what
    is held gets no force."""
    x, F = masked(symmetry, random), random.normal(size=symmetry.shape)
    assert (F * symmetry.spread(x)).sum() == pytest.approx(
        (symmetry.gather(F) * x).sum(), rel=1e-12
    )
    assert not symmetry.gather(F)[~symmetry.mask].any()


@pytest.mark.numbers
def test_a_folded_stiffness_is_that_of_the_spread_parts(
    symmetry: HalfTurn, random: np.random.Generator
) -> None:
    """Folding and spreading agree for any stiffness between nodes, symmetric or not."""
    x, size = masked(symmetry, random), int(np.prod(symmetry.shape))
    K = random_matrix((size, size), density=1e-3, rng=1, format="csr")
    wanted = symmetry.gather((K @ symmetry.spread(x).ravel()).reshape(symmetry.shape))
    folded = (symmetry.fold(K) @ x.ravel()).reshape(x.shape)
    np.testing.assert_allclose(folded, wanted, atol=1e-12 * abs(wanted).max())


@pytest.mark.numbers
def test_a_turned_tyre_is_the_same(symmetry: HalfTurn, random: np.random.Generator) -> None:
    """A field in the planes theta = 0 and pi is its own image under (theta, z) -> (-theta, -z):
    u_r kept, u_theta and u_z reversed, times the parity. Held components are zero."""
    U = symmetry.spread(masked(symmetry, random))
    image = np.empty_like(U)
    image[:, symmetry.beyond] = U[:, symmetry.nodes] * [1, -1, -1]
    image[:, symmetry.nodes] = U[:, symmetry.beyond] * [1, -1, -1]
    planes = symmetry.around.at(np.array([0.0, np.pi]))
    here, there = (np.einsum("ak,kni->ani", planes, field) for field in (U, image))
    np.testing.assert_allclose(here, symmetry.parity * there, atol=1e-13 * abs(U).max())
    assert not U[:, ~symmetry.free].any()


@pytest.mark.numbers
def test_dimension(symmetry: HalfTurn, inflated: Inflated) -> None:
    """The fields have as many unknowns as the turned half: all free components between the
    planes, and half of those in each plane. Of nodes at z = 0 these are the ones that the turn
    keeps (u_r) or reverses."""
    X, free = inflated.model.mesh.X, ~inflated.held
    middle = free[abs(X[:, 1]) < 1e-9].all(1).sum()
    pairs = (free.all(1).sum() - middle) // 2
    in_plane = 3 * pairs + (1 if symmetry.parity == 1 else 2) * middle
    # an even and an odd wave each are two functions of the half
    apart = 7 - 2 if symmetry.around is AROUND else 4 - 1 + 5
    planes = 2 if symmetry.around is AROUND else 1
    assert symmetry.mask.sum() == apart * free.sum() + planes * in_plane
    assert free.sum() == 3 * (2 * pairs + middle)


@pytest.mark.numbers
@pytest.mark.parametrize("around", [AROUND, WAVES], ids=["elements", "waves"])
def test_the_half_turn_maps_forces_to_forces(
    inflated: Inflated, random: np.random.Generator, around: HalfCircle
) -> None:
    """The tyre with belts at +-20 degrees keeps the half turn: where a field has the symmetry so
    have its forces in the planes, although not the mirror images'."""
    symmetry = HalfTurn(inflated.model.mesh, ~inflated.held, around)
    tyre = Revolved(inflated.model, inflated.loads, around)
    x = masked(symmetry, random)
    tyre.residual(np.multiply.outer(around.turn(0).real, inflated.U))
    one, other = masked(symmetry, random), masked(symmetry, random)
    product = lambda y: symmetry.gather(tyre.product(symmetry.spread(y)))
    left, right = (one * product(other)).sum(), (other * product(one)).sum()
    assert left == pytest.approx(right, rel=1e-10)
    assert (x * product(x)).sum() > 0
    even = x.copy()
    even[1] = 0.0
    assert abs(product(even)[1]).max() > 1e-4 * abs(product(even)[0]).max()  # the cords' bias


@pytest.mark.numbers
def test_axisymmetric_inflation_is_of_the_symmetry(inflated: Inflated) -> None:
    """The twist of the belts, u_theta, is odd across the section."""
    for around in (AROUND, WAVES):
        symmetry = HalfTurn(inflated.model.mesh, ~inflated.held, around)
        U = np.multiply.outer(around.turn(0).real, inflated.U)
        np.testing.assert_allclose(symmetry.spread(symmetry.parts(U)), U, atol=1e-12)
    mirrored = np.empty_like(inflated.U)
    mirrored[symmetry.beyond] = inflated.U[symmetry.nodes] * MIRROR_SIGNS
    assert abs(mirrored[symmetry.beyond] - inflated.U[symmetry.beyond])[:, 1].max() > 1e-6


@pytest.mark.numbers
def test_sections_without_the_symmetry_are_refused() -> None:
    work = ring((0.2, 0.25, 0.3), 0.02, 2, support.Rubber())
    free = work.free.copy()
    HalfTurn(work.model.mesh, free, AROUND)
    free[np.argmax(work.model.mesh.X[:, 1]), 2] ^= True
    with pytest.raises(Refused, match="supports differ"):
        HalfTurn(work.model.mesh, free, AROUND)
    b = support.block((0.2, 0.3, 2), (-0.02, 0.03, 2), True)
    m = support.model_of(support.deck(b.X, b.solids, support.Rubber()))
    with pytest.raises(Refused):
        HalfTurn(m.mesh, np.ones((len(b.X), 3), bool), AROUND)


@pytest.mark.numbers
@pytest.mark.parametrize(("off", "same"), [(0.4e-6, True), (0.9e-6, False), (-0.9e-6, False)])
def test_mirror_images_stand_in_the_same_place_to_half_a_micrometre(off: float, same: bool) -> None:
    X = np.array([[0.3, 0.0], [0.3, 0.02], [0.3, -0.02 - off], [0.35, -0.02]])
    images = mirror_images(X)
    assert images.tolist() == ([0, 2, 1, -1] if same else [0, -1, -1, -1])


def vectors(halves: Halves, random: np.random.Generator, columns: int = 2) -> Array:
    """Coordinates of random fields."""
    fields = halves.fields
    return fields.gather(fields.spread(random.normal(size=(fields.size, columns))))


def test_coordinates_are_of_kept_fields(halves: Halves, random: np.random.Generator) -> None:
    """Half turn and conjugation keep them, they are zero where the tyre is held, products are those
    of the coordinates; to one column the same happens as to many."""
    fields = halves.fields
    x, y = vectors(halves, random), vectors(halves, random)
    u, v = fields.spread(x), fields.spread(y)
    np.testing.assert_allclose(halves.symmetry.turned(u), u, atol=1e-14)
    assert not u[~halves.free].any() and (fields.free == halves.free).all()
    np.testing.assert_allclose(fields.gather(u), x, atol=1e-13)
    flat = u.reshape(-1, 2).conj().T @ v.reshape(-1, 2)
    np.testing.assert_allclose(flat, x.T @ y, atol=1e-11)
    np.testing.assert_array_equal(fields.spread(x[:, 0]), u[..., 0])
    np.testing.assert_array_equal(fields.gather(u[..., 0]), fields.gather(u)[:, 0])
    # u_r, and i times u_theta and u_z, are real on the middle plane
    middle = u[halves.symmetry.middle]
    assert not middle[:, 0].imag.any() and not middle[:, 1:].real.any()


def test_real_fields_are_a_kept_one_or_two(halves: Halves, random: np.random.Generator) -> None:
    """A real u is a + b, its coordinates are of a + i b; apart those of a and of i b."""
    fields = halves.fields
    u = random.normal(size=(*halves.free.shape, 2)) * halves.free[..., None]
    c = fields.spread(fields.gather(u))
    np.testing.assert_allclose(c.real + c.imag, u, atol=1e-13)
    apart = fields.spread(fields.apart(u))
    a, ib = apart[..., :2], apart[..., 2:]
    np.testing.assert_allclose(a - 1j * ib, u, atol=1e-13)
    assert not a.imag.any() and not ib.real.any()


@pytest.mark.parametrize("n", [0, 1, 4])
def test_matrices_on_half_are_the_wholes(
    halves: Halves, n: int, random: np.random.Generator
) -> None:
    """M x and K(n)^-1 f against dense matrices of the whole section."""
    fields, free = halves.fields, halves.free.ravel()
    x = vectors(halves, random)
    own = mechanics.mass_matrices(halves.whole)
    M = support.dense([(c, of_each_component(m, np.eye(3))) for c, m in own], len(halves.free))
    image = np.tensordot(M, fields.spread(x).reshape(-1, 2), 1) * free[:, None]
    got = fields.spread(fields.times(mechanics.mass(halves.half), x)).reshape(-1, 2)
    np.testing.assert_allclose(got, image, atol=1e-12 * abs(image).max())

    K0, K1, K2 = support.matrices(halves.whole, halves.U, halves.loads)
    K = K0 + 1j * n * K1 + n * n * K2
    loads = support.cavity(halves.half, 240e3)
    bands = [fields.assemble(p) for p in mechanics.tangents(halves.half, halves.U, loads, True)]
    band = np.asfortranarray(bands[0] + n * n * bands[2] + (1j * n * bands[1] if n else 0.0))
    given = np.asfortranarray(x)
    u = fields.spread(fields.factor(band).solve(given)).reshape(-1, 2)
    assert (given == x).all()
    force = (K @ u) * free[:, None]
    np.testing.assert_allclose(force, fields.spread(x).reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize(("band", "D", "words"), [(-2.0, 2.0, "pivot 1 of 2"), (2.0, 1.0, "plane")])
def test_what_is_not_positive_definite(band: float, D: float, words: str) -> None:
    """K = 2 and E = 2 with two unknowns, of which the last is coupled to two on the middle
    plane."""
    corner = np.array([[2.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    phase = np.array([1.0, 1j])
    K = np.array([[band, 2.0], [0.0, 0.0]])
    corner[1, 0] = D
    with pytest.raises(Indefinite, match=words):
        KeptCholesky(np.asfortranarray(K), corner, phase)
    corner[1, 0], K[0] = 2.0 + 1e-3, 2.0
    good = KeptCholesky(np.asfortranarray(K), corner, phase)
    assert good.solve(np.ones(8)).shape == (8,)


def test_whole_fields_and_forces(halves: Halves, random: np.random.Generator) -> None:
    """The state of half the elements is completed, and forces and sums are those of all
    elements."""
    symmetry = halves.symmetry
    even = halves.U * symmetry.here[:, None]
    np.testing.assert_allclose(symmetry.field(even), halves.U, atol=1e-15)
    own = support.cavity(halves.half, 240e3)
    half, whole = (
        mechanics.gradient(m, halves.U, p)
        for m, p in ((halves.half, own), (halves.whole, halves.loads))
    )
    np.testing.assert_allclose(symmetry.force(half), whole, atol=1e-10 * abs(whole).max())
    energy = mechanics.potential(halves.half, halves.U, own)
    assert 2 * energy == pytest.approx(mechanics.potential(halves.whole, halves.U, halves.loads))
    plain = halves.whole.mesh.symmetry
    u = random.normal(size=halves.U.shape)
    for same in (plain.field(u), plain.force(u), plain.kept(u)):
        assert same is u
    assert (plain.copies, symmetry.copies) == (1, 2)


def test_both_sides_move_alike(halves: Halves) -> None:
    X = halves.whole.mesh.X
    assert halves.symmetry.alike(X) is X
    moved = X + 1e-30j * np.arange(2 * len(X)).reshape(-1, 2)
    alike = halves.symmetry.alike(moved)
    other = halves.symmetry.other
    np.testing.assert_array_equal(alike.real, X)
    np.testing.assert_array_equal(alike.imag[other], alike.imag * [1, -1])
    R = (moved.imag[:, 0] + moved.imag[other, 0]) / 2
    np.testing.assert_array_equal(alike.imag[:, 0], R)
