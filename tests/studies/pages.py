"""Figures of the documents that a command computes: the command, its record, and the comparison.

    python -m tests.studies.pages FOLDER [STEP ...]
    python -m tests.studies.pages --check

The first runs the commands of `page_steps` (all, or the steps named, whose earlier ones must be in
FOLDER), writes what they give to tests/benchmarks/pages.json with command and date, and compares;
the second only compares the documents with the record, as `tests/test_pages.py` does: a printed
figure is the recorded one, rounded to its own last digit. Sentences are in `page_sentences`,
tables in `page_tables`. A table or block of output has a comment above it that no reader sees:
`<!-- checked: NAME -->`, or `<!-- given: SOURCE -->` if its figures are those of others, of
definitions or of a test. All commands take about 40 minutes of a core.
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from .page_sentences import SENTENCES
from .page_steps import ROOT, SOURCES, STEPS, Figures, Record
from .page_tables import TABLES

RECORD = ROOT / "tests" / "benchmarks" / "pages.json"
DOCUMENTS = (
    *("README.md", "solvers/README.md"),
    *(f"cases/{path.name}" for path in sorted((ROOT / "cases").glob("*.md"))),
    *(f"tests/benchmarks/{path.name}" for path in sorted((ROOT / "tests/benchmarks").glob("*.md"))),
)
NUMBER = r"([+\-]?\d+(?:\.\d+)?)"
IN_A_CELL = re.compile(
    r"(?<![\w.\[,/-])[+\-]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[+\-]?\d+)?(?![\w\]])", re.ASCII
)
MARK = re.compile(r"<!-- (checked|given): (.*) -->")


@dataclass(frozen=True)
class MarkedTable:
    """A table, or block of output, of a document, and the mark above it."""

    document: str
    kind: str  # checked or given; "" without a mark
    name: str
    rows: Sequence[str]  # without the head


def marked_tables(document: str) -> Iterator[MarkedTable]:
    """Every table of a document, and every block of output with a mark."""
    lines = (ROOT / document).read_text(encoding="utf-8").splitlines()
    place, is_code = 0, False
    while place < len(lines):
        line, before = lines[place], lines[place - 1] if place else ""
        mark = MARK.fullmatch(before)
        kind, name = (mark[1], mark[2]) if mark else ("", "")
        if line.startswith("```"):
            is_code = not is_code
            if is_code and mark:
                end = next(k for k in range(place + 1, len(lines)) if lines[k] == "```")
                yield MarkedTable(document, kind, name, lines[place + 2 : end])
        elif line.startswith("|") and not is_code:
            end = place
            while end < len(lines) and lines[end].startswith("|"):
                end += 1
            yield MarkedTable(document, kind, name, lines[place + 2 : end])
            place = end
            continue
        place += 1


def numbers(row: str) -> list[str]:
    """Numbers of a row behind its first cell or word."""
    row = plain(row)
    cells = row.strip("| ").split(" | ", 1) if row.startswith("|") else row.split(maxsplit=1)
    return IN_A_CELL.findall(cells[1]) if len(cells) > 1 else []


def is_rounded(printed: str, value: float) -> bool:
    """Return whether a printed number is ``value``, rounded to the last digit of the former."""
    mantissa, _, power = printed.replace(",", "").partition("e")
    unit = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
    return abs(float(f"{mantissa}e{power or 0}") - value) <= 0.5 * unit * (1 + 1e-3)


def plain(text: str) -> str:
    """Words in one line, without bold type."""
    return re.sub(r"\s+", " ", text.replace("\N{MINUS SIGN}", "-").replace("**", ""))


def differences(record: Record) -> Iterator[str]:
    """Sentences and tables that are not in their document, and printed figures that are not the
    recorded ones; nothing of a command that is not on record."""
    for document, words, figures in SENTENCES:
        pattern = NUMBER.join(re.escape(part) for part in words.split("{}"))
        match = re.search(pattern, plain((ROOT / document).read_text(encoding="utf-8")))
        if not match:
            yield f"{document}: not there: {words}"
            continue
        try:
            values = figures(record)
        except KeyError as error:
            if error.args[0] not in STEPS:
                raise
            continue  # a command that was not run, which `main` reports
        yield from _unequal(f"{document}: {words}", match.groups(), values)
    tables = {t.name: t for name in DOCUMENTS for t in marked_tables(name) if t.kind == "checked"}
    for name in tables.keys() ^ TABLES.keys():
        yield f"{name}: marked in no document" if name in TABLES else f"{name}: not in page_tables"
    for name in [name for name in TABLES if name in tables]:
        try:
            expected = TABLES[name](record)
        except KeyError as error:
            if error.args[0] not in STEPS:
                raise
            continue
        marked = tables[name]
        printed_rows = [row for row in marked.rows if numbers(row)]
        if len(printed_rows) != len(expected):
            yield f"{marked.document}: {name}: {len(printed_rows)} rows, {len(expected)} on record"
            continue
        for row, values in zip(printed_rows, expected, strict=True):
            if values is not None:
                yield from _unequal(f"{marked.document}: {name}: {row}", numbers(row), values)


def _unequal(where: str, printed: Sequence[str], values: Sequence[float]) -> Iterator[str]:
    if len(printed) != len(values):
        yield f"{where}: {len(printed)} figures, {len(values)} on record"
        return
    for each, value in zip(printed, values, strict=True):
        if not is_rounded(each, value):
            yield f"{where}: printed {each}, recorded {value:.6g}"


def recorded() -> dict[str, Figures]:
    """Recorded figures of the commands, by step."""
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    return {step: each["figures"] for step, each in record.items()}


def run(name: str, folder: Path) -> Figures:
    """A step's figures. Raises CalledProcessError."""
    step = STEPS[name]
    places = {each: str(folder / each.replace(" ", "_")) for each in STEPS}
    for source, write in SOURCES.items():
        if f"{{{source}}}" in step.command:
            places[source] = str(write(folder / source))
    words = shlex.split(re.sub(r"{(.*?)}", lambda match: places[match[1]], step.command))
    words = (
        [sys.executable, "-m", *words] if words[0] == "tyrecal" else [sys.executable, *words[1:]]
    )
    words += ["--output", places[name], "--quiet"] if step.file else []
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 4):  # 4: a fit that leaves more than it explains
        raise subprocess.CalledProcessError(done.returncode, words, done.stdout, done.stderr)
    return read_result(name, folder) if step.file else step.read(done.stdout)


def read_result(name: str, folder: Path) -> Figures:
    """Figures of a step whose files are in ``folder``."""
    step, place = STEPS[name], folder / name.replace(" ", "_")
    if step.file == ".":
        return step.read(place.read_text(encoding="utf-8"))
    return step.read(json.loads((place / step.file).read_text(encoding="utf-8")))


def write_record(name: str, figures: Figures) -> None:
    """The figures of a step, with its command and today's date, in the record."""
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    record[name] = {
        "command": STEPS[name].command,
        "date": date.today().isoformat(),
        "figures": {key: float(f"{value:.6g}") for key, value in figures.items()},
    }
    order = {each: record[each] for each in STEPS if each in record}
    RECORD.write_text(json.dumps(order, indent=1) + "\n", encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("steps", nargs="*", metavar="STEP")
    parser.add_argument(
        "--check", action="store_true", help="compare documents and record, run nothing"
    )
    options = parser.parse_args()
    if not options.check and not options.folder:
        parser.error("FOLDER, or --check")
    for name in [] if options.check else options.steps or STEPS:
        figures = run(name, options.folder.resolve())
        write_record(name, figures)
        print(f"{name}: {len(figures)} figures", flush=True)
    wrong = list(differences(recorded()))
    print("\n".join(wrong) or f"all {len(SENTENCES)} sentences and {len(TABLES)} tables agree")
    if missing := [name for name in STEPS if name not in recorded()]:
        print(f"not on record: {', '.join(missing)}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
