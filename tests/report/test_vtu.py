"""Modes for ParaView, read back: motions whose Cartesian form is known."""

from __future__ import annotations

import itertools

import meshio
import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.report.vtu import write_vtu
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode, RingShape
from tyrecal.simulate.modes.label import Label, Mode
from tyrecal.tyre.section.mesh import SectionMesh, build_mesh
from tyrecal.tyre.section.section import read_section

from ..conftest import CASES

SECTION = read_section(CASES / "p235_75r17.csv")
SECTORS = 24


@pytest.fixture(scope="module", params=[False, True], ids=["linear", "quadratic"])
def mesh(request: pytest.FixtureRequest) -> SectionMesh:
    return build_mesh(SECTION, [4, 4, 4, 1], [1, 1, 1, 2], request.param)


def mode(mesh: SectionMesh, c: int, amplitude: np.ndarray) -> Mode:
    """A mode on the mesh and, like a solver's, on the rim's reference node."""
    nodes = np.array([*mesh.nodes, 900001])
    points = np.array([*mesh.nodes.values(), (0.0, 0.0)])
    amplitude = np.broadcast_to(amplitude, (len(mesh.nodes), 3))
    shape = HarmonicShape(c, nodes, points, np.vstack([amplitude, np.zeros(3)]).astype(complex))
    raw = RawMode(50.0, shape, 2 if c else 1)
    return Mode(Label(c, 0, None if c else "axial"), 50.0, raw.multiplicity, 1.0, 0, raw)


def written(path, mesh: SectionMesh, c: int, amplitude) -> meshio.Mesh:
    write_vtu(path / "mode.vtu", mode(mesh, c, np.asarray(amplitude)), mesh, SECTORS)
    return meshio.read(path / "mode.vtu")


def test_hexahedra_fill_the_tyre_and_none_is_inverted(tmp_path, mesh):
    result = written(tmp_path, mesh, 0, [0, 0, 1])
    along, rows = mesh.shape
    (block,) = result.cells
    assert block.type == "hexahedron"
    assert len(result.points) == (along + 1) * (rows + 1) * SECTORS
    assert len(block.data) == len(mesh.solids) * SECTORS
    corners = result.points[block.data]
    low, high = [0, 1, 2, 3], [4, 5, 6, 7]
    for face, other, turn in ((low, high, 1), (high, low, -1)):
        for k in range(4):
            here, after, before = face[k], face[(k + turn) % 4], face[(k - turn) % 4]
            edges = corners[:, [after, before, other[k]]] - corners[:, [here]]
            assert (np.linalg.det(edges) > 0).all()

    pappus = 0.0  # area times the centroid's chord round the axle
    for nodes in mesh.solids.values():
        r, z = np.array([mesh.nodes[n] for n in nodes[:4]]).T
        cross = r * np.roll(z, -1) - np.roll(r, -1) * z
        pappus += (cross * (r + np.roll(r, -1))).sum() / 6
    assert volume(corners) == pytest.approx(pappus * SECTORS * np.sin(2 * np.pi / SECTORS))


def volume(corners: np.ndarray) -> float:
    """Volume of hexahedra with plane faces: six tetrahedra each, all on the diagonal 0-6."""
    walk = [1, 2, 3, 7, 4, 5, 1]
    total = 0.0
    for a, b in itertools.pairwise(walk):
        edges = corners[:, [a, b, 6]] - corners[:, [0]]
        total += np.linalg.det(edges).sum() / 6
    return total


def test_axial_motion_is_along_y(tmp_path, mesh):
    result = written(tmp_path, mesh, 0, [0, 0, 2])
    assert list(result.point_data) == ["mode"]
    np.testing.assert_allclose(
        result.point_data["mode"], np.tile([0, 2, 0], (len(result.points), 1))
    )


def test_wind_up_turns_about_plus_y(tmp_path, mesh):
    amplitude = [(0, r, 0) for r, _ in mesh.nodes.values()]
    result = written(tmp_path, mesh, 0, amplitude)
    np.testing.assert_allclose(
        result.point_data["mode"], np.cross([0, 1, 0], result.points), atol=1e-12
    )


def test_a_pair_moves_along_x_and_a_quarter_turn_on_along_z(tmp_path, mesh):
    # u_r = cos Theta, u_theta = -sin Theta: the whole tyre moves by 1 along x
    result = written(tmp_path, mesh, 1, [1, 1j, 0])
    for name, direction in (("mode", [1, 0, 0]), ("second_of_pair", [0, 0, 1])):
        expected = np.tile(direction, (len(result.points), 1))
        np.testing.assert_allclose(result.point_data[name], expected, atol=1e-12)


def test_shapes_on_rings_are_refused(tmp_path, mesh):
    rings = RawMode(50.0, RingShape(np.ones((9, 3)), np.ones((9, 3))), 2)
    with pytest.raises(InputError, match="section"):
        write_vtu(tmp_path / "mode.vtu", Mode(Label(2, 0), 50.0, 2, 1.0, 0, rings), mesh)
