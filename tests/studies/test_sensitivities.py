"""Sensitivities of the coarse tyre to its numbers, against differences of its frequencies.

Selection of the numbers to free, on linear data with a known truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import labelled
from tyrecal.studies.fit.targets import ValueTarget
from tyrecal.studies.sensitivities import table as table_module
from tyrecal.studies.sensitivities.deviations import deviations
from tyrecal.studies.sensitivities.selection import (
    Candidates,
    SelectedNumbers,
    likeliest_shifts,
    select_numbers,
)
from tyrecal.studies.sensitivities.table import Sensitivities, numbers_of, sensitivities
from tyrecal.tyre.case import start_values
from tyrecal.tyre.values import tyre_numbers

from ..chance import Chance, generator
from ..effects.support import coarse

CASE = coarse()
EVALUATOR = Evaluator(TyreDesign(CASE))
START = start_values(CASE)
ANGLES = {f"rebar_layers.{name}.angle_deg" for name in ("belt_1", "belt_2")}
STEP = 1e-3  # of a logarithm, to either side: differences are right to its square
Array = np.ndarray


@cache
def table() -> Sensitivities:
    return sensitivities(CASE, EVALUATOR, START, of=("frequency", "mass"))


def ln_q(values: dict[str, float]) -> Array:
    """ln of the frequencies and of the mass, in the order of the table."""
    evaluation = EVALUATOR.evaluate(Question({**START, **values}))
    hertz = {str(mode.label): mode.frequency_Hz for mode in labelled(evaluation)}
    places = [name.removeprefix("frequency_Hz ") for name in table().quantities]
    return np.log([*(hertz[name] for name in places[:-1]), evaluation.mass_kg])


def moved(by: str, share: float) -> float:
    """A number changed by a share of it, an angle by as many radians of degrees."""
    x = table().numbers[by]
    return x + share if by in ANGLES else x * float(np.exp(share))


def slope(by: str) -> Array:
    """The table's column of a number."""
    return np.array([row.value for row in table().rows if row.by == by])


def test_all_numbers_are_in_the_table_of_one_evaluation() -> None:
    """Variables by name, other numbers by path; those that move nothing are listed apart."""
    runs = EVALUATOR.counts.runs
    table()
    assert EVALUATOR.counts.runs - runs <= 2  # the tyre as its file has it begins every inflation
    own = {row.by for row in table().rows}
    assert {*START, "pressure_kPa", "materials.rubber.density_kg_per_m3", *ANGLES} <= own
    assert not {"rebar_layers.belt_1.area_m2", "rim.mass_kg", "effects.cap_ply"} & own
    assert "rim.mass_kg" in table().unmoved and own.isdisjoint(table().unmoved)
    assert own | {*table().unmoved} == {*START, *tyre_numbers(CASE)}
    assert {row.by: row.per for row in table().rows if row.per} == dict.fromkeys(ANGLES, "degree")


def test_frequencies_and_mass_move_as_the_table_states() -> None:
    """All numbers at once by shares of their own, up and down: a wrong entry would show."""
    own = list(dict.fromkeys(row.by for row in table().rows))
    shares = dict(zip(own, STEP * generator(7).choice([-1.0, 1.0], len(own)), strict=True))
    above, below = (
        ln_q({by: moved(by, side * share) for by, share in shares.items()}) for side in (1, -1)
    )
    expected = np.sum([slope(by) * share for by, share in shares.items()], axis=0)
    assert (above - below) / 2 / STEP == pytest.approx(expected / STEP, abs=1e-5)


@pytest.mark.slow
def test_each_sensitivity_is_that_of_central_differences() -> None:
    for by in dict.fromkeys(row.by for row in table().rows):
        change = ln_q({by: moved(by, STEP)}) - ln_q({by: moved(by, -STEP)})
        assert change / 2 / STEP == pytest.approx(slope(by), abs=1e-5), by


@pytest.mark.slow
def test_fewer_values_than_variables_leave_as_many_degrees_of_freedom(tmp_path: Path) -> None:
    """chi2 has the variables' spread in its covariance, so no value is lost to them."""
    data = tmp_path / "two.csv"
    data.write_text("c,m,frequency_Hz,sigma_Hz,pressure_kPa\n2,0,79.5,0.3,240\n1,1,37.8,0.3,240\n")
    assert deviations(CASE, EVALUATOR, data).freedom == 2


def test_a_number_that_is_0_has_its_sensitivity_per_unit() -> None:
    by = "effects.rim_width"
    rows = sensitivities(CASE, EVALUATOR, START, by=(by,), of=("frequency", "mass")).rows
    assert {row.per for row in rows} == {"m"}
    change = (ln_q({by: 1e-4}) - ln_q({by: -1e-4})) / 2e-4
    assert change == pytest.approx([row.value for row in rows], rel=1e-3, abs=1e-4)


def test_quantities_on_the_road_have_the_sensitivities_of_a_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As `fit` has them of targets there; loads by default the case's middle one."""
    given: list[object] = []

    def press(case: object, evaluator: object, targets: Sequence[ValueTarget], *rest: Any) -> Any:
        given.extend((each.quantity, each.state.load_N) for each in targets)
        return np.array([2e5, 0.02]), np.array([[400.0], [-3e-5]])

    monkeypatch.setattr(table_module, "press_with_slopes", press)
    kinds = ("vertical_stiffness", "contact_area_m2")
    stiffness, area = sensitivities(CASE, EVALUATOR, START, ("pressure_kPa",), kinds).rows
    assert given == [("vertical_stiffness_N_per_m", 4000.0), ("contact_area_m2", 4000.0)]
    assert stiffness.quantity == "vertical_stiffness_N_per_m 4000 N"
    assert stiffness.value == pytest.approx(240 * 400 / 2e5)
    assert area.value == pytest.approx(-240 * 3e-5 / 0.02)


@pytest.mark.parametrize(
    ("by", "words"),
    [
        ("C11", "did you mean 'C10'"),
        ("rebar_layers.belt_1.area_m2", "set by the variable 'A_belt': name A_belt instead"),
        ("name", "name is not a number"),
        ("rim.free", "rim.free is not a number"),
        ("variables.C10.start", "is no number of the tyre"),
    ],
)
def test_what_is_no_number_of_the_tyre_is_refused(by: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        numbers_of(CASE, [by])


@pytest.mark.parametrize(
    ("by", "of", "words"),
    [
        ("effects.cap_ply", "frequency", "effects.cap_ply is 0, where keywords"),
        ("C10", "stiffness", "there is no quantity 'stiffness'"),
    ],
)
def test_what_has_no_sensitivity_is_refused(by: str, of: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        sensitivities(CASE, EVALUATOR, START, [by], [of])


N, K = 24, 10  # values, numbers


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
