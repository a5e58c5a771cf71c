"""A fit with what is known before: the normal posterior where the model is linear, and `sample`.

Design variables: their coordinates, how well a start is known, sizes of effects next to 0.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import tyrecal
from tyrecal.cli.main import cli
from tyrecal.errors import InputError
from tyrecal.files import read_json
from tyrecal.simulate.deck.tyre_design import NEAR_ZERO, TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.studies.fit import model_errors
from tyrecal.studies.fit.free import freed_variables, with_freed
from tyrecal.studies.fit.prior import PriorProblem
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.variable import DesignVariable, read_variable, read_variables
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.schema import TargetMode, Variable
from tyrecal.tyre.values import overridden

from ..chance import generator
from ..conftest import CASES
from ..solved import calibrate
from .test_uncertainty import coarse
from .tyre_in_states import CASE, SIGMA, START, TRUTH, TyreInStates, case_with, fitted, measured

Array = np.ndarray


class _Errors:
    """Model errors with a covariance that is given, plus the scatter."""

    def __init__(self, covariance: Array):
        self.of_model = self.form = covariance
        self.known, self.by_constants = list[Any](), np.zeros((len(covariance), 0))

    def covariance(self, scatter: Array) -> Array:
        return self.of_model + np.diag(scatter**2)


def problem_with(count: int, monkeypatch: Any) -> tuple[PriorProblem, Array, Array]:
    """The first ``count`` frequencies of a tyre whose ln f is linear in x; J and Sigma."""
    case = case_with(measured()[:count])
    tyre = TyreInStates()
    problem = PriorProblem(case, tyre)  # type: ignore[arg-type]
    random = generator("prior", count)
    root = 0.01 * random.normal(size=(count, count))
    errors = _Errors(root @ root.T)
    monkeypatch.setattr("tyrecal.studies.fit.prior.model_errors", lambda *_: errors)
    point = problem.evaluate(problem.start()).plain
    J = point.jacobian / problem.scale[:, None] / (problem.reference * np.exp(0))[:, None]
    q = problem.reference + point.residuals / problem.scale
    return problem, J * (problem.reference / q)[:, None], errors.covariance(problem.scatter)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_a_linear_model_has_its_normal_posterior(count: int, monkeypatch: Any) -> None:
    """Mean and covariance by the textbook, with fewer values than variables too: in gain form,
    K = S J^T (J S J^T + Sigma)^-1, which shares nothing with the code."""
    problem, J, sigma = problem_with(count, monkeypatch)
    S = np.diag(problem.spread**2)
    K = S @ J.T @ np.linalg.inv(J @ S @ J.T + sigma)
    start = problem.evaluate(problem.mean)
    q = problem.reference + start.plain.residuals / problem.scale
    expected = problem.mean + K @ np.log(problem.reference / q)
    step = np.linalg.lstsq(start.jacobian, -start.residuals, rcond=None)[0]
    np.testing.assert_allclose(problem.mean + step, expected, rtol=1e-6)
    there = problem.evaluate(expected)
    assert np.linalg.norm(there.gradient) < 1e-3
    C = S - K @ J @ S
    scatter, used = problem.scatter * problem.reference, problem.scale > 0
    np.testing.assert_allclose(
        problem.covariance_by(there, scatter, used)[0], C, rtol=1e-6, atol=1e-12
    )
    # the same by what the fit answers to the data and to what was known before
    B = problem.response(there)[0] * problem.reference
    parts = B @ sigma @ B.T + problem.left_of_prior(there)
    np.testing.assert_allclose(parts, C, rtol=1e-6, atol=1e-12)
    assert len(uncertainty(problem, there.plain).standard_errors) == len(START)


def test_a_state_left_out_is_its_rows_left_out(monkeypatch: Any) -> None:
    """Rows without weight and rows that are left out are the same to the posterior."""
    problem, J, sigma = problem_with(9, monkeypatch)
    there = problem.evaluate(problem.mean)
    keep = np.arange(9) < 4
    C, _ = problem.covariance_by(there, np.empty(0), keep)
    S, own = np.diag(problem.spread**2), sigma[:4, :4]
    J = J[:4]
    expected = S - S @ J.T @ np.linalg.solve(J @ S @ J.T + own, J @ S)
    np.testing.assert_allclose(C, expected, rtol=1e-6, atol=1e-12)


def test_a_weight_divides_a_values_variance(monkeypatch: Any) -> None:
    """100 times the weight of 10 times the sigma is the same value, in the errors and chi2 too."""
    errors = lambda *_: _Errors(1e-4 * np.eye(4))
    for module in ("prior", "total_error"):
        monkeypatch.setattr(f"tyrecal.studies.fit.{module}.model_errors", errors)
    plain, loose = measured()[:4], measured(sigma=10 * SIGMA)[:4]
    heavy = [each.model_copy(update={"weight": 100.0}) for each in loose]
    own, same = (fitted(case_with(rows), prior=True).found for rows in (plain, heavy))
    assert same.chi2_per_dof == pytest.approx(own.chi2_per_dof, rel=1e-3)
    for name, each in own.variables.items():
        total = same.variables[name].standard_error_total
        assert total == pytest.approx(each.standard_error_total, rel=1e-3)
        assert each.explained_by_data is not None and 0 <= each.explained_by_data < 1


@pytest.mark.parametrize("method", ["slsqp", "gauss-newton"])
def test_a_fit_ends_where_its_weights_hold(method: str, monkeypatch: Any) -> None:
    """Little scatter and a model without errors: the truth; many errors: what was known."""
    for size in (1e-6, 10.0):
        errors = _Errors(size**2 * np.eye(9))
        monkeypatch.setattr("tyrecal.studies.fit.prior.model_errors", lambda *_, e=errors: e)
        monkeypatch.setattr("tyrecal.studies.fit.total_error.model_errors", model_errors)
        case = case_with(measured(sigma=1e-3)[:9])
        fit = calibrate(case, TyreInStates(), method, prior=True)  # type: ignore[arg-type]
        wanted = TRUTH if size < 1 else START
        for name, value in fit.fitted.plain.values.items():
            assert value == pytest.approx(wanted[name], rel=0.02 if size < 1 else 0.2), name
        assert fit.found.prior and fit.found.converged


def test_targets_and_solvers_without_model_errors_are_refused_before_a_run() -> None:
    """Modes under load, and a solver without sensitivities: one sentence, nothing evaluated."""
    tyre = TyreInStates()
    tyre.solver.capabilities = {"spindle", "loaded_modes"}
    loaded = TargetMode(c=1, m=0, symmetry="symmetric", load_N=4000, frequency_Hz=60, sigma_Hz=1)
    case = case_with([*measured()[:4], loaded])
    with pytest.raises(InputError, match="--prior takes no frequencies under load"):
        calibrate(case, tyre, prior=True)  # type: ignore[arg-type]
    tyre.has_gradients = False
    with pytest.raises(DeckRefused, match=r"--prior needs.*\(gradients\)"):
        calibrate(case_with(measured()[:4]), tyre, prior=True)  # type: ignore[arg-type]
    assert not tyre.asked


@pytest.mark.parametrize("name", ["rubber_density", "belt_1_angle", "sidewall_gauge"])
def test_a_freed_number_is_known_as_its_uncertainty_states(name: str) -> None:
    """A logarithm, an angle, and a number that is 0: the coordinate's spread is one sd of it."""
    case = with_freed(CASE, [name])
    own = read_variable(case, name)
    sd = freed_variables(case)[name].sd
    assert own.spread * own.slope(own.start) == pytest.approx(sd)


def test_too_few_values_without_sigma_are_refused_without_a_fit() -> None:
    """Two frequencies without sigma for three variables: the message says what --prior lacks."""
    two = [each.model_copy(update={"sigma_Hz": None}) for each in measured()[:2]]
    tyre = TyreInStates()
    with pytest.raises(InputError, match="have no sigma_Hz, and are too few"):
        calibrate(case_with(two), tyre, prior=True)  # type: ignore[arg-type]
    assert not tyre.asked


@pytest.mark.slow
def test_it_agrees_with_sample() -> None:
    """Where the data determine the variables and the model is nearly linear, the errors are those
    of `sample` within 5 %, and the values within a fifth of them."""
    case = coarse("exact", {})
    start = case.case.variables["C10"].start
    changed = {"C10": case.case.variables["C10"].model_copy(update={"start": 1.05 * start})}
    case = replace(
        case, case=case.case.model_copy(update={"variables": {**case.case.variables, **changed}})
    )
    fit = calibrate(case, Evaluator(TyreDesign(case)), "gauss-newton", prior=True).found
    assert fit.verdict == "fits"
    sample = tyrecal.run("sample", case)
    for name, each in fit.variables.items():
        own = sample.variables[name]
        assert each.standard_error_total == pytest.approx(own.standard_error, rel=0.05), name
        assert abs(each.value - own.best) < 0.2 * own.standard_error, name
        for other, correlation in fit.correlations[name].items():
            if other != name:
                assert correlation == pytest.approx(sample.correlations[name][other], abs=0.05)


@pytest.mark.slow
def test_fewer_values_than_variables(tmp_path: Any, capsys: Any) -> None:
    """Two frequencies for three variables: refused without --prior; with it each variable says what
    the data added, and the screen has it."""
    table = tmp_path / "two.csv"
    table.write_text("c,m,frequency_Hz,sigma_Hz,pressure_kPa\n2,0,79.5,0.3,240\n1,1,37.8,0.3,240\n")
    case = str(CASES / "p235_75r17.yaml")
    words = ["fit", case, "--measured", str(table), "--mesh", "coarse", "--no-pictures"]
    with pytest.raises(InputError, match=r"cannot determine 3 free variables.*--prior"):
        cli([*words, "--output", str(tmp_path / "a")], standalone_mode=False)
    assert cli([*words, "--prior", "--output", str(tmp_path / "b")], standalone_mode=False) == 0
    assert "by data %" in capsys.readouterr().out
    result = read_json(tmp_path / "b" / "fit.json")
    shares = [each["explained_by_data"] for each in result["variables"].values()]
    assert result["prior"] and all(0 <= share < 1 for share in shares) and max(shares) > 0.5


def read(variable: Variable) -> DesignVariable:
    """Read a variable as "x" of a case."""
    case = CASE.case.model_copy(update={"variables": {"x": variable}})
    return read_variable(replace(CASE, case=case), "x")


def test_a_variable_stays_next_to_0_where_it_moves_effects_alone() -> None:
    """Most effects leave the deck at 0, and have no slope there; other numbers have one."""

    def made(sets: list[str], lower: float, upper: float, start: float = 0.0) -> DesignVariable:
        return read(Variable(sets=sets, lower=lower, upper=upper, start=start, scale="linear"))

    both, other = ["effects.a", "effects.b"], ["effects.a", "pressure_kPa"]
    near = made(both, 0.0, 2.0)
    assert near.lower == near.start == 2 * NEAR_ZERO > 0 and near.upper == 2.0
    near = made(both, -3.0, 0.0)
    assert near.upper == near.start == -3 * NEAR_ZERO and near.lower == -3.0
    far = made(both, -3.0, 2.0, 0.5)
    assert (far.lower, far.start, far.upper) == (-3.0, 0.5, 2.0)
    for sets in (other, other[::-1], other[1:]):
        assert made(sets, 0.0, 2.0).lower == made(sets, 0.0, 2.0).start == 0.0


@pytest.mark.parametrize("log", [True, False])
def test_a_variables_coordinate_and_back(log: bool) -> None:
    """A logarithm, or the share of the way between the bounds; values stay within them, and the
    start is met to the last bit."""
    v = DesignVariable("x", 0.7, 0.3, 2.3, log)
    for value in (0.3, 0.5, 0.7, 1.9, 2.3):
        x = v.scaled(value)
        assert x == pytest.approx(np.log(value) if log else (value - 0.3) / 2.0)
        assert v.value(x) == pytest.approx(value, rel=1e-14)
        rise = (v.value(x + 1e-6) - v.value(x - 1e-6)) / 2e-6
        if 0.3 < value < 2.3:
            assert v.slope(value) == pytest.approx(rise, rel=1e-6)
    assert v.value(v.scaled(0.7)) == 0.7
    assert v.value(v.scaled(2.3) + 1) == 2.3 and v.value(v.scaled(0.3) - 1) == 0.3


def test_how_well_a_start_is_known() -> None:
    """A start is known as stated, else by 0.5 of a logarithm, and never worse than uniformly
    within the bounds. A linear variable that states nothing is uniform."""
    spread = lambda log, lower, upper, percent=None: (
        DesignVariable("x", 2.0, lower, upper, log, percent).spread
    )
    assert spread(True, 0.2, 20.0) == 0.5
    assert spread(True, 0.2, 20.0, 20.0) == pytest.approx(np.log(1.2))
    assert spread(True, 0.2, 20.0, 900.0) == pytest.approx(np.log(100) / 12**0.5)
    assert spread(True, 1.9, 2.1) == pytest.approx(np.log(2.1 / 1.9) / 12**0.5)
    assert spread(False, 1.0, 5.0) == pytest.approx(1 / 12**0.5)
    assert spread(False, 1.0, 5.0, 10.0) == pytest.approx(0.2 / 4)
    assert read(Variable(sets=["a"], start=2, lower=1, upper=5, percent=7)).percent == 7


def test_a_variable_starts_where_its_user_has_set_it() -> None:
    """Within its bounds; the case's own start stays what its file says."""
    case = overridden(CASE, {"C10": 2e6})
    assert start_values(case)["C10"] == read_variable(case, "C10").start == 2e6
    assert case.case.variables["C10"].start == 1e6 and start_values(CASE)["C10"] == 1e6
    outside = overridden(CASE, {"C10": 2e7})  # which other studies than a fit evaluate
    with pytest.raises(InputError, match=r"'C10' starts at 2e.07: it must start within its"):
        read_variables(outside)
    with pytest.raises(ValueError, match="C10_Pa is set by the variable 'C10': set C10 instead"):
        overridden(CASE, {"materials.rubber.C10_Pa": 2e6})
