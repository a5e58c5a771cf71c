"""Fields that the half turn keeps: their coordinates, and matrices and forces on half a section."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.kept_fields import KeptCholesky
from tyrecal_solvers.bundled.section.parts.part import of_each_component
from tyrecal_solvers.errors import Indefinite

from . import support
from .halves import Halves

Array = np.ndarray


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
