"""Objects in Python and in notebooks: few lines, tables, data frames and figures of every study."""

from __future__ import annotations

import builtins
import csv
import io
from collections.abc import Iterator
from html.parser import HTMLParser
from math import ceil
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import tyrecal
from tyrecal.api import _evaluator
from tyrecal.errors import InputError
from tyrecal.report.html.results import read_results
from tyrecal.studies import STUDIES
from tyrecal.studies.result import Result
from tyrecal.tyre.resolve import resolved

from ..conftest import CASES
from ..report.html import toy

CASE = CASES / "p235_75r17.yaml"
MOST_LINES, WIDTH = 20, 100


def lines(text: str) -> int:
    return sum(max(1, ceil(len(line) / WIDTH)) for line in text.splitlines())


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Result]:
    """One result of each study."""
    return read_results(toy.write(tmp_path_factory.mktemp("notebook") / "toy")).studies


@pytest.fixture(scope="module")
def objects(results: dict[str, Result]) -> dict[str, Any]:
    """Objects that functions of `tyrecal` return, and a result of each study."""
    case = tyrecal.load_case(CASE, mesh="coarse")
    tyre, evaluator = resolved(case), _evaluator(case, "", None)
    design = evaluator.design
    public: dict[str, Any] = {"case": case, "tyre": tyre, "evaluator": evaluator, "design": design}
    public |= {"mode": tyrecal.evaluate_modes(case)[0], "effects": tyrecal.list_effects()}
    public["state"] = tyrecal.sweep_pressure(case, 200)[0]
    public["fit"] = tyrecal.fit_case(case, fixed=["C10", "A_carcass"], method="gauss-newton")
    public["diagnosis"] = tyrecal.diagnose_case(
        case, CASES / "p235_75r17_wheeler.csv", effects="rim_width"
    )
    public["emulator"] = tyrecal.emulate(case, reach=0.1, evaluations=8)
    return public | results


def named_parts(name: str, thing: Any) -> Iterator[tuple[str, Any]]:
    """An object, and what its public attributes hold; the first entry of a collection, whose
    length is the user's own."""
    yield name, thing
    for key in getattr(type(thing), "model_fields", None) or getattr(thing, "__dict__", {}):
        value = getattr(thing, key)
        if isinstance(value, dict):
            value = next(iter(value.values()), None)
        elif isinstance(value, list | tuple):
            value = next(iter(value), None)
        if not key.startswith("_") and not isinstance(value, np.ndarray | str):
            yield f"{name}.{key}", value


def test_there_is_a_result_of_every_study(results: dict[str, Result]) -> None:
    assert {*STUDIES} - {*results} <= {"labels", "sensors"}


@pytest.mark.slow
def test_no_public_object_fills_the_screen(objects: dict[str, Any]) -> None:
    long = {
        place: lines(repr(each))
        for name, thing in objects.items()
        for place, each in named_parts(name, thing)
        if lines(repr(each)) > MOST_LINES
    }
    assert not long


class Tags(HTMLParser):
    """Counts of tags, and whether each is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.counts: dict[str, int] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)
        self.counts[tag] = self.counts.get(tag, 0) + 1

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_tables_in_a_notebook_are_those_of_the_terminal(results: dict[str, Result]) -> None:
    for result in results.values():
        tags = Tags(result._repr_html_())
        tables = result.tables()
        assert not tags.open and tags.counts.get("table", 0) == len(tables)
        cells = sum(len(row) for table in tables for row in table.rows)
        assert tags.counts.get("td", 0) == cells
        assert tags.counts.get("th", 0) == sum(len(table.columns) for table in tables)


def test_a_name_is_no_markup() -> None:
    """A material or effect may have any name."""
    from tyrecal.studies.notebook import _html
    from tyrecal.studies.result import Column, Table

    text = _html(Table([Column("<b>", "")], [["a<script>"]], caption="&"))
    assert "&lt;script&gt;" in text and "<b>" not in text and "&amp;" in text


def test_data_frames_are_the_csv_files(results: dict[str, Result]) -> None:
    pytest.importorskip("pandas")
    seen = 0
    for result in results.values():
        for name, text in result.csv_texts().items():
            frame, rows = result.to_dataframe(name), [*csv.reader(io.StringIO(text))]
            assert [*frame.columns] == rows[0] and len(frame) == len(rows) - 1
            for column, cells in zip(rows[0], zip(*rows[1:], strict=True), strict=True):
                if frame[column].dtype == float:
                    assert [*frame[column].dropna()] == [float(cell) for cell in cells if cell]
            assert result.texts()[f"{name}.csv"] == text
            seen += 1
        with pytest.raises(InputError, match="no table 'nothing'"):
            result.to_dataframe("nothing")
    assert seen > len(results)


def test_pandas_is_named_where_it_is_missing(
    results: dict[str, Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    load = builtins.__import__

    def without(name: str, *others: Any) -> Any:
        if name == "pandas":
            raise ImportError
        return load(name, *others)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pandas: run pip install '\.\[notebook\]'"):
        results["modes"].to_dataframe()


WITHOUT_FIGURE = {"modes", "diagnose", "sensors"}  # theirs need more than the result


def test_figures_are_those_of_the_page(results: dict[str, Result]) -> None:
    for name, result in results.items():
        if name in WITHOUT_FIGURE:
            with pytest.raises(InputError, match="no figure"):
                result.plot()
            continue
        figure = result.plot()
        assert isinstance(figure, Figure) and figure.axes
    assert figure._repr_png_().startswith(b"\x89PNG")
