"""Forward selection of numbers to free, on linear data with a known truth."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.sensitivities.selection import ForwardSelection, chi2, forward_selection

from ..chance import Chance, generator

N, K = 24, 10  # values, numbers
Array = np.ndarray


def directions(seed: int = 1) -> tuple[Array, Array]:
    """S + J Sx J^T of values with a scatter of 0.2 % and three variables, and G (N, K), whose last
    column is nearly that of the first."""
    random = generator(seed)
    J = random.normal(0, 0.3, (N, 3))
    G = random.normal(0, 0.004, (N, K))
    G[:, -1] = 0.9 * G[:, 0] + random.normal(0, 2e-4, N)
    return 0.002**2 * np.eye(N) + 0.25 * J @ J.T, G


COVARIANCE, G = directions()


def names(selection: ForwardSelection) -> list[int]:
    return [step.place for step in selection.steps]


def test_two_planted_numbers_are_freed_and_what_looks_like_one_is_listed() -> None:
    """Without scatter: only the two and the double of the first can be chosen. The gain of both is
    what chi2 falls by."""
    r = G[:, 0] * 3 - G[:, 4] * 3
    selection = forward_selection(r, COVARIANCE, G)
    assert sorted(names(selection)) in ([0, 4], [4, 9])
    alike = {step.place: step.alike for step in selection.steps}
    assert alike.pop(4) == () and alike in ({0: (9,)}, {9: (0,)})
    assert sum(step.gain for step in selection.steps) == pytest.approx(
        selection.chi2 - selection.chi2_left
    )
    assert selection.chi2 == pytest.approx(chi2(COVARIANCE, r))
    assert all(step.p_value < 1e-3 for step in selection.steps)
    assert selection.shifts[4] == pytest.approx(-3, rel=0.1) and selection.shifts[1] == 0
    assert selection.next_p_value > 0.05


def test_gains_and_shifts_are_those_of_a_fit_with_the_knowledge_as_a_residual() -> None:
    """The closed form against least squares over variables and the freed number."""
    r = generator(2).multivariate_normal(np.zeros(N), COVARIANCE, method="cholesky") + 3 * G[:, 4]
    selection = forward_selection(r, COVARIANCE, G)
    assert names(selection)[0] == 4
    white = np.linalg.inv(np.linalg.cholesky(COVARIANCE))
    rows = np.vstack([white @ G[:, [4]], np.ones((1, 1))])
    z, left, *_ = np.linalg.lstsq(rows, np.append(white @ r, 0.0), rcond=None)
    step = selection.steps[0]
    assert step.gain == pytest.approx(selection.chi2 - left[0])
    if len(selection.steps) == 1:
        assert selection.shifts[4] == pytest.approx(z[0])
    rows = np.vstack([white @ G, np.eye(K)])
    every = np.linalg.lstsq(rows, np.append(white @ r, np.zeros(K)), rcond=None)[0]
    assert selection.shifts_of_all == pytest.approx(every)


def test_the_probability_of_the_best_gain_counts_the_choice(chance: Chance) -> None:
    """It is uniform over sound tyres, so that 5 % free a number. False failures: 1e-7."""
    factor, p_values = np.linalg.cholesky(COVARIANCE), []
    for _ in range(10):
        selection = forward_selection(factor @ chance.random.normal(size=N), COVARIANCE, G)
        first = [step.p_value for step in selection.steps] or [selection.next_p_value]
        p_values.append(first[0])
    chance.distributed(p_values, "uniform")


def test_numbers_that_move_nothing_are_never_freed() -> None:
    r = generator(3).normal(0, 0.05, N)
    for columns in (np.zeros((N, 2)), np.zeros((N, 0))):
        selection = forward_selection(r, COVARIANCE, columns)
        assert not selection.steps and selection.next_place is None
        assert selection.chi2_left == selection.chi2
