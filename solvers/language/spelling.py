"""Words of keyword lines as the manual spells them in full.

ABAQUS ignores blanks and case, and takes a beginning that only one word has; a word that is exact
is never an abbreviation. A word that is in no list stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache

from .keyword_names import KEYWORD_NAMES
from .table import RULES

EVERYWHERE = ("INPUT",)  # a parameter of every keyword that has data lines


def squeezed(text: str) -> str:
    """A word without blanks, in upper case."""
    return "".join(text.upper().split())


def named(text: str) -> str:
    """A name as ABAQUS compares them: blanks count only between quotation marks."""
    text = text.strip()
    if len(text) > 1 and text[0] == text[-1] == '"':
        return " ".join(text[1:-1].upper().split())
    return squeezed(text.strip('"'))


def full(word: str, words: Iterable[str], mark: str = "") -> str:
    """The one of ``words`` that is meant; an error has ``mark`` before each. Raises ValueError."""
    short = squeezed(word)
    if not short:
        return ""
    spellings = {squeezed(each): each for each in words}
    if short in spellings:
        return spellings[short]
    fitting = [each for key, each in spellings.items() if key.startswith(short)]
    if len(fitting) > 1:
        several = " or ".join(mark + each for each in fitting)
        raise ValueError(f"'{word.strip()}' may be {several}: spell it out")
    return fitting[0] if fitting else " ".join(word.upper().split())


@cache
def full_keyword(word: str) -> str:
    """A keyword in full. Raises ValueError."""
    return full(word, KEYWORD_NAMES, "*")


def full_parameters(keyword: str, given: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Parameters of a keyword with their values, both in full. Raises ValueError."""
    rule = RULES.get(keyword)
    known = rule.parameters if rule else {}
    for key, value in given:
        name = full(key, (*known, *EVERYWHERE))
        words = known.get(name, "any")
        if words.islower():  # a kind of value, such as a number or a name
            yield name, value
        else:
            yield name, full(value.strip('"'), words.split("|"))
