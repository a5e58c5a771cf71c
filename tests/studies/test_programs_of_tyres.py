"""Programs of studies on the mechanics of tyres, on coarse meshes.

Belts as the study of stability turns them.
A truck whose cords bear no compression: one tyre, whatever the mesh.
Bounds of a stuck patch, on the coarse mesh.
Waves and elements round the tyre under a load are fine enough.
FEniCSx, where Debian's Python has it, finds the bundled solver's modes on a coarse mesh.
Computations of the comparison of footprints with CalculiX.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from ..solvers.press_deck import Angles, press_texts
from ..solvers.test_press_deck import coarse_case
from . import sizes_calculix, wrinkles
from .belts import COMMANDS, counts, failures, with_belts
from .calculix import ROOT
from .fenics import on_common
from .footprint_calculix import extrapolated
from .judge import PYTHON
from .loaded_mesh import frequencies
from .stuck_patch import CASE, Compliance, table
from .tread_gap import area_of_gap, serendipity, tread_faces
from .wrinkles import by_size, finer, with_compression


@pytest.mark.parametrize("size", ["205/55R16", "11R22.5"])
def test_working_belts_are_turned_to_their_own_sides(size: str) -> None:
    """24 degrees from the circumference; the carcass, cap plies and a truck's steep belt stay."""
    case = by_size(size)
    own, turned = case.case.rebar_layers, with_belts(case, 24.0, 200.0).case.rebar_layers
    angles = {name: layer.angle_deg for name, layer in turned.items()}
    working = [name for name in own if name.startswith("belt") and own[name].angle_deg != 50]
    assert len(working) == (3 if size == "11R22.5" else 2)
    for name, layer in own.items():
        kept = layer.angle_deg
        new = (66.0 if kept < 90 else 114.0) if name in working else kept
        assert angles[name] == pytest.approx(new)


def test_a_tyre_on_calculix_has_deviations_or_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """The case goes to the comparison with static moduli; a failed run gives its words."""

    def compare(case: LoadedCase, _: None) -> list[SimpleNamespace]:
        assert case.case.analysis.vibration_frequency_Hz is None
        if case.case.pressure_kPa > 500:
            raise EvaluationFailed("unstable", "carcass in crown")
        return [SimpleNamespace(common=0.25), SimpleNamespace(common=-0.5)]

    monkeypatch.setattr(sizes_calculix.calculix, "compare", compare)
    assert sizes_calculix.outcome("205/60R15") == "0.250 -0.500"
    assert sizes_calculix.outcome("11R22.5") == "unstable: carcass in crown"


@pytest.mark.slow
@pytest.mark.parametrize("bears", [True, False])
def test_the_three_commands_agree(bears: bool) -> None:
    """A carcass that bears compression buckles under belts at 24 degrees; slack cords do not."""
    case = with_compression(with_level(by_size("205/55R16"), "coarse"), bears)
    line = failures(with_belts(case, 24.0, 250.0), 300.0, False)
    assert {line[name].split(":")[0] for name in COMMANDS} == {"unstable" if bears else ""}
    assert counts([line]) == f"1 tyres, {int(not bears)} computed, the commands agree about 1"


@pytest.mark.slow
@pytest.mark.parametrize("holds", ["whole_bead", "bead_surface"])
def test_its_modes_do_not_hang_on_the_mesh_at_the_bead(holds: str) -> None:
    """Frequencies stay within 1 % with twice the elements and rows. If cords bear compression,
    [0,0] axial of a bead whose surface is held falls by more than 5 %."""
    case = by_size("11R22.5")
    case = changed(case, rim=with_part(case.case.rim, holds=holds))
    moved = {}
    for bears in (False, True) if holds == "bead_surface" else (False,):
        tyre = with_compression(case, bears)
        coarse, fine = (wrinkles.frequencies(each, 500.0) for each in (tyre, finer(tyre, 2, 2)))
        moved[bears] = {label: fine[label] / coarse[label] - 1 for label in coarse if label in fine}
    assert len(moved[False]) >= 9
    assert max(map(abs, moved[False].values())) < 0.01
    if holds == "bead_surface":
        assert moved[True][0, 0, "axial"] < -0.05


def test_compliance_of_a_single_mode() -> None:
    """The compliance of a known mode is 1 / (lambda - omega^2) at any frequency; without the
    mode it is right to third order in omega^2 / lambda."""
    static, inertia = np.array([[1 / 4.0]]), np.array([[1 / 16.0]])
    known = Compliance(static, inertia, np.array([4.0]), np.ones((1, 1)))
    unknown = Compliance(static, inertia, np.zeros(0), np.zeros((1, 0)))
    for value in (0.4, 3.0, 9.0):
        assert known.of(value)[0, 0] == pytest.approx(1 / (4 - value), rel=1e-12)
    for value in (0.4, 0.2):
        off = unknown.of(value)[0, 0] * (4 - value) - 1
        assert off == pytest.approx(-((value / 4) ** 2), rel=1e-9)


@pytest.mark.slow
def test_bounds_rise_with_the_load() -> None:
    """The free frequency below the lower bound, that below the upper; a larger patch holds more."""
    bounds = table([100.0, 1000.0], with_level(load_case(CASE), "coarse"))
    for label, (free, lower, upper) in bounds[100.0].items():
        assert free < lower < upper
        assert lower < bounds[1000.0][label][1] and upper < bounds[1000.0][label][2]


@pytest.mark.slow
def test_finer_round_the_tyre_moves_no_mode() -> None:
    """Every mode at 4 kN, of a patch that sticks and of one that slides, within 3e-4 of the same
    mesh near the patch with shorter elements and more waves beyond."""
    case = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    own, finer = (frequencies(case, [4000.0], name) for name in ("", "far"))
    assert len(own) == 16 and own.keys() == finer.keys()
    for member, both in own.items():
        assert both == pytest.approx(finer[member], rel=3e-4), member


def installed() -> bool:
    """Debian's Python can import FEniCSx."""
    try:
        return not subprocess.run([PYTHON, "-c", "import dolfinx"], capture_output=True).returncode
    except FileNotFoundError:
        return False


@pytest.mark.slow
def test_the_same_modes(tmp_path: Path) -> None:
    """Nine modes to 1e-8, the mass to 1e-11, the inflated states to a nanometre."""
    if not installed():
        pytest.skip("FEniCSx is not installed here (apt-get install python3-dolfinx)")
    case = with_level(load_case(ROOT / "cases" / "p235_75r17.yaml"), "coarse")
    solved = on_common(case, tmp_path)
    assert len(solved.ours) == 9
    for label, mode in solved.ours.items():
        assert mode.frequency_Hz == pytest.approx(solved.theirs[label].frequency_Hz, rel=1e-8)
        assert solved.mac(label) > 1 - 1e-6
    assert solved.apart_m < 1e-9
    assert solved.mass_kg[0] == pytest.approx(solved.mass_kg[1], rel=1e-11)


HALF = Angles(8.0, 24.0, 20.0, 1.5)


@pytest.mark.parametrize("step", [0.010, 0.005])
def test_the_gap_tells_the_edge(step: float) -> None:
    """An ellipse of 0.09 by 0.05 m, beside which the gap opens as distance^(3/2)."""
    a, b = 0.09, 0.05
    along, across = np.meshgrid(np.arange(0, 0.15, step), np.arange(0, 0.09, step), indexing="ij")
    outside = b * (np.hypot(along / a, across / b) - 1)
    over = np.where(outside <= 0, 3e-5, -(np.maximum(outside, 0) ** 1.5))
    assert area_of_gap(along, across, over) == pytest.approx(np.pi * a * b, rel=0.02)


def test_extrapolation_finds_the_limit_of_its_own_law() -> None:
    sizes = [8.0, 6.0, 4.0]
    assert extrapolated(sizes, [5 + 0.1 * h**2 for h in sizes]) == pytest.approx((5.0, 0.0))
    assert extrapolated([8.0, 6.0], [5 + 6.4, 5 + 3.6]) == pytest.approx((5.0, 3.6))


def test_functions_of_a_face() -> None:
    """The functions are one at their own node; they and their derivatives carry a linear field."""
    a = np.array([-1.0, 1, 1, -1, 0, 1, 0, -1])
    b = np.array([-1.0, -1, 1, 1, -1, 0, 1, 0])
    N, _, _ = serendipity(a, b)
    assert pytest.approx(np.eye(8)) == N
    N, by_a, by_b = serendipity(np.array([0.3, -0.7]), np.array([0.2, 0.9]))
    field = 2 + 3 * a - 5 * b
    assert N @ field == pytest.approx([2.0 + 0.9 - 1.0, 2 - 2.1 - 4.5])
    assert by_a @ field == pytest.approx([3, 3]) and by_b @ field == pytest.approx([-5, -5])


@pytest.mark.parametrize("element", ["C3D8", "C3D20"])
def test_faces_lie_on_the_tread(element: str, tmp_path: Path) -> None:
    texts = press_texts(coarse_case(element), [0.01], HALF, 0.3925)
    (tmp_path / "wheel.inp").write_text(texts["wheel.inp"])
    faces = tread_faces(tmp_path)
    assert {len(face) for face in faces} == {8 if element == "C3D20" else 4}
    rows = re.findall(r"^(\d+), (\S+), (\S+), (\S+)$", texts["wheel.inp"], re.M)
    place = {int(n): np.array([float(v) for v in xyz]) for n, *xyz in rows}
    for face in faces:
        p = np.array([place[n] for n in face])
        normal = np.cross(p[1] - p[0], p[2] - p[1])
        outwards = p[:4].mean(0) * [1, 1, 0]
        assert normal @ outwards > 0.1 * np.linalg.norm(normal) * np.linalg.norm(outwards)
        if element == "C3D20":
            assert p[4:] == pytest.approx((p[:4] + np.roll(p[:4], -1, 0)) / 2, abs=2e-3)
