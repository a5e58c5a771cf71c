"""The recorded blind studies, scored again from their data: seals, hashes, every figure."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.studies.blind.protocol import read_protocol
from tyrecal.studies.blind.score import Scored, score
from tyrecal.studies.blind.tables import page, summary

from ..benchmarks.blind import benchmark
from ..studies.blind_least_squares import errors
from .archive import ARCHIVE, STUDIES, digits, packed_bytes, unpack

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
    figures = summary(scored)
    words = page(figures, read_protocol(trials).maker)
    figures.pop("misses")
    alike(figures, json.loads((ARCHIVE / f"{study}.json").read_text()))
    recorded = (ARCHIVE / f"{study}.md").read_text()
    assert words.splitlines()[:12] == recorded.splitlines()[:12]


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
