"""Base of all studies' results: files, tables and words come from one class a study.

A result is a `Result` with its numbers as fields. What a number is called in tables, its unit and
its digits stand at its field, as a `Column`; JSON, CSV, the terminal and the page follow from it.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr

from ..errors import InputError
from ..files import Json, json_text
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.modes.label import Label
from ..tyre.case import as_written
from ..tyre.case.mistakes import shortened
from ..tyre.case.parts import MAX_REPR
from .notebook import Notebook

if TYPE_CHECKING:
    from ..simulate.evaluate.evaluator import Evaluator
    from ..tyre.case import LoadedCase

AnyResult = TypeVar("AnyResult", bound="Result")
PositiveNumber = Annotated[float, Field(gt=0)]
Wave = Annotated[int, Field(ge=0, le=200)]


@dataclass(frozen=True)
class Column:
    """A column of a table.

    >>> Column("area, cm²", ".1f", 1e4).cell(0.0158)
    '158.0'
    """

    name: str  # with the unit
    form: str = ".2f"  # of a number; "": the column holds words
    per_unit: float = 1.0  # what a value of the file is multiplied with

    def cell(self, value: Any) -> str | None:
        """A value as it is shown."""
        if value is None or isinstance(value, str):
            return value
        return format(self.per_unit * value, self.form)


@dataclass(frozen=True)
class Deviation:
    """A cell with a colour or mark that shows how far off a target is, after the ``value``."""

    percent: float
    value: str = ""


Cell = str | Deviation | None  # None: there is no value
MIN_NAMED_OVERLAP = 0.15  # with the unloaded shape, of a mode on the road that has a name
NAME_COLUMNS = (Column("mode", ""), Column("motion", ""))  # see `Named.named`


@dataclass(frozen=True)
class Table:
    """A table, for a terminal and for a page alike.

    >>> table = Table([Column("mode", ""), Column("Hz", ".1f")], [["[2,0]", "79.5"]])
    >>> [column.name for column in table.columns]
    ['mode', 'Hz']
    """

    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    title: str = ""
    caption: str = ""
    csv: str | None = (
        ""  # key of `Result.csv_rows` with its numbers, "" of `Result.csv`; None: none
    )


class ResultPart(BaseModel):
    """A piece of a result file; numbers are finite, SI or as named."""

    # built by who reads a result: a study imports many kinds, and writes one
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True, defer_build=True)

    @classmethod
    def columns(cls) -> dict[str, Column]:
        """Columns that tables show, by field."""
        return {
            key: each
            for key, field in cls.model_fields.items()
            for each in field.metadata
            if isinstance(each, Column)
        }

    def __repr__(self) -> str:
        return shortened(super().__repr__(), MAX_REPR)

    def cells(self) -> list[str | None]:
        """A table's row."""
        return [column.cell(getattr(self, key)) for key, column in self.columns().items()]


class ResultState(ResultPart):
    """State that a study evaluated, several values where it has several."""

    pressure_kPa: float | list[float]
    load_N: float | list[float]
    rim: str | list[str]  # how the rim was held: fixed, spindle or free


class Provenance(ResultPart):
    """Origin of a result file: tool, solver, tyre, state and inputs."""

    tyrecal: str  # version of tyrecal
    solver: str  # name of the solver
    solver_version: str  # version of the solver
    name: str  # name of the case
    size: str  # size code of the case
    tyre_sha256: str  # hash of the tyre as numbers
    overrides: dict[str, float | bool | str | None]  # numbers set by --set and --pressure-kPa
    state: ResultState  # state that was evaluated
    mesh: str  # mesh level
    targets: str | None = None  # source of the targets
    measured_sha256: str | None = None  # hash of the measured file, as by sha256sum
    measured_files: list[str] = Field(default=[])  # names of the measured files

    def __str__(self) -> str:
        given = [f"{name}={as_written(value)}" for name, value in self.overrides.items()]
        solver = f"{self.solver} {self.solver_version}"
        return ", ".join([f"tyre {self.tyre_sha256[:8]}", *given, f"mesh {self.mesh}", solver])


@dataclass
class StudyInput:
    """The start of a study."""

    case: LoadedCase
    evaluator: Evaluator
    designs: dict[str, dict[str, float]]  # values of the variables by name of the design
    responses: ResultPart | None = None  # `FitResponses` of the fit that found the design "fitted"
    jobs: int = 1  # evaluations at a time

    def stamped(self, result: AnyResult, **of: Any) -> AnyResult:
        """The result with its provenance, whose state is the case's except for ``of``."""
        from ..simulate.provenance import provenance  # late: not for those who read results

        return result.stamped(provenance(self.case, self.evaluator.solver, **of))


class Result(Notebook, ResultPart):
    """A study: its result file, and how to run it. Older files do not record their origin."""

    study: ClassVar[str] = ""  # the command, as its entry in run.json
    stem: ClassVar[str] = ""  # of its files
    command: ClassVar[str] = ""  # where it is not the study
    heading: ClassVar[str] = ""  # on the page
    figures: ClassVar[str] = ""  # "module:function": of the result, to figures by name
    part: ClassVar[str] = ""  # "module:function" of its part of a page, see `report.html.parts`
    is_seldom: ClassVar[bool] = False  # a page does not say that it is absent
    fits: ClassVar[bool] = False  # it finds a design, which it passes on
    follows_fit: ClassVar[bool] = False  # it studies the design of a fit before it too

    format: Literal[1] = 1  # version of the file's format
    provenance: Provenance | None = None  # origin: see provenance below
    _files: dict[str, str] = PrivateAttr(default_factory=dict)  # further texts, by file name

    @classmethod
    def run(cls, given: StudyInput) -> Self:
        """Run the study; the result has its provenance. A study declares its options as further
        arguments by keyword. Raises InputError, EvaluationFailed."""
        raise InputError(f"the study '{cls.study}' is run by its command only")

    @property
    def shown(self) -> Self:
        return self

    def quantities(self) -> dict[str, float]:
        """Numbers that a batch compares with a baseline, named ``KIND`` or ``KIND WHERE``:
        ``mass_kg``, ``area_m2 fitted 4000 N``; the unit is in the kind's name."""
        return {}

    def shortfall(self) -> tuple[str, str] | None:
        """Cause and words where the study has finished but not as it should; else None."""
        failed: list[Failed] = getattr(self, "failed", [])
        if not failed:
            return None
        more = f" (and {len(failed) - 1} more)" if len(failed) > 1 else ""
        return failed[0].cause, f"{failed[0].place}: {failed[0].words}{more}"

    def conclusion(self) -> dict[str, str | None]:
        """Further entries of the study in batch.json, such as a verdict."""
        return {}

    def pass_on(self, given: StudyInput) -> None:
        """Add what the studies after it need, such as a fitted design."""

    def with_files(self, files: Mapping[str, str]) -> Self:
        """The result with further text files, by name."""
        self._files.update(files)
        return self

    def content(self) -> Json:
        """Content of the JSON file."""
        return self.model_dump(exclude_unset=True, by_alias=True)

    def stamped(self, provenance: Json) -> Self:
        """The result with what it is of."""
        return self.model_copy(update={"provenance": Provenance.model_validate(provenance)})

    def texts(self) -> dict[str, str]:
        """The files by name."""
        tables = {f"{name}.csv": text for name, text in self.csv_texts().items()}
        return {f"{self.stem}.json": json_text(self.content())} | tables | self._files

    def csv_texts(self) -> dict[str, str]:
        """The CSV files by their names without ``.csv``."""
        texts = {self.stem: table} if (table := self.csv()) else {}
        further = self.csv_rows().items()
        return texts | {f"{self.stem}_{name}": rows_csv(rows) for name, rows in further if rows}

    def csv(self) -> str:
        """The rows, all digits, in the units of the JSON file; "": there is no such file."""
        return ""

    def csv_rows(self) -> Mapping[str, Sequence[CsvRow]]:
        """Rows of further tables, each a file STEM_NAME.csv by its name, in the same units."""
        return {}

    def tables(self) -> list[Table]:
        """For the terminal and the page."""
        return []

    def numbers(self) -> list[Table]:
        """Further tables, for the page alone."""
        return []

    def sentences(self) -> list[str]:
        """Sentences of the ``findings`` of all, or of each design, by their ``words``."""
        return self._words(slice(None))

    def summary(self) -> list[str]:
        """Sentences in short, for the head of the page: of the last design, the fitted one."""
        return self._words(slice(-1, None), "; ")

    def _words(self, chosen: slice, between: str = "") -> list[str]:
        findings = getattr(self, "findings", [])
        if not isinstance(findings, list):
            return list(findings.words)
        by_design = [(each.design, each.words) for each in findings[chosen]]
        by_design = [
            (name, [between.join(words)] if between else words) for name, words in by_design
        ]
        return [f"{name}: {each}" for name, words in by_design for each in words]

    def doubts(self) -> list[str]:
        """Doubts that must not be overlooked: the states in ``failed`` were not reached."""
        failed: list[Failed] = getattr(self, "failed", [])
        return [f"not reached: {each.place}: {each.words or each.cause}" for each in failed]


class Failed(ResultPart):
    """A state that a study could not reach."""

    design: str  # name of the design
    load_N: float | None = None
    pressure_kPa: float | None = None
    values: dict[str, float] = Field(default={})  # of numbers that are swept
    cause: str = ""  # kind of failure
    words: str = ""  # reason in words

    @property
    def place(self) -> str:
        """Design and load, pressure or values."""
        at = [f"{self.load_N:g} N"] if self.load_N is not None else []
        at += [f"{self.pressure_kPa:g} kPa"] if self.pressure_kPa is not None else []
        at += [f"{name}={value:.6g}" for name, value in self.values.items()]
        return ", ".join([self.design, *at])


CsvRow = Mapping[str, Any]
Notify = Callable[[str, EvaluationFailed | None], None]  # words; why a place was not reached


def silent(words: str, failure: EvaluationFailed | None) -> None:
    """Report no progress of a study."""


def notify_loads(
    notify: Notify,
    design: str,
    loads_N: Sequence[float],
    reached: int,
    failure: EvaluationFailed | None,
) -> None:
    """Report how many loads a design reached, and why no more."""
    if failure:
        notify(f"{design}, {loads_N[reached]:g} N", failure)
    notify(f"{design}: {reached} loads", None)


def not_reached(
    loads_N: Sequence[float], progress: Mapping[str, tuple[int, EvaluationFailed | None]]
) -> list[Failed]:
    """Loads that were not reached, one per design, with the reason."""
    return [
        Failed(design=name, load_N=loads_N[count], cause=failure.cause, words=failure.words)
        for name, (count, failure) in progress.items()
        if failure
    ]


class Named(ResultPart):
    """A mode's label and frequency."""

    c: Wave  # waves round the circumference
    m: Wave  # nodal circles on the belt
    kind: str | None  # only of [0,0]: axial (lateral) or torsional
    frequency_Hz: PositiveNumber  # frequency

    @property
    def label(self) -> Label:
        """[c, m]"""
        return Label(self.c, self.m, self.kind)

    def named(self) -> list[str]:
        """The cells of `NAME_COLUMNS`."""
        pair = " ×2" if getattr(self, "multiplicity", 1) > 1 else ""
        return [f"[{self.c},{self.m}]{pair}", self.label.motion]


class ModeEntry(Named):
    """A mode of modes.json or of a sweep."""

    multiplicity: int = 1  # 2: a pair of modes
    measured_Hz: float | None = None  # measured frequency, of a comparison with measurements
    deviation_percent: float | None = None  # computed over measured, less 1
    damping_ratio: float | None = None  # fraction of critical damping
    clarity: float | None = None  # clarity of the label, 0 to 1
    member: int | None = None  # 1 or 2: member of a split pair
    symmetry: str | None = None  # symmetry about the patch
    overlap: float | None = None  # overlap with the unloaded shape of this label
    spanned: float | None = None  # share of the shape that the modes at the load before span
    sliding_Hz: float | None = None  # frequency if nothing holds the patch along the road
    grip_mm: float | None = None  # motion of the crown at which the whole patch slides
    d_ln_f_d_ln_p: float | None = None  # sensitivity to the pressure
    standard_error_Hz: float | None = None  # of a fitted design, by all that is uncertain

    @property
    def has_lost_name(self) -> bool:
        """Whether so little of the unloaded shape is left that its name describes nothing."""
        return self.overlap is not None and self.overlap < MIN_NAMED_OVERLAP

    def named(self) -> list[str]:
        """The cells of `NAME_COLUMNS`; a mode that has lost its name has that of its curve."""
        mode, motion = super().named()
        return ["not named", f"was {mode}"] if self.has_lost_name else [mode, motion]


class CavityMode(ResultPart):
    """A member of the first wave round the cavity, between rigid walls."""

    direction: Literal["fore-aft", "vertical"]  # direction in which the gas pushes the wheel
    frequency_Hz: PositiveNumber

    @classmethod
    def pair(cls, hertz: Sequence[float]) -> list[CavityMode]:
        """Modes of the two frequencies (fore-aft, vertical), or none."""
        names: tuple[Literal["fore-aft", "vertical"], ...] = ("fore-aft", "vertical")
        return [cls(direction=d, frequency_Hz=f) for d, f in zip(names, hertz, strict=False)]

    def named(self) -> list[str]:
        """The cells of `NAME_COLUMNS`."""
        return ["cavity", self.direction]


def state_words(pressure_kPa: float, load_N: float, rim: str) -> str:
    """160 kPa, 4000 N, rim free"""
    load = f", {load_N:g} N" if load_N else ""
    return f"{pressure_kPa:g} kPa{load}, rim {rim if rim != 'springs' else 'on springs'}"


def in_lines(words: str) -> str:
    """A heading over several lines, broken at its commas."""
    return words.replace(", ", "\n")


def csv_text(keys: Sequence[str], rows: Iterable[CsvRow], end: str = "\n") -> str:
    """Rows as CSV, all digits."""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, keys, restval="", extrasaction="ignore", lineterminator=end)
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def rows_csv(rows: Sequence[CsvRow]) -> str:
    """Rows as CSV: a column for each key of any row, KEY.NAME for entries of a mapping, entries of
    a list joined by semicolons."""
    flat = [_flat(row) for row in rows]
    return csv_text(list(dict.fromkeys(key for row in flat for key in row)), flat)


def _flat(row: CsvRow) -> Json:
    flat: Json = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            flat |= {f"{key}.{name}": each for name, each in _flat(value).items()}
        elif isinstance(value, list | tuple):
            flat[key] = "; ".join(map(str, value))
        else:
            flat[key] = value
    return flat
