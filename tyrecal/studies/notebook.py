"""How results show themselves in Python and in notebooks: in few lines, as tables, data frames and
figures.

`Result` and what holds one inherit `Notebook`. Tables are those of the terminal, data frames those
of the CSV files, figures those of the page: a study adds nothing for it.
"""

from __future__ import annotations

import io
from html import escape
from importlib import import_module
from textwrap import shorten
from typing import Any

from ..errors import InputError
from ..tyre.case.mistakes import suggestion

MAX_SENTENCES, MAX_REPR_LINE = 8, 100  # of a repr, and of each of its lines
NEEDS_PANDAS = (
    "to_dataframe needs the package pandas: run pip install '.[notebook]' in a clone of tyrecal"
)


class Notebook:
    """Object that shows a result: itself, or the one that it holds."""

    @property
    def shown(self) -> Any:
        """The `Result` that is shown."""
        raise NotImplementedError

    def __repr__(self) -> str:
        result = self.shown
        origin = f" ({result.provenance})" if result.provenance else ""
        lines = [f"{type(self).__name__}: {result.heading}{origin}"]
        lines += result.summary()[:MAX_SENTENCES]
        tables = ", ".join(result.csv_texts())
        lines += [f"tables: {tables}"] if tables else []
        return "\n  ".join(shorten(line, MAX_REPR_LINE, placeholder=" ...") for line in lines)

    __str__ = __repr__

    def _repr_html_(self) -> str:
        result = self.shown
        sentences = "".join(f"<p>{escape(each)}</p>" for each in result.summary())
        return f"<h4>{escape(result.heading)}</h4>{sentences}" + "".join(
            map(_html, result.tables())
        )

    def to_dataframe(self, table: str = "") -> Any:
        """A table of the result as a pandas data frame, all digits, in the units of its columns.

        table: the name of its CSV file, such as ``sweep_modes``; by default the first one. Raises
        InputError where pandas is not installed, or there is no such table.
        """
        texts = self.shown.csv_texts()
        name = table or next(iter(texts), "")
        if name not in texts:
            raise InputError(f"{self.shown.study} has no table '{table}'{suggestion(table, texts)}")
        try:
            import pandas
        except ImportError:
            raise InputError(NEEDS_PANDAS) from None
        return pandas.read_csv(io.StringIO(texts[name]), engine="python")  # Python reads all digits

    def plot(self, name: str = "") -> Any:
        """A Matplotlib figure of the result, as its page has it; ``name``: which one, by default
        the first. Raises InputError where there is no such figure."""
        result = self.shown
        module, _, function = result.figures.partition(":")
        drawn = getattr(import_module(module), function)(result) if module else {}
        name = name or next(iter(drawn), "")
        if name not in drawn:
            raise InputError(f"{result.study} has no figure '{name}'{suggestion(name, drawn)}")
        return drawn[name]


def _html(table: Any) -> str:
    words = ": ".join(filter(None, (table.title, table.caption)))
    caption = f"<caption>{escape(words)}</caption>" if words else ""
    heads = "".join(f"<th>{escape(column.name)}</th>" for column in table.columns)
    rows = [heads, *("".join(map(_cell, row)) for row in table.rows)]
    return f"<table>{caption}{''.join(f'<tr>{row}</tr>' for row in rows if row)}</table>"


def _cell(cell: Any) -> str:
    """A cell of a `Table`: nothing, a text, or a value with its change in per cent."""
    if cell is None or isinstance(cell, str):
        return f"<td>{escape(cell or '')}</td>"
    return f"<td>{escape(f'{cell.value} {cell.percent:+z.2f}'.strip())}</td>"
