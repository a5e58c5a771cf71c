"""JUnit XML: valid for CI servers, complete, whatever the words."""

from __future__ import annotations

from xml.etree import ElementTree

import xmlschema
from hypothesis import given, settings
from hypothesis import strategies as some

from tyrecal.batch.case import CaseTask, lost
from tyrecal.batch.drift import baseline_of, compare
from tyrecal.batch.junit import junit
from tyrecal.batch.studies import Asked
from tyrecal.studies.pressure_range import PressureRange

from ..conftest import ROOT
from .data import entry, report

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
