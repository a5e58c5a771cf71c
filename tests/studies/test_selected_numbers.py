"""The record of selected numbers is counted as its page states, and a part of it is drawn anew."""

from __future__ import annotations

import json

import pytest

from ..conftest import ROOT
from .sensitivities import is_right, study, table

BENCHMARKS = ROOT / "tests" / "benchmarks"
LINES = [json.loads(x) for x in (BENCHMARKS / "sensitivities.jsonl").read_text().splitlines()]


def test_the_page_states_the_counts_of_the_record() -> None:
    page = (BENCHMARKS / "VERDICTS.md").read_text()
    rows = list(table(LINES))[2:]
    assert len(rows) == 2 and all(row in page for row in rows)


@pytest.mark.parametrize(
    ("off", "freed", "right"),
    [
        (["a", "b"], [["b"], ["a"]], True),
        (["a", "b"], [["c", "b"], ["a"]], True),
        (["a", "b"], [["a", "b"], ["c"]], False),
        (["a", "b"], [["a"], ["c"], ["b"]], False),
        (["a", "b"], [["a"]], False),
        ([], [], True),
        ([], [["a"]], False),
    ],
)
def test_both_numbers_are_first_or_alike(
    off: list[str], freed: list[list[str]], right: bool
) -> None:
    assert is_right({"off": off, "freed": freed}) == right


@pytest.mark.slow
def test_drawn_tyres_are_those_of_the_record() -> None:
    """The first of the one size: draws and sensitivities are the same on any machine."""
    kept = [line for line in LINES if line["size"] == "P235/75R17" and line["off"]][:4]
    drawn = list(study(4, 7, ["P235/75R17"]))[:4]
    for line, recorded in zip(drawn, kept, strict=True):
        assert line["off"] == recorded["off"]
        assert line["lambda"] == pytest.approx(recorded["lambda"], rel=1e-3)
        assert [group[0] for group in line["freed"]] == [group[0] for group in recorded["freed"]]
