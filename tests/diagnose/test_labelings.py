"""Frequencies without labels as evidence, on a tyre in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import multivariate_normal

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.diagnose.evidence import OUTSIDE, PRIOR_OUTSIDE, explain, outside
from tyrecal.studies.diagnose.label_swap import with_exchanged
from tyrecal.studies.diagnose.labelings import Reading
from tyrecal.studies.diagnose.several import PRIOR_NONE, priors, weigh_hypotheses, with_sets
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem

from ..chance import generator
from .toy import HERTZ, LABELS, Toy, problem

pytestmark = pytest.mark.numbers

Array = np.ndarray
A, B = Label(3, 0), Label(3, 1)
SINGLE = Assumed(form=0.001, response_error=0.0, further=0.0)


def linear(pressures: Sequence[float] = (160.0, 240.0, 320.0)) -> Toy:
    """In x and in effects, and e0 lets two modes change places."""
    toy = Toy(effects=3, pressures=pressures, bend=0.0)
    toy.tilt = {id: np.zeros_like(tilt) for id, tilt in toy.tilt.items()}
    for label, shift in ((A, 0.05), (B, -0.05)):
        toy.g["e0"][[label == own for own, _ in toy.rows]] += shift
    return toy


def both(toy: Toy, y: Array, p: float, assumed: Assumed = SINGLE) -> list[Reading]:
    """As the data are, and with the two modes' labels exchanged, which has 1 - p."""
    own = problem(toy, y, assumed=assumed).observations
    f = [f"{np.exp(y[[row == (x, 240.0) for row in toy.rows]][0]):.4g} Hz" for x in (A, B)]
    return [
        Reading(own, np.log(p), list(zip(f, (A, B), strict=True))),
        Reading(with_exchanged(own, A, B), np.log(1 - p), list(zip(f, (B, A), strict=True))),
    ]


def evidence(there: InverseProblem, toy: Toy, id: str = "") -> float:
    """ln Z of one effect by the joint normal density, over its range by trapezia."""
    S = there.sigma + toy.J @ np.diag(toy.spread**2) @ toy.J.T
    e = np.linspace(0, 1, 2001)
    means = toy.base + np.outer(e, toy.g[id]) if id else toy.base[None]
    ln = multivariate_normal.logpdf(there.observations.y - means, np.zeros(len(S)), S)
    return float(np.log(trapezoid(np.exp(ln - ln.max()), e)) + ln.max()) if id else float(ln)


@pytest.mark.parametrize("p", [0.9, 0.5])
def test_explanations_are_averages_over_labelings(p: float) -> None:
    """Against the sum of joint normal densities, and the labelings against the sum over
    explanations; 1e-4 of the likeliest, of the rule in the effects' sizes."""
    toy = linear()
    y = toy.base + 0.7 * toy.g["e0"] + toy.J @ np.array([0.1, -0.2, 0.05])
    readings = both(toy, y, p)
    diagnosis = diagnose(toy, toy.rows, readings, assumed=SINGLE)
    prior = {"none": PRIOR_NONE, **dict.fromkeys(toy.ranges, priors(3, 0.0)[1])}
    ln = []
    for reading in readings:
        there = replace(problem(toy, assumed=SINGLE), observations=reading.observations)
        own = {key: evidence(there, toy, key.replace("none", "")) for key in prior}
        own = {key: each + np.log(prior[key]) for key, each in own.items()}
        ln.append({**own, OUTSIDE: outside(there).ln_evidence + np.log(PRIOR_OUTSIDE)})
    table = np.array([[*own.values()] for own in ln]) + np.log([p, 1 - p])[:, None]
    table = np.exp(table - table.max())
    expected = dict(zip(ln[0], (table / table.sum()).sum(0), strict=True))
    assert diagnosis.probabilities == pytest.approx(expected, abs=1e-4)
    assert diagnosis.readings == pytest.approx((table / table.sum()).sum(1), abs=1e-4)


def test_an_effect_makes_a_labeling_likelier() -> None:
    """Two modes have changed places. Their labels by the order of the plain tyre are likelier
    before, with no effect; the data of the other modes want it, and under it the others' labels."""
    toy = linear()
    y = toy.base + 0.9 * toy.g["e0"]
    plain = with_exchanged(problem(toy, y, assumed=SINGLE).observations, A, B).y
    diagnosis = diagnose(toy, toy.rows, both(toy, plain, 0.9), assumed=SINGLE)
    assert diagnosis.readings[1] > 0.99 and diagnosis.verdict.key == "e0"
    assert diagnosis.problem.observations.y == pytest.approx(y)


@pytest.mark.slow
def test_sure_labels_are_as_those_of_the_file() -> None:
    toy = Toy(effects=2)
    y = toy.base + 0.6 * toy.g["e1"]
    base = problem(toy, y)
    labelled = diagnose(toy, toy.rows, base.observations, assumed=base.assumed)
    sure = diagnose(toy, toy.rows, [Reading(base.observations, -3.0)], assumed=base.assumed)
    assert sure.probabilities == pytest.approx(labelled.probabilities, abs=1e-9)
    assert sure.robustness == labelled.robustness and sure.readings == (1.0,)
    assert sure.verdict == labelled.verdict


@pytest.mark.slow
def test_several_effects_are_weighed_under_every_labeling() -> None:
    toy = Toy(effects=6, pressures=(240.0,))
    first = problem(toy, toy.base + 0.9 * toy.g["e1"])
    second = replace(first, observations=with_exchanged(first.observations, A, B))
    weighed = [weigh_hypotheses(each) for each in (first, second)]
    sets = [{h.key for h in each} for each in weighed]
    assert sets[0] != sets[1]  # else it shows nothing
    for own, there in zip(weighed, (first, second), strict=True):
        every = {h.key: h for h in with_sets(there, own, [*weighed[0], *weighed[1]])}
        assert {*every} == sets[0] | sets[1]
        assert all(every[h.key] is h for h in own)
        for key in sorted({*every} - {h.key for h in own})[:1]:
            alone = explain(there, key.split("+"), every[key].prior)
            assert every[key].ln_evidence == pytest.approx(alone.ln_evidence)


def test_a_verdict_hangs_on_a_label() -> None:
    """As the plain tyre has two modes there is no gap, the other way round an effect is named.
    Where both may be right that is said; sure labels are nothing to hang on."""
    toy = linear((160.0, 240.0))
    apart = np.log(HERTZ[LABELS.index(B)] / HERTZ[LABELS.index(A)])
    plain = toy.base + 1e-4 * generator("labelings").normal(size=len(toy.base))
    sign = np.array([(label == A) - float(label == B) for label, _ in toy.rows])
    toy.g["e0"] = apart / 0.9 * sign  # 0.9 of it exchanges them
    half = diagnose(toy, toy.rows, both(toy, plain, 0.5), assumed=SINGLE).readings[1]
    diagnosis = diagnose(toy, toy.rows, both(toy, plain, half), assumed=SINGLE)
    assert diagnosis.readings == pytest.approx((0.5, 0.5), abs=1e-3)
    assert diagnosis.verdict.kind == "undecided" and not diagnosis.robustness.robust
    (lower, _), (upper, _) = both(toy, plain, half)[0].labels
    hertz = f"the label of {lower}, {upper}"
    assert diagnosis.robustness.hangs_on == (
        f"{hertz} ([3,0], [3,1], 0.50 probable, then no gap)",
        f"{hertz} ([3,1], [3,0], 0.50 probable, then e0 named)",
    )
    assert diagnosis.robustness.low < 0.05 and diagnosis.robustness.high > 0.95
    for p, verdict in ((1 - 1e-15, "no_gap"), (1e-15, "named")):
        sure = diagnose(toy, toy.rows, both(toy, plain, p), assumed=SINGLE)
        assert sure.verdict.kind == verdict
        assert not any("label of" in each for each in sure.robustness.hangs_on)
