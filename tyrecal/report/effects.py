"""The catalogue of effects as a table, and the full description of one effect."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from ..studies.effects import CatalogueEntry
from ..studies.result import Column, Table

WIDTH = 98  # characters of a line


def effects_table(effects: Sequence[CatalogueEntry]) -> Table:
    """Table of all effects: id, title, range and unit of the parameter, solvers that support it."""
    ends = Column("from", form="g"), Column("to", form="g")
    words = [Column(name, form="") for name in ("effect", "what", "unit", "solvers")]
    rows = [
        [
            each.id,
            each.title,
            *(end.cell(getattr(each, key)) for end, key in zip(ends, ("low", "high"), strict=True)),
            each.unit,
            ", ".join(each.solvers),
        ]
        for each in effects
    ]
    return Table([*words[:2], *ends, *words[2:]], rows)


def effect_text(entry: CatalogueEntry) -> str:
    """Full description of one effect: paragraphs, then a list of its properties."""
    unit = f" {entry.unit}" if entry.unit else ""
    size = max(entry.high, entry.low, key=abs)  # the example in "case file": the farther end
    rows = {
        "parameter": f"{entry.symbol}, {entry.low:.4g} to {entry.high:.4g}{unit}; 0: absent",
        "case file": f"effects: {{{entry.id}: {size:.4g}}}",
        "in the deck": ", ".join(entry.changes),
        "modes": entry.signature,
        "proof": entry.toggle,
        "similar effects": ", ".join(entry.aliases) or "none",
        "solvers": ", ".join(entry.solvers) or "none",
    }
    paragraphs = [f"{entry.title} ({entry.id})", *entry.about]
    text = "\n\n".join(_wrapped(" ".join(part.split()), "") for part in paragraphs)
    return text + "\n\n" + "\n".join(_wrapped(words, f"{key:19}") for key, words in rows.items())


def _wrapped(words: str, head: str) -> str:
    """``words`` in lines of `WIDTH`: ``head`` before the first one, an indent before the others."""
    return fill(
        words, WIDTH, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False
    )
