"""Keywords of our decks against ABAQUS' manual, and mutants of them."""

from __future__ import annotations

import re

import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.language.table import RULES
from tyrecal_solvers.language.text import Block, read_keywords

from ..conftest import ROOT
from . import abaqus_decks, abaqus_mutants


def said(keywords: list[Block], before: list[Block]) -> list[str]:
    """Findings in words."""
    return [f"*{finding.block.name} {finding.words}" for finding in findings(keywords, before)]


@pytest.mark.slow
def test_every_deck_of_every_combination_of_options() -> None:
    """The grammar accepts each section deck, and the jobs that continue one with all the names
    they use."""
    count = 0
    for text in abaqus_decks.inflations():
        assert not said(read_keywords(text), []), text
        count += 1
    first = read_keywords(text)
    for text in (*abaqus_decks.modes(), *abaqus_decks.presses()):
        assert not said(read_keywords(text), first), text
        count += 1
    assert count == 384 + 192 + 32


def test_the_grammar_has_every_keyword_and_option_of_the_templates() -> None:
    """Keywords and options are taken from the templates' texts, whatever their conditions."""
    for path in (ROOT / "templates" / "abaqus").glob("*.j2"):
        text = re.sub(r"\{%.*?%\}", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for name, rest in re.findall(r"^\*([A-Z][A-Z ]+)(.*)$", text, re.MULTILINE):
            assert name in RULES, path
            for option in re.findall(r", ([A-Z][A-Z\- ]*)", rest):
                assert option in RULES[name].parameters, f"{path}: *{name}, {option}"


def test_what_the_grammar_does_not_know_is_a_doubt() -> None:
    """An unknown keyword and the options after it are not refused, because ABAQUS has more
    keywords."""
    text = next(abaqus_decks.inflations())
    for old, new in (("*DENSITY", "*PLASTIC\n1.0E6, 0.0\n*DENSITY"), ("*STATIC", "*DYNAMITE")):
        faults = findings(read_keywords(text.replace(old, new, 1)))
        assert faults and not any(each.sure for each in faults)


def test_mutants_of_our_decks_are_caught(request: pytest.FixtureRequest) -> None:
    """The grammar catches all of them."""
    mutants = abaqus_mutants.draw(60, request.config.getoption("--seed"))
    assert not [(kind, lines) for kind, caught, lines in mutants if not caught]
