"""A fit over several states: one design, each measured value in the state that it carries."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.modes.find import find_modes
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.fit.calibrate import Fit, calibrate, check
from tyrecal.studies.fit.crossing import AXIAL, TORSIONAL, crossing, order, pair_clarity
from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.studies.fit.states import _best_measured, next_states
from tyrecal.studies.fit.targets import Target, ValueTarget, read_targets, target_labels
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetMass, TargetMode, Targets, Variable
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import AS_THE_CASE, TyreState
from tyrecal.tyre.values import with_values

from ..chance import generator
from ..conftest import CASES
from . import pressed
from .fake import LABELS, FakeEvaluator

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
START = start_values(CASE)
TRUTH = {"A_belt": 2.6e-7, "A_carcass": 2.5e-7, "C10": 7e5}
STATES = [TyreState(p, 0.0, rim) for p in (None, 160.0, 320.0) for rim in (None, "free")]
SIGMA = 0.2


class TyreInStates(FakeEvaluator):
    """The closed form of `fake`, in pressures and on rims: f grows with p^0.4 and less with C10 at
    more pressure; a free rim lifts the modes of c <= 1. ``asked``: (pressure, free) of each
    question, batch by batch."""

    def __init__(self) -> None:
        base = {label: 30.0 + 9.0 * i for i, label in enumerate(LABELS)}
        turns = 1.0 + np.arange(len(LABELS))
        powers = {n: 0.2 + 0.1 * np.sin(turns * (2 + k)) for k, n in enumerate(START)}
        super().__init__(base, powers, START)
        self.design, self.counts = TyreDesign(CASE), None
        self.solver: Any = type("Fake", (), {"capabilities": {"spindle"}, "name": "fake"})
        self.asked: list[list[tuple[float, bool]]] = []

    def answer_all(self, questions: Any, jobs: int = 1) -> Iterator[Any]:
        told = [Question(q.values, q.gradients) for q in questions]
        state = lambda v: (v.get("pressure_kPa", 240.0), bool(v.get("rim.free", False)))
        self.asked.append([state(q.values) for q in told])
        return super().answer_all(told, jobs)

    def evaluate(self, question: Question) -> Evaluation:
        values = dict(question.values)
        ratio, free = values.get("pressure_kPa", 240.0) / 240.0, values.get("rim.free", False)
        alone = super().evaluate(Question(values))
        softer = (values["C10"] / START["C10"]) ** (-0.1 * np.log(ratio))
        lift = np.array([1.3 if free and label.c < 2 else 1.0 for label in LABELS])
        factor = ratio**0.4 * softer * lift
        f = factor * [mode.frequency_Hz for mode in alone.modes]
        modes = tuple(
            replace(m, frequency_Hz=float(x)) for m, x in zip(alone.modes, f, strict=True)
        )
        steep = {n: p - 0.1 * np.log(ratio) * (n == "C10") for n, p in self.powers.items()}
        gradients = {n: f * steep[n] / values[n] for n in question.gradients}
        mass = {n: 2.0 / START[n] for n in question.gradients}
        heavy = 10.0 + sum(2.0 * values[n] / START[n] for n in START)
        return Evaluation(ratio * 240.0, heavy, modes, gradients, mass_gradients=mass)

    def refuse_lacking(self, design: Any) -> None:
        if "spindle" in design.needs and "spindle" not in self.solver.capabilities:
            raise DeckRefused("cannot express a rim that moves")


def case_with(modes: list[TargetMode], mass: TargetMass | None = None) -> LoadedCase:
    targets = Targets(modes=modes, mass=mass)
    return replace(CASE, case=CASE.case.model_copy(update={"targets": targets}))


def measured(
    states: list[TyreState] = STATES, noise: float = 0.0, seed: int = 0, sigma: float = SIGMA
) -> list[TargetMode]:
    """The frequencies of TRUTH in every state, off by ``noise`` sigmas."""
    tyre, drawn = TyreInStates(), generator("states", seed)
    found = []
    for state in states:
        at = tyre.evaluate(Question(state.design(CASE, TRUTH)))
        for label, mode in zip(LABELS, at.modes, strict=True):
            found.append(
                TargetMode(
                    c=label.c,
                    m=label.m,
                    kind=label.kind,  # type: ignore[arg-type]
                    frequency_Hz=mode.frequency_Hz + noise * sigma * drawn.normal(),
                    sigma_Hz=sigma,
                    pressure_kPa=state.pressure_kPa,
                    rim=state.rim,
                )
            )
    return found


def fitted(case: LoadedCase, tyre: Any = None, **options: Any) -> Fit:
    made: Any = tyre or TyreInStates()
    return calibrate(case, made, **options)


def point_of(case: LoadedCase, x: Mapping[str, float] = START) -> tuple[Problem, Point]:
    problem = Problem(case, TyreInStates())  # type: ignore[arg-type]
    return problem, problem.evaluate(np.log([x[v.name] for v in problem.variables]))


@pytest.mark.parametrize("method", ["slsqp", "least-squares"])
def test_one_design_is_found_from_all_states(method: str) -> None:
    fit = fitted(case_with(measured()), method=method)
    result = fit.result
    assert result["converged"] and result["objective_Hz"] < 1e-2
    for name, truth in TRUTH.items():
        assert result["variables"][name]["value"] == pytest.approx(truth, rel=1e-4)
    assert len(result["modes"]) == 54 and result["pressure_kPa"] == 240.0
    told = [(s["pressure_kPa"], s["rim"], s["values"]) for s in result["states"]]
    assert told == [(p, rim, 9) for p in (240.0, 160.0, 320.0) for rim in ("fixed", "free")]
    assert len(fit.fitted.states) == 6 and fit.found.is_good


def test_states_of_a_design_are_asked_for_at_once_and_each_once() -> None:
    """So that --jobs does them side by side; the nominal state is asked as it always was."""
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


@pytest.mark.numbers
def test_each_state_adds_what_a_fit_without_it_lacks() -> None:
    """Standard errors without a state are those of the targets that are left, at the same design;
    those of k repeats of one state are sqrt(k) smaller."""
    problem, point = point_of(case_with(measured(noise=1.0)), TRUTH)
    known = uncertainty(problem, point)
    fit = fitted(case_with(measured(noise=1.0)))
    for state, told in zip(STATES, fit.result["states"], strict=True):
        rest = [s for s in STATES if s != state]
        fewer, there = point_of(case_with(measured(rest)), dict(fit.fitted.values))
        expected = uncertainty(fewer, there).standard_errors
        assert list(told["standard_errors_without"].values()) == pytest.approx(expected, rel=1e-9)
    assert all(e and e > 0 for e in known.standard_errors)
    alone = uncertainty(*point_of(case_with(measured([AS_THE_CASE])), TRUTH)).standard_errors
    repeated = measured([AS_THE_CASE], sigma=SIGMA / sqrt(6))
    again = uncertainty(*point_of(case_with(repeated), TRUTH)).standard_errors
    assert np.array(again) * sqrt(6) == pytest.approx(np.array(alone), rel=1e-9)
    for place, told in enumerate(fit.result["states"]):
        own = fit.result["modes"][9 * place : 9 * place + 9]
        off = [(m["fitted_Hz"] - m["target_Hz"]) / m["sigma_Hz"] for m in own]
        assert told["rms_sigmas"] == pytest.approx(np.sqrt(np.mean(np.square(off))), rel=1e-9)


@pytest.mark.numbers
def test_the_next_state_is_the_one_whose_fit_would_be_best() -> None:
    """Its standard errors are those of a fit that has it; the most telling is named first."""
    have = STATES[:2]
    fit = fitted(case_with(measured(have)))
    told = fit.found.next_states
    asked = {(each.pressure_kPa, each.rim) for each in told}
    assert asked == {(p, rim) for p in (190.0, 300.0) for rim in ("fixed", "free")}
    assert [each.ratio for each in told] == sorted(each.ratio for each in told)  # type: ignore[type-var]
    x = dict(fit.fitted.values)
    before = list(uncertainty(*point_of(case_with(measured(have)), x)).standard_errors)
    for each in told:
        more = measured([*have, TyreState(each.pressure_kPa, 0.0, each.rim)])  # type: ignore[arg-type]
        like = {(t.c, t.m, t.kind): t.sigma_Hz / t.frequency_Hz for t in more[:9]}  # type: ignore[operator]
        scaled = [
            t.model_copy(update={"sigma_Hz": like[t.c, t.m, t.kind] * t.frequency_Hz})
            for t in more[18:]
        ]
        after = uncertainty(*point_of(case_with([*more[:18], *scaled]), x)).standard_errors
        assert list(each.standard_errors_with.values()) == pytest.approx(after, rel=1e-3)
        ratio = np.exp(np.mean(np.log(np.array(after) / before)))
        assert each.ratio == pytest.approx(ratio, rel=1e-3) and ratio < 1


def test_modes_under_a_load_are_like_those_of_a_next_state() -> None:
    """Each once, where no unloaded state was measured; the tyre's own is then one to propose."""
    at_load = TyreState(None, 4000.0)
    told = [
        ValueTarget("frequency_Hz", 80.0, 0.4, state=at_load, member=Member(Label(2, 0), side))
        for side in ("symmetric", "antisymmetric")
    ]
    area = ValueTarget("contact_area_m2", 0.02, 1e-4, state=at_load)
    free = TyreState(None, 0.0, "free")
    hung = Target(Label(3, 0), 100.0, state=free)
    sigma = np.array([0.4, 0.6, 1e-4, 0.5])
    some = lambda *rows: SimpleNamespace(measured=list(rows))
    known = lambda *which: SimpleNamespace(sigma=sigma[list(which)])
    ((mode, relative),) = _best_measured(some(*told, area), known(0, 1, 2))  # type: ignore[arg-type]
    assert (mode.label, mode.multiplicity, relative) == (Label(2, 0), 2, 0.4 / 80.0)
    ((mode, relative),) = _best_measured(some(*told, hung), known(0, 1, 3))  # type: ignore[arg-type]
    assert (mode, relative) == (hung, 0.005)
    assert _best_measured(some(area), known(2)) == []  # type: ignore[arg-type]


def test_no_state_is_proposed_that_cannot_be_computed() -> None:
    tyre = TyreInStates()
    tyre.solver.capabilities = set()
    problem = Problem(case_with(measured([TyreState(160.0), AS_THE_CASE])), tyre)  # type: ignore[arg-type]
    point = problem.evaluate(problem.start())
    found = next_states(problem, point, uncertainty(problem, point))
    told = [each.state.told(CASE) for each in found]
    assert {(s.pressure_kPa, s.rim) for s in told} == {(130.0, "fixed"), (300.0, "fixed")}
    tyre.has_gradients = False
    bare = Problem(problem.case, tyre)  # type: ignore[arg-type]
    assert next_states(bare, point, uncertainty(problem, point)) == []


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
    found = crossing(problem, [point], point)
    assert found and found.state in STATES
    states = dict(point.states)
    mixed = {k: replace(m, clarity=0.5) for k, m in states[STATES[1]].items()}
    near = replace(point, states={**states, STATES[1]: mixed})
    assert pair_clarity(near) == 0.5 == pair_clarity(near, STATES[1])
    assert pair_clarity(near, STATES[0]) == pair_clarity(point)
    found = crossing(problem, [near], near)
    assert found and found.state == STATES[1]
    apart = mixed[AXIAL].frequency_Hz - mixed[TORSIONAL].frequency_Hz
    assert found.value == pytest.approx(0.5 * apart)


def test_tables_and_files_show_states_side_by_side() -> None:
    fit = fitted(case_with(measured(noise=1.0), TargetMass(mass_kg=14.0, sigma_kg=0.1)))
    first, *_, before, after = fit.found.tables()
    names = [column.name for column in first.columns]
    assert names[2:5] == ["240 kPa\nrim fixed", "240 kPa\nrim free", "160 kPa\nrim fixed"]
    assert names[-1] == "any state" and len(first.rows) == 9 + 1 and first.rows[-1][0] == "mass"
    assert first.rows[0][:2] == ["[0,0]", "lateral"] and None not in first.rows[0][2:-1]
    assert before.rows[0][0] == "nothing" and len(before.rows) == 7
    assert len(after.rows) == len(fit.found.next_states) == 4
    assert after.rows[0][0] == fit.found.next_states[0].said
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


LINES = """label,frequency_Hz,sigma_Hz,area [cm2],pressure_kPa,load_N,rim
"[2,0]",79.5,0.4,,240,,
"[2,0]",71.5,0.4,,160.2,,fixed
"[2,1]",60.5,0.4,,160,,free
"[0,0] lateral",45.5,0.4,,240.3,,free
"[2,1]",66.5,0.4,,240,4000,
"""


def test_a_laboratorys_table_becomes_targets_in_their_states(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text(
        LINES.replace("area [cm2],", "member,")
        .replace("240,4000,", "240,4000,")
        .replace("66.5,0.4,,", "66.5,0.4,symmetric,")
    )
    case, notes = with_measured(CASE, path)
    assert not notes
    modes = [
        (t.c, t.m, t.pressure_kPa, t.rim, t.load_N, t.symmetry) for t in case.case.targets.modes
    ]
    assert modes == [
        (2, 0, None, None, None, None),
        (2, 0, 160.2, None, None, None),
        (2, 1, 160.2, "free", None, None),  # pressures that differ by little are one
        (0, 0, None, "free", None, None),
        (2, 1, None, None, 4000.0, "symmetric"),
    ]
    assert target_labels(case) == [Label(2, 0), Label(2, 1), Label(0, 0, "axial")]
    assert next(iter(read_targets(case))).state == AS_THE_CASE
    (road,) = Problem(case, TyreInStates()).road  # type: ignore[arg-type]
    assert road.state == TyreState(None, 4000.0) and str(road.member) == "[2,1] symmetric"
    at_160 = replace(with_values(CASE, {"pressure_kPa": 160.0}), overrides={"pressure_kPa": 160.0})
    case, (note,) = with_measured(at_160, path)
    assert {t.pressure_kPa for t in case.case.targets.modes} == {None} and note.startswith(
        "3 values"
    )


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('"[3,0]",90,0.4,240,0,springs', "line 2: the rim has no springs in this case: give a"),
        ('"[3,0]",90,0.4,2000,0,fixed', "line 2: pressure_kPa must be less than 2000"),
    ],
)
def test_a_state_that_the_case_cannot_compute_is_refused(
    tmp_path: Path, line: str, words: str
) -> None:
    path = tmp_path / "m.csv"
    path.write_text(
        "label,frequency_Hz,sigma_Hz,pressure_kPa,load_N,rim\n"
        + line
        + "\n"
        + '"[2,0]",79,0.4,240,0,\n'
    )
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        with_measured(CASE, path)


def test_a_solver_without_a_moving_rim_refuses_before_it_starts() -> None:
    tyre = TyreInStates()
    tyre.solver.capabilities = set()
    with pytest.raises(DeckRefused, match="a rim that moves"):
        check(Problem(case_with(measured()), tyre))  # type: ignore[arg-type]
    assert tyre.calls == 0


def test_areas_at_two_pressures_are_pressed_in_their_states() -> None:
    """By the formula of `pressed`; the loads of one state are not another's."""
    plain = pressed.area_target(0.0125, 1e-4)
    there = pressed.area_target(0.0125, 1e-4, 6000.0).model_copy(update={"pressure_kPa": 160.0})
    case = pressed.case_with([], [plain, there])
    tyre = pressed.evaluator(case)
    asked: list[tuple[float | None, list[float]]] = []
    press_all = tyre.press_all

    def asking(designs: Any, loads: Any, jobs: int) -> Any:
        asked.append((designs[0].get("pressure_kPa"), list(loads)))
        return press_all(designs, loads, jobs)

    tyre.press_all = asking  # type: ignore[assignment, method-assign]
    point = Problem(case, tyre).evaluate(np.log(list(pressed.START.values())))
    assert dict(asked) == {None: [4000.0], 160.0: [6000.0]}
    assert point.others[1] / point.others[0] == pytest.approx(1.5 ** (2 / 3), rel=0.1)
    assert (point.jacobian[:, 0] != 0).all()


def test_the_bundled_solver_tells_the_mass_and_its_slopes() -> None:
    """Against differences, of areas and of a density; a state does not change the mass."""
    tyre = Evaluator(TyreDesign(CASE))
    names = ("A_belt", "materials.rubber.density_kg_per_m3")
    own = {**START, names[1]: 1200.0}
    found = tyre.evaluate(Question(own, names))
    for name in names:
        up, down = (
            tyre.evaluate(Question({**own, name: own[name] * factor})).mass_kg
            for factor in (1.01, 0.99)
        )
        rise = (up - down) / (0.02 * own[name])
        assert found.mass_gradients[name] == pytest.approx(rise, rel=1e-6)


@pytest.mark.slow
def test_a_real_tyre_is_found_from_four_states() -> None:
    """Modes of the coarse mesh at 160 and 320 kPa, rim fixed and free, without noise."""
    tyre = Evaluator(TyreDesign(CASE))
    states = [TyreState(p, 0.0, rim) for p in (160.0, 320.0) for rim in ("fixed", "free")]
    labels = target_labels(CASE)
    targets = []
    for state in states:
        ((_, found),) = find_modes(tyre, [Question(state.design(CASE, TRUTH))], labels)
        for label, mode in found.wanted.items():  # type: ignore[union-attr]
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
