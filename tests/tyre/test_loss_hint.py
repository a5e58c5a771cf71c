"""Hints on compounds without a loss factor, and on Prony series used beyond their terms.

The hint for cases whose textile or carcass cords bear compression, and where it is printed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.hints import lossless_hint, prony_hints, slack_cord_hint
from tyrecal.tyre.case.new_case import from_size
from tyrecal.tyre.case.parts import Prony
from tyrecal.tyre.load import load_case
from tyrecal.tyre.section.size import parse_size

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


TEXTILE = "materials.polyester_cord.bears_compression: false"


def written(code: str, folder: Path, *edits: tuple[str, str]) -> LoadedCase:
    """The case of a size with edits, as an earlier `init` may have written it."""
    draft = from_size(parse_size(code), {}, None, "tyre")
    text = draft.text
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    (folder / draft.file).write_bytes(draft.content)
    (folder / "tyre.yaml").write_text(text)
    return load_case(folder / "tyre.yaml")


BEARS = (", bears_compression: false", "")


def test_textile_cords_of_an_earlier_case_get_the_line_that_helps(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = written("205/55R16", tmp_path, BEARS)
    hint = slack_cord_hint(case)
    assert hint.startswith("cords of carcass, carcass_turn_up, cap_ply bear compression")
    assert hint.endswith(f"{TEXTILE}, materials.nylon_cord.bears_compression: false")
    assert run("validate", str(case.path)) == 0
    assert hint in capsys.readouterr().err


@pytest.mark.parametrize("code", ["205/55R16", "11R22.5"])
def test_no_hint_for_what_init_writes(
    code: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = written(code, tmp_path)
    assert slack_cord_hint(case) == ""
    assert run("validate", str(case.path)) == 0
    assert "compression" not in capsys.readouterr().err


def test_steel_that_belts_share_is_to_be_copied(tmp_path: Path) -> None:
    """An earlier truck had one material for carcass, belts and wires; one of the carcass alone is
    named itself."""
    shared = slack_cord_hint(
        written("11R22.5", tmp_path, ("material: carcass_", "material: steel_"))
    )
    assert "cords of carcass, carcass_turn_up bear" in shared
    assert shared.endswith(
        "copy materials.steel_cord as steel_cord_of_carcass for these layers, with"
        " materials.steel_cord_of_carcass.bears_compression: false"
    )
    own = slack_cord_hint(written("11R22.5", tmp_path, BEARS))
    assert own.endswith(" slack: materials.carcass_cord.bears_compression: false")


def test_shipped_cases_state_no_load_on_a_road_and_get_no_hint(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Their cords bear compression as the papers have it; a failure may still end with it."""
    path = CASES / "p235_75r17.yaml"
    assert run("validate", str(path)) == 0
    assert "compression" not in capsys.readouterr().err
    assert "materials.carcass_cord" in slack_cord_hint(load_case(path))
