"""All cases of a batch through an executor, and their summary, the content of batch.json."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

from ..errors import InputError
from ..files import Json, printable
from ..simulate.evaluate.executor import executor
from ..simulate.evaluate.failure import EvaluationFailed
from .case import CaseTask, Report, lost, run_case


def names_of(paths: Sequence[Path]) -> list[str]:
    """A name for each case file: its stem, or its path below the folder that all have in common,
    without the suffix, where two stems are the same.

    Raises InputError where a case is given twice, or a path cannot be printed.
    """
    for path in paths:
        if not str(path).isprintable():
            raise InputError(f"case '{printable(str(path))}': its path has control characters")
    stems = [path.stem for path in paths]
    if len(set(stems)) == len(stems):
        return stems
    whole = [path.absolute() for path in paths]
    top = Path(os.path.commonpath([path.parent for path in whole]))
    names = [path.relative_to(top).with_suffix("").as_posix() for path in whole]
    for path, name in zip(paths, names, strict=True):
        if names.count(name) > 1:
            raise InputError(f"case '{path}' is given twice, or twice by this name")
    return names


def run_batch(
    tasks: Sequence[CaseTask],
    jobs: int = 1,
    scheduler: str = "",
    notify: Callable[[Report], None] = lambda report: None,
) -> list[Report]:
    """Reports in the order of the tasks; ``notify`` gets each as it comes. scheduler: address of a
    Dask scheduler; without one, ``jobs`` processes of this machine work.

    Raises SolverUnavailable. Interrupted, it leaves the results of cases that have finished.
    """
    reports: dict[int, Report] = {}
    with executor(jobs, scheduler) as workers, closing(workers.each(run_case, tasks)) as answers:
        for place, answer in answers:
            if isinstance(answer, EvaluationFailed):  # its process died
                answer = lost(tasks[place], str(answer))
            reports[place] = answer
            notify(answer)
    return [reports[place] for place in range(len(tasks))]


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
