"""Sampling: closed forms of a linear tyre, boxes that grow, two optima, what is predicted."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from tyrecal.errors import InputError
from tyrecal.measured.measurement import Measurement
from tyrecal.report.figure import save
from tyrecal.report.sample import figures
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label, labelled
from tyrecal.studies.diagnose.observations import Observable, Observations
from tyrecal.studies.emulator import Evaluated, fitted, spread
from tyrecal.studies.fit.variable import DesignVariable
from tyrecal.studies.sample import box as box_module
from tyrecal.studies.sample.box import AT_EDGE, drawn, grown, larger, probed, shares_at_edge
from tyrecal.studies.sample.chains import (
    ENOUGH,
    WARM_UP,
    autocorrelation_time,
    enough_draws,
    needs_emcee,
    walk,
    walkers,
)
from tyrecal.studies.sample.posterior import Posterior, optima
from tyrecal.studies.sample.predict import conditional
from tyrecal.studies.sample.result import draws_csv, result
from tyrecal.studies.sample.study import Sample, check, first_box, rows_of, run, targets_as_readings
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import SPRINGS, TyreState

from ..chance import Chance, generator
from ..conftest import CASES
from ..effects.support import coarse

pytestmark = pytest.mark.numbers

Array = np.ndarray
LABELS = (Label(1, 0), Label(2, 0), Label(3, 0))
J = np.array([[0.5, 0.1], [0.2, -0.4], [0.1, 0.3]])
VARIABLES = (DesignVariable("A", 1.0, 1e-3, 1e3), DesignVariable("B", 0.5, -50.0, 51.0, False))
BOUNDS = np.array([[np.log(1e-3), np.log(1e3)], [0.0, 1.0]])
SIGMA = np.array([0.01, 0.02, 0.015])


def posterior(
    box: Array, eta: Callable[[Array], Array] | None = None, y: Array | None = None
) -> Posterior:
    """Of a tyre with ln f = 4 + J x, or another, measured at x = (0, 0.5)."""
    t = spread(14, 2)
    centre, half = box.mean(1), np.ptp(box, axis=1) / 2
    if eta is None:
        eta = lambda x: 4 + x @ J.T
    x, samples = centre + half * t, []
    named = lambda each: dict(zip(LABELS, each, strict=True))
    for each in x:
        rise = np.array([(eta(each + e) - eta(each - e)) / 2e-4 for e in 1e-4 * np.eye(2)]).T
        samples.append(Evaluated(each, named(eta(each)), named(rise), 0.0))
    made = fitted(VARIABLES, LABELS, centre, half, samples)
    rows = np.array([[0, i] for i in range(3)])
    values = eta(np.array([0.0, 0.5])) if y is None else y
    return Posterior((made,), np.zeros((1, 1)), rows, values, np.diag(1 / SIGMA), box)


COVARIANCE = np.linalg.inv((J.T / SIGMA**2) @ J)
WIDTH = np.sqrt(np.diag(COVARIANCE))
CENTRE = np.array([0.0, 0.5])
WIDE = np.stack([CENTRE - 7 * WIDTH, CENTRE + 7 * WIDTH], 1)


def test_a_linear_tyre_has_the_normal_posterior_of_the_closed_form(chance: Chance) -> None:
    """Draws ten autocorrelation times apart, made independent standard normal ones by the closed
    form: mean, scatter and distribution. False failures: 7e-7."""
    found = drawn(posterior(WIDE), BOUNDS, 100_000, int(chance.random.integers(2**31)))
    assert np.allclose(found.covariance, COVARIANCE, rtol=1e-6)
    assert np.allclose(found.optima, CENTRE[None], atol=1e-6 * WIDTH)
    chains = found.chains
    assert chains.enough and 0.2 < chains.acceptance < 0.6 and (chains.tau > 1).all()
    apart = chains.draws[:: int(10 * chains.tau.max())].reshape(-1, 2)
    z = np.linalg.solve(np.linalg.cholesky(COVARIANCE), (apart - CENTRE).T)
    assert len(apart) >= 1000
    for each in z:
        chance.mean(each, 0.0, 0.0)
        chance.scatter(each, 1.0)
        chance.distributed(each, "norm")
    chance.mean(z[0] * z[1], 0.0, 0.0)


def test_what_each_rim_tells_adds_up() -> None:
    """Two rims, an emulator each: information and ln p are the sums of both."""
    other = J @ np.array([[0.2, 0.0], [0.0, 1.5]])
    one, two = posterior(WIDE), posterior(WIDE, lambda x: 4.5 + x @ other.T)
    both = Posterior(
        (*one.emulators, *two.emulators),
        np.array([[0.0], [1.0]]),
        np.vstack([one.rows, two.rows + np.array([1, 0])]),
        np.concatenate([one.y, two.y]),
        np.diag(1 / np.tile(SIGMA, 2)),
        WIDE,
    )
    x = np.stack([CENTRE, CENTRE + 0.5 * WIDTH])
    assert both(x) == pytest.approx(one(x) + two(x), abs=1e-6)
    assert np.allclose(both.information(x), one.information(x) + two.information(x), rtol=1e-6)
    assert both.evaluations == 2 * one.evaluations and len(both.stated_errors) == 6
    states = [TyreState(240.0), TyreState(240.0, 0.0, "free")]
    measured = [Observable("frequency_Hz", LABELS[2], 240.0, rim=rim) for rim in ("free", None)]
    assert rows_of(measured, states, [LABELS, LABELS[1:]]).tolist() == [[1, 1], [0, 2]]


@pytest.mark.slow
def test_a_tyre_on_two_rims_is_sampled_and_predicted_on_both() -> None:
    """One variable, one mode a rim, without scatter: the draws hold the start; [0,0] torsional is
    higher where the wheel hangs, and a wave that moves no rim is the same on both."""
    case = coarse()
    alone = {"C10": case.case.variables["C10"]}
    case = replace(case, case=case.case.model_copy(update={"variables": alone}))
    label, evaluator = Label(0, 0, "torsional"), Evaluator(TyreDesign(case))
    readings = []
    for rim in (None, "free"):
        values = {"rim.free": rim == "free"}
        modes = labelled(evaluator.evaluate(Question(values)))
        hertz = next(mode.frequency_Hz for mode in modes if mode.label == label)
        readings.append(
            Measurement("frequency_Hz", label, "", 240.0, 0.0, hertz, 0.005 * hertz, rim=rim)
        )
    sample = run(case, evaluator, readings, 2000, at_kPa=(240.0,))
    told = result(sample, 0)
    assert told.variables["C10"].low < 1e6 < told.variables["C10"].high
    at = {(row.label, row.rim): row for row in told.predicted}
    clamped, hung = at[label, None], at[label, "free"]
    assert hung.frequency_Hz > 1.8 * clamped.frequency_Hz
    for row, reading in zip((clamped, hung), readings, strict=True):
        assert row.measured_Hz == pytest.approx(reading.value)
    waves = [at[Label(3, 0), rim] for rim in (None, "free")]
    assert waves[0].frequency_Hz == pytest.approx(waves[1].frequency_Hz, rel=1e-3)
    titles = [table.title for table in told.tables()[1:]]
    assert titles == ["Hz at 240 kPa", "Hz at 240 kPa, rim free"]
    spindle = {"s": case.case.variables["C10"].model_copy(update={"sets": [SPRINGS[0]]})}
    held = replace(case, case=case.case.model_copy(update={"variables": spindle}))
    with pytest.raises(InputError, match=r"^s sets what holds the rim"):
        check(held, evaluator, readings)


def test_draws_are_worth_as_many_as_their_autocorrelation_says() -> None:
    found = drawn(posterior(WIDE), BOUNDS, 40_000, 3).chains
    flat, tau = found.flat, found.tau.max()
    assert len(flat) == found.draws.shape[0] * found.draws.shape[1]
    assert found.effective == pytest.approx(len(flat) / tau)
    apart = max(1, int(tau / 2))
    assert len(found.thinned) == -(-found.draws.shape[0] // apart) * found.draws.shape[1]
    assert found.dropped + len(found.draws) == 400 and 20 < found.dropped < 100
    assert not drawn(posterior(WIDE), BOUNDS, 2000, 3).chains.enough


def test_more_draws_have_more_walkers_until_their_steps_tell_tau() -> None:
    """As many as are asked for are enough of a tau that is a fifth longer than a chain said."""
    counts = 3000, 40_000, 60_000, 160_000, 10**6
    assert [walkers(count, 2) for count in counts] == [100, 100, 150, 400, 400]
    assert walkers(3000, 40) == 160
    for tau in (3.0, 10.0, 10.7, 40.0):
        count = int(enough_draws(tau))
        assert count / walkers(count, 2) - WARM_UP * 1.2 * tau >= ENOUGH * 1.2 * tau
    assert walk(posterior(WIDE), CENTRE[None], COVARIANCE, 60_000, 1).draws.shape[1] == 150


def test_tau_is_known_as_well_as_said(chance: Chance) -> None:
    """Of 400 and of 100 walkers over 20 tau of x(t + 1) = a x(t) + noise, tau = 9: to 5 and 10 %,
    by which `ENOUGH` was chosen. False failures: 2e-7."""
    a, tau = 0.8, 9.0
    for number, share in ((400, 0.05), (100, 0.10)):
        noise = chance.random.normal(size=(int(ENOUGH * tau), number, 40))
        noise[0] /= np.sqrt(1 - a**2)
        x = lfilter([np.sqrt(1 - a**2)], [1, -a], noise, axis=0)
        off = [autocorrelation_time(each[:, :, None])[0] / tau - 1 for each in np.moveaxis(x, 2, 0)]
        assert np.sqrt(np.mean(np.square(off))) < 1.6 * share


def test_the_autocorrelation_time_is_that_of_the_closed_form() -> None:
    """Of x(t + 1) = a x(t) + noise it is (1 + a) / (1 - a), of independent draws 1; walkers that
    stay apart from each other have a long one."""
    random, times = generator("autocorrelation"), []
    for a in (0.0, 0.5, 0.9):
        x = [random.normal(size=(50, 1))]
        for _ in range(4000):
            x.append(a * x[-1] + np.sqrt(1 - a**2) * random.normal(size=(50, 1)))
        times.append(float(autocorrelation_time(np.array(x))[0]))
    assert times == pytest.approx([1.0, 3.0, 19.0], rel=0.1)
    apart = random.normal(size=(1000, 50, 1)) + 10 * (np.arange(50) % 2)[:, None]
    assert autocorrelation_time(apart)[0] > 300


def test_the_same_seed_gives_the_same_draws_and_another_one_others() -> None:
    first, same, other = (
        walk(posterior(WIDE), CENTRE[None], COVARIANCE, 3000, seed).flat for seed in (1, 1, 2)
    )
    assert first.tobytes() == same.tobytes() != other.tobytes()


def test_walkers_begin_within_the_box_however_wide_they_are_sent_out() -> None:
    corner = np.stack([CENTRE, CENTRE + 4 * WIDTH], 1)
    for box, start in ((WIDE, CENTRE), (corner, CENTRE)):
        far = walk(posterior(box), start[None], 1e6 * COVARIANCE, 3000, 1)
        assert ((far.flat >= box[:, 0]) & (far.flat <= box[:, 1])).all()
        assert np.unique(far.draws[0], axis=0).shape == (100, 2)


def test_the_density_ends_at_the_box() -> None:
    density = posterior(WIDE)
    x = np.array([CENTRE, WIDE[:, 0], WIDE[:, 1], WIDE[:, 1] * [1.01, 1], WIDE[:, 0] * [1, 0.99]])
    values = density(x)
    assert np.isfinite(values[:3]).all() and np.isneginf(values[3:]).all()
    off = x[1] - CENTRE
    assert values[1] == pytest.approx(-0.5 * off @ np.linalg.inv(COVARIANCE) @ off)
    assert np.isneginf(density(WIDE[:, 1][None] + 1)).all()


def two_valleys(x: Array) -> Array:
    """The same frequencies at x and at its mirror image."""
    A = x[..., 0] - 0.0
    return np.stack([4 + A**2, 4 + x[..., 1] + 0.02 * A, 5 - x[..., 1]], -1)


def test_all_optima_of_a_box_are_found_and_walkers_start_from_the_likely_ones() -> None:
    box = np.array([[-1.0, 1.0], [0.2, 0.8]])
    density = posterior(box, two_valleys, two_valleys(np.array([0.5, 0.5])))
    best, height = optima(density)
    assert len(best) == 2 and height[0] > height[1] > height[0] - 10
    assert np.allclose(best, [[0.5, 0.5], [-0.5, 0.505]], atol=0.02)
    for each in best:  # no place around is likelier
        around = density(each + 1e-3 * generator("around").normal(size=(200, 2)))
        assert around.max() <= density(each[None])[0] + 1e-9
    x = drawn(density, BOUNDS, 20_000, 0).chains.flat[:, 0]
    ratio = np.exp(height[1] - height[0])
    assert np.mean(x < 0) == pytest.approx(ratio / (1 + ratio), abs=0.1)


def test_an_optimum_at_the_edge_of_the_box_is_held_there() -> None:
    box = np.array([[0.05, 0.3], [0.2, 0.8]])
    best, _ = optima(posterior(box))
    assert best[0, 0] == 0.05
    y = np.linspace(0.2, 0.8, 4001)
    line = posterior(box)(np.column_stack([np.full(len(y), 0.05), y]))
    assert best[0, 1] == pytest.approx(y[line.argmax()], abs=2e-4)


def test_the_box_grows_until_it_holds_the_posterior() -> None:
    asked: list[Array] = []

    def ask(box: Array) -> Posterior:
        asked.append(box)
        return posterior(box)

    begun: list[bool] = []
    first = np.stack([CENTRE - 2 * WIDTH, CENTRE + 1.5 * WIDTH], 1)
    found = grown(ask, first, BOUNDS, np.ones(3), 20_000, 1, begun.append)
    assert found.at_edge.sum() < AT_EDGE and not found.stopped
    assert found.boxes == len(asked) >= 2 and found.evaluations == 14
    assert begun == [False, True] * len(asked)
    for before, after in pairwise(asked):
        assert (after[:, 0] <= before[:, 0]).all() and (after[:, 1] >= before[:, 1]).all()
    tails = np.abs(found.posterior.box - CENTRE[:, None]) / WIDTH[:, None]
    assert tails.min() > 3  # 1e-3 of a normal distribution lie beyond 3.3
    assert found.chains.flat.std(0) == pytest.approx(WIDTH, rel=0.05)


def test_a_box_that_cannot_grow_says_why() -> None:
    first = np.stack([CENTRE - WIDTH, CENTRE + WIDTH], 1)
    small = lambda box: posterior(box) if np.allclose(box, first) else failing(box)

    def failing(box: Array) -> Posterior:
        raise EvaluationFailed("no_equilibrium", "inflation stopped at 12 kPa")

    found = grown(small, first, BOUNDS, np.ones(3), 3000, 1)
    assert found.boxes == 1 and found.at_edge.sum() > AT_EDGE
    assert found.stopped == "a larger box has no emulator: inflation stopped at 12 kPa"
    with pytest.raises(EvaluationFailed, match="inflation"):
        grown(failing, first, BOUNDS, np.ones(3), 3000, 1)

    def rough(box: Array) -> Posterior:
        made = posterior(box)
        errors = np.full(3, 0.02 if not np.allclose(box, first) else 0.5)
        return replace(made, emulators=(replace(made.emulators[0], stated_errors=errors),))

    found = grown(rough, first, BOUNDS, np.array([0.03, 0.01, 0.03]), 3000, 1)
    assert found.stopped == "the emulator of a larger box may be 2 % off"
    assert found.boxes == 1 and found.evaluations == 14
    assert grown(rough, first, BOUNDS, np.full(3, 0.03), 3000, 1).boxes > 1


def test_a_box_does_not_grow_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(box_module, "GROWTHS", 1)
    first = np.stack([CENTRE - 0.1 * WIDTH, CENTRE + 0.1 * WIDTH], 1)
    found = grown(posterior, first, BOUNDS, np.ones(3), 3000, 1)
    assert found.boxes == 2 and found.stopped == "it was made larger 1 times"


def test_bounds_are_no_edges() -> None:
    box, bounds = np.array([[0.0, 1.0], [0.0, 1.0]]), np.array([[0.0, 5.0], [-3.0, 1.0]])
    x = np.column_stack([np.linspace(0, 1, 1001), np.linspace(0, 1, 1001)])
    found = shares_at_edge(x, box, bounds)
    assert found == pytest.approx(np.array([[0.0, 0.025], [0.025, 0.0]]), abs=1e-3)
    assert larger(box, bounds, found).tolist() == [[0.0, 1.25], [-0.25, 1.0]]
    assert larger(box, bounds, np.full((2, 2), 1e-5)).tolist() == box.tolist()
    near = np.array([[0.0, 1.1], [-0.1, 1.0]])
    assert larger(box, near, found).tolist() == near.tolist()


def test_a_box_is_tried_by_the_shares_that_draws_from_it_will_have(chance: Chance) -> None:
    """Of a normal posterior cut by its box: by the closed form of the first variable.
    False failures: 1e-6."""
    box = np.stack([CENTRE - [3, 7] * WIDTH, CENTRE + [2, 7] * WIDTH], 1)
    density = posterior(box)
    found = np.array(
        [probed(density, BOUNDS, int(s)) for s in chance.random.integers(10**9, size=50)]
    )
    whole = norm.cdf(2) - norm.cdf(-3)
    near = 0.05 * 2.5
    expected = [norm.cdf(near - 3) - norm.cdf(-3), norm.cdf(2) - norm.cdf(2 - near)]
    assert found.mean(0)[0] == pytest.approx(np.array(expected) / whole, rel=0.2)
    assert found[:, 1].max() < 1e-6


def test_a_box_with_two_optima_is_tried_about_both() -> None:
    """The same shares as walkers come to, of which fewer are at the farther edge."""
    box = np.array([[-0.54, 0.55], [0.2, 0.8]])
    density = posterior(box, two_valleys, two_valleys(np.array([0.5, 0.5])))
    found = probed(density, BOUNDS, 1)
    x = drawn(density, BOUNDS, 100_000, 0).chains.flat
    by_walkers = shares_at_edge(x, box, BOUNDS)
    assert by_walkers[0].min() > 1e-3
    assert found[0] == pytest.approx(by_walkers[0], rel=0.3)


def test_weights_of_draws_count_at_the_edge() -> None:
    box, x = np.array([[0.0, 1.0]]), np.array([[0.01], [0.5], [0.99], [0.98]])
    bounds = np.array([[-1.0, 2.0]])
    assert shares_at_edge(x, box, bounds).tolist() == [[0.25, 0.5]]
    weights = np.array([6.0, 3.0, 1.0, 0.0])
    assert shares_at_edge(x, box, bounds, weights) == pytest.approx(np.array([[0.6, 0.1]]))


def test_the_first_box_is_as_wide_as_the_linear_errors_say() -> None:
    bounds = np.array([[-9.0, 9.0], [0.0, 1.0]])
    sharp = np.diag([1e4, 1e4])
    box = first_box(np.array([0.2, 0.5]), sharp, VARIABLES, bounds)
    assert box == pytest.approx(np.array([[0.155, 0.245], [0.455, 0.545]]), abs=1e-3)
    nothing = first_box(np.array([0.2, 0.9]), np.zeros((2, 2)), VARIABLES, bounds)
    assert nothing == pytest.approx(np.array([[-0.5, 0.9], [0.55, 1.0]]))
    outside = first_box(np.array([20.0, -3.0]), sharp, VARIABLES, bounds)
    assert outside == pytest.approx(np.array([[8.955, 9.0], [0.0, 0.045]]), abs=1e-3)


def rows(pressures: tuple[float, ...]) -> tuple[Observable, ...]:
    return tuple(Observable("frequency_Hz", label, p) for p in pressures for label in LABELS)


def test_predictions_are_the_conditional_of_the_joint_normal_distribution() -> None:
    """Against the inverse of the whole covariance, which holds the conditional one in its block."""
    random = generator("joint")
    g, other = random.normal(0, 0.01, (3, 4)), random.normal(0, 0.01, (6, 4))
    here, there = rows((240.0,)), rows((200.0, 280.0))
    form = np.array([0.0018, 0.0015, 0.0010])  # of form_error
    scatter = np.diag([1e-4, 2e-4, 1e-4])
    ln_p = np.log([240.0, 200.0, 280.0])
    smooth = np.exp(-((ln_p[:, None] - ln_p) ** 2) / (2 * 0.54**2))
    whole = np.kron(smooth, np.eye(3)) * np.outer(np.tile(form, 3), np.tile(form, 3))
    near = np.exp(-((ln_p[:, None] - ln_p) ** 2) / (2 * 0.8**2))
    in_plane = np.array([label.m == 0 for label in LABELS])
    shared = 1.0 + (in_plane[:, None] == in_plane)  # by all modes, and by a family
    whole += 0.002**2 * np.kron(near, shared + np.eye(3))
    whole += np.vstack([g, other]) @ np.vstack([g, other]).T
    whole[:3, :3] += scatter
    found = conditional(here, whole[:3, :3], g, there, other, 0.002)
    precision = np.linalg.inv(whole)
    assert np.allclose(found.covariance, np.linalg.inv(precision[3:, 3:]), rtol=1e-6, atol=1e-15)
    assert np.allclose(found.pull, -found.covariance @ precision[3:, :3], atol=1e-8)
    C, A, B = np.diag([0.01, 0.04]), random.normal(size=(3, 2)), random.normal(size=(6, 2))
    rest = B - found.pull @ A
    expected = np.sqrt(np.diag(rest @ C @ rest.T + found.covariance))
    assert np.allclose(found.sigma(A, B, C), expected)


def test_drawn_predictions_have_that_mean_and_covariance(chance: Chance) -> None:
    """False failures: 1.2e-6."""
    here, there = rows((240.0,)), rows((200.0, 280.0))
    g, other = chance.random.normal(0, 0.01, (3, 2)), chance.random.normal(0, 0.01, (6, 2))
    sigma = g @ g.T + 1e-4 * np.eye(3)
    found = conditional(here, sigma, g, there, other, 0.0)
    eta, off = np.tile(np.arange(6.0), (2000, 1)), np.tile([0.01, -0.02, 0.03], (2000, 1))
    x = found.drawn(eta, off, int(chance.random.integers(2**31)))
    middle = eta[0] + found.pull @ off[0]
    for j in range(6):
        chance.mean(x[:, j] - middle[j], 0.0, 0.0)
        chance.scatter(x[:, j], float(np.sqrt(found.covariance[j, j])))


def test_a_missing_emcee_is_told_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(InputError, match=r"needs the package emcee.*pip install 'tyrecal\[sample]"):
        needs_emcee()


def test_targets_are_read_with_their_sigma_or_what_the_fit_leaves() -> None:
    case = load_case(CASES / "p235_75r17.yaml")
    modes = case.case.targets.modes
    modes[0] = modes[0].model_copy(update={"sigma_Hz": 0.7})
    modes[1] = modes[1].model_copy(update={"weight": 0.0})
    read = targets_as_readings(case, 1.5)
    assert [each.sigma for each in read] == [0.7] + 7 * [1.5]
    assert [each.value for each in read][:2] == [31.7, 37.8]
    assert {(each.pressure_kPa, each.quantity) for each in read} == {(240.0, "frequency_Hz")}


def sampled(draws: int = 20_000) -> Sample:
    """As `study.run` gives it, of the linear tyre."""
    density = posterior(WIDE)
    found = drawn(density, BOUNDS, draws, 5)
    observations = Observations(rows((240.0,)), density.y, SIGMA, 0.0, SIGMA * np.nan, SIGMA)
    x = found.chains.thinned
    eta = density.ln_f(x, density.rows)
    return Sample(
        VARIABLES, ("m2", ""), observations, (), found, rows((240.0,)), eta, SIGMA, 0.01, None
    )


def test_the_result_says_what_the_draws_are() -> None:
    sample = sampled()
    found, flat = result(sample, 5), sample.drawn.chains.flat
    A, B = found.variables["A"], found.variables["B"]
    a, b = np.exp(flat[:, 0]), -50 + 101 * flat[:, 1]
    for v, values in ((A, a), (B, b)):
        assert v.mean == pytest.approx(values.mean())
        assert (v.low, v.median, v.high) == pytest.approx(np.quantile(values, (0.05, 0.5, 0.95)))
        assert sum(v.density) == pytest.approx(1.0, abs=1e-6)
        assert v.low < v.best < v.high
    assert A.standard_error == pytest.approx(WIDTH[0] * A.best, rel=1e-6)
    assert B.standard_error == pytest.approx(WIDTH[1] * 101, rel=1e-6)
    assert A.box == pytest.approx(np.exp(WIDE[0])) and B.box == pytest.approx(-50 + 101 * WIDE[1])
    assert found.correlations["A"]["B"] == pytest.approx(np.corrcoef(flat.T)[0, 1])
    (pair,) = found.pairs
    thin = sample.drawn.chains.thinned
    assert (pair.a, pair.b) == ("B", "A") and np.sum(pair.counts) == len(thin)
    half = len(pair.counts) // 2  # rows are steps of B
    assert np.sum(pair.counts[:half]) == (thin[:, 1] < WIDE[1].mean()).sum()
    row, hertz = found.predicted[0], np.exp(sample.ln_f[:, 0])
    assert (row.low, row.frequency_Hz) == pytest.approx(np.quantile(hertz, (0.05, 0.5)))
    assert row.measured_Hz == pytest.approx(np.exp(sample.observations.y[0]))
    assert row.sigma_Hz == pytest.approx(0.01 * row.measured_Hz)
    assert row.standard_error == pytest.approx(0.01 * row.frequency_Hz)
    table = np.array([line.split(",") for line in draws_csv(sample).splitlines()[1:]], float)
    assert np.allclose(table, np.column_stack([np.exp(thin[:, 0]), -50 + 101 * thin[:, 1]]))
    assert draws_csv(sample).startswith("A,B\n") and len(table) == found.chains.kept
    assert found.csv().splitlines()[1].startswith("1,0,,240.0,")
    assert found.chains.enough or found.doubts()


def test_doubts_of_a_result() -> None:
    sample = sampled(3000)
    at_edge = np.array([[2e-3, 0.0], [0.0, 1e-3]])
    poor = replace(sample.drawn, at_edge=at_edge, stopped="why")
    words = " ".join(result(replace(sample, drawn=poor, rough=0.3), 0).doubts())
    assert "0.3 % of the draws lie at the edge of the box, which could not grow: why" in words
    assert "steps are fewer than 20 autocorrelation times" in words and "--draws" in words
    assert "may be off by 0.3 of a standard deviation" in words
    assert len(result(replace(sample, noise_Hz=1.2), 0).sentences()) == 3


def test_the_corner_picture_says_names_units_and_lines(
    tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pathlib import Path

    from ..report.watched import every_text_readable

    assert isinstance(tmp_path, Path)
    (name, figure), *_ = figures(result(sampled(), 0)).items()
    with every_text_readable(monkeypatch) as said:
        save(figure, tmp_path / f"{name}.png")
    assert {"A", "B", "A, m2", "draws", "linear", "median", "90 %"} <= set(said)
