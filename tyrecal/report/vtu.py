"""A mode on the revolved tyre, for ParaView."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from ..files import whole
from ..modes.mode import Mode
from ..tyre.mesh import SectionMesh
from .revolve import corners, motion, swept


def write_vtu(path: Path, mode: Mode, mesh: SectionMesh, sectors: int = 60) -> None:
    """Write the tyre as linear hexahedra (corner nodes only) with the mode's displacement.

    The axle is y: a point (R, Theta, Z) stands at (R cos Theta, Z, -R sin Theta), which keeps the
    system right-handed and is where ABAQUS revolves the deck's section to. Points in m, ring
    after ring of ``sectors`` points; point data in x, y, z as the solver scaled them (the bundled
    one: unit modal mass, 1/sqrt(kg)): ``mode`` and, of a pair, ``second_of_pair``, a quarter of a
    wave further. Raises NoSectionShape; OSError.
    """
    grid = corners(mesh)
    nodes, angles = grid.ravel(), 2 * np.pi * np.arange(sectors) / sectors
    fields = {"mode": motion(mode.raw, nodes, angles)}
    if mode.label.c:
        fields["second_of_pair"] = motion(mode.raw, nodes, angles, np.pi / 2)
    tyre = meshio.Mesh(
        swept(nodes, mesh, angles).reshape(-1, 3),
        [("hexahedron", _hexahedra(grid.shape, sectors))],
        point_data={name: field.reshape(-1, 3) for name, field in fields.items()},
    )
    with whole(path) as partial:
        tyre.write(partial, file_format="vtu")


def _hexahedra(shape: tuple[int, int], sectors: int) -> np.ndarray:
    rings = np.arange(shape[0] * shape[1]).reshape(shape)
    quads = np.stack([rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]], -1)
    here = quads.reshape(-1, 1, 4) * sectors + np.arange(sectors)[:, None]
    there = np.roll(here, -1, axis=1)
    # counter-clockwise in (r, z) looks against Theta, so the face with the larger one comes first
    return np.concatenate([there, here], -1).reshape(-1, 8)
