"""The road: contact and friction at nodes, and the equations' iterative solution."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tyrecal_solvers.bundled.deck.keywords import DeckError, read_keywords
from tyrecal_solvers.bundled.road.contact import Contact, FlatRoad
from tyrecal_solvers.bundled.road.footprint_job import read_road
from tyrecal_solvers.bundled.road.patch import edge
from tyrecal_solvers.bundled.solid3d.circumference import Circumference, half_circle
from tyrecal_solvers.bundled.solid3d.gmres import gmres

from . import support
from .contact import Round, ring

Array = np.ndarray
HEIGHT = 0.3
STIFFNESS, SLIP = 1e9, 1e-5
AROUND = half_circle(np.array([0.01, 0.01, 0.02, 0.5, np.pi - 0.54]))


@pytest.fixture(scope="module")
def work() -> Round:
    return ring((0.2, 0.25, HEIGHT), 0.02, 2, support.Rubber())


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
    """Beyond ``U`` by less and by more than the elastic slip, all differently."""
    return {
        name: U + size * random.normal(size=U.shape)
        for name, size in (("sticking", 0.1 * SLIP), ("sliding", 20 * SLIP))
    }


def test_places_and_areas(work: Round) -> None:
    """Undeformed nodes lie on the cylinder; the areas of the nodes near the road are those of its
    half, 60 degrees to the side; none beyond can touch."""
    road = work.road(AROUND, STIFFNESS)
    at = road.positions(np.zeros((len(AROUND.angles), len(work.U), 3)))
    k = len(road.area)
    assert AROUND.angles[k - 1] < np.pi / 3 <= AROUND.angles[k]
    np.testing.assert_allclose(
        at[..., 0], HEIGHT * np.cos(AROUND.angles[:k])[:, None] + 0 * at[..., 0]
    )
    np.testing.assert_allclose(
        at[..., 1], HEIGHT * np.sin(AROUND.angles[:k])[:, None] + 0 * at[..., 0]
    )
    np.testing.assert_array_equal(at[..., 2], work.model.mesh.X[road.nodes, 1] + 0 * at[..., 0])
    assert sorted(road.nodes) == sorted(np.flatnonzero(work.model.mesh.X[:, 0] > HEIGHT - 1e-9))
    areas = road.area.sum(1)
    np.testing.assert_allclose(areas, AROUND.shares[:k] * HEIGHT * 0.04, rtol=1e-12)
    U = lowered(AROUND, len(work.U), np.array([1e-3, 2e-3, -3e-3]))
    np.testing.assert_allclose(
        road.positions(U) - at, np.broadcast_to([1e-3, 2e-3, -3e-3], at.shape), atol=1e-15
    )


def test_an_open_road_pushes_nobody(work: Round, random: np.random.Generator) -> None:
    road, U = settled(work, 0.7)
    V = U + 1e-6 * random.normal(size=U.shape)
    open_ = road.forces(V, HEIGHT + 1e-3)
    assert not open_.local.any() and not open_.K.any() and open_.energy == 0.0
    assert open_.force == 0.0 and not open_.product(V).any()


def test_pressure_is_the_overclosures(work: Round) -> None:
    road = work.road(AROUND, STIFFNESS, 0.7)
    contact = road.forces(lowered(AROUND, len(work.U), np.array([2e-4, 0, 0])), HEIGHT)
    depth = 2e-4 - HEIGHT * (1 - np.cos(AROUND.angles[: len(road.area)]))
    pressure = contact.local[..., 0] / road.area
    wanted = STIFFNESS * np.maximum(depth, 0)[:, None]
    np.testing.assert_allclose(pressure, wanted + 0 * pressure, rtol=1e-9, atol=1e-3)
    assert contact.force == pytest.approx(2 * contact.local[..., 0].sum())
    assert not contact.local[..., 1:].any()  # has touched nothing before


@pytest.mark.parametrize("friction", [0.0, 0.7])
@pytest.mark.parametrize("state", ["sticking", "sliding"])
def test_tangent_is_the_forces_derivative(
    work: Round, random: np.random.Generator, friction: float, state: str
) -> None:
    road, U = settled(work, friction)
    V = states(U, random)[state]
    contact = road.forces(V, HEIGHT)
    slip = np.linalg.norm((contact.positions[..., 1:] - road.anchor)[road.gap == 0], axis=-1)
    assert (slip < SLIP).all() if state == "sticking" else (slip > SLIP).mean() > 0.9
    phi, e = random.normal(size=U.shape), 1e-11
    force = lambda step: road.forces(V + step * phi, HEIGHT).nodal(V.shape)
    wanted = (force(e) - force(-e)) / (2 * e)
    found = contact.product(phi)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-5 * abs(found).max())


@pytest.mark.parametrize("state", ["sticking", "sliding"])
def test_bounded_friction_has_a_potential(
    work: Round, random: np.random.Generator, state: str
) -> None:
    """With the normal forces that limit it given (Tresca), forces are the energy's gradient and
    the tangent is symmetric."""
    road, U = settled(work, 0.7)
    V = states(U, random)[state]
    bound = random.uniform(0.0, 2.0, (2, *road.area.shape))
    phi, psi = random.normal(size=(2, *U.shape))
    e = 1e-9
    energy = lambda step: road.forces(V + step * phi, HEIGHT, bound).energy
    contact = road.forces(V, HEIGHT, bound)
    wanted = (8 * (energy(e) - energy(-e)) - energy(2 * e) + energy(-2 * e)) / (12 * e)
    assert (contact.nodal(V.shape) * phi).sum() == pytest.approx(wanted, rel=1e-5)
    one, other = (psi * contact.product(phi)).sum(), (phi * contact.product(psi)).sum()
    assert one == pytest.approx(other, rel=1e-10)


def test_the_potential_has_no_jump_where_a_node_begins_to_slide(work: Round) -> None:
    """From e / 2 of the elastic slip's path on; at thrice e, 2.5 e of the bound."""
    road, U = settled(work, 0.7)
    bound = np.ones_like(road.area), np.ones_like(road.area)

    def friction(slips: float) -> float:
        along = lowered(AROUND, len(work.U), np.array([0.0, slips * SLIP, 0.0]))
        return road.forces(U + along, HEIGHT + 1.0, bound).energy

    full = 0.7 * road.area.size * SLIP
    rest = friction(0.0)
    for slips, path in ((0.5, 0.125), (1 - 1e-9, 0.5), (1 + 1e-9, 0.5), (3.0, 2.5)):
        assert friction(slips) - rest == pytest.approx(full * path, rel=1e-3)


def test_friction_never_exceeds_coulombs_and_opposes_slip(
    work: Round, random: np.random.Generator
) -> None:
    road, U = settled(work, 0.7)
    for V in states(U, random).values():
        contact = road.forces(V, HEIGHT)
        traction = np.linalg.norm(contact.local[..., 1:], axis=-1)
        assert (traction <= 0.7 * contact.local[..., 0] * (1 + 1e-12)).all()
        slip = contact.positions[..., 1:] - road.anchor
        assert (slip * contact.local[..., 1:]).sum(-1).min() >= 0.0  # on the road: along the slip


def test_positive_part_of_the_stiffness(work: Round, random: np.random.Generator) -> None:
    """The preconditioner's share is symmetric, not negative, and all of it without friction."""
    for friction in (0.0, 0.7):
        road, U = settled(work, friction)
        contact = road.forces(states(U, random)["sliding"], HEIGHT)
        blocks = contact.stiffness(*U.shape[:2], positive=True)
        np.testing.assert_allclose(blocks, blocks.swapaxes(-1, -2), atol=1e-9 * blocks.max())
        assert np.linalg.eigvalsh(blocks).min() >= -1e-9 * blocks.max()
        phi = random.normal(size=U.shape)
        same = np.allclose(np.einsum("knij,knj->kni", blocks, phi), contact.product(phi))
        assert same == (friction == 0.0)
        whole = contact.stiffness(*U.shape[:2], positive=False)
        image = np.einsum("knij,knj->kni", whole, phi)
        np.testing.assert_allclose(image, contact.product(phi), atol=1e-9 * abs(image).max())


def test_settled_keeps_what_sticks(work: Round, random: np.random.Generator) -> None:
    """Once a load is reached the forces at the same state are the same, sticking or sliding; nodes
    that newly touch have no traction until they move; those that left have forgotten theirs."""
    road, U = settled(work, 0.7)
    for V in states(U, random).values():
        V = V + lowered(AROUND, len(work.U), np.array([2e-4, 0.0, 0.0]))
        contact = road.forces(V, HEIGHT)
        new = (contact.local[..., 0] > 0) & (road.gap > 0)
        assert new.any()
        assert not contact.local[new][:, 1:].any()
        after = road.settled(contact)
        again = after.forces(V, HEIGHT)
        np.testing.assert_allclose(again.local, contact.local, rtol=1e-6, atol=1e-9)
        moved = after.forces(V + lowered(AROUND, len(work.U), np.array([0, SLIP / 2, 0])), HEIGHT)
        wanted = 0.7 * contact.local[new][:, 0] / 2
        np.testing.assert_allclose(moved.local[new][:, 1], wanted, rtol=1e-6)
        gone = after.settled(after.forces(V, HEIGHT + 1.0))
        assert (gone.gap > 0).all()
        assert not gone.forces(V, HEIGHT).local[..., 1:].any()


def test_traction_of_a_reached_load_is_path_dependent(work: Round) -> None:
    """There and back by ten elastic slips: the traction has turned to the full one against it."""
    road, U = settled(work, 0.7)
    along = lambda s: U + lowered(AROUND, len(work.U), np.array([0.0, s * SLIP, 0.0]))
    there = road.forces(along(10), HEIGHT)
    back = road.settled(there).forces(along(0), HEIGHT)
    on = there.local[..., 0] > 0
    np.testing.assert_allclose(there.local[on][:, 1], 0.7 * there.local[on][:, 0])
    np.testing.assert_allclose(back.local[on][:, 1], -0.7 * back.local[on][:, 0])


def test_nodes_slip_from_where_the_road_met_them(work: Round, random: np.random.Generator) -> None:
    """A node 0.3 mm above a road that rises by 0.4 mm has gone a quarter of its way on it; one
    that the road does not reach, none; the forces' derivative by the height is theirs."""
    road, U = settled(work, 0.7)
    V = U + 20 * SLIP * random.normal(size=U.shape)
    before = road.settled(road.forces(V, float(road.positions(V)[..., 0].max())))
    W, height = V + 3 * SLIP * random.normal(size=U.shape), before.height - 4e-4
    share, _ = before.share(height)
    wanted = np.clip(1 - before.gap / 4e-4, 0, None)
    np.testing.assert_allclose(share, wanted)
    assert ((share > 0) & (share < 1)).mean() > 0.05
    contact, e = before.forces(W, height), 1e-11
    slip = (contact.positions[..., 1:] - before.anchor) * share[..., None]
    length = np.linalg.norm(slip, axis=-1)
    traction = np.linalg.norm(contact.local[..., 1:], axis=-1)
    wanted = 0.7 * contact.local[..., 0] * np.minimum(length / SLIP, 1.0)
    np.testing.assert_allclose(traction, wanted, rtol=1e-9)
    force = lambda step: before.forces(W, height + step).local
    wanted = (force(e) - force(-e)) / (2 * e)
    np.testing.assert_allclose(contact.by_height, wanted, atol=1e-4 * abs(wanted).max())


def test_the_edge_follows_from_the_last_four_nodes() -> None:
    """p^2 ~ a^2 - x^2 over the last four that touch gives a, whatever is further in; between
    nodes where the pressure rises to the edge, or one node alone touches; beyond neither the last
    node nor the next."""
    x = np.arange(0.0, 9.0)
    pressure = np.sqrt(np.maximum(5.6**2 - x**2, 0.0))
    assert edge(x, pressure, 5) == pytest.approx(5.6)
    assert edge(x, np.where(x < 2, 9.0, pressure), 5) == pytest.approx(5.6)
    assert abs(edge(x, np.where(x < 3, 9.0, pressure), 5) - 5.6) > 0.02
    assert edge(x, np.where(x > 5, 0.0, 1 + x), 5) == 5.5
    assert edge(x, np.where(x > 0, 0.0, 1.0), 0) == 0.5
    assert edge(x, np.where(x > 5, 0.0, np.sqrt(np.maximum(7.0**2 - x**2, 0.0))), 5) == 6.0
    assert edge(x[:6], pressure[:6], 5) == 5.0
    steep = np.where(x > 5, 0.0, np.maximum(4.9**2 - x**2, 1e-9) ** 0.5)
    assert edge(x, steep, 5) == 5.0


def test_the_whole_tyres_force_is_on_the_axle(work: Round) -> None:
    """Nodal forces' resultant, in fixed directions, is half the tyre's."""
    road, U = settled(work, 0.7)
    V = U + lowered(AROUND, len(work.U), np.array([0.0, 3 * SLIP, SLIP]))
    contact: Contact = road.forces(V, HEIGHT)
    field = contact.nodal(V.shape)
    for i, shift in enumerate(np.eye(3)):
        work_of = (field * lowered(AROUND, len(work.U), shift)).sum()
        assert work_of == pytest.approx(contact.local[..., i].sum(), rel=1e-12)
    assert contact.force == pytest.approx(
        2 * (field * lowered(AROUND, len(work.U), np.eye(3)[0])).sum()
    )
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


def test_gmres_takes_the_first_direction_that_it_is_given(random: np.random.Generator) -> None:
    A, b = np.diag(np.arange(1.0, 41.0)), random.normal(size=40)
    M, calls = np.diag(1 / np.arange(1.0, 41.0)) + 1e-2, []

    def precondition(v: np.ndarray) -> np.ndarray:
        calls.append(1)
        return np.asarray(M @ v)

    plain = gmres(lambda v: A @ v, precondition, b, 1e-8, 40)
    asked = len(calls)
    given = gmres(lambda v: A @ v, precondition, b, 1e-8, 40, M @ b / np.linalg.norm(b))
    assert len(calls) == 2 * asked - 1
    np.testing.assert_allclose(given[0], plain[0], rtol=1e-12, atol=1e-12)
    assert given[1] == plain[1]


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
*CONTACT PAIR, INTERACTION=GRIP, TYPE=NODE TO SURFACE
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
