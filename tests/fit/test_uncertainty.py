"""Standard errors of a fit: formulas, scatter of fits, total errors, frequencies not measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import tyrecal
from tyrecal.files import json_text
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.model_errors import ModelErrors, road_changes
from tyrecal.studies.fit.prediction import (
    FitResponse,
    FitResponses,
    predicted_errors,
    prediction_variance,
    read_responses,
)
from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.studies.fit.road import press
from tyrecal.studies.fit.targets import ValueTarget, read_targets
from tyrecal.studies.fit.total_error import BY_SECTION, TotalError, total_error
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.inference.section_fields import fields, with_fields
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.pressure import PressureFindings
from tyrecal.studies.pressure_result import PressureRow, PressureSweep, run
from tyrecal.studies.result import ModeEntry
from tyrecal.studies.variable import DesignVariable, read_variable
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.schema import Uncertainty
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.state import TyreState

from ..chance import Chance, generator
from ..conftest import CASES
from ..solved import calibrate
from .fake import CASE, POWERS, evaluator, with_targets


def problem_of(scale: Any, targets: list, variables: list, others: Sequence = ()) -> Problem:
    """A problem of these targets that no solver answers."""
    problem: Any = Problem.__new__(Problem)
    problem.scale, problem.targets, problem.variables = scale, targets, variables
    problem.measured, problem.noise_Hz = [*targets, *others], None
    return problem


def test_uncertainty_by_its_formula() -> None:
    """B diag(sigma^2) B^T with B = (J^T J)^-1 J^T W^(1/2), unequal weights and sigmas; the noise is
    the root mean square of the frequencies' sigmas."""
    random = generator("uncertainty")
    slopes, scale = random.normal(size=(5, 2)), np.array([1.0, 4.0, 0.5, 0.0, 2.0])
    sigmas = np.array([0.1, 0.4, 0.2, 0.3])
    targets = [SimpleNamespace(sigma=s) for s in sigmas]
    variables = [DesignVariable("a", 3.0, 1.0, 9.0), DesignVariable("b", 0.0, -1.0, 3.0, log=False)]
    problem = problem_of(scale, targets, variables, [SimpleNamespace(sigma=0.05)])
    J, y = scale[:, None] * slopes, random.normal(size=5)
    at = Point({"a": 3.0, "b": 0.5}, np.zeros(2), scale * y, J, {}, 1.0, 1.0, np.empty(0))
    result = uncertainty(problem, at)
    B = np.linalg.inv(J.T @ J) @ J.T * scale
    covariance = (B * np.append(sigmas, 0.05) ** 2) @ B.T
    spread = np.sqrt(np.diag(covariance))
    assert result.standard_errors == pytest.approx(spread * [3.0, 4.0])
    assert result.correlations == pytest.approx(covariance / np.outer(spread, spread))
    assert result.singular_values == pytest.approx(np.linalg.svd(J, compute_uv=False))
    assert result.noise_Hz == pytest.approx(np.sqrt(np.mean(sigmas[:3] ** 2)))


def test_noise_is_what_is_left_over_the_freedom_that_is_left() -> None:
    """Four frequencies without sigma and two variables leave two degrees; a fifth, known one takes
    its leverage. Weights are none of the noise."""
    random = generator("noise")
    J, y = random.normal(size=(5, 2)), random.normal(size=5)
    scale = np.array([1.0, 4.0, 0.5, 2.0, 3.0])
    J = scale[:, None] * J
    variables = [DesignVariable("a", 3.0, 1.0, 9.0), DesignVariable("b", 3.0, 1.0, 9.0)]
    point_of = lambda n: Point(
        {"a": 3.0, "b": 3.0}, np.zeros(2), (scale * y)[:n], J[:n], {}, 1.0, 1.0, np.empty(0)
    )
    none = [SimpleNamespace(sigma=None)] * 4
    problem = problem_of(scale[:4], none, variables)
    result = uncertainty(problem, point_of(4))
    assert result.noise_Hz == pytest.approx(np.linalg.norm(y[:4]) / np.sqrt(2))
    problem = problem_of(scale, [*none, SimpleNamespace(sigma=0.3)], variables)
    leverage = J[4] @ np.linalg.inv(J.T @ J) @ J[4]
    noise = np.linalg.norm(y[:4]) / np.sqrt(4 - (2 - leverage))
    sigma = np.sqrt((4 * noise**2 + 0.3**2) / 5)
    assert uncertainty(problem, point_of(5)).noise_Hz == pytest.approx(sigma)


def test_a_direction_that_the_data_do_not_see() -> None:
    """The data determine the sum of two variables with one pattern, and not their difference."""
    powers = {**POWERS, "A_carcass": POWERS["A_belt"]}
    fit = calibrate(CASE, evaluator(powers=powers))  # type: ignore[arg-type]
    values = fit.result["singular_values"]
    assert values[-1] < 1e-9 * values[0]
    assert fit.result["variables"]["A_carcass"]["standard_error"] is None
    assert fit.result["variables"]["C10"]["standard_error"] is not None


@pytest.mark.slow
def test_standard_errors_are_those_of_the_fit_that_was_made(chance: Chance) -> None:
    """Unequal sigmas and weights: the scatter of 200 fits to noisy targets is the stated error.

    False failures: 6e-7.
    """
    sigma = np.array([0.05, 0.3, 0.1, 0.2, 0.1, 0.3, 0.05, 0.2, 0.4])
    exact = [t.frequency_Hz for t in CASE.case.targets.modes]
    for weights in ([1.0] * 9, [100.0, 1.0, 1.0, 0.0, 1.0, 5.0, 1.0, 0.2, 1.0]):
        fitted, stated = [], []
        for _ in range(200):
            noisy = list(exact + sigma * chance.random.normal(size=9))
            case = with_targets(frequency_Hz=noisy, sigma_Hz=list(sigma), weight=weights)
            variables = calibrate(case, evaluator()).result["variables"].values()  # type: ignore[arg-type]
            fitted.append([np.log(v["value"]) for v in variables])
            stated.append([v["standard_error"] / v["value"] for v in variables])
        for values, error in zip(np.transpose(fitted), np.mean(stated, axis=0), strict=True):
            chance.scatter(values, error)


def test_as_many_variables_as_data_tell_nothing_of_the_noise() -> None:
    weights = [1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    result = calibrate(with_targets(weight=weights), evaluator()).result  # type: ignore[arg-type]
    assert result["noise_Hz"] is None
    assert all(v["standard_error"] is None for v in result["variables"].values())


DENSITY, ANGLE = "materials.rubber.density_kg_per_m3", "rebar_layers.belt_1.angle_deg"


SIGMA = 1e-3  # relative


def coarse(known_from: str, stated: dict[str, Uncertainty]) -> LoadedCase:
    """The paper's tyre, coarse, at which its own frequencies are the targets."""
    case = tyrecal.load_case(CASES / "p235_75r17.yaml", mesh="coarse")
    section = with_part(case.case.section, known_from=known_from)
    case = changed(case, section=section, uncertainties=stated)
    hertz = frequencies(case, {})
    modes = [
        t.model_copy(update={"frequency_Hz": f, "sigma_Hz": SIGMA * f})
        for t, f in zip(case.case.targets.modes, hertz, strict=True)
    ]
    return changed(case, targets=case.case.targets.model_copy(update={"modes": modes}))


def frequencies(case: LoadedCase, numbers: dict[str, float]) -> np.ndarray:
    """Hz of the target modes at the start values with other numbers of the case."""
    labels = [t.label for t in read_targets(case)]
    question = Question({**start_values(case), **numbers})
    ((_, answer),) = find_modes(Evaluator(TyreDesign(case)), [question], lambda *_: labels, 1)
    assert isinstance(answer, LabelledModes)
    return np.array([answer.wanted[label].frequency_Hz for label in labels])


def total_of(case: LoadedCase) -> tuple[Problem, np.ndarray, TotalError]:
    """The problem, scatter (v, v) of its coordinates, and the total error at the start."""
    problem = Problem(case, Evaluator(TyreDesign(case)))
    point = problem.evaluate(problem.start())
    known = uncertainty(problem, point)
    J = point.jacobian
    return problem, np.linalg.inv(J.T @ J), total_error(problem, point, known)


@pytest.mark.slow
def test_a_constant_moves_the_variables_as_a_fit_to_another_tyre() -> None:
    """The belt's angle by one standard deviation: a step of the fit to that tyre's frequencies."""
    angle = Uncertainty(sets=[ANGLE], absolute=0.1)
    case = coarse("exact", {"angle": angle})
    problem, _, total = total_of(case)
    plain = problem.evaluate(problem.start())
    own = case.case.rebar_layers["belt_1"].angle_deg
    other = frequencies(case, {ANGLE: own + 0.1})
    J, scale = plain.jacobian, problem.scale
    wanted = np.array([t.frequency_Hz for t in problem.targets])
    step = np.linalg.lstsq(J, scale * (other - wanted), rcond=None)[0]
    share = total.shares["angle"] * np.diag(total.of_coordinates)
    np.testing.assert_allclose(np.sqrt(share), abs(step), rtol=0.02)


@pytest.mark.slow
def test_the_parts_are_the_whole() -> None:
    """Shares add to 1; a section by its size code adds more than one that is measured."""
    totals = {}
    for origin in ("measured", "size_code"):
        case = coarse(origin, {"density": Uncertainty(sets=[DENSITY], percent=1.5)})
        problem, scatter, total = total_of(case)
        np.testing.assert_allclose(np.sum([*total.shares.values()], 0), 1.0)
        weights = [t.multiplicity for t in problem.targets]
        assert weights != [1] * len(weights)  # so the scatter is no (J^T J)^-1
        totals[origin] = np.diag(total.of_coordinates)
        assert (totals[origin] > 0.5 * np.diag(scatter)).all()
    assert (totals["size_code"] > 4 * totals["measured"]).all()
    assert next(iter(total.shares)) == BY_SECTION


def test_chi2_above_its_freedom_scales_the_total() -> None:
    case = coarse("exact", {"density": Uncertainty(sets=[DENSITY], percent=1.5)})
    problem, _, total = total_of(case)
    point = problem.evaluate(problem.start())
    errors = [
        total.by_variable(problem, point, chi2)["C10"]["standard_error_total"]
        for chi2 in (None, 0.5, 4.0)
    ]
    assert errors[:2] == [errors[0]] * 2
    assert errors[2] == pytest.approx(2 * errors[0])
    # what predictions are made of states the scatter of each target, relative
    assert [each.scatter for each in total.responses] == pytest.approx(
        [SIGMA] * len(problem.targets)
    )


def test_why_it_is_not_known() -> None:
    """A solver without exact sensitivities: the reason is in the result, and no number."""
    fit = calibrate(CASE, evaluator())  # type: ignore[arg-type]
    result = fit.result
    assert all(
        v["standard_error_total"] is None for v in fit.found.model_dump()["variables"].values()
    )
    assert result["total_error_unknown"]
    assert "not known" in fit.found.sentences()[0]


def test_one_value_whose_scatter_is_not_known_leaves_the_whole_unknown() -> None:
    problem = Problem(CASE, evaluator())  # type: ignore[arg-type]
    point = problem.evaluate(problem.start())
    scatter = uncertainty(problem, point)
    sigma = np.where(np.arange(len(scatter.sigma)), scatter.sigma, np.nan)
    with pytest.raises(ValueError, match="standard deviation"):
        total_error(problem, point, replace(scatter, sigma=sigma))


def test_the_models_error_on_the_road_adds_its_variance() -> None:
    rows = (Observable("vertical_stiffness_N_per_m", None, 240.0),) * 2
    errors = ModelErrors(rows, [], np.zeros((2, 0)), 0.0, np.array([0.0, 0.02]))
    scatter = np.array([0.01, 0.03])
    added = errors.covariance(scatter) - replace(errors, road=np.zeros(2)).covariance(scatter)
    np.testing.assert_allclose(added, np.diag([0, 4e-4]), atol=1e-12)


@pytest.mark.slow
def test_changes_on_the_road_are_those_of_other_tyres() -> None:
    """Pressure, the meridian and the stiffness of compounds: stiffness and area of a tyre that has
    a fifth of a standard deviation of each, within 3 % of the change and 1e-4."""
    case = tyrecal.load_case(CASES / "p235_75r17.yaml", mesh="coarse")
    section = with_part(case.case.section, known_from="drawing")
    case = changed(case, section=section)
    names = ("pressure", "section meridian 2", "section stiffness 1")
    known = [source for source in sources(case)[0] if source.name in names]
    assert [source.name for source in known] == list(names)
    state = TyreState(load_N=3000.0)
    targets = [
        ValueTarget(name, 1.0, 0.1, state=state)
        for name in ("vertical_stiffness_N_per_m", "contact_area_m2")
    ]
    values, share = start_values(case), 0.2
    changes = road_changes(case, Evaluator(TyreDesign(case)), targets, values, known)
    kPa = case.case.pressure_kPa + share * known[0].steps["pressure_kPa"]
    none = dict.fromkeys(fields(case), 0.0)
    others = [
        (case, {**values, "pressure_kPa": kPa}),
        *((with_fields(case, {**none, name: share}), {}) for name in names[1:]),
    ]
    (own,) = press(case, Evaluator(TyreDesign(case)), targets, [values], 1)  # at its own values
    for column, (other, there) in zip(changes.T, others, strict=True):
        (pressed,) = press(other, Evaluator(TyreDesign(other)), targets, [there], 1)
        expected = np.log(np.asarray(pressed) / own) / share
        np.testing.assert_allclose(column, expected, rtol=0.03, atol=1e-4)


@pytest.mark.numbers
def test_the_variance_is_that_of_fits_to_drawn_tyres(chance: Chance) -> None:
    """A linear model of three variables, fitted by scatter alone to 8 values, off in 3 others.

    False failures: 3e-7.
    """
    random, draws = chance.random, 5000
    n, m, v, k = 8, 3, 3, 2
    J, other = random.normal(size=(n, v)), random.normal(size=(m, v))
    G = 0.01 * random.normal(size=(n + m, k))
    scatter = 0.003 * random.uniform(0.5, 2, n)
    root = 0.004 * random.normal(size=(n + m, n + m)) / np.sqrt(n + m)
    W = np.diag(scatter**-2)
    R = np.linalg.solve(J.T @ W @ J, J.T @ W)
    variance = prediction_variance(other, R, scatter, root @ root.T + G @ G.T)
    off = random.normal(size=(draws, n + m)) @ root.T + random.normal(size=(draws, k)) @ G.T
    measured = off[:, :n] + scatter * random.normal(size=(draws, n))  # of a tyre with x = 0
    errors = measured @ R.T @ other.T - off[:, n:]
    for own, spread in zip(errors.T, np.sqrt(variance), strict=True):
        chance.distributed(own, norm(scale=spread).cdf)


@pytest.mark.slow
def test_a_sweep_of_a_fitted_design_has_intervals(tmp_path: Path) -> None:
    """The fit to a tyre with another belt angle is off at another pressure as the standard error by
    the angle has it, which is what it adds to that by the mesh; the initial design has none."""
    case = coarse("exact", {"angle": Uncertainty(sets=[ANGLE], absolute=1.0)})
    start, kPa = start_values(case), 1.4 * case.case.pressure_kPa
    evaluator = Evaluator(TyreDesign(case))
    layers = dict(case.case.rebar_layers)
    layers["belt_1"] = layers["belt_1"].model_copy(
        update={"angle_deg": layers["belt_1"].angle_deg + 1.0}
    )
    turned = replace(case, case=case.case.model_copy(update={"rebar_layers": layers}))
    there = Evaluator(TyreDesign(turned))
    pressures = [case.case.pressure_kPa, kPa]
    own = run(turned, there, {"initial": start}, pressures).rows
    hertz = [{mode.label: mode.frequency_Hz for mode in row.modes} for row in own]
    modes = []
    for t in case.case.targets.modes:
        f = next(f for x, f in hertz[0].items() if (x.c, x.m, x.kind) == (t.c, t.m, t.kind))
        modes.append(t.model_copy(update={"frequency_Hz": f, "sigma_Hz": 1e-5 * f}))
    targets = case.case.targets.model_copy(update={"modes": modes})
    measured = replace(case, case=case.case.model_copy(update={"targets": targets}))
    fit = calibrate(measured, evaluator.of(TyreDesign(measured)), "gauss-newton").found
    (tmp_path / "fit.json").write_text(json_text(fit.content() | {"chi2_per_dof": None}))
    known = read_responses(tmp_path)
    assert len(known.responses) == len(modes)
    fitted = {name: each.value for name, each in fit.variables.items()}
    designs = {"initial": start, "fitted": fitted}
    sure = {"angle": Uncertainty(sets=[ANGLE], absolute=1e-6)}
    by_mesh = replace(measured, case=measured.case.model_copy(update={"uncertainties": sure}))
    errors = []
    for each in (measured, by_mesh):
        swept = run(each, evaluator, designs, [kPa], fit=known)
        initial, predicted = (row.modes for row in swept.rows)
        assert all(mode.standard_error_Hz is None for mode in initial)
        errors.append(np.array([mode.standard_error_Hz or np.nan for mode in predicted]))
    off = np.array([mode.frequency_Hz - hertz[1][mode.label] for mode in predicted])
    assert max(abs(off)) > 0.1
    by_angle = np.sqrt(errors[0] ** 2 - errors[1] ** 2)
    np.testing.assert_allclose(by_angle, abs(off), atol=0.01, rtol=0.1)
    assert "standard_error_Hz" in swept.csv()


def test_what_the_data_leave_of_the_prior_adds_to_predictions(monkeypatch: Any) -> None:
    """All of it, by a fit that does not answer its data."""
    J = generator("prior").normal(size=(2, len(CASE.case.variables)))
    answer = J, np.zeros((2, 0)), 0.0
    monkeypatch.setattr("tyrecal.studies.fit.prediction.linear_answer", lambda *_: answer)
    measured = [FitResponse(c=2, m=0, pressure_kPa=240.0, scatter=0.01, response={})]
    wanted, variance = [(Label(2, 0), 300.0)], []
    for prior in (True, False):
        fit = FitResponses(responses=measured, prior=prior)
        variance.append(predicted_errors(CASE, Any, {}, fit, wanted) ** 2)
    spread = [read_variable(CASE, name).spread for name in CASE.case.variables]
    assert variance[0] - variance[1] == pytest.approx(((J[1] * spread) ** 2).sum())


def test_a_table_shows_the_half_width_of_the_interval() -> None:
    mode = ModeEntry(c=2, m=0, kind=None, frequency_Hz=79.5, standard_error_Hz=1.0)
    rows = [PressureRow(design="fitted", pressure_kPa=p, modes=[mode]) for p in (200, 250)]
    curve = {"c": 2, "m": 0, "kind": None, "rise_Hz": 0.0, "rise_percent": 0.0, "curvature": ""}
    ends = PressureFindings(design="fitted", from_kPa=200, to_kPa=250, modes=[curve], words=[])
    (table,) = PressureSweep(rows=rows, findings=[ends]).tables()
    assert list(table.rows[0][2:4]) == ["79.50 ± 1.6", "79.50 ± 1.6"]
    assert "90 % interval of the tyre's own frequency" in table.caption
