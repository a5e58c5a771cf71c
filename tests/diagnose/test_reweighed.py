"""Evidence about fits that are known, against fits made anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.studies.diagnose.evidence import families, refit
from tyrecal.studies.diagnose.reweighed import Perturbation, lines, perturbed_evidence
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem

from ..chance import generator
from .test_veering import Near
from .toy import Toy, drawn, problem

pytestmark = pytest.mark.numbers

E = {"e0": np.array([0.2, 0.3, 0.4]), "e1": np.array([0.3, 0.2, 0.15])}


def changes(p: InverseProblem) -> list[Perturbation]:
    """One of each kind, and two at once."""
    every = np.ones(len(p.places), bool)
    fewer = np.array([row.label != p.observations.rows[3].label for row in p.observations.rows])
    twice = replace(p, reduced={0: 2.0})
    sure = replace(p, assumed=replace(p.assumed, form=0.0))
    return [
        Perturbation("nothing", p, every),
        Perturbation("a constant", twice, every),
        Perturbation("laws", p, every, 2.0),
        Perturbation("form", sure, every),
        *(Perturbation("starts", replace(p, spread=k * p.spread), every) for k in (0.5, 2.0)),
        Perturbation("a label", p, fewer),
        Perturbation("two", twice, fewer),
    ]


def made_anew(
    other: Perturbation, extra: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """ln Z and chi2 of effects `E`, or of more covariance without any, by re-fits."""
    p, error = other.problem.only(other.keep), other.problem.assumed.response_error
    assert error is not None
    p = replace(p, assumed=replace(p.assumed, response_error=other.response_factor * error))
    if extra is None:
        fitted = refit(p, E, 3)
    else:
        fitted = refit(p, {}, len(extra), extra[:, other.keep][:, :, other.keep])
    return fitted.ln_evidence, fitted.chi2


@pytest.mark.parametrize(("bend", "tolerance"), [(0.0, 1e-6), (0.02, 2e-3)])
def test_the_evidence_about_a_fit_is_that_of_a_fit_made_anew(bend: float, tolerance: float) -> None:
    """The evidence is exact for a model linear in x, except for what an effect does to its slopes;
    for a bent model it holds to second order in how far the fit moves."""
    toy = Toy(effects=2, bend=bend)
    p = problem(toy, assumed=Assumed(form=0.001, response_error=0.1))
    p = p.measured(drawn(toy, p, generator("reweighed"), {"e0": 0.4}, 0.2))
    fits = lines(p, E, refit(p, E, 3).d)
    extra = np.array([each.extra for each in families(p)])
    unknown = lines(p, {}, refit(p, {}, len(extra), extra).d, extra=extra)
    for other in changes(p):
        for evidence, wanted in zip(perturbed_evidence(fits, other), made_anew(other), strict=True):
            assert evidence == pytest.approx(wanted, abs=tolerance, rel=tolerance), other.words
        evidence, _ = perturbed_evidence(unknown, other, extra=extra)
        wanted, _ = made_anew(other, extra)
        assert evidence == pytest.approx(wanted, abs=tolerance, rel=tolerance), other.words


@pytest.mark.parametrize("among", [None, {2: 0.5, 4: 0.3}])
def test_near_modes_are_coupled_about_a_fit_as_by_a_fit_made_anew(
    among: dict[int, float] | None,
) -> None:
    """All points of the rule, or some that stand for all: to 0.1 where an explanation fits, as
    coupling bends. No label of the two is left out, whose partner would then be the model's."""
    toy = Near(0.01, effects=2)
    y = toy.coupled(1.1) + 0.3 * toy.g["e0"] + 0.2 * toy.g["e1"]
    p = problem(toy, y, assumed=Assumed(form=0.001, response_error=0.1))
    fits = lines(p, E, refit(p, E, 3).d, among)
    for other in changes(p):
        of = replace(other.problem.assumed, response_error=other.response_factor * 0.1)
        anew = refit(replace(other.problem, assumed=of).only(other.keep), E, 3, among=among)
        ln, chi2 = perturbed_evidence(fits, other, among)
        assert ln == pytest.approx(anew.ln_evidence, abs=0.1), other.words
        assert chi2 == pytest.approx(anew.chi2, abs=0.2), other.words
