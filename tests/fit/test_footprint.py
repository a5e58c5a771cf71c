"""Contact area, length, width and vertical stiffness as targets, on a tyre pressed by a formula."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.errors import InputError
from tyrecal.measured.targets import with_measured
from tyrecal.report.diagnosis import _measured
from tyrecal.report.html.comparison import _deviations
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.studies.diagnose.under_load import LoadedRow
from tyrecal.studies.fit.problem import Problem, objective
from tyrecal.studies.fit.targets import Target, objective_unit
from tyrecal.studies.footprint import footprint_result, press
from tyrecal.tyre.case.schema import TargetFootprint, Variable
from tyrecal.tyre.effects.edit import changed
from tyrecal.tyre.footprint_quantities import FOOTPRINT_QUANTITIES

from ..solved import calibrate
from . import pressed
from .pressed import (
    AREA,
    AREA_0,
    CASE,
    LENGTH,
    START,
    STIFFNESS,
    STIFFNESS_0,
    WIDTH,
    Elastic,
    Roadless,
    area_target,
    case_with,
    evaluator,
    power,
    stiffness_target,
)

TRUTH = {"A_belt": 2.6e-7, "A_carcass": 2.5e-7, "C10": 7e5}


MODES = CASE.case.targets.modes


START_X = np.log(list(START.values()))


def exact_modes(sigma_Hz: float | None) -> list:
    """The case's target modes with the frequencies that the model has at TRUTH."""
    by_label = {
        m.label: m.frequency_Hz
        for m in paired_labels(Evaluator(TyreDesign(CASE)).evaluate(Question(TRUTH)).modes)
    }
    return [
        t.model_copy(
            update={"frequency_Hz": by_label[Label(t.c, t.m, t.kind)], "sigma_Hz": sigma_Hz}
        )
        for t in MODES
    ]


AREA_TRUE, STIFFNESS_TRUE = AREA_0 * power(TRUTH, AREA), STIFFNESS_0 * power(TRUTH, STIFFNESS)


FOOTPRINT = [
    area_target(AREA_TRUE, 0.02 * AREA_TRUE),
    stiffness_target(STIFFNESS_TRUE, 0.02 * STIFFNESS_TRUE),
]


def test_without_sigmas_and_footprints_it_is_equation_1_to_the_last_bit() -> None:
    point = Problem(CASE, Evaluator(TyreDesign(CASE))).evaluate(START_X)
    root = np.sqrt([2.0 if t.c else 1.0 for t in MODES])
    f = np.array([point.modes[Label(t.c, t.m, t.kind)].frequency_Hz for t in MODES])
    residuals = root * (f - np.array([t.frequency_Hz for t in MODES]))
    assert (point.residuals == residuals).all()
    assert point.objective == np.linalg.norm(residuals)
    ones = [t.model_copy(update={"sigma_Hz": 1.0}) for t in MODES]
    same = Problem(case_with(ones, []), Evaluator(TyreDesign(CASE))).evaluate(START_X)
    assert (same.residuals == point.residuals).all() and (same.jacobian == point.jacobian).all()
    assert objective_unit(CASE) == "Hz" and objective_unit(case_with(ones, [])) == "sigma"


def test_the_weighted_objective_by_hand() -> None:
    """A singlet 2 sigma off, a doublet 1 Hz off without sigma and of weight 3, an area 4 sigma, a
    stiffness half a sigma off and of weight 8: sqrt(2^2 + 2 . 3 + 4^2 + 8 / 4) = sqrt(28)."""
    raw = {
        m.label: m.frequency_Hz
        for m in paired_labels(Evaluator(TyreDesign(CASE)).evaluate(Question(START)).modes)
    }
    torsional, ovals = Label(0, 0, "torsional"), Label(2, 0)
    modes = [
        MODES[1].model_copy(update={"frequency_Hz": raw[torsional] + 0.4, "sigma_Hz": 0.2}),
        MODES[5].model_copy(update={"frequency_Hz": raw[ovals] - 1.0, "weight": 3.0}),
    ]
    case = case_with(
        modes,
        [
            area_target(0.9 * AREA_0, 0.025 * AREA_0),
            stiffness_target(1.05 * STIFFNESS_0, 0.1 * STIFFNESS_0, weight=8.0),
        ],
    )
    point = Problem(case, evaluator(case)).evaluate(START_X)
    assert point.objective == pytest.approx(28**0.5, rel=1e-9)
    assert point.residuals == pytest.approx([-2, 6**0.5, 4, -(2**0.5)])
    by_label = [Target(torsional, 40.4, 1.0, 0.2), Target(ovals, 79.0, 3.0)]
    assert objective({torsional: 40.0, ovals: 80.0}, by_label) == pytest.approx(10**0.5)


def test_slopes_are_those_of_the_formula_and_of_central_differences() -> None:
    case = case_with(exact_modes(0.5), FOOTPRINT)
    problem = Problem(case, evaluator(case))
    x = np.log(list(TRUTH.values())) + 0.05
    point = problem.evaluate(x)
    powers = np.array([list(AREA.values()), list(STIFFNESS.values())])
    elasticities = (
        point.jacobian[-2:] * 0.02 / (point.others / [AREA_TRUE, STIFFNESS_TRUE])[:, None]
    )
    assert elasticities == pytest.approx(powers, rel=1e-4, abs=1e-6)
    step = 2e-4
    for i in range(3):
        there = [problem.evaluate(x + s * step * np.eye(3)[i]) for s in (1, -1)]
        central = (there[0].objective - there[1].objective) / (2 * step)
        assert point.gradient[i] == pytest.approx(central, rel=1e-4)


@pytest.mark.parametrize("method", ["slsqp", "gauss-newton"])
def test_finds_the_truth(method: str) -> None:
    case = case_with(exact_modes(0.5), FOOTPRINT)
    result = calibrate(case, evaluator(case), method).result
    assert result["converged"] and result["moved"] and result["objective_Hz"] < 0.01
    for name, value in TRUTH.items():
        assert result["variables"][name]["value"] == pytest.approx(value, rel=1e-3)
    area, stiffness = result["footprint"]
    assert (area["load_N"], area["quantity"], area["target"]) == (
        4000,
        "contact_area_m2",
        AREA_TRUE,
    )
    assert stiffness["quantity"] == "vertical_stiffness_N_per_m"
    assert area["initial"] == pytest.approx(AREA_0) and stiffness["sigma"] == 0.02 * STIFFNESS_TRUE
    assert abs(area["deviation_percent"]) < 0.02 and abs(stiffness["deviation_percent"]) < 0.02
    assert result["objective_unit"] == "sigma"


def test_footprints_alone_determine_as_many_variables_as_there_are() -> None:
    case = case_with([], FOOTPRINT)
    held = {"A_belt": TRUTH["A_belt"]}
    result = calibrate(case, evaluator(case), fixed=held).result
    assert result["converged"] and result["modes"] == [] and result["noise_Hz"] is None
    for name in ("A_carcass", "C10"):
        assert result["variables"][name]["value"] == pytest.approx(TRUTH[name], rel=1e-3)
    with pytest.raises(InputError, match="2 targets cannot determine 3 free variables"):
        calibrate(case, evaluator(case))


@pytest.mark.slow
def test_standard_errors_with_footprints_by_the_normal_equations() -> None:
    """The errors are (J'^T J')^-1 if weights are those of the noise: all sigmas are stated,
    singlets and doublets alike. With footprints no error is larger than without."""
    modes = [t for t in exact_modes(0.5) if t.c == 0]
    case = case_with(modes, FOOTPRINT)
    problem = Problem(case, evaluator(case))
    result = calibrate(case, evaluator(case)).result
    x = np.log([v["value"] for v in result["variables"].values()])
    J = problem.evaluate(x).jacobian
    errors = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    stated = [v["standard_error"] / v["value"] for v in result["variables"].values()]
    assert stated == pytest.approx(errors, rel=1e-6)
    assert result["singular_values"] == pytest.approx(np.linalg.svd(J, compute_uv=False))
    all_modes = case_with(exact_modes(0.5), [])
    alone = calibrate(all_modes, Evaluator(TyreDesign(all_modes))).result["variables"]
    both = case_with(exact_modes(0.5), FOOTPRINT)
    together = calibrate(both, evaluator(both)).result["variables"]
    for name in TRUTH:
        assert together[name]["standard_error"] < alone[name]["standard_error"]


def test_frequencies_without_sigma_share_one_from_their_own_residuals() -> None:
    """Footprints that are known exactly hold two of the three variables, so that nine frequencies
    have eight degrees of freedom left, not six."""
    modes = [
        t.model_copy(update={"frequency_Hz": t.frequency_Hz + 0.3 * (-1) ** i})
        for i, t in enumerate(exact_modes(None))
    ]
    sharp = [area_target(AREA_TRUE, 1e-6 * AREA_TRUE), stiffness_target(STIFFNESS_TRUE, 0.1)]
    case = case_with(modes, sharp)
    result = calibrate(case, evaluator(case)).result
    plain = [m["fitted_Hz"] - m["target_Hz"] for m in result["modes"]]
    assert result["noise_Hz"] == pytest.approx(np.linalg.norm(plain) / 8**0.5, rel=1e-3)


def test_numbers_are_those_of_a_footprint_at_the_cases_loads() -> None:
    case = case_with([], [*FOOTPRINT, area_target(0.01, 0.001, 5000.0)])
    assert case.case.loads_N == [4000, 5000, 6000]
    tyre = evaluator(case)
    point = Problem(case, tyre).evaluate(START_X)
    outcomes = press(tyre, {"initial": START}, case.case.loads_N)
    from tyrecal.tyre.resolve import resolved

    rows = footprint_result(
        {"initial": START}, [], outcomes, {"initial": resolved(CASE).mesh}
    ).content()["rows"]
    assert list(point.others) == [
        rows[0]["area_m2"],
        rows[0]["vertical_stiffness_N_per_m"],
        rows[1]["area_m2"],
    ]


@pytest.mark.parametrize("method", ["slsqp", pytest.param("gauss-newton", marks=pytest.mark.slow)])
def test_loads_out_of_reach_are_stepped_back_from(method: str) -> None:
    """The tyre bottoms out before the load where the fit would go first, and within 2 % of it."""
    case = case_with(exact_modes(0.5), FOOTPRINT)
    first = calibrate(case, evaluator(case), method).history[1]["values"]
    tyre = evaluator(case)
    solver = tyre.solver
    original = solver.write

    def write(decks, folder):  # type: ignore[no-untyped-def]
        near = all(abs(np.log(decks.values[n] / first[n])) < 0.02 for n in first)
        solver.reach = 3000.0 if near else 20e3
        return original(decks, folder)

    solver.write = write  # type: ignore[method-assign]
    fit = calibrate(case, tyre, method)
    assert fit.result["objective_Hz"] < 0.05
    failed = [row for row in fit.history if row["objective_Hz"] is None]
    assert all("the rim is on the road" in row["failure"] for row in failed)
    assert fit.result["failed_evaluations"] == len(failed) > 0


def test_a_later_load_out_of_reach_fails_and_one_without_a_target_is_not_pressed() -> None:
    case = case_with([], [*FOOTPRINT, area_target(0.01, 0.001, 5000.0)])
    with pytest.raises(EvaluationFailed, match="4500") as failure:
        Problem(case, evaluator(case, reach=4500.0)).evaluate(START_X)
    assert failure.value.cause == "no_equilibrium"
    Problem(case, evaluator(case, reach=5500.0)).evaluate(START_X)


def test_the_record_answers_a_second_fit_to_the_last_bit(tmp_path: Path) -> None:
    case = case_with(exact_modes(0.5), FOOTPRINT)
    first, second = evaluator(case, tmp_path), evaluator(case, tmp_path)
    results = [json.dumps(calibrate(case, each).result) for each in (first, second)]
    assert results[0] == results[1]
    assert first.counts.runs > 0 and (second.counts.runs, second.counts.recorded) == (
        0,
        first.counts.runs + first.counts.recorded,
    )


def test_a_solver_without_a_road_is_refused_before_anything_runs() -> None:
    case = case_with(MODES, FOOTPRINT)
    tyre = Evaluator(TyreDesign(case), _solver=Roadless())
    with pytest.raises(DeckRefused, match="cannot press a tyre on a road"):
        calibrate(case, tyre)
    assert tyre.counts.runs == 0
    assert calibrate(CASE, Evaluator(TyreDesign(CASE), _solver=Roadless())).result["converged"]


PATCH_TRUTH = {"A_belt": START["A_belt"], "A_carcass": 2.5e-7, "C10": 7e5}


POWERS = {
    "contact_area_m2": pressed.AREA,
    "contact_length_m": LENGTH,
    "contact_width_m": WIDTH,
    "vertical_stiffness_N_per_m": pressed.STIFFNESS,
}


AT_START = dict(zip(POWERS, (pressed.AREA_0, 0.16, 0.10, STIFFNESS_0), strict=True))


def target(name: str) -> TargetFootprint:
    """The quantity that the tyre has at TRUTH, to 2 %."""
    value = AT_START[name] * power(PATCH_TRUTH, POWERS[name])
    sigma = FOOTPRINT_QUANTITIES[name].sigma
    return TargetFootprint.model_validate({"load_N": 4000, name: value, sigma: 0.02 * value})


class Sloped(Elastic):
    """Gives exact sensitivities by the case's variables."""

    capabilities = Bundled.capabilities

    def write(self, decks: Any, folder: Any) -> Any:
        """The real decks; remembers the design."""
        self.values = decks.values
        return super().write(decks, folder)

    def footprint(self, load: float) -> dict[str, Any]:
        """Footprint of one load, with sensitivities."""
        at_load = super().footprint(load)
        at_load["contact_area_m2"] = float(at_load["area_m2"].sum())
        slopes = {
            variable: {
                each.slope: at_load[each.slope] * POWERS[name][variable] / self.values[variable]
                for name, each in FOOTPRINT_QUANTITIES.items()
            }
            for variable in START
        }
        return at_load | {"slopes": slopes}


def test_length_and_width_find_two_variables() -> None:
    case = case_with([], [target("contact_length_m"), target("contact_width_m")])
    fit = calibrate(case, evaluator(case), fixed={"A_belt": START["A_belt"]})
    assert fit.found.converged
    for name in ("A_carcass", "C10"):
        assert fit.found.variables[name].value == pytest.approx(PATCH_TRUTH[name], rel=1e-3)
    length, width = fit.found.footprint
    assert (length.quantity, width.quantity) == ("contact_length_m", "contact_width_m")
    assert length.initial == pytest.approx(0.16) and width.initial == pytest.approx(0.10)
    rows = {row[1]: row[2] for row in fit.found.tables()[0].rows}
    assert rows["contact length, mm"] == "160.0" and rows["contact width, mm"] == "100.0"
    assert "contact_length_m" in fit.found.csv()
    assert {aim for _, aim in _deviations(fit.found)} == {"contact length", "contact width"}


@pytest.mark.parametrize("solver", [Elastic, Sloped])
def test_sensitivities_are_those_of_the_formula(solver: type[Elastic]) -> None:
    """Sensitivities are by differences, or from a solver that gives them."""
    case = case_with([], [target(name) for name in POWERS])
    problem = Problem(case, Evaluator(TyreDesign(case), _solver=solver()))
    point = problem.evaluate(np.log(list(PATCH_TRUTH.values())) + 0.05)
    elasticities = point.jacobian / (problem.scale * point.others)[:, None]
    powers = [[own[name] for name in START] for own in POWERS.values()]
    assert elasticities == pytest.approx(np.array(powers), rel=1e-4, abs=1e-6)


def test_a_pressure_that_varies_moves_nothing_at_a_pressure_of_its_own() -> None:
    own = [target(name).model_copy(update={"pressure_kPa": 200.0}) for name in POWERS]
    case = case_with([], own)
    varies = Variable(sets=["pressure_kPa"], start=240, lower=200, upper=300)
    case = changed(case, variables={"p": varies, **case.case.variables})
    problem = Problem(case, Evaluator(TyreDesign(case), _solver=Sloped()))
    point = problem.evaluate(problem.start())
    assert not point.jacobian[:, 0].any() and point.jacobian[:, 1:].any()


def test_they_come_from_a_table(tmp_path: Any) -> None:
    path = tmp_path / "measured.csv"
    path.write_text(
        "load [N],pressure [kPa],contact length [mm],contact width [mm],sigma [mm]\n"
        "4000,200,132,141,2\n4000,240,126,139,2\n"
    )
    case, left_out = with_measured(CASE, path)
    assert not left_out
    targets = [
        (t.pressure_kPa, t.contact_length_m, t.contact_width_m, t.sigma_m)
        for t in case.case.targets.footprint
    ]
    assert targets == [
        (200, 0.132, None, 0.002),
        (200, None, pytest.approx(0.141), 0.002),
        (None, 0.126, None, 0.002),
        (None, None, 0.139, 0.002),
    ]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("contact_area_m2", 0.02, "contact area 200.0 cm² ± 1.0 %"),
        ("contact_length_m", 0.132, "contact length 132.0 mm ± 1.0 %"),
        ("contact_width_m", 0.141, "contact width 141.0 mm ± 1.0 %"),
        ("vertical_stiffness_N_per_m", 2.1e5, "vertical stiffness 210.0 N/mm ± 1.0 %"),
    ],
)
def test_words_of_a_diagnosis(name: str, value: float, words: str) -> None:
    assert _measured(LoadedRow(name, None, 220.0, 4e3, value, 0.01 * value, {})) == words
