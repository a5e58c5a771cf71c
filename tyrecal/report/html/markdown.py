"""The page in words of a diagnosis, as HTML."""

from __future__ import annotations

from markdown_it import MarkdownIt
from markupsafe import Markup

# no more than the page uses: a stranger's text cannot bring links, pictures or HTML
MARKS = MarkdownIt("zero").enable(["heading", "table", "list", "backticks"])


def html(text: str) -> Markup:
    """Headings one level down, without the title; paragraphs, tables, numbered lists, `code`."""
    tokens = MARKS.parse(text)
    if tokens and tokens[0].tag == "h1":
        tokens = tokens[3:]  # open, text, close
    for token in tokens:
        if token.type.startswith("heading"):
            token.tag = f"h{min(int(token.tag[1]) + 1, 6)}"
    words = MARKS.renderer.render(tokens, MARKS.options, {})
    wide = words.replace("<table>", '<div class="wide" tabindex="0"><table>')
    return Markup(wide.replace("</table>", "</table></div>"))
