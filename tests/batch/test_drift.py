"""Drift: what is allowed is allowed, what is not is said, whatever the numbers.

JUnit XML: valid for CI servers, complete, whatever the words.
"""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
import xmlschema
from hypothesis import given, settings
from hypothesis import strategies as some

from tyrecal.batch.case import Asked, CaseTask, lost
from tyrecal.batch.drift import DEFAULTS, OTHER_QUANTITIES, baseline_of, compare, read_baseline
from tyrecal.batch.junit import drift_line, junit
from tyrecal.batch.run import summary
from tyrecal.errors import InputError
from tyrecal.studies import STUDIES
from tyrecal.studies.pressure_range import PressureRange

from ..conftest import ROOT
from .support import entry, report

FINITE = some.floats(-1e9, 1e9)


def one(x: float, tolerance: dict[str, float], name: str = "fit/f") -> dict:
    """A baseline of a single number."""
    tolerances = {"fit/f": {"relative": 0.5}, name: tolerance}
    return {"format": 1, "tolerances": tolerances, "cases": {"a": {"fit": {"f [1,0]": x}}}}


def reports(x: float) -> list[dict]:
    return [report("a", fit=entry(**{"f [1,0]": x}))]


@given(FINITE, FINITE, some.floats(0, 2), some.floats(0, 1e6))
def test_a_number_drifts_beyond_the_larger_tolerance(
    old: float, new: float, relative: float, absolute: float
) -> None:
    drift = compare(reports(new), one(old, {"relative": relative, "absolute": absolute}))
    assert drift["compared"] == 1
    assert bool(drift["drifted"]) == (abs(new - old) > max(relative * abs(old), absolute))


@given(FINITE)
def test_the_same_number_never_drifts_even_where_nothing_is_allowed(x: float) -> None:
    assert not compare(reports(x), one(x, {}))["drifted"]


def test_the_name_that_says_more_wins() -> None:
    assert compare(reports(1.1), one(1.0, {"relative": 0.01}, "fit/f [1,0]"))["drifted"]
    assert not compare(reports(1.1), one(1.0, {"relative": 0.01}, "fit/f [2,0]"))["drifted"]


def test_what_is_gone_missing_or_new_is_said() -> None:
    before = [
        report("a", fit=entry(objective=1.0, mass_kg=2.0), modes=entry(mass_kg=2.0)),
        report("b", fit=entry(objective=1.0)),
    ]
    now = [
        report("a", fit=entry(objective=1.0, **{"fitted_Hz [1,0]": 3.0}), footprint=entry()),
        report("c", fit=entry(objective=1.0)),
    ]
    drift = compare(now, baseline_of(before, None))
    (gone,) = drift["drifted"]
    assert (gone["quantity"], gone["value"]) == ("mass_kg", None)
    assert drift_line(gone) == "mass_kg: 2 is gone"
    assert (drift["missing_cases"], drift["new_cases"]) == (["b"], ["c"])
    assert (drift["missing_studies"], drift["new_studies"]) == (["a/modes"], ["a/footprint"])
    assert drift["new"] == 1 and drift["compared"] == 2
    verdicts = {c["name"]: c["verdict"] for c in summary(["fit"], now, drift)["cases"]}
    assert verdicts == {"a": "drifted", "c": "good"}


def test_the_worst_stands_first_and_a_failure_is_no_drift() -> None:
    before = [report(name, fit=entry(objective=100.0)) for name in "abc"]
    now = [
        report("a", fit=entry(objective=101.0)),
        report("b", fit=entry(objective=90.0)),
        report("c", fit=entry("failed", "not_converged", "no", objective=0.0)),
    ]
    drift = compare(now, baseline_of(before, None))
    assert [each["case"] for each in drift["drifted"]] == ["b", "a"]
    counts = summary(["fit"], now, drift)["counts"]
    assert counts == {"cases": 3, "error": 0, "failed": 1, "drifted": 2, "good": 0}


def test_a_baseline_keeps_its_tolerances_and_only_what_is_good() -> None:
    now = [
        report("a", fit=entry(objective=1.0), modes=entry("error", "unstable", "no")),
        report("b", fit=entry("error", "unstable", "no")),
    ]
    first = baseline_of(now, None)
    assert first["cases"] == {"a": {"fit": {"objective": 1.0}}}
    assert first["tolerances"] == DEFAULTS
    again = baseline_of(now, {**first, "tolerances": {"fit/objective": {"absolute": 9}}})
    assert again["tolerances"] == {"fit/objective": {"absolute": 9}}


def test_a_study_that_is_new_in_a_baseline_brings_its_tolerances(tmp_path: Path) -> None:
    now = [
        report("a", sample=entry(**{"median C10": 1.0}), diagnose=entry(**{"verdict named": 1.0}))
    ]
    before = {"format": 1, "tolerances": {"fit/objective": {"absolute": 9}}, "cases": {}}
    path = tmp_path / "baseline.json"
    path.write_text(json.dumps(baseline_of(now, before)))
    known = read_baseline(path)
    assert known["tolerances"]["fit/objective"] == {"absolute": 9}
    assert known["tolerances"]["sample/median"] == DEFAULTS["sample/median"]
    other = [report("a", diagnose=entry(**{"verdict undecided": 1.0}))]
    (gone,) = compare(other, known)["drifted"]
    assert drift_line(gone) == "verdict named: 1 is gone"


def test_every_study_can_be_compared_with_its_own_baseline(tmp_path: Path) -> None:
    """Each has default tolerances; studies from outside, which have none, get one, too."""
    studies = {name for name, entry in STUDIES.items() if entry.runs_by_name}
    assert {kind.partition("/")[0] for kind in DEFAULTS} == studies
    now = [report("a", own=entry(**{"width_m at 4 kN": 1.0}))]
    path = tmp_path / "baseline.json"
    path.write_text(json.dumps(baseline_of(now, None)))
    known = read_baseline(path)
    assert known["tolerances"]["own/width_m"] == OTHER_QUANTITIES
    drifted = compare([report("a", own=entry(**{"width_m at 4 kN": 1.002}))], known)["drifted"]
    assert [each["quantity"] for each in drifted] == ["width_m at 4 kN"]
    assert not compare(now, known)["drifted"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is not a baseline"),
        ("[]", "format 1"),
        ('{"format": 2}', "format 1"),
        ('{"format": 1, "tolerances": {}}', "must have the keys tolerances and cases"),
        (json.dumps(one(1.0, {"relative": -1})), "tolerances.fit/f"),
        (json.dumps(one(1.0, {"realtive": 1})), "tolerances.fit/f"),
        (json.dumps(one(1.0, {"relative": float("nan")})), "tolerances.fit/f"),
        (json.dumps({**one(1.0, {}), "tolerances": {}}), "no tolerance 'fit/f'"),
        (json.dumps({**one(1.0, {}), "cases": {"a": {"fit": {"f": "1"}}}}), "cases.a.fit"),
        (json.dumps({**one(1.0, {}), "cases": {"a": 1}}), "cases.a.?"),
    ],
)
def test_a_wrong_baseline_is_refused_in_a_sentence(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_baseline(path)
    assert words in str(refused.value) and "\n" not in str(refused.value)


SCHEMA = xmlschema.XMLSchema(ROOT / "tests/data/junit.xsd")
STARTED = "2026-01-01T00:00:00+00:00"
BEFORE = [report("a", fit=entry(objective=1.0, mass_kg=1.0), modes=entry(mass_kg=1.0))]
ALL = [
    report("a", fit=entry(objective=2.0, mass_kg=3.0), modes=entry(mass_kg=1.0)),
    report(
        "b/deep",
        fit=entry("error", "unstable", "<no> & \x1b[31m\nsecond line"),
        footprint=entry("skipped", None, "the fit before it has no result"),
        modes=entry("failed", "timed_out", "too late"),
    ),
    lost(
        CaseTask("c", ROOT, ROOT, ("fit",), Asked(None, PressureRange(None, None, 2))),
        "its process died, twice",
    ),
]


def parsed(text: str) -> ElementTree.Element:
    SCHEMA.validate(text)
    return ElementTree.fromstring(text)


def test_every_outcome_has_its_element_and_its_words() -> None:
    suites = parsed(junit(ALL, compare(ALL, baseline_of(BEFORE, None)), STARTED))
    tests = {(t.get("classname"), t.get("name")): t for t in suites.iter("testcase")}
    assert len(tests) == 6
    drifted = tests["a", "fit"].find("failure")
    assert drifted is not None and drifted.get("type") == "drift"
    assert "2 drifted; mass_kg: 1 became 3" in drifted.get("message", "")
    assert (drifted.text or "").count("\n") == 1
    assert len(tests["a", "modes"]) == 0
    error = tests["b/deep", "fit"].find("error")
    assert error is not None and error.get("message") == "<no> & ?[31m"
    assert error.text == "<no> & ?[31m\nsecond line"
    assert tests["b/deep", "footprint"].find("skipped") is not None
    failure = tests["b/deep", "modes"].find("failure")
    assert failure is not None and failure.get("type") == "timed_out"
    assert tests["c", "fit"].find("error").get("type") == "worker_lost"  # type: ignore[union-attr]
    counts = [
        [suite.get(k) for k in ("tests", "failures", "errors", "skipped")] for suite in suites
    ]
    assert counts == [["2", "1", "0", "0"], ["3", "1", "1", "1"], ["1", "0", "1", "0"]]
    facts = {p.get("name"): p.get("value") for p in suites[0].iter("property")}
    assert facts["solver"] == "bundled 1.0.0" and facts["solver_runs"] == "9"
    assert suites[0].get("time") == "2.000" and suites[2].get("timestamp") == STARTED[:19]


def test_what_only_one_side_has_is_said() -> None:
    before = [*BEFORE, report("gone/deep", fit=entry(objective=1.0))]
    now = [
        report("a", fit=entry(objective=1.0, mass_kg=1.0), footprint=entry(area_m2=1.0)),
        report("new", fit=entry(objective=1.0)),
    ]
    suites = parsed(junit(now, compare(now, baseline_of(before, None)), STARTED))
    tests = {(t.get("classname"), t.get("name")): t for t in suites.iter("testcase")}
    skipped = {key for key, test in tests.items() if test.find("skipped") is not None}
    assert skipped == {("a", "modes"), ("gone/deep", "baseline")}
    assert [suite.get("skipped") for suite in suites] == ["1", "0", "1"]
    assert [suite.get("tests") for suite in suites] == ["3", "1", "1"]
    assert [suite.findtext("system-out") for suite in suites] == [
        "modes is in the baseline, but was not studied\n"
        "footprint is not in the baseline, so not compared",
        "new is not in the baseline, so not compared",
        "gone/deep is in the baseline, but not in this batch",
    ]


def test_a_verdict_is_in_the_suites_output() -> None:
    diagnosis = {**entry(words="no gap is seen"), "verdict": "no_gap", "effect": None}
    (suite,) = parsed(junit([report("a", fit=entry(), diagnose=diagnosis)], None, STARTED))
    assert suite.findtext("system-out") == "diagnose: no_gap: no gap is seen"
    assert suite.get("failures") == suite.get("errors") == "0"


@settings(max_examples=25)  # each is held against the schema
@given(some.text(min_size=1))
def test_any_words_give_valid_xml(words: str) -> None:
    suites = parsed(junit([report("a", fit=entry("error", "crashed", words))], None, STARTED))
    assert next(suites.iter("error")).get("type") == "crashed"
