"""A batch as JUnit XML, which CI servers show: a suite a case, a test a study.

Valid against both schemas in use, Jenkins' and Ant's: what they disagree about is left out. A study
without a result is an error; one that is not as it should be, or drifted, a failure. What only the
baseline has is skipped, and a suite's system-out says so, as of what only this batch has. Not by a
library such as junitparser, which writes any element and holds to neither schema.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..files import Json
from .case import Report

# entry of a study that only the baseline has
SKIPPED: Json = {"status": "skipped", "cause": None, "words": None, "quantities": {}}
OUTCOMES = {"error": "error", "failed": "failure", "skipped": "skipped"}  # status to element
UNPRINTABLE = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML 1.0


def junit(reports: Sequence[Report], drift: Json | None, started: str) -> str:
    """The file's text. drift: of `drift.compare`, None without a baseline; started: ISO 8601, for
    cases that never began."""
    suites = Element("testsuites")
    drifted: dict[tuple[str, str], list[Json]] = {}
    for each in drift["drifted"] if drift else ():
        drifted.setdefault((each["case"], each["study"]), []).append(each)
    for number, report in enumerate([*reports, *_missing(drift)]):
        facts = report["facts"]
        seconds = facts.get("seconds", {})
        attributes = {
            "name": report["name"],
            "package": "tyrecal.batch",
            "id": str(number),
            "timestamp": facts.get("started", started)[:19],  # schemas have no time zone
            "hostname": facts.get("host", "localhost"),
            "time": _time(sum(seconds.values())),
        }
        suite = SubElement(suites, "testsuite", attributes)
        properties = SubElement(suite, "properties")
        for name in ("solver", "solver_runs", "answered_from_record", "answered"):
            if name in facts:
                value = {"name": name, "value": str(facts[name])}
                SubElement(properties, "property", value)
        counts = dict.fromkeys(OUTCOMES.values(), 0)
        missing, lines = _unlike(drift, report["name"])
        lines += [
            f"{study}: {entry['verdict']}: {entry['words']}"
            for study, entry in report["studies"].items()
            if "verdict" in entry
        ]
        for study, entry in {**report["studies"], **dict.fromkeys(missing, SKIPPED)}.items():
            time = _time(seconds.get(study, 0.0))
            attributes = {"classname": report["name"], "name": study, "time": time}
            test = SubElement(suite, "testcase", attributes)
            outcome, kind, message, text = _outcome(entry, drifted.get((report["name"], study)))
            if outcome:
                counts[outcome] += 1
            if outcome == "skipped":
                SubElement(test, outcome)
            elif outcome:
                attributes = {"type": kind, "message": _clean(message)}
                SubElement(test, outcome, attributes).text = _clean(text)
        suite.set("tests", str(len(report["studies"]) + len(missing)))
        suite.set("failures", str(counts["failure"]))
        suite.set("errors", str(counts["error"]))
        suite.set("skipped", str(counts["skipped"]))
        SubElement(suite, "system-out").text = _clean("\n".join(lines)) or None
        SubElement(suite, "system-err")
    indent(suites)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(suites, "unicode") + "\n"


def _missing(drift: Json | None) -> list[Report]:
    """Suites for cases that only the baseline has."""
    names = drift["missing_cases"] if drift else ()
    return [{"name": name, "studies": {"baseline": SKIPPED}, "facts": {}} for name in names]


def _unlike(drift: Json | None, case: str) -> tuple[list[str], list[str]]:
    """Studies of a case that only the baseline has, and lines about what only one side has."""
    if not drift:
        return [], []
    missing, new = (
        [study for of, _, study in (each.rpartition("/") for each in drift[key]) if of == case]
        for key in ("missing_studies", "new_studies")
    )
    lines = [f"{study} is in the baseline, but was not studied" for study in missing]
    lines += [f"{study} is not in the baseline, so not compared" for study in new]
    if case in drift["missing_cases"]:
        lines.append(f"{case} is in the baseline, but not in this batch")
    if case in drift["new_cases"]:
        lines.append(f"{case} is not in the baseline, so not compared")
    return missing, lines


def _outcome(entry: Json, drifted: Sequence[Json] | None) -> tuple[str, str, str, str]:
    """(element, type, message, text) of a test; the element is empty where all is well."""
    if entry["status"] != "good":
        words = entry["words"] or ""
        return OUTCOMES[entry["status"]], entry["cause"] or "", words.split("\n")[0], words
    if drifted:
        lines = [drift_line(each) for each in drifted]
        return "failure", "drift", f"{len(lines)} drifted; {lines[0]}", "\n".join(lines)
    return "", "", "", ""


def drift_line(drift: Json) -> str:
    """A number that drifted, in words."""
    if drift["value"] is None:
        return f"{drift['quantity']}: {drift['baseline']:.6g} is gone"
    return (
        f"{drift['quantity']}: {drift['baseline']:.6g} became {drift['value']:.6g},"
        f" allowed {drift['allowed']:.2g}"
    )


def _time(seconds: float) -> str:
    return f"{seconds:.3f}"


def _clean(text: str) -> str:
    return UNPRINTABLE.sub("?", text)
