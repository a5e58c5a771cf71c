"""Result files read back, each checked: what a page may rely on."""

from __future__ import annotations

import contextlib
import csv
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from pydantic import Field, ValidationError

from ...errors import InputError
from ...files import Json, NotAFile, read_runs, read_text
from ...simulate.program import join_command
from ...studies import STUDIES, result_types
from ...studies.diagnose.result import DiagnosisResult
from ...studies.effects import Effects
from ...studies.fit.result import FitResult
from ...studies.result import Provenance, Result, ResultPart
from ..shape_data import DiagnosisSection, Patches, Shapes

File = TypeVar("File", bound=ResultPart)
StudyContent = TypeVar("StudyContent", bound=Result)


class RunFacts(ResultPart):
    """A study's entry in run.json."""

    case: str | None = None  # path of its file, relative to the folder
    command: str | None = None  # name of the study
    finished: bool = True
    started: str = ""  # UTC, as 2026-11-27T08:30:00+00:00
    arguments: list[str] = Field(default=[])  # words of the command line behind tyrecal
    host: str = ""

    @property
    def typed(self) -> str:
        """The command as it was typed, "" where it is not known."""
        return join_command(["tyrecal", *self.arguments]) if self.arguments else ""

    @property
    def minute(self) -> str:
        """When it started: 2026-11-27 08:30 UTC."""
        return f"{self.started[:16].replace('T', ' ')} UTC" if self.started else ""


@dataclass(frozen=True)
class Results:
    """Results in a folder; None or empty: it has none."""

    folder: Path
    studies: dict[str, Result]  # by name, in the order of a page
    fit_shapes: Shapes | None = None
    history: list[Json] = field(default_factory=list)  # design points of a fit, as `_history` reads
    history_csv: str = ""
    modes_shapes: Shapes | None = None
    patches: Patches | None = None
    diagnosis_section: DiagnosisSection | None = None
    diagnosis_words: str = ""  # diagnosis.md
    runs: dict[str, RunFacts] = field(default_factory=dict)

    def get(self, kind: type[StudyContent]) -> StudyContent | None:
        """The result of a study, None if the folder has none."""
        return next((each for each in self.studies.values() if isinstance(each, kind)), None)

    @property
    def fit(self) -> FitResult | None:
        return self.get(FitResult)

    @property
    def diagnosis(self) -> DiagnosisResult | None:
        return self.get(DiagnosisResult)

    @property
    def provenances(self) -> dict[str, Provenance]:
        """Origin of the results of each study, where they record it."""
        return {name: of for name, each in self.studies.items() if (of := each.provenance)}

    @property
    def case(self) -> str:
        """The case's name or, in folders that do not know it, its file's."""
        for of in self.provenances.values():
            return of.name
        known = (self.fit_shapes, self.modes_shapes, self.patches, self.diagnosis_section)
        for each in known:
            if each:
                return each.case
        owner = next((run.case for run in self.runs.values() if run.case), None)
        return Path(owner).stem if owner else self.folder.resolve().name


def read_results(folder: Path) -> Results:
    """Read the results that commands left in a folder. Raises InputError; OSError."""
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise InputError(f"'{folder}' {what}; give a folder of results")
    types = result_types()
    studies = {name: _read(folder / f"{kind.stem}.json", kind) for name, kind in types.items()}
    history = _text(folder / "fit_history.csv")
    results = Results(
        folder,
        {name: each for name, each in studies.items() if each and _is_filled(each)},
        _read(folder / "fit_shapes.json", Shapes),
        _history(history, folder / "fit_history.csv"),
        history or "",
        _read(folder / "modes_shapes.json", Shapes),
        _read(folder / "footprint_patches.json", Patches),
        _read(folder / "diagnosis_section.json", DiagnosisSection),
        _text(folder / "diagnosis.md") or "",
        _runs(folder),
    )
    if not results.studies:
        run = max(results.runs.values(), key=lambda each: each.started, default=RunFacts())
        last = "" if run.finished else f": its last run, 'tyrecal {run.command}', did not finish"
        if (folder / "batch.json").exists():
            last = "; it is a folder of a batch: give the folders of the cases in it"
        raise InputError(f"'{folder}' holds no results of a study: {', '.join(STUDIES)}{last}")
    return results


def _is_filled(result: Result) -> bool:
    """Whether it has rows; where no effect had an answer effects.json has none."""
    return not isinstance(result, Effects) or bool(result.rows)


def _read(path: Path, kind: type[File]) -> File | None:
    """The checked content of a result file; None if there is none. Raises InputError."""
    text = _text(path)
    if text is None:
        return None
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):  # an integer of thousands of digits is no JSONDecodeError
        raise InputError(f"'{path}' is damaged: it is no JSON") from None
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(place) for place in first["loc"]) or "the whole"
        raise InputError(
            f"'{path}' is not what tyrecal writes: {where}: {first['msg'][:1].lower()}"
            f"{first['msg'][1:]}"
        ) from None


def _runs(folder: Path) -> dict[str, RunFacts]:
    """The studies' entries in run.json, but for those that are none."""
    runs = {}
    for study, facts in read_runs(folder).items():
        with contextlib.suppress(ValidationError):
            runs[study] = RunFacts.model_validate(facts)
    return runs


def _text(path: Path) -> str | None:
    """Text of a file; None if there is none. Raises InputError."""
    try:
        return read_text(path, follow=False)
    except FileNotFoundError:
        return None
    except NotAFile as error:
        raise InputError(f"'{path}' is not what tyrecal writes: it {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"'{path}' is damaged: it is no text") from None


def _history(text: str | None, path: Path) -> list[Json]:
    """Design points of fit_history.csv; empty if there is none. Raises InputError."""
    if text is None:
        return []
    points: list[Json] = []
    try:
        for row in csv.DictReader(text.splitlines()):
            objective, start = row.pop("objective_Hz"), int(row.pop("start"))
            del row["point"], row["failure"]
            points.append(
                {
                    "point": len(points) + 1,
                    "start": start,
                    "objective_Hz": float(objective) if objective else None,
                    "values": {name: float(value) for name, value in row.items()},
                }
            )
    except (KeyError, ValueError, TypeError):
        raise InputError(f"'{path}' is not what tyrecal writes: line {len(points) + 2}") from None
    return points
