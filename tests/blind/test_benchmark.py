"""The benchmark for other methods: what it imports, its score by hand, and against the full one."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

from tyrecal.studies.blind.score import score as full_score
from tyrecal.studies.blind.statistics import clopper_pearson
from tyrecal.studies.blind.tables import summary

from ..benchmarks.blind import benchmark
from .archive import unpack

PAGE = Path(__file__).parents[1] / "benchmarks" / "BENCHMARK.md"
TRUTH = [
    {"trial": "a", "kind": "effect", "effect": "x", "band": "30", "group": "x y"},
    {"trial": "b", "kind": "effect", "effect": "z", "band": "5", "group": "z"},
    {"trial": "c", "kind": "none", "effect": "", "band": "0", "group": "none"},
    {"trial": "d", "kind": "outside", "effect": "law", "band": "40", "group": "outside"},
]


def test_it_needs_the_standard_library_and_numpy_alone() -> None:
    tree = ast.parse(Path(benchmark.__file__).read_text(encoding="utf-8"))
    names = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    names |= {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert {name.partition(".")[0] for name in names} <= {*sys.stdlib_module_names, "numpy"}


def test_an_entry_is_scored_by_hand(tmp_path: Path) -> None:
    """a: an effect that looks like the true one; b: missing; c: accused; d: recognised."""
    entry = tmp_path / "entry.csv"
    rows = [
        ("a", "y", 0.6),
        ("a", "x", 0.4),
        ("c", "x", 0.9),
        ("c", "none", 0.1),
        ("d", "outside", 1),
    ]
    benchmark.write(entry, ["trial", "explanation", "probability"], rows)
    figures = benchmark.score(entry, TRUTH)
    assert figures["effect, all"] == (1, 2) and figures["effect, from 25"] == (1, 1)
    assert figures["effect, from 4"] == (0, 1) and figures["effect, from 0"] == (0, 0)
    assert figures["none, named an effect"] == (1, 1) and figures["none, right"] == (0, 1)
    assert figures["named, right"] == (0, 1) and figures["outside, right"] == (1, 1)
    brier = 2 * 0.6**2 + 1 + 2 * 0.9**2
    assert figures["Brier score"] == (pytest.approx(brier), 4)


@pytest.mark.parametrize("right, count", [(0, 80), (4, 200), (80, 80), (7, 9)])
def test_its_bounds_are_those_of_clopper_and_pearson(right: int, count: int) -> None:
    assert benchmark.bounds(right, count) == pytest.approx(clopper_pearson(right, count), abs=1e-9)


@pytest.mark.slow
def test_it_counts_as_the_full_score_does(tmp_path: Path) -> None:
    """On the 140 trials of the second maker."""
    group = benchmark.GROUPS[1]
    unpack(group, tmp_path / group)
    trials = full_score(tmp_path / group, tmp_path / f"{group}-truth")
    ids = {each.id for each in trials}
    rows = [row for row in benchmark.recorded() if row[0] in ids]
    benchmark.write(tmp_path / "t.csv", ["trial", "explanation", "probability"], rows)
    truth = [row for row in benchmark.read(benchmark.HERE / "truth.csv") if row["trial"] in ids]
    figures, full = benchmark.score(tmp_path / "t.csv", truth), summary(trials)
    for band in full["by_band"]:
        right, count = figures[f"effect, from {band['low']:g}"]
        assert (right, count) == (band["top_1_group"]["right"], band["top_1_group"]["count"])
    assert figures["Brier score"][0] / len(ids) == pytest.approx(full["brier"], abs=1e-3)


@pytest.mark.slow
def test_the_page_has_the_table_that_the_commands_give(tmp_path: Path) -> None:
    benchmark.main("unpack", str(tmp_path))
    assert not list(tmp_path.rglob("*truth*"))
    benchmark.main("baseline", str(tmp_path), str(tmp_path / "baseline.csv"))
    benchmark.main("tyrecal", str(tmp_path / "tyrecal.csv"))
    table = benchmark.table([tmp_path / "baseline.csv", tmp_path / "tyrecal.csv"])
    assert table in PAGE.read_text(encoding="utf-8")
