"""Where the model is asked of an effect, and what is made of its answers.

Frequencies between the lowest and the highest pressure, against polynomials and the model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from tyrecal.studies.diagnose.diagnosis import _asked_again, _nearer_sizes
from tyrecal.studies.diagnose.several import weigh_hypotheses
from tyrecal.studies.diagnose.study import _reaching
from tyrecal.studies.inference.between import Between
from tyrecal.studies.inference.expansion import (
    EffectResponse,
    Expansion,
    _nodes,
    anchored,
    expand,
    hermite,
    lagrange,
    node_values,
    refined,
)
from tyrecal.studies.inference.inverse_problem import Assumed, Toggle
from tyrecal.studies.inference.model import Answer, EffectRange, ModelRow, Query
from tyrecal.tyre.state import TyreState

from .coarse_model import X, model
from .toy import LABELS, Sloped, Toy, problem

pytestmark = pytest.mark.numbers

Array = np.ndarray


def test_where_an_effect_is_evaluated_first() -> None:
    """At the farther end of its range if a slope is known there or at 0, else half way, too; of a
    two-sided range at both ends, or at the farther one if both slopes are known."""
    assert node_values(EffectRange(0.0, 2.0)).tolist() == [1.0, 2.0]
    assert node_values(EffectRange(-3.0, -1.0)).tolist() == [-3.0, -1.5]
    assert node_values(EffectRange(-3.0, -1.0), 1).tolist() == [-3.0]
    assert node_values(EffectRange(0.0, 2.0, extra_nodes=(3.0,)), 2).tolist() == [2.0, 3.0]
    for slopes, wanted in ((0, [-2.0, 4.0]), (1, [-2.0, 4.0]), (2, [4.0])):
        assert node_values(EffectRange(-2.0, 4.0), slopes).tolist() == wanted
    assert node_values(EffectRange(-2.0, 4.0, has_shape_uncertainty=True), 2).tolist() == [
        -2.0,
        4.0,
    ]


def test_an_effect_reaches_as_far_as_there_are_solutions() -> None:
    """Nodes from 0 outwards to the first that fails; those beyond the range do not widen it."""
    n, none = 4, np.zeros((4, 2))
    answer = lambda e: Answer(np.full(n, e), np.full((n, 2), 3 * e), np.full(n, abs(e)))
    plain = Expansion(np.zeros(2), np.zeros(n), none, np.zeros((n, 2, 2)), np.zeros(n), none, {})
    failed = ValueError("no such tyre")
    span = EffectRange(-1.0, 1.0)
    answers = {-1.0: answer(-1), -0.5: failed, 0.5: answer(0.5), 1.0: answer(1), 1.5: answer(1.5)}
    made = _nodes("e0", plain, span, answers)
    assert made and made.values.tolist() == [0.0, 0.5, 1.0, 1.5] and made.reach == (0.0, 1.0)
    shift, tilt, split = made.at(np.array([0.25, 1.25]))
    assert shift[:, 0] == pytest.approx([0.25, 1.25])
    assert tilt[:, 0, 0] == pytest.approx([0.75, 3.75])
    assert split[:, 0] == pytest.approx([0.25, 1.25])
    assert _nodes("e0", plain, span, dict.fromkeys(answers, failed)) is None
    assert isinstance(made, EffectResponse)


def test_hermites_polynomials_take_values_and_slopes() -> None:
    """Those of a polynomial of as many coefficients: that polynomial. Without slopes Lagrange's."""
    nodes, sloped = np.array([-2.0, 0.0, 0.5, 3.0]), np.array([True, False, True, True])
    made = Polynomial([0.3, -1.0, 0.5, 0.2, -0.4, 0.1, 0.02])
    e = np.array([-1.5, 0.0, 0.2, 0.5, 2.0])
    values, slopes = hermite(nodes, sloped, e)
    assert values @ made(nodes) + slopes @ made.deriv()(nodes) == pytest.approx(made(e))
    assert values[1] == pytest.approx([0, 1, 0, 0]) and abs(slopes[[1, 3]]).max() == 0
    assert (slopes[:, 1] == 0).all()  # none is given there
    cubic = Polynomial([0.3, -1.0, 0.5, 0.2])
    assert lagrange(nodes, e) @ cubic(nodes) == pytest.approx(cubic(e))
    values, slopes = hermite(nodes, np.zeros(4, bool), e)
    assert values == pytest.approx(lagrange(nodes, e)) and (slopes == 0).all()


@pytest.mark.parametrize(
    ("at_0", "span", "power", "wanted"),
    [
        (False, EffectRange(0.0, 1.0), 2, [0, 1]),
        (False, EffectRange(-2.0, 0.0), 2, [-2, 0]),
        (False, EffectRange(-0.5, 1.0), 4, [-0.5, 0, 1]),
        (True, EffectRange(0.0, 1.0), 2, [0, 1]),
    ],
)
def test_a_size_and_its_slope_make_a_quadratic(
    at_0: bool, span: EffectRange, power: int, wanted: list[float]
) -> None:
    """So do a size and the slope where the effect is 0; no slope is asked in vain."""
    toy = Sloped(power, at_0, span)
    toy.curve = toy.curve / 10 + Polynomial([0.0, 2e-4])
    nodes = expand(toy, np.zeros(3)).nodes["e0"]
    assert nodes.values.tolist() == pytest.approx(wanted)
    e = np.linspace(span.low, span.high, 7)
    assert nodes.at(e)[0][:, 0] == pytest.approx(toy.curve(e), abs=1e-12)
    queries = [q for q in toy.points if q.slopes]
    assert [q.constants for q in queries] == ([True] if at_0 else [False] * (len(wanted) - 1))
    by_values = lagrange(nodes.values, e) @ toy.curve(nodes.values)
    assert nodes.at(e)[0][:, -1] == pytest.approx(by_values, abs=1e-12)


def test_one_end_of_the_range_stands_for_both_where_both_slopes_are_known() -> None:
    """A cubic, which reaches to the other end."""
    toy = Sloped(3, span=EffectRange(-0.5, 1.0))
    toy.sloped_at_0 = ("e0",)
    plain, toy._answer = toy._answer, lambda point: both(point)  # type: ignore[method-assign]

    def both(point: Query) -> Answer:
        toy.at_0 = not point.effects
        return plain(point)

    nodes = expand(toy, np.zeros(3)).nodes["e0"]
    assert nodes.values.tolist() == [0, 1] and nodes.reach == (-0.5, 1.0)
    e = np.linspace(-0.5, 1, 7)
    assert nodes.at(e)[0][:, 0] == pytest.approx(toy.curve(e), abs=1e-12)


@pytest.mark.parametrize(("power", "wanted"), [(1, [0, 1]), (2, [0, 0.25, 1])])
def test_a_bent_effect_is_evaluated_near_0_too(power: int, wanted: list[float]) -> None:
    """Where its slope at the end differs from the chord's by 30 % of the shift."""
    assert expand(Sloped(power), np.zeros(3)).nodes["e0"].values.tolist() == wanted


def test_one_more_size_and_its_slope_make_a_quartic() -> None:
    """An effect that matters is refined at the calibration's x; it is exact at all sizes then."""
    toy = Sloped(4)
    toy.curve = toy.curve / 10 + Polynomial([0.0, 2e-4])
    expansion = expand(toy, np.zeros(3))
    nodes = refined(expansion, toy, {"e0": 0.5}).nodes["e0"]
    assert nodes.values.tolist() == [0, 0.5, 1] and nodes.reach == (0.0, 1.0)
    e = np.linspace(0, 1, 7)
    assert nodes.at(e)[0][:, 0] == pytest.approx(toy.curve(e), abs=1e-12)
    assert abs(expansion.nodes["e0"].at(e)[0][:, 0] - toy.curve(e)).max() > 1e-6


def test_an_effect_in_play_is_evaluated_near_its_likeliest_size_once() -> None:
    toy = Toy(effects=1, size=0.03, bend=0.0)
    p = problem(toy).measured(toy.base + 0.72 * toy.g["e0"])
    seen = []
    for _ in range(2):
        p, changed = _nearer_sizes(p, toy, weigh_hypotheses(p))
        seen.append((changed, p.expansion.nodes["e0"].values.tolist()))
    assert seen == [(True, [0, 0.5, 0.75, 1]), (False, [0, 0.5, 0.75, 1])]


def test_a_nearer_size_is_asked_where_the_far_end_has_no_solution() -> None:
    class Stops(Sloped):
        far = 0.5

        def _answer(self, point: Query) -> Answer:
            if point.effects.get("e0", 0.0) > self.far:
                return ValueError("no such tyre")  # type: ignore[return-value]
            return super()._answer(point)

    toy = Stops(2, at_0=True)
    nodes = expand(toy, np.zeros(3)).nodes["e0"]
    assert nodes.values.tolist() == [0, 0.25, 0.5] and nodes.reach == (0.0, 0.5)
    toy.far = 0.1
    expansion = expand(toy, np.zeros(3))
    assert not expansion.nodes and expansion.failed == {"e0": "no such tyre"}


def test_an_effect_is_not_asked_again_where_it_was_asked() -> None:
    """Near a node, or 0, and near x0: what was asked there is known; elsewhere it is asked."""
    for size, move, wanted in (
        (1.0, 0.0, False),
        (0.49, 0.02, False),
        (0.02, 0.2, False),
        (1.0, 0.2, True),
        (0.74, 0.0, True),
        (0.64, 0.0, True),
    ):
        toy = Toy(effects=1, size=0.3, pressures=(160.0, 240.0), bend=0.0)
        toy.tilt["e0"] *= 0
        base = problem(toy, assumed=Assumed(form=1e-6, response_error=0.0), noise=1e-5)
        p = base.measured(toy.base + toy.J @ np.array([move, 0.0, 0.0]) + size * toy.g["e0"])
        hypotheses = weigh_hypotheses(p)
        best = next(h for h in hypotheses if h.key == "e0")
        assert best.values["e0"][best.best] == pytest.approx(size, abs=0.02)
        assert best.fitted.d[best.best][0] == pytest.approx(move, abs=0.03)
        before = toy.asked
        again, changed = _asked_again(p, toy, hypotheses)
        assert changed == wanted and toy.asked - before == wanted
        anchor = again.expansion.nodes["e0"].anchor
        assert (anchor is not None) == wanted
        if wanted:  # and not a second time
            assert not _asked_again(again, toy, weigh_hypotheses(again))[1]


def test_curvature_is_that_of_two_slopes() -> None:
    toy = Toy(effects=0, bend=0.1)
    expansion = expand(toy, np.array([0.2, -0.1, 0.3]))
    assert expansion.hessian == pytest.approx(2 * toy.bend[:, None, None] * np.eye(3), abs=1e-9)


def test_a_change_beyond_the_range_is_asked_where_it_was_measured() -> None:
    """Counted from what the case has; within the range, at 0, or as a factor nothing is added."""
    span = EffectRange(-0.3, 0.7, base=0.3)  # of an effect from 0 to 1
    reached = lambda value, times=False: _reaching(span, Toggle("a", value, times, 0.3)).extra_nodes
    assert reached(1.5) == (pytest.approx(1.2),) and reached(-0.2) == (pytest.approx(-0.5),)
    for value in (1.0, 0.0, 0.3, 0.65):
        assert reached(value) == ()
    assert reached(5.0, True) == ()
    twice = _reaching(_reaching(span, Toggle("a", 1.5, base=0.3)), Toggle("a", 1.5, base=0.3))
    assert len(twice.extra_nodes) == 1
    zero = _reaching(EffectRange(0.5, 1.0), Toggle("a", 0.0))  # 0 is a node anyway
    assert zero.extra_nodes == ()


def test_an_anchor_is_exact_where_it_was_asked_and_absent_without_the_effect() -> None:
    toy = Toy(bend=0.3)
    bare = expand(toy, np.zeros(3))
    x = np.array([0.4, -0.3, 0.2])
    toy.bend = toy.bend * 1.5  # the model at hand departs from what was expanded
    expansion = anchored(bare, toy, [Query(x, {"e0": 0.6})])
    (answer,) = toy.answers([Query(x, {"e0": 0.6})])
    assert isinstance(answer, Answer)
    eta, J = expansion.plain(x)
    for e, wanted in ((0.6, answer), (0.0, None)):
        a, B, _ = expansion.nodes["e0"].at(np.array([e]))
        if wanted:
            assert eta + a[0] + B[0] @ x == pytest.approx(wanted.eta, abs=1e-9)
            assert J + B[0] == pytest.approx(wanted.jacobian, abs=1e-9)
        else:
            assert abs(a).max() == 0 and abs(B).max() == 0
    far, _, _ = expansion.nodes["e0"].at(np.array([1.0]))
    near, _, _ = bare.nodes["e0"].at(np.array([1.0]))
    assert abs(far - near).max() <= abs(expansion.nodes["e0"].anchor.shift).max() * 3  # type: ignore[union-attr]


def test_what_two_effects_do_together_is_asked() -> None:
    """Exact where they were asked, what each is alone where the other is absent; and of effects
    whose product shifts modes too, exact at all sizes up to there."""

    class Product(Toy):
        def _answer(self, point: Query) -> Answer:
            answer = super()._answer(point)
            both = point.effects.get("e0", 0.0) * point.effects.get("e1", 0.0)
            return replace(answer, eta=answer.eta + 0.02 * both)

    toy, d = Product(effects=3, bend=0.0), np.array([0.2, -0.1, 0.1])
    bare = expand(toy, np.zeros(3))
    met = anchored(bare, toy, [Query(d, {"e0": 0.8, "e1": 0.5})])
    with_joint = replace(problem(toy), expansion=met)
    for e in ((0.8, 0.5), (0.4, 0.25), (0.8, 0.0), (0.0, 0.5)):
        effects = dict(zip(("e0", "e1"), e, strict=True))
        (answer,) = toy.answers([Query(d, effects)])
        assert isinstance(answer, Answer)
        at = {id: np.array([size]) for id, size in effects.items()}
        assert with_joint.predicted(at, d[None])[0] == pytest.approx(answer.eta, abs=1e-9)
    without = with_joint.added({"e0": np.array([0.8]), "e2": np.array([0.3])}, 1)[0]
    plain = replace(with_joint, expansion=bare).added(
        {"e0": np.array([0.8]), "e2": np.array([0.3])}, 1
    )
    assert without == pytest.approx(plain[0])


A, B = LABELS[:2]


def test_rows_and_ends_of_each_rim() -> None:
    """A mode that was measured between the ends only gets rows there; the mass needs none."""
    wide = TyreState(200.0, "wide")
    rows: list[ModelRow] = [(A, 160.0), (A, 240.0), (B, 240.0), (A, 320.0), (A, wide), (None, 0.0)]
    states = [TyreState(p) for p in (160.0, 240.0, 320.0)]
    between = Between.of(rows, [states[0], wide, *states[1:]])
    assert set(between.ends) == {states[0], states[2], wide}
    assert between.rows[6:] == ((B, states[0]), (B, states[2]))
    assert between.low.tolist() == [0, 0, 6, 0, 4, 5, 6, 6]
    assert between.high.tolist() == [3, 3, 7, 3, 4, 5, 7, 7]
    assert np.flatnonzero(between.inner).tolist() == [1, 2]


@pytest.mark.parametrize("degree", [1, 3])
def test_shifts_are_cubics_in_ln_p(degree: int) -> None:
    """With slopes by the pressure, else straight lines; other numbers are straight lines."""
    p = np.array([160.0, 200.0, 280.0, 320.0])
    between = Between.of([(A, float(each)) for each in p], [TyreState(float(each)) for each in p])
    curve = np.polynomial.Polynomial([0.3, -0.2, 0.5, 0.4][: degree + 1])
    ln_p, none = np.log(p), np.zeros((4, 1))
    plain = Answer(np.sin(p), none, 0 * p, by_pressure=np.cos(p) if degree > 1 else None)
    ends = ~between.inner
    rate = curve.deriv()(ln_p) + np.cos(p)
    answer = Answer(
        np.where(ends, curve(ln_p) + np.sin(p), 0.0),
        np.where(ends, 2 * ln_p, 0.0)[:, None],
        np.where(ends, 3 * ln_p, 0.0),
        slopes={"e0": np.where(ends, 4 * ln_p, 0.0)},
        by_pressure=np.where(ends, rate, 0.0),
    )
    filled = between.filled(answer, plain)
    assert filled.eta == pytest.approx(curve(ln_p) + np.sin(p), abs=1e-12)
    assert filled.jacobian[:, 0] == pytest.approx(2 * ln_p, abs=1e-12)
    assert filled.split == pytest.approx(3 * ln_p) and filled.slopes["e0"] == pytest.approx(
        4 * ln_p
    )


@pytest.mark.slow
def test_a_tyre_between_two_pressures() -> None:
    """An effect and a step of the variables: shifts to 1 % of the largest, in two thirds of the
    runs."""
    pressures = (160.0, 240.0, 320.0)
    own = model([*((label, p) for p in pressures for label in LABELS), (None, 0.0)])
    points = [(X, {"bead_filler": 2.0}), (X + 0.05, {})]
    plain, *near = own.answers([Query(X), *(Query(*each, near=X) for each in points)])
    runs = own.evaluator.counts.runs
    whole = own.answers([Query(*each) for each in points])
    assert runs == 1 + 3 + 2 * 2 and own.evaluator.counts.runs == runs + 2 * 3
    assert isinstance(plain, Answer)
    for one, other in zip(near, whole, strict=True):
        assert isinstance(one, Answer) and isinstance(other, Answer)
        shift = abs(other.eta - plain.eta).max()
        assert shift > 0.005 and abs(one.eta - other.eta).max() < 0.01 * shift
        tilt = abs(other.jacobian - plain.jacobian).max()
        assert abs(one.jacobian - other.jacobian).max() < 0.05 * tilt
