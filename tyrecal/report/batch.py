"""Tables of a batch: what is not as it should be, and what drifted.

They show a result of `batch.run` and a drift of `batch.drift`, as batch.json holds them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from ..simulate.modes.label import in_words

MAX_ROWS = 40  # cases in the table, and in that of the drift
FIGURES = ("baseline", "now", "change", "allowed")
OUTCOME_COLOURS = {"error": "red", "failed": "red", "skipped": "yellow"}


def failures_table(result: Mapping[str, Any]) -> Table | None:
    """Studies that are not good; None where there are none."""
    table = _table("case", "study", "status", "why")
    rows: dict[tuple[str, str, str], list[str]] = {}  # studies that say the same share a row
    for case in result["cases"]:
        for study, entry in case["studies"].items():
            if entry["status"] != "good":
                key = case["name"], entry["status"], entry["words"] or ""
                rows.setdefault(key, []).append(study)
    for (name, status, words), studies in list(rows.items())[:MAX_ROWS]:
        shown = Text(status, OUTCOME_COLOURS[status])
        table.add_row(Text(name), ", ".join(studies), shown, Text(words))
    return _with_rest(table, len(rows))


def drift_table(drift: Mapping[str, Any]) -> Table | None:
    """Numbers that drifted, the worst first; None where there are none."""
    table = _table("case", "study", "quantity", *FIGURES)
    for each in drift["drifted"][:MAX_ROWS]:
        old, new, allowed = each["baseline"], each["value"], each["allowed"]  # in one unit
        table.add_row(
            Text(each["case"]),
            each["study"],
            Text(in_words(each["quantity"])),
            f"{old:.6g}",
            "gone" if new is None else f"{new:.6g}",
            "" if new is None else _share(new - old, old, sign="+"),
            _share(allowed, old),
        )
    return _with_rest(table, len(drift["drifted"]))


def _table(*columns: str) -> Table:
    """An empty table with right-aligned columns of figures."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1), pad_edge=False, show_edge=False)
    for name in columns:
        figures = name in FIGURES
        table.add_column(
            name, justify="right" if figures else "left", no_wrap=figures, overflow="fold"
        )
    return table


def _share(change: float, of: float, sign: str = "") -> str:
    """A change in per cent of the baseline, or as it is where that is 0."""
    return f"{100 * change / abs(of):{sign}.3g} %" if of else f"{change:{sign}.3g}"


def _with_rest(table: Table, rows: int) -> Table | None:
    if rows > MAX_ROWS:
        table.caption = f"and {rows - MAX_ROWS} more, all of them in batch.json"
    return table if rows else None
