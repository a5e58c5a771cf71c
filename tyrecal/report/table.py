"""Tables for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich import table as rich
from rich.text import Text

from ..studies.result import Cell, Column, Deviation, Table
from .words import CLOSE, FAR

EMPTY_CELL = "-"


def shown(table: Table, *sections: Table) -> rich.Table:
    """What a terminal prints: a table, others as sections of it."""
    found = _empty(table)
    for each in (table, *sections):
        if each is not table:
            found.add_section()
            if each.columns:
                found.add_row(*(Text(column.name, "bold") for column in each.columns))
        for row in each.rows:
            found.add_row(*map(_cell, row))
    return found


def _empty(table: Table) -> rich.Table:
    # figures never break: on a narrow terminal only names and words do
    made = rich.Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1), pad_edge=False, show_edge=False)
    made.title, made.caption = table.title or None, table.caption or None
    for column in table.columns:
        figures = bool(column.form)
        made.add_column(
            Text(column.name),
            justify="right" if figures else "left",
            no_wrap=figures,
            overflow="fold",
        )
    return made


def _cell(cell: Cell) -> Text:
    # square brackets of names and labels are markup to rich unless they come as Text
    if isinstance(cell, Deviation):
        off = abs(cell.percent)
        colour = "green" if off < CLOSE else "yellow" if off < FAR else "red"
        return Text(f"{cell.percent:+.2f}", colour)
    return Text(EMPTY_CELL if cell is None else cell)


def solvers_table(solvers: Sequence[Mapping[str, Any]]) -> Table:
    """The installed solvers and what they can do, or why they cannot."""
    rows = [
        [
            each["name"],
            each["version"] or "",
            each["dialect"] or "",
            each["problem"] or ", ".join(each["capabilities"]),
        ]
        for each in solvers
    ]
    return Table([Column(name, "") for name in ("solver", "version", "decks", "can do")], rows)


def signatures_table(effects: Sequence[Mapping[str, Any]]) -> Table:
    """How far each effect of effects.json moves the modes, and the variables that follow it."""
    percents = Column("before %"), Column("after %")
    absorbed = Column("absorbed %", ".1f", 100.0)
    size, mass = Column("size", "g"), Column("kg", "+.2f")
    names = [Column(name) for name in effects[0]["refitted"]]
    rows = [
        [
            each["id"],
            size.cell(each["value"]),
            each["unit"],
            mass.cell(each["mass_kg"]),
            *map(percents[0].cell, (each["before_percent"], each["after_percent"])),
            absorbed.cell(each["absorbed"]),
            *map(_moved, each["refitted"].values()),
        ]
        for each in effects
    ]
    caption = (
        "rms change of all modes, as it comes and after the best linear re-fit of the variables;"
        " how far that moves them"
    )
    columns = [Column("effect", ""), size, Column("unit", ""), mass, *percents, absorbed, *names]
    return Table(columns, rows, caption=caption)


def _moved(change: Mapping[str, float]) -> str:
    before, after = change["before"], change["after"]
    return f"{100 * (after / before - 1):+.1f} %" if before else f"{after - before:+.3g}"


def effects_table(effects: Sequence[Mapping[str, Any]]) -> Table:
    """The catalogue of effects: parameter's range, solvers that can express it."""
    ends = Column("from", "g"), Column("to", "g")
    words = [Column(name, "") for name in ("effect", "what", "unit", "solvers")]
    rows = [
        [
            each["id"],
            each["title"],
            *(end.cell(each[key]) for end, key in zip(ends, ("low", "high"), strict=True)),
            each["unit"],
            ", ".join(each["solvers"]),
        ]
        for each in effects
    ]
    return Table([*words[:2], *ends, *words[2:]], rows)
