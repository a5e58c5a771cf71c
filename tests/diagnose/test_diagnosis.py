"""The whole on a tyre in closed form: its stages, twins that a toggle parts, the section, units.

The result of a diagnosis says what was found, under load too, as plain data.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tyrecal.report.diagnosis import page
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.diagnose.diagnosis import STAGES, Diagnosis, diagnose
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.study import DiagnosedCase
from tyrecal.studies.diagnose.under_load import LoadedRow, UnderLoad
from tyrecal.studies.inference.inverse_problem import Assumed, Toggle
from tyrecal.studies.inference.model import Answer, EffectRange, Query
from tyrecal.studies.inference.regions import SectionPart

from ..chance import Chance, generator
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers


def diagnosed(toy: Toy, effects: dict[str, float], seed: int, **keys: object) -> Diagnosis:
    base = problem(toy)
    y = drawn(toy, base, generator(seed), effects, 0.3)
    return diagnose(toy, toy.rows, base.measured(y).observations, assumed=base.assumed, **keys)  # type: ignore[arg-type]


def test_every_stage_is_told_once_and_in_order() -> None:
    stages: list[str] = []
    diagnosis = diagnosed(Toy(effects=1), {"e0": 0.5}, 0, stage=stages.append)
    assert stages == list(STAGES)
    assert repr(diagnosis) == f"Diagnosis({diagnosis.verdict.kind}: {diagnosis.verdict.words})"


@pytest.mark.slow
def test_a_toggle_that_parts_twins_comes_first_and_does() -> None:
    toy = Toy(twin=True, size=0.02)
    toy.tilt["twin"] = 0.98 * toy.tilt["e0"]
    alone = diagnosed(toy, {"e0": 0.7}, 3)
    assert alone.verdict.kind == "undecided"
    words = [choice.what for choice in alone.choices if choice.gain > 0][:2]
    assert any(id in what for what in words for id in ("e0", "twin"))
    base = problem(toy, changes=(Toggle("e0", 0.0),))
    y = drawn(toy, problem(toy), generator(3), {"e0": 0.7}, 0.3)
    noise = generator(4).normal(0, 0.001, len(y))
    both = base.measured(np.concatenate([y, y - 0.7 * toy.g["e0"] + noise])).observations
    after = diagnose(toy, toy.rows, both, (Toggle("e0", 0.0),), base.assumed)
    assert after.verdict.kind == "named" and after.verdict.key == "e0" and after.rung == 4


@pytest.mark.slow
def test_the_section_map_finds_the_part_and_joins_what_looks_alike(chance: Chance) -> None:
    """With its softness within its sigma.

    False failures: 1e-7.
    """
    toy = Toy(size=0.01)
    random = np.random.default_rng(5)  # the tyre is one, its data are drawn
    shape = lambda: np.tile(random.normal(0, 0.3, len(LABELS)), 3)
    soft, other = shape(), shape()
    parts = [
        SectionPart("sidewall", soft, shape() / 10, ""),
        SectionPart("bead", 1.01 * soft, shape() / 10, ""),
        SectionPart("tread", other, shape() / 10, ""),
        SectionPart("nowhere", 0 * soft, 0 * soft, ""),
    ]
    base = problem(toy)
    y = drawn(toy, base, chance.random, {}, 0.3) + 0.05 * soft
    diagnosis = diagnose(
        toy, toy.rows, base.measured(y).observations, assumed=base.assumed, parts=lambda x: parts
    )
    best = diagnosis.parts[0]
    assert best.region in ("sidewall", "bead") and set(best.same_as) == {"sidewall", "bead"} - {
        best.region
    }
    chance.normal([(best.stiffness_percent - 5) / best.stiffness_sigma])
    (nothing,) = [p for p in diagnosis.parts if p.region == "nowhere"]
    assert nothing.evidence == 0 and nothing.stiffness_sigma == pytest.approx(20)
    assert 2 <= diagnosis.effective_rank <= 6


class OtherUnits(Toy):
    """The toy with effects counted in fortieths, and design variables in other units each."""

    effect, x = 40.0, np.array([2.0, 0.5, 1.5])

    def __init__(self, **keys: Any):
        super().__init__(**keys)
        self.spread = self.spread * self.x
        self.ranges = {id: EffectRange(0.0, self.effect) for id in self.ranges}

    def _answer(self, point: Query) -> Answer:
        effects = {id: e / self.effect for id, e in point.effects.items()}
        answer = super()._answer(Query(point.x / self.x, effects, point.constants))
        return replace(answer, jacobian=answer.jacobian / self.x)


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_diagnosis_does_not_depend_on_units(seed: int) -> None:
    """Units of effects and of design variables change no probability, gap, error held out or gain;
    sizes are in the other unit."""
    toys = [
        kind(effects=3, size=0.02, pressures=(200.0, 240.0), bend=0.0) for kind in (Toy, OtherUnits)
    ]
    for toy in toys:
        toy.spread = 0.4 * toy.spread  # so that the prior counts
    base = problem(toys[0])
    y = drawn(toys[0], base, generator(seed), {"e1": 0.4}, 0.5)
    shape = np.random.default_rng(5).normal(0, 0.3, (2, len(y)))
    parts = [SectionPart("a", shape[0], shape[1], ""), SectionPart("b", shape[1], shape[0], "")]
    one, other = (
        diagnosis_result(
            diagnose(
                toy,
                toy.rows,
                base.measured(y).observations,
                assumed=Assumed(form=0.001),
                parts=lambda x: parts,
            )
        ).content()
        for toy in toys
    )
    for content, scale, unit in ((one, 1.0, np.ones(3)), (other, OtherUnits.effect, OtherUnits.x)):
        for sizes in (content["parameter"], *content["parameters"].values()):
            for key in ("value", "low", "high"):
                sizes[key] /= scale
        for key in ("judged_at", "smallest_visible"):
            content[key] = {id: e if e is None else e / scale for id, e in content[key].items()}
        for by, width in zip(content["bias_percent"].values(), unit, strict=True):
            by |= {id: float(np.log1p(change / 100)) / width for id, change in by.items()}
    flat = [list(numbers(content)) for content in (one, other)]
    assert [place for place, _ in flat[0]] == [place for place, _ in flat[1]]
    values = [np.array([value for _, value in each]) for each in flat]
    assert len(values[0]) > 150
    assert values[1] == pytest.approx(values[0], rel=1e-4, abs=1e-6)


def numbers(data: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a result, and where it stands."""
    inner = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in inner:
        if isinstance(value, dict | list):
            yield from numbers(value, f"{place}.{key}")
        elif isinstance(value, int | float):
            yield f"{place}.{key}", float(value)


def test_a_pair_is_told_with_both_sizes() -> None:
    toy = Toy(effects=3, size=0.05)
    d = diagnosed(toy, {"e0": 0.8, "e1": 0.6}, 7)
    content = diagnosis_result(d).content()
    assert content["effect"] == "e0+e1" and set(content["parameters"]) == {"e0", "e1"}
    words = page(DiagnosedCase(d, (), False, {}, (), toy), "tyre", "a.csv")  # type: ignore[arg-type]
    for size in content["parameters"].values():
        assert size["low"] < size["value"] < size["high"]
        number = f"{size['value']:.3g}"
        assert f"is {number}, 90 %" in words and f"{number} ({size['low']:.3g}" in words


def test_the_result_says_what_was_found() -> None:
    d = diagnosed(Toy(effects=3, pressures=(200.0, 240.0)), {"e1": 0.8}, 7)
    content = diagnosis_result(d).content()
    assert [(g["name"], g["p_value"], g["holm"]) for g in content["gap"]["groups"]] == [
        (g.name, g.p_value, g.corrected) for g in d.gap.groups
    ]
    assert any(g["holm"] > g["p_value"] for g in content["gap"]["groups"])
    by = {
        **content["gap"]["by_family"],
        **content["gap"]["by_harmonic"],
        **content["gap"]["by_pressure"],
    }
    assert by == {g.name: g.rms_percent for g in d.gap.groups}
    rows = content["gap"]["residuals"]
    assert [row["percent"] for row in rows] == pytest.approx(100 * d.gap.residuals)
    assert [row["sigma_percent"] for row in rows] == pytest.approx(100 * d.gap.spread)
    assert content["shrinkage"] == {
        name: getattr(d.shrinkage, name)
        for name in d.shrinkage.__dataclass_fields__  # type: ignore[union-attr]
    }
    shares = list(content["probabilities"].values())
    assert shares == sorted(shares, reverse=True) and {"none", "outside"} <= set(
        content["probabilities"]
    )
    kept = {key for key, p in d.probabilities.items() if p > 1e-6}
    assert set(content["probabilities"]) == kept | {"none", "outside"} != set(d.probabilities)


def test_the_result_says_what_was_measured_under_load() -> None:
    """By load where all tyres have an answer, every row with what each tyre is off by."""
    d = diagnosed(Toy(effects=3), {}, 7)
    member = Member(Label(2, 0), "symmetric")
    area = LoadedRow("contact_area_m2", None, 240.0, 3e3, 0.01, 1e-4, {"none": 0.03, "e1": -0.01})
    mode = LoadedRow("frequency_Hz", member, 220.0, 1e3, 80.0, 0.5, {"none": 0.02, "e1": 0.0})
    lost = LoadedRow("contact_area_m2", None, 240.0, 2e3, 0.02, 1e-4, {"none": 0.5})
    rows = (area, mode, lost)
    content = diagnosis_result(d, UnderLoad(rows, ("none", "e1"), ("e1, 240 kPa: no",))).content()
    assert list(content["gap"]["by_load"].items()) == [
        ("1000", pytest.approx(2.0)),
        ("3000", pytest.approx(3.0)),
    ]
    under = content["under_load"]
    assert under["effect"] == "e1" and under["failed"] == ["e1, 240 kPa: no"]
    assert under["calibrated_rms_percent"] == pytest.approx(100 * np.hypot(0.03, 0.02) / 2**0.5)
    assert under["effect_rms_percent"] == pytest.approx(1 / 2**0.5)
    assert [row["calibrated_percent"] for row in under["rows"]] == pytest.approx([3.0, 2.0, 50.0])
    assert [row["effect_percent"] for row in under["rows"]] == [-1.0, 0.0, None]
    assert [row["mode"] for row in under["rows"]] == [None, str(member), None]
    for row, own in zip(under["rows"], rows, strict=True):
        names = ("quantity", "pressure_kPa", "load_N", "measured", "sigma")
        assert [row[name] for name in names] == [
            own.quantity,
            own.pressure_kPa,
            own.load_N,
            own.value,
            own.sigma,
        ]
    alone = diagnosis_result(d, UnderLoad(rows[2:], ("none",), ())).content()["under_load"]
    assert alone["effect"] is None and alone["effect_rms_percent"] is None
    assert alone["rows"][0]["effect_percent"] is None
    assert alone["calibrated_rms_percent"] == pytest.approx(50.0)
    plain = diagnosis_result(d).content()
    assert plain["under_load"] is None and plain["gap"]["by_load"] == {}


def test_the_result_is_plain_data_with_the_promised_keys() -> None:
    import json

    content = diagnosis_result(diagnosed(Toy(effects=3), {}, 7)).content()
    json.dumps(content, allow_nan=False)
    assert {
        "verdict",
        "effect",
        "parameter",
        "probabilities",
        "candidate_set",
        "groups",
        "detectability",
        "gap",
        "section_map",
        "shrinkage",
        "rung",
        "bias_percent",
        "next_measurements",
    } <= set(content)
    assert {"p_value", "rms_percent", "by_family", "by_harmonic", "by_pressure"} <= set(
        content["gap"]
    )
    assert set(content["gap"]["by_family"]) == {"in-plane", "lateral", "[0,0]"}
    assert set(content["bias_percent"]) == {"A", "B", "C"}
    assert {
        "held_out",
        "before_percent",
        "after_percent",
        "fraction",
        "low",
        "high",
        "placebo_95",
    } <= set(content["shrinkage"])
    assert sum(content["probabilities"].values()) == pytest.approx(1, abs=1e-4)
