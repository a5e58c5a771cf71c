"""Damping ratios of measured modes: in a CSV, over repeats, as targets, next to fitted ones."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest

import tyrecal
from tyrecal.errors import InputError
from tyrecal.measured.measurement import CSV_COLUMNS, Measurement, measurements_csv
from tyrecal.measured.repeats import combined
from tyrecal.measured.tables import read_measurements
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.fit.targets import read_damping_targets
from tyrecal.studies.result import StudyInput
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.schema import TargetMode, Targets

from ..calibrated import calibrate
from ..fit.fake import LABELS, FakeEvaluator

CASE_FILE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
HEAD = ",".join(CSV_COLUMNS)
FREQUENCY = "frequency_Hz,1,0,,,240,0,58.5,0.5"


def measured(label: Label, hertz: float, damping: float = nan, **more: str) -> Measurement:
    return Measurement("frequency_Hz", label, more.pop("member", ""), 240.0, 0.0, hertz, 0.5,
                       damping_ratio=damping, **more)  # fmt: skip


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join([HEAD, *lines, ""]))
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
