"""A fit as all callers make it: targets stay in the state that they were measured in;
and its result: what happened, what moved, which bounds hold, the state it was fitted in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.targets import in_set_state
from tyrecal.studies.fit.build_result import StartReport, fit_result
from tyrecal.studies.fit.calibrate import history_csv
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.fit.targets import read_targets
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.schema import TargetFootprint, TargetMode, Variable
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import overridden

from ..solved import calibrate
from .fake import CASE as FAKE_CASE
from .fake import LABELS, POWERS, START, START_X, TARGETS, FakeEvaluator, evaluator
from .fake import TRUTH as FAKE_TRUTH
from .tyre_in_states import CASE, TRUTH, TyreInStates, case_with, measured

OWN, SOFT, FREE = TyreState(), TyreState(160.0), TyreState(None, 0.0, "free")
AREA = TargetFootprint(load_N=4000, contact_area_m2=0.016, sigma_m2=1e-4)


class Tyre(TyreInStates):
    """Toy tyre with an evaluator's way to other designs of the same tyre."""

    def of(self, design: Any) -> Tyre:
        return self


def study(case: LoadedCase, **given: Any) -> FitStudy:
    tyre: Any = Tyre()
    return FitStudy(case, tyre, **given)


def states(case: LoadedCase) -> set[TyreState]:
    return {target.state for target in read_targets(case)}


def with_pressure_variable(modes: list[TargetMode], start: float = 240.0) -> LoadedCase:
    case = case_with(modes)
    P = Variable(sets=["pressure_kPa"], start=start, lower=100.0, upper=400.0)
    variables = {**case.case.variables, "P": P}
    return replace(case, case=case.case.model_copy(update={"variables": variables}))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"pressure_kPa": 200}, "at 200 kPa, only at 240 kPa: set pressure_kPa=240, or give meas"),
        (
            {"rim.free": True},
            "at 240 kPa with the rim free, only at 240 kPa with the rim fixed: set rim.free=false",
        ),
        ({"effects.wheel_free": 0.05}, "at 240 kPa with the rim free, only at 240 kPa with the"),
        (
            {"rim.free": True, "pressure_kPa": 160},
            "set pressure_kPa=240 and rim.free=false, or give measurements at 160 kPa with the rim",
        ),
    ],
)
def test_a_fit_in_a_state_without_targets_is_refused(
    values: Mapping[str, float], words: str
) -> None:
    """The refusal states which states have targets, and what to do. No design is evaluated."""
    case = overridden(case_with(measured([OWN])), values)
    with pytest.raises(InputError) as refused:
        study(case)
    assert words in str(refused.value) and "\n" not in str(refused.value)
    assert "p235_75r17.yaml: no target was measured" in str(refused.value)


@pytest.mark.parametrize(
    ("values", "kept"),
    [
        ({"pressure_kPa": 160}, SOFT),
        ({"pressure_kPa": 240}, OWN),
        ({"rim.free": True}, FREE),
        ({"rim.free": False}, OWN),
    ],
)
def test_a_state_that_is_set_chooses_the_targets_measured_there(
    values: Mapping[str, float], kept: TyreState
) -> None:
    case = case_with(measured([OWN, FREE if "rim.free" in values else SOFT]))
    fit = study(overridden(case, values))
    assert states(fit.case) == {OWN} and len(fit.case.case.targets.modes) == 9
    hertz = [mode.frequency_Hz for mode in measured([kept])]
    assert [mode.frequency_Hz for mode in fit.case.case.targets.modes] == hertz
    (left_out,) = fit.left_out
    assert left_out.startswith("9 values at ") and study(case).left_out == []


def test_the_fit_that_remains_finds_the_tyre() -> None:
    """The fit starts from a start that its user set, and the result records it."""
    case = overridden(case_with(measured([OWN, SOFT])), {"pressure_kPa": 240, "C10": 2e6})
    fit = study(case).run()
    assert fit.initial.values["C10"] == 2e6 and fit.result["pressure_kPa"] == 240
    assert fit.result["provenance"]["overrides"] == {"pressure_kPa": 240, "C10": 2e6}
    for name, truth in TRUTH.items():
        assert fit.result["variables"][name]["value"] == pytest.approx(truth, rel=1e-3)


def test_other_numbers_leave_the_states_alone() -> None:
    """Effects, a spindle's compliance, and numbers that are set back to those of the file."""
    case = case_with(measured([OWN, SOFT]))
    for values in ({"effects.bead_filler": 1.5}, {"rim.spindle.lateral_m_per_N": 1e-7}):
        assert overridden(case, values).case.targets == case.case.targets
    back = overridden(overridden(case, {"pressure_kPa": 200}), {"pressure_kPa": 240})
    assert back.case == case.case


def test_areas_stay_at_their_pressure_and_on_a_held_rim() -> None:
    case = case_with(measured([OWN, FREE]))
    targets = case.case.targets.model_copy(update={"footprint": [AREA]})
    case = replace(case, case=case.case.model_copy(update={"targets": targets}))
    softer = overridden(case, {"pressure_kPa": 160})
    assert softer.case.targets.footprint[0].pressure_kPa == 240
    chosen, left_out = in_set_state(overridden(case, {"rim.free": True}))
    assert chosen.case.targets.footprint == [] and len(chosen.case.targets.modes) == 9
    assert left_out == ["10 values at 240 kPa with the rim fixed"]


def test_targets_whose_pressure_is_a_variable_follow_it_unless_it_is_held() -> None:
    """The pressure's start is where its search begins; held elsewhere, it moves the targets."""
    case = with_pressure_variable(measured([OWN]))
    assert states(study(overridden(case, {"P": 200})).case) == {OWN}
    assert states(study(case, fixed={"P": 240.0}).case) == {OWN}
    for held in (study, lambda case, fixed: study(overridden(case, fixed), fixed=fixed)):
        with pytest.raises(InputError, match="at 200 kPa, only at 240 kPa: set P=240, or give"):
            held(case, fixed={"P": 200.0})


def test_measured_files_choose_by_the_state_that_is_set(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    head = "label,frequency_Hz,sigma_Hz,pressure_kPa,rim\n"
    rows = [f'"[{c},0]",{60 + 10 * c},0.4,240,{rim}\n' for c in (1, 2, 3) for rim in ("", "free")]
    path.write_text(head + "".join(rows))
    assert states(study(CASE, measured=path).case) == {OWN, FREE}
    free = study(overridden(CASE, {"rim.free": True}), measured=path)
    assert free.left_out == ["3 values at 240 kPa with the rim fixed"]
    assert states(free.case) == {OWN}
    without = [row.replace(",\n", "\n") for row in rows[::2]]  # on the rim that the case has
    path.write_text(head.replace(",rim", "") + "".join(without))
    assert states(study(overridden(CASE, {"rim.free": True}), measured=path).case) == {OWN}


def test_says_that_it_did_not_move() -> None:
    """Frequencies that nothing changes: converged at once, and not moved."""
    fit = calibrate(FAKE_CASE, evaluator(powers={n: 0 * p for n, p in POWERS.items()}))  # type: ignore[arg-type]
    assert fit.result["converged"] and not fit.result["moved"]
    assert not fit.found.is_good
    assert not fit.found.model_copy(update={"converged": False, "moved": True}).is_good
    assert fit.found.model_copy(update={"moved": True}).is_good
    assert fit.result["singular_values"] == [0.0, 0.0, 0.0]
    assert all(v["standard_error"] is None for v in fit.result["variables"].values())


def test_a_bound_that_holds_is_reported() -> None:
    fit = calibrate(FAKE_CASE, evaluator({**FAKE_TRUTH, "A_belt": 3e-8}))  # type: ignore[arg-type]
    belt = fit.result["variables"]["A_belt"]
    assert belt["at_bound"] and belt["value"] == belt["lower"]
    assert fit.result["converged"]


@pytest.mark.parametrize("held", [False, True])
def test_a_pressure_that_varies_is_told_as_it_was_fitted(held: bool) -> None:
    """The result has the fitted pressure with its frequencies and mass, not that of the case."""
    pressure = FAKE_CASE.case.variables["C10"].model_copy(
        update={"sets": ["pressure_kPa"], "start": 200.0, "lower": 100.0, "upper": 400.0}
    )
    variables = {"C10": FAKE_CASE.case.variables["C10"], "pressure": pressure}
    case = replace(FAKE_CASE, case=FAKE_CASE.case.model_copy(update={"variables": variables}))
    powers = {"C10": POWERS["C10"], "pressure": POWERS["A_belt"]}
    start = {"C10": START["C10"], "pressure": 200.0}
    tyre = FakeEvaluator({label: 1.05 * f for label, f in TARGETS.items()}, powers, start)
    fixed = {"pressure": 250.0} if held else {}
    fit = calibrate(case, tyre, fixed=fixed)  # type: ignore[arg-type]
    assert fit.result["pressure_kPa"] == fit.fitted.values["pressure"] != 240.0


def test_the_result_says_what_happened() -> None:
    """Points, failures, when the objective was near its end, and deviations, from the history."""
    fails = lambda values: values["A_belt"] > 1.005 * FAKE_TRUTH["A_belt"]
    fit = calibrate(FAKE_CASE, evaluator(fails=fails), starts=3, seed=1)  # type: ignore[arg-type]
    result, history = fit.result, fit.history
    objectives = [row["objective_Hz"] for row in history]
    assert [row["point"] for row in history] == list(range(1, len(history) + 1))
    assert [row["start"] for row in history] == sorted(row["start"] for row in history)
    assert {row["start"] for row in history} == {1, 2, 3}
    assert [s["evaluations"] for s in result["starts"]] == [
        sum(row["start"] == k for row in history) for k in (1, 2, 3)
    ]
    failed = [row for row in history if row["objective_Hz"] is None]
    assert result["failed_evaluations"] == len(failed) > 0 and result["replaced_starts"] > 0
    assert result["gradient_evaluations"] == len(history) - len(failed)
    assert all((row["failure"] is None) == (row["objective_Hz"] is not None) for row in history)
    near = [f is not None and f < result["objective_Hz"] + 0.05 for f in objectives]
    assert result["evaluations_to_0.05_Hz"] == near.index(True) + 1 > 2
    assert result["objective_Hz"] == min(s["objective_Hz"] for s in result["starts"])
    assert result["objective_Hz"] == fit.fitted.objective < result["initial_objective_Hz"]
    assert result["initial_objective_Hz"] == fit.initial.objective == objectives[0]
    for mode, label in zip(result["modes"], LABELS, strict=True):
        assert (mode["c"], mode["m"], mode["kind"]) == (label.c, label.m, label.kind)
        share = mode["fitted_Hz"] / mode["target_Hz"] - 1
        assert mode["deviation_percent"] == pytest.approx(100 * share)
        assert mode["initial_Hz"] == fit.initial.modes[label].frequency_Hz
        assert mode["fitted_Hz"] == mode["frequency_Hz"] == fit.fitted.modes[label].frequency_Hz
    for i, a in enumerate(result["variables"]):
        assert result["correlations"][a][a] == pytest.approx(1)
        one = result["variables"][a]
        assert one["initial"] == START[a] and one["value"] == fit.fitted.values[a]
        assert (one["lower"], one["upper"]) == (
            FAKE_CASE.case.variables[a].lower,
            FAKE_CASE.case.variables[a].upper,
        )
        assert fit.fitted.x[i] == pytest.approx(np.log(one["value"]))
    lines = history_csv(history).splitlines()
    assert lines[0] == "point,start,A_belt,A_carcass,C10,objective_Hz,failure"
    assert len(lines) == len(history) + 1
    first = lines[1].split(",")
    assert [float(cell) for cell in first[:-1]] == [1, 1, *START.values(), objectives[0]]
    assert first[-1] == "" and any("inflation stopped" in line for line in lines)


@pytest.mark.parametrize(("gap", "at_bound"), [(0.9e-6, True), (1.1e-6, False)])
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_variable_is_at_a_bound_to_a_millionth(gap: float, at_bound: bool, side: str) -> None:
    problem = Problem(FAKE_CASE, evaluator())  # type: ignore[arg-type]
    x = START_X.copy()
    x[2] = problem.lower[2] + gap if side == "lower" else problem.upper[2] - gap
    point = problem.evaluate(x)
    report = StartReport({}, point, "", True, [])
    history = [{"objective_Hz": point.objective, "values": {}}]
    variables = fit_result(problem, point, [report], history, 0, "slsqp").variables
    assert [one.at_bound for one in variables.values()] == [False, False, at_bound]


@pytest.mark.parametrize(("change", "moved"), [(1.1e-6, True), (-1.1e-6, True), (0.9e-6, False)])
def test_a_fit_has_moved_by_more_than_a_millionth(change: float, moved: bool) -> None:
    problem = Problem(FAKE_CASE, evaluator())  # type: ignore[arg-type]
    first, last = problem.evaluate(START_X), problem.evaluate(START_X + change * np.eye(3)[1])
    report = StartReport({}, last, "", True, [])
    history = [{"objective_Hz": last.objective, "values": {}}]
    assert fit_result(problem, first, [report], history, 0, "slsqp").moved == moved
