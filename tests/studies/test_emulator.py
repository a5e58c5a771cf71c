"""The emulator: exact for what it is made of, its error as stated, the crossing of two modes."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation, RawMode
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.studies import emulator as module
from tyrecal.studies.emulator import (
    PAIR,
    Emulator,
    Evaluated,
    bound,
    emulator,
    fitted,
    products,
    spread,
    up_to,
)
from tyrecal.studies.variable import DesignVariable

from ..chance import Chance, generator
from ..fit.fake import LABELS, START, FakeEvaluator, evaluator, shape
from ..fit.test_crossing import CoupledEvaluator

pytestmark = pytest.mark.numbers

Array = np.ndarray
VARIABLES = [DesignVariable(name, value, value / 9, 9 * value) for name, value in START.items()]
MODES = (Label(1, 0), Label(2, 0))


def box(reach: float) -> Array:
    """About the start."""
    x = np.log(list(START.values()))
    return np.stack([x - reach, x + reach], 1)


def made(tyre: Any, reach: float = 0.3, count: int = 30) -> Emulator:
    return emulator(tyre, VARIABLES, box(reach), LABELS, count)


def polynomial(degrees: Array, a: Array, t: Array, centre: Array, half: Array) -> list[Evaluated]:
    """Evaluated designs whose ln f are polynomials of t."""
    rise = np.stack([products(degrees, t, j) @ a for j in range(t.shape[1])], 2) / half
    value = products(degrees, t) @ a
    named = lambda each: dict(zip(MODES, each, strict=True))
    return [
        Evaluated(x, named(y), named(slope), 0.0)
        for x, y, slope in zip(centre + half * t, value, rise, strict=True)
    ]


@pytest.mark.parametrize(("v", "degree", "count"), [(1, 5, 4), (2, 4, 7), (3, 4, 12), (4, 3, 10)])
def test_polynomials_are_found_from_fewer_designs_than_terms(
    v: int, degree: int, count: int
) -> None:
    """Values alone would leave them open: slopes are used, and all of them."""
    random, degrees = generator("polynomials", v), up_to(v, degree)
    a = random.normal(size=(len(degrees), 2))
    assert count < len(degrees) == comb(v + degree, v) <= count * (1 + v)
    centre, half = random.normal(size=v), random.uniform(0.1, 1.0, v)
    samples = lambda count: polynomial(degrees, a, spread(count, v), centre, half)
    emulated = fitted((), MODES, centre, half, samples(count))
    t = random.uniform(-1, 1, (50, v))
    x = centre + half * t
    assert np.allclose(emulated.ln_f(x), products(degrees, t) @ a, rtol=0, atol=1e-9)
    rise = np.stack([products(degrees, t, j) @ a for j in range(v)], 2) / half
    assert np.allclose(emulated.slopes(x), rise, rtol=0, atol=1e-7)
    assert emulated.evaluations == count and not emulated.failed
    surer = fitted((), MODES, centre, half, samples(3 * count))
    assert surer.stated_error < 1e-9


def test_products_are_legendres_and_their_slopes_those_of_differences() -> None:
    random, degrees = generator("products"), up_to(3, 5)
    t = random.uniform(-1, 1, (20, 3))
    by_hand = np.prod(
        [np.polynomial.legendre.Legendre.basis(k)(t[:, j]) for j, k in enumerate((2, 0, 3))], 0
    )
    (place,) = np.flatnonzero((degrees == (2, 0, 3)).all(1))
    assert np.allclose(products(degrees, t)[:, place], by_hand)
    for j, step in enumerate(1e-6 * np.eye(3)):
        difference = (products(degrees, t + step) - products(degrees, t - step)) / 2e-6
        assert np.allclose(products(degrees, t, j), difference, rtol=0, atol=1e-7)


@pytest.mark.parametrize("v", [1, 3, 6])
def test_designs_are_spread_evenly_and_more_of_them_are_further_ones(v: int) -> None:
    """Designs are off even spacing by 2 or 3 ranks of 40; drawn ones are off by 5 and more, as a
    rule."""
    t = spread(40, v)
    assert np.array_equal(t, spread(90, v)[:40])
    expected = (2 * np.arange(40) + 1) / 40 - 1
    assert abs(np.sort(t, axis=0) - expected[:, None]).max() < 0.21
    by_hand = [0.5, 0.25, 0.75, 0.125], [1 / 3, 2 / 3, 1 / 9, 4 / 9], [0.2, 0.4, 0.6, 0.8]
    for column, values in zip(t.T, by_hand, strict=False):
        assert np.allclose((column[:4] + 1) / 2, values)


def test_a_design_left_out_is_as_if_it_had_not_been_evaluated() -> None:
    random = generator("left out")
    t, degrees = spread(12, 2), up_to(2, 3)
    rows = np.concatenate([products(degrees, t), *(products(degrees, t, j) for j in range(2))])
    equations = random.normal(size=(36, 3))
    a, residuals = module._left_out(rows, equations, 12)
    assert np.allclose(a, np.linalg.lstsq(rows, equations, None)[0])
    for i in range(12):
        others = np.arange(36) % 12 != i
        without = np.linalg.lstsq(rows[others], equations[others], None)[0]
        assert np.allclose(residuals[i], equations[i] - products(degrees, t[i : i + 1]) @ without)


def test_the_bound_is_a_tolerance_limit(chance: Chance) -> None:
    """The bound holds for 99 % of designs of log-normal errors with a confidence of 95 %, which
    the closed form approaches. False failures: 1e-7."""
    drawn = np.exp(chance.random.normal(-9.0, 1.5, (2000, 30)))
    quantile = np.exp(-9.0 + 2.3263 * 1.5)
    chance.often([bound(each) > quantile for each in drawn], 0.93, 0.97)
    assert bound(np.full(9, 1e-3)) == pytest.approx(1e-3)
    outlier = np.append(np.full(60, 1e-6), 1e-2)
    assert bound(outlier) >= 1e-2


def test_fresh_designs_keep_the_stated_error(chance: Chance) -> None:
    """Designs also keep the error if the two modes cross. False failures: 1e-7."""
    tyre, kept = meeting(), []
    emulated = made(tyre)
    assert 1e-9 < emulated.median_error < emulated.stated_error < 1e-3
    assert (emulated.stated_errors <= emulated.stated_error).all()
    x = np.array([chance.random.uniform(*ends, 200) for ends in box(0.3)]).T
    for each in x:
        error = abs(emulated.ln_f(each[None])[0] - exact(tyre, each))
        kept.append(bool((error <= emulated.stated_error).all()))
    chance.often(kept, 0.95)


class Springs(FakeEvaluator):
    """f^2 is a sum of shares, each as large as a variable is over its start, and a rest."""

    def evaluate(self, question: Question) -> Evaluation:
        ratio = np.array([question.values[name] / self.start[name] for name in START])
        shares = np.array([self.powers[name] for name in START]).T
        square = 1 + shares @ (ratio - 1)
        f = np.array([self.base[label] for label in LABELS]) * np.sqrt(square)
        modes = [RawMode(float(x), shape(label), 1) for x, label in zip(f, LABELS, strict=True)]
        gradients = {
            name: f * shares[:, j] / (2 * square * self.start[name])
            for j, name in enumerate(START)
            if name in question.gradients
        }
        return Evaluation(240.0, 12.8, tuple(modes), gradients)


class Meeting(CoupledEvaluator, Springs):
    """The two [0, 0] modes would cross at the start, and avoid each other."""


def meeting() -> FakeEvaluator:
    tyre = evaluator()
    belt = np.array([0.1, 0.5, *np.linspace(0.2, 0.4, 7)])
    shares = belt, np.full(9, 0.2), np.linspace(0.25, 0.15, 9)
    base = {**tyre.base, LABELS[0]: tyre.base[LABELS[1]]}
    return Meeting(base, dict(zip(START, shares, strict=True)), START)


def exact(tyre: FakeEvaluator, x: Array) -> Array:
    """ln f by label."""
    values = dict(zip(START, np.exp(x).tolist(), strict=True))
    modes = {m.label: m.frequency_Hz for m in label_modes(tyre.evaluate(Question(values)).modes)}
    return np.log([modes[label] for label in LABELS])


def test_the_two_modes_change_names_where_they_meet() -> None:
    """The names follow, frequencies are of the order of their gap's square as exact as others."""
    tyre = meeting()
    emulated, random = made(tyre), generator("meet")
    x = np.array([random.uniform(*ends, 300) for ends in box(0.3)]).T
    truth, predicted = np.array([exact(tyre, each) for each in x]), emulated.ln_f(x)
    above = truth[:, 0] > truth[:, 1]
    assert 30 < above.sum() < 270
    clear = abs(truth[:, 0] - truth[:, 1]) > 5e-3
    assert clear.sum() > 200 and abs(predicted - truth)[clear].max() < 1e-5
    upper, lower = np.sort(predicted[:, :2]).T[::-1]
    assert abs(upper - truth[:, :2].max(1)).max() < 2e-4 > abs(lower - truth[:, :2].min(1)).max()


def test_slopes_of_the_two_modes_are_those_of_differences() -> None:
    emulated, random = made(meeting()), generator("slopes")
    assert set(PAIR) <= set(emulated.labels)
    x = np.array([random.uniform(*ends, 40) for ends in box(0.28)]).T
    x = x[abs(np.diff(emulated.ln_f(x)[:, :2])[:, 0]) > 1e-3]
    steps = 1e-6 * np.eye(3)
    rise = np.stack([(emulated.ln_f(x + e) - emulated.ln_f(x - e)) / 2e-6 for e in steps], 2)
    assert len(x) > 20 and np.allclose(emulated.slopes(x), rise, rtol=0, atol=1e-6)


def test_frequencies_of_a_design_and_what_is_refused() -> None:
    tyre = evaluator()
    emulated = made(tyre, 0.2, 6)
    values = {"C10": 1.1 * START["C10"]}
    hertz = emulated.frequencies(values)
    truth = np.exp(exact(tyre, np.log([{**START, **values}[name] for name in START])))
    assert list(hertz) == LABELS and np.allclose(list(hertz.values()), truth, rtol=1e-9)
    low, high = (START["C10"] * np.exp(each) for each in (-0.2, 0.2))
    for edge in (low, high):
        emulated.frequencies({"C10": edge})
    with pytest.raises(ValueError, match=r"C10 is 1\.3e\+06: the emulator covers 818731 to"):
        emulated.frequencies({"C10": 1.3e6})
    with pytest.raises(ValueError, match="C10 is 700000: the"):
        emulated.frequencies({"C10": 7e5})
    with pytest.raises(ValueError, match="no variable 'C1', only A_belt, A_carcass, C10"):
        emulated.frequencies({"C1": 1e6})


def test_designs_that_fail_are_left_out_and_all_of_them_are_told() -> None:
    belt = START["A_belt"]
    emulated = made(evaluator(fails=lambda values: values["A_belt"] < 0.9 * belt), 0.3, 20)
    assert emulated.failed == sum(t < np.log(0.9) / 0.3 for t in spread(20, 3)[:, 0]) > 3
    assert emulated.evaluations == 20 - emulated.failed and emulated.stated_error < 1e-9
    with pytest.raises(EvaluationFailed, match="inflation stopped"):
        made(evaluator(fails=lambda values: True), 0.3, 20)


class Counted(FakeEvaluator):
    """Notes what is asked."""

    def evaluate(self, question: Question) -> Evaluation:
        self.asked.append([float(np.log(question.values[name])) for name in START])
        return super().evaluate(question)


def test_a_larger_box_asks_for_what_is_new_in_it() -> None:
    """Designs of the smaller one stand for as many as would lie there, failed ones, too; more
    designs of the same box are the further ones of the same sequence."""
    plain, belt = evaluator(), START["A_belt"]
    tyre = Counted(plain.base, plain.powers, START, fails=lambda v: v["A_belt"] < 0.8 * belt)
    tyre.asked = []
    whole = box(0.3)
    first = emulator(tyre, VARIABLES, whole, LABELS, 20)
    assert len(tyre.asked) == 20 and first.failed > 0
    larger = whole + np.array([[0.0, 0.0], [0.0, 0.3], [-0.1, 0.0]])
    grown = emulator(tyre, VARIABLES, larger, LABELS, 20, before=first)
    t = spread(20, 3)
    x = larger.mean(1) + np.ptp(larger, axis=1) / 2 * t
    outside = ((x < whole[:, 0]) | (x > whole[:, 1])).any(1)
    assert 5 < outside.sum() < 15 and np.allclose(tyre.asked[20:], x[outside])
    assert grown.evaluations + grown.failed == len(tyre.asked)
    assert grown.designs[: first.evaluations] == first.designs and grown.stated_error < 1e-9
    assert np.allclose(grown.ln_f(x), [exact(plain, each) for each in x], rtol=0, atol=1e-9)
    same = emulator(tyre, VARIABLES, larger, LABELS, 20, before=grown)
    count = len(tyre.asked)
    assert same.designs == grown.designs and count == 20 + outside.sum()
    emulator(tyre, VARIABLES, larger, LABELS, count + 3, before=grown)
    further = larger.mean(1) + np.ptp(larger, axis=1) / 2 * spread(count + 3, 3)[count:]
    assert np.allclose(tyre.asked[count:], further)


def test_where_the_last_variables_are_known_fewer_are_left() -> None:
    """The same frequencies and slopes by those that are left."""
    emulated, random = made(meeting()), generator("restricted")
    last = box(0.3)[1:].mean(1) + np.array([0.1, -0.2])
    fewer = emulated.restricted(last)
    low, high = box(0.28)[0]
    x = random.uniform(low, high, (20, 1))
    whole = np.hstack([x, np.tile(last, (20, 1))])
    assert np.allclose(fewer.ln_f(x), emulated.ln_f(whole), rtol=0, atol=1e-12)
    assert np.allclose(fewer.slopes(x), emulated.slopes(whole)[:, :, :1], rtol=0, atol=1e-10)
    assert len(fewer.degrees) == emulated.degrees.max() + 1 and len(fewer.box) == 1
    nothing = emulated.restricted(np.zeros(0))
    assert np.allclose(nothing.ln_f(whole), emulated.ln_f(whole), rtol=0, atol=1e-12)


def test_of_a_solver_without_exact_sensitivities_it_is_the_same() -> None:
    exact, differing = (made(evaluator(has_gradients=has), 0.1, 10) for has in (True, False))
    x = box(0.05).T
    assert np.allclose(differing.slopes(x), exact.slopes(x), rtol=0, atol=1e-4)
    assert np.allclose(differing.ln_f(x), exact.ln_f(x), rtol=0, atol=1e-5)


def test_too_few_evaluations_are_refused() -> None:
    with pytest.raises(InputError, match="needs 3 evaluations at least, got 2"):
        made(evaluator(), 0.3, 2)
    assert made(evaluator(), 0.3, 3).evaluations == 3
