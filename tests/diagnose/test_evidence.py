"""Evidence on a tyre in closed form: by brute force, about known fits, sizes of effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.hermite import hermgauss
from scipy.stats import multivariate_normal

from tyrecal.studies.diagnose.evidence import explain, families, grid, outside, refit
from tyrecal.studies.diagnose.robustness import Perturbation, _reevaluate, lines, perturbed_evidence
from tyrecal.studies.diagnose.several import weigh_hypotheses
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem
from tyrecal.studies.inference.model import Answer, EffectRange, Query

from ..chance import Chance, generator
from .test_veering import Near
from .toy import LABELS, Toy, drawn, flat, problem

pytestmark = pytest.mark.numbers


def test_evidence_against_the_marginal_in_closed_form() -> None:
    """Linear and Gaussian: y ~ N(eta0 + e g, Sigma + J J^T), its integral over e by 4001 points."""
    toy = flat(pressures=(240.0,), effects=2)
    base = problem(toy)
    y = drawn(toy, base, generator(1), {"e0": 0.5}, 0.3)
    p = base.measured(y)
    S = p.sigma + toy.J @ np.diag(toy.spread**2) @ toy.J.T
    ln = lambda e: multivariate_normal(toy.base + e * toy.g["e0"], S).logpdf(y)
    assert refit(p, {}, 1).ln_evidence[0] == pytest.approx(ln(0.0), abs=1e-7)
    grid = (np.arange(4001) + 0.5) / 4001
    wanted = np.log(np.mean(np.exp([ln(e) for e in grid])))
    assert explain(p, ["e0"], 1.0).ln_evidence == pytest.approx(wanted, abs=1e-5)


def test_what_an_effects_law_may_be_off_is_scatter_of_its_own() -> None:
    """As so much more covariance, parameter by parameter; none where there is no effect."""
    toy = flat(pressures=(160.0, 240.0))
    loose = problem(toy, assumed=Assumed(form=0.001, response_error=0.1)).measured(
        toy.base + toy.g["e0"]
    )
    strict = replace(loose, assumed=Assumed(form=0.001, response_error=0.0))
    e = np.array([0.4, 1.0])
    result = refit(loose, {"e0": e}, 2)
    for i, more in enumerate(loose.response_covariance(loose.added({"e0": e}, 2))):
        own = refit(strict, {"e0": e[i : i + 1]}, 1, more)
        assert more.any() and result.ln_evidence[i] == pytest.approx(own.ln_evidence[0])
    assert refit(loose, {}, 1).ln_evidence == pytest.approx(refit(strict, {}, 1).ln_evidence)


def test_what_else_an_effect_is_is_integrated_over() -> None:
    """z ~ N(0, 1) times a shift that grows as the effect does: as so much more covariance. It is
    asked for at the ends of the range alone; laws of two effects are off by themselves."""
    toy, more = flat(pressures=(160.0, 240.0)), generator(7).normal(0, 0.01, 18)
    toy.ranges["e0"] = EffectRange(-1.0, 0.5, has_shape_uncertainty=True)
    sizes, plain = [], toy._answer

    def told(point: Query) -> Answer:
        if not point.shape_uncertainty:
            return plain(point)
        sizes.append(point.effects["e0"])
        return replace(plain(point), shape_uncertainty=2 * point.effects["e0"] * more)

    toy._answer = told  # type: ignore[method-assign]
    p = problem(toy, assumed=Assumed(form=0.001)).measured(toy.base + 0.4 * toy.g["e0"])
    assert sorted(sizes) == [-1.0, 0.5]
    e = np.array([-0.5, 0.4])
    result = refit(p, {"e0": e}, 2)
    for i in range(2):
        shift, shape_uncertainty = 0.04 * e[i] * toy.g["e0"], 2 * e[i] * more
        extra = np.outer(shift, shift) * p._alike + np.outer(shape_uncertainty, shape_uncertainty)
        bare = replace(p, assumed=Assumed(form=0.001, response_error=0.0))
        nodes = {**p.expansion.nodes, "e0": replace(p.expansion.nodes["e0"], shape_uncertainty={})}
        bare = replace(bare, expansion=replace(p.expansion, nodes=nodes))
        own = refit(bare, {"e0": e[i : i + 1]}, 1, extra)
        assert result.ln_evidence[i] == pytest.approx(own.ln_evidence[0])
    both, one, other = (
        p.response_covariance(p.added(effects, 2))
        for effects in ({"e0": e, "e1": e**2}, {"e0": e}, {"e1": e**2})
    )
    np.testing.assert_allclose(both, one + other, atol=1e-16)


@pytest.mark.parametrize("far", [(0, 0, 0), (2, 2, 2), (-2, 2, 0), (3, 0, -3)])
def test_evidence_against_quadrature_where_the_model_bends(far: tuple[int, int, int]) -> None:
    """Laplace in x against Gauss and Hermite's rule, 24 nodes each way, at and far from x0."""
    toy = Toy(pressures=(240.0,), effects=1, bend=0.1)
    toy.spread = np.full(3, 0.05)
    base = problem(toy, noise=0.01)
    (answer,) = toy.answers([Query(toy.spread * far)])
    assert isinstance(answer, Answer)
    p = base.measured(answer.eta)
    fitted = refit(p, {}, 1)
    nodes, weights = hermgauss(24)
    grid = np.stack(np.meshgrid(*[np.sqrt(2) * nodes] * 3), -1).reshape(-1, 3)
    L = np.linalg.cholesky(fitted.covariance[0])
    x = fitted.d[0] + grid @ L.T
    eta = toy.base + x @ toy.J.T + np.outer((x**2).sum(1), toy.bend)
    ln = multivariate_normal(np.zeros(len(p.places)), p.sigma).logpdf(answer.eta - eta)
    ln += multivariate_normal(np.zeros(3), np.diag(toy.spread**2)).logpdf(x)
    ln += np.log(np.einsum("i,j,k->ijk", *[weights] * 3).ravel()) + (grid**2).sum(1) / 2
    wanted = np.logaddexp.reduce(ln) + 1.5 * np.log(2) + np.linalg.slogdet(L)[1]
    assert fitted.ln_evidence[0] == pytest.approx(wanted, abs=0.03)


def test_fewer_values_only_widen_the_answer() -> None:
    """Where the model is linear, and the range of the effect is no limit, a posterior's width is
    the data's information alone, whatever was drawn."""
    toy = flat()
    toy.ranges["e1"] = EffectRange(-5.0, 5.0)
    base = problem(toy)
    keep = np.arange(len(base.places)) % 3 > 0
    width = lambda q: np.diff([explain(q, ["e1"], 1.0).quantile("e1", s) for s in (0.05, 0.95)])[0]
    for key in range(5):
        p = base.measured(drawn(toy, base, generator("fewer", key), {"e1": 0.7}, 0.3))
        assert width(p.only(keep)) > 1.05 * width(p)


def test_a_refit_never_ends_above_where_it_began() -> None:
    """Where the model bends and nothing fits undamped steps jump from side to side."""
    random = generator("refit")
    for _ in range(20):
        toy = Toy(effects=0, bend=0.3, pressures=(240.0,))
        p = problem(toy, assumed=Assumed(form=0.02))
        p = p.measured(toy.base + random.normal(0, 0.3, len(toy.base)))
        inverse, start = np.linalg.inv(p.sigma), p.centre - p.expansion.x0

        def misfit(d: np.ndarray) -> float:
            r, off = p.observations.y - p.plain(d)[0], (d - start) / p.spread  # noqa: B023
            return float(r @ inverse @ r + off @ off)  # noqa: B023

        d = refit(p, {}, 1).d[0]
        assert misfit(d) <= misfit(0 * d)
        again = refit(p, {}, 1, near=d[None]).d[0]
        assert misfit(again) <= misfit(d) * (1 + 1e-12)


@pytest.mark.slow
def test_the_interval_of_the_parameter_covers(chance: Chance) -> None:
    """The 90 % interval holds the true parameter, drawn from its prior, in 90 of 100 tyres, and one
    at most for the grid.

    False failures: 1e-7.
    """
    toy = flat(size=0.01, pressures=(240.0,), effects=1)
    base, inside = problem(toy), []
    for _ in range(300):
        e = chance.random.uniform(0, 1)
        hypothesis = explain(
            base.measured(drawn(toy, base, chance.random, {"e0": e}, 1.0)), ["e0"], 1.0
        )
        inside.append(hypothesis.quantile("e0", 0.05) <= e <= hypothesis.quantile("e0", 0.95))
    chance.often(inside, 0.89, 0.91)


def test_narrow_peaks_are_integrated() -> None:
    """An effect seen 300 times over: ln Z against 200001 points, the interval as narrow."""
    toy = Toy(size=0.3, bend=0.0, pressures=(240.0,), effects=1)
    toy.tilt["e0"] *= 0
    base = problem(toy)
    p = base.measured(toy.base + 0.4321 * toy.g["e0"])
    hypothesis = explain(p, ["e0"], 1.0)
    S = np.linalg.inv(p.sigma + toy.J @ toy.J.T)
    grid = (np.arange(200_001) + 0.5) / 200_001
    a = toy.g["e0"] @ S @ toy.g["e0"]
    ln = -a * (grid - 0.4321) ** 2 / 2
    _, ln_det = np.linalg.slogdet(p.sigma + toy.J @ toy.J.T)
    wanted = np.log(np.mean(np.exp(ln))) - (ln_det + len(p.places) * np.log(2 * np.pi)) / 2
    assert a > 1e3
    assert hypothesis.ln_evidence == pytest.approx(wanted, abs=0.02)
    assert hypothesis.mean()["e0"] == pytest.approx(0.4321, abs=1e-3)
    width = hypothesis.quantile("e0", 0.95) - hypothesis.quantile("e0", 0.05)
    assert width == pytest.approx(2 * 1.645 / np.sqrt(a), rel=0.15)


@pytest.mark.slow
def test_the_intervals_of_a_pair_cover(chance: Chance) -> None:
    """Each 90 % interval holds the truth, drawn from its prior, in 88 to 92 of 100 tyres.

    False failures: 2e-7.
    """
    toy = Toy(effects=2, bend=0.0)
    for id in toy.tilt:
        toy.tilt[id] = 0 * toy.tilt[id]
    base = problem(toy)
    inside: dict[str, list[bool]] = {"e0": [], "e1": []}
    for _ in range(30):
        truth = {id: chance.random.uniform(0, 1) for id in inside}
        there = base.measured(drawn(toy, base, chance.random, truth, 1.0))
        (pair,) = (h for h in weigh_hypotheses(there) if h.key == "e0+e1")
        for id, hits in inside.items():
            low, high = (pair.quantile(id, share) for share in (0.05, 0.95))
            hits.append(low <= truth[id] <= high)
    for hits in inside.values():
        chance.often(hits, 0.88, 0.92)


def test_sizes_on_the_grid_have_a_density_of_one_over_the_range() -> None:
    """The weighted sum of a polynomial is its mean over the range, wherever the range lies."""
    nodes = expand(Toy(effects=1), np.zeros(3)).nodes["e0"]
    for low, high in ((0.0, 1.0), (-3.0, 1.0), (2.0, 7.0)):
        e, ln = grid(replace(nodes, reach=(low, high)))
        mean = (high**4 - low**4) / 4 / (high - low)
        assert np.exp(ln) @ e**3 == pytest.approx(mean)
        assert low < e.min() and e.max() < high and len(e) == 25


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


def test_a_label_of_near_modes_that_is_left_out_is_as_if_never_read() -> None:
    toy = Near(0.01, effects=1)
    p = problem(toy, toy.coupled(1.1) + 0.3 * toy.g["e0"])
    keep = np.array([row.label != LABELS[0] for row in p.observations.rows])
    (again,) = _reevaluate(p, outside(p), [Perturbation("a label", p, keep)])
    assert again.ln_evidence == pytest.approx(outside(p.only(keep)).ln_evidence, abs=1e-6)
