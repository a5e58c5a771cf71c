"""Numbers set in the text of a case file. All else stays as its user wrote it: comments, order,
layout, digits. Called where a new case is made of an old one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

from .case_text import plain_text
from .document import compose
from .mistakes import Keys
from .parts import as_written

Edit = tuple[int, int, str]  # characters from start to end of the text, and what replaces them


def set_in_text(text: str, values: Mapping[Keys, Any]) -> str:
    """The YAML ``text`` with the ``values``, numbers, words or lists of them, at their keys: keys
    and list indices from the top of the file on. A key that it lacks is added to the part that it
    belongs to. Raises YAMLError."""
    stated = [keys for keys in values if is_stated(text, keys)]
    lacking = [[keys] for keys in values if keys not in stated]  # each changes what the next finds
    for together in (stated, *lacking):
        root = compose(text)
        assert isinstance(root, MappingNode)
        edits = sorted(_edit(text, root, keys, values[keys]) for keys in together)
        for start, end, new in reversed(edits):
            text = text[:start] + new + text[end:]
    return text


def is_stated(text: str, keys: Keys) -> bool:
    """Whether the YAML ``text`` has a value at the keys. Raises YAMLError."""
    node = compose(text)
    for key in keys:
        node = _child(node, key)
    return node is not None


def _edit(text: str, node: Node, keys: Keys, value: Any) -> Edit:
    """The edit of ``text`` that sets the value at ``keys`` below ``node``."""
    key, *rest = keys
    child = _child(node, key)
    if rest and isinstance(child, MappingNode | SequenceNode):
        return _edit(text, child, tuple(rest), value)
    if child is not None:
        start, end = child.start_mark.index, child.end_mark.index
        if start < end:
            return start, end, _flow(rest, value)
        name = next(name for name, own in node.value if own is child)
        start = text.index(":", name.end_mark.index) + 1  # where the value of the key is absent
        return start, start, f" {_flow(rest, value)}"
    assert isinstance(node, MappingNode)
    start, column = node.start_mark.index, node.start_mark.column
    if node.flow_style:
        return start + 1, start + 1, _flow(keys, value)[1:-1] + (", " if node.value else "")
    if column:  # an indented table: the key becomes its first line
        return start, start, f"{_flow(keys, value)[1:-1]}\n{column * ' '}"
    # a part of the file goes to its end, where it parts no comment from its key
    entry = f"\n  {_flow(rest, value)[1:-1]}" if rest else f" {_flow(rest, value)}"
    return len(text.rstrip()), len(text), f"\n\n{_name(key)}:{entry}\n"


def _flow(keys: Sequence[str | int], value: Any) -> str:
    """A value under the keys, as a flow mapping such as {a: {b: 1.5}}; without keys, the value."""
    if keys:
        return f"{{{_name(keys[0])}: {_flow(keys[1:], value)}}}"
    if isinstance(value, list):
        return f"[{', '.join(_flow((), each) for each in value)}]"
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return repr(value) if is_number else as_written(value)


def _name(key: str | int) -> str:
    return plain_text(str(key))


def _child(node: Node | None, key: Any) -> Node | None:
    """The node at a key of a mapping or a place of a list; None if there is none."""
    if isinstance(node, MappingNode):
        return next((child for name, child in node.value if name.value == str(key)), None)
    if isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
        child: Node = node.value[key]
        return child
    return None
