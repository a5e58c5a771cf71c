"""One case of a batch: its studies in a row; every failure is reported and not raised.

The report is plain data, small enough for any network: ``name``; ``provenance``, None where the
case could not be read; ``studies``, each with

* ``status``: ``good``; ``failed``, finished but not as it should (a fit that did not converge, a
  load that was not reached); ``error``, there is no result; ``skipped``, see `study`;
* ``cause`` (`EvaluationFailed`, `_failed`) and ``words``, or None; ``quantities``, name to number;
of a diagnosis its ``verdict``,
  and the ``effect`` that it names or None;

and ``facts``, which are volatile: seconds by study and of a core, when, where, which solver, how
often it ran and the record answered, or ``answered``: all of it by the case's folder.

Result files are those of the command of the same name. Where a batch fits, studies that follow a
fit study the fitted design next to the initial one, as with their --fitted.
"""

from __future__ import annotations

import inspect
import json
import os
import platform
import time
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import (
    Json,
    json_text,
    os_words,
    private_dir,
    read_bytes,
    read_json,
    set_aside,
    write_runs,
    write_text,
)
from ..measured.load import load_case
from ..simulate.case_folder import owner
from ..simulate.deck.decks_design import design_of
from ..simulate.evaluate.evaluator import Evaluator
from ..simulate.evaluate.failure import EvaluationFailed, SolverUnavailable
from ..simulate.evaluate.solver import solver_facts
from ..simulate.evaluate.store import Store, solver_identity
from ..simulate.provenance import provenance, sources
from ..studies import study_class
from ..studies.fitted import NOT_CONVERGED, has_good
from ..studies.pressure_range import PressureRange
from ..studies.result import StudyInput
from ..tyre.case import LoadedCase, start_values, with_level
from ..tyre.values import unusual_value, with_values


@dataclass(frozen=True)
class Asked:
    """Options of the studies, by the names of arguments of `Result.run`."""

    loads_N: tuple[float, ...] | None  # None: those of the case
    pressures_kPa: PressureRange


@dataclass
class Studied:
    """A case under study."""

    given: StudyInput
    asked: Asked
    no_fit: bool = False  # a fit was requested and has no result


@dataclass
class StudyOutcome:
    """Outcome of a study (see `case`), its numbers, and its result files, name to text."""

    status: str = "good"  # or "failed", "skipped"
    cause: str | None = None  # of a failure, a key
    words: str | None = None  # of a failure, for people
    quantities: dict[str, float] = field(default_factory=dict)  # `Result.quantities`, by name
    files: dict[str, str] = field(default_factory=dict)
    conclusion: dict[str, str | None] = field(default_factory=dict)  # `Result.conclusion`


def study(name: str, state: Studied) -> StudyOutcome:
    """One study; skipped where it follows a fit that has no result. Raises what the study does."""
    kind = study_class(name)
    if state.no_fit and kind.follows_fit:
        return StudyOutcome("skipped", None, "the fit before it has no result")
    state.no_fit = state.no_fit or kind.fits
    known = inspect.signature(kind.run).parameters
    options = {key: value for key, value in vars(state.asked).items() if key in known}
    result = kind.run(state.given, **options)
    result.pass_on(state.given)
    state.no_fit = state.no_fit and not kind.fits
    failed = getattr(result, "failed", ())  # states not reached; without any row there is no result
    if failed and not getattr(result, "rows", True):
        raise EvaluationFailed(failed[0].cause, failed[0].words)
    conclusion, short = result.conclusion(), result.shortfall()
    cause, words = short or (None, conclusion.pop("words", None))
    status = "failed" if short else "good"
    return StudyOutcome(status, cause, words, result.quantities(), result.texts(), conclusion)


FINISHED = "finished.json"  # in a case's folder: what was asked, and the answer
ENDED = ("good", "failed")  # statuses of studies with a result
# causes that may be gone the next time: with one of them nothing is kept in `FINISHED`
AGAIN = {"crashed", "timed_out", "no_results", "licence", "unavailable", "disc", "internal"}
Report = Json


@dataclass(frozen=True)
class CaseTask:
    """Task of a worker. Its paths are absolute, on a file system that the worker sees too."""

    name: str
    path: Path
    folder: Path  # of the results
    studies: tuple[str, ...]  # names of studies, in the order to run
    asked: Asked
    solver: str = ""  # its name, empty for the case's own
    mesh: str = ""  # level, empty for the case's own
    record: Path | None = None  # the evaluation store; None: none is used
    command: tuple[str, ...] = ()  # of the solver
    allow_unusual: bool = False


def run_case(task: CaseTask) -> Report:
    """All studies of a case, or its report of an earlier run with the same question."""
    facts: Json = {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "host": platform.node() or "localhost",
    }
    report: Report = {"name": task.name, "provenance": None, "studies": {}, "facts": facts}
    try:
        loaded = _loaded(task)
        evaluator = Evaluator(
            design_of(loaded), task.solver, task.folder / "runs", command=task.command
        )
        question = _question(task, loaded, evaluator)
        report["provenance"] = provenance(loaded, evaluator.solver)
        facts |= solver_facts(evaluator.solver)
        finished = _finished(task.folder, question)
        if finished is None:
            finished, files = _studied(task, loaded, evaluator, facts)
            if not AGAIN & {each["cause"] for each in finished.values()}:
                digests = {file: _digest(task.folder / file) for file in files}
                _write(
                    task.folder / FINISHED,
                    {"question": question, "files": digests, "studies": finished},
                )
        else:
            facts.update(answered=True, seconds=dict.fromkeys(finished, 0.0))
        report["studies"] = finished
    except Exception as error:  # whatever it is, the other cases go on
        with suppress(OSError):
            if task.folder.exists():
                _write_runs(task, None, facts, (), {})
        report["studies"] = dict.fromkeys(task.studies, _entry(_failed(error), task))
    return report


def lost(task: CaseTask, words: str) -> Report:
    """The report of a case whose worker died."""
    entry = _entry(StudyOutcome("error", "worker_lost", words), task)
    studies = dict.fromkeys(task.studies, entry)
    return {"name": task.name, "provenance": None, "studies": studies, "facts": {}}


def _studied(
    task: CaseTask, loaded: LoadedCase, evaluator: Evaluator, facts: Json
) -> tuple[Json, list[str]]:
    """Every study's entry in the report, and the names of the result files."""
    private_dir(task.folder)
    _write_runs(task, loaded, facts, (), {})
    evaluator.store = Store(task.record) if task.record else None
    given = StudyInput(loaded, evaluator, {"initial": start_values(loaded)})
    state = Studied(given, task.asked)
    entries: Json = {}
    files: list[str] = []
    aside: dict[str, str] = {}
    facts["seconds"], used = {}, time.process_time()
    for name in task.studies:
        clock = time.monotonic()
        try:
            outcome = study(name, state)
        except Exception as error:  # the other studies go on
            outcome = _failed(error)
        place = task.folder
        if outcome.cause == NOT_CONVERGED and has_good(place / "fit.json"):
            place, aside[name] = private_dir(place / NOT_CONVERGED), NOT_CONVERGED
        for file, text in outcome.files.items():
            _write_text(place / file, text)
            files.append((place / file).relative_to(task.folder).as_posix())
        if outcome.files:
            set_aside(place, name, outcome.files)
        entries[name] = _entry(outcome, task)
        facts["seconds"][name] = round(time.monotonic() - clock, 3)
    if evaluator.folder:
        with suppress(OSError):  # it holds failures, or was never made
            evaluator.folder.rmdir()
    facts["cpu_seconds"] = round(time.process_time() - used, 3)
    facts.update(solver_runs=evaluator.counts.runs, answered_from_record=evaluator.counts.recorded)
    ended = [name for name in task.studies if entries[name]["status"] in ENDED]
    _write_runs(task, loaded, facts, ended, aside)
    return entries, files


def _write_runs(
    task: CaseTask,
    loaded: LoadedCase | None,
    facts: Json,
    ended: Collection[str],
    aside: Mapping[str, str],
) -> None:
    """The studies' entries in run.json; results of those that have not ended are earlier ones.
    loaded: the case, None where it could not be read;
    aside: folders of results that did not take the place of earlier ones, by study."""
    entry = {**owner(task.folder, task.path, loaded), "command": "batch", **facts}
    new: Json = {name: {**entry, "finished": name in ended} for name in task.studies}
    for name, place in aside.items():
        new[name]["results"] = place
    write_runs(task.folder, new, many_writers=True)


def _loaded(task: CaseTask) -> LoadedCase:
    """The case at its mesh level and start values. Raises InputError."""
    loaded = load_case(task.path, task.allow_unusual)
    if task.mesh:
        loaded = with_level(loaded, task.mesh)
    loaded = with_values(loaded, start_values(loaded))
    for load in () if task.allow_unusual else task.asked.loads_N or ():
        if message := unusual_value(loaded, "road.loads_N.0", load):
            raise InputError(f"a load of {load:g} N: {message}")
    return loaded


def _failed(error: Exception) -> StudyOutcome:
    """Outcome of a study that an exception ended."""
    if isinstance(error, EvaluationFailed):
        return StudyOutcome("error", error.cause, error.words)
    if isinstance(error, SolverUnavailable):
        return StudyOutcome("error", "unavailable", str(error))
    if isinstance(error, InputError):
        return StudyOutcome("error", "input", str(error))
    if isinstance(error, OSError):
        return StudyOutcome("error", "disc", os_words(error))
    trace = error.__traceback__
    while trace and trace.tb_next:
        trace = trace.tb_next
    place = f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace else ""
    return StudyOutcome("error", "internal", f"{type(error).__name__}: {error} ({place})")


def _entry(outcome: StudyOutcome, task: CaseTask) -> Json:
    """A study as the report has it; its words do not depend on where the case lies."""
    words = outcome.words and outcome.words.replace(f"{task.path.parent}{os.sep}", "")
    return {
        "status": outcome.status,
        "cause": outcome.cause,
        "words": words,
        "quantities": outcome.quantities,
        **outcome.conclusion,
    }


def _question(task: CaseTask, loaded: LoadedCase, evaluator: Evaluator) -> str:
    """Hash of all that the results depend on: the case and its files, the options, the tool."""
    files = [task.path, *loaded.files, *loaded.template_files]
    solver = [*solver_identity(evaluator.solver), sources()]
    parts = [task.studies, asdict(task.asked), task.mesh, solver, [_digest(p) for p in files]]
    return sha256(json.dumps(parts).encode()).hexdigest()


def _finished(folder: Path, question: str) -> Json | None:
    """The entries of an earlier run that had the same question and whose files are as it left
    them; None: there is none."""
    try:
        finished = read_json(folder / FINISHED, follow=False)
        if finished["question"] != question:
            return None
        if any(_digest(folder / file) != digest for file, digest in finished["files"].items()):
            return None
        entries: Json = finished["studies"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return entries


def _digest(path: Path) -> str:
    return sha256(read_bytes(path)).hexdigest()


def _write(path: Path, content: Any) -> None:
    _write_text(path, json_text(content))


def _write_text(path: Path, text: str) -> None:
    write_text(path, text, many_writers=True)  # a worker thought dead may still be at it
