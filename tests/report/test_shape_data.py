"""Shapes kept for the page and for ParaView: the same motions, section and patches."""

from __future__ import annotations

import itertools
import json
from base64 import b64decode
from pathlib import Path

import meshio
import numpy as np
import pytest
from rich.console import Console

from tyrecal.errors import InputError
from tyrecal.measured.labels import Judged
from tyrecal.measured.modal import LabelledMode, ModalTest
from tyrecal.measured.sensors import MeasuredMode, Sensors
from tyrecal.report.html.modes import packed
from tyrecal.report.measured import measured_table
from tyrecal.report.revolve import motion, placed, swept
from tyrecal.report.shape_data import Shapes, patches_data, section_data, tyre_data
from tyrecal.report.vtu import write_vtu
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import evaluator as door_module
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode, RingShape
from tyrecal.simulate.modes.label import Label, Mode, paired_labels
from tyrecal.studies.footprint import patch_of, press
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.section.mesh import SectionMesh, build_mesh
from tyrecal.tyre.section.section import read_section

from ..chance import generator
from ..conftest import CASES
from ..studies.hertz import Hertz, coarse_case
from .html.toy import loaded_shapes

ANGLES = 2 * np.pi * np.arange(48) / 48


@pytest.fixture(scope="module")
def tyre(tmp_path_factory: pytest.TempPathFactory):
    case = load_case(coarse_case(tmp_path_factory.mktemp("case")))
    evaluation = Evaluator(TyreDesign(case)).evaluate(Question(start_values(case)))
    return case, evaluation, paired_labels(evaluation.modes)


def swept_again(content: dict, mode: dict) -> tuple[np.ndarray, np.ndarray]:
    """Points and displacement (node, angle, 3), as the page's script computes them from 16 bit."""
    data = packed(Shapes.model_validate(json.loads(json.dumps(content))))
    chosen = data["modes"][content["modes"].index(mode)]
    R, Z = whole(data["place"]).reshape(2, -1)
    real, imaginary = whole(chosen["shape"]).reshape(2, -1, 3)
    n, up = chosen["n"], np.stack([np.sin(ANGLES), 0 * ANGLES, np.cos(ANGLES)], -1)
    round_ = np.stack([np.cos(ANGLES), 0 * ANGLES, -np.sin(ANGLES)], -1)
    axle = np.array([0.0, 1.0, 0.0])
    cos, sin = np.cos(n * ANGLES)[:, None], np.sin(n * ANGLES)[:, None]
    r, t, z = np.moveaxis(real[:, None] * cos - imaginary[:, None] * sin, -1, 0)[..., None]
    return R[:, None, None] * up + Z[:, None, None] * axle, r * up + t * round_ + z * axle


def whole(text: str) -> np.ndarray:
    """Numbers of the page, from 16 bit."""
    return np.frombuffer(b64decode(text), "<i2") / 32767


def test_angles_of_a_loaded_tyre_are_parts_of_a_turn() -> None:
    shapes = Shapes.model_validate(loaded_shapes("toy"))
    angles = 2 * np.pi * whole(packed(shapes)["angle"])
    assert angles == pytest.approx(shapes.angles, abs=2e-4)


@pytest.mark.slow
def test_shapes_swept_again_are_the_modes(tyre) -> None:
    """Against the pictures' own sweep: alike but for scale, the turn of a pair and of the axes."""
    case, evaluation, modes = tyre
    content, mesh = tyre_data(case, evaluation, modes), resolved(case).mesh
    nodes = mesh.skin()
    # the pictures have Theta = 0 at +x, the page at the top
    turned = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    rest = swept(nodes, mesh, ANGLES) @ turned.T
    assert len(content["modes"]) == len(modes) > 8
    for mode, kept in zip(modes, content["modes"], strict=True):
        points, u = swept_again(content, kept)
        assert points * np.abs(rest).max() / np.abs(points).max() == pytest.approx(rest, abs=1e-4)
        pair = [motion(mode.raw, nodes, ANGLES, phase) @ turned.T for phase in (0.0, np.pi / 2)]
        basis = np.array([each.ravel() for each in (pair if mode.label.c else pair[:1])]).T
        part, *_ = np.linalg.lstsq(basis, u.ravel(), rcond=None)
        assert basis @ part == pytest.approx(u.ravel(), abs=1e-4), mode.label


def test_a_crest_stands_at_the_top(tyre) -> None:
    case, evaluation, modes = tyre
    for mode in tyre_data(case, evaluation, modes)["modes"]:
        A = np.array(mode["real"]) + 1j * np.array(mode["imaginary"])
        assert np.abs(A).max() == pytest.approx(1.0, abs=1e-5)
        if mode["c"]:  # r and z there are as large as anywhere round the tyre
            most = np.linalg.norm(np.abs(A[:, [0, 2]]), axis=0).max()
            assert np.linalg.norm(A.real[:, [0, 2]], axis=0).max() > 0.99 * most


def test_a_solver_with_nodes_of_its_own(tyre) -> None:
    """Other node numbers and another order change nothing; places too far away are not guessed."""
    case, evaluation, modes = tyre
    mesh = resolved(case).mesh
    order = generator(1).permutation(len(evaluation.nodes))
    other = type(evaluation)(
        evaluation.pressure_kPa,
        evaluation.mass_kg,
        evaluation.modes,
        {},
        np.arange(len(order)),
        evaluation.displacement[order],
    )

    def renumbered(mode: Mode, aside: float) -> Mode:
        s = mode.raw.shape
        assert isinstance(s, HarmonicShape)
        own = HarmonicShape(s.n, np.arange(len(order)), s.points[order] + aside, s.amplitude[order])
        raw = type(mode.raw)(mode.raw.frequency_Hz, own, mode.raw.multiplicity)
        return Mode(mode.label, mode.frequency_Hz, mode.multiplicity, 1.0, mode.position, raw)

    same = [renumbered(mode, 0.0) for mode in modes]
    assert tyre_data(case, other, same) == tyre_data(case, evaluation, modes)
    assert placed(other, [renumbered(mode, 5e-3) for mode in modes], mesh) == ({}, [])


def test_the_section_is_whole(tyre) -> None:
    """Areas of the polygons and of the outline agree (shoelace); cords stand once per layer."""
    case, *_ = tyre
    mesh = resolved(case).mesh
    section = section_data(case, mesh, {})

    def area(flat: list[float]) -> float:
        z, r = np.reshape(flat, (-1, 2)).T
        return 0.5 * float(abs(z @ np.roll(r, 1) - r @ np.roll(z, 1)))

    cells = [cell for cells in section.areas.values() for cell in cells]
    assert len(cells) == len(mesh.solids)
    assert sum(map(area, cells)) == pytest.approx(area(section.outline), rel=0.02)
    assert set(section.cords) == set(case.case.rebar_layers) and section.inflated is None


def test_patches_keep_all_that_touches(tyre, monkeypatch: pytest.MonkeyPatch) -> None:
    case, *_ = tyre
    monkeypatch.setattr(door_module, "find_solver", lambda name, *command: Hertz())
    monkeypatch.setattr(Hertz, "reach", 1e5)
    values, mesh = start_values(case), resolved(case).mesh
    loads = [1000.0, 4000.0, 65e3]  # the last up to where the rings of nodes stand far apart
    pressed = press(Evaluator(TyreDesign(case)), {"initial": values}, loads)["initial"]
    kept = patches_data("x", {"initial": pressed}, {"initial": mesh}).patches
    for footprint, patch in zip(pressed.footprints, kept, strict=True):
        there = patch_of(pressed, footprint, mesh)
        p = np.array(patch.pressure_kPa)
        assert (p > 0).sum() == (there.pressure > 0).sum() > 4
        assert 1e3 * p.sum() == pytest.approx(there.pressure.sum(), rel=1e-5)
        assert (p[[0, -1]] == 0).all() and (p[:, [0, -1]] == 0).all()
        assert p.size < there.pressure.size


def test_kept_data_is_small(tyre, tmp_path: Path) -> None:
    case, evaluation, modes = tyre
    assert len(json.dumps(tyre_data(case, evaluation, modes))) < 100_000


def run_of(name: str) -> ModalTest:
    """A test with one mode, [2,1] at 66.1 Hz."""
    sensors = Sensors(np.zeros((1, 3)), np.eye(3)[:1])
    label = Label(2, 1)
    judged = Judged(label, {label: 1.0}, f"like {label}")
    mode = MeasuredMode(66.1, np.ones(1), 0.02, 0.1)
    return ModalTest(name, (LabelledMode(mode, sensors, np.ones(1), 1.0, judged, "", "1"),))


@pytest.mark.parametrize("name", ["[run].uff", "[bold].uff", "run [2].uff"])
def test_names_are_no_markup(name: str) -> None:
    """File names and labels in square brackets stand there as they are."""
    console = Console(width=100)
    with console.capture() as text:
        console.print(measured_table([run_of(name)]))
    assert name in text.get() and "[2,1] member 1" in text.get() and "like [2,1]" in text.get()


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
