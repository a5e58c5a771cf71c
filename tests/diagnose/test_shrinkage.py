"""How far an effect shrinks the error of data that are held out, and how far a placebo does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.evidence import explain, refit
from tyrecal.studies.diagnose.several import weigh_hypotheses
from tyrecal.studies.diagnose.shrinkage import _placebo, held_out, shrink
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.inference.model import EffectRange, Query
from tyrecal.studies.inference.observations import Observable

from ..chance import Chance, generator
from .test_diagnosis import diagnosed
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers


@pytest.mark.parametrize(
    ("pressures", "held"),
    [((160.0, 240.0, 320.0), {240.0}), ((160.0, 240.0), {160.0}), ((240.0,), set())],
)
def test_what_is_held_out_follows_a_rule(pressures: tuple[float, ...], held: set[float]) -> None:
    rows = [Observable("frequency_Hz", x, p) for p in pressures for x in LABELS]
    rows.append(Observable("mass_kg", None, 0.0))
    mask, _ = held_out(rows)
    chosen = [row for row, h in zip(rows, mask, strict=True) if h]
    if held:
        assert {row.pressure_kPa for row in chosen} == held
        assert len(chosen) == len(LABELS)
    else:
        assert {row.label for row in chosen} == {Label(4, 0), Label(3, 1)}
    assert all(row.label for row in chosen)


@pytest.mark.slow
def test_an_effect_shrinks_the_held_out_error(chance: Chance) -> None:
    """Beyond the placebo's quantile, and least squares' error too, in 17 of 20 tyres.

    False failures: 2e-7.
    """
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base, shrunk, usual = problem(toy), [], []
    for _ in range(12):
        there = base.measured(drawn(toy, base, chance.random, {"e1": 0.9}, 0.3))
        s = shrink(there)
        assert s is not None and s.low <= s.high
        shrunk.append(s.effect == "e1" and s.fraction > s.placebo_95)
        usual.append(s.least_squares_after_percent < s.least_squares_before_percent)
    chance.often(shrunk, 0.85)
    chance.often(usual, 0.85)


@pytest.mark.slow
def test_an_effect_is_told_with_the_rung_that_its_shrinkage_gives() -> None:
    diagnosis = diagnosed(Toy(size=0.02, pressures=(160.0, 200.0, 240.0)), {"e1": 0.9}, 1)
    s = diagnosis.shrinkage
    assert s is not None
    named = diagnosis.verdict.kind == "named"
    assert diagnosis.rung == 2 or not (named and s.effect == "e1" and s.fraction > s.placebo_95)


@pytest.mark.slow
def test_without_an_effect_the_error_shrinks_beyond_the_placebo_in_one_of_twenty(
    chance: Chance,
) -> None:
    """The placebo's quantile is of 200 draws, and of a model linear in x: 3 to 8 of 100.

    False failures: 1e-7.
    """
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base, beyond = problem(toy), []
    for _ in range(16):
        there = base.measured(drawn(toy, base, chance.random, {}, 0.0))
        fake = shrink(there)
        assert fake is not None
        beyond.append(fake.fraction > fake.placebo_95)
    chance.often(beyond, 0.03, 0.08)


@pytest.mark.parametrize("without", [True, False])
def test_a_calibration_as_usual_stands_beside(without: bool) -> None:
    """Least squares of the other rows, by SciPy on the tyre itself, without and with the effect."""
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    toy.spread = np.array([0.003, 0.01, 0.03])  # so that the bounds count
    base = problem(toy)
    y = drawn(toy, base, generator(1), {"e1": 0.9}, 0.03)
    there = base.measured(y)
    s = shrink(there, "e1")
    assert s is not None
    hold, _ = held_out(there.observations.rows)
    (h,) = (h for h in weigh_hypotheses(there.only(~hold)) if h.key == "e1")
    effects = {} if without else h.mean()

    def off(x: np.ndarray) -> np.ndarray:
        return toy._answer(Query(x, effects)).eta - y

    weighed = lambda x: np.concatenate([off(x)[~hold] / 0.002, (x - toy.start) / toy.spread])
    best = least_squares(weighed, toy.start, xtol=1e-14, ftol=1e-14).x
    expected = 100 * np.sqrt(np.mean(off(best)[hold] ** 2))
    got = s.least_squares_before_percent if without else s.least_squares_after_percent
    assert got == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_the_placebo_is_what_tyres_without_an_effect_would_show() -> None:
    """Each drawn tyre by itself: the likeliest effect of the rows that are kept, at its likeliest
    size, lowers the error of those held out by R; 95 % of them show less."""
    toy = Toy(effects=2, size=0.02, pressures=(200.0, 240.0), bend=0.0)
    toy.tilt = {id: 200 * tilt for id, tilt in toy.tilt.items()}
    toy.ranges["e1"] = EffectRange(0.0, 0.7)
    p = problem(toy, assumed=Assumed(form=0.001, response_error=0.04))
    hold, _ = held_out(p.observations.rows)
    noise = np.random.default_rng(7).multivariate_normal(
        np.zeros(len(hold)), p.sigma, 200, method="cholesky"
    )
    kept, out = p.only(~hold), p.only(hold)
    shares = []
    for each in noise:
        there = kept.measured(kept.plain(np.zeros(3))[0] + each[~hold])
        before = each[hold] - out.plain(np.zeros(3))[1] @ refit(there, {}, 1).d[0]
        best = max((explain(there, [id], 1.0) for id in toy.g), key=lambda h: h.ln_evidence)
        assert best.fitted is not None
        e, d = {best.key: best.values[best.key][[best.best]]}, best.fitted.d[best.best]
        shift, tilt, *_ = out.added(e, 1)
        after = each[hold] - shift[0] - (out.plain(np.zeros(3))[1] + tilt[0]) @ d
        shares.append(1 - np.sqrt(np.mean(after**2) / np.mean(before**2)))
    placebo = _placebo(p, hold, np.random.default_rng(7))
    assert placebo == pytest.approx(np.quantile(shares, 0.95), rel=1e-6)
