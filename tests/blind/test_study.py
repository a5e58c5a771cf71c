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

from ..studies.blind_least_squares import STUDIES, errors, unpacked

LEAST_SQUARES = {  # errors held out without and with the effect, %, shrinkage, by chance
    "blind_study_1": (1.70, 0.47, 0.74, 0.68),
    "blind_study_2": (1.66, 0.43, 0.76, 0.64),
    "blind_study_2_second_maker": (1.51, 0.39, 0.72, 0.48),
}


@pytest.fixture(scope="module", params=STUDIES, ids=[study.name for study in STUDIES])
def study(request: pytest.FixtureRequest) -> Path:
    """Its folder."""
    folder: Path = request.param
    return folder


@pytest.fixture(scope="module")
def trials(study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study as it lay before the answerer, then with answers; the truth beside it."""
    folder = tmp_path_factory.mktemp("study") / "trials"
    unpacked(study, folder)
    return folder


@pytest.fixture(scope="module")
def scored(trials: Path) -> list[Scored]:
    return score(trials, trials.with_name("trials-truth"))


@pytest.mark.slow
def test_calibrated_as_usual_the_error_shrinks_too(
    study: Path, trials: Path, scored: list[Scored]
) -> None:
    by_kind = errors(trials, scored)
    before, after = 100 * np.median(by_kind["effect"], 0)
    shrinks, chance = (1 - by_kind[kind][:, 1] / by_kind[kind][:, 0] for kind in ("effect", "none"))
    got = before, after, np.median(shrinks), np.quantile(chance, 0.95)
    assert got == pytest.approx(LEAST_SQUARES[study.name], abs=0.006)


def alike(computed: Any, stated: Any, where: str = "") -> None:
    """Plain data that is the same, numbers to 1e-6."""
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
        assert computed == pytest.approx(stated, rel=1e-6, abs=1e-9), where


@pytest.mark.slow
def test_the_study_says_what_is_on_record(study: Path, trials: Path, scored: list[Scored]) -> None:
    figures = summary(scored)
    words = page(figures, read_protocol(trials).maker)
    figures.pop("misses")
    alike(figures, json.loads((study / "score.json").read_text()))
    recorded = (study / "RESULT.md").read_text()
    assert words.splitlines()[:12] == recorded.splitlines()[:12]


def test_another_answer_breaks_the_hash(trials: Path) -> None:
    path = sorted((trials / "answers").glob("*.json"))[0]
    kept = path.read_text()
    path.write_text(kept.replace('"no_gap"', '"named"').replace('"undecided"', '"named"') + " ")
    with pytest.raises(InputError, match="changed after they were hashed"):
        score(trials, trials.with_name("trials-truth"))
    path.write_text(kept)
