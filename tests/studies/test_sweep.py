"""Sweeps of a tyre in closed form: grids, samples, failures, findings; and one that is cut off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.pressure import State
from tyrecal.studies.pressure import sweep as sweep_pressure
from tyrecal.studies.result import StudyInput
from tyrecal.studies.sweep import SweptRange, grid, latin_hypercube, read_ranges
from tyrecal.studies.sweep_result import SweepResult, run
from tyrecal.tyre.case import start_values

from ..effects.support import coarse
from ..fit.fake import LABELS, FakeEvaluator

CASE = coarse()
START = {**start_values(CASE), "pressure_kPa": 240.0}
POWERS = {"C10": 0.2, "pressure_kPa": 0.3}
OTHERS = {name: np.zeros(len(LABELS)) for name in START if name not in POWERS}
C10, PRESSURE = SweptRange("C10", 8e5, 1.2e6, 3), SweptRange("pressure_kPa", 160.0, 320.0)


class ClosedForm(FakeEvaluator):
    """f = 50 (1 + i / 10) (C10 / 1e6)^0.2 (p / 240)^0.3 of the mode at place i of LABELS."""

    def __init__(self, **options: Any):
        base = {label: 50 * (1 + i / 10) for i, label in enumerate(LABELS)}
        powers = {name: np.full(len(LABELS), power) for name, power in POWERS.items()}
        super().__init__(base, powers | OTHERS, START, **options)


def given(**options: Any) -> StudyInput:
    """The study's start, without provenance, which needs a real solver."""
    start = StudyInput(CASE, ClosedForm(**options), {"initial": start_values(CASE)})  # type: ignore[arg-type]
    start.stamped = lambda result, **of: result  # type: ignore[method-assign,assignment]
    return start


def test_a_grid_has_every_combination_with_its_frequencies() -> None:
    result = run(given(), [C10, PRESSURE], sampled=False)
    points = [(row.values["C10"], row.values["pressure_kPa"]) for row in result.rows]
    assert points == [(c, p) for c in (8e5, 1e6, 1.2e6) for p in (160.0, 320.0)]
    for (c, p), row in zip(points, result.rows, strict=True):
        hertz = {mode.label: mode.frequency_Hz for mode in row.modes}
        factor = (c / START["C10"]) ** 0.2 * (p / 240) ** 0.3
        assert hertz == pytest.approx(
            {label: 50 * (1 + i / 10) * factor for i, label in enumerate(LABELS)}
        )
    mode = next(each for each in result.modes if each.label == Label(2, 0))
    spans = {"C10": 1.5**0.2 - 1, "pressure_kPa": 2**0.3 - 1}
    for name, ratio in spans.items():  # a span of the mean: (f_high - f_low) / f_mean
        assert mode.change_percent[name] == pytest.approx(200 * ratio / (2 + ratio), rel=0.01)
    assert 0.99 < mode.linear_share < 1
    assert "most by pressure_kPa: " in result.sentences()[2]
    assert len(result.csv().splitlines()) == 1 + 6 * len(LABELS)


def test_sweep_pressure_is_the_sweep_of_the_pressure() -> None:
    kPa = [160.0, 240.0, 320.0]
    states = sweep_pressure(CASE, ClosedForm(), {"initial": start_values(CASE)}, kPa)  # type: ignore[arg-type]
    rows = run(given(), [replace(PRESSURE, steps=3)], sampled=False).rows
    for state, row in zip(states, rows, strict=True):
        assert isinstance(state, State) and row.values == {"pressure_kPa": state.pressure_kPa}
        assert {m.label: m.frequency_Hz for m in row.modes} == state.frequencies


@pytest.mark.slow
def test_a_latin_hypercube_has_a_point_in_each_stratum_and_repeats_with_its_seed() -> None:
    points, discrepancy = latin_hypercube([C10, PRESSURE], 20, 3)
    for each in (C10, PRESSURE):
        shares = [(point[each.name] - each.low) / (each.high - each.low) for point in points]
        assert sorted(np.floor(20 * np.array(shares))) == list(range(20))
    result = run(given(), [C10, PRESSURE], True, 20, 3)
    assert [row.values for row in result.rows] == points
    assert (result.seed, result.discrepancy) == (3, discrepancy)
    assert "20 points, seed 3" in result.sentences()[0]


def test_points_that_fail_are_listed_and_the_others_kept() -> None:
    result = run(given(fails=lambda values: values["C10"] > 1.1e6), [C10, PRESSURE], False)
    assert len(result.rows) == 4 and len(result.failed) == 2
    assert result.failed[0].place == "initial, C10=1.2e+06, pressure_kPa=160"
    with pytest.raises(EvaluationFailed, match="inflation stopped"):
        run(given(fails=lambda values: True), [C10], False)


def test_too_few_points_state_no_change_by_a_number() -> None:
    """One value of C10 that is left of a grid, and two points of a sample of two numbers."""
    alone = run(given(fails=lambda values: values["C10"] < 1.1e6), [C10, PRESSURE], False)
    for result in (alone, run(given(), [C10, PRESSURE], True, 2)):
        assert {*map(str, (mode.change_percent for mode in result.modes))} == {"{}"}
        assert {mode.linear_share for mode in result.modes} == {None}
        assert result.sentences()[1] == "too few points to tell what each number changes"
        assert result.tables()[0].rows[0][-1] is None


def test_without_ranges_all_variables_are_sampled_within_10_percent() -> None:
    ranges = read_ranges(CASE, [], True)
    assert [each.name for each in ranges] == list(start_values(CASE))
    for each in ranges:
        ends = 0.9 * START[each.name], 1.1 * START[each.name]
        assert (each.low, each.high) == pytest.approx(ends)


@pytest.mark.parametrize(
    ("text", "sampled", "words"),
    [
        ("C10=8e5:1.2e6", False, "'C10=8e5:1.2e6' is no range: must be NAME=A:B:N, such as"),
        ("C10=8e5:1.2e6:5", True, "no range with a Latin hypercube: must be NAME=A:B, such"),
        ("C10=8e5:1.2e6:2.5", False, "must be NAME=A:B:N with numbers"),
        ("C10=1e6:1e6:2", False, "A must be less than B"),
        ("C10=8e5:1.2e6:1", False, "N at least 2"),
        ("C10=nan:1.2e6:2", False, "must be a finite number"),
        ("C11=8e5:1.2e6:2", False, "did you mean 'C10'"),
        ("C10=8e5:1e9:2", False, "C10=1e\\+09: usual is"),
        ("C10=-1e6:1e6:2", False, "C10=-1e\\+06: materials.rubber.C10_Pa must be greater"),
        ("C10=8e5:1.2e6:100001", False, "more than 100000"),
        ("rebar_layers.belt_1.area_m2=1e-7:2e-7:2", False, "set by the variable 'A_belt'"),
        ("mesh.level=1:2:2", False, "no number of the tyre"),
        ("analysis.static_increments=2:5:3", False, "=3.5: .*must be a whole number, got 3.5"),
        ("analysis.static_increments=2:5", True, "must be a whole number"),
    ],
)
def test_ranges_that_are_refused(text: str, sampled: bool, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_ranges(CASE, [text], sampled)


def test_a_number_has_one_range_and_unusual_ends_may_be_allowed() -> None:
    with pytest.raises(InputError, match="C10 has two ranges"):
        read_ranges(CASE, ["C10=8e5:1.2e6:2", "C10=8e5:1.3e6:2"], False)
    (swept,) = read_ranges(CASE, ["C10=8e5:1e9:2"], False, allow_unusual=True)
    assert grid([swept]) == [{"C10": 8e5}, {"C10": 1e9}]
    (spaced,) = read_ranges(CASE, ["C10 = 8e5 : 1.2e6"], True)  # names of a deck have blanks, too
    assert (spaced.name, spaced.high) == ("C10", 1.2e6)


@pytest.mark.slow
def test_a_sweep_that_was_cut_off_runs_no_point_twice(tmp_path: Path) -> None:
    """As `studies.kill` has it of 200 points, killed five times."""
    swept = [SweptRange("C10", 8e5, 1.2e6)]
    evaluator = Evaluator(TyreDesign(CASE), store=Store(tmp_path))
    start = StudyInput(CASE, evaluator, {"initial": start_values(CASE)})

    def cut_off(words: str, failure: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(start, swept, False, notify=cut_off)
    assert evaluator.counts.runs == 2  # the first point, and the tyre from which all inflate
    again = replace(start, evaluator=Evaluator(TyreDesign(CASE), store=Store(tmp_path)))
    result = run(again, swept, False)
    assert again.evaluator.counts.runs == 1 and len(result.rows) == 2


def test_a_variable_named_as_a_column_of_modes_has_a_column_of_its_own() -> None:
    result = run(given(), [C10, PRESSURE], sampled=False)
    swept = [
        x.model_copy(update={"name": x.name.replace("C10", "c")}) for x in result.numbers_swept
    ]
    rows = [
        x.model_copy(update={"values": {"c": x.values["C10"], "pressure_kPa": 1.0}})
        for x in result.rows
    ]
    text = result.model_copy(update={"numbers_swept": swept, "rows": rows}).csv()
    heads, *lines = (line.split(",") for line in text.splitlines())
    assert heads[:4] == ["variables.c", "pressure_kPa", "mass_kg", "c"]
    assert {float(line[0]) for line in lines} == {8e5, 1e6, 1.2e6}


def test_a_result_without_modes_is_refused() -> None:
    """So a damaged sweep.json is named by `tyrecal report`."""
    result = run(given(), [C10, PRESSURE], sampled=False)
    with pytest.raises(ValidationError, match="modes"):
        SweepResult.model_validate(result.model_dump() | {"modes": []})
