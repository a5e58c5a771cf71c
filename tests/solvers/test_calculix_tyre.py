"""Real runs of ccx 2.20 on a coarse tyre: beside the bundled solver, and decks that it rejects."""

from __future__ import annotations

from pathlib import Path

import pytest
from tyrecal_solvers.calculix.results import read_mass
from tyrecal_solvers.calculix.runner import run_job

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import label_modes
from tyrecal.studies.blind.outside import thick_cushion
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

from ..blind.laws import tread_density
from ..conftest import CASES
from ..studies.blind_calculix import common_problem
from ..studies.calculix import common


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
