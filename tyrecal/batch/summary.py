"""Summary of a batch: the content of batch.json."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ..files import Json
from .case import Report

# the worst first. error: a study gave no result; failed: it has one that is no good, as a fit that
# did not converge; drifted: a quantity is off the baseline
VERDICTS = ("error", "failed", "drifted", "good")


def summary(studies: Sequence[str], reports: Sequence[Report], drift: Json | None) -> Json:
    """Results only: ``studies``; ``counts`` of cases by verdict; ``cases``, each with its
    ``verdict``, provenance and studies; ``baseline``, as `drift.compare` says, or None."""
    drifted = {each["case"] for each in drift["drifted"]} if drift else set()
    cases = [
        {
            "name": report["name"],
            "verdict": _verdict(report, report["name"] in drifted),
            "provenance": report["provenance"],
            "studies": report["studies"],
        }
        for report in reports
    ]
    counts = Counter(case["verdict"] for case in cases)
    return {
        "format": 1,
        "studies": list(studies),
        "counts": {"cases": len(cases), **{verdict: counts[verdict] for verdict in VERDICTS}},
        "cases": cases,
        "baseline": drift,
    }


def _verdict(report: Report, drifted: bool) -> str:
    statuses = {entry["status"] for entry in report["studies"].values()}
    statuses |= {"drifted"} if drifted else set()
    return next((verdict for verdict in VERDICTS if verdict in statuses), "good")
