"""The preconditioner follows the contact without being formed anew."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.road.contact_update import ContactUpdate

from . import support
from .conftest import Inflated
from .contact import ring
from .test_multifrontal import LENGTHS, Problem, conjugate_gradients, road_blocks

Array = np.ndarray


@pytest.mark.slow
def test_follows_the_contact(inflated: Inflated) -> None:
    """The update follows contact that begins, stiffens and ends, with as few iterations as a
    factor formed there."""
    touching = ContactUpdate(Problem(inflated).factor)
    for blocks in (
        road_blocks(inflated, 1e6, 0.1),
        road_blocks(inflated, 1e7, 0.5),
        0 * road_blocks(inflated, 1e6, 0.1),
    ):
        problem = Problem(inflated, contact=blocks)
        touching.to(problem.folded(blocks))
        b = problem.random()[0]
        x, used = conjugate_gradients(problem.product, touching.solve, b)
        assert np.linalg.norm(problem.product(x) - b) <= 2e-6 * np.linalg.norm(b)
        assert used <= conjugate_gradients(problem.product, problem.factor.solve, b)[1] + 3


@pytest.mark.slow
def test_one_node_in_the_middle_of_the_patch(inflated: Inflated) -> None:
    """The node adds a single column: both symmetries hold it, except for its way down."""
    blocks, X = np.zeros_like(road_blocks(inflated, 1e6, 0.0)), inflated.model.mesh.X
    blocks[0, np.lexsort((abs(X[:, 1]), -X[:, 0].round(9)))[0]] = np.diag([1e6, 0.0, 0.0])
    touching, problem = ContactUpdate(Problem(inflated).factor), Problem(inflated, contact=blocks)
    touching.to(problem.folded(blocks))
    x = problem.random()[0]
    expected = problem.factor.solve(x)
    np.testing.assert_allclose(touching.solve(x), expected, atol=1e-3 * abs(expected).max())


@pytest.mark.slow
def test_releases_what_the_factor_holds(inflated: Inflated) -> None:
    """Nodes on one side let go, others left: to the same inverse as the factor without them."""
    before = road_blocks(inflated, 1e6, 0.1)
    after = before.copy()
    after[2:] = 0.0
    touching = ContactUpdate(Problem(inflated, contact=before).factor)
    problem = Problem(inflated, contact=after)
    touching.to(problem.folded(after))
    x = problem.random()[0]
    expected = problem.factor.solve(x)
    # what the factor drops where the parts are eliminated singly, it no longer drops
    np.testing.assert_allclose(touching.solve(x), expected, atol=2e-2 * abs(expected).max())


def test_friction_is_not_symmetric(inflated: Inflated) -> None:
    """Traction that grows with the pressure: solved at once, where the symmetric part is not."""
    normal = road_blocks(inflated, 1e6, 0.0)
    whole = normal.copy()
    whole[..., 1, 0] += 0.5 * normal[..., 0, 0]
    whole[0, :, 1] = 0.0
    problem = Problem(inflated, contact=normal)
    touching = ContactUpdate(problem.factor)
    problem.contact = whole
    x = problem.random()[0]
    image = problem.product(x)
    error = {}
    for name, blocks in (("symmetric", normal), ("whole", whole)):
        touching.to(problem.folded(blocks))
        error[name] = np.linalg.norm(touching.solve(image) - x) / np.linalg.norm(x)
    assert error["whole"] < 0.3 * error["symmetric"]


@pytest.mark.slow
def test_places_are_formed_once(inflated: Inflated) -> None:
    """Columns for the same nodes again cost nothing, and stay in place for more nodes."""
    blocks = road_blocks(inflated, 1e6, 0.1)
    some = blocks.copy()
    some[1:] = 0.0
    problem = Problem(inflated)
    all_, few = problem.folded(blocks), problem.folded(some)
    touching, x = ContactUpdate(problem.factor), problem.random()[0]
    touching.to(few)
    first = touching.solve(x)
    touching.to(all_)
    assert not np.allclose(touching.solve(x), first, atol=1e-3 * abs(first).max())
    touching.to(few)
    np.testing.assert_array_equal(touching.solve(x), first)
    fresh = ContactUpdate(Problem(inflated).factor)
    fresh.to(all_)
    touching.to(all_)
    expected = fresh.solve(x)
    assert touching.solve(x) == pytest.approx(expected, abs=1e-4 * abs(expected).max())


def test_takes_what_the_factor_left_out_of_the_contact() -> None:
    """The update adds what couples the two parts of the factor. Without cords the factor
    separates fields that keep the mirror from those that reverse it; a road under one side
    couples them. The inverse is right to single precision."""
    work = ring((0.2, 0.21, 0.23), 0.02, 2, support.Rubber(), 2e3)
    plain = Inflated(None, work.model, ~work.free, work.loads, work.U)  # type: ignore[arg-type]
    X = work.model.mesh.X
    blocks = np.zeros((2 * len(LENGTHS) + 1, len(X), 3, 3))
    blocks[1:4, (X[:, 0] > 0.2299) & (X[:, 1] > 0.001)] = 1e7 * np.diag([1.0, 0.1, 0.1])
    problem = Problem(plain, contact=blocks)
    touching = ContactUpdate(problem.factor)
    touching.to(problem.folded(blocks))
    x = problem.random()[0]
    back = touching.solve(problem.product(x))
    np.testing.assert_allclose(back, x, atol=1e-2 * abs(x).max())
    assert abs(problem.factor.solve(problem.product(x)) - x).max() > 0.1 * abs(x).max()


def test_changes_of_less_than_a_thousandth_are_left_out() -> None:
    """Changes below a thousandth of the stiffest contact's stiffness are left out; the solution is
    then the factor's."""
    work = ring((0.2, 0.21, 0.23), 0.02, 2, support.Rubber(), 2e3)
    plain = Inflated(None, work.model, ~work.free, work.loads, work.U)  # type: ignore[arg-type]
    blocks = np.zeros((2 * len(LENGTHS) + 1, len(work.U), 3, 3))
    blocks[1:4, work.model.mesh.X[:, 0] > 0.2299] = 1e7 * np.diag([1.0, 0.1, 0.1])
    problem = Problem(plain, contact=blocks)
    touching, x = ContactUpdate(problem.factor), problem.random()[0]
    was = problem.factor.solve(x)
    np.testing.assert_array_equal(touching.solve(x), was)
    for more, same in ((1 + 0.9e-3, True), (1 + 1.1e-3, False)):
        touching.to(problem.folded(more * blocks))
        assert np.array_equal(touching.solve(x), was) == same
