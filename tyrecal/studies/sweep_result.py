"""Frequencies over any numbers of a case: sweep.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..files import Json
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.modes.find import LabelledModes
from ..simulate.modes.label import Label, labelled
from .modes import mode_entry
from .result import (
    NAME_COLUMNS,
    Column,
    CsvRow,
    Failed,
    ModeEntry,
    Named,
    Notify,
    Result,
    ResultPart,
    StudyInput,
    Table,
    csv_text,
    silent,
)
from .sweep import (
    DEFAULT_POINTS,
    SweptRange,
    evaluate_points,
    grid,
    latin_hypercube,
    read_ranges,
    swept_labels,
    swept_state,
)

LOWEST, CHANGE = Column("lowest Hz"), Column("", "+z.2f")


class SweptNumber(ResultPart):
    """A number that is swept, in its own unit."""

    name: str  # variable or path
    low: float  # low end of its range
    high: float  # high end of its range
    steps: int | None = None  # None: sampled


class SweptPoint(ResultPart):
    """The design with the swept numbers at these values."""

    values: dict[str, float]  # by the names of the swept numbers
    mass_kg: float  # mass of the tyre without its rim
    modes: list[ModeEntry]  # those that all points have


class SweptMode(Named):
    """A mode over all points, and the plane of least squares through them; ``frequency_Hz`` is its
    mean."""

    lowest_Hz: float  # lowest frequency over all points
    highest_Hz: float  # highest frequency over all points
    # change of the mean by each number, from low to high end; empty where the points are too few
    change_percent: dict[str, float]
    linear_share: float | None  # share of the variance that these changes explain


class SweepFindings(ResultPart):
    """Findings in words."""

    words: list[str]  # findings in words


class SweepResult(Result):
    """sweep.json"""

    study, stem, heading = "sweep", "sweep", "Frequencies over numbers of the case"
    figures = "tyrecal.report.sweep:figures"
    is_seldom = follows_fit = True

    design: str
    sampling: Literal["grid", "latin_hypercube"]  # how the points were chosen
    seed: int | None = None  # of a Latin hypercube, whose values are uniform within the ranges
    discrepancy: float | None = None  # its centred L2 discrepancy
    numbers_swept: list[SweptNumber]  # swept numbers with their ranges
    rows: Annotated[list[SweptPoint], Field(min_length=1)]  # points that were computed
    failed: list[Failed]  # points that were not
    modes: Annotated[list[SweptMode], Field(min_length=1)]  # modes over all points
    findings: SweepFindings  # findings on all points

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        ranges: Sequence[str] = (),
        latin_hypercube: int = 0,
        seed: int = 0,
        allow_unusual: bool = False,
    ) -> SweepResult:
        """The last design over a grid of ``ranges`` NAME=A:B:N or, with as many points as
        ``latin_hypercube`` states, over ranges NAME=A:B. Without ranges: all variables within 10 %
        of their values. Raises InputError, DeckRefused; the first failure where every point
        fails."""
        sampled = bool(latin_hypercube) or not ranges
        swept = read_ranges(given.case, ranges, sampled, allow_unusual)
        return run(given, swept, sampled, latin_hypercube, seed)

    def quantities(self) -> dict[str, float]:
        return {
            f"frequency_Hz {_at(row.values)} {mode.label}": mode.frequency_Hz
            for row in self.rows
            for mode in row.modes
        }

    def csv(self) -> str:
        keys = ["mass_kg", "c", "m", "kind", "multiplicity", "frequency_Hz"]
        keys += ["damping_ratio"] * any(m.damping_ratio for row in self.rows for m in row.modes)
        names = [each.name for each in self.numbers_swept]
        # a variable may have the name of a column of modes
        columns = {name: f"variables.{name}" if name in keys else name for name in names}
        keys = [*columns.values(), *keys]
        rows = (
            {columns[k]: x for k, x in row.values.items()}
            | {"mass_kg": row.mass_kg, **mode.model_dump()}
            for row in self.rows
            for mode in row.modes
        )
        return csv_text(keys, rows)

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """Each mode over all points."""
        return {"modes": [each.model_dump() for each in self.modes]}

    def tables(self) -> list[Table]:
        names = [*self.modes[0].change_percent]
        share = Column("linear %", ".0f", 100)
        heads = [*NAME_COLUMNS, LOWEST, Column("highest"), *(Column(f"% by {n}") for n in names)]
        rows = [
            [
                *mode.named(),
                *map(LOWEST.cell, (mode.lowest_Hz, mode.highest_Hz)),
                *(CHANGE.cell(mode.change_percent[name]) for name in names),
                share.cell(mode.linear_share),
            ]
            for mode in self.modes
        ]
        caption = (
            f"{self.design}, {len(self.rows)} points; % by a number: change of the frequency from"
            " its low to its high end, by least squares; linear: share of the variance that these"
            " changes explain"
        )
        return [Table([*heads, share], rows, caption=caption, csv="modes")]


def run(
    given: StudyInput,
    swept: Sequence[SweptRange],
    sampled: bool,
    count: int = 0,
    seed: int = 0,
    notify: Notify = silent,
) -> SweepResult:
    """The last design over a grid or, if ``sampled``, ``count`` points (0: ten for each number).
    Raises DeckRefused; the first failure where every point fails."""
    facts: Json = {}
    if sampled:
        points, discrepancy = latin_hypercube(swept, count or DEFAULT_POINTS * len(swept), seed)
        facts = {"seed": seed, "discrepancy": discrepancy}
    else:
        points = grid(swept)
    name, values = [*given.designs.items()][-1]
    rows, failures = _evaluated(given, {name: values}, points, notify)
    if not rows:
        raise failures[min(failures)]
    modes = [_mode(each.label, swept, rows) for each in rows[0].modes]
    if not modes:
        raise InputError("no mode is at every point of the sweep: give narrower ranges")
    result = SweepResult(
        format=1,
        design=name,
        sampling="latin_hypercube" if sampled else "grid",
        **facts,
        numbers_swept=[
            SweptNumber(name=x.name, low=x.low, high=x.high, steps=None if sampled else x.steps)
            for x in swept
        ],
        rows=rows,
        failed=[
            Failed(design=name, values=points[i], cause=each.cause, words=each.words)
            for i, each in sorted(failures.items())
        ],
        modes=modes,
        findings=SweepFindings(words=_words(swept, modes, len(points), facts)),
    )
    return given.stamped(result, **swept_state(given.case, swept))


def _evaluated(
    given: StudyInput,
    design: dict[str, dict[str, float]],
    points: Sequence[dict[str, float]],
    notify: Notify,
) -> tuple[list[SweptPoint], dict[int, EvaluationFailed]]:
    """Rows in the order of the points, with the modes that all of them have, and failures."""
    known: dict[int, tuple[float, dict[Label, ModeEntry]]] = {}
    failures: dict[int, EvaluationFailed] = {}

    def use(place: int, name: str, answer: LabelledModes | EvaluationFailed) -> None:
        words = f"{name}, {_at(points[place])}"
        if isinstance(answer, EvaluationFailed):
            failures[place] = answer
            notify(words, answer)
            return
        own = {mode.label: ModeEntry(**mode_entry(mode)) for mode in labelled(answer.evaluation)}
        known[place] = answer.evaluation.mass_kg, own
        notify(f"{words}: {len(own)} modes", None)

    evaluate_points(given.case, given.evaluator, design, points, use, jobs=given.jobs)
    if not known:
        return [], failures
    labels = swept_labels(given.case, (own for _, own in known.values()))
    rows = [
        SweptPoint(values=points[i], mass_kg=mass, modes=[own[label] for label in labels])
        for i, (mass, own) in sorted(known.items())
    ]
    return rows, failures


def _at(values: dict[str, float]) -> str:
    """C10=1e+06, pressure_kPa=240"""
    return ", ".join(f"{name}={value:.6g}" for name, value in values.items())


def _mode(label: Label, swept: Sequence[SweptRange], rows: Sequence[SweptPoint]) -> SweptMode:
    hertz = np.array([next(m.frequency_Hz for m in row.modes if m.label == label) for row in rows])
    share = np.array(
        [[(row.values[s.name] - s.low) / (s.high - s.low) for s in swept] for row in rows]
    )
    plane = np.column_stack([np.ones(len(rows)), share])
    change, _, rank, _ = np.linalg.lstsq(plane, hertz, None)
    is_determined = rank == plane.shape[1]
    scatter = hertz.var()
    left = np.mean((hertz - plane @ change) ** 2)
    share_explained = float(1 - left / scatter) if scatter > 1e-18 * hertz.mean() ** 2 else 1.0
    return SweptMode(
        **asdict(label),
        frequency_Hz=float(hertz.mean()),
        lowest_Hz=float(hertz.min()),
        highest_Hz=float(hertz.max()),
        change_percent={
            s.name: float(100 * x / hertz.mean())
            for s, x in zip(swept, change[1:], strict=True)
            if is_determined
        },
        linear_share=share_explained if is_determined else None,
    )


def _words(
    swept: Sequence[SweptRange], modes: Sequence[SweptMode], count: int, facts: Json
) -> list[str]:
    spans = ", ".join(f"{each.name} from {each.low:g} to {each.high:g}" for each in swept)
    how = (
        f"a Latin hypercube of {count} points, seed {facts['seed']}"
        if facts
        else (f"a grid of {count} points")
    )
    words = [f"{how}: {spans}"]
    if not modes[0].change_percent:
        return [*words, "too few points to tell what each number changes"]
    for each in swept:
        most = max(modes, key=lambda mode: abs(mode.change_percent[each.name]))
        change = most.change_percent[each.name]
        words.append(f"most by {each.name}: {most.label.display}, {change:+.2g} %")
    return words
