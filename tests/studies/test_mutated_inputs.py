"""A sample of `mutated_inputs`: a stranger's files end in a sentence and change nothing outside."""

from __future__ import annotations

from pathlib import Path

import pytest

from .mutated_inputs import NAMES, Kinds, trials


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> Kinds:
    """Inputs that are mutated."""
    return Kinds(tmp_path_factory.mktemp("mutated") / "inputs")


SLOW = {"folders", "records", "requests", "cases", "universal"}


@pytest.mark.parametrize(
    "kind", [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW)) for n in NAMES]
)
def test_no_mutated_input_breaks_anything(kind: str, kinds: Kinds) -> None:
    results = list(trials(kinds, kind, list(range(12)), seed=2))
    assert [each for each in results if each["fault"]] == [] and len(results) == 12


def test_a_fault_is_seen(kinds: Kinds, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change outside, a traceback, and an end without a word are told from what is right."""

    def bad(self: Kinds, here: Path, chance: object) -> int:
        (self.outside / "victim").write_text("changed")
        raise ZeroDivisionError

    monkeypatch.setattr(Kinds, "records", bad)
    monkeypatch.setattr(Kinds, "cases", lambda *_: 2)
    words = [each["fault"] for kind in ("records", "cases") for each in trials(kinds, kind, [0], 2)]
    assert "OUTSIDE" in words[0] and "ZeroDivisionError" in words[0]
    assert words[1] == "code 2 without a word"
