"""The result of a diagnosis says what was found, under load too, as plain data."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.report.diagnosis import page
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.study import DiagnosedCase
from tyrecal.studies.diagnose.under_load import LoadedRow, UnderLoad

from .test_diagnosis import diagnosed
from .toy import Toy

pytestmark = pytest.mark.numbers


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
