"""Places of sensors that distinguish a tyre's modes, and frequency shifts by the sensors' mass.

Candidates are the nodes of the tread at even angles. A sensor has a row phi for each direction that
it measures: the modes of the case there, scaled to the same mean square, a doublet as two columns.
The next sensor is the one that raises ln det(1 + Phi^T Phi) most, Phi being all rows so far. With
one direction each this is close to QR with column pivoting of Phi^T until its rank is reached (the
1 regularises it), and D-optimal design from there on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..simulate.modes.label import BELT, Mode
from .case_modes import CaseModes
from .labels import Labeller
from .modal import label_in_turn
from .sensors import MeasuredMode, Sensors

Array = np.ndarray

ANGLE_STEPS = 48  # candidates round the tyre
NEAR_HULL_m = 1e-3  # distance from the section's convex hull up to which a node is outside
DRAWN_TESTS = 100  # of `labelled_in_tests`
# standard deviations of noise over a mode's root mean square signal, and of a place, m
DRAWN_NOISE_SHARE, DRAWN_OFF_m = 0.05, 0.002


def place_sensors(case: CaseModes, modes: Sequence[Mode], count: int, axes: str) -> Sensors:
    """``count`` sensors that distinguish modes of a case; axes: directions of each, such as rtz.

    Raises InputError for more sensors than places, and where no mode moves them.
    """
    places = tread_places(case.points)
    if count > len(places):
        raise InputError(f"the tread of this mesh has {len(places)} places, {count} are too many")
    sensors = at_places(places, axes)
    seen = [mode for mode in modes if case.is_seen(mode, sensors)]
    if not seen:
        names = ", ".join(str(mode.label) for mode in modes)
        raise InputError(
            f"sensors along {axes} see none of {names}: give --axes rtz, or more modes"
        )
    Phi = np.hstack([case.signals(mode, sensors) for mode in seen])
    Phi /= np.sqrt(np.mean(Phi**2, axis=0))
    blocks = Phi.reshape(len(places), len(axes), -1)
    # (1 + Phi^T Phi)^-1 of the sensors chosen, by Woodbury's identity
    inverse, chosen = np.eye(Phi.shape[1]), list[int]()
    while len(chosen) < count:
        images = blocks @ inverse
        grams = np.eye(len(axes)) + images @ blocks.swapaxes(1, 2)
        gains = np.linalg.slogdet(grams)[1]
        gains[chosen] = 0.0
        best = int(np.argmax(gains))
        inverse = inverse - images[best].T @ np.linalg.solve(grams[best], images[best])
        chosen.append(best)
    return at_places(places[chosen], axes)


def tread_places(points: Array) -> Array:
    """Places R, Theta, Z (k, 3) on the tread of a section with nodes ``points`` (n, 2)."""
    from scipy.spatial import ConvexHull

    R, Z = points.T
    equations = ConvexHull(points).equations  # unit normals, and offsets
    is_outside = (points @ equations[:, :2].T + equations[:, 2]).max(1) > -NEAR_HULL_m
    # BELT: share of the largest radius from which a node counts as belt
    rows = np.flatnonzero(is_outside & (BELT * R.max() < R))
    angles = 2 * np.pi * np.arange(ANGLE_STEPS) / ANGLE_STEPS
    return np.array([[R[row], angle, Z[row]] for row in rows for angle in angles])


def at_places(places: Array, axes: str) -> Sensors:
    """Sensors at places (p, 3), p places, with a signal for each direction of ``axes`` in turn."""
    directions = np.eye(3)[["rtz".index(axis) for axis in axes]]
    return Sensors(np.repeat(places, len(axes), axis=0), np.tile(directions, (len(places), 1)))


def labelled_in_tests(
    case: CaseModes,
    modes: Sequence[Mode],
    sensors: Sensors,
    highest: int,
    random: np.random.Generator,
) -> Array:
    """Whether each mode gets its label without a case, (d, m), in d drawn tests, m modes.

    In a test a doublet is at any angle, noise has `DRAWN_NOISE_SHARE` and places are `DRAWN_OFF_m`
    off; highest: the largest c that labels can have.
    """
    labeller = Labeller(sensors, highest)
    is_right = []
    for _ in range(DRAWN_TESTS):
        measured = draw_test(case, modes, sensors, random)
        labels = label_in_turn([(each, labeller, "") for each in measured])
        by_frequency = {each.mode.frequency_Hz: each.judged.label for each in labels}
        is_right.append([by_frequency[mode.frequency_Hz] == mode.label for mode in modes])
    return np.array(is_right)


def draw_test(
    case: CaseModes, modes: Sequence[Mode], sensors: Sensors, random: np.random.Generator
) -> list[MeasuredMode]:
    """A drawn test: what the sensors measure of each mode."""
    count, radius = len(sensors.points), sensors.points[:, 0].max()
    off = DRAWN_OFF_m * random.standard_normal((count, 3)) / [1.0, radius, 1.0]
    there = Sensors(sensors.points + off, sensors.directions)
    measured = []
    for mode in modes:
        both = case.signals(mode, there)
        u = both @ random.standard_normal(both.shape[1])
        u += DRAWN_NOISE_SHARE * np.sqrt(np.mean(u**2)) * random.standard_normal(count)
        measured.append(MeasuredMode(mode.frequency_Hz, u))
    return measured


def mass_shifts(case: CaseModes, mode: Mode, places: Array, mass_kg: float) -> Array:
    """Relative changes of a mode's frequency by a mass at each place (p, 3), to first order: of
    both members of a doublet (2,), the larger fall first, or of one mode (1,). The case's shapes
    have a modal mass of 1 kg."""
    u = case.signals(mode, at_places(places, "rtz"))
    return np.asarray(-np.linalg.eigvalsh(mass_kg * u.T @ u)[::-1] / 2)
