"""The box that is sampled: how wide it begins, how it is tried, when it grows and what stops it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import norm

from tyrecal.simulate.evaluate.failure import EvaluationFailed
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
from tyrecal.studies.sample.study import first_box

from ..chance import Chance
from .known_posteriors import BOUNDS, CENTRE, VARIABLES, WIDTH, posterior, two_valleys

pytestmark = pytest.mark.numbers

Array = np.ndarray


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
