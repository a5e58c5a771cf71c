"""Parts of a page: sections of blocks that studies give, numbered in the page's order.

A study offers its words, tables and figures (`studies.result.Result`). One that also needs other
files of the folder, or has more to say at the head of the page, names a function as its `part`:
result and `Chapter` in, `StudyPart` out. The page knows no study by name.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup
from matplotlib.figure import Figure

from ...errors import InputError
from ...files import Json
from ...studies import named
from ...studies.result import Deviation, Result, Table
from ...units import signed
from ..figure import svg
from .results import Results

MAX_EMBEDDED_BYTES = 300_000  # of a CSV file in the page; the numbers of a longer one as shown


@dataclass(frozen=True)
class KeyFigure:
    """A result for the head of the page, as text with its unit; more: small letters below it."""

    name: str
    value: str
    more: str = ""


@dataclass(frozen=True)
class Paragraphs:
    """Sentences of one look: facts, findings, verdict, doubt, legend, heading, or absent."""

    kind: str
    lines: Sequence[str]


@dataclass(frozen=True)
class Prose:
    """Text with marks, as HTML."""

    html: Markup
    kind = "prose"


@dataclass
class PageFigure:
    """A picture with its caption."""

    svg: Markup
    caption: str
    number: str = ""
    kind = "figure"


@dataclass
class BarFigure:
    """Bars: name, share of the full width, and the value as text."""

    caption: str
    bars: Sequence[tuple[str, float, str]]
    number: str = ""
    kind = "figure"


@dataclass
class PageTable:
    """A table with its caption, and its numbers as a CSV file; folded: shown on demand."""

    table: Table
    caption: str
    file: str
    text: str  # of the file
    folded: bool = False
    number: str = ""
    kind = "table"


@dataclass(frozen=True)
class CsvFiles:
    """Further CSV files, texts by name."""

    texts: Mapping[str, str]
    kind = "files"


@dataclass
class ShapeViewer:
    """Data of `viewer.js`; id: unique within the chapter."""

    id: str
    data: Json
    caption: str
    number: str = ""
    kind = "viewer"


Numbered = PageFigure | BarFigure | PageTable | ShapeViewer
Block = Numbered | Paragraphs | Prose | CsvFiles


@dataclass(frozen=True)
class PageSection:
    """A section under a heading that the contents list."""

    id: str
    heading: str
    blocks: list[Block]


@dataclass(frozen=True)
class StudyPart:
    """Contribution of a study to a page."""

    summary: Sequence[str]  # sentences for the head of the page
    doubts: Sequence[str]
    sections: list[PageSection]  # the first is the study's own
    key_figures: Sequence[KeyFigure] = ()


@dataclass(frozen=True)
class Chapter:
    """Results of a folder on a page; prefix: of ids."""

    results: Results
    prefix: str

    def figure(self, name: str, file: str, draw: Callable[[], Figure]) -> PageFigure:
        """A figure of the contents of a file of the folder. Raises InputError."""
        with lists_of(self.results.folder / file):
            return drawn(f"{self.prefix}{name}", draw)

    def figures(self, result: Result) -> Iterator[PageFigure]:
        """The figures that a study offers. Raises InputError."""
        file = f"{result.stem}.json"
        if result.figures:
            with lists_of(self.results.folder / file):
                plots: dict[str, Figure] = named(result.figures)(result)
            for name in plots:
                yield self.figure(name, file, partial(plots.__getitem__, name))


def drawn(key: str, draw: Callable[[], Figure]) -> PageFigure:
    """The figure as SVG; its caption is the figure's label."""
    figure = draw()
    caption = str(figure.get_label())
    return PageFigure(svg(figure, caption, key), caption)


def study_part(result: Result, chapter: Chapter) -> StudyPart:
    """The part of a study of a page, its own or the usual one. Raises InputError."""
    if result.part:
        part: StudyPart = named(result.part)(result, chapter)
        return part
    return usual_part(result, chapter.figures(result))


def usual_part(
    result: Result,
    figures: Iterable[PageFigure],
    key_figures: Sequence[KeyFigure] = (),
    summary: Sequence[str] | None = None,
    more: Sequence[Block] = (),
    sections: Iterable[PageSection] = (),
) -> StudyPart:
    """Findings, figures and tables of a study in this order, with all its CSV files.

    summary: default: the study's own; more: behind figures; sections: behind the study's own.
    """
    texts = {name: text for name, text in result.texts().items() if name.endswith(".csv")}
    tables = [
        # a terminal prints a table without columns below another
        *(page_table(each, result, texts) for each in result.tables() if each.columns),
        *(page_table(each, result, texts, folded=True) for each in result.numbers()),
    ]
    blocks: list[Block] = []
    if sentences := [*map(sentence, result.sentences())]:
        blocks.append(Paragraphs("findings", sentences))
    blocks += [*figures, *more, *tables]
    given = {each.file for each in tables}
    if left := {name: text for name, text in texts.items() if name not in given}:
        blocks.append(CsvFiles(left))
    return StudyPart(
        [*map(sentence, result.summary())] if summary is None else summary,
        result.doubts(),
        [PageSection(result.study, result.heading, blocks), *sections],
        key_figures,
    )


def page_table(
    table: Table, result: Result, texts: Mapping[str, str], folded: bool = False
) -> PageTable:
    """A table of a study with the file that has its numbers, all digits; without one, or where that
    is too long, as they are shown. Provenance is at the end of a page, not in captions."""
    caption = table.caption.removesuffix(str(result.provenance or "")).rstrip("; ")
    parts = [table.title, caption]
    if not any(parts):
        parts = [": ".join(filter(None, (result.heading, table.csv)))]
    caption = " ".join(map(sentence, filter(None, parts))).removesuffix(".")
    name = f"{result.stem}_{table.csv}.csv" if table.csv else f"{result.stem}.csv"
    text = texts.get(name, "")
    if table.csv is None or not 0 < len(text) <= MAX_EMBEDDED_BYTES:
        return shown_table(table, caption, result.stem, folded)
    return PageTable(table, caption, name, text, folded)


def shown_table(table: Table, caption: str, stem: str, folded: bool = False) -> PageTable:
    """A table whose CSV file has its cells as they are shown."""
    text = io.StringIO(newline="")
    heads = [[column.name for column in table.columns]] if table.columns else []
    csv.writer(text, lineterminator="\n").writerows([*heads, *(map(_plain, x) for x in table.rows)])
    return PageTable(table, caption, f"{stem}_table.csv", text.getvalue(), folded)


def _plain(cell: object) -> str:
    if isinstance(cell, Deviation):
        return f"{cell.value} {signed(cell.percent, 2)}".lstrip()
    return "" if cell is None else str(cell)


def link_of(text: str) -> str:
    """A text as an address that needs no file and no network."""
    return f"data:text/csv;charset=utf-8,{quote(text, safe=' ,:;-.')}".replace(" ", "%20")


def number(blocks: Iterable[Block]) -> None:
    """Number figures and tables in their order on the page."""
    counts = {"Figure": 0, "Table": 0}
    for block in blocks:
        if isinstance(block, Numbered):
            word = "Table" if isinstance(block, PageTable) else "Figure"
            counts[word] += 1
            block.number = f"{word} {counts[word]}"
            if isinstance(block, PageTable) and block.file.endswith("_table.csv"):
                block.file = block.file.replace("_table", f"_table_{counts[word]}")


def sentence(words: str) -> str:
    """Make a sentence with a capital and a full stop."""
    return words[:1].upper() + words[1:] + ("" if words.endswith((".", "!", "?")) else ".")


@contextmanager
def lists_of(path: Path) -> Iterator[None]:
    """Raises InputError where lists of the file that belong together differ in length."""
    try:
        yield
    except InputError:
        raise
    except (ValueError, LookupError, TypeError):
        raise InputError(f"'{path}' is damaged: its lists do not go together") from None
