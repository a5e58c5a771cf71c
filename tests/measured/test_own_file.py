"""Targets in a file of measurements, damping ratios too: read and judged as if given."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest

import tyrecal
from tyrecal.errors import InputError
from tyrecal.measured.load import judged, load_case
from tyrecal.measured.measurement import CSV_COLUMNS, Measurement, measurements_csv
from tyrecal.measured.repeats import combined
from tyrecal.measured.tables import read_measurements
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.make import copy_case
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.fit.targets import read_damping_targets, read_targets, target_labels
from tyrecal.studies.result import StudyInput
from tyrecal.studies.sample.study import measured_readings, states_sampled
from tyrecal.tyre.case import CaseError, start_values
from tyrecal.tyre.case.schema import TargetMode, Targets
from tyrecal.tyre.case.shape import with_defaults
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import overridden

from ..conftest import CASES
from ..fit.fake import LABELS, FakeEvaluator
from ..fit.test_fit_study import study
from ..solved import calibrate

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


CASE_FILE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"


DAMPING_HEAD = ",".join(CSV_COLUMNS)


FREQUENCY = "frequency_Hz,1,0,,,240,0,58.5,0.5"


def measured(label: Label, hertz: float, damping: float = nan, **more: str) -> Measurement:
    return Measurement("frequency_Hz", label, more.pop("member", ""), 240.0, 0.0, hertz, 0.5,
                       damping_ratio=damping, **more)  # fmt: skip


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join([DAMPING_HEAD, *lines, ""]))
    return path


def test_a_file_has_a_row_for_each_damping_ratio(tmp_path: Path) -> None:
    rows = [measured(Label(1, 0), 58.5, 0.049), measured(Label(2, 0), 79.5)]
    path = tmp_path / "m.csv"
    path.write_text(text := measurements_csv(rows))
    assert text.splitlines()[2] == "damping_ratio,1,0,,,240,0,0.049,0.0123"
    first, second = read_measurements(path)
    assert (first.value, first.damping_ratio) == (58.5, 0.049)
    assert second.damping_ratio != second.damping_ratio


def test_repeats_and_doublets_have_their_mean() -> None:
    label = Label(1, 0)
    runs = [measured(label, 58.4, 0.04, run="a"), measured(label, 58.6, 0.05, run="b")]
    assert combined(runs)[0].damping_ratio == pytest.approx(0.045)
    stated = [replace(each, damping_sigma=0.003 + 0.001 * i) for i, each in enumerate(runs)]
    assert combined(stated)[0].damping_sigma == pytest.approx(0.0025)  # of a mean of two
    pair = [measured(label, 58.0 + i, 0.04 + 0.02 * i, member=str(i + 1)) for i in (0, 1)]
    runs = [replace(each, run="a") for each in pair] + [measured(label, 58.5, nan, run="b")]
    assert combined(runs)[0].damping_ratio == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("damping_ratio,2,0,,,240,0,0.03,0.01", r"line 3: there is no frequency_Hz of \[2,0\]"),
        ("damping_ratio,1,0,,,200,0,0.03,0.01", "there is no frequency_Hz"),
        ("damping_ratio,,,,,240,0,0.03,0.01", "c is '', must be a whole number"),
        ("damping_ratio,1,0,,,240,0,3,0.5", "damping_ratio is 3: no tyre has that, usual is"),
        ("damping_ratio,1,0,,,240,0,0.03,0.05", "sigma is 0.05, more than"),
    ],
)
def test_rows_that_are_refused(tmp_path: Path, row: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_measurements(written(tmp_path / "m.csv", FREQUENCY, row))


@pytest.mark.slow
def test_a_fit_compares_damping(tmp_path: Path) -> None:
    """The fitted tyre's with the measured one's, in the table and in files."""
    path = written(tmp_path / "m.csv", FREQUENCY, "damping_ratio,1,0,,,240,0,0.049,0.012")
    case = tyrecal.load_case(CASE_FILE, mesh="coarse")
    rubber = case.case.materials["rubber"].model_copy(update={"loss_factor": 0.2})
    materials = {**case.case.materials, "rubber": rubber}
    lossy = replace(case, case=case.case.model_copy(update={"materials": materials}))
    targets, _ = with_measured(lossy, path)
    assert targets.case.targets.modes[0].damping_ratio == 0.049
    held = {name: value for name, value in start_values(case).items() if name != "C10"}
    given = StudyInput(lossy, Evaluator(TyreDesign(lossy)), {"initial": start_values(lossy)})
    result = FitResult.run(given, measured=path, fixed=held, method="gauss-newton")
    (mode,) = result.modes
    assert mode.target_damping_ratio == 0.049
    assert mode.damping_ratio == pytest.approx(0.0131, rel=0.1)
    assert mode.fitted_Hz == pytest.approx(58.5, rel=1e-3)
    heads = [column.name for column in result.tables()[0].columns]
    assert heads[-2:] == ["damping %", "target %"] and "damping_ratio" in result.csv()


def test_targets_of_damping_have_their_sigma(tmp_path: Path) -> None:
    """Stated in the file, else a quarter; targets only where a variable sets a loss factor."""
    more = "frequency_Hz,2,0,,,240,0,79.5,0.5", "damping_ratio,2,0,,,240,0,0.04,"
    path = written(tmp_path / "m.csv", FREQUENCY, "damping_ratio,1,0,,,240,0,0.05,0.005", *more)
    case, _ = with_measured(tyrecal.load_case(CASE_FILE, mesh="coarse"), path)
    assert [t.damping_sigma for t in case.case.targets.modes] == [0.005, None]
    assert read_damping_targets(case) == []
    loss = case.case.variables["C10"].model_copy(update={"sets": ["materials.rubber.loss_factor"]})
    case = replace(case, case=case.case.model_copy(update={"variables": {"loss": loss}}))
    targets = read_damping_targets(case)
    assert [(t.value, t.sigma) for t in targets] == [(0.05, 0.005), (0.04, 0.01)]
    assert {t.quantity for t in targets} == {"damping_ratio"}


class Lossy(FakeEvaluator):
    """Damping ratios that are half the loss factor, times a share that falls with C10."""

    def evaluate(self, question: Question) -> Evaluation:
        result = super().evaluate(question)
        share = 0.8 * (question.values["C10"] / self.start["C10"]) ** -0.3
        loss = question.values["loss"]
        modes = [
            replace(mode, damping_ratio=loss / 2 * share / (1 + i))
            for i, mode in enumerate(result.modes)
        ]
        return replace(result, modes=tuple(modes))


@pytest.mark.parametrize("method", ["gauss-newton", "slsqp"])
def test_a_fit_finds_the_loss_factor_of_a_tyre_in_closed_form(method: str) -> None:
    """With a modulus that moves frequencies and damping, from a tyre's own values."""
    case = tyrecal.load_case(CASE_FILE, mesh="coarse")
    variables = {"C10": case.case.variables["C10"]}
    variables["loss"] = variables["C10"].model_copy(
        update={
            "sets": ["materials.rubber.loss_factor"],
            **{"start": 0.1, "lower": 0.01, "upper": 1.0},
        }
    )
    powers = {"C10": np.linspace(0.1, 0.5, 9), "loss": np.zeros(9)}
    tyre = Lossy(
        dict(zip(LABELS, range(30, 120, 10), strict=True)), powers, {"C10": 1e6, "loss": 1}
    )
    truth = {"C10": 1.2e6, "loss": 0.25}
    targets = [
        TargetMode(
            c=mode.shape.n,
            m=label.m,
            kind=label.kind,
            frequency_Hz=mode.frequency_Hz,
            sigma_Hz=0.1,
            damping_ratio=mode.damping_ratio,
        )
        for label, mode in zip(LABELS, tyre.evaluate(Question(truth)).modes, strict=True)
        if label.m == 0 and label.c
    ]
    update = {"variables": variables, "targets": Targets(source="", modes=targets)}
    case = replace(case, case=case.case.model_copy(update=update))
    fit = calibrate(case, tyre, method)  # type: ignore[arg-type]
    assert dict(fit.fitted.values) == pytest.approx(truth, rel=1e-4)
    error = fit.found.variables["loss"].standard_error
    assert error == pytest.approx(0.25 * 0.25 / len(targets) ** 0.5, rel=0.05)
