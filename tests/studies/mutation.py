"""Small changes of Python source, one place at a time, and a running function changed likewise."""

from __future__ import annotations

import ast
import gc
import re
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import CodeType, FunctionType
from typing import Any

OPERATORS = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.Pow: "*",
    ast.FloorDiv: "/",
    ast.Mod: "//",
    ast.BitAnd: "|",
    ast.BitOr: "&",
}
COMPARISONS = {
    ast.Lt: ("<=", ">"),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<"),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
PAIRS = "min max, minimum maximum, any all, sin cos, real imag, argmin argmax, floor ceil"
NAMES = {a: b for pair in PAIRS.split(", ") for a, b in (pair.split(), pair.split()[::-1])}


@dataclass(frozen=True)
class Mutant:
    """The bytes from ``start`` to ``end`` of ``file`` become ``new``; ``line`` from 1 on."""

    file: str
    line: int
    kind: str
    old: str
    new: str
    start: int
    end: int

    def of(self, source: bytes) -> bytes:
        """The mutated source."""
        return source[: self.start] + self.new.encode() + source[self.end :]

    def compiles(self, source: bytes) -> bool:
        """Return whether the text is still Python; templates are not judged."""
        if not self.file.endswith(".py"):
            return True
        with warnings.catch_warnings(action="ignore"):
            try:
                compile(self.of(source), self.file, "exec")
            except SyntaxError:
                return False
        return True


def mutants_of(file: str, source: bytes) -> Iterator[Mutant]:
    """List the changes of one file; none in annotations, messages, assertions and imports."""
    tree = ast.parse(source)
    begins = [0]
    for row in source.splitlines(keepends=True):
        begins.append(begins[-1] + len(row))

    def span(node: ast.AST) -> tuple[int, int]:
        at: Any = node
        return begins[at.lineno - 1] + at.col_offset, begins[at.end_lineno - 1] + at.end_col_offset

    def text(node: ast.AST) -> str:
        return source[slice(*span(node))].decode()

    spared: set[ast.AST] = set()
    for node in ast.walk(tree):
        parts: list[Any] = [getattr(node, "annotation", None), getattr(node, "returns", None)]
        if isinstance(node, ast.Raise | ast.Assert | ast.Import | ast.ImportFrom | ast.JoinedStr):
            parts.append(node)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            parts.append(node)
        spared.update(inner for part in parts if part for inner in ast.walk(part))
    for node in ast.walk(tree):
        if node in spared:
            continue
        for target, kind, new in _changes(node, text):
            start, end = span(target)
            yield Mutant(file, target.lineno, kind, text(target), new, start, end)


def template_mutants_of(file: str, source: bytes) -> Iterator[Mutant]:
    """Changes of a Jinja template: a value that is shown is dropped, a condition turned round."""
    for match in re.finditer(rb"\{\{(?![{]).*?\}\}|\{% (?:el)?if (.*?) %\}", source, re.DOTALL):
        line = source.count(b"\n", 0, match.start()) + 1
        if condition := match[1]:
            start, end = match.span(1)
            turned = f"not ({condition.decode()})"
            yield Mutant(file, line, "condition", condition.decode(), turned, start, end)
        else:
            yield Mutant(file, line, "value dropped", match[0].decode(), "", *match.span())


def _changes(node: Any, text: Callable[[ast.AST], str]) -> Iterator[tuple[Any, str, str]]:
    """Changes of a node: the part to replace, the kind of the change, and the replacement."""
    if isinstance(node, ast.BinOp):
        left, right = text(node.left), text(node.right)
        if not {"'", '"'} & {*left, *right}:
            if operator := OPERATORS.get(type(node.op)):
                yield node, "operator", f"(({left}) {operator} ({right}))"
            if isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div):
                yield node, "part dropped", f"({left})"
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        for other in COMPARISONS[type(node.ops[0])]:
            yield node, "comparison", f"{text(node.left)} {other} {text(node.comparators[0])}"
    elif isinstance(node, ast.Constant) and type(node.value) is int:
        yield node, "constant", repr({0: 1, 1: 2, 2: 1, 3: 2}.get(node.value, node.value + 1))
    elif isinstance(node, ast.Constant) and type(node.value) is float:
        yield node, "constant", repr(2 * node.value if node.value else 1.0)
    elif isinstance(node, ast.Constant) and type(node.value) is bool:
        yield node, "constant", repr(not node.value)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not | ast.Invert):
        yield node, "sign", f"({text(node.operand)})"
    elif isinstance(node, ast.BoolOp):
        other = " or " if isinstance(node.op, ast.And) else " and "
        yield node, "and, or", f"({other.join(f'({text(value)})' for value in node.values)})"
    elif isinstance(node, ast.AugAssign):
        yield node, "statement dropped", "pass"
        if operator := OPERATORS.get(type(node.op)):
            yield node, "operator", f"{text(node.target)} {operator}= {text(node.value)}"
    elif isinstance(node, ast.If):
        yield node.test, "branch never", "False"
        yield node.test, "branch always", "True"
    elif isinstance(node, ast.IfExp):
        yield node, "branch never", f"({text(node.orelse)})"
        yield node, "branch always", f"({text(node.body)})"
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield node, "statement dropped", "pass"
    elif isinstance(node, ast.Attribute) and node.attr in NAMES:
        yield node, "name", f"{text(node.value)}.{NAMES[node.attr]}"
    elif isinstance(node, ast.Name) and node.id in NAMES and isinstance(node.ctx, ast.Load):
        yield node, "name", NAMES[node.id]


def functions_of(code: CodeType) -> dict[str, list[CodeType]]:
    """Code of every function below a module's, by its qualified name, in the order of the text."""
    codes: dict[str, list[CodeType]] = defaultdict(list)
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            codes[inner.co_qualname].append(inner)
            for name, more in functions_of(inner).items():
                codes[name] += more
    return codes


def functions(modules: set[str]) -> dict[str, list[FunctionType]]:
    """List the functions of modules whose top package is one of ``modules``."""
    by_module: dict[str, list[FunctionType]] = defaultdict(list)
    for one in gc.get_objects():
        if isinstance(one, FunctionType) and (one.__module__ or "").partition(".")[0] in modules:
            by_module[one.__module__].append(one)
    return by_module


def exchange(known: list[FunctionType], before: bytes, after: bytes) -> bool:
    """Give the functions of an imported module, wherever they are referred to, the code of
    another source; False where there was none to exchange."""
    old, new = (functions_of(compile(text, "", "exec")) for text in (before, after))
    place = {
        (name, code.co_firstlineno): i for name, some in old.items() for i, code in enumerate(some)
    }
    exchanged = False
    for function in known:
        name, code = function.__code__.co_qualname, function.__code__
        i = place.get((name, code.co_firstlineno))
        if i is not None and i < len(new[name]) and old[name][i] != new[name][i]:
            function.__code__ = new[name][i]
            exchanged = True
    return exchanged
