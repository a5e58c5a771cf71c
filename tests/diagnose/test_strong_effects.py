"""Effects so strong, or labels so wrong, that the plain tyre that fits them is no tyre."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.evidence import refit
from tyrecal.studies.diagnose.labelings import exchange_shifts, rows_if_exchanged, with_exchanged
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.inference.model import Answer, EffectRange, Query
from tyrecal.studies.inference.plain_fit import plain_fit

from .toy import LABELS, Toy, problem

pytestmark = pytest.mark.numbers

X = np.array([0.2, -0.1, 0.15])
ASSUMED = Assumed(form=0.001, response_error=0.02)


class Strong(Toy):
    """Effects of up to 30 % of a frequency, near to what variables do, in a model that bends."""

    def __init__(self) -> None:
        super().__init__(effects=3, size=0.02, bend=0.05)
        self.g["e0"] = self.J @ [1.5, -1.0, 0.8] + 5 * self.g["e0"]

    def measured(self, **effects: float) -> np.ndarray:
        (answer,) = self.answers([Query(X, effects)])
        assert isinstance(answer, Answer)
        return answer.eta


def diagnosed(toy: Toy, y: np.ndarray, known: bool) -> Diagnosis:
    p = problem(toy, y, assumed=ASSUMED)
    about = expand(toy, np.zeros(3)) if known else None
    return diagnose(toy, toy.rows, p.observations, assumed=ASSUMED, known=about)


@pytest.mark.parametrize("known", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_strong_effect_does_not_drive_the_expansion_away(known: bool) -> None:
    """The plain fit is ten times as far from the truth as the tyre that the model is expanded
    about; the effect is named, at its size and with its variables."""
    toy = Strong()
    y = toy.measured(e0=0.9)
    p = problem(toy, y, assumed=ASSUMED)
    astray = abs(plain_fit(toy, p.observations, p.places, 0.001) - X).max()
    d = diagnosed(toy, y, known)
    x0 = d.problem.expansion.x0
    assert astray > 0.8 and abs(x0 - X).max() < 0.2
    assert d.verdict.key == "e0" and d.probabilities["e0"] > 0.8
    assert d.parameter("e0")["value"] == pytest.approx(0.9, abs=0.02)
    h = d.hypothesis("e0")
    assert x0 + h.fitted.d[h.best] == pytest.approx(X, abs=0.05)


class Bounded(Strong):
    """The last step of the fit leads to where the plain tyre has no solution."""

    def _answer(self, point: Query) -> Answer:
        if point.coupled and abs(point.x - X).max() < 0.2:
            return EvaluationFailed("no_equilibrium", "none")  # type: ignore[return-value]
        return super()._answer(point)


@pytest.mark.slow
def test_where_there_is_no_tyre_to_expand_about_the_first_expansion_stays() -> None:
    toy = Bounded()
    y = toy.measured(e0=0.9)
    d = diagnosed(toy, y, True)
    p = problem(toy, y, assumed=ASSUMED)
    own = plain_fit(toy, p.observations, p.places, 0.001, expand(toy, np.zeros(3)))
    assert d.problem.expansion.x0.tolist() == own.tolist()


def test_a_tyre_that_fits_is_expanded_about_its_own_fit() -> None:
    toy = Strong()
    p = problem(toy, toy.measured(), assumed=ASSUMED)
    d = diagnosed(toy, toy.measured(), False)
    own = plain_fit(toy, p.observations, p.places, 0.001)
    assert d.problem.expansion.x0.tolist() == own.tolist()


@pytest.mark.slow
def test_labels_that_are_exchanged_are_found_beside_a_strong_effect() -> None:
    toy, n = Strong(), len(LABELS)
    a, b = LABELS[6], LABELS[7]
    y = toy.measured(e0=0.9)
    toy.base[7::n] += 0.06 + y[6::n] - y[7::n]  # 6 % apart, with the effect
    p = problem(toy, toy.measured(e0=0.9), assumed=ASSUMED)
    wrong = with_exchanged(p.observations, a, b)
    d = diagnose(toy, toy.rows, wrong, assumed=ASSUMED)
    assert d.exchanged == (a, b) and d.verdict.key == "e0"


@pytest.mark.slow
def test_labels_that_lie_near_each_other_at_one_pressure_alone_may_be_exchanged() -> None:
    """Read there, they are followed to others, where they lie 35 % apart."""
    toy, n = Strong(), len(LABELS)
    a, b = LABELS[6], LABELS[7]
    y = toy.measured()
    toy.base[7::n] += np.array([0.25, 0.35, 0.35]) + y[6::n] - y[7::n]
    p = problem(toy, toy.measured(), assumed=ASSUMED)
    wrong = with_exchanged(p.observations, a, b)
    assert diagnose(toy, toy.rows, wrong, assumed=ASSUMED).exchanged == (a, b)
    assert diagnose(toy, toy.rows, p.observations, assumed=ASSUMED).exchanged is None


@pytest.mark.slow
def test_exchanged_labels_are_put_right_where_one_of_the_two_is_missing() -> None:
    """A sound tyre is sound; exchanged twice its labels are what they were."""
    toy, n = Toy(effects=2, bend=0.0), len(LABELS)
    a, b = LABELS[6], LABELS[7]
    toy.base[7::n] = toy.base[6::n] + 0.15
    for missing in (6, 7 + n):
        keep = np.arange(3 * n) != missing
        y = toy.base + 1e-4 * np.sin(np.arange(3 * n))
        given = problem(toy, y, assumed=ASSUMED).only(keep).observations
        wrong = with_exchanged(given, a, b)
        assert set(rows_if_exchanged(wrong)) == set(toy.rows) == set(rows_if_exchanged(given))
        assert with_exchanged(wrong, a, b).rows == given.rows
        off = np.array([0.15 * ((row.label == a) - (row.label == b)) for row in wrong.rows])
        assert any(np.allclose(own, -off, atol=1e-3) for own in exchange_shifts(wrong).T)
        d = diagnose(toy, toy.rows, wrong, assumed=ASSUMED)
        assert d.exchanged == (a, b) and d.verdict.kind == "no_gap"
        assert diagnose(toy, toy.rows, given, assumed=ASSUMED).exchanged is None


class Springs(Toy):
    """Two effects that lower one mode each past the next lower one, as soft clamps do."""

    def __init__(self) -> None:
        super().__init__(effects=4, size=0.01)
        for id, label in (("e0", Label(2, 1)), ("e1", Label(3, 1))):
            self.g[id] = np.tile([-0.25 * (each == label) for each in LABELS], 3)


@pytest.mark.slow
@pytest.mark.parametrize("exchange", [False, True])
def test_two_strong_effects_are_told_from_an_exchange_of_labels(exchange: bool) -> None:
    """Beside no single effect the file fits as it is; exchanged labels take off some of that."""
    toy = Springs()
    (answer,) = toy.answers([Query(X, {"e0": 0.9, "e1": 0.8})])
    assert isinstance(answer, Answer)
    given = problem(toy, answer.eta, assumed=ASSUMED).observations
    a, b = Label(0, 0, "axial"), Label(0, 0, "torsional")
    if exchange:
        given = with_exchanged(given, a, b)
    d = diagnose(toy, toy.rows, given, assumed=ASSUMED)
    assert d.exchanged == ((a, b) if exchange else None)
    assert d.verdict.key == "e0+e1"


def test_what_an_exchange_of_labels_does_stands_beside_the_constants() -> None:
    """With any share of it in the data the fit stays where it is."""
    toy = Toy(effects=0, bend=0.0)
    toy.base[3 :: len(LABELS)] = toy.base[2 :: len(LABELS)] + 0.05
    p = problem(toy, toy.base + toy.J @ X)
    shifts = exchange_shifts(p.observations)
    assert len(shifts) == len(p.places) and np.all((abs(shifts) > 0).sum(0) == 2 * 3)
    assert shifts.sum(0) == pytest.approx(0.0, abs=1e-12)  # what one gains the other loses
    half = p.observations.y + shifts @ np.full(shifts.shape[1], 0.5)
    there = replace(p.observations, y=half)
    with_, without = (plain_fit(toy, there, p.places, 0.001, moved=m) for m in (shifts, None))
    assert abs(with_ - X).max() < 0.05 < abs(without - X).max()


def test_an_effect_s_range_as_a_constant_has_its_mean_square() -> None:
    """A shift in proportion to an effect that is uniform over 0 to 1, or -0.5 to 1."""
    for low in (0.0, -0.5):
        toy = Toy(effects=1, bend=0.0)
        toy.ranges = {"e0": EffectRange(low, 1.0)}
        (nodes,) = expand(toy, np.zeros(3)).nodes.values()
        mean = {0.0: 1 / 3, -0.5: (1 + 0.25) / 6}[low]
        assert (nodes.range_shifts() ** 2).sum(0) == pytest.approx(mean * toy.g["e0"] ** 2)


def test_no_fit_is_asked_for_where_data_are_fewer_than_variables() -> None:
    toy = Toy(effects=1, pressures=(240.0,))
    p = problem(toy, toy.base + 0.3)
    few = p.only(np.arange(len(p.places)) < 2)
    d = diagnose(toy, toy.rows, few.observations, assumed=ASSUMED)
    assert d.verdict.kind == "undecided" and np.isfinite(refit(few, {}, 1).chi2).all()
