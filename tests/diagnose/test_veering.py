"""Near modes that constants couple: against eigenvalues of 2 by 2, the model itself, and the whole
integral; tyres whose cords turned by three standard deviations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.evidence import explain, refit, refit_at
from tyrecal.studies.inference.cord_coupling import cord_coupling, coupling, partner
from tyrecal.studies.inference.inverse_problem import InverseProblem
from tyrecal.studies.inference.model import Answer, Coupling, Query
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.inference.veering import Veering
from tyrecal.tyre.values import with_values

from ..chance import Chance
from .coarse_model import CASE, MODEL
from .toy import LABELS, Toy, problem

pytestmark = pytest.mark.numbers
AXIAL, TORSIONAL = LABELS[:2]


def matrix(z: float) -> np.ndarray:
    """A pair of lambda, coupled in proportion to z, and moved apart."""
    return np.array([[1.01 + 0.004 * z, 0.02 * z], [0.02 * z, 0.98 - 0.003 * z]])


def test_the_coupling_of_two_modes_is_found_from_their_frequencies() -> None:
    at_0, above = (np.log(np.linalg.eigvalsh(matrix(z)))[::-1, None] / 2 for z in (0, 1))
    slopes = np.array([[0.004 / 1.01], [-0.003 / 0.98]]) / 2
    q, rise = coupling(at_0, slopes, above)
    scale = np.sqrt(1.01 * 0.98)
    assert q == pytest.approx(0.02 / scale, rel=1e-9)
    assert rise == pytest.approx(0.0, abs=1e-12)
    turned = above[::-1]  # whichever has which label
    assert coupling(at_0, slopes, turned)[0] == pytest.approx(q, rel=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("zeta", [0.3, 2.0])
def test_coupled_modes_are_eigenvalues_and_their_slopes(side: float, zeta: float) -> None:
    pair = Veering(
        np.full(2, 0.02),
        np.zeros(2),
        np.zeros(2),
        np.array([1, 0]),
        np.zeros(2),
        np.array([side, -side]),
    )
    eta = np.array([[0.011, -0.004]]) * side
    off = 0.02 * zeta * (np.ones((2, 2)) - np.eye(2))
    values, vectors = np.linalg.eigh(np.diag(np.exp(2 * eta[0])) + off)
    of_first = 1 if side > 0 else 0  # the upper or the lower
    ln_f, own, part, ln_label = pair.mixed(eta, zeta)
    assert ln_f[0] == pytest.approx(np.log(values[[of_first, 1 - of_first]]) / 2, rel=1e-12)
    assert np.exp(ln_label[0]) == pytest.approx(0.01 + 0.99 * vectors[0, of_first] ** 2, rel=1e-9)
    for i in range(2):
        moved = eta + 1e-6 * np.eye(2)[[i]]
        slope = (pair.mixed(moved, zeta)[0] - ln_f)[0] / 1e-6
        assert slope[[i, 1 - i]] == pytest.approx([own[0, i], part[0, 1 - i]], abs=1e-4)


def test_rows_without_a_pair_say_nothing_of_labels() -> None:
    """As those that are held out."""
    alone = Veering(*np.zeros((3, 2)), np.full(2, -1), np.zeros(2), np.ones(2))
    with np.errstate(all="raise"):
        _, own, part, ln_label = alone.mixed(np.array([[0.3, 0.5]]), 1.0)
    assert ln_label.tolist() == [0.0] and own.tolist() == [[1.0, 1.0]] and not part.any()


def test_only_modes_of_one_harmonic_are_partners() -> None:
    assert partner(AXIAL) == TORSIONAL and partner(TORSIONAL) == AXIAL
    assert partner(Label(3, 0)) == Label(3, 1) and partner(Label(3, 1)) == Label(3, 0)
    assert partner(Label(0, 1)) is partner(Label(2, 2)) is partner(None) is None


@pytest.mark.slow
def test_cords_three_standard_deviations_off_move_a_near_pair_as_the_model_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By 1.5 % of a frequency, of which slopes say a tenth, to 0.1 %. Where a step fails, the other
    side is taken."""
    rows = [(label, 240.0) for label in LABELS]
    model = TyreModel(CASE, Evaluator(TyreDesign(CASE)), rows, sources(CASE)[0], {})
    x = MODEL.start + np.array([0.0, 0.0, np.log(0.83)])  # the two cross near here
    (at_0,) = model.answers([Query(x, constants=True, coupled=True)])
    assert isinstance(at_0, Answer) and at_0.constants is not None and at_0.coupling is not None
    evaluated, failed = model.modes, list[int]()

    def fails_once(wanted: Any) -> Any:
        if failed:
            return evaluated(wanted)
        failed.append(len(wanted))
        return [EvaluationFailed("unstable", "no solution")] * len(wanted)

    monkeypatch.setattr(model, "modes", fails_once)
    other = cord_coupling(model, x, at_0.eta, at_0.constants)
    assert failed and other is not None
    assert other.size == pytest.approx(at_0.coupling.size, rel=0.1)
    carcass = list(model.sources).index("carcass_angle")
    turned = with_values(CASE, {"rebar_layers.carcass.angle_deg": 3.0})
    (off,) = TyreModel(turned, Evaluator(TyreDesign(turned)), rows, [], {}).answers([Query(x)])
    assert isinstance(off, Answer)
    moved = off.eta[:2] - at_0.eta[:2]
    assert abs(moved).min() > 0.012
    assert (3 * abs(at_0.constants[:2, carcass]) < 0.15 * abs(moved)).all()
    q, rise, side = at_0.coupling.size[:2], at_0.coupling.rise[:2], np.sign(moved)
    pair = Veering(q, rise, np.full(2, at_0.eta[:2].mean()), np.array([1, 0]), q, side)
    assert pair.mixed(at_0.eta[None, :2], 3.0)[0][0] == pytest.approx(off.eta[:2], abs=1e-3)


class Near(Toy):
    """The toy with its two [0,0] some per cent apart, coupled by a constant."""

    size = 0.012

    def __init__(self, apart: float, effects: int, size: float = 0.02):
        super().__init__(effects, size=size, bend=0.0)
        n = len(LABELS)
        self.base[1::n] = self.base[::n] + apart
        self.mates = np.full(len(self.rows), -1)
        self.mates[::n] = np.arange(1, len(self.rows), n)
        self.mates[1::n] = self.mates[::n] - 1

    def _answer(self, point: Query) -> Answer:
        answer = super()._answer(point)
        size = np.where(self.mates >= 0, self.size, 0.0)
        coupling = Coupling(self.mates, size, 0 * size)
        return replace(answer, coupling=coupling if point.coupled else None)

    def coupled(self, z: float) -> np.ndarray:
        """ln f with that much of the constant, by eigenvalues."""
        y = self.base.copy()
        for i in range(0, len(self.rows), len(LABELS)):
            scale = np.exp(2 * y[i : i + 2])
            off = self.size * z * np.sqrt(scale.prod())
            low, high = np.linalg.eigvalsh(np.diag(scale) + off * (np.ones((2, 2)) - np.eye(2)))
            y[i : i + 2] = np.log([low, high] if y[i] < y[i + 1] else [high, low]) / 2
        return y


def by_slopes(p: InverseProblem) -> InverseProblem:
    """As if nothing were coupled."""
    return replace(p, expansion=replace(p.expansion, coupling=None))


@pytest.mark.parametrize("z", [0.2, 1.3])
def test_the_evidence_is_the_integral_over_what_couples(z: float) -> None:
    """Against 80 points in zeta, x re-fitted at each; slopes alone have less by far."""
    toy = Near(0.01, effects=1)
    p = problem(toy, toy.coupled(z))
    zeta = (np.arange(80) + 0.5) / 20
    added, start = p.added({}, 1), np.zeros((1, 3))
    at = [replace(p, zeta=each) for each in zeta.tolist()]
    ln, prior = refit_at(p, at, added, None, start, 10).ln_evidence[:, 0], -(zeta**2) / 2
    known = np.logaddexp.reduce(ln + prior) - np.logaddexp.reduce(prior)
    assert refit(p, {}, 1).ln_evidence[0] == pytest.approx(known, abs=0.2)
    assert refit(by_slopes(p), {}, 1).ln_evidence[0] < known - 2 or z < 1


@pytest.mark.slow
def test_turned_cords_are_no_effect(chance: Chance) -> None:
    """Cords uniformly within three standard deviations, the pair within 4 %, one of its values gone
    from every second tyre: p(none) falls short of 0.2 in 1 of 20; by slopes alone in more than
    1 of 5.

    False failures: 2e-7.
    """
    short: dict[bool, list[bool]] = {True: [], False: []}
    for tyre in range(24):
        toy = Near(float(chance.random.uniform(-0.04, 0.04)), effects=2, size=0.01)
        base, y = problem(toy), toy.coupled(float(chance.random.uniform(-3, 3)))
        there = base.measured(
            chance.random.multivariate_normal(y, base.sigma, method="cholesky")
        ).only(np.arange(len(y)) != 1 if tyre % 2 else np.ones(len(y), bool))
        for known in short:
            p = there if known else by_slopes(there)
            ln = [explain(p, [id], 0.3).ln_evidence for id in ("e0", "e1")]
            none = refit(p, {}, 1).ln_evidence[0]
            short[known].append(none - np.logaddexp.reduce([none, *ln]) < np.log(0.2))
    chance.often(short[True], 0.0, 0.05)
    chance.often(short[False], 0.2)


def test_far_modes_are_not_coupled() -> None:
    """A constant moves a pair 20 % apart by (3 q)^2 / 0.8 of ln f: too little to be looked at."""
    toy = Near(0.2, effects=1)
    assert problem(toy).integrand
    toy.size = 0.004
    assert not problem(toy).integrand and not problem(Toy(effects=1)).integrand
