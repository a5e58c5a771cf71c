"""The pressure sweep's own arithmetic, on tyres whose answers are known.

Pressures of a sweep without ends: round the case's own.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.studies.fitted import read_fitted
from tyrecal.studies.pressure import State, findings, sweep
from tyrecal.studies.pressure_range import PressureRange
from tyrecal.studies.pressure_result import slopes, sweep_result
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import pressure_name
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from ..evaluate.stand_in import CASE
from ..fit.fake import LABELS, shape

P = [100.0, 130.0, 200.0, 320.0]
AXIAL, TORSIONAL = LABELS[:2]


def states(curves, mixing=lambda p: 0.0):
    """States with frequencies curves[label](p); the two [0,0] shapes turned into one another by
    the angle ``mixing(p)``."""
    made = []
    for p in P:
        raw = []
        for label, f in curves.items():
            x = shape(label)
            if label.c == 0:
                other = shape(TORSIONAL if label == AXIAL else AXIAL)
                turn = mixing(p) * (1 if label == AXIAL else -1)
                u = np.cos(turn) * x.amplitude + np.sin(turn) * other.amplitude
                x = HarmonicShape(0, x.nodes, x.points, u)
            raw.append(RawMode(f(p), x, 2 if label.c else 1))
        made.append(State("initial", p, label_modes(raw), None))
    return made


def test_slopes_by_differences_are_exact_for_a_power_of_the_pressure_with_a_bend():
    """ln f quadratic in ln p: second-order differences have no error, at uneven steps and ends."""
    f = lambda p: 20 * np.exp(0.3 * np.log(p) + 0.02 * np.log(p) ** 2)
    rises = slopes(states({Label(2, 0): f}), [Label(2, 0)])[Label(2, 0)]
    assert rises == pytest.approx([0.3 + 0.04 * np.log(p) for p in P], rel=1e-9)


def test_slopes_of_few_pressures():
    made = states({Label(2, 0): lambda p: p**0.4})
    assert slopes(made[:1], [Label(2, 0)]) == {Label(2, 0): [None]}
    assert slopes(made[:2], [Label(2, 0)])[Label(2, 0)] == pytest.approx([0.4, 0.4])


def test_findings_name_every_exception():
    curves = {
        AXIAL: lambda p: 30 + 0.0001 * p**2,  # convex
        TORSIONAL: lambda p: 38 + 10 * np.sin(p / 60),  # falls, and bends both ways
        Label(1, 0): lambda p: 60 + np.sqrt(p),
        Label(2, 0): lambda p: 80 + 3 * np.sqrt(p),
        Label(3, 0): lambda p: 90 + 2 * np.sqrt(p),  # rises less than [2,0]
    }
    content = findings(states(curves), list(curves)).model_dump()
    by_label = {(m["c"], m["m"], m["kind"]): m for m in content["modes"]}
    assert [m["curvature"] for m in content["modes"]] == ["convex", "neither"] + ["concave"] * 3
    assert [m["rises"] for m in content["modes"]] == [True, False, True, True, True]
    assert by_label[2, 0, None]["rise_Hz"] == pytest.approx(3 * (np.sqrt(320) - 10))
    assert by_label[0, 0, "axial"]["convex_at_kPa"] == [130.0, 200.0]
    inner, outer = content["families"]
    assert inner["members"] == ["[0,0] torsional", "[1,0]", "[2,0]", "[3,0]"]
    assert not inner["grows_with_c"] and inner["exceptions"] == ["[3,0]"]
    assert outer["members"] == ["[0,0] axial"] and outer["grows_with_c"]
    text = "\n".join(content["words"])
    assert "every mode rises, except [0,0] torsional from 100 to 320 kPa" in text
    assert "the rise grows with c, except [3,0]" in text
    assert "except [0,0] lateral (convex), [0,0] torsional (neither)" in text
    assert content["disagreements"] == [] and content["least_mac"] == pytest.approx(1.0)
    assert "labels follow the shapes" in text and "three pressures" not in text
    two = findings(states(curves)[:2], list(curves)).model_dump()
    assert {m["curvature"] for m in two["modes"]} == {"unknown"}
    assert "the curvature needs three pressures" in two["words"]


def test_modes_that_cross_keep_their_labels_and_modes_that_mix_are_told():
    """Frequencies cross between 130 and 200 kPa. Where the shapes do not mix, label and shape go
    on together; where they change into one another in small turns, the labels part from them."""
    curves = {AXIAL: lambda p: 30 + 0.1 * (p - 150), TORSIONAL: lambda p: 30 + 0.01 * (p - 150)}
    plain = states(curves)
    assert plain[0].modes[0].frequency_Hz < plain[0].modes[1].frequency_Hz
    assert plain[3].frequencies == pytest.approx({AXIAL: 47.0, TORSIONAL: 31.7})
    assert findings(plain, [AXIAL, TORSIONAL]).disagreements == []

    mixing = findings(
        states(curves, lambda p: np.pi / 2 * P.index(p) / 3), [AXIAL, TORSIONAL]
    ).model_dump()
    disagreements = mixing["disagreements"]
    assert {(d["from_kPa"], d["to_kPa"]) for d in disagreements} == {(130.0, 200.0)}
    assert {(d["label"], d["followed_to"]) for d in disagreements} == {
        (str(AXIAL), str(TORSIONAL)),
        (str(TORSIONAL), str(AXIAL)),
    }
    assert mixing["least_mac"] == pytest.approx(np.cos(np.pi / 6) ** 2)
    assert "continues under the label" in mixing["words"][-1]


def test_families() -> None:
    assert [x.family for x in (TORSIONAL, Label(4, 0), Label(12, 0))] == ["in-plane"] * 3
    assert [x.family for x in (AXIAL, Label(1, 1))] == ["out-of-plane"] * 2
    assert [x.family for x in (Label(0, 1), Label(0, 2), Label(3, 2))] == [None] * 3


@pytest.mark.slow
def test_more_modes_are_asked_for_where_a_target_is_lost() -> None:
    case = load_case(CASES / "p235_75r17.yaml")
    few = case.case.analysis.model_copy(update={"modes_per_harmonic": 1})
    from dataclasses import replace

    short = replace(case, case=case.case.model_copy(update={"analysis": few}))
    evaluator = Evaluator(TyreDesign(short))
    outcomes = sweep(short, evaluator, {"initial": start_values(case)}, [200.0])
    assert evaluator.counts.runs == 3  # the nominal tyre, this one, and again with more modes
    (whole,) = sweep(case, Evaluator(TyreDesign(case)), {"initial": start_values(case)}, [200.0])
    (state,) = outcomes
    for label in LABELS:
        assert state.frequencies[label] == pytest.approx(whole.frequencies[label], rel=1e-9)
    result = sweep_result(short, {"initial": {}}, outcomes).content()
    assert result["findings"] == [] and len(result["rows"]) == 1


@pytest.mark.slow
def test_a_variable_that_sets_the_pressure_is_what_is_swept(case_folder: Path) -> None:
    path = case_folder / "p235_75r17.yaml"
    extra = (
        "  inflation:\n    sets: [pressure_kPa]\n    start: 240\n    lower: 50\n    upper: 400\n"
    )
    path.write_text(path.read_text().replace("\ntargets:", f"\n{extra}\ntargets:"))
    case = load_case(path)
    assert pressure_name(case) == "inflation"
    (ours,) = sweep(case, Evaluator(TyreDesign(case)), {"initial": start_values(case)}, [200.0])
    plain = load_case(CASES / "p235_75r17.yaml")
    assert pressure_name(plain) == "pressure_kPa"
    (theirs,) = sweep(
        plain, Evaluator(TyreDesign(plain)), {"initial": start_values(plain)}, [200.0]
    )
    assert ours.frequencies == theirs.frequencies
    for label, slope in theirs.slopes.items():
        assert ours.slopes[label] == pytest.approx(slope, rel=1e-6)


FIT = {
    "variables": {"A_belt": {"value": 2e-7}, "A_carcass": {"value": 4e-7}},
    "fixed": {"C10": 1e6},
    "pressure_kPa": 240.0,
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fixed": {}}, "variable 'C10' is missing"),
        ({"fixed": {"C10": 1e6, "C01": 1.0}}, "variable 'C01' of this case is not known"),
        ({"fixed": {"C10": "soft"}}, "'C10' is 'soft'"),
        ({"fixed": {"C10": float("nan")}}, "'C10' is nan"),
        ({"fixed": {"C10": True}}, "'C10' is True"),
        ({"fixed": {"C10": -1e6}}, "C10_Pa"),
        ({"variables": [1, 2]}, "not the fit.json"),
        ({"pressure_kPa": None}, "not the fit.json"),
        ({"provenance": None}, "not the fit.json"),
        ({"provenance": {}}, "does not state its tyre"),
        ({"provenance": {"tyre_sha256": "0"}}, "of another tyre: .* has been edited since"),
    ],
)
def test_a_file_that_is_no_fit_of_this_case(change: dict, words: str, tmp_path: Path) -> None:
    case = load_case(CASES / "p235_75r17.yaml")
    path = tmp_path / "fit.json"
    right = FIT | {"provenance": {"tyre_sha256": tyre_sha256(case), "mesh": "default"}}
    path.write_text(json.dumps(right | change))
    with pytest.raises(InputError, match=words) as refused:
        read_fitted(path, case)
    assert "\n" not in str(refused.value)
    path.write_text(json.dumps(right))
    assert read_fitted(path, case) == ({"A_belt": 2e-7, "A_carcass": 4e-7, "C10": 1e6}, [])


@pytest.mark.parametrize(("own", "ends"), [(240, (100, 320)), (850, (350, 1130))])
def test_default_ends_follow_the_case(own: float, ends: tuple[float, float]) -> None:
    case = with_values(CASE, {"pressure_kPa": own})
    pressures = PressureRange(None, None, 12).on(case)
    assert (pressures[0], pressures[-1], len(pressures)) == (*ends, 12)
    assert pressures == sorted(pressures) and pressures[0] < own < pressures[-1]


def test_an_end_that_is_given_counts() -> None:
    assert PressureRange(200.0, None, 4).on(CASE) == [200, 240, 280, 320]
    assert PressureRange(None, 110.0, 3).on(CASE) == [100, 105, 110]
    with pytest.raises(
        InputError, match=r"100 must be less than --to-kPa 90 \(default: 100 to 320"
    ):
        PressureRange(None, 90.0, 3).on(CASE)
