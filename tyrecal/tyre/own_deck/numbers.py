"""The numbers of a deck that may be set: by a mark `{{ NAME }}` in its text, or by a path that
names the place, as in `material RUBBER / HYPERELASTIC / C10`; values are in the deck's own units.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from .text import Block, Row, fields, named, number_from, table

DECK_MARK = re.compile(r"\{\{\s*([A-Za-z][A-Za-z0-9_\-]*)\s*\}\}")
PARAMETER = re.compile(r"<\s*(\w+)\s*>")
GIVEN = re.compile(r"{{|<")  # in a text whose numbers are given elsewhere
IN_PATHS = {*table.MATERIAL_OPTIONS, "REBAR LAYER", "REBAR"}  # blocks whose numbers have paths
Numbers = Mapping[str, float]
Parameters = dict[str, int | float | str]  # of *PARAMETER, by their names in upper case


def paths(blocks: Sequence[Block]) -> dict[str, tuple[int, int, int]]:
    """Path to block, row and field of the plain numbers of materials, layers and parameters."""
    places: dict[str, tuple[int, int, int]] = {}
    material = section = ""
    layers = [row.name(0) for b in blocks if b.name == "REBAR LAYER" for row in b.rows]
    rebars = [b.get("NAME") for b in blocks if b.name == "REBAR" for _ in b.rows]
    for place, block in enumerate(blocks):
        if block.name == "STEP":
            break
        if block.name == "MATERIAL":
            material = f"material {block.get('NAME')}"
        elif block.name in ("SURFACE SECTION", "MEMBRANE SECTION"):
            section = f"section {block.get('ELSET')} / "
        elif block.name == "PARAMETER":
            for i, (name, value) in enumerate(map(assigned, block.rows)):
                if plain_number(value):
                    places[f"parameter / {name}"] = place, i, -1
        for (name, *_), i, j in fields.placed_fields(block) if block.name in IN_PATHS else ():
            row, given = block.rows[i], block.get("NAME")
            if block.name == "REBAR LAYER":
                owner = f"{section * (layers.count(row.name(0)) > 1)}rebar {row.name(0)}"
            elif block.name == "REBAR":
                owner = f"rebar {given}" + f" {row.name(0)}" * (rebars.count(given) > 1)
            else:
                is_table = len(block.rows) > 1 and block.name != "HYPERELASTIC"
                owner = f"{material} / {block.name}" + f" / row {i + 1}" * is_table
            if plain_number(row.text(j)):
                places.setdefault(f"{owner} / {name}", (place, i, j))
    return places


def acting_parameters(blocks: Sequence[Block]) -> set[str]:
    """Names, in upper case, of the parameters of a section deck on which more than the pressure and
    steps' increments depends: of these the case decides."""
    acting, in_step = set[str](), False
    for block in blocks:
        in_step = block.name != "END STEP" and (in_step or block.name == "STEP")
        if (in_step and block.name != "BOUNDARY") or block.name in table.OUTPUT_KEYWORDS:
            continue
        texts = [*(row.line for row in block.rows), *block.parameters.values()]
        acting |= {name.upper() for text in texts for name in PARAMETER.findall(text)}
    rows = [row for block in blocks if block.name == "PARAMETER" for row in block.rows]
    for row in reversed(rows):
        name, expression = assigned(row)
        if name.upper() in acting:
            acting |= {word.upper() for word in re.findall(r"[A-Za-z]\w*", expression)}
    return acting


def moduli(numbers: Iterable[str], material: str) -> dict[str, int]:
    """Paths of a material's moduli, -1 where it is their reciprocal."""
    own = (path for path in numbers if path.startswith(f"material {material} / "))
    signs = {path: modulus_sign(path.rpartition(" / ")[2]) for path in own}
    return {path: sign for path, sign in signs.items() if sign}


def modulus_sign(name: str) -> int:
    """1 for a field that is a modulus, -1 for the reciprocal of one, 0 for any other."""
    if re.fullmatch(r"D[1-6]", name):
        return -1
    return int(bool(re.fullmatch(r"E|stiffness|mu\d?|C\d\d", name)))


def assigned(row: Row) -> tuple[str, str]:
    """Name and expression of a *PARAMETER's data line, without a comment."""
    name, _, value = ",".join(row.fields).partition("#")[0].partition("=")
    return name.strip(), value.strip()


def plain_number(text: str) -> bool:
    """Whether a field is a finite number as it stands."""
    try:
        return math.isfinite(number_from(text))
    except ValueError:
        return False


def marks(blocks: Sequence[Block]) -> dict[str, Block]:
    """The marks of a deck, each with a block that has it."""
    by_mark: dict[str, Block] = {}
    for block in blocks:
        for row in block.rows:
            for field in row.fields:
                for name in DECK_MARK.findall(field):
                    by_mark.setdefault(name, block)
        for value in block.parameters.values():
            if "{{" in value:
                raise block.refused(f"a mark must be in a data line, not in {value}")
    return by_mark


def marked_numbers(marks: Mapping[str, Block], given: Numbers, variable: Any) -> dict[str, float]:
    """Values of marks that only a variable of a case gives, by its start."""
    if not isinstance(variable, dict) or not isinstance(variable.get("start"), int | float):
        return {}
    paths = [p for p in variable.get("sets") or () if isinstance(p, str)]
    names = [path.removeprefix("deck.numbers.") for path in paths]
    return {name: variable["start"] for name in names if name in marks and name not in given}


def written(value: float) -> str:
    """A number as decks have it: 13 digits in at most 20 characters."""
    return format(value, ".13g")


def with_number(line: str, row: Row, index: int, value: float) -> str:
    """The line of a row with a number at a field, -1: in NAME = value; the rest as it stands. A
    real parameter stays real: in expressions the quotient of two whole numbers is whole."""
    text = written(value)
    if index < 0:
        name, _, rest = line.partition("=")
        before = assigned(row)[1]
        is_whole = text.lstrip("-").isdigit() and not before.lstrip("+-").isdigit()
        return f"{name}={rest.replace(before, text + '.' * is_whole, 1)}"
    fields = line.split(",")
    fields[index] = re.sub(r"\S.*\S|\S", text, fields[index], count=1)
    return ",".join(fields)


def is_marked(block: Block) -> bool:
    """Whether its numbers depend on marks or parameters."""
    in_data = any(GIVEN.search(row.line) for row in block.rows)
    return in_data or any("<" in value for value in block.parameters.values())


def with_marks_filled(text: str, numbers: Numbers) -> str:
    """A text with the numbers of those marks that have one."""
    return DECK_MARK.sub(lambda m: written(numbers[m[1]]) if m[1] in numbers else m[0], text)


def filled(block: Block, numbers: Numbers, parameters: Parameters) -> Block:
    """A block with the numbers of its marks and parameters."""

    def text(field: str) -> str:
        field = with_marks_filled(field, numbers)
        if "{{" in field:
            raise block.refused(f"the mark {field} has no number: give it in deck.numbers")
        return PARAMETER.sub(lambda m: _parameter(block, parameters, m[1]), field)

    rows = [Row(row.place, text(row.line)) if GIVEN.search(row.line) else row for row in block.rows]
    values = {k: text(v) if "<" in v else v for k, v in block.parameters.items()}
    return replace(block, parameters=values, rows=rows)


def _parameter(block: Block, parameters: Parameters, name: str) -> str:
    if name.upper() not in parameters:
        raise block.refused(f"the parameter <{name}> is not defined above")
    value = parameters[name.upper()]
    return value if isinstance(value, str) else written(value)


MAX_RESULT = 1e300  # result of an expression
MAX_BASE = 1e30  # of a power
OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
EXPRESSION_FUNCTIONS = {
    name: getattr(math, name)
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "log10", "fabs")
} | {"abs": abs, "float": float, "min": min, "max": max, "int": int}


def parameters(block: Block, known: Parameters) -> None:
    """Add the parameters that a *PARAMETER defines, NAME = expression, of those above too, by their
    names in upper case."""
    for row in block.rows:
        text = ",".join(row.fields)[:60]
        name, expression = assigned(row)
        if not (name or expression):
            continue
        if not expression or not re.fullmatch(r"[A-Za-z]\w*", name):
            raise block.refused(f"'{text}' is not NAME = expression", row)
        try:
            value = _evaluate(ast.parse(expression, mode="eval").body, known)
        except (RecursionError, MemoryError):
            raise block.refused(f"'{text}' is nested too deep", row) from None
        except (ValueError, SyntaxError, KeyError, TypeError, ArithmeticError) as error:
            raise block.refused(f"'{text}' is not honoured: {error}", row) from None
        known[name.upper()] = value


def _evaluate(node: ast.AST, known: Parameters) -> Any:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float, str):
        return node.value
    if isinstance(node, ast.Name):
        if node.id == "pi":
            return math.pi
        if node.id.upper() not in known:
            raise ValueError(f"{node.id} is not defined above")
        return known[node.id.upper()]
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](_number(_evaluate(node.operand, known)))
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        left, right = (_number(_evaluate(side, known)) for side in (node.left, node.right))
        whole = isinstance(left, int) and isinstance(right, int)
        if isinstance(node.op, ast.Div) and whole and left % right:
            raise ValueError(f"{left}/{right} of whole numbers: write {left}./{right}")
        if isinstance(node.op, ast.Pow) and (abs(right) > 100 or abs(left) > MAX_BASE):
            raise ValueError("a power above 100, or of a large number")
        value = OPERATORS[type(node.op)](left, right)
        if abs(value) > MAX_RESULT:
            raise ValueError(f"a number above {MAX_RESULT:g}")
        return value
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        function = EXPRESSION_FUNCTIONS.get(node.func.id)
        if function and not node.keywords:
            return function(*(_number(_evaluate(a, known)) for a in node.args))
    raise ValueError("only numbers, names, + - * / ** and plain functions are")


def _number(value: Any) -> Any:
    if isinstance(value, str):
        raise ValueError(f"'{value}' is no number")
    return value


def replaced(block: Block, changes: Mapping[tuple[int, int], float]) -> Block:
    """A block with numbers at (row, field) set; field -1: the value of NAME = value."""
    rows = list(block.rows)
    for (i, j), value in changes.items():
        rows[i] = Row(rows[i].place, with_number(rows[i].line, rows[i], j, value))
    return replace(block, rows=tuple(rows))


def as_known(path: Any, known: Iterable[str]) -> Any:
    """A path in a user's deck as ``known`` spells it: case, blanks and the prefix deck.numbers.
    do not matter; anything else, such as a variable's name, unchanged."""
    if not isinstance(path, str) or "/" not in path:
        return path
    return canonical(path.removeprefix("deck.numbers."), known) or path


def canonical(path: str, known: Iterable[str]) -> str | None:
    """The path of ``known`` that is meant, ignoring case and blanks."""
    words = lambda each: [named(word) for word in each.split("/")]
    return next((each for each in known if words(each) == words(path)), None)
