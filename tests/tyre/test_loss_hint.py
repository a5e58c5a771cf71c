"""Hints on compounds without a loss factor, and on Prony series used beyond their terms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.loss_hint import lossless_hint, prony_hints
from tyrecal.tyre.case.parts import Prony

from ..cli.test_cli import run
from ..conftest import CASES
from ..effects.support import coarse

CASE = coarse()


def with_rubbers(hertz: float | None, **changes: dict[str, Any]) -> LoadedCase:
    """The case with compounds that are changed copies of its own."""
    own = CASE.case.materials["rubber"]
    rubbers = {name: own.model_copy(update=change) for name, change in changes.items()}
    analysis = CASE.case.analysis.model_copy(update={"vibration_frequency_Hz": hertz})
    update = {"materials": {**CASE.case.materials, **rubbers}, "analysis": analysis}
    return replace(CASE, case=CASE.case.model_copy(update=update))


def test_compounds_without_loss_are_named_where_others_have_one() -> None:
    lossy, none = {"loss_factor": 0.1}, {"loss_factor": None}
    assert not list(lossless_hint(CASE))
    assert not list(lossless_hint(with_rubbers(None, rubber=lossy, tread=lossy)))
    (words,) = lossless_hint(with_rubbers(None, rubber=none, tread=lossy, apex={"loss_factor": 0}))
    assert words.startswith("materials.rubber, materials.apex: without loss_factor")


@pytest.mark.parametrize(
    ("hertz", "times", "words"),
    [
        (None, [0.1], ""),
        (60.0, [0.1], "terms of 1.6 Hz"),  # the usual series of a static test
        (15.0, [0.1], ""),
        (60.0, [0.1, 1e-3], ""),
        (0.1, [0.1, 1e-3], "terms of 1.6 to 1.6e+02 Hz"),
        (60.0, [], ""),
    ],
)
def test_a_prony_series_beyond_its_terms(
    hertz: float | None, times: list[float], words: str
) -> None:
    terms = [Prony(g=0.1, k=0.0, tau_s=tau) for tau in times]
    hints = list(prony_hints(with_rubbers(hertz, rubber={"prony": terms})))
    assert len(hints) == bool(words) and all(words in hint for hint in hints)


def test_validate_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("validate", str(CASES / "205_60r15.yaml")) == 0
    assert "analysis.vibration_frequency_Hz is 60" in capsys.readouterr().err
