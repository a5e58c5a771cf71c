"""Properties of every effect: absent at 0, smooth, exact slopes, refusals in one sentence."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.tyre import effects
from tyrecal.tyre.case import CaseError
from tyrecal.tyre.effects import IDS, Effect, catalogue
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from ..conftest import ROOT
from ..solved import calibrate
from .support import CASE, CASES, START, coarse, data, decks, frequencies, slopes

EFFECTS = list(catalogue().values())
each = pytest.mark.parametrize("effect", EFFECTS, ids=[effect.id for effect in EFFECTS])
EXACT = [effect for effect in EFFECTS if effect.id != "stiffness_splice"]  # it has differences
DEAR = {"road_contact", "point_mass", "rotation"}  # whose modes are of several harmonics
STEP = 1e-3  # of the parameter; central differences are then right to 1e-5 or so


@each
def test_entry_is_complete(effect: Effect) -> None:
    assert effect.id in IDS
    assert effect.low < effect.high and effect.low <= 0 <= effect.high
    assert all((effect.title, effect.symbol, effect.changes, effect.signature, effect.toggle))
    assert set(effect.aliases) <= set(IDS)


@each
def test_a_range_is_a_passenger_tyre_s_and_of_some_goes_with_the_pressure(effect: Effect) -> None:
    """A truck, three times as stiff, bends a clamp as much as a car does where that gives way a
    third of it, is measured by a gauge off by as large a share, and warms by no more in its run."""
    assert effect.range_on(CASE) == (effect.low, effect.high)
    truck = replace(CASE, file_data={**CASE.file_data, "pressure_kPa": 720.0})
    third = effect.id.startswith("spindle") or effect.id == "temperature_drift"
    times = 1 / 3 if third else 3.0 if effect.id == "pressure_offset" else 1.0
    assert effect.range_on(truck) == pytest.approx((times * effect.low, times * effect.high))
    ranges, _ = effect_ranges(truck, Evaluator(TyreDesign(truck)), [effect.id])
    span = ranges.get(effect.id)  # road contact and the like, where a solver has them
    assert span is None or (span.low, span.high) == pytest.approx(effect.range_on(truck))


def test_a_case_without_effects_is_the_very_case() -> None:
    assert resolved(CASE).written is CASE


@each
def test_zero_writes_the_same_decks(effect: Effect) -> None:
    plain = data(Decks(TyreDesign(CASE)))
    assert decks(CASE, **{effect.id: 0.0}) == plain
    assert decks(CASE, **{effect.id: effect.high}) != plain


@each
def test_effect_is_written_in_the_case_and_none_is_left(effect: Effect) -> None:
    case = with_values(CASE, {f"effects.{effect.id}": effect.high})
    applied = resolved(case).written
    assert not any(applied.case.effects.values())
    assert resolved(applied).written is applied
    assert CASE.case.effects[effect.id] == 0


@pytest.mark.parametrize(
    "effect",
    [pytest.param(e, marks=[pytest.mark.slow] * (e.id in DEAR)) for e in EXACT],
    ids=[effect.id for effect in EXACT],
)
def test_slopes_are_those_of_the_frequencies(effect: Effect) -> None:
    at = 0.4 * effect.high
    name = f"effects.{effect.id}"
    evaluator = Evaluator(TyreDesign(CASE))
    f = {
        side: np.array(
            [m.frequency_Hz for m in evaluator.evaluate(Question({**START, name: at * side})).modes]
        )
        for side in (1 - STEP, 1 + STEP)
    }
    central = (f[1 + STEP] - f[1 - STEP]) / (2 * STEP * at)
    exact = slopes(CASE, effect.id, at)
    assert abs(central).max() * effect.high > 1e-3 * f[1 + STEP].min()  # it does something
    assert exact == pytest.approx(central, rel=1e-4, abs=1e-4 * abs(central).max())


@pytest.mark.parametrize("id", ["bead_filler", "tread_density", "belt_angle", "cap_ply"])
def test_slope_next_to_nothing(id: str) -> None:
    """The deck's digits do not show a share of next to nothing, but the slope is still there."""
    low, high = (slopes(CASE, id, share * catalogue()[id].high) for share in (1e-12, 1e-4))
    assert low == pytest.approx(high, rel=1e-2, abs=1e-3 * abs(high).max())


@pytest.mark.parametrize(
    ("method", "start"), [("slsqp", 0.0), pytest.param("gauss-newton", 1.0, marks=pytest.mark.slow)]
)
def test_a_fit_ends_where_an_effect_is_absent(method: str, start: float) -> None:
    """Frequencies lower than the plain tyre's want a filler softer than none: the bound 0."""
    modes = [
        t.model_copy(update={"frequency_Hz": 0.95 * f})
        for t in CASE.case.targets.modes
        for label, f in frequencies().items()
        if (label.c, label.m, label.kind) == (t.c, t.m, t.kind)
    ]
    filler = CASE.case.variables["C10"].model_copy(
        update={
            "sets": ["effects.bead_filler"],
            "start": start,
            "lower": 0.0,
            "upper": 3.0,
            "scale": "linear",
        }
    )
    targets = CASE.case.targets.model_copy(update={"modes": modes})
    changed = CASE.case.model_copy(update={"targets": targets, "variables": {"filler": filler}})
    case = replace(CASE, case=changed)
    result = calibrate(case, Evaluator(TyreDesign(case)), method).result
    variable = result["variables"]["filler"]
    assert result["converged"] and variable["at_bound"] and 0 <= variable["value"] < 1e-3
    assert result["moved"] == (start > 0)
    assert (variable["lower"], variable["upper"]) == (0.0, 3.0)


@each
def test_slope_at_zero_or_one_sentence(effect: Effect) -> None:
    name = f"effects.{effect.id}"
    evaluate = Decks(TyreDesign(with_values(CASE, {name: 0.0}), {name: 0.0}), (name,)).tangents
    try:
        rows = evaluate("abaqus")[name]
    except TemplateFailed as error:
        assert f"{name} is 0" in str(error)
    else:
        assert rows


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("effects: {tread_density: 0.1, cap_pli: 1.0}", "did you mean 'cap_ply'"),
        ("effects: {tread_wear: 5.0}", "effects.tread_wear is 5.0: usual is 0 to 0.5"),
        ("effects: {tread_wear: much}", "must be a number"),
        ("effects: 3", "must be a table"),
    ],
)
def test_case_file_says_what_is_wrong(case_folder, text: str, words: str) -> None:
    path = case_folder / "p235_75r17.yaml"
    path.write_text(path.read_text() + text + "\n")
    with pytest.raises(CaseError) as refused:
        load_case(path)
    assert words in str(refused.value)


def test_case_file_holds_effects_and_varies_them(case_folder) -> None:
    path = case_folder / "p235_75r17.yaml"
    variable = (
        "variables:\n  gauge: {sets: [effects.pressure_offset], start: 2, lower: 1, upper: 5}"
    )
    text = path.read_text().replace("variables:", variable)
    path.write_text(text + "effects: {temperature: 5}\n")
    case = load_case(path)
    by_variable = data(Decks(TyreDesign(with_values(case, {"gauge": 3.0}))))
    assert by_variable == decks(load_case(CASES / path.name), temperature=5, pressure_offset=3)


@pytest.mark.parametrize(
    ("id", "value"),
    [
        ("dynamic_stiffening", -0.1),
        ("tread_density", -1.0),
        ("tread_wear", 0.95),
        ("bead_filler", -1.0),
        ("cap_ply", -1.0),
        ("belt_angle", 70.0),
        ("belt_angle", -20.0),
        ("belt_width", 0.1),
        ("carcass_fanning", 1.01),
        ("carcass_turn_up", -0.1),
        ("sidewall_gauge", -0.95),
        ("sidewall_gauge", 9.0),  # the section folds over
        ("rim_width", 0.1),
        ("bead_seat", -0.1),
        ("bead_seat", 1.0),
        ("pressure_offset", -161.0),
        ("temperature", 134.0),
        ("temperature_drift", -170.0),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(id: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"^effects.{id} [^\n]*, got {value:g}$"):
        with_values(CASE, {f"effects.{id}": value})


def test_a_design_that_cannot_be_is_a_failure_to_step_back_from() -> None:
    with pytest.raises(EvaluationFailed, match="tread_wear") as failed:
        Evaluator(TyreDesign(CASE)).evaluate(Question({"effects.tread_wear": 2.0}))
    assert failed.value.cause == "refused"


def test_a_solver_says_which_effect_it_cannot_express() -> None:
    with pytest.raises(DeckRefused, match="'calculix' cannot express"):
        Evaluator(TyreDesign(CASE), "calculix").evaluate(
            Question({"effects.dynamic_stiffening": 0.1})
        )


def test_a_tyre_without_a_belt_has_no_effects_of_it() -> None:
    layers = {"carcass": CASE.case.rebar_layers["carcass"]}
    bare = replace(CASE, case=CASE.case.model_copy(update={"rebar_layers": layers}))
    for id in ("tread_density", "cap_ply", "belt_angle", "belt_width", "sidewall_gauge"):
        with pytest.raises(ValueError, match=f"^effects.{id} must be 0: this case has no belt"):
            with_values(bare, {f"effects.{id}": catalogue()[id].high})
    assert with_values(bare, {"effects.temperature": 5.0})


@each
def test_other_shipped_case_has_a_deck_of_it(effect: Effect) -> None:
    other = with_values(coarse("p235_75r17_narrow_rim.yaml"), {"pressure_kPa": 200.0})
    assert decks(other, **{effect.id: effect.high / 2}) != decks(other)


@pytest.mark.slow
def test_a_new_file_is_all_that_a_new_effect_touches(tmp_path: Path) -> None:
    """A copy of the package finds a new effect, lists it in its place and writes it into the
    case."""
    package = shutil.copytree(ROOT / "tyrecal", tmp_path / "tyrecal")
    text = (package / "tyre/effects/belt_angle.py").read_text()
    text = text.replace('id="belt_angle"', 'id="steeper_belts"').replace("place=70", "place=71")
    (package / "tyre/effects/steeper_belts.py").write_text(text)
    program = f"""
from tyrecal.tyre.effects import IDS, catalogue
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values
assert IDS.index("steeper_belts") == IDS.index("belt_angle") + 1
assert list(catalogue()) == list(IDS) and len(set(IDS)) == len(IDS)
case = load_case({str(CASES / "p235_75r17.yaml")!r})
made = [resolved(with_values(case, {{f"effects.{{id}}": 1.5}})).case for id in IDS[6:8]]
assert made[0] == made[1] != resolved(case).case
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_an_effect_that_cannot_be_loaded_is_named_and_left_out(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    broken = EntryPoint("broken", "no_such_package:EFFECT", "tyrecal.effects")
    odd = EntryPoint("odd", "tyrecal.version:__version__", "tyrecal.effects")
    monkeypatch.setattr(effects, "ADDED", {"broken": broken, "odd": odd})
    monkeypatch.setattr(effects, "IDS", (*effects.IDS, "broken", "odd"))
    others = effects.catalogue.__wrapped__()
    assert list(others) == [id for id in effects.IDS if id not in ("broken", "odd")]
    assert "effect 'broken' of 'no_such_package:EFFECT' cannot be loaded" in caplog.text
    assert "effect 'odd' of 'tyrecal.version:__version__' cannot be loaded" in caplog.text
    with pytest.raises(InputError, match="'broken'"):
        others["broken"]
