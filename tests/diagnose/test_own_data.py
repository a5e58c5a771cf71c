"""Diagnoses of the real model's own data, also on the road, and refusals before they begin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.measurement import Measurement
from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.diagnose.gap import find_gap, projection
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.diagnose.study import parse_change, study
from tyrecal.studies.diagnose.under_load import LoadedRow, UnderLoad, compare
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.export import add
from tyrecal.studies.footprint import footprint_row
from tyrecal.studies.inference.check_units import check_units
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem, Toggle, places
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.observations import Observable, Observations, observe
from tyrecal.studies.inference.separability import separate
from tyrecal.studies.loaded import LoadedTyre, load_tyres
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.editor import EDITOR_LINE
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..case.test_guard import SLIPS
from ..chance import Chance
from ..studies.hertz import coarser_case
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
    d = diagnose(MODEL, ROWS, plain.observations, known=plain.expansion)
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


@pytest.mark.parametrize(
    ("text", "change"),
    [
        ("bead_filler=1", Toggle("bead_filler", 1.0, False)),
        (" bead_filler = 0", Toggle("bead_filler", 0.0, False)),
        ("bead_filler*0.5", Toggle("bead_filler", 0.5, True)),
    ],
)
def test_a_change_is_a_value_or_a_factor(text: str, change: Toggle) -> None:
    assert parse_change(text) == change


@pytest.mark.parametrize(
    "text", ["bead_filler", "nonsense=0", "bead_filler=x", "=1", "bead_filler*1", "bead_filler=inf"]
)
def test_a_change_that_is_none(text: str) -> None:
    with pytest.raises(InputError):
        parse_change(text)


def test_what_is_not_even_near_the_model_is_refused() -> None:
    """A frequency by a factor of 2, the mass by 1.5, either way; frequencies are told first."""
    rows = [(Label(2, 0), 240.0), (None, 0.0)]
    answer = Answer(np.log([80.0, 12.0]), np.zeros((2, 1)), np.zeros(2))
    start = np.zeros(1)
    model: Any = SimpleNamespace(rows=rows, start=start, answers=lambda points: [answer])

    def check(frequency: float, mass: float) -> None:
        measured = (Observable("mass_kg", None, 0.0), Observable("frequency_Hz", *rows[0]))
        none = np.full(2, np.nan)
        y = np.log([12.0 * mass, 80.0 * frequency])
        check_units(model, Observations(measured, y, none, 0.0, none, none), ["a.csv"], ())

    for good in (1.0, 1.99, 1 / 1.99):
        check(good, 1.0)
    for good in (1.49, 1 / 1.49):
        check(1.0, good)
    for bad in (2.01, 1 / 2.01):
        with pytest.raises(InputError, match=f"a.csv: .* {bad:.2g} times the model's"):
            check(bad, 1.51)
    for bad in (1.51, 1 / 1.51):
        with pytest.raises(InputError, match=f"a.csv: the mass is {bad:.2g} times the model's"):
            check(1.9, bad)


def test_a_model_without_an_answer_says_why_before_anything_is_judged() -> None:
    """A plain tyre gives its own failure; a switched one gives what was switched."""
    rows = [(Label(2, 0), 240.0)]
    answer = Answer(np.log([80.0]), np.zeros((1, 1)), np.zeros(1))
    failure, asked_for = DeckRefused("no such tyre"), []
    none = np.full(1, np.nan)
    seen = Observations((Observable("frequency_Hz", *rows[0]),), answer.eta, none, 0.0, none, none)

    def check(answers: list, *changes: Toggle) -> None:
        answering = lambda points: asked_for.append([dict(p.effects) for p in points]) or answers
        model: Any = SimpleNamespace(rows=rows, start=np.zeros(1), answers=answering)
        check_units(model, seen, ["a.csv"], changes)

    with pytest.raises(DeckRefused, match="no such tyre"):
        check([failure])
    switched = Toggle("point_mass", 0.05, base=0.02)
    with pytest.raises(InputError, match=r"'point_mass=0.05' cannot be evaluated: no such tyre"):
        check([answer, failure], switched)
    check([answer, answer], switched)
    # what is as in the case, or a factor, is no other tyre
    check([answer], replace(switched, value=0.02), replace(switched, times=True))
    assert asked_for == [[{}], *[[{}, {"point_mass": pytest.approx(0.03)}]] * 2, [{}]]


def test_an_effect_is_added_with_the_files_comments_kept(case_folder: Path) -> None:
    old = case_folder / "p235_75r17.yaml"
    new = add(old, {"bead_filler": 1.5})
    added = [line for line in new.read_text().splitlines() if line not in old.read_text()]
    apart = "effects:", EDITOR_LINE.strip()
    assert [word for line in added if (word := line.strip()) not in apart] == ["bead_filler: 1.5"]
    assert "# Table 1 of the paper" in new.read_text()
    with pytest.raises(InputError):
        add(old, {"bead_filler": 1.5})
    with pytest.raises(ValueError, match="no 'nothing'"):
        add(old, {"nothing": 1.5})


def test_an_effect_is_added_to_a_case_whose_numbers_are_unusual(case_folder: Path) -> None:
    """Its user was told of them already."""
    path = case_folder / "p235_75r17.yaml"
    old, new, *_ = next(iter(SLIPS.values()))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert load_case(add(path, {"bead_filler": 1.5}), allow_unusual=True).case.effects


LOADS = [100.0, 600.0]  # a patch of several elements at the last: its stiffness is no noise


SOFTER = 0.9


AREA, STIFFNESS = "contact_area_m2", "vertical_stiffness_N_per_m"


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> LoadedCase:
    return load_case(coarser_case(tmp_path_factory.mktemp("coarse")))


def true_values(case: LoadedCase) -> dict[str, float]:
    """Values of the tyre that is measured."""
    return {**start_values(case), "C10": SOFTER * start_values(case)["C10"], "pressure_kPa": 220.0}


@pytest.fixture(scope="module")
def readings(case: LoadedCase) -> list[Measurement]:
    """Areas and a stiffness of that tyre; the first area as the mean of two."""
    pressed = Evaluator(TyreDesign(case)).press(true_values(case), LOADS)
    low, high = (footprint_row(pressed, each, resolved(case).mesh) for each in pressed.footprints)
    (first, last), area = LOADS, low["area_m2"]
    rows = [
        (AREA, first, 1.01 * area),
        (AREA, first, 0.99 * area),
        (AREA, last, high["area_m2"]),
        (STIFFNESS, last, high[STIFFNESS]),
    ]
    return [Measurement(q, None, "", 220.0, load, x, 0.02 * x) for q, load, x in rows]


@pytest.mark.slow
def test_the_tyre_itself_is_found(case: LoadedCase, readings: list[Measurement]) -> None:
    tyres = {"none": start_values(case), "it": true_values(case)}
    comparison = compare(case, Evaluator(TyreDesign(case)), readings, tyres)
    assert not comparison.failed
    assert [(row.quantity, row.load_N) for row in comparison.rows] == [
        (AREA, LOADS[0]),
        (AREA, LOADS[1]),
        (STIFFNESS, LOADS[1]),
    ]
    assert comparison.rms_percent("it") == pytest.approx(0, abs=1e-6)
    at_last = comparison.rms_percent("none", LOADS[1])
    assert at_last and at_last > 0.5
    stiffness = comparison.rows[-1]
    assert stiffness.off["none"] < 0  # what was measured is softer
    assert comparison.rows[0].sigma == pytest.approx(
        0.02 / np.sqrt(2) * comparison.rows[0].value, rel=1e-3
    )


@pytest.mark.slow
def test_modes_under_load(case: LoadedCase) -> None:
    """Named by the doublet's member; one that the tyre does not have stays without a value."""
    values = {**start_values(case), "pressure_kPa": 220.0}
    (tyre,) = load_tyres(case, Evaluator(TyreDesign(case)), {"": values}, LOADS[:1]).values()
    assert isinstance(tyre, LoadedTyre)
    hertz = {mode.member: mode.frequency_Hz for mode in tyre.loads[-1].modes}
    wanted = [
        Member(Label(1, 1), "symmetric"),
        Member(Label(2, 0), "antisymmetric"),
        Member(Label(0, 0, "axial"), "antisymmetric"),
    ]
    read = [
        Measurement(
            "frequency_Hz", m.label, m.symmetry, 220.0, LOADS[0], hertz.get(m, 37.0), 0.1, 2
        )
        for m in wanted
    ]
    comparison = compare(case, Evaluator(TyreDesign(case)), read, {"none": start_values(case)})
    off = {row.member: row.off for row in comparison.rows}
    assert [off[m]["none"] for m in wanted[:2]] == pytest.approx([0, 0], abs=1e-6)
    assert not off[wanted[2]]


@pytest.mark.slow
def test_what_cannot_be_pressed_is_said(case: LoadedCase, readings: list[Measurement]) -> None:
    """A splice does not go with a road; no tyre bears 1 MN, but what lies below stays."""
    beyond = replace(readings[0], load_N=1e6)
    spliced = {**true_values(case), "effects.stiffness_splice": 0.1}
    tyres = {"none": start_values(case), "it": spliced}
    comparison = compare(case, Evaluator(TyreDesign(case)), [*readings[:2], beyond], tyres)
    first, second = comparison.rows
    assert set(first.off) == {"none"} and not second.off
    assert comparison.rms_percent("it") is None and comparison.rms_percent("none")
    splice, load = sorted(comparison.failed)
    assert "it, 220 kPa: " in splice and "splice" in splice
    assert "none, 220 kPa: " in load and "no equilibrium" in load


def test_tyres_are_compared_on_the_same_rows() -> None:
    rows = [
        LoadedRow(AREA, None, 240.0, load, 0.01, 1e-4, off)
        for load, off in ((1e3, {"a": 0.03, "b": 0.01}), (2e3, {"a": 0.5}))
    ]
    comparison = UnderLoad(tuple(rows), ("a", "b"), ("b, 240 kPa: no",))
    assert comparison.rms_percent("a") == pytest.approx(3) and comparison.rms_percent(
        "b"
    ) == pytest.approx(1)
    assert comparison.rms_percent("a", 2e3) is None
