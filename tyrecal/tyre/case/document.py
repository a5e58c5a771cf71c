"""YAML as plain data that remembers its lines, without anything YAML could do to us."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.parser import Parser

from .mistakes import Keys, Mistake, dotted, nearby, shortened
from .parts import WRONG

MAX_TABLE_BYTES = 1_000_000  # of a table next to a case
MAX_CASE_BYTES = 100_000  # bytes of YAML; shipped cases have 5000, and it is read at 30 kB/s
MAX_EVENTS = 20_000  # keys and values
DEEPEST = 20  # keys within keys


@dataclass
class Document:
    """A YAML file: plain data, the line and text of every path in it, and its mistakes.

    Values that are wrong as YAML are WRONG in ``data``; None when there is no data at all.
    """

    file: str
    data: dict[str, Any] | None = None
    places: dict[Keys, tuple[int, str]] = field(default_factory=dict)  # line from 1, and its text
    mistakes: list[Mistake] = field(default_factory=list)

    def add(self, keys: Keys, message: str) -> None:
        """Record a mistake at ``keys``, on the nearest line above them when they are missing."""
        known = keys
        while known and known not in self.places:
            known = known[:-1]
        line, text = self.places.get(known, (1, ""))
        value = text if known == keys else "missing"
        self.mistakes.append(Mistake(self.file, line, dotted(keys), value, message))

    def refuse(self, line: int, message: str) -> None:
        """Record that the file as a whole is wrong; line 0: on no line of its own."""
        self.mistakes.append(Mistake(self.file, line, "", "", message))


def read_document(path: Path) -> Document:
    """Read a YAML file that holds a mapping; every fault is among its mistakes."""
    document = Document(str(path))
    text = _text(path, document)
    if text is None:
        return document
    try:
        root = compose(text)
        if isinstance(root, MappingNode):
            document.data = _Reader(document, _yaml().constructor).mapping(root, ())
        else:
            document.refuse(1, "the file must hold keys and values, as in 'format: 1'")
    except _Harmful as harmful:
        at_percent = 1 + [row[:1] for row in [*text.split("\n"), "%"]].index("%")
        document.refuse(harmful.line or at_percent, harmful.message)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        document.refuse(mark.line + 1 if mark else 1, f"not YAML: {_sentence(error)}")
    except YAMLError as error:
        line = text.count("\n", 0, getattr(error, "position", 0)) + 1
        document.refuse(line, f"not YAML: {shortened(str(error), 100)}")
    return document


def _yaml() -> YAML:
    yaml = YAML(typ="safe", pure=True)
    yaml.Parser = _Harmless
    return yaml


@lru_cache(maxsize=32)
def compose(text: str) -> Node | None:
    """The nodes of a text, None of an empty one; they must not be changed. Composing takes two
    thirds of the time to load a case, which one command does several times. Raises YAMLError."""
    return _yaml().compose(text)


def _text(path: Path, document: Document) -> str | None:
    """Text of a case file; None, and a mistake in the document, if it cannot be read."""
    try:
        if path.is_dir():
            document.refuse(0, f"is a folder, must be a case file{nearby(path, '.yaml')}")
            return None
        if path.exists() and not path.is_file():
            document.refuse(0, "is not a regular file")
            return None
        with path.open("rb") as file:
            content = file.read(MAX_CASE_BYTES + 1)
    except FileNotFoundError:
        document.refuse(0, f"there is no such file{nearby(path, '.yaml')}")
    except (OSError, ValueError) as error:
        document.refuse(0, f"cannot be read: {getattr(error, 'strerror', None) or error}")
    else:
        if len(content) > MAX_CASE_BYTES:
            document.refuse(1, f"the file is larger than {MAX_CASE_BYTES} bytes")
        elif not content.strip():
            document.refuse(1, "the file is empty")
        else:
            try:
                return content.decode("utf-8-sig")
            except UnicodeDecodeError as error:
                line = content.count(b"\n", 0, error.start) + 1
                document.refuse(line, "the text must be in UTF-8")
    return None


class _Harmful(YAMLError):
    """YAML that is valid but that no case needs; line 0: where the first % begins one."""

    def __init__(self, line: int, message: str):
        super().__init__(message)
        self.line, self.message = line, message


class _Harmless(Parser):
    """No alias, tag, directive or deep nest, not too much of anything, judged from each event
    before anything is expanded or built from it."""

    events, depth = 0, 0

    def get_event(self) -> Any:
        """The next event. Raises _Harmful."""
        event = super().get_event()
        line = event.start_mark.line + 1
        self.events += 1
        if self.events > MAX_EVENTS:
            raise _Harmful(line, f"there are more than {MAX_EVENTS} keys and values")
        if getattr(event, "version", None) or getattr(event, "tags", None):
            raise _Harmful(0, "remove the directive, as %YAML: a case is plain YAML 1.2")
        self.depth += isinstance(event, CollectionStartEvent)
        self.depth -= isinstance(event, CollectionEndEvent)
        if self.depth > DEEPEST:
            raise _Harmful(line, f"keys are nested more than {DEEPEST} deep")
        if isinstance(event, AliasEvent):
            raise _Harmful(line, f"the alias *{event.anchor} must be written out in full")
        if getattr(event, "tag", None):
            raise _Harmful(line, f"the tag {event.tag} is not allowed, only plain values are")
        return event


def _sentence(error: MarkedYAMLError) -> str:
    text = error.problem or error.context or "it cannot be read"
    hint = "; indent with spaces, not tabs" if "\\t" in text or "'\t'" in text else ""
    return shortened(text, 150) + hint


@dataclass
class _Reader:
    """Turns YAML nodes into plain data, noting lines."""

    document: Document
    constructor: Any

    def item(self, node: Node, keys: Keys, line: int) -> Any:
        """The value of ``node``, and its place noted."""
        if isinstance(node, MappingNode):
            self.document.places[keys] = line + 1, "a table"
            return self.mapping(node, keys)
        if isinstance(node, SequenceNode):
            self.document.places[keys] = line + 1, "a list"
            nodes = enumerate(node.value)
            return [self.item(entry, (*keys, i), entry.start_mark.line) for i, entry in nodes]
        assert isinstance(node, ScalarNode)
        empty = "''" if node.style else "null"
        self.document.places[keys] = line + 1, shortened(str(node.value)) or empty
        return self.scalar(node, keys)

    def mapping(self, node: MappingNode, keys: Keys) -> dict[str, Any]:
        """Content of a mapping; a wrong or repeated key is a mistake with its line."""
        data: dict[str, Any] = {}
        for name, content in node.value:
            line = name.start_mark.line
            key = name.value if isinstance(name, ScalarNode) else "?"
            if not isinstance(name, ScalarNode) or _kind(name) != "str":
                comma = node.flow_style and data and _kind(name) == "int"
                hint = f": has '{[*data][-1]}' before it a comma for a point?" if comma else ""
                self.document.refuse(
                    line + 1, f"the key {shortened(key)} must be a plain word{hint}"
                )
            elif key in data:
                first = self.document.places[(*keys, key)][0]
                self.document.mistakes.append(
                    Mistake(
                        self.document.file,
                        line + 1,
                        dotted((*keys, key)),
                        "given twice",
                        f"it is on line {first} already, remove one of the two",
                    )
                )
            else:
                data[key] = self.item(content, (*keys, key), line)
        return data

    def scalar(self, node: ScalarNode, keys: Keys) -> Any:
        """Value of a scalar; WRONG, and a mistake, if it is no plain or finite value."""
        if "\0" in node.value:  # no path and no command can hold one
            self.document.add(keys, "must hold no NUL character")
            return WRONG
        if _kind(node) not in ("int", "float", "bool", "null"):
            return node.value
        with suppress(ValueError, OverflowError):  # thousands of digits
            value = self.constructor.construct_object(node, deep=True)
            if value is None or isfinite(value):
                return value
        self.document.add(keys, "must be a finite number")
        return WRONG


def _kind(node: Node) -> str:
    """YAML's type of a scalar, as its resolver tagged it: ``str``, ``int``, ``null``, ..."""
    return (node.tag or "").rpartition(":")[2]
