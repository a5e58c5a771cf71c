"""Figures and pictures of the documents are those that the commands give, pictures by the numbers
that they draw; links lead somewhere, and a page on recorded studies stays short."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from .conftest import CASES
from .studies.page_steps import STEPS
from .studies.pages import DOCUMENTS as FIGURE_PAGES
from .studies.pages import differences, is_rounded, marked_tables, numbers, plain, recorded, run
from .studies.pictures import DRAWN, PICTURES, Drawn, draw, numbers_apart

ROOT = CASES.parent
BENCHMARKS = ROOT / "tests" / "benchmarks"
DOCUMENTS = sorted(
    document
    for folder in (".", ".github", "cases", "cases/site", "solvers", "tests", "tests/benchmarks")
    for document in (ROOT / folder).glob("*.md")
) + sorted((BENCHMARKS / "records").glob("*.md"))
MAX_PAGE_WORDS = 1500


def test_every_figure_is_the_recorded_one_rounded() -> None:
    """The record is that of the last run of `python -m tests.studies.pages FOLDER`."""
    assert not list(differences(recorded()))


@pytest.mark.slow
@pytest.mark.numbers
@pytest.mark.parametrize("step", [name for name, step in STEPS.items() if step.is_quick])
def test_a_command_gives_what_is_recorded(step: str, tmp_path: Path) -> None:
    figures, kept = run(step, tmp_path), recorded()[step]
    assert figures.keys() == kept.keys()
    assert figures == pytest.approx(kept, rel=1e-4)


@pytest.mark.parametrize("document", FIGURE_PAGES)
def test_tables_of_figures_name_their_source(document: str) -> None:
    """A table of which a third of the cells are numbers is checked, or says which file gives them;
    that file is there."""
    for table in marked_tables(document):
        for source in table.name.split(", ") if table.kind == "given" else []:
            places = [ROOT / source, *(ROOT / "tyrecal").rglob(source)]
            assert any(place.exists() for place in places), source
        cells = [cell for row in table.rows for cell in plain(row).strip("| ").split(" | ")[1:]]
        figures = [cell for cell in cells if re.match(r"[+-]?\d", cell)]
        assert table.kind or 3 * len(figures) < len(cells) or len(figures) < 2, table.rows


@pytest.mark.parametrize(
    ("printed", "value", "expected"),
    [
        ("2.6", 2.55, True),
        ("2.6", 2.549, False),
        ("2.60e-7", 2.604e-7, True),
        ("10,000", 9e3, False),
    ],
)
def test_a_printed_number_is_compared_to_its_last_digit(
    printed: str, value: float, expected: bool
) -> None:
    assert is_rounded(printed, value) == expected


def test_numbers_of_a_row_are_those_behind_its_name() -> None:
    row = "| [3,0] at 2 kN | **\N{MINUS SIGN}11.5 %** | [4,0] 13 | 1.34e-7 ± 188 % | 10,000 |"
    assert numbers(row) == ["-11.5", "13", "1.34e-7", "188", "10,000"]


def text_without_code(document: Path) -> str:
    """A document without its blocks of code."""
    return re.sub(r"```.*?```", "", document.read_text(encoding="utf-8"), flags=re.S)


def anchors(document: Path) -> set[str]:
    """Names that a link to a part of the document may have: its headings, as GitHub writes them,
    and its explicit anchors."""
    text = text_without_code(document)
    headings = re.findall(r"^#+ (.*)$", text, re.M)
    plain = [re.sub(r"\]\([^)]*\)", "]", heading).strip().lower() for heading in headings]
    names = {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}
    return names | set(re.findall(r'<a id="([^"]*)">', text))


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_a_file_and_a_heading(document: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", text_without_code(document)):
        if not link.startswith("http"):
            path, _, anchor = link.partition("#")
            target = document.parent / path if path else document
            assert target.exists(), link
            if anchor and target.suffix == ".md":
                assert anchor in anchors(target), link


@pytest.mark.parametrize("page", sorted(BENCHMARKS.glob("*.md")), ids=lambda path: path.name)
def test_a_page_on_recorded_studies_is_short(page: Path) -> None:
    shown = re.sub(r"<!--.*?-->", "", page.read_text(encoding="utf-8"))
    assert len(shown.split()) <= MAX_PAGE_WORDS


def test_notes_on_recorded_studies_have_a_page() -> None:
    for notes in (BENCHMARKS / "records").glob("*.md"):
        assert (BENCHMARKS / notes.name).exists(), notes


def test_every_picture_of_the_guides_has_a_command() -> None:
    names = [name for drawn in DRAWN for name in drawn.pictures]
    assert sorted(names) == sorted(path.name for path in PICTURES.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    "drawn",
    [drawn for drawn in DRAWN if drawn.is_quick],
    ids=lambda drawn: next(iter(drawn.pictures)),
)
def test_pictures_are_of_today(drawn: Drawn, tmp_path: Path) -> None:
    for name, path in draw(drawn, tmp_path).items():
        assert not list(numbers_apart(path, PICTURES / name)), name
