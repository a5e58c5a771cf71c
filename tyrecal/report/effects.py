"""The catalogue of effects in words: as a table, and one effect at length."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from ..studies.effects import CatalogueEntry
from ..studies.result import Column, Table

WIDTH = 98


def effects_table(effects: Sequence[CatalogueEntry]) -> Table:
    """The catalogue of effects: parameter's range, solvers that can express it."""
    ends = Column("from", "g"), Column("to", "g")
    words = [Column(name, "") for name in ("effect", "what", "unit", "solvers")]
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
    """One effect at length."""
    unit = f" {entry.unit}" if entry.unit else ""
    size = max(entry.high, entry.low, key=abs)
    rows = {
        "parameter": f"{entry.symbol}, {entry.low:.4g} to {entry.high:.4g}{unit}; 0: absent",
        "case file": f"effects: {{{entry.id}: {size:.4g}}}",
        "in the deck": ", ".join(entry.changes),
        "modes": entry.signature,
        "proof": entry.toggle,
        "hard to tell from": ", ".join(entry.aliases) or "no other",
        "solvers": ", ".join(entry.solvers) or "none",
    }
    paragraphs = [f"{entry.title} ({entry.id})", *entry.about]
    text = "\n\n".join(_filled(" ".join(part.split()), "") for part in paragraphs)
    return text + "\n\n" + "\n".join(_filled(words, f"{key:19}") for key, words in rows.items())


def _filled(words: str, head: str) -> str:
    return fill(
        words, WIDTH, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False
    )
