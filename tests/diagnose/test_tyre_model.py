"""The real model behind the protocol: slopes, parts of the section, effects carried to each fit."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import carried, derivatives, expand
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.plain_fit import plain_fit
from tyrecal.studies.inference.regions import regions
from tyrecal.studies.inference.tyre_model import TyreModel, _key
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.variable import read_variables
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.values import with_values

from .coarse_model import CASE, MODEL, ROWS, X, asked
from .toy import Toy, problem


def test_a_worker_runs_one_evaluation_at_a_time() -> None:
    own = TyreModel(CASE, MODEL.evaluator, ROWS, [], {}, jobs=2)
    assert own.jobs == 2 and pickle.loads(pickle.dumps(own)).jobs == 1


@pytest.mark.slow
def test_slopes_against_differences() -> None:
    x, step = MODEL.start + np.array((0.1, -0.2, 0.05)), 1e-4
    own = asked(Query(x, constants=True))
    for j, d in enumerate(step * np.eye(3)):
        two = (asked(Query(x + d)).eta - asked(Query(x - d)).eta) / (2 * step)
        modes = slice(0, -1)
        assert own.jacobian[modes, j] == pytest.approx(two[modes], abs=2e-4)
        assert own.jacobian[-1, j] == pytest.approx(two[-1], abs=1e-5)  # of a mass
    assert own.constants is not None
    for source in ("pressure", "rubber_density", "belt_1_angle"):
        k = MODEL.sources.index(source)
        ((path, size),) = MODEL.found[k].steps.items()
        shifted = []
        for side in (0.1, -0.1):
            value = MODEL.designs.constants[path] + side * size
            there = with_values(CASE, {} if path == "pressure_kPa" else {path: value})
            rows = ROWS
            if path == "pressure_kPa":
                rows = [(label, p + side * size if label else p) for label, p in ROWS]
            other = TyreModel(there, Evaluator(TyreDesign(there)), rows, [], {})
            (answer,) = other.answers([Query(x)])
            assert isinstance(answer, Answer)
            shifted.append(answer.eta)
        wanted = (shifted[0] - shifted[1]) / 0.2
        assert own.constants[:-1, k] == pytest.approx(wanted[:-1], abs=2e-5)
        assert own.constants[-1, k] == pytest.approx(wanted[-1], rel=0.02, abs=1e-9)


def test_parts_of_the_section_make_the_whole() -> None:
    """All rubber heavier together is the density; all parts and the pressure stiffer by the same
    factor raise every frequency by half of it."""
    parts = regions(MODEL, MODEL.start)
    own = asked(Query(MODEL.start, constants=True))
    assert own.constants is not None
    rubber = [part for part in parts if not part.name.endswith("cords")]
    assert {part.name for part in rubber} == {
        "tread",
        "crown under the tread",
        "upper sidewall",
        "lower sidewall",
        "bead",
    }
    modes = slice(0, -1)
    density = own.constants[modes, MODEL.sources.index("rubber_density")] / 0.015
    assert sum(part.mass for part in rubber)[modes] == pytest.approx(density, rel=1e-6, abs=1e-9)
    k = MODEL.sources.index("pressure")
    pressure = own.constants[modes, k] * np.array([p for label, p in ROWS if label])
    stiffness = sum(part.stiffness for part in parts)[modes]
    assert stiffness + pressure == pytest.approx(np.full(18, 0.5), abs=1e-3)
    mass = sum(part.mass for part in parts)[modes]
    assert mass == pytest.approx(np.full(18, -0.5), abs=1e-3)


def test_coordinates_of_a_linear_and_a_logarithmic_variable() -> None:
    """The share of the way between the bounds, or a logarithm; before anything is measured as far
    from its start as the variable's own spread says; numbers come back, beyond the bounds too."""
    variables = CASE.case.variables
    C10 = variables["C10"].model_copy(update={"scale": "linear", "lower": 3e5, "upper": 1.1e6})
    case = CASE.case.model_copy(update={"variables": {**variables, "C10": C10}})
    own = TyreModel(replace(CASE, case=case), Evaluator(TyreDesign(CASE)), ROWS, [], {})
    start = start_values(CASE)
    assert list(own.variables) == ["A_belt", "A_carcass", "C10"]
    assert own.designs.values(own.start) == pytest.approx(start)
    assert own.start[[0, 2]] == pytest.approx([np.log(start["A_belt"]), (start["C10"] - 3e5) / 8e5])
    there = own.designs.values(own.start + np.array([0.1, 0.0, 0.5]))
    assert there["A_belt"] == pytest.approx(np.exp(0.1) * start["A_belt"])
    assert there["C10"] == pytest.approx(start["C10"] + 4e5) and there["C10"] > 1.1e6
    assert own.spread.tolist() == [v.spread for v in read_variables(replace(CASE, case=case))]
    slopes = {name: own.designs.slope(name, there) for name in ("C10", "A_belt")}
    assert slopes == {"C10": 8e5, "A_belt": there["A_belt"]}
    with_more = own.designs.at(own.start, {"frequency_stiffening": 0.3})
    assert with_more["effects.frequency_stiffening"] == 0.3


def test_a_solver_that_gives_no_slopes_of_the_mass_is_refused_where_that_was_measured() -> None:
    silent = SimpleNamespace(mass_kg=10.0, gradients={"C10": np.ones(1)}, mass_gradients={})
    own = TyreModel(CASE, Evaluator(TyreDesign(CASE)), [(None, 0.0)], [], {})
    with pytest.raises(DeckRefused, match="gives no sensitivities of the mass, which was measured"):
        own._answer_rows._mass_slopes(own.start, [SimpleNamespace(evaluation=silent)])  # type: ignore[list-item]


def test_a_denied_licence_ends_the_study_and_is_no_answer_about_an_effect(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """An effect that had no licence would be left out as if there were no such tyre."""
    own = TyreModel(CASE, Evaluator(TyreDesign(CASE)), ROWS, [], {})
    failures = [EvaluationFailed("no_equilibrium", "of 1 N 1 is left")]
    fail = lambda evaluator, wanted, *more: failures * len(wanted)
    monkeypatch.setattr("tyrecal.studies.inference.tyre_model.modes_in_order", fail)
    queries = [Query(X, {"point_mass": 0.05})]
    assert own.answers(queries) == failures
    failures[:] = [EvaluationFailed("licence", "all tokens are in use")]
    with pytest.raises(SolverUnavailable, match="all tokens are in use"):
        own.answers(queries)


@pytest.mark.slow
def test_an_effect_without_slopes_takes_the_plain_tyres() -> None:
    """The solver gives none with a splice: all is asked once, together, and nothing in vain."""
    evaluator = Evaluator(TyreDesign(CASE))
    splice = Query(X, {"stiffness_splice": 1.0})
    ranges, _ = effect_ranges(CASE, evaluator, ("bead_filler", "stiffness_splice"))
    own = TyreModel(CASE, evaluator, ROWS[:9], [], ranges)
    answers = own.answers([splice, Query(X, {"bead_filler": 1.0})])
    assert evaluator.counts.runs == 4  # the nominal one first, the plain one with these two
    (plain,) = own.answers([Query(X)])
    assert isinstance(plain, Answer) and isinstance(answers[0], Answer)
    assert answers[0].jacobian == pytest.approx(plain.jacobian, abs=1e-12)
    assert plain.constants is None  # they were not asked for
    assert (answers[0].eta > plain.eta).all() and answers[0].split[-1] > 0
    assert isinstance(answers[1], Answer) and abs(answers[1].jacobian - plain.jacobian).max() > 1e-3


SPLICE = "stiffness_splice"


WIDE = with_values(CASE, {"splice.width_deg": 100.0})


def with_slopes(case: LoadedCase, ids: Sequence[str]) -> TyreModel:
    """At 180 kPa, and the mass."""
    evaluator = Evaluator(TyreDesign(case))
    ranges, _ = effect_ranges(case, evaluator, ids)
    return TyreModel(case, evaluator, [*ROWS[:9], (None, 0.0)], [], ranges)


def test_slopes_by_effects_against_differences() -> None:
    """By the parameter at any size but 0, none of the mass; of effects that move nodes, too, but
    none that parts pairs far."""
    own = with_slopes(WIDE, ("bead_filler", "temperature", SPLICE, "rotation", "rim_width"))
    assert own.sloped == {"bead_filler", "temperature", "rim_width"}
    assert own.sloped_at_0 == {SPLICE, "temperature", "rim_width"}
    for id, e, step in (("bead_filler", 0.5, 5e-4), ("rim_width", 6e-3, 1e-5)):
        points = [Query(X, {id: e + side * step}) for side in (1, -1)]
        above, below, answer = own.answers([*points, Query(X, {id: e}, slopes=(id,))])
        assert (
            isinstance(above, Answer) and isinstance(below, Answer) and isinstance(answer, Answer)
        )
        two = (above.eta - below.eta)[:-1] / (2 * step)
        assert answer.slopes[id][:-1] == pytest.approx(two, rel=1e-4, abs=1e-6)
        assert np.isnan(answer.slopes[id][-1]) and above.slopes == {}


@pytest.mark.slow
def test_the_slope_by_a_splice_against_differences_of_spliced_tyres() -> None:
    own, step = with_slopes(WIDE, (SPLICE,)), 0.02
    points = [Query(X, slopes=(SPLICE,)), Query(X, {SPLICE: step}), Query(X, {SPLICE: -step})]
    answer, above, below = own.answers(points)
    assert isinstance(answer, Answer) and isinstance(above, Answer) and isinstance(below, Answer)
    two = (above.eta - below.eta)[:-1] / (2 * step)
    assert answer.slopes[SPLICE][:-1] == pytest.approx(two, rel=2e-3)
    assert (two > 0.01).all()


def test_sources_that_are_effects_step_once_and_fail_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a sensitivity at 0 the shift by the step is added to the slope; where the step has no
    solution, the point has none."""
    n = len(ROWS)
    answer = Answer(np.zeros(n), np.zeros((n, 3)), np.zeros(n), np.full((n, 2), 0.5))
    moved = replace(answer, eta=np.arange(float(n)), constants=None)
    point, stepped = Query(X, constants=True), Query(X, {"rim_width": 1e-3})
    monkeypatch.setattr(MODEL, "_steps", [(1, "rim_width", 1e-3)])
    known: dict[Any, Any] = {_key(point): answer, _key(stepped): moved}
    completed = MODEL._completed(point, known)
    assert isinstance(completed, Answer) and completed.constants is not None
    assert completed.constants[:, 0] == pytest.approx(np.full(n, 0.5))
    assert completed.constants[:, 1] == pytest.approx(0.5 + np.arange(n))
    assert answer.constants is not None and (answer.constants == 0.5).all()  # its own stays
    failure = DeckRefused("no such rim")
    assert MODEL._completed(point, {**known, _key(stepped): failure}) is failure
    assert MODEL._completed(Query(X), {_key(Query(X)): moved}) is not moved


def test_a_refusal_with_one_effect_is_that_points_answer() -> None:
    """Springs and air in the cavity do not go together: the others are answered all the same."""
    both = Query(X, {"point_mass": 0.05, "cavity_air": 1.0})
    refused, plain = MODEL.answers([both, Query(X)])
    assert isinstance(refused, DeckRefused) and isinstance(plain, Answer)
    with pytest.raises(DeckRefused):
        other = with_values(CASE, {"effects.cavity_air": 1.0, "effects.point_mass": 0.05})
        TyreModel(other, Evaluator(TyreDesign(other)), ROWS, [], {}).answers([Query(X)])


@pytest.mark.slow
def test_sensitivities_by_differences_are_the_exact_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """By variables, constants, fields of the section and an effect, of frequencies and mass."""
    section = CASE.case.section.model_copy(update={"known_from": "drawing"})
    case = replace(CASE, case=CASE.case.model_copy(update={"section": section}))
    wanted = {"rubber_density", "belt_1_angle", "section meridian 1", "section gauge 1"}
    own_sources = [each for each in sources(case)[0] if each.name in wanted]
    point = Query(X, constants=True, slopes=("pressure_offset",))

    def answered() -> Answer:
        evaluator = Evaluator(TyreDesign(case))
        ranges, _ = effect_ranges(case, evaluator, ("pressure_offset",))
        (answer,) = TyreModel(case, evaluator, ROWS[9:], own_sources, ranges).answers([point])
        assert isinstance(answer, Answer) and answer.constants is not None
        return answer

    exact = answered()
    monkeypatch.setattr(Bundled, "capabilities", Bundled.capabilities - {"gradients"})
    other = answered()
    assert abs(other.jacobian - exact.jacobian).max() < 2e-5 < abs(exact.jacobian).max()
    assert exact.constants is not None and other.constants is not None
    assert (abs(other.constants - exact.constants).max(0) < 2e-5).all()
    assert (abs(exact.constants).max(0) > 2e-4).all() and len(wanted) == exact.constants.shape[1]
    slope, its = (each.slopes["pressure_offset"][:-1] for each in (exact, other))
    assert its == pytest.approx(slope, abs=1e-6) and abs(slope).max() > 1e-3


START = np.array([0.2, -0.1, 0.15])


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
    known, there = expand(toy, np.zeros(3)), expand(toy, START)
    before = toy.asked
    expansion = carried(known, toy, START)
    assert toy.asked == before + 1
    assert expansion.eta == pytest.approx(there.eta) and expansion.x0 == pytest.approx(START)
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
    p = problem(toy, toy.base + toy.J @ START + toy.bend * (START @ START))
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
    truth = toy.answers([Query(START, {"e1": 0.8})])[0]
    assert isinstance(truth, Answer)
    p = problem(toy, truth.eta)
    rows, assumed = list(toy.rows), Assumed(form=0.001, response_error=0.0)
    whole, quick = (
        diagnose(toy, rows, p.observations, assumed=assumed, known=known)
        for known in (None, expand(toy, np.zeros(3)))
    )
    assert whole.verdict.key == quick.verdict.key == "e1"
    assert quick.probabilities == pytest.approx(whole.probabilities, abs=0.01)
