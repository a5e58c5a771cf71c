"""The few marks of Markdown that the page in words of a diagnosis uses, as HTML."""

from __future__ import annotations

import re

from markupsafe import Markup, escape


def html(text: str, skip_title: bool = True) -> Markup:
    """Headings (two levels down), paragraphs, tables, numbered lists, `code`; all else as it is."""
    blocks = (block.strip("\n") for block in re.split(r"\n\s*\n", text))
    return Markup("\n").join(
        _block(block) for block in blocks if block and not (skip_title and block.startswith("# "))
    )


def _block(block: str) -> Markup:
    lines = block.splitlines()
    if heading := re.match(r"(#+) (.*)", lines[0]):
        level = min(len(heading[1]) + 1, 6)
        return Markup("<h{0}>{1}</h{0}>").format(level, _inline(heading[2]))
    if lines[0].startswith("|"):
        rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines]
        width = len(rows[0])
        body = [[*row, *[""] * (width - len(row))] for row in rows[2:]]
        table = _row(rows[0], "th") + Markup("").join(_row(row, "td") for row in body)
        return Markup('<div class="wide" tabindex="0"><table>{}</table></div>').format(table)
    if all(re.match(r"\d+\. ", line) for line in lines):
        items = (_inline(line.split(". ", 1)[1]) for line in lines)
        return Markup("<ol>{}</ol>").format(
            Markup("").join(Markup("<li>{}</li>").format(item) for item in items)
        )
    return Markup("<p>{}</p>").format(_inline(" ".join(lines)))


def _row(cells: list[str], tag: str) -> Markup:
    each = (Markup("<{0}>{1}</{0}>").format(Markup(tag), _inline(cell)) for cell in cells)
    return Markup("<tr>{}</tr>").format(Markup("").join(each))


def _inline(text: str) -> Markup:
    pieces = text.split("`")
    return Markup("").join(
        Markup("<code>{}</code>").format(piece) if k % 2 else escape(piece)
        for k, piece in enumerate(pieces)
    )
