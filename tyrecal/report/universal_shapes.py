"""Mode shapes as a universal file: `tyrecal export --format uff`.

x is forward, y to the left along the axle, z up, from the wheel's centre; angles go round from the
bottom, backwards. A pair has two shapes. Shapes on the section are on points of the tyre's inflated
outer surface, those of solvers in three dimensions on the solver's points, and those under a load
on the tread's, where the load has put them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from math import pi

import numpy as np

from ..errors import InputError
from ..measured.universal_text import WrittenShape, line_set, shape_set, universal_text
from ..simulate.evaluate.results import Evaluation, HarmonicShape, RingShape
from ..simulate.modes.label import Mode
from ..simulate.modes.rings import on_rings
from ..studies.loaded import LoadedTyre
from ..studies.response import TREAD_SYSTEM
from ..tyre.case import LoadedCase
from ..tyre.resolve import resolved
from .revolve import placed

Array = np.ndarray
NamedShape = tuple[str, float, float | None, RingShape]  # name, Hz, damping ratio, shape
POINTS_AROUND, POINTS_PER_WAVE = 24, 6  # round the tyre, at least
POINTS_ACROSS = 11  # along the section's outer surface
MAX_LINE_NODES = 250  # of a data set 82, which draws a line
LINE_DIGITS = 5  # of the places, m and rad, by which points are on one line


def shapes_text(
    case: LoadedCase, evaluation: Evaluation, modes: Sequence[Mode], unit_mass: bool
) -> str:
    """Text of the file; unit_mass: whether the solver's harmonic shapes have a modal mass of 1 kg;
    others have 0, not known. Raises InputError where a shape is not on the section's nodes."""
    first = modes[0].raw.shape
    if isinstance(first, RingShape):
        shapes, points, unit_mass = _on_solvers_points(evaluation), first.points, False
    else:
        shapes, points = _on_surface(case, evaluation, modes)
    return _text(case.case.name, points, points * [1, 0, 1], shapes, unit_mass)


def loaded_shapes_text(case: LoadedCase, tyre: LoadedTyre, unit_mass: bool) -> str:
    """Text of the file, of the tyre at its last load; unit_mass: as in `shapes_text`."""
    last = tyre.loads[-1]
    assert last.surface is not None and tyre.angles is not None
    places = last.surface.reshape(-1, 3)
    angles = np.repeat(tyre.angles, last.surface.shape[1])
    rest = np.tile(last.surface[len(tyre.angles) // 2], (len(tyre.angles), 1))  # far from the road
    points = np.column_stack([rest[:, 0], angles, rest[:, 2]])
    shapes = [
        (str(mode.member), mode.frequency_Hz, None, RingShape(points, mode.shape.reshape(-1, 3)))
        for mode in last.modes
        if mode.shape is not None
    ]
    return _text(case.case.name, points, places, shapes, unit_mass)


def _text(
    title: str, points: Array, places: Array, shapes: Sequence[NamedShape], unit_mass: bool
) -> str:
    """Text of the file; points (p, 3): R, Theta, Z, by which lines are drawn; places (p, 3): along
    r, theta, z at these angles."""
    numbers = range(1, len(points) + 1)
    cos, sin = np.cos(points[:, 1]), np.sin(points[:, 1])

    def along_axes(vectors: Array) -> Array:
        r, theta, z = vectors.T  # then along r, theta, z at the angle 0
        turned = np.column_stack([r * cos - theta * sin, r * sin + theta * cos, z])
        return np.asarray(turned @ TREAD_SYSTEM.axes)

    sets = [line_set(k, line) for k, line in enumerate(_lines(points), start=1)]
    for k, (name, hertz, damping, shape) in enumerate(shapes, start=1):
        moved = along_axes(np.nan_to_num(shape.displacement))
        written = WrittenShape(name, hertz, moved, damping or 0.0, float(unit_mass))
        sets.append(shape_set(title, k, written, numbers))
    nodes = dict(zip(numbers, along_axes(places).tolist(), strict=True))
    return universal_text(title, nodes, sets)


def _on_solvers_points(evaluation: Evaluation) -> list[NamedShape]:
    """All modes of a solver in three dimensions, each of a pair on its own."""
    return [
        (f"mode {k}", mode.frequency_Hz, mode.damping_ratio, mode.shape)
        for k, mode in enumerate(evaluation.modes, start=1)
        if isinstance(mode.shape, RingShape)
    ]


def _on_surface(
    case: LoadedCase, evaluation: Evaluation, modes: Sequence[Mode]
) -> tuple[list[NamedShape], Array]:
    """All modes at points (p, 3) R, Theta, Z of the inflated surface. Raises InputError."""
    mesh = resolved(case).mesh
    moved, modes = placed(evaluation, modes, mesh)
    if not moved:
        raise InputError("the solver gives no shapes on the section's nodes")
    skin = mesh.skin()
    nodes = skin[np.linspace(0, len(skin) - 1, min(POINTS_ACROSS, len(skin))).round().astype(int)]
    around = max(POINTS_AROUND, POINTS_PER_WAVE * max(mode.label.c for mode in modes))
    angles = 2 * pi * np.arange(around) / around
    shapes: list[NamedShape] = []
    for mode in modes:
        assert isinstance(mode.raw.shape, HarmonicShape)
        hertz = mode.raw.members or (mode.frequency_Hz,) * mode.multiplicity
        for member, own_Hz in enumerate(hertz):
            name = str(mode.label) + f" {member + 1}" * (len(hertz) > 1)
            shape = on_rings(mode.raw.shape, nodes, angles, member * pi / 2)
            shapes.append((name, own_Hz, mode.raw.damping_ratio, shape))
    inflation = np.array([moved[int(node)] * [1, 0, 1] for node in nodes])
    return shapes, shapes[0][3].points + np.repeat(inflation, around, axis=0)


def _lines(points: Array) -> list[list[int]]:
    """Numbers of the points R, Theta, Z (p, 3) on circles, closed, and on meridians."""
    circles, meridians = defaultdict(list), defaultdict(list)
    for number, (r, theta, z) in enumerate(np.round(points, LINE_DIGITS), start=1):
        circles[r, z].append(number)
        meridians[theta].append(number)
    closed = [[*line, line[0]] for line in circles.values()]
    return [x for x in (*closed, *meridians.values()) if 2 < len(x) <= MAX_LINE_NODES]
