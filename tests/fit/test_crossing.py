"""The crossing of the two [0, 0] modes: its linear model, and a fit that ends there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.simulate.evaluate.results import Evaluation, HarmonicShape, RawMode
from tyrecal.studies.fit.crossing import crossing, gap, order, pair_clarity
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.search import AT_CROSSING
from tyrecal.tyre.state import AS_THE_CASE

from ..solved import calibrate
from .fake import CASE, LABELS, POINTS, START, FakeEvaluator, evaluator, shape

pytestmark = pytest.mark.numbers

COUPLING = 0.02  # Hz, half the least gap


class CoupledEvaluator(FakeEvaluator):
    """The axial and the torsional mode are the two of [[axial, delta], [delta, torsional]]."""

    def evaluate(self, question: Question) -> Evaluation:
        alone = super().evaluate(question)
        raw = [mode.frequency_Hz for mode in alone.modes[:2]]
        f, vectors = np.linalg.eigh(np.diag(raw) + COUPLING * (1 - np.eye(2)))
        belt = np.stack([shape(label).amplitude for label in LABELS[:2]])
        mixed = [
            RawMode(float(x), HarmonicShape(0, np.arange(9), POINTS, np.tensordot(v, belt, 1)), 1)
            for x, v in zip(f, vectors.T, strict=True)
        ]
        slopes = {
            n: np.concatenate([vectors.T**2 @ each[:2], each[2:]])
            for n, each in alone.gradients.items()
        }
        return Evaluation(alone.pressure_kPa, alone.mass_kg, (*mixed, *alone.modes[2:]), slopes)


def coupled(axial: float, torsional: float) -> CoupledEvaluator:
    """The tyre that meets all targets at TRUTH but those two, which are off by these factors."""
    plain = evaluator()
    base = dict(plain.base)
    base[LABELS[0]] *= axial
    base[LABELS[1]] *= torsional
    return CoupledEvaluator(base, plain.powers, START)


@pytest.mark.parametrize("torsional", [0.98, 0.965, 0.95])
def test_the_difference_without_coupling_is_found_on_either_side(torsional: float) -> None:
    tyre = coupled(1.08, torsional)
    problem = Problem(CASE, tyre)  # type: ignore[arg-type]
    at = np.log([4e-7, 1.5e-7, 4.5e5])
    point = problem.evaluate(at)
    edge = crossing(problem, [point], point)
    assert edge
    alone = FakeEvaluator(tyre.base, tyre.powers, START).evaluate(Question(point.values)).modes[:2]
    f = np.array([mode.frequency_Hz for mode in alone])
    assert pair_clarity(point) < 1 and abs(gap(point, AS_THE_CASE)) > 2 * COUPLING
    assert edge.at(at) == pytest.approx(f[0] - f[1], rel=1e-9)
    assert order(problem, point) == {AS_THE_CASE: np.sign(f[0] - f[1])}
    slopes = [f @ (np.array([1, -1]) * tyre.powers[name][:2]) for name in START]
    assert edge.slopes == pytest.approx(slopes, rel=1e-6)


@pytest.mark.parametrize("factors", [(1.07, 0.955), (1.08, 0.966)])
def test_a_fit_that_ends_at_the_crossing_says_so_soon(factors: tuple[float, float]) -> None:
    """Without a bound there, the fit would step over the jump and back until its restarts are
    used up."""
    tyre = coupled(*factors)
    fit = calibrate(CASE, tyre)  # type: ignore[arg-type]
    result = fit.result
    assert result["message"] == AT_CROSSING and result["converged"]
    assert result["evaluations"] <= 45 and result["projected_gradient_norm"] > 1
    problem = Problem(CASE, tyre)  # type: ignore[arg-type]
    lowest = differential_evolution(
        lambda x: problem.evaluate(x).objective,
        [(x - 0.1, x + 0.1) for x in fit.fitted.x],
        popsize=10,
        maxiter=40,
        polish=False,
        seed=1,
    ).fun
    assert result["objective_Hz"] == pytest.approx(lowest, rel=2e-3)
