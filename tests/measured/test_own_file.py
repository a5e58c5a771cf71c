"""A case whose targets stand in a file: read with it, judged with it, as if it were given."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.load import judged, load_case
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.blind.make import copy_case
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.fit.targets import read_targets, target_labels
from tyrecal.studies.sample.study import measured_readings, states_sampled
from tyrecal.tyre.case import CaseError
from tyrecal.tyre.case.shape import with_defaults
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import overridden

from ..conftest import CASES
from ..fit.test_fit_study import study

HEAD = "label,frequency_Hz,sigma_Hz,pressure_kPa,rim\n"
ROWS = [f'"[{c},0]",{50 + 15 * c},0.4,240,case\n' for c in (1, 2, 3)]
TEXT = (CASES / "p235_75r17.yaml").read_text()


def case_of(folder: Path, rows: list[str], more: str = "") -> Path:
    """A case beside its table of sections and of measurements."""
    shutil.copy(CASES / "p235_75r17.csv", folder)
    (folder / "measured.csv").write_text(HEAD + "".join(rows))
    start = TEXT.index("  source:", TEXT.index("\ntargets:"))
    end = TEXT.index("\n\n", start)
    path = folder / "own.yaml"
    path.write_text(f"{TEXT[:start]}  file: measured.csv\n{more}{TEXT[end:]}")
    return path


def test_what_a_file_holds_are_targets_each_in_its_state(tmp_path: Path) -> None:
    """The targets are those of --measured, also for commands that need the targets' labels or
    states."""
    rows = [*ROWS, '"[2,0]",70,0.4,160,free\n', '"[7,0]",190,1,240,\n']
    case = load_case(case_of(tmp_path, rows, "  source: our bench\n"))
    given, left_out = with_measured(load_case(CASES / "p235_75r17.yaml"), tmp_path / "measured.csv")
    assert case.case.targets.modes == given.case.targets.modes and not left_out
    assert case.case.targets.source == "our bench" and given.case.targets.source == "measured.csv"
    assert case.case.analysis.highest_harmonic == 7
    assert {t.state for t in read_targets(case)} == {TyreState(), TyreState(160.0, 0.0, "free")}
    assert len(target_labels(case)) == 4 and case.measured == tmp_path / "measured.csv"
    assert case.files[0] == case.measured
    assert judged(case.path) == (case, [])
    for values in ({"C10": 2e6}, {"rebar_layers.belt_1.angle_deg": 68}):  # a case like any other
        assert overridden(case, values).case.targets == case.case.targets
    assert with_defaults(case.file_data)["targets"]["file"] == "measured.csv"


@pytest.mark.parametrize(
    ("row", "line", "words"),
    [
        ('"[4,0]",110,0,240,\n', 5, "sigma is 0, must be greater than 0"),
        (
            '"[4,0]",110,0.4,2.4,\n',
            5,
            "the pressure is 2.4 kPa: usual is 20 to 2000 kPa; did you mean 2.4 bar, 240 kPa?",
        ),
        ('"[4,0]",110,0.4,240,springs\n', 5, "the rim has no springs in this case"),
        ('"[2,0]",81,0.4,240,case\n', 5, "measures the same as line 3"),
        ('"[4,0]",110\n', 5, "2 cells, the headings are 5"),
    ],
)
def test_mistakes_in_the_file_have_its_name_and_line(
    row: str, line: int, words: str, tmp_path: Path
) -> None:
    path = case_of(tmp_path, [*ROWS, row])
    loaded, (mistake,) = judged(path)
    assert loaded is None and words in mistake.message
    assert (mistake.file, mistake.line) == (str(tmp_path / "measured.csv"), line)
    with pytest.raises(CaseError, match=f"measured.csv, line {line}: ") as refused:
        load_case(path)
    assert refused.value.mistakes == [mistake]


def test_targets_that_no_fit_can_use_are_mistakes_of_the_case(tmp_path: Path) -> None:
    """Too few targets, or targets at one other pressure, are refused by a fit and ignored by
    other studies."""
    path = case_of(tmp_path, ROWS[:2])
    _, (mistake,) = judged(path)
    assert mistake.key == "targets" and "2 targets cannot determine 3" in mistake.message
    path = case_of(tmp_path, [row.replace("240", "200") for row in ROWS])
    _, (mistake,) = judged(path)
    assert "no target was measured at 240 kPa, only at 200 kPa" in mistake.message
    assert {t.state.pressure_kPa for t in read_targets(load_case(path))} == {200.0}
    (tmp_path / "measured.csv").write_text("")
    _, (mistake,) = judged(path)
    assert mistake.message == "the file is empty"


def test_values_stay_on_the_rim_and_at_the_pressure_of_the_case_file(tmp_path: Path) -> None:
    case = load_case(case_of(tmp_path, ROWS))
    for values in ({"rim.free": True}, {"pressure_kPa": 200}):
        with pytest.raises(InputError, match=r"measured.csv: no target was measured at 2"):
            study(overridden(case, values))
    free = overridden(case, {"rim.free": True})
    assert {each.rim for each in measured_readings(free) or ()} == {"fixed"}
    assert states_sampled(free, measured_readings(free))["rim"] == ["free", "fixed"]
    given = measured_readings(free, CASES / "p235_75r17_wheeler.csv")  # as its user has set it
    assert {each.rim for each in given or ()} == {None}


def test_a_fit_takes_the_file_and_its_frequencies_without_labels(tmp_path: Path) -> None:
    case = load_case(case_of(tmp_path, [*ROWS, ",66,0.4,240,case\n"]))
    assert len(case.case.targets.modes) == 3 and judged(case.path) == (case, [])
    own = study(case)
    assert own.needs_labels and own.measured == case.measured and len(own.readings) == 4
    other = study(case, measured=CASES / "p235_75r17_wheeler.csv")
    assert len(other.case.case.targets.modes) == 9


def test_results_state_the_file(tmp_path: Path) -> None:
    case = load_case(case_of(tmp_path, ROWS))
    block = FitStudy(case, Evaluator(TyreDesign(case))).provenance
    assert block["targets"] == "measured.csv" and len(block["measured_sha256"]) == 64


def test_a_blind_trials_case_has_its_file_with_it(tmp_path: Path) -> None:
    case = load_case(case_of(tmp_path, ROWS))
    (tmp_path / "trials").mkdir()
    copy_case(case, tmp_path / "trials")
    again = load_case(tmp_path / "trials/case/own.yaml")
    assert again.case == case.case and json.dumps(again.file_data) == json.dumps(case.file_data)
