"""Standard errors, correlations and noise of a fit: their formulas, and the scatter of fits."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.variable import DesignVariable

from ..calibrated import calibrate
from ..chance import Chance, generator
from .known_truth import CASE, POWERS, evaluator, with_targets


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
