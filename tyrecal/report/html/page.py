"""The page: folders read, sections made and numbered, templates filled."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from jinja2 import FileSystemLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment
from markupsafe import Markup

from ...errors import InputError
from ...files import Json, atomic_write, open_file
from ...studies import result_types
from ...studies.result import Deviation
from ...units import signed
from ..table import CLOSE, FAR, MINUS
from .comparison import comparison
from .parts import (
    BarFigure,
    Block,
    Chapter,
    KeyFigure,
    PageFigure,
    PageSection,
    Paragraphs,
    StudyPart,
    link_of,
    lists_of,
    number,
    study_part,
)
from .provenance import doubts_of, provenance_section
from .results import Results, RunFacts, read_results

MAX_PAGE_BYTES = 5_000_000
MARK = '<meta name="generator" content="tyrecal report">'


@dataclass(frozen=True)
class Page:
    """A page that was written: bytes, and the commands whose results each folder holds."""

    path: Path
    size: int  # bytes
    found: dict[str, list[str]]  # folder to commands


def write_page(path: Path, folders: Sequence[Path], author: str = "", title: str = "") -> Page:
    """Write the results of ``folders`` as one page that needs no network; author: a name above the
    title; title: default the names of the cases. Results of the same runs give the same bytes.
    Raises InputError; OSError."""
    results = [read_results(folder) for folder in folders]
    _refuse(path)
    try:
        content = page(results, author, title).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError("a name in the results is no text") from None
    size = len(content)
    if size > MAX_PAGE_BYTES:
        raise InputError(
            f"the page would have {size / 1e6:.1f} MB, more than 5: give fewer folders"
        )
    with atomic_write(path) as partial:
        partial.write_bytes(content)
    studies = {
        str(each.folder): [result_types()[name].command or name for name in each.studies]
        for each in results
    }
    return Page(path, size, studies)


def _refuse(path: Path) -> None:
    """Raises InputError where no page may be written to ``path``; OSError."""
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; give a file with --output")
    try:
        with open_file(path, follow=False) as file:
            ours = MARK.encode() in file.read(2000)
    except FileNotFoundError:
        ours = True
    if not ours:
        raise InputError(f"'{path}' is not a page of tyrecal; give another file with --output")
    if not path.parent.is_dir():
        raise InputError(f"'{path}' cannot be written: there is no folder '{path.parent}'")


def page(results: Sequence[Results], author: str = "", title: str = "") -> str:
    """The page as text; author: a name above the title. Raises InputError."""
    several = len(results) > 1
    chapters = [chapter(each, f"f{k}-", several) for k, each in enumerate(results, 1)]
    sections = [section for each in chapters for section in each["sections"]]
    compared = comparison(results, [each["prefix"] for each in chapters])
    last = provenance_section(results)
    lead = [block for each in chapters for block in each["lead"]]
    front = [compared] if compared else []
    number([*lead, *(block for each in [*front, *sections, last] for block in each.blocks)])
    template = environment().get_template("page.html.j2")
    return template.render(
        mark=Markup(MARK),
        title=title or " and ".join(dict.fromkeys(each.case for each in results)),
        author=author,
        date=max(run.started[:10] for each in results for run in [*each.runs.values(), RunFacts()]),
        chapters=chapters,
        front=front,
        last=last,
        close=CLOSE,
        far=FAR,
    )


def chapter(results: Results, prefix: str, several: bool = False) -> Json:
    """Values of the templates for one folder's results; the first figure leads the page. prefix: of
    the ids of the folder's elements; several: the page has more folders. Raises InputError."""
    parts = []
    for result in results.studies.values():
        with lists_of(results.folder / f"{result.stem}.json"):
            parts.append(study_part(result, Chapter(results, prefix)))
    sections = [section for part in parts for section in part.sections]
    lead = _take_first_figure(sections)
    doubts = [Paragraphs("doubt", words)] if (words := doubts_of(results)) else []
    heads = [
        {"id": part.sections[0].id, "heading": part.sections[0].heading, "of": part}
        for part in parts
        if part.sections[0].blocks and (part.summary or part.doubts)
    ]
    return {
        "prefix": prefix,
        "name": f"{results.folder.resolve().name}: {results.case}" if several else "",
        "key_figures": _key_figures(parts),
        "lead": [*doubts, *lead],
        "heads": heads,
        "sections": [each for each in sections if each.blocks],
    }


def _key_figures(parts: Sequence[StudyPart]) -> list[KeyFigure]:
    """Those of all studies, of equal names the first."""
    return list(
        {
            each.name: each for part in reversed(parts) for each in reversed(part.key_figures)
        }.values()
    )[::-1]


def _take_first_figure(sections: Sequence[PageSection]) -> list[Block]:
    """The first figure, taken out of its section: it is at the head of the page."""
    for section in sections:
        for block in section.blocks:
            if isinstance(block, PageFigure | BarFigure):
                section.blocks.remove(block)
                return [block]
    return []


@lru_cache(maxsize=1)
def environment() -> ImmutableSandboxedEnvironment:
    """The sandbox of the page's templates: what comes from files is escaped."""
    made = ImmutableSandboxedEnvironment(
        loader=FileSystemLoader(str(files("tyrecal_templates") / "report")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["signed"] = lambda value, digits: with_minus(signed(value, digits))
    made.filters["minus"] = with_minus
    made.filters["link"] = link_of
    made.tests["deviation"] = lambda cell: isinstance(cell, Deviation)
    return made


def with_minus(text: str) -> str:
    """Hyphens at the start of numbers as minus signs; not of options such as --set x=-1."""
    return re.sub(r"(?<![^\s(])-(?=\d)", MINUS, text)
