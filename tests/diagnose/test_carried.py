"""Many tyres of one case: effects asked once, about the start, and carried to each tyre's fit."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.inference.expansion import carried, derivatives, expand
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.plain_fit import plain_fit

from .toy import Toy, problem

X = np.array([0.2, -0.1, 0.15])


class Sloped(Toy):
    """With slopes by the parameters of its effects, whose shifts go with their square, too."""

    sloped = ("e0", "e1")

    def _answer(self, point: Query) -> Answer:
        own = super()._answer(point)
        slopes = {}
        for id in point.slopes:
            e, g = point.effects[id], self.g[id]
            own = Answer(own.eta + e**2 * g, own.jacobian, own.split)
            slopes[id] = g * (1 + 2 * e) + self.tilt[id] @ point.x
        return Answer(own.eta, own.jacobian, own.split, self.constants, slopes)


@pytest.mark.parametrize("toy", [Toy(effects=2, bend=0.05), Sloped(effects=2, bend=0.05)])
def test_what_goes_with_x_to_first_order_is_carried_exactly(toy: Toy) -> None:
    known, there = expand(toy, np.zeros(3)), expand(toy, X)
    before = toy.asked
    expansion = carried(known, toy, X)
    assert toy.asked == before + 1
    assert expansion.eta == pytest.approx(there.eta) and expansion.x0 == pytest.approx(X)
    for id, nodes in there.nodes.items():
        assert expansion.nodes[id].shift == pytest.approx(nodes.shift, abs=1e-13)
        assert expansion.nodes[id].slope == pytest.approx(nodes.slope, abs=1e-12)
        assert expansion.nodes[id].tilt == pytest.approx(nodes.tilt, abs=1e-13)


def test_derivatives_of_a_polynomial() -> None:
    nodes = np.array([-0.3, 0.0, 0.4, 1.0])
    assert derivatives(nodes) @ nodes**3 == pytest.approx(3 * nodes**2)


def test_the_fit_begins_with_what_is_known() -> None:
    """The same minimum within what it ends by, asked a few times less."""
    toy = Toy(bend=0.1)
    p = problem(toy, toy.base + toy.J @ X + toy.bend * (X @ X))
    known = expand(toy, np.zeros(3))
    counts, fits = [], []
    for each in (None, known):
        toy.asked = 0
        fits.append(plain_fit(toy, p.observations, p.places, 0.001, each))
        counts.append(toy.asked)
    assert fits[1] == pytest.approx(fits[0], abs=0.02)
    assert counts[1] < counts[0]


@pytest.mark.slow
def test_a_diagnosis_with_known_effects_says_the_same() -> None:
    """The tyre has an effect that moves along with x, and its likeliest effects are evaluated
    again; probabilities agree within 0.01."""
    toy = Toy(effects=3, bend=0.05)
    truth = toy.answers([Query(X, {"e1": 0.8})])[0]
    assert isinstance(truth, Answer)
    p = problem(toy, truth.eta)
    rows, assumed = list(toy.rows), Assumed(form=0.001, response_error=0.0)
    whole, quick = (
        diagnose(toy, rows, p.observations, assumed=assumed, known=known)
        for known in (None, expand(toy, np.zeros(3)))
    )
    assert whole.verdict.key == quick.verdict.key == "e1"
    assert quick.probabilities == pytest.approx(whole.probabilities, abs=0.01)
