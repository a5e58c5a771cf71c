"""The recorded blind studies, scored again from their data: seals, hashes, every figure."""

from __future__ import annotations

import json
import lzma
import tarfile
from pathlib import Path
from typing import Any

import pytest

from tyrecal.blind.protocol import BadTrials, read_protocol
from tyrecal.blind.score import score
from tyrecal.blind.tables import page, summary

STUDIES = sorted((Path(__file__).parents[1] / "benchmarks").glob("blind_study_*"))


@pytest.fixture(scope="module", params=STUDIES, ids=[study.name for study in STUDIES])
def study(request: pytest.FixtureRequest) -> Path:
    """Its folder."""
    folder: Path = request.param
    return folder


@pytest.fixture(scope="module")
def trials(study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study as it lay before the answerer, then with answers; the truth beside it."""
    folder = tmp_path_factory.mktemp("study") / "trials"
    folder.mkdir()
    for name in ("trials", "answers"):
        with tarfile.open(study / f"{name}.tar.xz") as archive:
            archive.extractall(folder, filter="data")
    for name in ("protocol.json", "seal.json"):
        (folder / name).write_bytes((study / name).read_bytes())
    truth = folder.with_name("trials-truth")
    truth.mkdir()
    (truth / "truth.json").write_bytes(lzma.decompress((study / "truth.json.xz").read_bytes()))
    return folder


def alike(found: Any, stated: Any, where: str = "") -> None:
    """Plain data that is the same, numbers to 1e-6."""
    if isinstance(stated, dict):
        assert found.keys() == stated.keys(), where
        for key in stated:
            alike(found[key], stated[key], f"{where}/{key}")
    elif isinstance(stated, list):
        assert len(found) == len(stated), where
        for i, pair in enumerate(zip(found, stated, strict=True)):
            alike(*pair, f"{where}/{i}")
    elif stated is None:
        assert found is None, where
    else:
        assert found == pytest.approx(stated, rel=1e-6, abs=1e-9), where


def test_the_study_says_what_is_on_record(study: Path, trials: Path) -> None:
    figures = summary(score(trials, trials.with_name("trials-truth")))
    words = page(figures, read_protocol(trials).maker)
    figures.pop("misses")
    alike(figures, json.loads((study / "score.json").read_text()))
    recorded = (study / "RESULT.md").read_text()
    assert words.splitlines()[:12] == recorded.splitlines()[:12]


def test_another_answer_breaks_the_hash(trials: Path) -> None:
    path = sorted((trials / "answers").glob("*.json"))[0]
    kept = path.read_text()
    path.write_text(kept.replace('"no_gap"', '"named"').replace('"undecided"', '"named"') + " ")
    with pytest.raises(BadTrials, match="changed after they were hashed"):
        score(trials, trials.with_name("trials-truth"))
    path.write_text(kept)
