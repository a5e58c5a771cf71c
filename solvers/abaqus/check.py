"""Check of keywords against their records in the table: what ABAQUS would refuse of a deck by its
manual, and what is not checked."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, partial

from ..language.element_types import NODES_AND_SECTION
from ..language.rule import KeywordRule
from ..language.spelling import named
from ..language.step_rules import STEP_PROCEDURES
from ..language.table import RULES
from ..language.text import Block, Row, is_label

LONGEST = {"number": 20, "integer": 10, "label": 10, "name": 80}  # characters of a field
FORM = {
    "number": re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([EeDd][+-]?[0-9]+)?"),
    "integer": re.compile(r"[+-]?[0-9]+"),
    "label": re.compile(r"\+?0*[1-9][0-9]{0,8}"),
    "name": re.compile(r".+"),
    "freedom": re.compile(r"[0-9]+|ENCASTRE|PINNED|[XYZ]A?SYMM", re.IGNORECASE),
}
NUMBERED = {"node": "nset", "element": "elset"}  # kinds of fields that are numbers, or sets of them
BEGIN_END = {"PART": "END PART", "ASSEMBLY": "END ASSEMBLY", "INSTANCE": "END INSTANCE"}
HOLDS_LAYERS_IN_3D = re.compile(r"(SF)?M(3D|CL)|S\d")
GENERATORS = {"NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY", "SYMMETRIC MODEL GENERATION"}


@dataclass(frozen=True)
class Finding:
    """A fault of a keyword or of one of its data lines. ``sure``: ABAQUS' manual refuses it;
    otherwise the table has no rule for it, or the manual does not say what happens."""

    block: Block
    row: Row | None
    words: str
    sure: bool = True


@dataclass
class _Names:
    """Names given and used, and what elements and nodes there are."""

    given: set[tuple[str, str]] = field(default_factory=set)
    used: list[tuple[str, str, Block, Row | None]] = field(default_factory=list)
    nodes: set[str] = field(default_factory=set)
    types: set[str] = field(default_factory=set)  # of elements
    bare: list[tuple[Block, str]] = field(default_factory=list)  # sets, the sections they need


def findings(blocks: Sequence[Block], before: Sequence[Block] = ()) -> list[Finding]:
    """Faults in the keywords of a job, which may continue from the model of another, ``before``."""
    names = _Names()
    _keywords(before, names)
    names.used.clear()
    names.bare.clear()
    faults = [*_order(blocks, before), *_keywords(blocks, names)]
    if BEGIN_END.keys().isdisjoint(block.name for block in (*before, *blocks)):
        faults += _unnamed(blocks, names)  # in parts, names have prefixes
    return faults


def _keywords(blocks: Sequence[Block], names: _Names) -> list[Finding]:
    """Findings about parameters and data."""
    rules = [(block, RULES[block.name]) for block in blocks if block.name in RULES]
    judged = [(block, rule) for block, rule in rules if rule.is_judged]
    return [f for k in judged for f in (*_parameters(*k, names), *_data(*k, names))]


def _order(blocks: Sequence[Block], before: Sequence[Block]) -> Iterator[Finding]:
    """Levels, options of others, what must come after, what may stand once, steps' procedures."""
    seen = {block.name for block in before}
    opened: list[Block] = []  # parts, assembly, instance, step, the innermost last
    parent: Block | None = None
    once: dict[tuple[int, str], Block] = {}
    procedure = ""
    parts = any(block.name == "PART" for block in blocks)
    guessed = False  # whether a keyword above may be what the next ones are options of
    for block in blocks:
        name, inside, rule = block.name, opened[-1].name if opened else "", RULES.get(block.name)
        level = "step" if inside == "STEP" else "part" if inside or not parts else "model"
        fault = partial(Finding, block, None)
        if inside == "STEP" and not procedure:
            procedure = name
            if name not in STEP_PROCEDURES:
                yield fault("is under *STEP, the place of the step's procedure", bool(rule))
        elif inside == "STEP" and name in STEP_PROCEDURES:
            yield fault(f"is a second procedure of a step of *{procedure}")
        if rule is None:
            yield fault("is not checked: the table has no rule for it", sure=False)
        else:
            here = {level, "model"} if not parts and not inside else {level}
            if not here & set(rule.level.split()):
                words = {"step": "a step", "part": "a part or assembly", "model": "the model"}
                yield fault(f"does not belong in {words[level]}")
            if rule.under and (parent is None or parent.name not in rule.under):
                yield fault(f"must be directly under *{' or *'.join(rule.under)}", not guessed)
            if rule.after and not seen & set(rule.after):
                yield fault(f"must come after *{' or *'.join(rule.after)}")
            if rule.within and inside == "STEP" and procedure not in rule.within:
                yield fault(f"does not belong in a step of *{procedure}")
            if rule.once:
                scope = {"job": blocks[0], "step": opened[-1] if opened else None, "parent": parent}
                if (key := (id(scope[rule.once]), name)) in once:
                    yield fault(f"may be given once in a {rule.once}")
                once[key] = block
            if rule.is_judged and not rule.under:
                parent = block
        if name == "STEP" or name in BEGIN_END:
            opened.append(block)
            procedure = ""
        elif name == "END STEP" or name in BEGIN_END.values():
            if inside != name.removeprefix("END "):
                yield fault("ends what did not begin last")
            else:
                opened.pop()
        guessed = rule is None or (guessed and bool(rule.under))
        seen.add(name)
    for block in opened:
        yield Finding(block, None, f"has no *END {block.name}")


def _parameters(block: Block, rule: KeywordRule, names: _Names) -> Iterator[Finding]:
    """Findings about the parameters of a keyword: unknown ones, wrong values, missing ones."""
    fault = partial(Finding, block, None)
    for name, value in block.parameters.items():
        if name not in rule.parameters:
            yield fault(f"its {name} is not checked: the table does not have it", sure=False)
            continue
        wanted = rule.parameters[name]
        if wanted.islower():
            yield from _value(block, None, wanted, value, names, f"{name}=")
        elif value.upper() not in wanted.split("|"):
            words = " or ".join(word or "no value" for word in wanted.split("|"))
            yield fault(f"{name}={value} must be {words}")
    for group in rule.needed:
        if not set(group.split("|")) & set(block.parameters):
            yield fault(f"needs {' or '.join(group.split('|'))}")
    both = [name for name in rule.alone if name in block.parameters]
    if len(both) > 1:
        yield fault(f"{both[0]} and {both[1]} exclude each other")


def _data(block: Block, rule: KeywordRule, names: _Names) -> Iterator[Finding]:
    """Data lines: their number, then each field."""
    lines = rule.forms(block.parameters)
    if not lines and rule.fields:  # a variant whose data the table does not know
        return
    least, most = rule.rows if rule.fields else (0, 0)
    least = max(least, len(lines) if len(lines) > 1 else 0)
    if block.parameters.get("OP") == "NEW":  # which takes all that there were away
        least = 0
    if not least <= len(block.rows) <= most:
        bounds = f"{least}" if least == most else f"{least} to {most}" if most < 9 else ""
        bounds = bounds or f"at least {least}"
        yield Finding(block, None, f"has {len(block.rows)} data lines, {bounds} must be")
    if block.name == "ELEMENT":
        yield from _elements(block, names)
    if block.name == "NODE":
        names.nodes |= {row.fields[0].strip() for row in block.rows}
    for i, row in enumerate(block.rows if lines else ()):
        kinds, rest = _form(lines[min(i, len(lines) - 1)])
        more = row.fields[len(kinds) :]
        if any(more) and not rest:
            yield Finding(block, row, f"'{more[0]}' is more than its data line takes")
        for j, (kind, may_lack) in enumerate([*kinds, *[(rest, True)] * len(more) * bool(rest)]):
            if text := row.text(j):
                yield from _value(block, row, kind, text, names, "")
            elif not may_lack:
                yield Finding(block, row, f"field {j + 1}, a {kind}, is missing")


def _value(
    block: Block, row: Row | None, kind: str, text: str, names: _Names, of: str
) -> Iterator[Finding]:
    """One value of a kind; names that it gives or uses are noted."""
    if kind in ("text", "any"):
        return
    if kind.startswith("+"):
        names.given.add((kind[1:], named(text)))
    elif kind in NUMBERED or kind not in FORM:
        names.used.append((kind, named(text), block, row))
    form = kind if kind in FORM else "name"
    if kind in NUMBERED and is_label(text.strip()):
        form = "integer"
    if not FORM[form].fullmatch(text.strip()):
        what = "is missing" if not text.strip() else f"is no {form}"
        yield Finding(block, row, f"{of}{text} {what}")
    elif len(text.strip()) > LONGEST.get(form, 80):
        words = f"{of}{text} has more than the {LONGEST.get(form, 80)} characters that are read"
        yield Finding(block, row, words, sure=form == "name")


def _elements(block: Block, names: _Names) -> Iterator[Finding]:
    """Findings about the nodes of the elements of an *ELEMENT block; notes their type in
    ``names``."""
    kind = named(block.parameters.get("TYPE", ""))
    if kind not in NODES_AND_SECTION:
        words = f"TYPE={kind} is not checked: the table does not have it"
        yield Finding(block, None, words, sure=False)
        return
    count, section = NODES_AND_SECTION[kind]
    for row in block.rows:
        if len([text for text in row.fields if text.strip()]) != count + 1:
            yield Finding(block, row, f"an element {kind} has {count} nodes")
    names.types.add(kind)
    if _set(block):
        names.bare.append((block, section))


def _unnamed(blocks: Sequence[Block], names: _Names) -> Iterator[Finding]:
    """Names that are used but not defined, and sets whose elements have no properties."""
    generated = any(block.name in GENERATORS for block in blocks)
    for kind, name, block, row in names.used:
        if kind in NUMBERED and FORM["integer"].fullmatch(name):
            if kind == "node" and names.nodes and name not in names.nodes and not generated:
                yield Finding(block, row, f"there is no node {name}")
        elif (NUMBERED.get(kind, kind), name) not in names.given:
            yield Finding(block, row, f"there is no {NUMBERED.get(kind, kind)} {name}")
    of_elements = {_set(block) for block in blocks if block.name == "ELEMENT"}
    for block, section in names.bare:
        sets = {_set(other) for other in blocks if other.name == section}
        if _set(block) not in sets and sets <= of_elements:
            yield Finding(block, None, f"its elements {_set(block)} have no *{section}")
    bodies: dict[str, Block] = {}
    for block in blocks:
        if block.name == "RIGID BODY" and (tied := named(block.parameters.get("TIE NSET", ""))):
            if tied in bodies:
                yield Finding(block, None, f"the nodes {tied} are of another rigid body already")
            bodies[tied] = block
        if block.name != "REBAR LAYER":
            continue
        oriented = "ORIENTATION" in block.parameters
        if oriented and any(kind.startswith("SFMGAX") for kind in names.types):
            yield Finding(block, None, "takes no ORIENTATION on axisymmetric elements")
        fanned = block.parameters.get("GEOMETRY", "") in ("ANGULAR", "LIFT EQUATION")
        if fanned and not oriented and any(map(HOLDS_LAYERS_IN_3D.match, names.types)):
            words = "needs an ORIENTATION, a cylindrical one, on elements in three dimensions"
            yield Finding(block, None, words)


def _set(block: Block) -> str:
    """The element set that it names."""
    return named(block.parameters.get("ELSET", ""))


@cache
def _form(text: str) -> tuple[list[tuple[str, bool]], str]:
    """Kinds of the fields of a data line, whether each may lack, and of all that follow."""
    kinds: list[tuple[str, bool]] = []
    for word in text.split():
        if word.endswith("..."):
            return kinds, word.removesuffix("...")
        count, _, kind = word.rpartition("*")
        kinds += [(kind.removesuffix("?"), kind.endswith("?"))] * int(count or 1)
    return kinds, ""
