"""The revolved tyre for ParaView: a mode, or the tyre pressed on the road."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np

from ..files import atomic_write
from ..simulate.evaluate.pressed import Footprint, Pressed
from ..simulate.modes.label import Mode
from ..tyre.section.mesh import SectionMesh
from .revolve import cartesian, motion, swept

MAX_ANGLE = np.radians(5.0)  # between rings of points of the pressed tyre


def write_vtu(path: Path, mode: Mode, mesh: SectionMesh, sectors: int = 60) -> None:
    """Write the tyre as linear hexahedra (corner nodes only) with the mode's displacement.

    The axle is y: a point (R, Theta, Z) stands at (R cos Theta, Z, -R sin Theta), which keeps the
    system right-handed and is where ABAQUS revolves the deck's section to. Points in m, ring
    after ring of ``sectors`` points; point data in x, y, z as the solver scaled them (the bundled
    one: unit modal mass, 1/sqrt(kg)): ``mode`` and, of a pair, ``second_of_pair``, a quarter of a
    wave further. Raises InputError; OSError.
    """
    nodes, quads = mesh.grid()
    angles = 2 * np.pi * np.arange(sectors) / sectors
    fields = {"mode": motion(mode.raw, nodes, angles)}
    if mode.label.c:
        fields["second_of_pair"] = motion(mode.raw, nodes, angles, np.pi / 2)
    _write(path, quads, swept(nodes, mesh, angles), fields)


def write_pressed(
    folder: Path, designs: Mapping[str, Pressed], meshes: Mapping[str, SectionMesh]
) -> None:
    """footprint_DESIGN_LOADN.vtu of every design and load. Raises OSError."""
    for name, pressed in designs.items():
        for footprint in pressed.footprints:
            path = folder / f"footprint_{name}_{footprint.load_N:g}N.vtu"
            write_pressed_vtu(path, pressed, footprint, meshes[name])


def write_pressed_vtu(
    path: Path, pressed: Pressed, footprint: Footprint, mesh: SectionMesh
) -> None:
    """Write the deformed tyre at a load, in the axes of `write_vtu`, the road square to +x.

    Points in m, deformed; point data ``displacement`` in m, in x, y, z, of inflation and load
    together, and ``contact_pressure`` in Pa, interpolated where rings are far apart. Raises
    OSError.
    """
    nodes, quads = mesh.grid()
    row = {int(node): i for i, node in enumerate(pressed.nodes)}
    field = np.zeros((len(pressed.angles), len(row), 4))
    field[..., :3] = footprint.displacement
    field[footprint.ring, [row[int(n)] for n in footprint.node], 3] = footprint.pressure_Pa
    angles, field = _refined(pressed.angles, field[:, [row[int(n)] for n in nodes]])
    place = np.stack(np.broadcast_arrays(0.0, angles, 0.0), -1)
    u = cartesian(place, np.moveaxis(field[..., :3], 0, 1))
    fields = {"displacement": u, "contact_pressure": field[..., 3].T}
    _write(path, quads, swept(nodes, mesh, angles) + u, fields)


def _refined(angles: np.ndarray, field: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles, and a field (angle, ...) linear between them; no gap is above ``MAX_ANGLE``."""
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    parts = np.ceil(gaps / MAX_ANGLE - 1e-9).astype(int)
    ring = np.repeat(np.arange(len(angles)), parts)
    share = np.concatenate([np.arange(count) / count for count in parts])
    following = field[(ring + 1) % len(angles)]
    weight = share.reshape(-1, *[1] * (field.ndim - 1))
    return angles[ring] + share * gaps[ring], (1 - weight) * field[ring] + weight * following


def _write(
    path: Path, quads: np.ndarray, points: np.ndarray, fields: dict[str, np.ndarray]
) -> None:
    """Points and fields (node, angle, ...) on corner nodes swept round, elements between them."""
    flat = lambda field: np.float32(
        field.reshape(points.shape[0] * points.shape[1], *field.shape[2:])
    )
    tyre = meshio.Mesh(
        flat(points),
        [("hexahedron", np.int32(_hexahedra(quads, points.shape[1])))],
        point_data={name: flat(field) for name, field in fields.items()},
    )
    # single precision and no compression: smaller than double with it, in a twentieth of the time
    with atomic_write(path) as partial:
        tyre.write(partial, file_format="vtu", compression=None)


def _hexahedra(quads: np.ndarray, sectors: int) -> np.ndarray:
    """Corners (element, 8) of the elements (quad, 4) of a section swept round."""
    here = quads[:, None] * sectors + np.arange(sectors)[:, None]
    there = np.roll(here, -1, axis=1)
    # counter-clockwise in (r, z) looks against Theta, so the face with the larger one comes first
    return np.concatenate([there, here], -1).reshape(-1, 8)
