"""The recorded blind studies, scored again from their data: seals, hashes, every figure.

The benchmark for other methods: what it imports, its score by hand, and against the full one.
"""

from __future__ import annotations

import ast
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.report.blind import page
from tyrecal.studies.blind.protocol import read_protocol
from tyrecal.studies.blind.score import Scored, clopper_pearson, score
from tyrecal.studies.blind.score import score as full_score

from ..benchmarks.blind import benchmark
from ..studies.blind_least_squares import errors
from .archive import ARCHIVE, STUDIES, digits, packed_bytes, unpack
from .tables import full_summary, rivals

LEAST_SQUARES = {  # errors held out without and with the effect, %, shrinkage, by chance
    "blind_study_1": (1.70, 0.47, 0.74, 0.68),
    "blind_study_2": (1.66, 0.43, 0.76, 0.64),
    "blind_study_2_second_maker": (1.51, 0.39, 0.72, 0.48),
}


@pytest.fixture(scope="module", params=STUDIES)
def study(request: pytest.FixtureRequest) -> str:
    """Its name."""
    name: str = request.param
    return name


@pytest.fixture(scope="module")
def trials(study: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study as it lay before the answerer, then with answers; the truth beside it."""
    folder = tmp_path_factory.mktemp("study") / "trials"
    unpack(study, folder)
    return folder


@pytest.fixture(scope="module")
def scored(trials: Path) -> list[Scored]:
    return score(trials, trials.with_name("trials-truth"))


@pytest.mark.slow
def test_calibrated_as_usual_the_error_shrinks_too(
    study: str, trials: Path, scored: list[Scored]
) -> None:
    by_kind = errors(trials, scored)
    before, after = 100 * np.median(by_kind["effect"], 0)
    shrinks, chance = (1 - by_kind[kind][:, 1] / by_kind[kind][:, 0] for kind in ("effect", "none"))
    got = before, after, np.median(shrinks), np.quantile(chance, 0.95)
    assert got == pytest.approx(LEAST_SQUARES[study], abs=0.006)


def alike(computed: Any, stated: Any, where: str = "") -> None:
    """Plain data that is the same, numbers to 1e-5: answers are packed to fewer digits."""
    if isinstance(stated, dict):
        assert computed.keys() == stated.keys(), where
        for key in stated:
            alike(computed[key], stated[key], f"{where}/{key}")
    elif isinstance(stated, list):
        assert len(computed) == len(stated), where
        for i, pair in enumerate(zip(computed, stated, strict=True)):
            alike(*pair, f"{where}/{i}")
    elif stated is None:
        assert computed is None, where
    else:
        assert computed == pytest.approx(stated, rel=1e-5, abs=1e-9), where


@pytest.mark.slow
def test_the_study_says_what_is_on_record(study: str, trials: Path, scored: list[Scored]) -> None:
    figures = full_summary(scored, rivals(trials))
    words = page(figures, read_protocol(trials).maker)
    figures.pop("misses")
    alike(figures, json.loads((ARCHIVE / f"{study}.json").read_text()))
    recorded = (ARCHIVE / f"{study}.md").read_text()
    assert words.splitlines()[:9] == recorded.splitlines()[:9]


def test_another_answer_breaks_the_hash(tmp_path: Path) -> None:
    unpack(STUDIES[-1], trials := tmp_path / "trials")
    path = sorted((trials / "answers").glob("*.json"))[0]
    kept = path.read_text()
    path.write_text(kept.replace('"no_gap"', '"named"').replace('"undecided"', '"named"') + " ")
    with pytest.raises(InputError, match="changed after they were hashed"):
        score(trials, trials.with_name("trials-truth"))


def test_packed_files_come_back_to_the_last_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers = (
        "1.50 -0.0 -0.25 007.5 12.345678901234567 12.345678901234567 0.1 1e-07 3.25e-10 2.0000"
    )
    files = {"a/x.json": f'{{"p": [{numbers}]}}', "b.csv": f"{numbers}\n0.30000000000000004,,é\n"}
    (tmp_path / "some.xz").write_bytes(packed_bytes(files))
    monkeypatch.setattr(benchmark, "HERE", tmp_path)
    assert dict(benchmark.archive("some")) == files
    assert list(benchmark.archive("some", "b")) == [("b.csv", files["b.csv"])]
    benchmark.packed.cache_clear()


def test_an_interval_is_shortened_outwards() -> None:
    """So that it holds what it held."""
    for low, high in ((1.23456789e-8, 2.3456784e-8), (-3.4567891, -1.2345671), (0.0, 1.5)):
        assert digits(low, "low") <= low <= digits(low, "low") + 1e-5 * abs(low)
        assert digits(high, "high") - 1e-5 * abs(high) <= high <= digits(high, "high")
    assert digits(0.44999999999999996, "low") == pytest.approx(0.45, abs=1.1e-6)


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
    figures, full = benchmark.score(tmp_path / "t.csv", truth), full_summary(trials)
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
