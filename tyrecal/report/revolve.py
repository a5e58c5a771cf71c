"""The section swept round the axle: rings of points and how a mode moves them.

Cartesian axes: y is the axle, z points up, (R, Theta, Z) lies at (R cos Theta, Z, -R sin Theta).
The sign makes (r, theta, z) and (x, y, z) both right-handed: Theta turns about +y, as ABAQUS
revolves the section of the deck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..simulate.evaluate.results import Evaluation, HarmonicShape, RawMode
from ..simulate.modes.label import Mode
from ..simulate.modes.rings import on_rings
from ..tyre.section.mesh import SectionMesh

Array = np.ndarray
EQUAL_POINTS = 1e-9  # m
MAX_NODE_DISTANCE = 1e-3  # m, within which a node of another mesh stands for one of ours


def placed(
    evaluation: Evaluation, modes: Sequence[Mode], mesh: SectionMesh
) -> tuple[dict[int, Array], list[Mode]]:
    """Displacement by the inflation (r, theta, z in m) by number of the rubber's nodes, and the
    modes with shapes on these nodes; both are empty if the solver does not give them there.

    If a solver has other nodes or numbers, each node takes the values of the nearest one.
    """
    shapes = [mode.raw.shape for mode in modes]
    known = [shape for shape in shapes if isinstance(shape, HarmonicShape)]
    if not known or len(known) < len(shapes):
        return {}, []
    of_rubber = {n for element in mesh.solids.values() for n in element}
    own = {n: place for n, place in mesh.nodes.items() if n in of_rubber}
    nodes, places = np.array(list(own)), np.array(list(own.values()))
    there = known[0].points
    row_of = {number: row for row, number in enumerate(known[0].nodes.tolist())}
    rows = np.array([row_of.get(number, 0) for number in own])
    if abs(there[rows] - places).max() > EQUAL_POINTS:
        from scipy.spatial import KDTree  # late: a quarter of a second

        away, rows = KDTree(there).query(places)
        if away.max() > MAX_NODE_DISTANCE:
            return {}, []
    moved = dict(zip(own, evaluation.displacement[rows], strict=True))
    on_mesh = (HarmonicShape(s.n, nodes, places, s.amplitude[rows]) for s in known)
    return moved, [
        replace(mode, raw=replace(mode.raw, shape=shape))
        for mode, shape in zip(modes, on_mesh, strict=True)
    ]


def swept(nodes: Array, mesh: SectionMesh, angles: Array) -> Array:
    """Undeformed points (node, angle, 3) x, y, z in m of ``nodes`` at ``angles`` Theta, rad."""
    R, Z = np.array([mesh.nodes[int(n)] for n in nodes]).T
    points = np.stack(np.broadcast_arrays(R[:, None], angles, Z[:, None]), -1)
    return cartesian(points, points * [1, 0, 1])


def motion(mode: RawMode, nodes: Array, angles: Array, phase: float = 0.0) -> Array:
    """Displacement (node, angle, 3) in x, y, z: Re[amplitude exp(i (n Theta + phase))].

    amplitude: the mode's complex shape, whose scale is the solver's; n: its number of waves;
    angles, phase: rad. Raises InputError if the shape is not known on the section's nodes.
    """
    if not isinstance(mode.shape, HarmonicShape):
        raise InputError("only modes known on the section's nodes can be swept")
    rings = on_rings(mode.shape, nodes, angles, phase)
    return cartesian(rings.points, rings.displacement).reshape(len(nodes), len(angles), 3)


def cartesian(points: Array, vectors: Array) -> Array:
    """Vectors with components (r, theta, z) at points (R, Theta, Z), in x, y, z."""
    cos, sin = np.cos(points[..., 1]), np.sin(points[..., 1])
    r, theta, z = np.moveaxis(vectors, -1, 0)
    return np.stack([r * cos - theta * sin, z, -r * sin - theta * cos], -1)
