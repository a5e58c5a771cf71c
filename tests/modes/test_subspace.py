import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyrecal.simulate.evaluate.results import HarmonicShape
from tyrecal.simulate.modes.rings import mac, on_rings, squared_cosines

from ..chance import generator

pytestmark = pytest.mark.numbers

RNG = generator(0)
NODES = np.array([5, 7, 9, 11])
POINTS = np.column_stack([RNG.uniform(0.2, 0.4, 4), RNG.uniform(-0.1, 0.1, 4)])
ANGLES = np.arange(24) / 24 * 2 * np.pi


def shape(n=2, seed=1):
    rng = generator(seed)
    return HarmonicShape(
        n, NODES, POINTS, rng.standard_normal((4, 3)) + 1j * rng.standard_normal((4, 3))
    )


def pair(made, turn=0.0):
    return [on_rings(made, NODES, ANGLES, turn + half) for half in (0.0, np.pi / 2)]


@given(phase=st.floats(0, 6.3), size=st.floats(1e-3, 1e3))
def test_mac_of_a_shape_with_itself_turned_and_scaled_is_one(phase, size):
    a = shape()
    b = HarmonicShape(2, NODES, POINTS, a.amplitude * size * np.exp(1j * phase))
    assert mac(a, b) == pytest.approx(1.0)


def test_mac_is_symmetric_below_one_and_zero_between_harmonics():
    a, b = shape(seed=1), shape(seed=2)
    assert 0 < mac(a, b) < 1
    assert mac(a, b) == pytest.approx(mac(b, a))
    assert mac(a, shape(n=3)) == 0.0


def test_mac_needs_the_same_nodes():
    other = HarmonicShape(2, NODES + 1, POINTS, shape().amplitude)
    with pytest.raises(ValueError, match="same nodes"):
        mac(shape(), other)


def columns(shapes):
    return np.array([each.displacement.ravel() for each in shapes]).T


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0, np.pi / 2])
def test_a_pair_spans_the_same_however_it_is_turned(turn):
    a, b = columns(pair(shape())), columns(pair(shape(), turn))
    assert squared_cosines(a, b) == pytest.approx([1.0, 1.0])
    assert squared_cosines(a[:, :1], b) == pytest.approx([1.0])
    assert squared_cosines(a[:, :1], b[:, :1]) == pytest.approx([np.cos(turn) ** 2], abs=1e-12)


def test_the_mac_of_two_pairs_is_that_of_their_harmonic_shapes():
    a, b = shape(seed=1), shape(seed=2)
    cosines = squared_cosines(columns(pair(a)), columns(pair(b, 0.7)))
    assert cosines == pytest.approx([mac(a, b)] * 2)


def test_dependent_and_zero_shapes_span_less():
    a = columns(pair(shape()))
    assert squared_cosines(a, a[:, [0, 0]]) == pytest.approx([1.0])
    assert len(squared_cosines(a, 0 * a)) == 0


def test_rings_stand_where_they_were_asked_for():
    ring = on_rings(shape(), NODES[[2, 0]], ANGLES[:3], 0.2)
    assert ring.points[:, 1] == pytest.approx(np.tile(ANGLES[:3], 2))
    assert ring.points[:3, [0, 2]] == pytest.approx(np.tile(POINTS[2], (3, 1)))
    expected = (shape().amplitude[0] * np.exp(1j * (2 * ANGLES[1] + 0.2))).real
    assert ring.displacement[4] == pytest.approx(expected)
    with pytest.raises(ValueError, match="no node 6"):
        on_rings(shape(), np.array([6]), ANGLES)
