"""The page in words of a diagnosis, as blocks of the report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

from ...studies.result import Column, Table
from .parts import Block, Prose, shown_table

# no more than the page uses: a stranger's text cannot bring links, pictures or HTML
MARKS = MarkdownIt("zero").enable(["heading", "table", "list", "backticks"])


@dataclass
class MarkdownSection:
    """Blocks under a heading; "": above all headings."""

    heading: str
    blocks: list[Block] = field(default_factory=list)


def sections(text: str, stem: str) -> list[MarkdownSection]:
    """Sections under the headings below the title, their tables for download as ``stem``_table;
    marks are paragraphs, numbered lists, tables and `code`. A paragraph that ends with a colon
    above a table is its caption."""
    parts, run = [MarkdownSection("")], list[Token]()

    def end_run() -> None:
        if run:
            html = MARKS.renderer.render(run, MARKS.options, {})
            parts[-1].blocks.append(Prose(Markup(html)))
            run.clear()

    tokens = iter(MARKS.parse(text))
    for token in tokens:
        if token.type == "heading_open":
            end_run()
            inner = next(tokens)
            next(tokens)  # its end
            if token.tag != "h1":
                parts.append(MarkdownSection(_plain(inner.content)))
        elif token.type == "table_open":
            words = ""
            if run and run[-1].type == "paragraph_close" and run[-2].content.endswith(":"):
                words = _plain(run[-2].content).rstrip(":")
                del run[-3:]
            end_run()
            caption = parts[-1].heading or stem
            parts[-1].blocks.append(shown_table(_table(tokens), words or caption, stem))
        else:
            run.append(token)
    end_run()
    return parts


def _table(tokens: Iterator[Token]) -> Table:
    """The table whose tokens come next."""
    rows: list[list[str]] = []
    for token in tokens:
        if token.type == "table_close":
            break
        if token.type == "tr_open":
            rows.append([])
        elif token.type == "inline":
            rows[-1].append(_plain(token.content))
    return Table([*map(Column, rows[0])], rows[1:])


def _plain(text: str) -> str:
    return text.replace("`", "")
