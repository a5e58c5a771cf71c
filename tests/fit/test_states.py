"""A fit over several states: one design, each measured value in the state that it carries."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from tyrecal.errors import InputError
from tyrecal.report.table import shown
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.modes.find import find_modes
from tyrecal.studies.fit.calibrate import check
from tyrecal.studies.fit.crossing import AXIAL, TORSIONAL, crossing, order, pair_clarity
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.result import Deviation
from tyrecal.tyre.case.schema import TargetMass, TargetMode, Targets, Variable
from tyrecal.tyre.state import AS_THE_CASE, TyreState
from tyrecal.tyre.values import with_values

from ..solved import calibrate
from . import pressed
from .tyre_in_states import (
    CASE,
    START,
    STATES,
    TRUTH,
    TyreInStates,
    case_with,
    fitted,
    measured,
    point_of,
)


@pytest.mark.parametrize("method", ["slsqp", "gauss-newton"])
def test_one_design_is_found_from_all_states(method: str) -> None:
    fit = fitted(case_with(measured()), method=method)
    result = fit.result
    assert result["converged"] and result["objective_Hz"] < 1e-2
    for name, truth in TRUTH.items():
        assert result["variables"][name]["value"] == pytest.approx(truth, rel=1e-4)
    assert len(result["modes"]) == 54 and result["pressure_kPa"] == 240.0
    states = [(s["pressure_kPa"], s["rim"], s["values"]) for s in result["states"]]
    assert states == [(p, rim, 9) for p in (240.0, 160.0, 320.0) for rim in ("fixed", "free")]
    assert len(fit.fitted.states) == 6 and fit.found.is_good


def test_states_of_a_design_are_asked_for_at_once_and_each_once() -> None:
    """So --jobs computes states side by side; the question for the nominal state is the usual
    one."""
    tyre = TyreInStates()
    problem = Problem(case_with(measured()), tyre, jobs=4)  # type: ignore[arg-type]
    problem.evaluate(problem.start())
    problem.evaluate(problem.start())
    expected = [(p, free) for p in (240.0, 160.0, 320.0) for free in (False, True)]
    assert tyre.asked == [expected] and tyre.jobs == [4]


def test_slopes_and_residuals_are_those_of_each_states_own_frequencies() -> None:
    """Against central differences, the mass among them; a doublet counts twice."""
    case = case_with(measured(sigma=0.5), TargetMass(mass_kg=14.0, sigma_kg=0.1))
    problem, point = point_of(case)
    h = 1e-5
    for k, e in enumerate(h * np.eye(3)):
        rise = problem.evaluate(point.x + e).residuals - problem.evaluate(point.x - e).residuals
        assert point.jacobian[:, k] == pytest.approx(rise / (2 * h), rel=1e-6, abs=1e-6)
    assert point.residuals[-1] == pytest.approx((16.0 - 14.0) / 0.1) and len(point.others) == 1
    for i, t in enumerate(problem.targets):
        f = point.states[t.state][t.label].frequency_Hz
        assert point.residuals[i] == pytest.approx(
            sqrt(2 if t.label.c else 1) * (f - t.frequency_Hz) / 0.5
        )
    tyre: Any = TyreInStates()
    tyre.has_gradients = False
    other = Problem(case, tyre).evaluate(point.x)
    assert other.jacobian == pytest.approx(point.jacobian, rel=1e-3, abs=1e-3)


def test_targets_of_one_state_are_a_fit_of_that_state_alone() -> None:
    """Stated or not, to the last bit; its result has no word of states."""
    plain, stated = measured([AS_THE_CASE]), measured([TyreState(240.0, 0.0, "fixed")])
    assert stated[0].pressure_kPa == 240.0 and stated[0].rim == "fixed"
    one, other = fitted(case_with(plain)), fitted(case_with(stated))
    assert one.found.texts() == other.found.texts()
    assert "states" not in one.result and "rim" not in one.result["modes"][0]
    assert one.found.csv().splitlines()[0].endswith("target_Hz,deviation_percent")


def test_a_fit_at_another_state_alone_is_that_cases_fit() -> None:
    """Told by its targets' state or by the case's: the same design."""
    there = fitted(case_with(measured([TyreState(160.0, 0.0, "free")], noise=1.0)))
    moved = with_values(
        case_with(measured([AS_THE_CASE])), {"pressure_kPa": 160.0, "rim.free": True}
    )
    own = [
        t.model_copy(update={"pressure_kPa": None, "rim": None})
        for t in measured([TyreState(160.0, 0.0, "free")], noise=1.0)
    ]
    moved = replace(moved, case=moved.case.model_copy(update={"targets": Targets(modes=own)}))

    class Moved(TyreInStates):
        def evaluate(self, question: Question) -> Evaluation:
            values = {**question.values, "pressure_kPa": 160.0, "rim.free": True}
            return super().evaluate(Question(values, question.gradients))

    alone = fitted(moved, Moved())
    for name in START:
        values = [f.result["variables"][name]["value"] for f in (there, alone)]
        errors = [f.result["variables"][name]["standard_error"] for f in (there, alone)]
        assert values[0] == pytest.approx(values[1], rel=1e-9)
        assert errors[0] == pytest.approx(errors[1], rel=1e-9)
    assert [s["pressure_kPa"] for s in there.result["states"]] == [160.0]


def test_a_design_that_fails_in_one_state_fails() -> None:
    class Weak(TyreInStates):
        def evaluate(self, question: Question) -> Evaluation:
            if question.values.get("pressure_kPa") == 160.0:
                raise EvaluationFailed("unstable", "the belt buckles")
            return super().evaluate(question)

    problem = Problem(case_with(measured()), Weak())  # type: ignore[arg-type]
    with pytest.raises(EvaluationFailed, match="the belt buckles"):
        problem.evaluate(problem.start())


def test_crossings_are_those_of_each_state() -> None:
    """The [0, 0] modes may be nearer in one state than in another; that one bounds."""
    case = case_with(measured(STATES[:3]))
    problem, point = point_of(case)
    assert order(problem, point) == dict.fromkeys(STATES[:3], -1.0)
    edge = crossing(problem, [point], point)
    assert edge and edge.state in STATES
    states = dict(point.states)
    mixed = {k: replace(m, clarity=0.5) for k, m in states[STATES[1]].items()}
    near = replace(point, states={**states, STATES[1]: mixed})
    assert pair_clarity(near) == 0.5 == pair_clarity(near, STATES[1])
    assert pair_clarity(near, STATES[0]) == pair_clarity(point)
    edge = crossing(problem, [near], near)
    assert edge and edge.state == STATES[1]
    apart = mixed[AXIAL].frequency_Hz - mixed[TORSIONAL].frequency_Hz
    assert edge.value == pytest.approx(0.5 * apart)


def test_tables_and_files_show_states_side_by_side() -> None:
    fit = fitted(case_with(measured(noise=1.0), TargetMass(mass_kg=14.0, sigma_kg=0.1)))
    first, *_, before, after = fit.found.tables()
    names = [column.name for column in first.columns]
    assert names[2:5] == ["240 kPa\nrim fixed", "240 kPa\nrim free", "160 kPa\nrim fixed"]
    assert names[-1] == "any state" and len(first.rows) == 9 + 1 and first.rows[-1][0] == "mass, kg"
    assert first.rows[0][:2] == ["[0,0]", "lateral"] and None not in first.rows[0][2:-1]
    mode = fit.found.modes[0]
    assert first.rows[0][2] == Deviation(mode.deviation_percent, f"{mode.fitted_Hz:.2f}")
    console = Console(width=110)
    with console.capture() as text:
        console.print(shown(first))
    assert f"{mode.fitted_Hz:.2f} {mode.deviation_percent:+.2f}" in text.get()
    assert before.rows[0][0] == "nothing" and len(before.rows) == 7
    assert len(after.rows) == len(fit.found.next_states) == 4
    assert after.rows[0][0] == fit.found.next_states[0].display
    (table,) = fit.found.numbers()
    assert len(table.rows) == 55 and table.rows[1][0] == "240 kPa, rim fixed"
    rows = list(csv.DictReader(io.StringIO(fit.found.csv())))
    assert {(r["pressure_kPa"], r["rim"]) for r in rows[:54]} == {
        (f"{p:.1f}", rim) for p in (160, 240, 320) for rim in ("fixed", "free")
    }
    assert rows[-1]["quantity"] == "mass_kg" and float(rows[-1]["fitted"]) > 10


def test_a_variable_that_a_state_sets_moves_nothing_there() -> None:
    """A spring of the spindle is none of a free rim; the pressure cannot be both."""
    v = Variable(sets=["rim.spindle.radial_m_per_N"], start=1e-8, lower=1e-9, upper=1e-6)
    base = case_with(measured([AS_THE_CASE, TyreState(None, 0.0, "free")]))
    variables = {**base.case.variables, "c_r": v}
    case = replace(base, case=base.case.model_copy(update={"variables": variables}))
    problem = Problem(case, TyreInStates())  # type: ignore[arg-type]
    free = TyreState(rim="free")
    values, names = problem.question({**START, "c_r": 2e-8}, free, ("C10", "c_r"))
    assert names == ("C10",) and "c_r" not in values and values["rim.free"] is True
    values, names = problem.question({**START, "c_r": 2e-8}, AS_THE_CASE, ("C10", "c_r"))
    assert names == ("C10", "c_r") and values["c_r"] == 2e-8
    p = Variable(sets=["pressure_kPa"], start=240.0, lower=200.0, upper=280.0)
    base = case_with(measured([AS_THE_CASE, TyreState(160.0)]))
    variables = {**base.case.variables, "p": p}
    case = replace(base, case=base.case.model_copy(update={"variables": variables}))
    with pytest.raises(InputError, match=r"variable 'p' sets pressure_kPa.*--fix p"):
        check(Problem(case, TyreInStates()))
    check(Problem(case, TyreInStates(), {"p": 240.0}))


def test_areas_at_two_pressures_are_pressed_in_their_states() -> None:
    """Areas follow the formula of `pressed`; loads of one state do not enter another."""
    plain = pressed.area_target(0.0125, 1e-4)
    there = pressed.area_target(0.0125, 1e-4, 6000.0).model_copy(update={"pressure_kPa": 160.0})
    case = pressed.case_with([], [plain, there])
    tyre = pressed.evaluator(case)
    presses: list[tuple[float | None, list[float]]] = []
    press_all = tyre.press_all

    def asking(questions: Any, jobs: int) -> Any:
        presses.append((questions[0].values.get("pressure_kPa"), list(questions[0].loads_N)))
        return press_all(questions, jobs)

    tyre.press_all = asking  # type: ignore[assignment, method-assign]
    point = Problem(case, tyre).evaluate(np.log(list(pressed.START.values())))
    assert dict(presses) == {None: [4000.0], 160.0: [6000.0]}
    assert point.others[1] / point.others[0] == pytest.approx(1.5 ** (2 / 3), rel=0.1)
    assert (point.jacobian[:, 0] != 0).all()


def test_the_bundled_solver_tells_the_mass_and_its_slopes() -> None:
    """Against differences, of areas and of a density; a state does not change the mass."""
    tyre = Evaluator(TyreDesign(CASE))
    names = ("A_belt", "materials.rubber.density_kg_per_m3")
    own = {**START, names[1]: 1200.0}
    evaluation = tyre.evaluate(Question(own, names))
    for name in names:
        up, down = (
            tyre.evaluate(Question({**own, name: own[name] * factor})).mass_kg
            for factor in (1.01, 0.99)
        )
        rise = (up - down) / (0.02 * own[name])
        assert evaluation.mass_gradients[name] == pytest.approx(rise, rel=1e-6)


@pytest.mark.slow
def test_a_real_tyre_is_found_from_four_states() -> None:
    """Modes of the coarse mesh at 160 and 320 kPa, rim fixed and free, without noise."""
    tyre = Evaluator(TyreDesign(CASE))
    states = [TyreState(p, 0.0, rim) for p in (160.0, 320.0) for rim in ("fixed", "free")]
    labels = target_labels(CASE)
    targets = []
    for state in states:
        ((_, labelled),) = find_modes(tyre, [Question(state.design(CASE, TRUTH))], labels)
        for label, mode in labelled.wanted.items():  # type: ignore[union-attr]
            targets.append(
                TargetMode(
                    c=label.c,
                    m=label.m,
                    kind=label.kind,  # type: ignore[arg-type]
                    frequency_Hz=mode.frequency_Hz,
                    sigma_Hz=0.1,
                    pressure_kPa=state.pressure_kPa,
                    rim=state.rim,
                )
            )
    result = calibrate(case_with(targets), tyre).result
    for name, truth in TRUTH.items():
        assert result["variables"][name]["value"] == pytest.approx(truth, rel=1e-3)
