"""Structure of the page: order, numbers of figures and tables, downloads, units, nothing empty."""

from __future__ import annotations

import csv
import io
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from tyrecal.report.html.page import environment, page
from tyrecal.report.html.parts import Block, PageTable, Paragraphs
from tyrecal.report.html.results import read_results
from tyrecal.studies import STUDIES
from tyrecal.studies.result import Column, Table

from . import toy
from .test_page import DATA, ROOT, VOID, words_of

FILLED_BY_SCRIPT = {"canvas", "script"}
MAY_BE_EMPTY = {"td", "span", "g", "defs"}  # cells without a value, bars, parts of pictures
NAMELESS = ("page.html.j2", "blocks.html.j2", "viewer.html.j2", "page.py", "parts.py")


class Elements(HTMLParser):
    """Elements in their order: tag, attributes, own text, and the number of inner elements."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.all: list[dict[str, object]] = []
        self.open: list[dict[str, object]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        element: dict[str, object] = {"tag": tag, **dict(attrs), "text": "", "inner": 0}
        for each in self.open[-1:]:
            each["inner"] = 1
        self.all.append(element)
        if tag not in VOID:
            self.open.append(element)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            self.open.pop()

    def handle_data(self, data: str) -> None:
        for each in self.open:
            each["text"] = f"{each['text']}{data}"

    def texts(self, *tags: str) -> list[str]:
        chosen = [each for each in self.all if each["tag"] in tags]
        return [" ".join(str(each["text"]).split()) for each in chosen]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return toy.write(tmp_path_factory.mktemp("structure") / "results")


@cache
def elements_of(*folders: Path) -> Elements:
    return Elements(page([read_results(each) for each in folders]))


def folders(folder: Path, count: int) -> list[Path]:
    return [folder, toy.write(folder.parent / "other")][:count]


@pytest.mark.parametrize("count", [1, 2])
def test_contents_are_the_headings_in_order(folder: Path, count: int) -> None:
    tags = elements_of(*folders(folder, count))
    ids = {each["id"]: at for at, each in enumerate(tags.all) if "id" in each}
    start = next(at for at, each in enumerate(tags.all) if each["tag"] == "nav")
    end = next(at for at, each in enumerate(tags.all) if each["tag"] == "main")
    links = [str(each["href"])[1:] for each in tags.all[start:end] if each["tag"] == "a"]
    assert [ids[link] for link in links] == sorted(ids[link] for link in links)
    listed = [" ".join(str(e["text"]).split()) for e in tags.all[start:end] if e["tag"] == "a"]
    assert listed == tags.texts("h2")
    assert links[0] == "summary" and links[-1] == "provenance"


@pytest.mark.parametrize("count", [1, 2])
def test_figures_and_tables_are_numbered_once_in_order(folder: Path, count: int) -> None:
    tags = elements_of(*folders(folder, count))
    for word, tag, holder in (("Figure", "figcaption", "figure"), ("Table", "caption", "table")):
        captions = [text for text in tags.texts(tag) if text.startswith(word)]
        numbers = [int(text.split()[1].rstrip(".")) for text in captions]
        assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) > 10 * count
        assert all(len(text) > len("Figure 99. ") for text in captions)
        held = [e for e in tags.all if e["tag"] == holder and "bars" not in str(e.get("class"))]
        assert len(held) == len(numbers)


def test_key_figures_and_a_picture_come_first_and_provenance_last(folder: Path) -> None:
    words = words_of(page([read_results(folder)]))
    key = "33.13 → 8.60 Hz", "+5.1 %", "12.50 kg", "rim width"
    places = [words.index(each) for each in key]
    assert max(places) < words.index("Figure 1.") < words.index("Table 1.")
    assert words.index("What the model lacks") < words.index("Figure 1.")
    assert words.rindex("0123456789abcdef") > words.rindex("Figure ")


def test_nothing_is_empty(folder: Path) -> None:
    for each in elements_of(folder).all:
        tag, kind = str(each["tag"]), each.get("class")
        if tag in VOID | FILLED_BY_SCRIPT | MAY_BE_EMPTY or kind in ("shown", "gallery"):
            continue
        assert str(each["text"]).strip() or each["inner"], each


def test_every_table_is_a_file_to_download(folder: Path) -> None:
    """In the page itself, with all digits where the study writes such a file."""
    tags = elements_of(folder)
    links = [each for each in tags.all if str(each.get("href", "")).startswith(DATA)]
    texts = {str(e["download"]): unquote(str(e["href"]).removeprefix(DATA)) for e in links}
    captions = [each for each in tags.all if each["tag"] == "caption"]
    assert sum("csv" in str(each["text"]) for each in captions) == len(captions) <= len(links)
    for name, text in texts.items():
        rows = list(csv.reader(io.StringIO(text)))
        assert len(rows) > 1 and len({len(row) for row in rows}) == 1, name
    results = read_results(folder)
    written = {n: t for each in results.studies.values() for n, t in each.texts().items()}
    whole = {name for name in texts if texts[name] == written.get(name)}
    assert {"fit.csv", "fit_variables.csv", "sample.csv", "diagnosis_section.csv"} <= whole
    assert texts["fit_history.csv"] == (folder / "fit_history.csv").read_text()


def test_numbers_have_one_unit_and_no_zero_a_sign(folder: Path) -> None:
    words = words_of(page([read_results(folder)]))
    assert "0.36 mm²" in words and "0.8 MPa" in words
    assert not re.search(r"[-\u2212]0(\.0+)?(?![.\d])", words)
    assert not re.search(r"\d m2\b|\d m²", words)
    rows = [text for text in elements_of(folder).texts("tr") if re.match("A_belt|C10", text)]
    assert len(rows) > 3 and not [text for text in rows if re.search(r"\de[-+\u2212]?\d", text)]


def block_of(block: Block) -> Elements:
    module: Any = environment().get_template("blocks.html.j2").module
    return Elements(module.block(block, ""))


@pytest.mark.parametrize(("columns", "many"), [(16, False), (17, True)])
def test_a_table_of_many_columns_is_set_smaller(columns: int, many: bool) -> None:
    table = Table([Column("Hz")] * columns, [["1.0"] * columns])
    tags = block_of(PageTable(table, "caption", "a.csv", "text"))
    (shown,) = (str(each["class"]).split() for each in tags.all if each["tag"] == "table")
    assert ("many" in shown) == many


def test_findings_are_a_list_and_headings_are_none() -> None:
    for kind, tag in (("findings", "li"), ("heading", "h3"), ("facts", "p")):
        tags = block_of(Paragraphs(kind, ["one", "two"]))
        assert tags.texts(tag) == ["one", "two"]
        assert {e["tag"] for e in tags.all} == {tag} | ({"ul"} if tag == "li" else set())


def test_the_page_knows_no_study_by_name() -> None:
    places = [*(ROOT / "templates/report").iterdir(), *(ROOT / "tyrecal/report/html").iterdir()]
    chosen = [path for path in places if path.name in NAMELESS]
    assert len(chosen) == len(NAMELESS)
    for path in chosen:
        quoted = set(re.findall(r"[\"']([a-z-]+)[\"']", path.read_text()))
        assert not quoted & STUDIES.keys(), path.name
