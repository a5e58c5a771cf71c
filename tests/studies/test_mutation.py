"""The study of mutants changes what it says, nothing else, and in running functions too."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

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
