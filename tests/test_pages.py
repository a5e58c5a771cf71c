"""Figures of the pages on the paper and on real data are those that the tool computes; links of all
documents lead somewhere, and a page on recorded studies stays short."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.studies.fit.calibrate import calibrate
from tyrecal.studies.fit.problem import objective
from tyrecal.studies.fit.targets import read_targets
from tyrecal.studies.labelling.label import fitted_prior, label
from tyrecal.studies.labelling.result import labels_posterior
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

from .conftest import CASES
from .studies.both_columns import COLUMNS, PAPER_HZ
from .studies.pages import differences, recorded

NUMBER = re.compile(r"[+\-]?\d+(?:\.\d+)?")
ROOT = CASES.parent
BENCHMARKS = ROOT / "tests" / "benchmarks"
DOCUMENTS = sorted(
    document
    for folder in (".", ".github", "cases", "solvers", "tests", "tests/benchmarks")
    for document in (ROOT / folder).glob("*.md")
) + sorted((BENCHMARKS / "records").glob("*.md"))
MAX_PAGE_WORDS = 1500


def rows(page: str, start: str) -> list[list[str]]:
    """Cells of the lines of a page's table that begin so, plain."""
    text = (CASES / page).read_text(encoding="utf-8")
    plain = text.replace("\N{MINUS SIGN}", "-").replace("*", "")
    lines = re.findall(rf"^\| ({start}.*?) \|$", plain, re.M)
    return [re.split(r" ?\| ", line) for line in lines]


def figure(cell: str) -> float:
    """The first number."""
    match = NUMBER.search(cell)
    assert match, cell
    return float(match[0])


def frequencies(values: Mapping[str, float]) -> dict[Label, float]:
    """Frequencies of the paper's tyre."""
    case = load_case(CASES / "p235_75r17.yaml")
    answer = Evaluator(TyreDesign(case)).evaluate(Question(values))
    return {mode.label: mode.frequency_Hz for mode in paired_labels(answer.modes)}


def test_table_2_of_the_page_on_the_paper() -> None:
    """Both columns, deviations and changes; equation (1) of both."""
    targets = read_targets(load_case(CASES / "p235_75r17.yaml"))
    start = start_values(load_case(CASES / "p235_75r17.yaml"))
    hertz = [frequencies({**start, **column}) for column in COLUMNS]
    printed = rows("paper.md", r"\[\d,\d\]")
    for target, cells, paper in zip(targets, printed, np.transpose(PAPER_HZ), strict=True):
        ours = [each[target.label] for each in hertz]
        assert cells[0].split()[0] == f"[{target.label.c},{target.label.m}]"
        expected = [
            *(
                x
                for pair in zip(paper, ours, strict=True)
                for x in (*pair, 100 * pair[1] / pair[0] - 100)
            ),
            100 * paper[1] / paper[0] - 100,
            100 * ours[1] / ours[0] - 100,
        ]
        for cell, value in zip(cells[1:], expected, strict=True):
            assert figure(cell) == pytest.approx(value, abs=0.06 if "%" in cell else 0.006), cells
    (last,) = rows("paper.md", r"equation \(1\), Hz")
    assert [figure(last[i]) for i in (2, 5)] == [
        pytest.approx(objective(each, targets), abs=0.006) for each in hertz
    ]


def test_every_figure_is_the_recorded_one_rounded() -> None:
    """The record is that of the last run of `python -m tests.studies.pages FOLDER`."""
    assert not list(differences(recorded()))


@pytest.mark.slow
@pytest.mark.numbers
def test_labels_of_the_page_on_real_data() -> None:
    """Labels that the fitted 205/60R15 gives to six frequencies without labels."""
    case = load_case(CASES / "205_60r15.yaml")
    evaluator = Evaluator(TyreDesign(case))
    fixed = {"A_belt": case.case.variables["A_belt"].start}
    fit = calibrate(case, evaluator, fixed=fixed).found
    readings = read_measurements(CASES / "205_60r15_vervoort.csv", labelled=False)
    labelled = label(case, evaluator, readings, fitted_prior(case, fit), fixed=fixed)
    table = rows("real_data.md", r"\d{3}")
    for cells, frequency in zip(table, labels_posterior(case, labelled).frequencies, strict=True):
        assert figure(cells[0]) == frequency.frequency_Hz and cells[1] == frequency.display
        assert figure(cells[2]) == pytest.approx(frequency.expected_Hz, abs=0.06)
        off = 100 * (frequency.expected_Hz or 0.0) / frequency.frequency_Hz - 100
        assert figure(cells[3]) == pytest.approx(off, abs=0.06)
        assert figure(cells[4]) == pytest.approx(100 * frequency.probability, abs=1.0)


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
    assert len(page.read_text(encoding="utf-8").split()) <= MAX_PAGE_WORDS


def test_notes_on_recorded_studies_have_a_page() -> None:
    for notes in (BENCHMARKS / "records").glob("*.md"):
        assert (BENCHMARKS / notes.name).exists(), notes
