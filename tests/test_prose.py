"""README, guides, help, errors and the report page are short sentences in plain words.

Lengths, sums of words, words to avoid. Tables and code are not sentences.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import click
import pytest
from markdown_it import MarkdownIt

from tyrecal.cli.main import cli
from tyrecal.report.effects import effect_text
from tyrecal.studies.effects import CatalogueEntry
from tyrecal.tyre.effects import catalogue

ROOT = Path(__file__).parents[1]
GUIDES = sorted((ROOT / "cases").glob("*.md"))
DOCUMENTS = ["README.md", *(f"cases/{path.name}" for path in GUIDES), "solvers/README.md"]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("[!.]*/**/*.md"), *ROOT.glob(".github/*.md")]
SITE = [f"cases/site/{path.name}" for path in sorted((ROOT / "cases/site").glob("*.md"))]
WRITTEN = [*DOCUMENTS, *SITE, "CHANGELOG.md"]
README_LINES = 150
SENTENCE_WORDS = 35
MEAN_SENTENCE_WORDS = 20.0
WORDS = 22_000  # of all documents, without the tables of the reference
REFERENCE = ["cases/README.md", "cases/glossary.md", "cases/case_keys.md"]  # have tables of keys
CHANGELOG_WORDS = 600  # of one version
AVOID = re.compile(  # the left column is what a reader stumbles over, the comment what to write
    r"""\b(
    told | is\ said | are\ said | says?\ of            # reported, printed, listed
    | asks?\ the\ model | is\ asked | are\ asked       # is evaluated, runs the solver
    | hangs?\ on                                       # depends on
    | stands?\ (in|at) | lies?\ in                     # is in, is given in
    | comes?\ to | (is|are)\ worth                     # is, amounts to
    | in\ play | takes?\ up | gives?\ way              # active, absorbs, yields
    | nobody | whoever | whatever | at\ hand           # name the case
    | an\ own | (one|some)\ of\ one's\ own | an\ own\ one  # your own
    | discs? | telephones?                             # disk, phone
    | beside                                           # next to, in addition to
    | slopes?                                          # sensitivity
    | (a|the|on|one|from|this)\ record                 # evaluation store
    | outside\ the\ catalogue                          # not explained by the catalogue
    | axial\ (mode|shape|\[)                           # lateral
    | but\ for                                         # except
    )\b""",
    re.VERBOSE | re.IGNORECASE,
)
KEYS = ["slope over the harmonic, c = 4 over c = 1"]  # of result files, with words to avoid


def blocks(name: str) -> Iterator[tuple[str, str]]:
    """Kind (paragraph, heading, th, td) and text of each block of a document, without code blocks.

    A link is its text, inline code one word.
    """
    tokens = MarkdownIt().enable("table").parse((ROOT / name).read_text(encoding="utf-8"))
    for before, token in pairwise(tokens):
        if token.type == "inline":
            pieces = [
                {"text": child.content, "code_inline": "`code`", "softbreak": " "}.get(
                    child.type, ""
                )
                for child in token.children or []
            ]
            yield before.type.removesuffix("_open"), "".join(pieces)


def sentences(name: str) -> list[str]:
    """Sentences of the paragraphs and lists of a document."""
    paragraphs = [text for kind, text in blocks(name) if kind == "paragraph"]
    return [s for text in paragraphs for s in re.split(r"(?<=[.!?])\s+(?=[^a-z])", text) if s]


def word_count(text: str) -> int:
    """Words: runs of letters and digits with what is joined to them by no blank."""
    return sum(any(c.isalnum() for c in word) for word in text.split())


def words_without_reference(name: str) -> int:
    """Words of a document's text, code included, without the tables of the reference."""
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not (name in REFERENCE and line.startswith("|"))]
    return word_count("\n".join(kept))


@pytest.mark.parametrize("name", WRITTEN)
def test_sentences_are_short(name: str) -> None:
    lengths = {sentence: word_count(sentence) for sentence in sentences(name)}
    assert not [s for s, length in lengths.items() if length > SENTENCE_WORDS]
    assert sum(lengths.values()) / len(lengths) <= MEAN_SENTENCE_WORDS


@pytest.mark.parametrize("name", WRITTEN)
def test_words_are_plain(name: str) -> None:
    assert not [(match[0], text) for _, text in blocks(name) for match in AVOID.finditer(text)]


@pytest.mark.parametrize("name", WRITTEN)
def test_guides_say_whom_they_are_for_and_end_with_limits(name: str) -> None:
    if name not in {"README.md", "CHANGELOG.md", *REFERENCE, *SITE}:
        paragraphs = [text for kind, text in blocks(name) if kind == "paragraph"]
        assert paragraphs[0].startswith("For ")
        assert "limits" in anchors(ROOT / name)


def test_documents_together_are_short() -> None:
    assert sum(map(words_without_reference, DOCUMENTS)) <= WORDS


def test_the_readme_is_one_page() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= README_LINES
    assert "what the model is missing" in " ".join(lines[:10])


def anchors(path: Path) -> set[str]:
    """The headings of a document as links name them."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def test_the_changelog_is_short() -> None:
    versions = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[1:]
    assert max(map(word_count, versions)) <= CHANGELOG_WORDS


def test_every_picture_is_on_a_page() -> None:
    texts = "".join(path.read_text(encoding="utf-8") for path in PAGES)
    assert {path.name for path in ROOT.glob("cases/pictures/*")} == {
        *re.findall(r"pictures/([\w.]+)\)", texts)
    }


def pages_of_help(command: click.Command, context: click.Context) -> Iterator[tuple[str, str]]:
    """Name and help of a command and of all commands below it."""
    yield context.command_path, command.get_help(context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below
            yield from pages_of_help(below, click.Context(below, context, name))


def spoken_words(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of each string of a module that has a blank, without its docstrings.

    A value amid a formatted string is a blank.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    apart = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            apart |= {id(part) for part in node.values}
            parts = [part.value if isinstance(part, ast.Constant) else " " for part in node.values]
            yield node.lineno, "".join(map(str, parts))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in apart:
            yield node.lineno, node.value


def avoided(texts: Iterable[tuple[str, str]]) -> list[tuple[str, str, str]]:
    """Place, avoided word and text, on one line, of each text that has one."""
    lines = [(place, " ".join(text.split())) for place, text in texts]
    return [(place, hit[0], line) for place, line in lines for hit in AVOID.finditer(line)]


def test_the_words_to_avoid_are_seen() -> None:
    texts = [("a", "what the verdict hangs\n on"), ("b", "depends on"), ("c", "an axial mode")]
    assert [(place, word) for place, word, _ in avoided(texts)] == [
        ("a", "hangs on"),
        ("c", "axial mode"),
    ]


def test_help_is_in_plain_words() -> None:
    pages = list(pages_of_help(cli, click.Context(cli, info_name="tyrecal")))
    assert len(pages) > 20
    assert not avoided(pages)


def test_effects_are_in_plain_words() -> None:
    assert not avoided(
        (id, effect_text(CatalogueEntry.of(effect, []))) for id, effect in catalogue().items()
    )


def test_templates_of_pages_and_cases_are_in_plain_words() -> None:
    templates = [*ROOT.glob("templates/report/*.j2"), *ROOT.glob("templates/case/*.j2")]
    assert templates
    assert not avoided(
        (path.name, re.sub(r"{#.*?#}|<[^>]*>", " ", path.read_text(encoding="utf-8")))
        for path in templates
    )


@pytest.mark.parametrize("package", ["tyrecal", "solvers"])
def test_errors_and_results_are_in_plain_words(package: str) -> None:
    texts = [
        (f"{path.relative_to(ROOT)}:{line}", text)
        for path in sorted((ROOT / package).rglob("*.py"))
        for line, text in spoken_words(path)
        if len(text.split()) > 2 and text not in KEYS
    ]
    assert len(texts) > 100 and not avoided(texts)
