"""Modes that were not measured: against conditional normal distributions, and by simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE, Hypothesis, explain, outside, refit
from tyrecal.studies.diagnose.posteriors import likeliest
from tyrecal.studies.diagnose.several import weigh_hypotheses
from tyrecal.studies.inference.inverse_problem import InverseProblem

from ..blind.answers import expected, expected_by
from ..chance import Chance, generator
from .test_veering import Near
from .toy import LABELS, Toy, drawn, flat, problem

pytestmark = pytest.mark.numbers
HELD_kPa = 240.0


def parted(toy: Toy) -> tuple[np.ndarray, np.ndarray]:
    """Places of modes at the held-out pressure, and of the others."""
    out = np.array([p == HELD_kPa for _, p in toy.rows])
    return np.flatnonzero(out), np.flatnonzero(~out)


def without(p: InverseProblem, places: np.ndarray) -> InverseProblem:
    return p.only(np.isin(np.arange(len(p.places)), places))


def plain(p: InverseProblem) -> Hypothesis:
    fitted = refit(p, {}, 1)
    return Hypothesis(NONE, 0.25, float(fitted.ln_evidence[0]), {}, np.zeros(1), fitted)


def test_what_is_expected_is_the_conditional_distribution_in_closed_form() -> None:
    """Linear: x, constants, form and scatter are jointly normal; scatter of what is not measured
    is no part of the tyre."""
    toy = flat(effects=2)
    base = problem(toy)
    y = drawn(toy, base, generator("conditional"), {}, 0.3)
    out, kept = parted(toy)
    S = base.sigma - np.diag(base.observations.scatter**2 * np.isin(np.arange(len(y)), out))
    T = S + toy.J @ toy.J.T
    gain = T[np.ix_(out, kept)] @ np.linalg.inv(T[np.ix_(kept, kept)])
    p = without(base.measured(y), kept)
    prediction = expected_by(p, plain(p), toy.rows, out)
    assert prediction.mean == pytest.approx(toy.base[out] + gain @ (y - toy.base)[kept], abs=1e-7)
    variance = np.diag(T)[out] - np.einsum("ij,ji->i", gain, T[np.ix_(kept, out)])
    assert prediction.deviation == pytest.approx(np.sqrt(variance), rel=1e-5)
    low, high = prediction.interval()
    assert norm.cdf((high - prediction.mean) / prediction.deviation) == pytest.approx(
        0.95, abs=1e-4
    )
    assert low + high == pytest.approx(2 * prediction.mean)


def test_intervals_hold_what_they_say(chance: Chance) -> None:
    """Tyres with an effect whose size was drawn like its prior: the error over its own standard
    deviation, one row of each tyre, has no bias and the right size. False failures: 2e-7."""
    toy = Toy(effects=2, bend=0.0, size=0.01)
    base, random = problem(toy), chance.random
    out, kept = parted(toy)
    off, inside = [], []
    for i in range(150):
        y = drawn(toy, base, random, {"e0": random.uniform(0, 1)}, 1.0)
        p = without(base.measured(y), kept)
        prediction = expected_by(p, explain(p, ["e0"], 1.0), toy.rows, out)
        row, scatter = i % len(out), base.observations.scatter[out]
        off.append(((y[out] - prediction.mean) / np.hypot(prediction.deviation, scatter))[row])
        inside.append(abs(off[-1]) < 1.645)
    chance.often(inside, 0.88, 0.92)
    chance.mean(off, -0.1, 0.1)


def test_explanations_are_pooled_by_their_probabilities_and_outside_says_nothing() -> None:
    toy = Toy(effects=2, bend=0.0)
    base = problem(toy)
    out, kept = parted(toy)
    p = without(base.measured(toy.base + 0.12 * toy.g["e0"]), kept)
    known = [h for h in weigh_hypotheses(p, pairs=False) if h.key != OUTSIDE]
    ln = np.array([h.ln_evidence + np.log(h.prior) for h in known])
    share = np.exp(ln - np.logaddexp.reduce(ln))
    each = [expected_by(p, h, toy.rows, out) for h in known]
    mean = share @ np.array([one.mean for one in each])
    pooled = expected(p, [*known, outside(p)], toy.rows, out)
    assert np.sort(share)[-2] > 0.01  # more than one explains it
    assert pooled.mean == pytest.approx(mean, abs=2e-5)
    assert np.all(pooled.deviation**2 > share @ np.array([one.deviation**2 for one in each]) - 1e-9)


def test_near_modes_that_were_not_measured_are_coupled_as_those_that_were() -> None:
    """Data of exact eigenvalues: within their intervals and 0.15 %, where uncoupled modes are off
    by more than 0.7 %."""
    toy = Near(0.01, effects=1)
    y = toy.coupled(2.0)
    out, kept = parted(toy)
    p = without(problem(toy, y), kept)
    prediction = expected_by(p, plain(p), toy.rows, out)
    low, high = prediction.interval()
    assert np.all((low < y[out]) & (y[out] < high))
    assert prediction.mean[:2] == pytest.approx(y[out][:2], abs=1.5e-3)
    assert abs(likeliest(p, plain(p), toy.rows, out)[:2] - y[out][:2]).max() < 3e-3
    assert abs(toy.base[out][:2] - y[out][:2]).min() > 7e-3


def test_near_modes_that_an_effect_lets_cross_have_the_order_that_it_gives_them() -> None:
    """Axial above torsional by 2 %, below it by 1 % without the effect."""
    toy = Near(0.01, effects=1)
    up = np.where(np.arange(len(toy.rows)) % len(LABELS) == 0, 0.03, 0.0)
    toy.g["e0"], toy.tilt["e0"] = up, 0 * toy.tilt["e0"]
    out, kept = parted(toy)
    p = without(problem(toy, toy.base + up), kept)
    h = explain(p, ["e0"], 1.0)
    for mean in (expected_by(p, h, toy.rows, out).mean, likeliest(p, h, toy.rows, out)):
        assert mean[:2] == pytest.approx((toy.base + up)[out][:2], abs=3e-3)


def test_near_modes_none_of_which_was_measured_may_be_coupled_as_ever() -> None:
    """Their standard deviation holds what coupling may move them by, 0.5 % at two of its own."""
    toy = Near(0.01, effects=1)
    out, kept = parted(toy)
    kept = np.array([i for i in kept if toy.mates[i] < 0])
    p = without(problem(toy), kept)
    assert not p.integrand
    prediction = expected_by(p, plain(p), toy.rows, out)
    bare = replace(p, expansion=replace(p.expansion, coupling=None))
    alone = expected_by(bare, plain(bare), toy.rows, out)
    more = np.sqrt(prediction.deviation**2 - alone.deviation**2)[:2]
    assert np.all(more > 1e-3) and np.all(more < 6e-3)
    assert prediction.deviation[2:] == pytest.approx(alone.deviation[2:], rel=1e-6)


def test_an_error_of_the_whole_run_is_no_part_of_the_tyre() -> None:
    """All rows 1 % up, as that is known to happen: what was not measured stays nearly where it is,
    since variables and constants say nothing of a common factor."""
    toy = flat(effects=1)
    toy.J -= toy.J.mean(0)
    toy.constants *= 0.0
    out, kept = parted(toy)
    base = problem(toy)
    common = replace(base, observations=replace(base.observations, common=0.01))
    p = without(common.measured(toy.base + 0.01), kept)
    assert expected_by(p, plain(p), toy.rows, out).mean == pytest.approx(toy.base[out], abs=2e-3)
