"""Every table of a study is also a CSV file of its results."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from fnmatch import fnmatch
from typing import Any

import pytest

from tyrecal.files import RESULTS
from tyrecal.report.html.results import Results, read_results
from tyrecal.studies import STUDIES

from .html import toy


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return read_results(toy.write(tmp_path_factory.mktemp("csv") / "toy"))


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def numbers(content: Any, key: str = "") -> Iterator[float]:
    if isinstance(content, dict):
        for name, each in content.items():
            yield from numbers(each, name)
    elif isinstance(content, list):
        for each in content:
            yield from numbers(each, key)
    elif isinstance(content, float) and key not in LEFT_OUT:
        yield content


# histograms, and how clear a label is: no table has them
LEFT_OUT = {"density", "box", "counts", "clarity"}
IN_TABLES = {  # key of the JSON content whose every number has to be in some CSV file
    "fit": ("variables", "modes", "states"),
    "modes": ("modes", "cavity"),
    "sweep-pressure": ("rows",),
    "sweep-load": ("rows",),
    "footprint": ("rows",),
    "sample": ("variables", "predicted"),
    "diagnose": ("probabilities", "detectability", "section_map"),
}


def test_every_number_of_a_table_is_in_a_csv(results: Results) -> None:
    for study, keys in IN_TABLES.items():
        result = results.studies[study]
        written = {name: text for name, text in result.texts().items() if name.endswith(".csv")}
        cells = {cell for text in written.values() for row in rows(text) for cell in row.values()}
        for key in keys:
            values = list(numbers(result.content().get(key, {})))
            missing = [x for x in values if repr(x) not in cells]
            assert not missing, (study, key, missing, sorted(written))


def test_every_study_with_a_table_has_a_csv_that_a_new_run_replaces(results: Results) -> None:
    assert set(results.studies) == set(STUDIES) - {"labels"}
    for study, result in results.studies.items():
        names = [name for name in result.texts() if name.endswith(".csv")]
        assert names, study
        for name in names:
            patterns = RESULTS.get(study, (f"{study}.*", f"{study}_*"))
            assert any(fnmatch(name, pattern) for pattern in patterns), name


def test_files_of_a_diagnosis_and_of_effects(results: Results) -> None:
    texts = results.studies["diagnose"].texts()
    assert rows(texts["diagnosis_probabilities.csv"])[0]["explanation"] == "rim_width"
    assert set(rows(texts["diagnosis_section.csv"])[0]) >= {"region", "evidence", "same_as"}
    first = rows(results.studies["effects"].texts()["effects_modes.csv"])[0]
    percent = first["before_percent"], first["after_percent"]
    assert (first["id"], *percent) == ("filler", "4.0", "1.5")
