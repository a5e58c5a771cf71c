"""Effects in the case, calibrated by it or switched in a run; variables in a diagnosis."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.report.diagnosis import page
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.posteriors import calibrated_variables, constants_posterior
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.study import DiagnosedCase, study
from tyrecal.studies.diagnose.verdict import no_gap_words
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem, Toggle
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.sensitivities.selection import likeliest_shifts
from tyrecal.tyre.values import with_values
from tyrecal.units import in_engineers_units

from ..chance import generator
from .coarse_model import CASE, EFFECTS, MODEL, ROWS, X, asked, written
from .toy import Toy, flat, problem

HELD = 0.9


WITH_FILLER = with_values(CASE, {"effects.bead_filler": HELD})


def test_ranges_count_from_what_the_case_has() -> None:
    """From none of the effect to the end of its range, which the case is part of the way to."""
    plain, own = (
        effect_ranges(case, Evaluator(TyreDesign(case)), ["bead_filler"])[0]["bead_filler"]
        for case in (CASE, WITH_FILLER)
    )
    assert (plain.base, own.base) == (0.0, HELD)
    assert own.low == pytest.approx(plain.low - HELD) and own.low < 0
    assert own.high == pytest.approx(plain.high - HELD) and own.high > 0


@pytest.mark.slow
def test_parameters_count_from_what_the_case_has() -> None:
    evaluator = Evaluator(TyreDesign(WITH_FILLER))
    ranges, _ = effect_ranges(WITH_FILLER, evaluator, EFFECTS)
    assert ranges["bead_filler"].low == pytest.approx(-HELD)
    own = TyreModel(WITH_FILLER, evaluator, ROWS, sources(WITH_FILLER)[0], ranges)
    less, as_it_is = own.answers([Query(X, {"bead_filler": -HELD}), Query(X)])
    assert isinstance(less, Answer) and isinstance(as_it_is, Answer)
    assert less.eta == pytest.approx(asked(Query(X)).eta, abs=1e-9)
    assert as_it_is.eta == pytest.approx(asked(Query(X, {"bead_filler": HELD})).eta, abs=1e-9)
    nodes = expand(own, X).nodes["bead_filler"]
    more, _, _ = nodes.at(np.array([1.2 - HELD]))
    wanted = asked(Query(X, {"bead_filler": 1.2})).eta - as_it_is.eta
    assert more[0] == pytest.approx(wanted, abs=5e-4)


@pytest.mark.slow
def test_splits_count_from_what_the_case_has() -> None:
    """A mass on the tread splits pairs by itself, a wider rim does not: neither is added twice."""
    rows = ROWS[:-1]
    case = with_values(CASE, {"effects.point_mass": 0.04})
    evaluator = Evaluator(TyreDesign(case))
    ranges, _ = effect_ranges(case, evaluator, ("point_mass", "rim_width"))
    own = TyreModel(case, evaluator, rows, [], ranges)
    none = np.full(len(rows), np.nan)
    observables = tuple(Observable("frequency_Hz", label, p) for label, p in rows)
    observations = Observations(observables, np.zeros(len(rows)), none, 0.0, none, none)
    problem = InverseProblem(observations, expand(own, X), ranges, np.arange(len(rows)), X, X)
    for id, e in (("point_mass", 0.03), ("point_mass", -0.04), ("rim_width", 5e-3)):
        (there,) = own.answers([Query(X, {id: e})])
        assert isinstance(there, Answer)
        _, _, split, *_ = problem.added({id: np.array([e])}, 1)
        assert split[0] == pytest.approx(abs(there.split), abs=1e-4)
    assert split.max() > 3e-3


@pytest.mark.slow
def test_a_splice_in_the_case_leaves_sensitivities_to_differences() -> None:
    """It has no exact ones; a splice of half its range changes them by less than a tenth."""
    case = with_values(CASE, {"effects.stiffness_splice": 0.5})
    evaluator = Evaluator(TyreDesign(case))
    assert evaluator.difference_step and not Evaluator(TyreDesign(CASE)).difference_step
    (answer,) = TyreModel(case, evaluator, ROWS, [], {}).answers([Query(X)])
    assert isinstance(answer, Answer)
    assert answer.jacobian == pytest.approx(asked(Query(X)).jacobian, rel=0.1, abs=0.01)


@pytest.mark.slow
def test_a_source_of_error_steps_from_what_the_case_has() -> None:
    wide = with_values(CASE, {"effects.rim_width": 4e-3})
    columns = []
    for case in (CASE, wide):
        own = TyreModel(case, Evaluator(TyreDesign(case)), ROWS, sources(case)[0], {})
        (answer,) = own.answers([Query(X, constants=True)])
        assert isinstance(answer, Answer) and answer.constants is not None
        columns.append(answer.constants[:, own.sources.index("rim_width")])
    assert columns[1] == pytest.approx(columns[0], rel=0.3, abs=2e-4)
    assert columns[0] @ columns[1] > 0


@pytest.mark.slow
def test_a_part_of_an_effect_in_the_case_leaves_the_rest_to_be_found(tmp_path: Path) -> None:
    truth = 0.8 * MODEL.ranges["bead_filler"].high
    path = written(tmp_path / "a.csv", asked(Query(X, {"bead_filler": truth})).eta)
    none = study(CASE, Evaluator(TyreDesign(CASE)), path, effects=EFFECTS, section_map=False)
    some = study(
        WITH_FILLER, Evaluator(TyreDesign(WITH_FILLER)), path, effects=EFFECTS, section_map=False
    )
    sizes = [each.diagnosis.parameter("bead_filler") for each in (none, some)]
    assert sizes[1]["low"] < truth < sizes[1]["high"]
    deviation = max(each["high"] - each["low"] for each in sizes) / (2 * 1.645)
    # the law may be off for all of the effect, or for what the case lacks of it alone
    assert sizes[1]["value"] == pytest.approx(sizes[0]["value"], abs=deviation)
    seen = [
        diagnosis_result(each.diagnosis).smallest_visible["bead_filler"] for each in (none, some)
    ]
    assert abs(seen[1]) == pytest.approx(seen[0], rel=0.8)  # nearest to the case, up or down
    words = page(some, "tyre", "a.csv")
    assert "including the 0.9 of the case" in words
    assert "including the" not in page(none, "tyre", "a.csv")


@pytest.mark.slow
def test_a_toggled_run_is_set_to_what_it_says_whatever_the_case_has(tmp_path: Path) -> None:
    truth = 1.5
    one = written(tmp_path / "a.csv", asked(Query(X, {"bead_filler": truth})).eta)
    other = written(tmp_path / "b.csv", asked(Query(X)).eta)
    d = study(
        WITH_FILLER,
        Evaluator(TyreDesign(WITH_FILLER)),
        one,
        toggled=[(other, Toggle("bead_filler", 0.0))],
        effects=EFFECTS,
        section_map=False,
    ).diagnosis
    size = d.parameter("bead_filler")
    assert d.rung == 4 and size["low"] < truth < size["high"]


@pytest.mark.slow
def test_a_run_switched_beyond_the_range_is_asked_there(tmp_path: Path) -> None:
    """The range is where the effect may be, not how far a laboratory can go with it."""
    far = 1.5 * MODEL.ranges["bead_filler"].high
    one = written(tmp_path / "a.csv", asked(Query(X)).eta)
    other = written(tmp_path / "b.csv", asked(Query(X, {"bead_filler": far})).eta)
    result = study(
        CASE,
        Evaluator(TyreDesign(CASE)),
        one,
        toggled=[(other, Toggle("bead_filler", far))],
        effects=EFFECTS,
        section_map=False,
    )
    d = result.diagnosis
    nodes, own = d.bare.expansion.nodes["bead_filler"], d.bare.expansion
    assert nodes.reach[1] == MODEL.ranges["bead_filler"].high
    shift, _, _ = nodes.at(np.array([far]))
    (there,) = result.model.answers([Query(own.x0, {"bead_filler": far})])
    assert isinstance(there, Answer)
    assert shift[0] == pytest.approx(there.eta - own.eta, abs=1e-9)
    assert d.verdict.kind in ("no_gap", "undecided") and d.probabilities["none"] > 0.25


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (Toggle("point_mass", 0.05), "not among the effects"),
        (Toggle("bead_filler", -40.0), "cannot be evaluated"),
    ],
)
def test_a_change_that_the_diagnosis_cannot_follow(
    tmp_path: Path, change: Toggle, words: str
) -> None:
    one = written(tmp_path / "a.csv", asked(Query(X)).eta)
    other = written(tmp_path / "b.csv", asked(Query(X)).eta, noise=2e-3)
    with pytest.raises(InputError, match=words):
        study(CASE, Evaluator(TyreDesign(CASE)), one, toggled=[(other, change)], effects=EFFECTS)


@pytest.mark.slow
def test_an_effect_that_a_variable_sets_is_no_candidate(tmp_path: Path) -> None:
    variable = CASE.case.variables["C10"].model_copy(
        update={"sets": ["effects.bead_filler"], "start": 0.5, "lower": 0.1, "upper": 3.0}
    )
    variables = {**CASE.case.variables, "filler": variable}
    case = replace(CASE, case=CASE.case.model_copy(update={"variables": variables}))
    path = written(tmp_path / "a.csv", asked(Query(X)).eta)
    result = study(case, Evaluator(TyreDesign(case)), path, effects=EFFECTS, section_map=False)
    assert result.calibrated == ("bead_filler",)
    assert not result.diagnosis.problem.expansion.failed
    assert "bead_filler" not in result.diagnosis.probabilities
    words = page(result, "tyre", "a.csv")
    assert "Not considered, because a variable of the case calibrates them: `bead_filler`." in words
    assert (
        "Considered, by your choice: only `tread_density`, `pressure_offset` of the catalogue"
        in words
    )
    variable = variable.model_copy(
        update={"sets": ["pressure_kPa"], "start": 200.0, "lower": 100.0, "upper": 400.0}
    )
    case = replace(CASE, case=CASE.case.model_copy(update={"variables": {"p": variable}}))
    with pytest.raises(InputError, match="sets pressure_kPa"):
        study(case, Evaluator(TyreDesign(case)), path, effects=EFFECTS)


@pytest.mark.slow
def test_what_is_wrong_with_a_file_names_that_file(tmp_path: Path) -> None:
    one = written(tmp_path / "a.csv", asked(Query(X)).eta)
    copy = tmp_path / "copy.csv"
    copy.write_text(one.read_text())
    with pytest.raises(InputError, match=r"copy.csv: has the same values as .*a.csv"):
        study(CASE, Evaluator(TyreDesign(CASE)), one, [copy], effects=EFFECTS)
    high = written(tmp_path / "high.csv", asked(Query(X)).eta[:-1] + 1.0, ROWS[:-1])
    with pytest.raises(InputError, match=r"high.csv: .* right unit"):
        study(
            CASE,
            Evaluator(TyreDesign(CASE)),
            one,
            [],
            [(high, Toggle("bead_filler", 0.0))],
            effects=EFFECTS,
        )
    on_rim = written(tmp_path / "rim.csv", asked(Query(X)).eta + 0.6 * (np.arange(19) == 18))
    with pytest.raises(InputError, match=r"rim.csv: the mass is 1.8 times .* without its rim"):
        study(CASE, Evaluator(TyreDesign(CASE)), on_rim, effects=EFFECTS)


START = np.array((0.3, -0.2, 0.1))


def exact(toy: Toy, effects: dict[str, float]) -> Diagnosis:
    """Diagnosis of data at X without scatter."""
    base, (answer,) = problem(toy), toy.answers([Query(START, effects)])
    assert isinstance(answer, Answer)
    seen = base.measured(answer.eta[base.places]).observations
    return diagnose(toy, toy.rows, seen, assumed=base.assumed)


def told(d: Diagnosis, toy: Toy) -> str:
    return page(DiagnosedCase(d, (), False, {}, (), toy), "tyre", "a.csv")  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def toy() -> Toy:
    return Toy(effects=3, size=0.03)


@pytest.fixture(scope="module")
def named(toy: Toy) -> Diagnosis:
    return exact(toy, {"e0": 0.8})


@pytest.fixture(scope="module")
def plain(toy: Toy) -> Diagnosis:
    return exact(toy, {})


def test_the_variables_with_the_effect_are_the_truth(toy: Toy, named: Diagnosis) -> None:
    """As near as a standard error: the data have no scatter, the prior and the grid of sizes pull
    a little; a logarithm's scatter is the variable's share."""
    calibrated = calibrated_variables(named, toy)  # type: ignore[arg-type]
    assert named.leading == "e0" and set(calibrated) == {"without", "with"}
    for variable, truth in zip(calibrated["with"].values(), 2 * np.exp(START), strict=True):
        assert variable["unit"] == "Pa" and 0 < variable["standard_error"] < 0.05 * truth
        assert abs(variable["value"] - truth) < variable["standard_error"]
    assert calibrated["without"].keys() == calibrated["with"].keys() == set(toy.variables)
    assert "calibrated" not in diagnosis_result(named).content()
    assert diagnosis_result(named, None, calibrated).content()["calibrated"] == calibrated


def test_the_page_has_them_with_units(toy: Toy, named: Diagnosis) -> None:
    words = told(named, toy)
    assert words.startswith("# What the model of tyre lacks")
    assert "| variable | without an effect | with `e0` |" in words
    rows = re.findall(r"^\| ([ABC]) \| (\S+) MPa ± \S+ % \| (\S+) MPa ± \S+ % \|$", words, re.M)
    assert [name for name, *_ in rows] == list(toy.variables)
    calibrated = calibrated_variables(named, toy)  # type: ignore[arg-type]
    for name, _, value in rows:
        assert float(value) == pytest.approx(1e-6 * calibrated["with"][name]["value"], rel=1e-3)
    unseen = {**named.separability.smallest, "e1": None}
    blind = replace(named, separability=replace(named.separability, smallest=unseen))
    for d, count in ((named, 0), (blind, 1)):
        (line, *_) = [*re.findall(r"^.*at any size.*$", told(d, toy), re.M), ""]
        assert line.count("`e1`") == count and "`e0`" not in line


def test_where_there_is_no_gap_nothing_explains_it(toy: Toy, plain: Diagnosis) -> None:
    """Said once, no effect beside the calibrated variables, none that shrinks an error."""
    assert plain.verdict.kind == "no_gap" and plain.leading is None
    words = told(plain, toy)
    assert words.lower().count(no_gap_words(plain.probabilities["none"])) == 1
    assert "lacks" not in words and "it shrinks by" not in words
    assert "| variable | without an effect |\n" in words
    assert calibrated_variables(plain, toy)["with"] is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (-0.00934, "m", "-9.34 mm"),
        (2.1e-7, "m2", "0.21 mm²"),
        (1.26e6, "Pa", "1.26 MPa"),
        (3e-7, "m/N", "0.3 mm/kN"),
        (0.25, "", "0.25"),
        (-3.0, "degrees", "-3 degrees"),
    ],
)
def test_sizes_in_the_units_people_say_them_in(value: float, unit: str, words: str) -> None:
    assert in_engineers_units(value, unit, 3) == words


@pytest.mark.parametrize("spread", [1.0, 0.02])
def test_constants_are_their_mean_over_all_tyres_that_fit(spread: float) -> None:
    """Also where the variables are known before, so that they do not absorb all that they could:
    the closed form, by the covariance of deviations at the variables' prior."""
    toy: Any = flat(effects=0, pressures=(160.0, 240.0))
    toy.spread = np.full(3, spread)
    toy.constants *= 3
    base = problem(toy, assumed=Assumed(form=0.001))
    off = toy.constants @ [2.0, -1.5] + toy.J @ np.full(3, 0.5 * spread)
    y = toy.base + off + 0.002 * generator("constants").normal(size=len(toy.base))
    data = base.measured(y).observations
    diagnosis = diagnose(toy, toy.rows, data, assumed=Assumed(form=0.001), ranked=False)
    reported = {each.name: each.shift_in_sd for each in constants_posterior(diagnosis)}
    J = toy.J * toy.spread
    known = base.covariance(data, np.zeros((len(y), 0))) + J @ J.T
    shifts = likeliest_shifts(y - toy.base, known, toy.constants)
    assert list(reported) == sorted(reported, key=lambda name: -abs(reported[name]))
    assert reported == pytest.approx(dict(zip(toy.sources, shifts, strict=True)), abs=1e-3)
