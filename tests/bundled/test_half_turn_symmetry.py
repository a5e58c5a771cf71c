"""A quarter of the tyre for the whole: parts of a field, their forces, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import random_array as random_matrix
from tyrecal_solvers.bundled.road.half_turn_symmetry import HalfTurn
from tyrecal_solvers.bundled.section.symmetry import MIRROR_SIGNS, mirror_images
from tyrecal_solvers.bundled.solid3d.circumference import HalfCircle, half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import Refused

from . import support
from .conftest import Inflated
from .contact import ring

pytestmark = pytest.mark.numbers

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


def test_parts_of_what_was_spread(symmetry: HalfTurn, random: np.random.Generator) -> None:
    x = masked(symmetry, random)
    np.testing.assert_allclose(symmetry.parts(symmetry.spread(x)), x, atol=1e-14)


def test_gather_is_the_transpose_of_spread(symmetry: HalfTurn, random: np.random.Generator) -> None:
    """F . spread(x) = gather(F) . x, so energies and forces on the parts belong together; what
    is held gets no force."""
    x, F = masked(symmetry, random), random.normal(size=symmetry.shape)
    assert (F * symmetry.spread(x)).sum() == pytest.approx(
        (symmetry.gather(F) * x).sum(), rel=1e-12
    )
    assert not symmetry.gather(F)[~symmetry.mask].any()


def test_a_folded_stiffness_is_that_of_the_spread_parts(
    symmetry: HalfTurn, random: np.random.Generator
) -> None:
    """Folding and spreading agree for any stiffness between nodes, symmetric or not."""
    x, size = masked(symmetry, random), int(np.prod(symmetry.shape))
    K = random_matrix((size, size), density=1e-3, rng=1, format="csr")
    wanted = symmetry.gather((K @ symmetry.spread(x).ravel()).reshape(symmetry.shape))
    folded = (symmetry.fold(K) @ x.ravel()).reshape(x.shape)
    np.testing.assert_allclose(folded, wanted, atol=1e-12 * abs(wanted).max())


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


def test_axisymmetric_inflation_is_of_the_symmetry(inflated: Inflated) -> None:
    """The twist of the belts, u_theta, is odd across the section."""
    for around in (AROUND, WAVES):
        symmetry = HalfTurn(inflated.model.mesh, ~inflated.held, around)
        U = np.multiply.outer(around.turn(0).real, inflated.U)
        np.testing.assert_allclose(symmetry.spread(symmetry.parts(U)), U, atol=1e-12)
    mirrored = np.empty_like(inflated.U)
    mirrored[symmetry.beyond] = inflated.U[symmetry.nodes] * MIRROR_SIGNS
    assert abs(mirrored[symmetry.beyond] - inflated.U[symmetry.beyond])[:, 1].max() > 1e-6


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


@pytest.mark.parametrize(("off", "same"), [(0.4e-6, True), (0.9e-6, False), (-0.9e-6, False)])
def test_mirror_images_stand_in_the_same_place_to_half_a_micrometre(off: float, same: bool) -> None:
    X = np.array([[0.3, 0.0], [0.3, 0.02], [0.3, -0.02 - off], [0.35, -0.02]])
    images = mirror_images(X)
    assert images.tolist() == ([0, 2, 1, -1] if same else [0, -1, -1, -1])
