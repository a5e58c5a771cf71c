"""Programs that change code, files and decks, on samples.

The study of mutants changes what it says, nothing else, and in running functions too.
A sample of `mutated_inputs`: a stranger's files end in a sentence and change nothing outside.
A sample of `own_deck_fuzz`: a damaged deck is refused in one sentence, or read.
A hundredth of `deck_numbers`: no number of a deck is off by a unit in silence.
"""

from __future__ import annotations

import sys
from pathlib import Path
from random import Random
from types import ModuleType

import pytest

from . import deck_numbers, own_deck_fuzz
from .mutated_inputs import NAMES, Kinds, trials
from .mutation import exchange, functions, mutants_of, template_mutants_of

SOURCE = b'''"""A docstring 1."""
from math import pi

LIMIT = 3

def area(r: float, cut: float = 0.5) -> float:
    """pi r^2 1."""
    if r < 0 and not cut > 1:
        raise ValueError("r is " + str(-1))
    return pi * r**2 - cut

twice = lambda x: 2 * x
'''


def test_changes_are_python_and_none_is_in_words() -> None:
    mutants = list(mutants_of("a.py", SOURCE))
    assert all(m.compiles(SOURCE) and m.of(SOURCE) != SOURCE for m in mutants)
    assert {m.line for m in mutants} == {4, 6, 8, 10, 12}  # no docstring, import or message
    changes = {(m.kind, m.old, m.new) for m in mutants}
    assert ("constant", "3", "2") in changes
    assert ("branch never", "r < 0 and not cut > 1", "False") in changes
    assert ("comparison", "r < 0", "r <= 0") in changes
    assert ("part dropped", "pi * r**2 - cut", "(pi * r**2)") in changes
    assert ("operator", "r**2", "((r) * (2))") in changes


def test_values_and_conditions_of_templates_change() -> None:
    source = b"{% if a.b %}\n<p>{{ x|fixed(2) }}</p>\n{% endif %}{# {{ no }} #}"
    first, second, *_ = template_mutants_of("a.j2", source)
    assert first.of(source).startswith(b"{% if not (a.b) %}") and first.compiles(source)
    assert (second.line, second.kind) == (2, "value dropped") and b"<p></p>" in second.of(source)


@pytest.mark.parametrize(
    ("old", "new", "area", "twice"), [(b"- cut", b"+ cut", 3.64, 4), (b"2 * x", b"3 * x", 2.64, 6)]
)
def test_a_running_function_is_exchanged_wherever_it_is_known(
    old: bytes, new: bytes, area: float, twice: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = ModuleType("mutated_for_a_test")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(compile(SOURCE, "", "exec"), vars(module))
    known = module.area, module.twice  # as another module has imported them
    assert exchange(functions({module.__name__})[module.__name__], SOURCE, SOURCE.replace(old, new))
    assert known[0](1.0) == pytest.approx(area, abs=0.01) and known[1](2) == twice
    assert not exchange(functions({module.__name__})[module.__name__], SOURCE, SOURCE)


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> Kinds:
    """Inputs that are mutated."""
    return Kinds(tmp_path_factory.mktemp("mutated") / "inputs")


@pytest.mark.slow
@pytest.mark.parametrize("kind", NAMES)
def test_no_mutated_input_breaks_anything(kind: str, kinds: Kinds) -> None:
    results = list(trials(kinds, kind, list(range(12)), seed=2))
    assert [each for each in results if each["fault"]] == [] and len(results) == 12


@pytest.mark.slow
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


def test_no_damaged_deck_ends_in_a_traceback(request: pytest.FixtureRequest) -> None:
    mutants = own_deck_fuzz.draw(30, request.config.getoption("--seed"))
    assert not [(kind, how) for kind, how, *_ in mutants if how not in ("refused", "read")]


def test_sizes_beyond_a_machine_are_refused() -> None:
    """Each refusal is within the limits of time and memory."""
    assert not [how for how in own_deck_fuzz.sizes() if how not in ("refused", "read")]


@pytest.mark.parametrize("name", ["parameters", "ogden"])
def test_a_slip_is_refused_or_changes_little(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """12 of 312 slips; all 312 end so."""
    chosen = Random(request.config.getoption("--seed")).sample(range(144), 6)
    path = deck_numbers.decks(tmp_path, name)
    trials = list(deck_numbers.trials(name, path, chosen))
    assert len(trials) == 6
    assert not [each for each in trials if deck_numbers.ending(each) in ("silent", "failed")]
