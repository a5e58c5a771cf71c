import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import legval

from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode, RingShape
from tyrecal.simulate.modes.label import Label, belt_motion, label_modes, pair_rings
from tyrecal.simulate.modes.rings import on_rings

from ..chance import generator

pytestmark = pytest.mark.numbers

AXIAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")


def section():
    """Nodes on a tyre's outline: a crown of 0.18 m and round sidewalls down to the rim."""
    z = np.linspace(-0.09, 0.09, 25)
    height = np.linspace(0.0, np.pi, 15)[1:-1]
    side = np.column_stack([0.30 + 0.08 * np.cos(height), 0.09 + 0.03 * np.sin(height)])
    return np.concatenate([side * [1, -1], np.column_stack([0.39 - 0.8 * z**2, z]), side])


POINTS = section()
NODES = np.arange(1, len(POINTS) + 1) * 10
# component, polynomial: motions of the belt by order
ORDERS = {
    0: {"r": [1.0], "t": [0.6]},
    1: {"r": [0, 0.7], "t": [0, 0.3], "z": [1.0]},
    2: {"r": [0, 0, 1.0], "z": [0, 0.4]},
    3: {"r": [0, 0, 0, 1.0], "z": [0, 0, 0.5]},
}
RINGS = NODES[[3, 9, 13, 19, 25, 31, 37, 41, 47]]
CROWN = NODES[[13, 16, 19, 22, 25, 28, 31, 34, 37]]
ANGLES = np.arange(24) / 24 * 2 * np.pi


def shape(c, motions, weights=(1.0,), sidewall=0.0, points=POINTS):
    """r, z in phase and theta a quarter wave behind, on the order's polynomials, fading to the
    rim; ``sidewall``: motion that the sidewalls make on their own."""
    zeta = points[:, 1] / 0.09
    fade = np.clip((points[:, 0] - 0.22) / 0.14, 0, 1)
    u = np.zeros((len(points), 3), complex)
    for motion, weight in zip(motions, weights, strict=True):
        for name, series in motion.items():
            k = "rtz".index(name)
            lag = 1j if name == "t" and c else 1
            u[:, k] += weight * lag * legval(np.clip(zeta, -1, 1), series) * fade
    u[:, 2] += sidewall * (fade < 1)
    return HarmonicShape(c, NODES, points, u)


def mode(frequency, *args, **kwargs):
    made = shape(*args, **kwargs)
    return RawMode(frequency, made, 2 if made.n else 1)


def labels(modes):
    return [labelled.label for labelled in label_modes(modes)]


def rings(made, rng, noise=0.0, nodes=RINGS, angles=ANGLES):
    """Rings with both halves of a pair, turned at random, their points shuffled."""
    turn = rng.uniform(0, 2 * np.pi)
    halves = []
    order = rng.permutation(len(nodes) * len(angles))
    for phase in (turn, turn + np.pi / 2) if made.n else (0.0,):
        ring = on_rings(made, nodes, angles, phase)
        u = ring.displacement[order]
        u = u + noise * np.abs(u).max() * rng.standard_normal(u.shape)
        halves.append(RingShape(ring.points[order], u))
    return halves


@pytest.mark.parametrize("c", range(1, 8))
@pytest.mark.parametrize("m", ORDERS)
def test_a_belt_moving_on_one_order_has_that_label(c, m):
    (labelled,) = label_modes([mode(50.0, c, [ORDERS[m]])])
    assert labelled.label == Label(c, m)
    assert labelled.clarity > 0.7
    assert (labelled.frequency_Hz, labelled.multiplicity, labelled.position) == (50.0, 2, 0)


@pytest.mark.parametrize(
    "motion, label",
    [
        ({"z": [1.0]}, AXIAL),
        ({"t": [1.0]}, TORSIONAL),
        ({"r": [1.0]}, Label(0, 2)),
        ({"r": [0, 1.0]}, Label(0, 1)),
        ({"r": [0, 0, 1.0]}, Label(0, 2)),
    ],
)
def test_without_waves_only_a_rigid_belt_is_0_0(motion, label):
    assert labels([mode(50.0, 0, [motion])]) == [label]


@settings(max_examples=30, deadline=None)
@given(c=st.integers(0, 6), m=st.integers(0, 3), phase=st.floats(0, 6.3), size=st.floats(1e-6, 1e6))
def test_phase_and_size_of_a_shape_do_not_matter(c, m, phase, size):
    made = shape(c, [ORDERS[m]])
    turned = HarmonicShape(c, NODES, POINTS, made.amplitude * size * np.exp(1j * phase))
    one, two = belt_motion(made), belt_motion(turned)
    assert two.shares == pytest.approx(one.shares, abs=1e-12)
    assert two.participation == pytest.approx(one.participation)


def test_two_modes_that_share_both_rigid_motions_are_told_apart_together():
    axial, torsional = {"z": [1.0]}, {"t": [1.0]}
    # the second holds more axial than torsional motion too, but less than the first
    modes = [
        mode(36.0, 0, [axial, torsional], (0.80, 0.60)),
        mode(36.5, 0, [axial, torsional], (0.72, -0.69)),
    ]
    first, second = label_modes(modes)
    assert (first.label, second.label) == (AXIAL, TORSIONAL)
    assert first.clarity == pytest.approx(0.28, abs=0.02)
    assert second.clarity == 0.0


def test_an_even_tie_still_gives_both_labels_and_no_clarity():
    both = [{"z": [1.0]}, {"t": [1.0]}]
    modes = [mode(36.0, 0, both, (1.0, 1.0)), mode(36.2, 0, both, (1.0, -1.0))]
    labelled = label_modes(modes)
    assert {one.label for one in labelled} == {AXIAL, TORSIONAL}
    assert max(one.clarity for one in labelled) < 1e-6


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_an_overtone_does_not_steal_the_label_however_pure_it_is(order):
    modes = [
        mode(60.0, 2, [ORDERS[1], ORDERS[0]], (0.8, 0.5)),
        mode(70.0, 2, [ORDERS[0], ORDERS[1]], (0.8, -0.5)),
        mode(190.0, 2, [{"r": [0, 1.0]}]),
    ]
    wanted = [Label(2, 1), Label(2, 0), Label(2, 3)]
    assert labels([modes[i] for i in order]) == [wanted[i] for i in order]


def test_a_sidewall_mode_below_the_belts_does_not_take_the_label():
    modes = [mode(40.0, 3, [ORDERS[0]], (0.05,), sidewall=1.0), mode(90.0, 3, [ORDERS[0]])]
    assert labels(modes) == [Label(3, 2), Label(3, 0)]


def test_what_nothing_claims_has_the_first_free_order_of_its_parity():
    """A mode of the sidewalls alone: without waves 1 or 2, with waves 2 or 3."""
    for c, m, wanted in ((0, 1, 1), (0, 2, 2), (0, 3, 1), (2, 0, 2), (2, 1, 3), (2, 2, 2)):
        assert labels([mode(40.0, c, [{"r": ORDERS[m]["r"]}], (0.05,), sidewall=1.0)]) == [
            Label(c, wanted)
        ]


def test_no_label_twice_among_many_overtones():
    modes = [mode(50.0 + i, c, [ORDERS[i % 3]]) for c in (0, 1, 4) for i in range(9)]
    all_labels = labels(modes)
    assert len(set(all_labels)) == len(all_labels)
    assert sum(label.c == label.m == 0 for label in all_labels) <= 2


@settings(max_examples=25, deadline=None)
@given(c=st.integers(0, 8), m=st.integers(0, 3), seed=st.integers(0, 1000))
@pytest.mark.parametrize("nodes", [RINGS, CROWN], ids=["all over", "crown only"])
def test_rings_of_shuffled_noisy_points_carry_the_same_label(nodes, c, m, seed):
    made = shape(c, [ORDERS[m]])
    (expected,) = labels([RawMode(50.0, made, 2)])
    for half in rings(made, generator(seed), 0.02, nodes):
        assert labels([RawMode(50.0, half, 1)]) == [expected]


@pytest.mark.parametrize("missing, m", [("r", 1), ("t", 0), ("z", 0), ("tz", 0), ("tz", 2)])
def test_components_that_were_not_measured_may_be_missing(missing, m):
    half = rings(shape(2, [ORDERS[m]]), generator(0), 0.02)[0]
    u = half.displacement.copy()
    u[:, ["rtz".index(name) for name in missing]] = np.nan
    assert labels([RawMode(50.0, RingShape(half.points, u), 1)]) == [Label(2, m)]


def test_points_at_no_regular_place_and_a_few_lost_ones():
    rng = generator(3)
    z = rng.uniform(-0.09, 0.09, 150)
    points = np.column_stack([0.39 - 0.8 * z**2, z])
    theta = rng.uniform(0, 2 * np.pi, 150)
    made = shape(3, [ORDERS[1]], points=points)
    u = (made.amplitude * np.exp(1j * (3 * theta + 0.4))[:, None]).real
    u[rng.random(u.shape) < 0.2] = np.nan
    scattered = RingShape(np.column_stack([points[:, 0], theta, z]), u)
    assert labels([RawMode(50.0, scattered, 1)]) == [Label(3, 1)]


def test_one_ring_of_radial_motion_tells_c():
    half = rings(shape(4, [ORDERS[0]]), generator(0), nodes=NODES[[25]])[0]
    u = half.displacement * [1, np.nan, np.nan]
    assert labels([RawMode(50.0, RingShape(half.points, u), 1)]) == [Label(4, 0)]


def test_nothing_measured_on_the_belt_is_refused():
    half = rings(shape(2, [ORDERS[0]]), generator(0))[0]
    u = np.where(half.points[:, :1] > 0.36, np.nan, half.displacement)
    with pytest.raises(ValueError, match="four points of the belt"):
        label_modes([RawMode(50.0, RingShape(half.points, u), 1)])


@pytest.mark.parametrize("seed", range(5))
def test_halves_of_pairs_find_each_other_where_four_modes_meet(seed):
    rng = generator(seed)
    flat, tilted = shape(2, [ORDERS[0]]), shape(2, [ORDERS[1]])
    other = shape(3, [ORDERS[0]])
    halves = [
        RawMode(f + split, half, 1)
        for f, made in ((48.2, flat), (48.3, tilted), (48.25, other))
        for split, half in zip((0.0, 0.02), rings(made, rng, 0.02), strict=True)
    ]
    joined = pair_rings([halves[i] for i in rng.permutation(6)])
    assert [one.multiplicity for one in joined] == [2, 2, 2]
    by_label = {one.label: one.frequency_Hz for one in label_modes(joined)}
    assert by_label == pytest.approx({Label(2, 0): 48.21, Label(2, 1): 48.31, Label(3, 0): 48.26})


def test_a_lone_half_and_a_single_mode_stay_as_they_are():
    rng = generator(0)
    lone = RawMode(80.0, rings(shape(2, [ORDERS[0]]), rng)[0], 1)
    (spin,) = rings(shape(0, [{"t": [1.0]}]), rng)
    modes = [RawMode(36.0, spin, 1), lone, mode(90.0, 3, [ORDERS[0]])]
    joined = pair_rings(modes)
    assert joined == modes
    assert labels(joined) == [TORSIONAL, Label(2, 0), Label(3, 0)]


def test_halves_that_are_too_far_apart_are_not_joined():
    a, b = rings(shape(2, [ORDERS[0]]), generator(0))
    halves = [RawMode(80.0, a, 1), RawMode(81.0, b, 1)]
    assert len(pair_rings(halves)) == 2
    assert len(pair_rings(halves, tolerance=0.02)) == 1


def test_labels_cost_little():
    modes = [mode(50.0 + i, i // 2, [ORDERS[i % 2]]) for i in range(10)]
    label_modes(modes)
    best = np.inf
    for _ in range(20):
        start = time.process_time()
        label_modes(modes)
        best = min(best, time.process_time() - start)
    assert best < 2e-3


def weights_for(share):
    """Weights of the orders 0 and 1 by which the first has that share of the belt's energy."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        part = belt_motion(shape(3, [ORDERS[0], ORDERS[1]], (middle, 1 - middle))).shares[0]
        low, high = (middle, high) if part < share else (low, middle)
    return low, 1 - low


@pytest.mark.parametrize("share, label", [(0.19, Label(3, 3)), (0.21, Label(3, 0))])
def test_an_order_is_claimed_with_a_fifth_of_the_motion(share, label):
    """The other one is taken by a lower mode; with less it is an overtone of that."""
    lower, upper = (
        mode(50.0, 3, [ORDERS[1]]),
        mode(60.0, 3, [ORDERS[0], ORDERS[1]], weights_for(share)),
    )
    assert labels([lower, upper]) == [Label(3, 1), label]


def with_sidewalls(part):
    """[3,0] on the belt, whose mean square motion is that share of all points'."""
    belt = POINTS[:, 0] > 0.94 * POINTS[:, 0].max()
    u = np.where(belt[:, None], [1.0, 0.6j, 0.0], 0.0)
    u[~belt, 2] = np.sqrt(1.36 * (1 / part - belt.mean()) / (1 - belt.mean()))
    return HarmonicShape(3, NODES, POINTS, u)


@pytest.mark.parametrize("part, label", [(0.09, Label(3, 2)), (0.11, Label(3, 0))])
def test_an_order_is_claimed_with_a_tenth_of_the_belts_part(part, label):
    """The part is that of the mean square motion; below a tenth a mode of the sidewalls claims
    nothing."""
    made = with_sidewalls(part)
    assert belt_motion(made).participation == pytest.approx(part)
    assert labels([RawMode(50.0, made, 2)]) == [label]


@pytest.mark.parametrize("hertz, first", [(69.0, False), (72.0, True), (200.0, True)])
def test_of_two_that_move_the_belt_alike_the_more_compliant_part_has_the_label(hertz, first):
    """Half of the belt's part at 50 Hz against all of it above: they are even at 50 sqrt(2) Hz."""
    modes = [RawMode(50.0, with_sidewalls(0.5), 2), RawMode(hertz, with_sidewalls(1.0), 2)]
    assert (labels(modes)[0] == Label(3, 0)) == first
    assert (labels(modes)[1] == Label(3, 0)) != first


def test_halves_are_joined_to_half_a_per_cent():
    a, b = rings(shape(2, [ORDERS[0]]), generator(0))
    for split, count in ((0.0049, 1), (0.0051, 2)):
        assert len(pair_rings([RawMode(80.0, a, 1), RawMode(80.0 * (1 + split), b, 1)])) == count


def test_of_two_alike_a_half_is_joined_to_the_nearer():
    """Though the farther moves the belt as it does, and the nearer a little otherwise."""
    a, b = rings(shape(2, [ORDERS[0]]), generator(0))
    other = rings(shape(2, [ORDERS[0], ORDERS[1]], [1.0, 0.3]), generator(0))[0]
    halves = [RawMode(f, half, 1) for f, half in ((80.0, a), (80.02, other), (80.38, b))]
    joined = pair_rings(halves)
    assert [(m.frequency_Hz, m.multiplicity) for m in joined] == [
        (pytest.approx(80.01), 2),
        (80.38, 1),
    ]


def test_harmonics_are_looked_for_up_to_twelve():
    angles = np.arange(40) / 40 * 2 * np.pi
    for c, expected in ((11, 11), (12, 12)):
        half = rings(shape(c, [ORDERS[0]]), generator(0), angles=angles)[0]
        assert belt_motion(half).c == expected
    beyond = rings(shape(13, [ORDERS[0]]), generator(0), angles=angles)[0]
    assert belt_motion(beyond).c <= 12


def test_clarity_is_the_lead_over_the_next_order():
    weights = weights_for(0.7)
    (labelled,) = label_modes([mode(50.0, 3, [ORDERS[0], ORDERS[1]], weights)])
    shares = sorted(belt_motion(shape(3, [ORDERS[0], ORDERS[1]], weights)).shares)
    assert labelled.label == Label(3, 0) and labelled.clarity == pytest.approx(
        shares[-1] - shares[-2]
    )


def test_the_next_free_overtone_of_its_parity_is_taken():
    """Modes without waves have odd overtones from 1 and even ones from 2, modes with waves from
    2 and 3."""
    many = [mode(50.0 + i, 0, [{"r": [0, 1.0]}]) for i in range(3)]
    assert labels(many) == [Label(0, 1), Label(0, 3), Label(0, 5)]
    many = [mode(50.0 + i, 0, [{"t": [1.0]}]) for i in range(3)]
    assert labels(many) == [TORSIONAL, Label(0, 2), Label(0, 4)]
    many = [mode(50.0 + i, 2, [ORDERS[m]]) for i, m in enumerate((0, 0, 0, 1, 1))]
    assert labels(many) == [Label(2, 0), Label(2, 2), Label(2, 4), Label(2, 1), Label(2, 3)]


@pytest.mark.parametrize("motion, m", [({"r": [1.0]}, 0), ({"r": [0, 1.0]}, 1)])
def test_two_rings_carry_a_plane_and_no_higher_degree(motion, m):
    """A motion that is constant or linear over the width is nothing else, though a parabola or a
    cubic through two places would fit as well."""
    theta, z = np.tile(ANGLES, 2), np.repeat([-0.06, 0.06], len(ANGLES))
    u = legval(z / 0.06, motion["r"]) * np.cos(2 * theta)
    ring = RingShape(
        np.column_stack([np.full(len(z), 0.39), theta, z]), np.column_stack([u, 0 * u, 0 * u])
    )
    assert belt_motion(ring).shares[m] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_either_sidewall_tells_how_many_waves_there_are(side):
    """The belt hardly moves, with two waves; one sidewall does, with three."""
    rows = [
        (0.39, 0.0, 0.1, 2),
        (0.39, 0.03, 0.1, 2),
        (0.32, 0.1 * side, 1.0, 3),
        (0.32, -0.1 * side, 0.0, 3),
    ]
    points = [(R, angle, z) for R, z, _, _ in rows for angle in ANGLES]
    u = np.concatenate([size * np.cos(c * ANGLES) for _, _, size, c in rows])
    ring = RingShape(np.array(points), np.column_stack([u, 0 * u, 0 * u]))
    assert belt_motion(ring).c == 3
