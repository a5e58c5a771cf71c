"""Rate at which `fit --measured FILE` names a slip in a table of drawn tyres, and accuses no
clean one.

    python -m tests.studies.slips [COUNT] [SEED] [SIZE ...] >> slips.jsonl
    python -m tests.studies.slips slips.jsonl

Each tyre, its scatter and its frequencies at two pressures are drawn as by `fit_errors`, written
with one decimal. Its table is fitted twice, coarse mesh: as it is, and with one slip, the kinds in
turn:

    digit            another digit in one place of a number
    decimal place    a number ten times as large or small
    exchanged digits two neighbouring digits of a number
    exchanged rows   the values of two neighbouring rows at one pressure
    exchanged pressures

A slip moves its values by at least 8 standard deviations or 3 %, those of exchanged pressures on
average. Counted are the first sentence that the command prints about the data (a doubt before the
fit, a refusal, or the fit's reason), and the refusal or the fit's reason alone. A sentence is right
if it names the slip's row before any other and, of an exchange, its kind with both rows or
pressures. One line of JSON is printed for each table, the counts to stderr; the second command
counts a record.

And how often a fit blames a slip of one value where the model lacks an effect:

    python -m tests.studies.slips effects [SEED] [EFFECT ...] > lines.jsonl

Each effect of the catalogue, at the end of its range that is farther from 0, is added to a drawn
P235/75R17 of a known section; else drawn and measured as by `fit_errors`, coarse mesh. The case
without the effect is fitted to the frequencies at two pressures, and to those at the lower one. A
line of JSON is printed for each fit: its verdict, its reason, and whether the user is kept from
`diagnose`: the model does not fit, and the reason excludes effects. Counts go to stderr.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tyrecal.errors import InputError
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.measured.sense import doubts_of_file
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.fit.verdict import DOES_NOT_FIT, FITS, MAX_CHI2_PER_DOF
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.effects.edit import changed
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .fit_errors import LABELS, SIZES, case_of, drawn, drawn_tyre, measured_and_own, shortened

CLEAN, DIGIT, DECIMAL, DIGITS, ROWS, PRESSURES = (
    "clean",
    "digit",
    "decimal place",
    "exchanged digits",
    "exchanged rows",
    "exchanged pressures",
)
SLIPS = (DIGIT, DECIMAL, DIGITS, ROWS, PRESSURES)
LEAST_SIGMAS, LEAST_RELATIVE = 8.0, 0.03
FIRST_LINE = 2  # of a file, below its heads
Slipped = tuple[list[Measurement], tuple[int, ...]]  # the table, and its rows that are wrong


@dataclass(frozen=True)
class Judged:
    """Sentences of the command about one table: the first doubt before the fit, then the reason why
    it is refused or does not fit; "" where there is none."""

    doubt: str
    reason: str
    verdict: str = ""
    chi2_per_dof: float | None = None

    @property
    def first(self) -> str:
        """The first sentence about the data."""
        return self.doubt or self.reason


def table_of(case: LoadedCase) -> list[Measurement]:
    """The case's targets as rows of a file, with one decimal."""
    return [
        Measurement(
            "frequency_Hz",
            Label(t.c, t.m, t.kind),
            "",
            t.pressure_kPa or case.case.pressure_kPa,
            0.0,
            round(t.frequency_Hz, 1),
            t.sigma_Hz or np.nan,
        )
        for t in case.case.targets.modes
    ]


def with_slip(rows: Sequence[Measurement], kind: str, random: np.random.Generator) -> Slipped:
    """A table with one drawn slip of a kind."""
    if kind == CLEAN:
        return list(rows), ()
    while True:
        slipped, wrong = _drawn_slip(rows, kind, random)
        moves = [abs(slipped[i].value - rows[i].value) for i in wrong]
        least = [min(LEAST_SIGMAS * rows[i].sigma, LEAST_RELATIVE * rows[i].value) for i in wrong]
        if wrong and np.mean(moves) >= np.mean(least):
            return slipped, wrong


def _drawn_slip(rows: Sequence[Measurement], kind: str, random: np.random.Generator) -> Slipped:
    """The same of any size; without wrong rows if the numbers drawn leave the table as it was."""
    values, count = [row.value for row in rows], len(LABELS)
    i = int(random.integers(len(rows)))
    wrong: tuple[int, ...] = (i,)
    if kind == DECIMAL:
        values[i] *= random.choice([0.1, 10.0])
    elif kind in (DIGIT, DIGITS):
        letters = list(f"{values[i]:.1f}")
        places = [k for k, letter in enumerate(letters) if letter != "."]
        k = int(random.integers(len(places) - (kind == DIGITS)))
        if kind == DIGIT:
            letters[places[k]] = str(random.integers(10))
        else:
            here, there = places[k], places[k + 1]
            letters[here], letters[there] = letters[there], letters[here]
        values[i] = float("".join(letters))
    elif kind == ROWS:
        j = i + 1
        if j % count == 0:
            return list(rows), ()
        values[i], values[j], wrong = values[j], values[i], (i, j)
    else:
        values, wrong = [*values[count:], *values[:count]], tuple(range(len(rows)))
    if not all(v > 0 for v in values):
        return list(rows), ()
    return [replace(row, value=v) for row, v in zip(rows, values, strict=True)], wrong


def judged(case: LoadedCase, rows: Sequence[Measurement], folder: Path) -> Judged:
    """Sentences of `fit --measured` about the data. Raises EvaluationFailed."""
    file, doubt = folder / "measured.csv", ""
    file.write_text(measurements_csv(rows))
    try:
        doubt = next(iter(doubts_of_file(file)), "")
        fit = FitStudy(case, Evaluator(TyreDesign(case)), file).run("gauss-newton").found
    except InputError as refusal:
        return Judged(doubt, str(refusal))
    reason = fit.reason.sentence if fit.reason else ""
    return Judged(doubt, reason, fit.verdict, fit.chi2_per_dof)


def is_named(kind: str, wrong: Sequence[int], words: str) -> bool:
    """Return whether a sentence names the slip before anything else."""
    first = words.split("Nearly as likely")[0]
    lines = {int(each) - FIRST_LINE for each in re.findall(r"csv, line (\d+)", first)}
    if kind == PRESSURES:
        return "kPa exchanged?" in first
    if kind == ROWS:
        return "labels exchanged?" in first and lines == set(wrong)
    return lines == set(wrong)


def study(count: int, seed: int, sizes: Sequence[str] = SIZES) -> list[dict[str, Any]]:
    """A line for each of two tables of ``count`` tyres of each size, all sizes in turn."""
    cases = {size: case_of(size) for size in sizes}
    random = {size: np.random.default_rng([seed, SIZES.index(size), 48]) for size in sizes}
    lines: list[dict[str, Any]] = []
    for k in range(count):
        for size in sizes:
            made = None
            while made is None:
                made = _both_tables(cases[size], SLIPS[k % len(SLIPS)], random[size])
            for line in made:
                lines.append({"size": size, **line})
                print(json.dumps(lines[-1]), flush=True)
    return lines


def _both_tables(
    case: LoadedCase, kind: str, random: np.random.Generator
) -> list[dict[str, Any]] | None:
    """The lines of one drawn tyre, without and with a slip; None if it cannot be evaluated."""
    lines = []
    try:
        rows = table_of(drawn(case, random)[0])
        for each in (CLEAN, kind):
            slipped, wrong = with_slip(rows, each, random)
            with TemporaryDirectory() as folder:
                judgement = judged(case, slipped, Path(folder))
            lines.append(_line(each, rows, slipped, wrong, judgement))
    except (EvaluationFailed, ValueError):
        return None
    return lines


def _line(
    kind: str,
    rows: Sequence[Measurement],
    slipped: Sequence[Measurement],
    wrong: Sequence[int],
    judgement: Judged,
) -> dict[str, Any]:
    moved = [] if kind == PRESSURES else [(rows[i].value, slipped[i].value) for i in wrong]
    words = {"doubt": judgement.doubt, "reason": judgement.reason}
    names = lambda text: is_named(kind, wrong, text) if kind != CLEAN else bool(text)
    first, by_fit = names(judgement.first), names(judgement.reason)
    if not (first or by_fit) if kind == CLEAN else first and by_fit:
        words = {}  # of what is as it should be
    chi2 = judgement.chi2_per_dof
    return {
        "kind": kind,
        "moved": moved,
        "named_first": first,
        "named_by_fit": by_fit,
        "verdict": judgement.verdict,
        "chi2_per_dof": chi2 and shortened(chi2),
        **{key: re.sub(r"\S*measured\.csv", "measured.csv", each) for key, each in words.items()},
    }


def counts(lines: Sequence[dict[str, Any]]) -> str:
    """The table of results."""
    names = ("named_first", "named_by_fit")
    every = Counter(line["kind"] for line in lines)
    right = Counter((line["kind"], name) for line in lines for name in names if line[name])
    rows = [(kind, every[kind], [right[kind, name] for name in names]) for kind in SLIPS]
    sums = [sum(each[2][i] for each in rows) for i in range(len(names))]
    rows.append(("with a slip", sum(every[kind] for kind in SLIPS), sums))
    rows.append(("clean: something named", every[CLEAN], [right[CLEAN, name] for name in names]))
    wrong = [
        line
        for line in lines
        if line["verdict"] == FITS and (line["chi2_per_dof"] or 0) > MAX_CHI2_PER_DOF
    ]
    return "\n".join(
        [
            "| tables | number | named by the first sentence | by the fit |",
            "|---|---|---|---|",
            *(f"| {kind} | {n} | {first} | {by_fit} |" for kind, n, (first, by_fit) in rows),
            f"| 'fits' with chi2/dof above {MAX_CHI2_PER_DOF:g} | {len(wrong)} | | |",
        ]
    )


def main(count: int, seed: int, sizes: Sequence[str]) -> None:
    """Print the lines, and their counts."""
    print(counts(study(count, seed, sizes)), file=sys.stderr)


def known_case(folder: Path) -> LoadedCase:
    """The shipped P235/75R17 with an exact section, coarse mesh."""
    for path in CASES.glob("p235_75r17*"):
        shutil.copy(path, folder)
    path = folder / "p235_75r17.yaml"
    text = path.read_text().replace("known_from: size_code", "known_from: exact")
    path.write_text(text)
    return with_level(load_case(path), "coarse")


def lines(case: LoadedCase, id: str, seed: int, folder: Path) -> Iterator[dict[str, Any]]:
    """The two fits to a tyre with an effect. Raises EvaluationFailed, InputError, ValueError."""
    effect = catalogue()[id]
    random = np.random.default_rng([48, seed, effect.place])
    size = max(effect.range_on(case), key=lambda end: (abs(end), end))
    tyre = drawn_tyre(case, random)
    tyre = replace(tyre, case=effect.add(tyre.case, size))
    rows = table_of(measured_and_own(case, tyre, random)[0])
    file = folder / "measured.csv"
    for count in (2 * len(LABELS), len(LABELS)):
        file.write_text(measurements_csv(rows[:count]))
        at = case if count > len(LABELS) else changed(case, pressure_kPa=rows[0].pressure_kPa)
        fit = FitStudy(at, Evaluator(TyreDesign(at)), file).run("gauss-newton").found
        reason = fit.reason
        yield {
            "effect": id,
            "size": size,
            "values": count,
            "verdict": fit.verdict,
            "chi2_per_dof": fit.chi2_per_dof,
            "kind": reason.kind if reason else "",
            "kept_from_diagnose": fit.verdict == DOES_NOT_FIT
            and bool(reason and reason.excludes_effects),
        }


def slips_or_effects(seed: int, ids: Sequence[str]) -> None:
    """Print the lines, and their counts."""
    every: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        case = known_case(Path(folder))
        for id in ids or catalogue():
            try:
                for line in lines(case, id, seed, Path(folder)):
                    every.append(line)
                    print(json.dumps(line), flush=True)
            except (EvaluationFailed, ValueError) as failure:
                print(f"{id}: {failure}", file=sys.stderr)
    off = [line for line in every if line["verdict"] == DOES_NOT_FIT]
    print(
        f"{len(every)} fits, {len(off)} do not fit; a reason in"
        f" {sum(bool(line['kind']) for line in every)},"
        f" kept from diagnose {sum(line['kept_from_diagnose'] for line in every)}",
        file=sys.stderr,
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["effects"]:
        slips_or_effects(int(sys.argv[2]) if sys.argv[2:] else 0, sys.argv[3:])
    elif sys.argv[1:] and Path(sys.argv[1]).is_file():
        print(counts([json.loads(line) for line in Path(sys.argv[1]).read_text().splitlines()]))
    else:
        given = [int(x) for x in sys.argv[1:3]]
        count, seed = [*given, *(100, 1)[len(given) :]]
        main(count, seed, sys.argv[3:] or SIZES)
