"""Real runs of ccx 2.20 on a coarse tyre: beside the bundled solver, and decks that it rejects.

Cords that bear no compression in CalculiX: a compressed one is refused by layer and region.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.calculix.results import Fields, read_mass
from tyrecal_solvers.calculix.runner import run_job
from tyrecal_solvers.calculix.slack import (
    STRIP_COMMENT,
    Strip,
    read_strips,
    refuse_slack,
    stretches,
)
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import label_modes
from tyrecal.studies.blind.maker import thick_cushion
from tyrecal.tyre.case import start_values
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.load import load_case

from ..blind.laws import tread_density
from ..conftest import CASES
from ..studies.blind_calculix import common_problem
from ..studies.calculix import common
from .test_calculix_files import main_case


def coarse_case(folder: Path) -> Path:
    """A small model of the paper's tyre: half the elements, two diameters."""
    text = (CASES / "p235_75r17.yaml").read_text()
    for old, new in (
        (
            "{crown: 8, upper_sidewall: 8, lower_sidewall: 8, bead: 2}",
            "{crown: 6, upper_sidewall: 6, lower_sidewall: 6, bead: 1}",
        ),
        ("rows: [1, 1, 1, 3]", "rows: [1, 1, 1, 1]"),
        ("grading: [1.0, 1.0, 1.0, 0.7]", "grading: null"),
        ("highest_harmonic: 4", "highest_harmonic: 1"),
        ("pressure_kPa: 240.0", "pressure_kPa: 100.0"),
        ("modes_per_harmonic: 2", "modes_per_harmonic: 2"),
    ):
        assert old in text
        text = text.replace(old, new)
    text = text[: text.index("targets:")] + text[text.index("solver:") :]
    path = folder / "p235_75r17.yaml"
    path.write_text(text)
    return path


@pytest.mark.ccx
def test_masses_agree_where_cord_lines_have_kinks(case_folder: Path) -> None:
    """Masses also agree if one rubber borders on another at a ply, to 1e-6 of the tyre's."""
    case = load_case(coarse_case(case_folder))
    case = tread_density(thick_cushion(case, 1.5), -0.2)
    with common():
        ours = Evaluator(TyreDesign(common_problem(case))).evaluate(Question({}))
    for name, text in Decks(TyreDesign(case)).texts("calculix").items():
        (case_folder / name).write_text(text)
    run_job(case_folder, "inflate", ["sector.inp"], ["ccx"], 60.0)
    mass_kg = 180 * read_mass(case_folder / "inflate.dat")
    assert mass_kg == pytest.approx(ours.mass_kg, rel=1e-6)


@pytest.mark.ccx
def test_calculix_agrees_with_the_bundled_solver(case_folder: Path) -> None:
    """The folder has a blank in its absolute path, to which ccx itself cannot write."""
    case = load_case(coarse_case(case_folder))
    values = start_values(case)
    ours = Evaluator(TyreDesign(case)).evaluate(Question(values))
    theirs = Evaluator(TyreDesign(case), "calculix", folder=case_folder / "runs").evaluate(
        Question(values)
    )
    assert theirs.mass_kg == pytest.approx(ours.mass_kg, rel=3e-3)
    assert abs(theirs.displacement).max() == pytest.approx(abs(ours.displacement).max(), rel=0.05)
    known = {mode.label: mode.frequency_Hz for mode in label_modes(ours.modes)}
    hertz = {mode.label: mode.frequency_Hz for mode in label_modes(theirs.modes)}
    assert hertz.keys() == known.keys()
    assert hertz == pytest.approx(known, rel=0.01)


@pytest.mark.ccx
@pytest.mark.parametrize(
    ("template", "old", "new", "cause"),
    [
        ("sector.inp.j2", "*TIE, NAME", "*NO_SUCH_KEYWORD, NAME", "crashed"),
        (
            "sector.inp.j2",
            "*SOLID SECTION, ELSET={{ solid.set }}, MATERIAL={{ solid.material }}",
            "*SOLID SECTION, ELSET={{ solid.set }}, MATERIAL=NO_SUCH",
            "crashed",
        ),
        ("sector.inp.j2", "{{ rubber.C10 | number }}", "nan", "crashed"),
        ("inflate.inp.j2", "PARAMETERS=FIELD", "PARAMETER=FIELD", "crashed"),
        ("diameter.inp.j2", "U\n*END STEP\n", "U\n", "no_results"),
    ],
)
def test_decks_that_ccx_rejects(
    case_folder: Path, template: str, old: str, new: str, cause: str
) -> None:
    from importlib.resources import files

    path = coarse_case(case_folder)
    text = path.read_text().replace("highest_harmonic: 1", "highest_harmonic: 0")
    path.write_text(text + "\ntemplates: own\n")
    (case_folder / "own").mkdir()
    text = (Path(str(files("tyrecal_templates") / "calculix")) / template).read_text()
    assert old in text
    (case_folder / "own" / template).write_text(text.replace(old, new))
    with pytest.raises(EvaluationFailed) as failure:
        Evaluator(TyreDesign(load_case(path)), "calculix").evaluate(Question({"pressure_kPa": 0.0}))
    assert failure.value.cause == cause


R, LENGTH, WALL = 0.3, 0.02, 2e-4
POINTS = np.array([[R + r, 0.0, z] for z in (0.0, LENGTH) for r in (-WALL / 2, WALL / 2)])


def cylinder(growth: float, along: float, twist: float) -> Fields:
    """A ply's element of a cylinder: hoop and axial strain, and a rotation about the axle that
    grows by ``twist`` (rad) over the length."""
    angle = twist * POINTS[:, 2] / LENGTH
    r = POINTS[:, 0] * (1 + growth)
    moved = np.stack([r * np.cos(angle), r * np.sin(angle), (1 + along) * POINTS[:, 2]], -1)
    return Fields(np.arange(1, 5), POINTS, [(0, "DISP", moved - POINTS)])


def strip(angle_deg: float, layer: str = "carcass") -> Strip:
    return Strip(layer, "crown", "textile", angle_deg, [[1, 2], [3, 4]])


@pytest.mark.parametrize("angle_deg", [0.0, 70.0, 90.0, 110.0])
def test_stretches_of_a_cylinder_in_closed_form(angle_deg: float) -> None:
    """lambda^2 = (lambda_z cos)^2 + (lambda_theta (sin + gamma cos))^2 with gamma = R twist / L, to
    the second order of the twist over one element."""
    growth, along, twist = 0.02, -0.01, 1e-3
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    wanted = np.hypot((1 + along) * c, (1 + growth) * (s + R * twist / LENGTH * c))
    got = stretches([strip(angle_deg)], cylinder(growth, along, twist))
    assert got == pytest.approx([wanted], abs=1e-6)


def test_a_compressed_cord_is_refused_by_layer_and_region(tmp_path: Path) -> None:
    """Taut cords, and cords without a comment in the deck, are not."""
    deck, plies = tmp_path / "sector.inp", [strip(0.0), strip(90.0, "cap_ply")]
    comments = [f"** no compression: {json.dumps(vars(each))}\n" for each in plies]
    deck.write_text("*NODE\n" + "".join(comments) + "*ELEMENT\n")
    assert read_strips(deck) == plies
    refuse_slack(plies, cylinder(0.01, 0.01, 0.0))
    words = r"carcass in crown by 1 %; .*materials.textile.bears_compression"
    with pytest.raises(RunFailed, match=words) as failure:
        refuse_slack(plies, cylinder(0.01, -0.01, 0.0))
    assert failure.value.cause == "unstable" and "cap_ply" not in str(failure.value)
    layers = ["belt_1", "belt_2", "carcass", "chafer"]
    with pytest.raises(RunFailed) as failure:
        refuse_slack([strip(0.0, name) for name in layers], cylinder(0.01, -0.01, 0.0))
    assert [name in str(failure.value) for name in layers] == [True, True, True, False]


def test_the_deck_says_which_cords_must_be_taut() -> None:
    """The deck lists all strips of the layer whose material bears no compression, each between
    ends as far apart as a carcass' elements are long, and no others. ABAQUS has its keyword."""
    case = main_case()
    assert not STRIP_COMMENT.findall(Decks(TyreDesign(case)).texts("calculix")["sector.inp"])
    cord = with_part(case.case.materials["carcass_cord"], bears_compression=False)
    case = changed(case, materials={**case.case.materials, "carcass_cord": cord})
    decks = Decks(TyreDesign(case))
    text = decks.texts("calculix")["sector.inp"]
    strips = [Strip(**json.loads(comment)) for comment in STRIP_COMMENT.findall(text)]
    assert len(strips) == text.count("*MATERIAL, NAME=CARCASS_")
    assert {each.layer for each in strips} == {"carcass"}
    assert {each.region for each in strips} == {name for name, _ in case.section.regions}
    nodes = text.partition("*NODE, NSET=TYRE\n")[2].partition("*")[0].splitlines()
    place = {int(n): np.array([float(v) for v in xyz]) for n, *xyz in (r.split(",") for r in nodes)}
    for each in strips:
        pairs = np.array([[place[n] for n in pair] for pair in each.ends])
        assert np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) == pytest.approx(WALL, rel=0.1)
        assert np.linalg.norm(pairs.mean(1)[1] - pairs.mean(1)[0]) > 10 * WALL
    assert decks.texts("abaqus")["inflate.inp"].count("*NO COMPRESSION") == 1
