"""The road: contact and friction over the patch, and the equations' iterative solution."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tyrecal_solvers.bundled.road.contact import Bound, Contact, FlatRoad
from tyrecal_solvers.bundled.road.patch import patch
from tyrecal_solvers.bundled.road.road_data import read_road
from tyrecal_solvers.bundled.solid3d.circumference import Circumference, half_circle
from tyrecal_solvers.bundled.solid3d.gmres import gmres, gmres_together
from tyrecal_solvers.language.text import DeckError, read_keywords

from . import support
from .contact import Round, ball, ring

Array = np.ndarray
HEIGHT, WIDTH = 0.3, 0.04
STIFFNESS, SLIP = 1e9, 1e-5
AROUND = half_circle(np.array([0.01, 0.01, 0.02, 0.5, np.pi - 0.54]))


@pytest.fixture(scope="module")
def work() -> Round:
    return ring((0.2, 0.25, HEIGHT), WIDTH / 2, 2, support.Rubber())


def lowered(around: Circumference, nodes: int, shift: Array) -> Array:
    """The field (k, n, 3) of a shift in the road's frame: down, along, across."""
    c, s = np.cos(around.angles), np.sin(around.angles)
    down, along, across = shift
    u = np.stack([c * down + s * along, c * along - s * down, across + 0 * c], -1)
    return np.repeat(u[:, None], nodes, 1)


def settled(work: Round, friction: float, depth: float = 2e-4) -> tuple[FlatRoad, Array]:
    """A road that a shift of the ring by ``depth`` has touched, and that state."""
    road = work.road(AROUND, STIFFNESS, friction, SLIP)
    U = lowered(AROUND, len(work.U), np.array([depth, 0.0, 0.0]))
    return road.settled(road.forces(U, HEIGHT)), U


def states(U: Array, random: np.random.Generator) -> dict[str, Array]:
    """Beyond ``U`` by less and by more than the elastic slip, a little differently everywhere."""
    return {
        name: U
        + lowered(AROUND, U.shape[1], np.array([0.0, slips * SLIP, -slips * SLIP / 2]))
        + 0.1 * SLIP * random.normal(size=U.shape)
        for name, slips in (("sticking", 0.2), ("sliding", 20.0))
    }


def densely(road: FlatRoad, U: Array, height: float, count: int = 4000) -> tuple[float, float]:
    """Force of half the tyre (N) and its patch (m2, not deformed) by adding up many points."""
    points = road.tread.everywhere((np.arange(count) + 0.5) / count)
    over = np.maximum(points.positions(U)[..., 0] - height, 0.0)
    area = (road.tread.ds * road.tread.X[..., 0])[points.e] * road.tread.length[points.t, None]
    each = over.sum(-1), (over > 0).sum(-1)
    force, covered = ((area * one).sum() / count for one in each)
    return road.stiffness * float(force), float(covered)


def test_a_fourth_column_of_a_span_adds_to_its_third(work: Round) -> None:
    """Where waves follow, a span's third function also moves a column of theirs; where that is the
    third again, it counts once."""
    tread = work.road(AROUND, STIFFNESS).tread
    three, count, nodes = tread.columns[:, :3], len(AROUND.angles), len(work.U)
    columns = np.concatenate([three, three[:, 2:]], 1)
    columns[0, 3] = count
    U = np.random.default_rng(7).normal(size=(count + 1, nodes, 3)) * 1e-3
    both = U[:count].copy()
    both[three[0, 2]] += U[count]
    share = np.array([0.2, 0.7])
    plain = replace(tread, columns=three).everywhere(share)
    own = replace(tread, columns=columns, shape=U.shape).everywhere(share)
    first = own.t == 0
    for of in ("positions", "rates"):
        at = getattr(own, of)(U)
        np.testing.assert_allclose(at[first], getattr(plain, of)(both)[first], rtol=1e-12)
        np.testing.assert_allclose(at[~first], getattr(plain, of)(U[:count])[~first], rtol=1e-12)


def test_places(work: Round) -> None:
    """Undeformed points lie on the cylinder, of spans that begin within 60 degrees of the road, and
    a shift moves them by itself; their rates are the derivatives by the angle."""
    road = work.road(AROUND, STIFFNESS)
    points = road.tread.everywhere(np.linspace(0, 1, 4))
    at = points.positions(np.zeros((len(AROUND.angles), len(work.U), 3)))
    np.testing.assert_allclose(at[..., 0], HEIGHT * np.cos(points.angle), atol=1e-15)
    np.testing.assert_allclose(at[..., 1], HEIGHT * np.sin(points.angle), atol=1e-15)
    assert abs(at[..., 2]).max() < WIDTH / 2 and np.ptp(at[..., 2]) > 0.9 * WIDTH
    assert road.tread.begin == pytest.approx([0.0, 0.01, 0.02, 0.04, 0.54])
    U = lowered(AROUND, len(work.U), np.array([1e-3, 2e-3, -3e-3]))
    moved = points.positions(U)
    np.testing.assert_allclose(moved - at, 0 * at + [1e-3, 2e-3, -3e-3], atol=1e-15)
    e = 1e-6
    ahead = lambda step: replace(points, angle=points.angle + step).positions(U)
    wanted = (ahead(e) - ahead(-e)) / (2 * e)
    np.testing.assert_allclose(points.rates(U), wanted, atol=1e-9)


@pytest.mark.parametrize("depth", [1e-6, 1e-5, 1.5e-5, 2e-5, 6e-5, 2.4e-4, 3e-3])
def test_a_round_ring_on_the_road(work: Round, depth: float) -> None:
    """Sunk in by a depth without being deformed, the patch ending within elements and near their
    borders: W R (R sin t - (R - depth) t) k of force at R cos t = R - depth; its area, length and
    width; the force's derivative is k times the area."""
    road = work.road(AROUND, STIFFNESS)
    contact = road.forces(lowered(AROUND, len(work.U), np.array([depth, 0, 0])), HEIGHT)
    t = np.arccos((HEIGHT - depth) / HEIGHT)
    wanted = STIFFNESS * WIDTH * HEIGHT * (HEIGHT * np.sin(t) - (HEIGHT - depth) * t)
    assert contact.force / 2 == pytest.approx(wanted, rel=1e-7)
    assert contact.stiffness == pytest.approx(STIFFNESS * WIDTH * HEIGHT * t, rel=1e-8)
    footprint = patch(contact, work.model.mesh.X, AROUND.angles)
    assert footprint.length == pytest.approx(2 * HEIGHT * np.sin(t), rel=1e-8)
    assert footprint.width == pytest.approx(WIDTH)
    assert footprint.area.sum() == pytest.approx(WIDTH * HEIGHT * np.sin(t), rel=1e-7)
    assert footprint.force[..., 0].sum() == pytest.approx(wanted, rel=1e-7)
    assert not contact.traction.any()  # has touched nothing before


@pytest.mark.parametrize("depth", [2e-4, 4.1e-4])
def test_a_ball_on_the_road(depth: float) -> None:
    """The cap that is below the road: its force, its circle along and across, within elements of
    both directions."""
    R = 0.1
    work = ball((0.03, R), np.linspace(0.0, 0.4, 17), support.Rubber())
    around = half_circle(np.array([0.07] * 6 + [np.pi - 0.42]))
    road = work.road(around, STIFFNESS)
    contact = road.forces(lowered(around, len(work.U), np.array([depth, 0, 0])), R)
    across = (R - depth) / R
    wanted = 2 * np.pi * R**2 * (R / 2 * (1 - across**2) - (R - depth) * (1 - across))
    assert contact.force == pytest.approx(STIFFNESS * wanted, rel=5e-3)
    footprint = patch(contact, work.model.mesh.X, around.angles)
    radius = np.sqrt(2 * R * depth - depth**2)
    assert footprint.length == pytest.approx(2 * radius, rel=1e-3)
    assert footprint.width == pytest.approx(2 * radius, rel=1e-3)
    assert 2 * footprint.area.sum() == pytest.approx(np.pi * radius**2, rel=1e-2)


@pytest.mark.parametrize("size", [pytest.param(1e-5, marks=pytest.mark.slow), 3e-5, 3e-4])
def test_patches_of_any_shape(work: Round, random: np.random.Generator, size: float) -> None:
    """Touching here and there, twice in an element or with a gap amid it: what many points add up
    to, but for their own error."""
    road = work.road(AROUND, STIFFNESS)
    U = lowered(AROUND, len(work.U), np.array([2e-4, 0.0, 0.0]))
    for _ in range(5):
        V = U + size * random.normal(size=U.shape)
        contact = road.forces(V, HEIGHT)
        force, area = densely(road, V, HEIGHT)
        assert contact.force / 2 == pytest.approx(force, rel=1e-5)
        assert contact.points.area.sum() == pytest.approx(area, rel=2e-3)


def test_nodes_share_the_patch(work: Round, random: np.random.Generator) -> None:
    """Areas and forces of the nodes sum to the patch's; the areas are those of the deformed tread,
    stretched along and across; nodes in its midst bear the pressure there."""
    road, _ = settled(work, 0.7)
    U = lowered(AROUND, len(work.U), np.array([1e-2, 0.0, 0.0]))
    X = work.model.mesh.X
    U[..., 2] += 0.05 * X[:, 1]
    U[..., 1] += 0.02 * HEIGHT * np.sin(AROUND.angles)[:, None]
    contact = road.forces(U, HEIGHT)
    footprint = patch(contact, X, AROUND.angles)
    np.testing.assert_allclose(footprint.force.sum((0, 1))[0], contact.normal.sum())
    np.testing.assert_allclose(
        footprint.force[..., 1:].sum((0, 1)), contact.traction.sum((0, 1, 2)), atol=1e-9
    )
    points = contact.points
    stretch = points.densities(U)[points.angle < 0.02]
    np.testing.assert_allclose(stretch, 1.02 * 1.05, rtol=2e-3)
    assert footprint.area.sum() == pytest.approx((points.area * points.densities(U)).sum())
    assert footprint.area.min() == 0.0 and (footprint.area[footprint.force[..., 0] > 0] > 0).all()
    middle = np.flatnonzero(abs(X[:, 1]) + abs(X[:, 0] - HEIGHT) < 1e-9)[0]
    pressure = footprint.force[2, middle, 0] / footprint.area[2, middle]
    over = road.forces(U, HEIGHT).positions[..., 0].max() - HEIGHT
    assert pressure == pytest.approx(STIFFNESS * over / (1.02 * 1.05), rel=0.02)


def test_an_open_road_pushes_nobody(work: Round, random: np.random.Generator) -> None:
    road, U = settled(work, 0.7)
    V = U + 1e-6 * random.normal(size=U.shape)
    open_ = road.forces(V, HEIGHT + 1e-3)
    assert open_.force == open_.energy == 0.0
    assert not open_.field.any() and not open_.matrix().nnz


@pytest.mark.parametrize("friction", [0.0, 0.7])
@pytest.mark.parametrize("state", ["sticking", "sliding"])
def test_tangent_is_the_forces_derivative(
    work: Round, random: np.random.Generator, friction: float, state: str
) -> None:
    """The tangent is exact to rounding without friction; with friction, except for the points'
    own way as the edge moves."""
    road, U = settled(work, friction)
    V = states(U, random)[state]
    contact = road.forces(V, HEIGHT)
    slip = np.linalg.norm(contact.moved, axis=-1)[road.gap(contact.points) == 0]
    assert (slip < SLIP).mean() > 0.9 if state == "sticking" else (slip > SLIP).mean() > 0.9
    phi, e = random.normal(size=U.shape), 1e-9
    force = lambda step: road.forces(V + step * phi, HEIGHT).field
    wanted = (force(e) - force(-e)) / (2 * e)
    product = (contact.matrix() @ phi.ravel()).reshape(phi.shape)
    close = 1e-2 if friction else 1e-4
    np.testing.assert_allclose(product, wanted, rtol=0, atol=close * abs(product).max())


@pytest.mark.parametrize("state", ["sticking", "sliding"])
def test_bounded_friction_has_a_potential(
    work: Round, random: np.random.Generator, state: str
) -> None:
    """Forces are the energy's gradient and the tangent is symmetric, if the normal forces that
    limit friction are given (Tresca)."""
    road, U = settled(work, 0.7)
    V = states(U, random)[state]
    points = road.forces(V, HEIGHT).points
    bound = Bound(points, *random.uniform(0.0, 2.0, (2, *points.angle.shape)))
    phi, psi = random.normal(size=(2, *U.shape))
    e = 1e-9
    energy = lambda step: road.forces(V + step * phi, HEIGHT, bound).energy
    contact = road.forces(V, HEIGHT, bound)
    wanted = (8 * (energy(e) - energy(-e)) - energy(2 * e) + energy(-2 * e)) / (12 * e)
    assert (contact.field * phi).sum() == pytest.approx(wanted, rel=1e-5)
    K = contact.matrix()
    one, other = psi.ravel() @ (K @ phi.ravel()), phi.ravel() @ (K @ psi.ravel())
    assert one == pytest.approx(other, rel=1e-10)
    force = lambda step: road.forces(V + step * phi, HEIGHT, bound).field
    wanted = (force(e) - force(-e)) / (2 * e)
    product = (K @ phi.ravel()).reshape(phi.shape)
    np.testing.assert_allclose(product, wanted, rtol=0, atol=1e-4 * abs(product).max())


def test_the_potential_has_no_jump_where_a_point_begins_to_slide(work: Round) -> None:
    """The potential is smooth beyond half the elastic slip e; at three times e it is 2.5 e of
    the bound."""
    road, U = settled(work, 0.7)
    bound = road.forces(U, HEIGHT).bound(1.0)

    def friction(slips: float) -> float:
        along = lowered(AROUND, len(work.U), np.array([0.0, slips * SLIP, 0.0]))
        return road.forces(U + along, HEIGHT + 1.0, bound).energy

    full = 0.7 * bound.normal.sum() * SLIP
    for slips, path in ((0.5, 0.125), (1 - 1e-9, 0.5), (1 + 1e-9, 0.5), (3.0, 2.5)):
        assert friction(slips) == pytest.approx(full * path, rel=1e-3)


def test_friction_never_exceeds_coulombs_and_opposes_slip(
    work: Round, random: np.random.Generator
) -> None:
    road, U = settled(work, 0.7)
    for V in states(U, random).values():
        contact = road.forces(V, HEIGHT)
        traction = np.linalg.norm(contact.traction, axis=-1)
        assert (traction <= 0.7 * contact.normal * (1 + 1e-12)).all()
        assert (contact.moved * contact.traction).sum(-1).min() >= 0.0  # on the road: along it


def test_positive_part_of_the_stiffness(work: Round, random: np.random.Generator) -> None:
    """The preconditioner's share is symmetric, not negative, and all of it without friction."""
    for friction in (0.0, 0.7):
        road, U = settled(work, friction)
        contact = road.forces(states(U, random)["sliding"], HEIGHT)
        whole, part = contact.matrix(), contact.matrix(positive=True)
        scale = abs(part).max()
        assert abs(part - part.T).max() < 1e-9 * scale
        x = random.normal(size=(5, U.size))
        assert (np.einsum("in,ni->i", x, part @ x.T) > -1e-9 * scale).all()
        assert (abs(whole - part).max() < 1e-9 * scale) == (friction == 0.0)


def test_settled_keeps_what_sticks(work: Round, random: np.random.Generator) -> None:
    """Forces of a reached load stay the same at the same state, sticking or sliding. Points that
    newly touch have no traction until they move; points that left have lost theirs."""
    road, U = settled(work, 0.7)
    down = lowered(AROUND, len(work.U), np.array([2e-4, 0.0, 0.0]))
    for x in (0.3 * SLIP, 4 * SLIP):
        V = U + lowered(AROUND, len(work.U), np.array([0.0, x, -x / 2]))
        contact = road.forces(V, HEIGHT)
        after = road.settled(contact)
        again = after.forces(V, HEIGHT)
        scale = abs(contact.field[..., 1:]).max()
        np.testing.assert_allclose(again.field, contact.field, rtol=0, atol=1e-6 * scale)
        deeper = after.forces(V + down, HEIGHT)
        new = (deeper.normal > 0) & (after.gap(deeper.points) > 0)
        assert new.any() and not deeper.traction[new].any()
        gone = after.settled(after.forces(V, HEIGHT + 1.0))
        touched = gone.forces(V, HEIGHT)
        assert (gone.gap(touched.points) > 0).all() and not touched.traction.any()


def test_traction_of_a_reached_load_is_path_dependent(work: Round) -> None:
    """A motion there and back by ten elastic slips turns the traction to the full one against
    it."""
    road, U = settled(work, 0.7)
    along = lambda s: U + lowered(AROUND, len(work.U), np.array([0.0, s * SLIP, 0.0]))
    there = road.forces(along(10), HEIGHT)
    back = road.settled(there).forces(along(0), HEIGHT)
    np.testing.assert_allclose(there.traction[..., 0], 0.7 * there.normal, atol=1e-12)
    np.testing.assert_allclose(back.traction[..., 0], -0.7 * back.normal, atol=1e-12)


def test_points_slip_from_where_the_road_met_them(work: Round, random: np.random.Generator) -> None:
    """A point 0.3 mm above a road that rises by 0.4 mm has gone a quarter of its way on it; one
    that the road does not reach, none; the forces' derivative by the height is theirs."""
    road, U = settled(work, 0.7)
    along = lowered(AROUND, len(work.U), np.array([0.0, SLIP / 2, SLIP / 4]))
    height = road.height - 4e-4
    contact, e = road.forces(U + along, height), 1e-9
    gap = road.gap(contact.points)
    np.testing.assert_allclose(contact.share, np.clip(1 - gap / 4e-4, 0, None))
    assert ((contact.share > 0) & (contact.share < 1)).mean() > 0.05
    slip = np.linalg.norm(contact.moved * contact.share[..., None], axis=-1)
    traction = np.linalg.norm(contact.traction, axis=-1)
    wanted = 0.7 * contact.normal * slip / SLIP
    np.testing.assert_allclose(traction, wanted, rtol=1e-9, atol=1e-15)
    force = lambda step: road.forces(U + along, height + step).field
    wanted = (force(e) - force(-e)) / (2 * e)
    np.testing.assert_allclose(contact.by_height(), wanted, atol=1e-3 * abs(wanted).max())
    down = lambda step: road.forces(U + along, height + step).force
    assert -contact.stiffness * 2 == pytest.approx((down(e) - down(-e)) / (2 * e), rel=1e-6)


def test_the_whole_tyres_force_is_on_the_axle(work: Round) -> None:
    """The field's resultant, in fixed directions, is half the tyre's."""
    road, U = settled(work, 0.7)
    V = U + lowered(AROUND, len(work.U), np.array([0.0, 3 * SLIP, SLIP]))
    contact: Contact = road.forces(V, HEIGHT)
    local = [contact.normal.sum(), *contact.traction.sum((0, 1, 2))]
    for shift, wanted in zip(np.eye(3), local, strict=True):
        work_of = (contact.field * lowered(AROUND, len(work.U), shift)).sum()
        assert work_of == pytest.approx(wanted, rel=1e-12)
    assert contact.force == pytest.approx(2 * local[0])
    assert replace(road, friction=0.0).forces(V, HEIGHT).force == pytest.approx(contact.force)


@pytest.mark.parametrize("preconditioned", [False, True])
def test_gmres_solves(random: np.random.Generator, preconditioned: bool) -> None:
    A = np.eye(60) + 0.5 * random.normal(size=(60, 60)) / np.sqrt(60)
    b = random.normal(size=60)
    M = np.linalg.inv(A + 0.01 * random.normal(size=A.shape)) if preconditioned else np.eye(60)
    x, used, left = gmres(lambda v: A @ v, lambda v: M @ v, b, 1e-10, 60)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), atol=1e-8)
    assert left == pytest.approx(np.linalg.norm(A @ x - b) / np.linalg.norm(b), abs=1e-12)
    assert left <= 1e-10
    assert used < (15 if preconditioned else 60)


def test_right_sides_together_are_solved_as_each_alone(random: np.random.Generator) -> None:
    """Fewer calls, the same solutions, whether the first directions are known or not; the zero
    right side is left out."""
    A, M = np.diag(np.arange(1.0, 41.0)), np.diag(1 / np.arange(1.0, 41.0)) + 1e-2
    rights, calls = [random.normal(size=40), np.zeros(40), np.ones(40)], list[list[int]]()

    def precondition(vectors: np.ndarray, which: list[int]) -> np.ndarray:
        calls.append(which)
        return vectors @ M.T

    product = lambda vectors, which: vectors @ A.T
    alone = [gmres(lambda v: A @ v, lambda v: M @ v, b, 1e-8, 40) for b in rights]
    together, used, left = gmres_together(product, precondition, rights, 1e-8, 40)
    assert used == len(calls) == max(each[1] for each in alone)
    assert calls[0] == [0, 2] and left[1] == 0
    first = np.stack([M @ b / (np.linalg.norm(b) or 1.0) for b in rights])
    given = gmres_together(product, precondition, rights, 1e-8, 40, first)
    assert len(calls) == 2 * used - 1
    for i, (x, _, rest) in enumerate(alone):
        np.testing.assert_allclose(together[i], x, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(given[0][i], x, rtol=1e-9, atol=1e-12)
        assert left[i] == pytest.approx(rest, rel=1e-6, abs=1e-14)


def test_gmres_ends_where_it_is_told(random: np.random.Generator) -> None:
    A, b = np.diag(np.arange(1.0, 41.0)), np.ones(40)
    identity = lambda v: v
    x, used, left = gmres(lambda v: A @ v, identity, b, 1e-12, 5)
    assert used == 5
    assert left == pytest.approx(np.linalg.norm(A @ x - b) / np.linalg.norm(b), rel=1e-9)
    assert left > 1e-2
    x, used, left = gmres(lambda v: A @ v, identity, 0 * b, 1e-12, 5)
    assert (used, left) == (0, 0.0) and not x.any()
    x, used, _ = gmres(lambda v: 3 * v, identity, b, 1e-12, 5)
    assert used == 1
    np.testing.assert_allclose(x, b / 3)
    few = np.where(np.arange(40) % 2, 2.0, 5.0)  # two different eigenvalues: two iterations
    assert gmres(lambda v: few * v, identity, random.normal(size=40), 1e-10, 20)[1] == 2


def test_gmres_ends_where_no_direction_is_left() -> None:
    """A turn by 90 degrees is solved in two; a projection spans two directions, and leaves what is
    across it."""
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    x, used, left = gmres(lambda v: turn @ v, lambda v: v, np.array([1.0, 0.0]), 1e-12, 5)
    assert used == 2 and left < 1e-12
    np.testing.assert_allclose(x, [0.0, -1.0], atol=1e-12)
    onto, b = np.array([1.0, 0.0, 0.0]), np.array([3.0, 4.0, 0.0])
    x, used, left = gmres(lambda v: onto * (onto @ v), lambda v: v, b, 1e-12, 5)
    assert used == 2 and left == pytest.approx(4 / 5) and x[0] == pytest.approx(3.0)


ROAD = """*SYMMETRIC MODEL GENERATION, REVOLVE
0., 0., 0., 0., 1., 0.
1., 0., 0.
90., 2, 1., C
90., 1, 1., C
90., 1, 1., C
90., 2, 1., C
*RIGID BODY, REF NODE=900002, ANALYTICAL SURFACE=ROAD
*SURFACE, NAME=ROAD, TYPE=CYLINDER
0.4, 0., 0., 0.4, 1., 0.
0.4, 0., -1.
START, -1., 0.
LINE, 1., 0.
*SURFACE INTERACTION, NAME=GRIP
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
1E10
*FRICTION, ELASTIC SLIP=1E-6
0.5
*CONTACT PAIR, INTERACTION=GRIP, TYPE=SURFACE TO SURFACE
TREAD, ROAD
"""


def test_a_road_is_read() -> None:
    data = read_road(read_keywords(ROAD))
    assert data and (data.node, data.tread) == ("900002", "TREAD")
    assert (data.stiffness, data.friction, data.elastic_slip) == (1e10, 0.5, 1e-6)
    assert np.degrees(data.lengths) == pytest.approx([45, 45, 90])
    assert read_road(read_keywords(ROAD[: ROAD.index("*CONTACT PAIR")])) is None
    smooth = read_road(read_keywords(ROAD.replace("1E-6\n0.5", "1E-6\n0.")))
    assert smooth and smooth.friction == 0.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("TREAD, ROAD\n", "TREAD, ROAD\n*CONTACT PAIR\nTREAD, ROAD\n", "one *CONTACT PAIR"),
        ("SURFACE=ROAD", "SURFACE=RODE", "ROAD is no analytical surface"),
        ("*SURFACE, NAME=ROAD", "*SURFACE, NAME=RODE", "ROAD is no analytical surface"),
        ("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1E10\n", "", "needs a *SURFACE BEH"),
        ("*FRICTION, ELASTIC SLIP=1E-6\n0.5\n", "", "and a *FRICTION"),
        ("1E10", "0.", "stiffness must be positive"),
        ("0.5\n", "-0.1\n", "friction not negative"),
        ("SLIP=1E-6", "SLIP=0.9E-6", "elastic slip at least 1e-06 m"),
        (", ELASTIC SLIP=1E-6", "", "elastic slip at least"),
        ("TYPE=CYLINDER", "TYPE=REVOLUTION", "of TYPE=CYLINDER"),
        ("LINE, 1., 0.\n", "LINE, 1., 0.\nLINE, 2., 0.\n", "of TYPE=CYLINDER"),
        ("0.4, 0., 0., 0.4", "0.4, 0., 0., 0.3", "only a flat road"),
        ("0.4, 1., 0.", "0.4, 1., 0.1", "only a flat road"),
        ("0.4, 0., -1.", "0.4, 0., 1.", "only a flat road"),
        ("0.4, 0., 0., 0.4, 1., 0.\n0.4,", "-0.4, 0., 0., -0.4, 1., 0.\n-0.4,", "only a flat"),
        ("START, -1., 0.", "LINE, -1., 0.", "only a flat road"),
        ("START, -1., 0.", "START, -1., 0.1", "only a flat road"),
        ("LINE, 1., 0.", "LINE, 1., 0.1", "only a flat road"),
        ("LINE, 1., 0.", "CIRCL, 1., 0.", "only a flat road"),
        ("90., 2, 1., C\n*", "90., 2, 1.1, C\n*", "bias"),
        ("90., 2, 1., C\n*", "90., 1, 1., C\n*", "mirror at 180 degrees"),
        ("90., 2, 1., C\n*", "90., 3, 1., C\n*", "mirror at 180 degrees"),
        (
            "90., 2, 1., C\n90., 1, 1., C\n90., 1, 1., C\n90., 2, 1., C\n",
            "360., 2, 1., C\n",
            "four elements",
        ),
    ],
)
def test_roads_that_mean_something_else(old: str, new: str, words: str) -> None:
    assert ROAD.count(old) == 1
    with pytest.raises(DeckError, match=re.escape(words)):
        read_road(read_keywords(ROAD.replace(old, new)))


def test_four_elements_are_enough() -> None:
    some = ROAD.replace("90., 2, 1., C", "90., 1, 1., C")
    data = read_road(read_keywords(some))
    assert data and np.degrees(data.lengths) == pytest.approx([90, 90])
