"""Sections from size codes: twelve tyres have the sizes, masses and modes that they should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.bundled.section.shapes import quad
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.studies.modes import modes_result
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.new_case import from_size
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.section.from_size import build, construction, usual
from tyrecal.tyre.section.mesh import build_mesh
from tyrecal.tyre.section.section import Section, SectionError, fill_lines, read_section
from tyrecal.tyre.section.size import parse_size

TWELVE = [
    "145/80R13",
    "175/65R14",
    "195/65R15",
    "205/60R15",
    "205/55R16",
    "225/45R17",
    "255/40R17",
    "P235/75R17",
    "31x10.50R15LT",
    "LT315/70R17",
    "11R22.5",
    "315/80R22.5",
]
SIXTEEN = {
    (0, 0, "axial"),
    (0, 0, "torsional"),
    (1, 0, None),
    (1, 1, None),
    (2, 0, None),
    (2, 1, None),
    (3, 0, None),
    (3, 1, None),
    (4, 0, None),
}
# kg; the published 205/60R15 of the guide, the paper's tyre as weighed by its makers, and trucks'
MASSES = {"205/60R15": 9.3, "P235/75R17": 15.5, "11R22.5": 54.0, "315/80R22.5": 67.0}


CaseOf = Callable[[str], LoadedCase]


@cache
def built(code: str) -> Section:
    size = parse_size(code)
    return build(size, usual(size)).section()


@pytest.fixture(scope="module")
def case_of(tmp_path_factory: pytest.TempPathFactory) -> CaseOf:
    """The case of a size code, written and loaded once."""

    @cache
    def case(code: str) -> LoadedCase:
        folder = tmp_path_factory.mktemp("size")
        draft = from_size(parse_size(code), {}, None, "tyre")
        (folder / draft.file).write_bytes(draft.content)
        (folder / "tyre.yaml").write_text(draft.text)
        return load_case(folder / "tyre.yaml")

    return case


@pytest.mark.parametrize(
    "code",
    [
        "145/80R13",
        "205/60R15",
        pytest.param("255/40R17", marks=pytest.mark.slow),
        "P235/75R17",
        pytest.param("31x10.50R15LT", marks=pytest.mark.slow),
        pytest.param("11R22.5", marks=pytest.mark.slow),
        pytest.param("315/80R22.5", marks=pytest.mark.slow),
    ],
)
def test_the_size_code_gives_sixteen_modes(code: str, case_of: CaseOf) -> None:
    case = with_level(case_of(code), "coarse")
    values = start_values(case)
    evaluation = Evaluator(TyreDesign(case)).evaluate(Question(values))
    result, _ = modes_result(case, values, evaluation)
    modes = {(m.c, m.m, m.kind): m for m in result.modes}
    assert modes.keys() >= SIXTEEN
    assert sum(modes[label].multiplicity for label in SIXTEEN) == 16
    assert min(modes[label].clarity or 0.0 for label in SIXTEEN) > 0.5
    assert result.pressure_kPa == parse_size(code).pressure_kPa
    if code in MASSES:
        assert result.mass_kg == pytest.approx(MASSES[code], rel=0.1)
    # what the standards state are dimensions of the inflated tyre: the section grows little
    mesh = resolved(case).mesh
    nodes = [i for i, n in enumerate(evaluation.nodes.tolist()) if n in mesh.nodes]
    at = np.array([mesh.nodes[evaluation.nodes.tolist()[i]] for i in nodes])
    moved = at + np.asarray(evaluation.displacement)[nodes][:, [0, 2]]
    size = parse_size(code)
    assert 2 * moved[:, 0].max() == pytest.approx(size.overall_diameter, rel=0.005)
    width = size.section_width(usual(size).rim)
    assert np.ptp(moved[:, 1]) == pytest.approx(width, rel=0.016)


@pytest.mark.parametrize("code", [*TWELVE, "305/70R22.5", "315/70R22.5", "385/65R22.5"])
@pytest.mark.parametrize("level", ["coarse", "default", "refined"])
def test_every_mesh_that_is_written_unfolds(code: str, level: str, case_of: CaseOf) -> None:
    """Held by the rim, too, where the surface outside a carcass that turns upright runs short."""
    mesh = resolved(with_level(case_of(code), level)).mesh
    corners = np.array([[mesh.nodes[n] for n in nodes] for nodes in mesh.solids.values()])
    jacobian = np.einsum("gax,eai->gexi", quad(8, 3).dN, corners)
    assert (np.linalg.det(jacobian) > 0).all()


@pytest.mark.parametrize("quadratic", [True, False])
def test_the_surface_of_a_bead_is_its_outside_and_its_end(quadratic: bool) -> None:
    """Where the rim holds the whole bead it holds these, too."""
    section = built("205/60R15")
    mesh = lambda whole: build_mesh(section, [4, 1, 3, 2, 2, 2], [1] * 6, quadratic, None, whole)
    whole, surface = mesh(True), mesh(False)
    assert set(surface.rim) < set(whole.rim)
    columns = [n // 1000 for n in whole.nodes]
    ends = {n for n in whole.nodes if n // 1000 in (min(columns), max(columns))}
    assert set(surface.rim) == set(whole.rim) & (ends | set(whole.outer_nodes))


def test_mass_grows_with_the_tyre() -> None:
    masses = []
    for code in ("145/80R13", "205/55R16", "LT315/70R17", "315/80R22.5"):
        section = built(code)
        elements = [4] * len(section.regions)
        mesh = build_mesh(section, elements, [1] * (len(section.names) - 1), False)
        corners = np.array([[mesh.nodes[n] for n in nodes] for nodes in mesh.solids.values()])
        r, z = np.moveaxis(corners, 2, 0)
        area = (r * np.roll(z, -1, 1) - z * np.roll(r, -1, 1)).sum(1) / 2
        masses.append(1100 * 2 * np.pi * (abs(area) * r.mean(1)).sum())
    assert masses == sorted(masses)


@pytest.mark.parametrize("code", TWELVE)
def test_the_section_has_the_dimensions_of_its_code(code: str) -> None:
    size = parse_size(code)
    gauges = usual(size)
    section = built(code)
    outer = section.points[-1]
    assert 2 * outer[:, 0].max() == pytest.approx(size.overall_diameter, abs=1e-6)
    assert 2 * outer[:, 1].max() == pytest.approx(size.section_width(gauges.rim), abs=1e-5)
    held = section.points[1, section.rigid]
    assert held[0, 0] == pytest.approx(size.flange_radius(gauges.rim), abs=1e-6)
    outside = np.hypot(*(outer[section.rigid][0] - held[0]).T)
    seat = size.bead_seat_radius - np.tan(np.radians(15.0 * size.truck)) * outside
    assert seat < held[-1, 0] < seat + 5e-3
    # it touches the flange, between which the rim is as wide as it says
    assert 2 * outer[section.rigid][0, 1] == pytest.approx(gauges.rim, rel=0.01)


@pytest.mark.parametrize(
    ("code", "of_width"),
    [
        ("205/60R15", ((7, 0.027), (3, 0.01), (8, 0.02))),
        ("LT245/75R16", ((9.5, 0.03), (4.5, 0.015), (11, 0.02))),
        ("315/80R22.5", ((8, 0.06), (8, 0.02), (18, 0.04))),
    ],
)
def test_gauges_are_those_that_the_guide_states(
    code: str, of_width: tuple[tuple[float, float], ...]
) -> None:
    """Crown, sidewall and bead, mm, and shares of the nominal width."""
    size = parse_size(code)
    gauges = usual(size)
    stated = [1e-3 * mm + share * size.width for mm, share in of_width]
    assert [gauges.crown, gauges.sidewall, gauges.bead] == pytest.approx(stated)


@pytest.mark.parametrize("code", TWELVE)
def test_gauges_and_belts(code: str) -> None:
    size = parse_size(code)
    gauges = usual(size)
    section = built(code)
    thickness = np.hypot(*(section.points[-1] - section.points[0]).T)
    widest = int(np.argmax(section.points[1, :, 1]))
    rim = int(np.flatnonzero(section.rigid)[0])
    for station, gauge in ((0, gauges.crown), (widest, gauges.sidewall), (rim, gauges.bead)):
        assert thickness[station] == pytest.approx(gauge, abs=1e-6)
    lines = fill_lines(section)
    assert (np.hypot(*np.diff(lines, axis=0).T) > 0.2e-3).all()  # six rows or more
    carcass = section.points[1]
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(carcass, axis=0).T))])
    there = np.logical_and.accumulate(~np.isnan(section.points[..., 0]), axis=1)
    made = construction(size)
    for k, belt in enumerate(made.belts, start=2):
        width = belt.share * gauges.belt - belt.steps * gauges.step
        assert 2 * arc[there[k].sum() - 1] == pytest.approx(width, rel=1e-4)
    base = section.names.index("base")
    tread = np.hypot(*(lines[-1] - lines[base])[there[base]].T)
    assert 2 * arc[len(tread) - 1] == pytest.approx(gauges.belt, rel=1e-4) and (tread > 1e-3).all()


@pytest.mark.parametrize("code", TWELVE)
def test_the_carcass_is_turned_up_round_the_filler(code: str) -> None:
    """From the rim, where the filler is thickest, to its tip, where plies lie together; a car's
    turn-up goes on to the widest point."""
    section, gauges = built(code), usual(parse_size(code))
    made = construction(parse_size(code))
    apart = np.hypot(*(section.points[2] - section.points[1]).T)
    ends = np.cumsum([0, *(count for _, count in section.regions)])
    start = dict(zip((name for name, _ in section.regions), ends, strict=False))
    tip, rim = start["filler"], int(np.flatnonzero(section.rigid)[0])
    assert (np.diff(apart[tip : rim + 1]) > 0).all()
    assert apart[tip] == pytest.approx(gauges.ply, abs=1e-6)
    top = start["lower_sidewall"] if made.high else tip
    assert not np.isnan(apart[top:]).any() and np.isnan(apart[top - 1])
    if made.high:
        assert top == np.argmax(section.points[1, :, 1])


@pytest.mark.parametrize("code", ["205/60R15", "LT315/70R17"])
def test_the_carcass_bears_the_pressure_without_bending(code: str) -> None:
    """Its sidewall has the curvature of a net of meridional cords: kappa proportional to r."""
    size = parse_size(code)
    table = build(size, usual(size))
    place = {name: i for i, name in enumerate(table.labels)}
    wall = table.points[place["shoulder"] : place["upper_sidewall"] + 1]
    a, b, c = wall[:-2], wall[1:-1], wall[2:]
    sides = [np.hypot(*(p - q).T) for p, q in ((a, b), (b, c), (c, a))]
    (ax, ay), (bx, by) = (b - a).T, (c - b).T
    curvature = 2 * abs(ax * by - ay * bx) / np.prod(sides, axis=0)  # of the circle through three
    assert curvature / b[:, 0] == pytest.approx(np.mean(curvature / b[:, 0]), rel=0.01)


def test_both_halves_are_one_anothers_image() -> None:
    mesh = build_mesh(built("205/60R15"), [4, 1, 3, 2, 2, 1], [1] * 6, True)
    points = {(round(r, 9), round(z, 9)) for r, z in mesh.nodes.values()}
    assert points == {(r, -z) for r, z in points}


def test_the_table_read_again_gives_the_same_mesh(tmp_path: Path) -> None:
    size = parse_size("205/60R15")
    table = build(size, usual(size))
    (tmp_path / "s.csv").write_text(table.csv())
    section = read_section(tmp_path / "s.csv")
    assert section.regions == table.section().regions
    meshes = [build_mesh(s, [8, 1, 8, 5, 4, 2], [1] * 6, True) for s in (section, table.section())]
    assert meshes[0].solids == meshes[1].solids and meshes[0].cords == meshes[1].cords
    one, other = (np.array(list(mesh.nodes.values())) for mesh in meshes)
    assert one == pytest.approx(other, abs=3e-7)


@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    st.integers(13, 34).map(lambda n: 10 * n + 5),
    st.sampled_from([35, 40, 45, 50, 55, 60, 65, 70, 75, 80]),
    st.sampled_from([13, 15, 17, 19, 22]),
    st.floats(0.8, 1.2),
    st.floats(-0.5, 1.0),
)
def test_any_size_and_gauges_mesh_or_are_refused_in_words(
    width: int, aspect: int, rim: int, factor: float, wider: float
) -> None:
    size = parse_size(f"{width}/{aspect}R{rim}")
    gauges = usual(size, size.measuring_rim + wider * 0.0254)
    gauges = replace(gauges, crown=factor * gauges.crown, belt=gauges.belt / factor)
    try:
        section = build(size, gauges).section()
    except SectionError as error:
        assert "\n" not in str(error) and "mm" in str(error)
        return
    assert build_mesh(section, [8, 1, 6, 5, 4, 2], [1] * 6, True).solids
    outer = section.points[-1, :, 1]
    assert 2 * outer.max() == pytest.approx(size.section_width(gauges.rim), abs=1e-4)
