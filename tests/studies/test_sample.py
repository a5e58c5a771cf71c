"""Sampling as a study: two rims, what is predicted, targets as readings, and the result.

The box that is sampled: how wide it begins, how it is tried, when it grows and what stops it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import norm

from tyrecal.errors import InputError
from tyrecal.measured.measurement import Measurement
from tyrecal.report.figure import save
from tyrecal.report.sample import figures
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label, labelled
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.result import StudyInput
from tyrecal.studies.sample import box as box_module
from tyrecal.studies.sample.box import (
    AT_EDGE,
    edge_probability,
    grow_box,
    larger,
    sample_box,
    shares_at_edge,
)
from tyrecal.studies.sample.posterior import Posterior
from tyrecal.studies.sample.predict import conditional
from tyrecal.studies.sample.result import draws_csv, result
from tyrecal.studies.sample.study import Sample, check, first_box, run, targets_as_readings
from tyrecal.tyre.case.schema import Variable
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import SPRINGS
from tyrecal.tyre.values import overridden

from ..chance import Chance, generator
from ..conftest import CASES
from ..effects.support import coarse
from .test_posterior import (
    BOUNDS,
    CENTRE,
    LABELS,
    SIGMA,
    VARIABLES,
    WIDE,
    WIDTH,
    posterior,
    two_valleys,
)

Array = np.ndarray

pytestmark = pytest.mark.numbers


@pytest.mark.slow
def test_a_tyre_on_two_rims_is_sampled_and_predicted_on_both() -> None:
    """The draws hold the start with one variable, one mode a rim and no scatter. [0,0] torsional
    is higher if the wheel hangs, and a wave that moves no rim is the same on both."""
    case = coarse()
    loss = Variable(sets=["materials.rubber.loss_factor"], start=0.1, lower=0.01, upper=0.5)
    chosen = {"C10": case.case.variables["C10"], "loss": loss}
    case = replace(case, case=case.case.model_copy(update={"variables": chosen}))
    label, evaluator = Label(0, 0, "torsional"), Evaluator(TyreDesign(case))
    readings = []
    for rim in (None, "free"):
        values = {"rim.free": rim == "free"}
        modes = labelled(evaluator.evaluate(Question(values)))
        hertz = next(mode.frequency_Hz for mode in modes if mode.label == label)
        readings.append(
            Measurement("frequency_Hz", label, "", 240.0, 0.0, hertz, 0.005 * hertz, rim=rim)
        )
    sample = run(StudyInput(case, evaluator, {}), readings, 2000, at_kPa=(240.0,))
    summary = result(sample, 0)
    assert [*summary.variables] == ["C10"] and summary.left_out == ["loss"]
    assert summary.variables["C10"].low < 1e6 < summary.variables["C10"].high
    at = {(row.label, row.rim): row for row in summary.predicted}
    clamped, hung = at[label, None], at[label, "free"]
    assert hung.frequency_Hz > 1.8 * clamped.frequency_Hz
    for row, reading in zip((clamped, hung), readings, strict=True):
        assert row.measured_Hz == pytest.approx(reading.value)
    waves = [at[Label(3, 0), rim] for rim in (None, "free")]
    assert waves[0].frequency_Hz == pytest.approx(waves[1].frequency_Hz, rel=1e-3)
    titles = [table.title for table in summary.tables()[1:]]
    assert titles == ["Hz at 240 kPa", "Hz at 240 kPa, rim free", "Shares of the variance"]
    shares = summary.variance_shares  # of a single variable
    assert shares and all(each.first["C10"] == pytest.approx(1.0) for each in shares)
    spindle = {"s": case.case.variables["C10"].model_copy(update={"sets": [SPRINGS[0]]})}
    held = replace(case, case=case.case.model_copy(update={"variables": spindle}))
    with pytest.raises(InputError, match=r"^s sets the rim's compliance"):
        check(held, readings)


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
    prediction = conditional(here, whole[:3, :3], g, there, other, 0.002)
    precision = np.linalg.inv(whole)
    assert np.allclose(
        prediction.covariance, np.linalg.inv(precision[3:, 3:]), rtol=1e-6, atol=1e-15
    )
    assert np.allclose(prediction.pull, -prediction.covariance @ precision[3:, :3], atol=1e-8)
    C, A, B = np.diag([0.01, 0.04]), random.normal(size=(3, 2)), random.normal(size=(6, 2))
    rest = B - prediction.pull @ A
    expected = np.sqrt(np.diag(rest @ C @ rest.T + prediction.covariance))
    assert np.allclose(prediction.sigma(A, B, C), expected)


def test_drawn_predictions_have_that_mean_and_covariance(chance: Chance) -> None:
    """False failures: 1.2e-6."""
    here, there = rows((240.0,)), rows((200.0, 280.0))
    g, other = chance.random.normal(0, 0.01, (3, 2)), chance.random.normal(0, 0.01, (6, 2))
    sigma = g @ g.T + 1e-4 * np.eye(3)
    prediction = conditional(here, sigma, g, there, other, 0.0)
    eta, off = np.tile(np.arange(6.0), (2000, 1)), np.tile([0.01, -0.02, 0.03], (2000, 1))
    x = prediction.drawn(eta, off, int(chance.random.integers(2**31)))
    middle = eta[0] + prediction.pull @ off[0]
    for j in range(6):
        chance.mean(x[:, j] - middle[j], 0.0, 0.0)
        chance.scatter(x[:, j], float(np.sqrt(prediction.covariance[j, j])))


def test_targets_are_read_with_their_sigma_or_what_the_fit_leaves() -> None:
    case = load_case(CASES / "p235_75r17.yaml")
    modes = case.case.targets.modes
    modes[0] = modes[0].model_copy(update={"sigma_Hz": 0.7})
    modes[1] = modes[1].model_copy(update={"weight": 0.0})
    read = targets_as_readings(case, 1.5)
    assert [each.sigma for each in read] == [0.7] + 7 * [1.5]
    assert [each.value for each in read][:2] == [31.7, 37.8]
    assert {(each.pressure_kPa, each.quantity) for each in read} == {(240.0, "frequency_Hz")}
    assert targets_as_readings(overridden(case, {"pressure_kPa": 200}), 1.5) == read


def sampled(draws: int = 20_000) -> Sample:
    """Sample of the linear tyre, as `study.run` gives it."""
    density = posterior(WIDE)
    drawing = sample_box(density, BOUNDS, draws, 5)
    observations = Observations(rows((240.0,)), density.y, SIGMA, 0.0, SIGMA * np.nan, SIGMA)
    x = drawing.chains.thinned
    eta = density.ln_f(x, density.rows)
    return Sample(
        VARIABLES, ("m2", ""), observations, (), drawing, rows((240.0,)), eta, SIGMA, 0.01, None
    )


def test_the_result_says_what_the_draws_are() -> None:
    sample = sampled()
    summary, flat = result(sample, 5), sample.drawn.chains.flat
    A, B = summary.variables["A"], summary.variables["B"]
    a, b = np.exp(flat[:, 0]), -50 + 101 * flat[:, 1]
    for v, values in ((A, a), (B, b)):
        assert v.mean == pytest.approx(values.mean())
        assert (v.low, v.median, v.high) == pytest.approx(np.quantile(values, (0.05, 0.5, 0.95)))
        assert sum(v.density) == pytest.approx(1.0, abs=1e-6)
        assert v.low < v.best < v.high
    assert A.standard_error == pytest.approx(WIDTH[0] * A.best, rel=1e-6)
    assert B.standard_error == pytest.approx(WIDTH[1] * 101, rel=1e-6)
    assert A.box == pytest.approx(np.exp(WIDE[0])) and B.box == pytest.approx(-50 + 101 * WIDE[1])
    assert summary.correlations["A"]["B"] == pytest.approx(np.corrcoef(flat.T)[0, 1])
    (pair,) = summary.pairs
    thin = sample.drawn.chains.thinned
    assert (pair.a, pair.b) == ("B", "A") and np.sum(pair.counts) == len(thin)
    half = len(pair.counts) // 2  # rows are steps of B
    assert np.sum(pair.counts[:half]) == (thin[:, 1] < WIDE[1].mean()).sum()
    row, hertz = summary.predicted[0], np.exp(sample.ln_f[:, 0])
    assert (row.low, row.frequency_Hz) == pytest.approx(np.quantile(hertz, (0.05, 0.5)))
    assert row.measured_Hz == pytest.approx(np.exp(sample.observations.y[0]))
    assert row.sigma_Hz == pytest.approx(0.01 * row.measured_Hz)
    assert row.standard_error == pytest.approx(0.01 * row.frequency_Hz)
    table = np.array([line.split(",") for line in draws_csv(sample).splitlines()[1:]], float)
    assert np.allclose(table, np.column_stack([np.exp(thin[:, 0]), -50 + 101 * thin[:, 1]]))
    assert draws_csv(sample).startswith("A,B\n") and len(table) == summary.chains.kept
    assert summary.csv().splitlines()[1].startswith("1,0,,240.0,")
    assert summary.chains.enough or summary.doubts()


def test_doubts_of_a_result() -> None:
    sample = sampled(3000)
    at_edge = np.array([[2e-3, 0.0], [0.0, 1e-3]])
    short = replace(sample.drawn.chains, draws=sample.drawn.chains.draws[:9])
    poor = replace(sample.drawn, at_edge=at_edge, stopped="why", chains=short)
    words = " ".join(result(replace(sample, drawn=poor, widened=0.13), 0).doubts())
    assert "0.3 % of the draws are at the edge of the box, which could not grow: why" in words
    assert "steps are fewer than 20 autocorrelation times" in words and "--draws" in words
    assert "makes a standard deviation of the measurement 13 % larger" in words
    assert len(result(replace(sample, noise_Hz=1.2), 0).sentences()) == 3
    usual = result(replace(sample, widened=0.02), 0)
    assert usual.sentences()[-1].endswith("it makes the largest standard deviation 2 % larger")
    assert not any("standard deviation" in words for words in usual.doubts())


def test_the_corner_picture_says_names_units_and_lines(
    tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pathlib import Path

    from ..report.conftest import every_text_readable

    assert isinstance(tmp_path, Path)
    (name, figure), *_ = figures(result(sampled(), 0)).items()
    with every_text_readable(monkeypatch) as texts:
        save(figure, tmp_path / f"{name}.png")
    assert {"A", "B", "A, mm²", "draws", "linear", "median", "90 %"} <= set(texts)


def test_the_box_grows_until_it_holds_the_posterior() -> None:
    boxes: list[Array] = []

    def ask(box: Array) -> Posterior:
        boxes.append(box)
        return posterior(box)

    begun: list[bool] = []
    first = np.stack([CENTRE - 2 * WIDTH, CENTRE + 1.5 * WIDTH], 1)
    result = grow_box(ask, first, BOUNDS, np.ones(3), 20_000, 1, begun.append)
    assert result.at_edge.sum() < AT_EDGE and not result.stopped
    assert result.boxes == len(boxes) >= 2 and result.evaluations == 14
    assert begun == [False, True] * len(boxes)
    for before, after in pairwise(boxes):
        assert (after[:, 0] <= before[:, 0]).all() and (after[:, 1] >= before[:, 1]).all()
    tails = np.abs(result.posterior.box - CENTRE[:, None]) / WIDTH[:, None]
    assert tails.min() > 3  # 1e-3 of a normal distribution lie beyond 3.3
    assert result.chains.flat.std(0) == pytest.approx(WIDTH, rel=0.05)


def test_a_box_that_cannot_grow_says_why() -> None:
    first = np.stack([CENTRE - WIDTH, CENTRE + WIDTH], 1)
    small = lambda box: posterior(box) if np.allclose(box, first) else failing(box)

    def failing(box: Array) -> Posterior:
        raise EvaluationFailed("no_equilibrium", "inflation stopped at 12 kPa")

    result = grow_box(small, first, BOUNDS, np.ones(3), 3000, 1)
    assert result.boxes == 1 and result.at_edge.sum() > AT_EDGE
    assert result.stopped == "a larger box has no emulator: inflation stopped at 12 kPa"
    with pytest.raises(EvaluationFailed, match="inflation"):
        grow_box(failing, first, BOUNDS, np.ones(3), 3000, 1)

    def rough(box: Array) -> Posterior:
        made = posterior(box)
        errors = np.full(3, 0.02 if not np.allclose(box, first) else 0.5)
        own = replace(made.emulators[0], error_covariance=np.diag(errors**2))
        return replace(made, emulators=(own,))

    result = grow_box(rough, first, BOUNDS, np.array([0.03, 0.01, 0.03]), 3000, 1)
    assert result.stopped == "the emulator of a larger box is 2 % (rms) off"
    assert result.boxes == 1 and result.evaluations == 14
    assert grow_box(rough, first, BOUNDS, np.full(3, 0.03), 3000, 1).boxes > 1


def test_a_box_does_not_grow_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(box_module, "GROWTHS", 1)
    first = np.stack([CENTRE - 0.1 * WIDTH, CENTRE + 0.1 * WIDTH], 1)
    result = grow_box(posterior, first, BOUNDS, np.ones(3), 3000, 1)
    assert result.boxes == 2 and result.stopped == "it was made larger 1 times"


def test_bounds_are_no_edges() -> None:
    box, bounds = np.array([[0.0, 1.0], [0.0, 1.0]]), np.array([[0.0, 5.0], [-3.0, 1.0]])
    x = np.column_stack([np.linspace(0, 1, 1001), np.linspace(0, 1, 1001)])
    shares = shares_at_edge(x, box, bounds)
    assert shares == pytest.approx(np.array([[0.0, 0.025], [0.025, 0.0]]), abs=1e-3)
    assert larger(box, bounds, shares).tolist() == [[0.0, 1.25], [-0.25, 1.0]]
    assert larger(box, bounds, np.full((2, 2), 1e-5)).tolist() == box.tolist()
    near = np.array([[0.0, 1.1], [-0.1, 1.0]])
    assert larger(box, near, shares).tolist() == near.tolist()


def test_a_box_is_tried_by_the_shares_that_draws_from_it_will_have(chance: Chance) -> None:
    """A normal posterior cut by its box, by the closed form of the first variable.
    False failures: 1e-6."""
    box = np.stack([CENTRE - [3, 7] * WIDTH, CENTRE + [2, 7] * WIDTH], 1)
    density = posterior(box)
    shares = np.array(
        [edge_probability(density, BOUNDS, int(s)) for s in chance.random.integers(10**9, size=50)]
    )
    whole = norm.cdf(2) - norm.cdf(-3)
    near = 0.05 * 2.5
    expected = [norm.cdf(near - 3) - norm.cdf(-3), norm.cdf(2) - norm.cdf(2 - near)]
    assert shares.mean(0)[0] == pytest.approx(np.array(expected) / whole, rel=0.2)
    assert shares[:, 1].max() < 1e-6


def test_a_box_with_two_optima_is_tried_about_both() -> None:
    """The same shares as walkers come to, of which fewer are at the farther edge."""
    box = np.array([[-0.54, 0.55], [0.2, 0.8]])
    density = posterior(box, two_valleys, two_valleys(np.array([0.5, 0.5])))
    shares = edge_probability(density, BOUNDS, 1)
    x = sample_box(density, BOUNDS, 100_000, 0).chains.flat
    by_walkers = shares_at_edge(x, box, BOUNDS)
    assert by_walkers[0].min() > 1e-3
    assert shares[0] == pytest.approx(by_walkers[0], rel=0.3)


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
