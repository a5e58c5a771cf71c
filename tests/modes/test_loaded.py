"""Loaded modes by their shapes: members of unloaded modes, symmetry, following over the load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode, RingShape
from tyrecal.simulate.modes.label import Label, Mode
from tyrecal.simulate.modes.loaded import (
    SYMMETRIES,
    Member,
    ModesAtLoad,
    Rings,
    _nearest_orthonormal,
    follow,
    members,
    rings,
    state,
)

Array = np.ndarray
NODES = np.array([3, 5, 7])
POINTS = np.array([[0.30, -0.05], [0.31, 0.0], [0.30, 0.05]])
ANGLES = np.sort(np.concatenate([np.arange(12) * np.pi / 6, [0.1, 2 * np.pi - 0.1]]))
WHERE = rings(ANGLES, NODES, NODES, POINTS)
LEAN = np.array([-1.0, 0.0, 1.0])


NARROW = rings(ANGLES, NODES, NODES, np.array([[0.30, -0.05], [0.30, -0.04], [0.30, 0.05]]))


def mode(n: int, r: Array, theta: Array, z: Array, kind: str | None = None) -> Mode:
    """u_r, u_z ~ exp(i n theta), u_theta ~ -i exp(i n theta), turned round the tyre by 0.7 rad."""
    amplitude = np.stack([r + 0j * LEAN, theta + 0j * LEAN, z + 0j * LEAN], -1) * np.exp(0.7j * n)
    shape = HarmonicShape(n, NODES, POINTS, amplitude)
    label = Label(n, 0, kind)
    return Mode(label, 50.0, 2 if n else 1, 1.0, 0, RawMode(50.0, shape, 2 if n else 1))


OVAL = mode(2, np.ones(3), 0.5j * np.ones(3), 0.1 * LEAN)


def test_areas_are_the_bands() -> None:
    """A band of the width of the line and the tyre's radius, whatever the rings' angles."""
    width = 2 * np.hypot(0.05, 0.01)
    assert WHERE.areas.sum() == pytest.approx(2 * np.pi * 0.305 * width)
    np.testing.assert_allclose(WHERE.areas[0], WHERE.areas[0][::-1])


def test_a_ring_has_half_of_the_way_to_either_neighbour() -> None:
    angles = np.array([0.0, 0.1, 0.4, 1.0, 3.0, 5.0])
    areas = rings(angles, NODES, NODES, POINTS).areas
    arcs = [(0.1 + 2 * np.pi - 5.0) / 2, 0.2, 0.45, 1.3, 2.0, (2 * np.pi - 3.0) / 2]
    np.testing.assert_allclose(areas[:, 1] / areas.sum(0)[1], np.array(arcs) / (2 * np.pi))
    order = np.array([2, 0, 1])  # whatever the order of the nodes
    np.testing.assert_allclose(rings(angles, NODES[order], NODES, POINTS).areas, areas[:, order])


def test_members_of_a_doublet_stand_by_the_patch() -> None:
    """The members are one even and one odd about angle 0, wherever the doublet was turned to,
    and orthogonal."""
    both = members(OVAL, WHERE)
    assert list(both) == [Member(OVAL.label, symmetry) for symmetry in SYMMETRIES]
    shapes = np.array(list(both.values()))
    np.testing.assert_allclose(WHERE.evenness(shapes), [1, 0], atol=1e-12)
    assert (
        abs(shapes[0][0, :, 0]).min() == pytest.approx(1) and abs(shapes[1][0, :, 0]).max() < 1e-12
    )
    np.testing.assert_allclose(WHERE.overlaps(shapes, shapes), np.eye(2), atol=1e-3)


def test_members_of_a_doublet_that_runs_round_stand_where_they_are_largest() -> None:
    """Points of the section out of phase, as cords at a bias have them: no other phase has more of
    its motion, area by area, along r and z in the patch's middle and of theta beside it."""
    random = np.random.default_rng(3)
    r, theta, z = random.normal(size=(3, 3)) + 1j * random.normal(size=(3, 3))
    even, odd = members(mode(2, r, theta, z), NARROW).values()
    amplitude = even[0] - 1j * odd[0]
    axes, areas = np.array([1.0, 1j, 1.0]), NARROW.areas.sum(0)[:, None]
    moves = lambda phase: ((amplitude * axes * np.exp(1j * phase)).real ** 2 * areas).sum()
    assert max(areas) > 3 * min(areas)
    others = np.array([moves(phase) for phase in np.linspace(0.05, np.pi - 0.05, 60)])
    assert (others < moves(0.0)).all()


def test_shapes_count_by_the_areas_of_their_points() -> None:
    random = np.random.default_rng(5)
    a, b = random.normal(size=(2, 1, *NARROW.areas.shape, 3))
    product = lambda x, y: float((x * y * NARROW.areas[:, :, None]).sum())
    assert NARROW.flat(a) @ NARROW.flat(b).T == pytest.approx(product(a, b))
    mac = product(a, b) ** 2 / (product(a, a) * product(b, b))
    assert NARROW.overlaps(a, b) == pytest.approx(mac)


def test_the_odd_member_is_the_even_one_turned_by_a_quarter_wave() -> None:
    random = np.random.default_rng(4)
    r, theta, z = random.normal(size=(3, 3)) + 1j * random.normal(size=(3, 3))
    even, odd = members(mode(2, r, theta, z), NARROW).values()
    turned = replace(NARROW, angles=NARROW.angles + np.pi / 4)
    ahead, _ = members(mode(2, r, theta, z), turned).values()
    np.testing.assert_allclose(ahead, odd, atol=1e-12)
    assert abs(even - odd).max() > 0.1


@pytest.mark.parametrize(
    ("shape", "symmetry"),
    [
        ((0 * LEAN, 0 * LEAN, np.ones(3)), "symmetric"),
        ((0 * LEAN, np.ones(3), 0 * LEAN), "antisymmetric"),
        ((0.3j * np.ones(3), 0 * LEAN, 1j * np.ones(3)), "symmetric"),
    ],
)
def test_single_modes(shape: tuple[Array, ...], symmetry: str) -> None:
    """[0,0]: along the axle is symmetric about the patch, about the axle is not."""
    ((member, field),) = members(mode(0, *shape, kind="axial"), WHERE).items()
    assert member.symmetry == symmetry and str(member) == f"[0,0] lateral {symmetry}"
    assert abs(field).max() == pytest.approx(1.0)  # the part that moves, not the other


def test_sampled_shapes_have_no_members() -> None:
    ring = RingShape(np.zeros((1, 3)), np.zeros((1, 3)))
    sampled = Mode(Label(2, 0), 50.0, 1, 1.0, 0, RawMode(50.0, ring, 1))
    with pytest.raises(TypeError, match="harmonic"):
        members(sampled, WHERE)


def waves(count: int) -> Array:
    """Orthonormal even fields, then as many odd ones, (2 count, ring, node, 3)."""
    where = rings(np.arange(24) * np.pi / 12, NODES, NODES, POINTS)
    shapes = [
        [np.cos(n * where.angles), np.sin(n * where.angles)][odd][:, None, None]
        * np.array([1.0, 0.0, 0.0])
        * np.ones((1, 3, 1))
        for odd in (0, 1)
        for n in range(1, count + 1)
    ]
    return (
        np.array(shapes) / np.sqrt((WIDE.flat(np.array(shapes)) ** 2).sum(1))[:, None, None, None]
    )


WIDE: Rings = rings(np.arange(24) * np.pi / 12, NODES, NODES, POINTS)


def solved(K: Array, basis: Array) -> ModesAtLoad:
    """Modes of a stiffness on a basis of one symmetry."""
    values, vectors = np.linalg.eigh(K)
    return state(np.sqrt(values), np.einsum("im,ikjc->mkjc", vectors, basis), WIDE)


def test_a_spring_that_exchanges_shapes_keeps_the_order() -> None:
    """A point of the tyre held ever harder: modes end below the next one's frequency, with much of
    its shape, and still are themselves."""
    basis = waves(5)[:5]
    K = np.diag(np.array([40.0, 60.0, 80.0, 100.0, 120.0]) ** 2)
    held = np.ones(5)
    free, tight = solved(K, basis), solved(K + 1e6 * np.outer(held, held), basis)
    followed = follow(free, tight, WIDE)
    np.testing.assert_array_equal(followed.position, np.arange(5))
    np.testing.assert_allclose(followed.spanned, 1.0)
    likest = WIDE.overlaps(free.shapes, tight.shapes).argmax(1)
    assert (likest < np.arange(5)).any()  # by the likest shape they would have other names


def test_a_curve_that_crosses_others_goes_on() -> None:
    """Modes that hardly attract cross, and so do those of different symmetry, in whatever order
    and with whatever sign they come."""
    basis = waves(3)
    before = ModesAtLoad(np.array([40.0, 50.0, 60.0, 45.0]), basis[[0, 1, 2, 3]], np.arange(4) < 3)
    after = ModesAtLoad(np.array([70.0, 52.0, 62.0, 99.0]), -basis[[0, 1, 2, 3]], np.arange(4) < 3)
    order = np.array([2, 0, 3, 1])
    mixed = ModesAtLoad(after.frequencies[order], after.shapes[order], after.symmetric[order])
    followed = follow(before, mixed, WIDE)
    np.testing.assert_array_equal(order[followed.position], np.arange(4))


def test_a_mode_that_left_is_not_named() -> None:
    """A mode that the next load's modes do not hold has no place there; nor has a kind that is
    missing."""
    basis = waves(4)
    before = ModesAtLoad(
        np.array([40.0, 50.0, 45.0]), basis[[0, 1, 4]], np.array([True, True, False])
    )
    after = ModesAtLoad(np.array([41.0, 60.0]), basis[[0, 2]], np.array([True, True]))
    followed = follow(before, after, WIDE)
    assert followed.position[0] == 0 and followed.position[2] == -1
    assert followed.spanned[0] == pytest.approx(1) and followed.spanned[1] < 0.1


def test_what_is_not_known_lies_above() -> None:
    """A spring mixes a new mode in from above: the lower two keep their names, whose shapes have
    come nearer to each other's, as they do where it was known from the beginning."""
    basis = waves(3)[:3]
    K = np.diag(np.array([40.0, 60.0, 80.0]) ** 2)
    held = np.array([1.0, 1.0, 1.5])
    before, after = solved(K, basis), solved(K + 3e3 * np.outer(held, held), basis)
    lower = ModesAtLoad(before.frequencies[:2], before.shapes[:2], before.symmetric[:2])
    whole, part = follow(before, after, WIDE), follow(lower, after, WIDE)
    np.testing.assert_array_equal(whole.position, np.arange(3))
    np.testing.assert_array_equal(part.position, np.arange(2))


def test_the_nearest_orthonormal_columns_do_not_depend_on_sizes() -> None:
    """The columns are orthonormal, and as near to the directions as an independent formula
    gives: v (v^T v)^-1/2 of columns of length 1."""
    v = np.linalg.qr(np.random.default_rng(2).standard_normal((9, 3)))[0]
    v = v + 0.2 * np.roll(v, 1, axis=1)
    columns = _nearest_orthonormal(v * [1.0, 30.0, 0.01])
    np.testing.assert_allclose(columns.T @ columns, np.eye(3), atol=1e-12)
    unit = v / np.linalg.norm(v, axis=0)
    values, vectors = np.linalg.eigh(unit.T @ unit)
    np.testing.assert_allclose(columns, unit @ (vectors / np.sqrt(values)) @ vectors.T, atol=1e-12)
