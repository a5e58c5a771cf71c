"""Damping ratios as evidence: closed forms, derivatives, and what they decide."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import pi, tan
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.diagnose.labelings import with_exchanged
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.inference.damping import (
    ASSUMED_LOSS,
    ASSUMED_LOSS_SD,
    DAMPING_FORM,
    STATED_LOSS_SD,
    DampingEvidence,
    loss_deviations,
    with_losses,
    with_twice_the_loss,
)
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.observations import DampingRatios, Observable, observe
from tyrecal.studies.inference.section_fields import COMPOUNDS_ALIKE
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.effects.edit import with_part, with_rubbers
from tyrecal.tyre.values import with_values

from ..chance import generator
from ..effects.support import coarse
from ..measured.test_measurements import GOOD, read
from .toy import LABELS, Toy, problem

Array = np.ndarray


class TwoSprings(Toy):
    """Each mode a mass on two springs of two compounds, k1 + k2 = 1: zeta = (eta1 k1 + eta2 k2)/2.

    "e0" and "twin" shift frequencies alike; "twin" also takes loss from the mode [1,0].
    """

    eta = np.array((0.3, 0.1))

    def __init__(self) -> None:
        super().__init__(effects=1, pressures=(240.0,), twin=True, size=0.03, bend=0.0)
        self.g["twin"], self.tilt["twin"] = self.g["e0"], self.tilt["e0"]
        self.k1 = generator(1).uniform(0.1, 0.9, len(self.rows))
        self.taken = np.array([0.6 * (label == Label(1, 0)) for label, _ in self.rows])

    def _answer(self, point: Query) -> Answer:
        stiffer = self.k1 * np.exp(point.x[0])  # x is the ln of the first compound's modulus
        k = np.array([stiffer, 1 - self.k1]) / (stiffer + 1 - self.k1)
        zeta = self.eta @ k / 2 * (1 - self.taken * point.effects.get("twin", 0.0))
        losses = 0.2 * (self.eta[:, None] * k / (self.eta @ k)).T  # both known to 20 %
        return replace(super()._answer(point), damping=np.log(zeta), losses=losses)


def seen(toy: Toy, ln_zeta: Array, scatter: float = 0.25) -> DampingRatios:
    rows = tuple(Observable("damping_ratio", *row) for row in toy.rows)
    return DampingRatios(rows, ln_zeta, np.full(len(rows), scatter))


def test_two_springs_have_the_closed_form() -> None:
    toy = TwoSprings()
    made = expand(toy, np.zeros(3))
    assert made.damping is not None and made.damping_slopes is not None
    assert np.exp(made.damping) == pytest.approx((0.3 * toy.k1 + 0.1 * (1 - toy.k1)) / 2)
    # d ln zeta / d ln k1 = k1 k2 (eta1 - eta2) / (eta1 k1 + eta2 k2)
    exact = toy.k1 * (1 - toy.k1) * 0.2 / (0.3 * toy.k1 + 0.1 * (1 - toy.k1))
    assert made.damping_slopes[:, 0] == pytest.approx(exact, abs=0.01)
    assert np.all(made.damping_slopes[:, 1:] == 0)
    e = np.array([0.5, 1.0])
    want = np.log(1 - e[:, None] * toy.taken)
    assert made.nodes["twin"].damping_at(e) == pytest.approx(want, abs=1e-12)
    assert np.all(made.nodes["e0"].damping_at(e) == 0)


def test_likelihood_is_the_normal_one_with_all_its_parts() -> None:
    """Woodbury's form against the whole covariance, x and loss factors integrated out."""
    random, toy = generator(2), TwoSprings()
    m = len(toy.rows)
    J, L, at_x0 = random.normal(size=(m, 3)), random.normal(size=(m, 2)), random.normal(size=m)
    d, added = random.normal(size=(2, 3)), random.normal(size=(2, m))
    root = random.normal(size=(2, 3, 3))
    information = root @ root.transpose(0, 2, 1) + np.eye(3)
    data = seen(toy, random.normal(size=m))
    labels = [label for label, _ in toy.rows]
    S = np.diag(data.scatter**2) + L @ L.T
    S += DAMPING_FORM**2 * np.array([[a == b for b in labels] for a in labels])
    evidence = DampingEvidence.of(data, at_x0, J, L)
    for q, ln in enumerate(evidence.ln_likelihood(added, d, information)):
        whole = S + J @ np.linalg.inv(information[q]) @ J.T
        mean = at_x0 + J @ d[q] + added[q]
        assert ln == pytest.approx(multivariate_normal(mean, whole).logpdf(data.y))
    known = np.arange(m) != 4  # of one mode the model knows no damping
    fewer = DampingEvidence.of(data, np.where(known, at_x0, np.nan), J, L)
    whole = (S + J @ np.linalg.inv(information[0]) @ J.T)[known][:, known]
    ln = multivariate_normal((at_x0 + J @ d[0] + added[0])[known], whole).logpdf(data.y[known])
    assert fewer.ln_likelihood(added, d, information)[0] == pytest.approx(ln)
    assert fewer.count == m - 1


def of_twins(damping: DampingRatios) -> dict[str, float]:
    """Probabilities if the frequencies have the effect that both share."""
    toy = TwoSprings()
    (there,) = toy.answers([Query(np.zeros(3), {"twin": 0.9})])
    assert isinstance(there, Answer)
    plain = problem(toy, there.eta)
    data = replace(plain.observations, damping=damping)
    places = np.arange(len(damping.rows))
    return probabilities(
        weigh_hypotheses(replace(plain, observations=data, damping_places=places), pairs=False)
    )


def test_damping_decides_between_effects_that_frequencies_do_not_separate() -> None:
    toy = TwoSprings()
    alone = of_twins(DampingRatios())
    assert alone["e0"] == pytest.approx(alone["twin"])
    for own, (here, other) in {0.9: ("twin", "e0"), 0.0: ("e0", "twin")}.items():
        (answer,) = toy.answers([Query(np.zeros(3), {"twin": own})])
        assert isinstance(answer, Answer) and answer.damping is not None
        both = of_twins(seen(toy, answer.damping))
        assert both[here] > 5 * both[other]
    # a level that all modes share is a matter of loss factors, not of an effect
    (plain,) = toy.answers([Query(np.zeros(3))])
    assert isinstance(plain, Answer) and plain.damping is not None
    level = of_twins(seen(toy, plain.damping + 0.15))
    assert level["e0"] == pytest.approx(both["e0"], abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("toy", [Toy(effects=1, pressures=(240.0,)), TwoSprings()])
def test_a_result_states_how_many_ratios_are_used(toy: Toy) -> None:
    y = toy.base + 0.002 * generator(5).normal(size=9)
    data = replace(problem(toy, y).observations, damping=seen(toy, np.full(9, -3.0)))
    known = diagnose(toy, toy.rows, data, ranked=False)
    content = diagnosis_result(known).content()
    if isinstance(toy, TwoSprings):
        assert content["damping_ratios"] == 9 and not known.left_out
        return
    plain = diagnose(toy, toy.rows, problem(toy, y).observations, ranked=False)
    assert known.probabilities == plain.probabilities and "damping_ratios" not in content
    assert known.left_out == ("9 damping ratios: the solver computes none of these modes",)


def test_measured_ratios_are_means_with_their_labels(tmp_path: Path) -> None:
    pair = [f"frequency_Hz,2,0,,{i},240,0,{f},0.2" for i, f in ((1, 79.0), (2, 80.0))]
    pair += [f"damping_ratio,2,0,,{i},240,0,{z},{z / 5}" for i, z in ((1, 0.02), (2, 0.04))]
    alone = ["frequency_Hz,1,0,,,240,0,60.0,0.2", "damping_ratio,1,0,,,240,0,0.03,"]
    data = observe(read(tmp_path, *pair, *alone))
    assert [str(row) for row in data.damping.rows] == ["[1,0] at 240 kPa", "[2,0] at 240 kPa"]
    assert np.exp(data.damping.y) == pytest.approx([0.03, 0.03])
    assert data.damping.scatter == pytest.approx([0.25, np.hypot(0.004, 0.008) / 2 / 0.03])
    other = with_exchanged(data, Label(1, 0), Label(2, 0)).damping
    assert [str(row.label) for row in other.rows] == ["[2,0]", "[1,0]"]
    assert observe(read(tmp_path, GOOD)).damping.rows == ()


def test_stiffening_loses_at_least_what_causality_demands() -> None:
    add, case = catalogue()["frequency_stiffening"].add, coarse()
    for stated, e, want in ((0.05, 0.2, tan(pi * 0.1)), (0.5, 0.2, 0.5), (None, 0.2, None)):
        lossy = partial(with_part, loss_factor=stated)
        made = add(with_rubbers(case, lossy), e)
        assert made.case.materials["rubber"].loss_factor == want  # type: ignore[union-attr]
    table = with_rubbers(case, lambda m: with_part(m, loss_factor=[[10, 0.01], [100, 0.4]]))
    raised = add(table, 0.1).case.materials["rubber"].loss_factor  # type: ignore[union-attr]
    assert raised == [[10, tan(pi * 0.05)], [100, 0.4]]


def test_loss_factors_are_known_as_stated() -> None:
    case = catalogue()["bead_filler"].add(coarse(), 1.0)
    unknown = loss_deviations(case)
    names = list(unknown)
    assert len(names) > 1 and with_losses(case).case.materials[names[0]].loss_factor == ASSUMED_LOSS  # type: ignore[union-attr]
    L = np.array([*unknown.values()])
    assert np.sqrt((L**2).sum(1)) == pytest.approx(ASSUMED_LOSS_SD)
    assert L[0] @ L[1] == pytest.approx(COMPOUNDS_ALIKE * ASSUMED_LOSS_SD**2)
    stated = loss_deviations(with_rubbers(case, lambda m: with_part(m, loss_factor=0.1)))
    assert np.sqrt((stated[names[1]] ** 2).sum()) == pytest.approx(STATED_LOSS_SD)


@pytest.mark.slow
def test_derivatives_of_a_tyre_of_two_compounds() -> None:
    """By loss factors and variables, against differences of the solver's damping ratios."""
    case = with_losses(catalogue()["bead_filler"].add(coarse(), 1.0))
    rows = [(label, 240.0) for label in LABELS]
    evaluator = Evaluator(TyreDesign(case))
    model = TyreModel(case, evaluator, rows, [], {}, damped=True)
    (answer,) = model.answers([Query(model.start, constants=True)])
    assert isinstance(answer, Answer) and answer.damping is not None
    shares = model._known_shares
    assert sum(shares.values()) == pytest.approx(np.ones(9), abs=1e-9)
    name, loss = next(iter(shares)), 1.1 * ASSUMED_LOSS
    more = with_values(case, {f"materials.{name}.loss_factor": loss})
    (other,) = TyreModel(more, evaluator, rows, [], {}).answers([Query(model.start)])
    assert isinstance(other, Answer) and other.damping is not None
    assert np.expm1(other.damping - answer.damping) == pytest.approx(0.1 * shares[name], abs=1e-9)
    assert with_twice_the_loss(more, name).case.materials[name].loss_factor == 2 * loss  # type: ignore[union-attr]
    made, step = expand(model, model.start), 1e-3
    assert made.damping_slopes is not None
    d = step * np.array((0.0, 0.0, 1.0))  # of C10; belt and carcass change hardly anything
    above, below = model.answers([Query(model.start + d), Query(model.start - d)])
    assert isinstance(above, Answer) and isinstance(below, Answer)
    assert above.damping is not None and below.damping is not None
    rise = above.damping - below.damping
    assert made.damping_slopes[:, 2] == pytest.approx(rise / 2 / step, abs=0.02)
    assert abs(made.damping_slopes[:, :2]).max() < 0.1
