"""Geometry of sensors: axle, centre, directions, and places that are not on the tyre."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.geometry import _axle, sensors_of
from tyrecal.measured.sensors import real_part

ANGLES = np.radians([3, 31, 65, 88, 124, 149, 187, 214, 246, 271, 303, 337])


def ring(radius: float = 0.35, half_width: float = 0.05, axle: int = 2, off: float = 0.0) -> dict:
    """Nodes round a tyre about the axle, whose middle is ``off`` from it."""
    x, y = (axle + 1) % 3, (axle + 2) % 3
    nodes = {}
    for k, angle in enumerate(ANGLES):
        place = np.zeros(3)
        place[[x, y]] = radius * np.cos(angle) + off, radius * np.sin(angle)
        place[axle] = half_width * (-1) ** k
        nodes[k + 1] = tuple(place)
    return nodes


SIGNALS = [(node, k) for node in range(1, 13) for k in (1, 2, 3)]


@pytest.mark.parametrize("axle", [0, 1, 2])
def test_the_axle_is_where_they_spread_least(axle: int) -> None:
    """Theta from the next axis in the order x, y, z, x; directions 1, 2, 3 along x, y, z are turned
    with it."""
    sensors = sensors_of(SIGNALS, ring(axle=axle))
    assert sensors.points[::3, 0] == pytest.approx(0.35)
    assert np.degrees(sensors.points[::3, 1]) % 360 == pytest.approx(np.degrees(ANGLES))
    assert sensors.points[::3, 2] == pytest.approx(0.05 * (-1) ** np.arange(12))
    x, y = (axle + 1) % 3, (axle + 2) % 3
    for k, angle in enumerate(ANGLES):
        three = sensors.directions[3 * k : 3 * k + 3]
        assert three[axle] == pytest.approx([0, 0, 1])
        assert three[x] == pytest.approx([np.cos(angle), -np.sin(angle), 0])
        assert three[y] == pytest.approx([np.sin(angle), np.cos(angle), 0])


def test_directions_may_be_the_sensors_own_and_turned_round() -> None:
    sensors = sensors_of([(1, 1), (1, -2), (1, 3)], ring(), cylindrical=True)
    assert sensors.directions.tolist() == [[1, 0, 0], [0, -1, 0], [0, 0, 1]]
    plain = sensors_of([(1, 1), (1, -1)], ring())
    assert plain.directions[1].tolist() == (-plain.directions[0]).tolist()


def test_places_as_wide_as_high_do_not_tell_the_axle() -> None:
    """A tyre is less than three quarters as wide as high."""
    assert _axle(np.array([[0.0, 0, 0], [1.0, 1.1, 0.74]])) == "z"
    with pytest.raises(InputError, match="give --axle"):
        _axle(np.array([[0.0, 0, 0], [1.0, 1.1, 0.76]]))
    assert sensors_of([(1, 1)], ring(0.3, 0.3), axle="z").points[0, 0] == pytest.approx(0.3)


@pytest.mark.parametrize(("radius", "tyre"), [(0.149, 0), (0.151, 1), (1.499, 1), (1.501, 0)])
def test_radii_are_a_tyres(radius: float, tyre: int) -> None:
    if tyre:
        assert len(sensors_of(SIGNALS, ring(radius)).points) == 36
    else:
        with pytest.raises(InputError, match="no tyre's"):
            sensors_of(SIGNALS, ring(radius))


@pytest.mark.parametrize(("off", "fine"), [(0.03, True), (0.04, False)])
def test_a_circle_stands_about_the_axle(off: float, fine: bool) -> None:
    """The circle is about the axle to a tenth of its radius; with a given centre it may be
    anywhere."""
    if fine:
        assert sensors_of(SIGNALS, ring(off=off))
    else:
        with pytest.raises(InputError, match=f"middle {off:g} m off the axle"):
            sensors_of(SIGNALS, ring(off=off))
    assert sensors_of(SIGNALS, ring(off=off), centre=(off, 0, 0)).points[:, 0] == pytest.approx(
        0.35
    )


def test_few_sensors_or_none_on_a_circle_do_not_tell_a_centre() -> None:
    """Three, a row, or places that lie on no circle within 6 %."""
    moved = ring(off=0.1)
    assert sensors_of([(1, 1), (5, 1), (9, 1)], moved)
    with pytest.raises(InputError, match="off the axle"):
        sensors_of([(1, 1), (4, 1), (7, 1), (10, 1)], moved)
    row = {k: (0.3, 0.02 * k, 0.01 * k) for k in range(1, 7)}
    assert sensors_of([(k, 1) for k in row], row, axle="z")
    for size, circle in ((0.05, True), (0.08, False)):
        nodes = {}
        for k, angle in enumerate(ANGLES):
            r = 0.35 * (1 + size * (-1) ** k)
            nodes[k + 1] = (r * np.cos(angle) + 0.1, r * np.sin(angle), 0.05 * (-1) ** (k // 2))
        if circle:
            with pytest.raises(InputError, match="off the axle"):
                sensors_of(SIGNALS, nodes)
        else:
            assert sensors_of(SIGNALS, nodes)


def test_a_node_without_a_place_is_named() -> None:
    with pytest.raises(InputError, match="node 13 has no coordinates"):
        sensors_of([(1, 1), (14, 1), (13, 1)], ring())


def test_a_shape_is_turned_to_be_real() -> None:
    """Collinearity 1 but for a factor, 0 in quadrature, (a^2 - b^2) / (a^2 + b^2) between."""
    u = np.array([1.0, -2.0, 0.5])
    for angle in (0.0, 0.4, 1.5):
        turned, collinear = real_part(u * np.exp(1j * angle))
        assert abs(turned) == pytest.approx(abs(u)) and collinear == pytest.approx(1.0)
    _, collinear = real_part(np.array([2.0, 1j]))
    assert collinear == pytest.approx(0.6)
    assert real_part(np.array([1.0, 1j]))[1] == pytest.approx(0.0)
    assert real_part(np.zeros(3))[1] == 0.0
