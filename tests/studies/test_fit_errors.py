"""The record of stated errors is counted as its page states."""

from __future__ import annotations

import json

from ..conftest import ROOT
from .fit_errors import table

BENCHMARKS = ROOT / "tests" / "benchmarks"


def test_what_a_90_percent_interval_holds_is_counted() -> None:
    one = {
        "size": "a",
        "chi2_per_dof": 1.0,
        "variables": {"C10": [3.0, 1.0]},
        "modes": {"[1,0]": 2},
    }
    other = {
        "size": "a",
        "chi2_per_dof": 2.0,
        "variables": {"C10": [-4.0, -1.7]},
        "modes": {"[1,0]": -1},
    }
    rows = list(table([one, other]))
    assert "| a | C10 | 1 of 2 | 3.54 | 1.39 |" in rows
    assert (
        "| a | [1,0] | 1 of 2 |  | 1.58 |" in rows
        and "| a | all modes | 1 of 2 |  | 1.58 |" in rows
    )
    assert rows[-1] == "a: 2 tyres, chi2/dof 1.50 on average"


def test_the_page_states_the_counts_of_the_record() -> None:
    page = (BENCHMARKS / "VERDICTS.md").read_text()
    lines = [json.loads(x) for x in (BENCHMARKS / "fit_errors.jsonl").read_text().splitlines()]
    rows = [row.strip("| ").split(" | ")[:3] for row in table(lines) if row[0] == "|"]
    held = {(size, name): count for size, name, count in rows[2:]}
    tyre, prior = "P235/75R17", "P235/75R17, --prior"
    names = ["all modes", "[1,1]", "A_belt", "C10", "A_carcass"]
    counts = [held[prior, name] for name in names]
    unsure = [f"{name}, said not to hold" for name in ("A_belt", "C10", "A_carcass")]
    counts += [held[tyre, name] for name in ("all modes", "[4,0]", "C10", *unsure)]
    for size in ("205/60R15, --prior", "225/45R17, --prior"):
        names = ["all modes", "A_belt", "A_carcass", "C10_sidewall", "C10_tread"]
        counts += [held[size, name] for name in names]
    for count in counts:
        assert count in page, count
