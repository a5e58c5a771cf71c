"""Selection of the numbers to free, on linear data with a known truth."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.sensitivities.selection import (
    Candidates,
    SelectedNumbers,
    likeliest_shifts,
    select_numbers,
)

from ..chance import Chance, generator

N, K = 24, 10  # values, numbers
Array = np.ndarray


def directions() -> tuple[Array, Array]:
    """S of values with a scatter of 0.2 % and three variables, and G (N, K), whose last column is
    nearly that of the first."""
    random = generator("selection")
    J = random.normal(0, 0.3, (N, 3))
    G = random.normal(0, 0.004, (N, K))
    G[:, -1] = 0.9 * G[:, 0] + random.normal(0, 1e-4, N)
    return 0.002**2 * np.eye(N) + 0.25 * J @ J.T, G


COVARIANCE, G = directions()
FACTOR = np.linalg.cholesky(COVARIANCE)
BASE = Candidates.of(np.zeros(N), COVARIANCE, G)


def select(r: Array) -> SelectedNumbers:
    """The selection, with the draws of chance made once for all tests."""
    candidates = Candidates.of(r, COVARIANCE, G)
    candidates.__dict__["draws"] = BASE.draws
    return select_numbers(candidates)


def test_two_planted_numbers_are_freed_and_what_looks_like_one_is_listed() -> None:
    """Without scatter nothing else is chosen, and nothing is left."""
    selection = select(2 * G[:, 0] - 2.5 * G[:, 4])
    shift = {each.place: each.shift for each in selection.numbers}
    assert shift == pytest.approx({0: 2.0, 4: -2.5}, abs=1e-3)
    assert {each.place: each.alike for each in selection.numbers} == {0: (9,), 4: ()}
    assert all(each.p_value < 1e-3 for each in selection.numbers)
    assert selection.chi2_left == pytest.approx(0, abs=1e-3) and selection.next_p_value > 0.05


def test_a_number_is_freed_within_three_standard_deviations() -> None:
    """The rest stays a deviation; the gain is that of the bounded least squares."""
    r = 5 * G[:, 4]
    candidates, white = Candidates.of(r, COVARIANCE, G[:, [4]]), np.linalg.inv(FACTOR)
    (number,) = select_numbers(candidates).numbers
    assert number.shift == pytest.approx(3)
    squares = [float(((white @ (r - z * G[:, 4])) ** 2).sum()) for z in (0, 3)]
    assert number.gain == pytest.approx(squares[0] - squares[1])
    assert select_numbers(candidates).chi2_left == pytest.approx(squares[1])


def test_a_number_that_only_imitates_two_is_taken_out_again() -> None:
    """Its column is half of either, so that it alone gains most, and both together leave less."""
    columns = np.column_stack([G[:, :3], 0.7 * (G[:, 0] + G[:, 1])])
    columns[:, 3] += generator("imitates").normal(0, 1.5e-3, N)
    candidates = Candidates.of(2 * G[:, 0] + 2 * G[:, 1], COVARIANCE, columns)
    assert candidates.best([])[0] == 3
    assert {each.place for each in select_numbers(candidates).numbers} == {0, 1}


def test_likeliest_shifts_are_those_of_least_squares_with_the_knowledge_as_residuals() -> None:
    r = FACTOR @ generator("all free").normal(size=N) + 2 * G[:, 4]
    rows = np.vstack([np.linalg.solve(FACTOR, G), np.eye(K)])
    wanted = np.append(np.linalg.solve(FACTOR, r), np.zeros(K))
    every = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    assert likeliest_shifts(r, COVARIANCE, G) == pytest.approx(every)


def test_the_probability_of_the_best_gain_counts_the_choice(chance: Chance) -> None:
    """It is uniform over sound tyres, so that 5 % free a number. False failures: 1e-7."""
    p_values = []
    for _ in range(30):
        candidates = Candidates(chance.random.normal(size=N), BASE.G)
        candidates.__dict__["draws"] = BASE.draws
        p_values.append(candidates.best([])[1])
    chance.distributed(p_values, "uniform")


def test_numbers_that_move_nothing_are_never_freed() -> None:
    r = generator("nothing").normal(0, 0.05, N)
    for columns in (np.zeros((N, 2)), np.zeros((N, 0))):
        selection = select_numbers(Candidates.of(r, COVARIANCE, columns))
        assert not selection.numbers and selection.next_place is None
        assert selection.chi2_left == selection.chi2
