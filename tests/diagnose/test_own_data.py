"""A diagnosis of the real model's own data, and its expansion against the model itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.diagnose.gap import find_gap, projection
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.diagnose.study import study
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem, Toggle, places
from tyrecal.studies.inference.model import Query
from tyrecal.studies.inference.observations import observe
from tyrecal.studies.inference.separability import separate

from ..chance import Chance
from .coarse_model import CASE, EFFECTS, MODEL, ROWS, X, asked, written


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> InverseProblem:
    """The tyre at X, weighed, measured without a mistake."""
    expansion = expand(MODEL, X)
    path = written(tmp_path_factory.mktemp("plain") / "a.csv", expansion.eta)
    observations = observe(read_measurements(path))
    where = places(observations, ROWS)
    return InverseProblem(
        replace(observations, y=expansion.eta[where]),
        expansion,
        MODEL.ranges,
        where,
        MODEL.start,
        MODEL.spread,
    )


@pytest.mark.slow
def test_the_expansion_is_the_model_at_its_nodes_and_close_between(plain: InverseProblem) -> None:
    expansion = plain.expansion
    there = X + np.array((0.15, -0.15, 0.1))
    eta, _ = expansion.plain(there)
    assert eta == pytest.approx(asked(Query(there)).eta, abs=5e-4)
    for id in EFFECTS:
        nodes = expansion.nodes[id]
        high = nodes.reach[1]
        for e, near in ((high, 1e-9), (0.6 * high, 1e-3), (0.1 * high, 5e-4)):
            a, B, _ = nodes.at(np.array([e]))
            assert expansion.eta + a[0] == pytest.approx(asked(Query(X, {id: e})).eta, abs=near)
            moved = asked(Query(there, {id: e})).eta
            assert eta + a[0] + B[0] @ (there - X) == pytest.approx(moved, abs=2e-3)


@pytest.mark.slow
def test_an_effect_in_the_models_own_data_is_named_with_its_size(tmp_path: Path) -> None:
    truth = 0.8 * MODEL.ranges["bead_filler"].high
    path = written(tmp_path / "a.csv", asked(Query(X, {"bead_filler": truth})).eta)
    result = study(CASE, Evaluator(TyreDesign(CASE)), path, effects=EFFECTS)
    d = result.diagnosis
    assert d.verdict.kind == "named" and d.verdict.key == "bead_filler"
    size = d.parameter("bead_filler")
    assert size["low"] < truth < size["high"]
    content = diagnosis_result(d).content()
    assert content["effect"] == "bead_filler" and content["rung"] in (1, 2)
    assert (
        content["shrinkage"]["fraction"] > 0.3 and content["section_map"]
    )  # unless it is left out
    assert sum(content["probabilities"].values()) == pytest.approx(1, abs=1e-4)


@pytest.mark.slow
def test_a_plain_tyre_has_no_gap(plain: InverseProblem, chance: Chance) -> None:
    """Measured with all that its covariance allows, nothing is named in 49 of 50, and "none" has a
    quarter in 17 of 20 (0.94 of 300 draws); without a mistake it is said.

    False failures: 2e-7.
    """
    d = diagnose(MODEL, ROWS, plain.observations, expansion=plain.expansion)
    assert d.verdict.kind == "no_gap"
    factor, named, quarter = np.linalg.cholesky(plain.sigma), [], []
    for _ in range(25):
        y = plain.observations.y + factor @ chance.random.normal(size=len(ROWS))
        hypotheses = weigh_hypotheses(plain.measured(y))
        p = probabilities(hypotheses)
        named.append(decide(hypotheses, p, len(ROWS), len(X)).kind not in ("no_gap", "undecided"))
        quarter.append(p["none"] > 0.25)
    chance.often(named, 0.0, 0.02)
    chance.often(quarter, 0.85)


@pytest.mark.slow
def test_the_mass_gives_the_hidden_away(plain: InverseProblem) -> None:
    """One more row raises lambda by the square of what its shift is off from what the other rows
    tell of it, over its variance given them (exact: information adds up). At one design no draw is
    in that; a fit's own design, which draws move, changes lambda by more than the mass does."""
    light = np.array([row.label is not None for row in plain.observations.rows])
    lambdas = [
        separate(problem, projection(problem, np.zeros(len(X)))[0], {}).full
        for problem in (plain, plain.only(light))
    ]
    _, J = plain.plain(np.zeros(len(X)))
    whole = plain.sigma + J * plain.spread**2 @ J.T  # of measurements, were nothing calibrated
    gain = np.linalg.solve(whole[light][:, light], whole[light][:, ~light])[:, 0]
    variance = (whole[~light][:, ~light] - gain @ whole[light][:, ~light]).item()
    gained = {id: lambdas[0][id] - lambdas[1][id] for id in EFFECTS}
    for id in EFFECTS:
        full = np.array([max(plain.expansion.nodes[id].reach, key=abs)])
        shift = plain.added({id: full}, 1)[0][0]
        surprise = (shift[~light] - gain @ shift[light]).item()
        assert gained[id] == pytest.approx(surprise**2 / variance, rel=1e-6)
    assert (
        find_gap(plain, np.zeros(len(X)), tuple(MODEL.variables)).absorbed["tread_density"] < 0.99
    )


@pytest.mark.slow
def test_a_toggled_run_shows_the_cause(tmp_path: Path) -> None:
    truth = 0.5 * MODEL.ranges["bead_filler"].high
    one = written(tmp_path / "a.csv", asked(Query(X, {"bead_filler": truth})).eta)
    other = written(tmp_path / "b.csv", asked(Query(X)).eta)
    d = study(
        CASE,
        Evaluator(TyreDesign(CASE)),
        one,
        toggled=[(other, Toggle("bead_filler", 0.0))],
        assumed=Assumed(),
        effects=EFFECTS,
        section_map=False,
    ).diagnosis
    assert d.verdict.kind == "named" and d.rung == 4


@pytest.mark.slow
def test_a_wrong_unit_and_one_mode_alone(tmp_path: Path) -> None:
    eta = asked(Query(X)).eta
    thrice = written(tmp_path / "a.csv", eta + np.log(2 * np.pi))
    with pytest.raises(InputError, match="right unit"):
        study(CASE, Evaluator(TyreDesign(CASE)), thrice, effects=EFFECTS)
    one = written(tmp_path / "b.csv", eta[5:6], ROWS[5:6])
    d = study(CASE, Evaluator(TyreDesign(CASE)), one, effects=EFFECTS, section_map=False).diagnosis
    assert d.verdict.kind == "undecided" and "cannot tell" in d.verdict.words
    assert d.shrinkage is None
    weighed = written(tmp_path / "c.csv", eta[-1:], ROWS[-1:])
    with pytest.raises(InputError, match="no frequency"):
        study(CASE, Evaluator(TyreDesign(CASE)), weighed, effects=EFFECTS)
