"""Mode shapes of the unloaded tyre as a universal file: `tyrecal export --format uff`.

The points are on the tyre's inflated outer surface. x is forward, y to the left along the axle, z
up, from the wheel's centre; points go round from the bottom, backwards. A pair has two shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from ..errors import InputError
from ..measured.universal_text import WrittenShape, line_set, shape_set, universal_text
from ..simulate.evaluate.results import Evaluation, HarmonicShape, RingShape
from ..simulate.modes.label import Mode
from ..simulate.modes.rings import on_rings
from ..studies.response import TREAD_SYSTEM
from ..tyre.case import LoadedCase
from ..tyre.resolve import resolved
from .revolve import placed

Array = np.ndarray
POINTS_AROUND, POINTS_PER_WAVE, POINTS_ACROSS = (
    36,
    4,
    17,
)  # points round the tyre, at least, and along its surface
NODES_OF_A_RING = 1000  # node 2003 is the third one of the second ring


def shapes_text(
    case: LoadedCase, evaluation: Evaluation, modes: Sequence[Mode], unit_mass: bool
) -> str:
    """Text of the file; unit_mass: whether the solver's shapes have a modal mass of 1 kg, else they
    have none. Raises InputError where a shape is not known on the tyre's surface."""
    if any(isinstance(mode.raw.shape, RingShape) for mode in modes):
        raise InputError("a universal file needs shapes on the section: take another solver")
    mesh = resolved(case).mesh
    moved, modes = placed(evaluation, modes, mesh)
    if not moved:
        raise InputError("the solver gives no shapes on the section's nodes")
    skin = mesh.skin()
    rows = skin[np.linspace(0, len(skin) - 1, min(POINTS_ACROSS, len(skin))).round().astype(int)]
    waves = max(mode.label.c for mode in modes)
    around = max(POINTS_AROUND, POINTS_PER_WAVE * waves)
    angles = 2 * pi * np.arange(around) / around
    numbers = [[NODES_OF_A_RING * (k + 1) + i + 1 for i in range(len(rows))] for k in range(around)]
    places, shapes = {}, []
    for node, own in zip(rows, np.transpose(numbers), strict=True):
        r, z = np.array(mesh.nodes[int(node)]) + moved[int(node)][[0, 2]]
        for number, angle in zip(own, angles, strict=True):
            places[int(number)] = TREAD_SYSTEM.place([r, np.degrees(angle), z]).tolist()
    lines = [[*own, own[0]] for own in np.transpose(numbers).tolist()] + numbers
    for mode in modes:
        shape = mode.raw.shape
        assert isinstance(shape, HarmonicShape)
        hertz = mode.raw.members or (mode.frequency_Hz,) * mode.multiplicity
        for member, own_Hz in enumerate(hertz):
            motion = on_rings(shape, rows, angles, member * pi / 2).displacement
            name = str(mode.label) + f" {member + 1}" * (len(hertz) > 1)
            damping = mode.raw.damping_ratio or 0.0
            vectors = _cartesian(motion.reshape(len(rows), around, 3), angles).reshape(-1, 3)
            shapes.append(WrittenShape(name, own_Hz, vectors, damping, float(unit_mass)))
    title = case.case.name
    sets = [line_set(k, nodes) for k, nodes in enumerate(lines, start=1)]
    sets += [shape_set(title, k, each, places) for k, each in enumerate(shapes, start=1)]
    return universal_text(title, places, sets)


def _cartesian(vectors: Array, angles: Array) -> Array:
    """Vectors (node, angle, 3) along r, theta, z at the angles, along x, y, z."""
    cos, sin, zero = np.cos(angles), np.sin(angles), 0 * angles
    turned = np.array([[cos, sin, zero], [-sin, cos, zero], [zero, zero, 1 + zero]])
    return np.einsum("nak,kja,jx->nax", vectors, turned, TREAD_SYSTEM.axes)
