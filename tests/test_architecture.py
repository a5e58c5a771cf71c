"""The map in .github/ARCHITECTURE.md is true: rooms, arrows, files and names are as it says."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
import tyrecal_solvers.bundled

ROOT = Path(__file__).parents[1]


MAP = (ROOT / ".github" / "ARCHITECTURE.md").read_text(encoding="utf-8")


ROOMS = re.findall(r"^(\w+) {2,}", MAP.split("```")[1], re.MULTILINE)  # from the top down


LEAVES = ("errors", "files", "interrupt", "units", "version")


FACES = ("__init__", "__main__")  # what is offered, and the command


PACKAGES = {"tyrecal": "tyrecal", "solvers": "tyrecal_solvers"}


DOCS = (ast.Module, ast.ClassDef, ast.FunctionDef)


OTHER_LIMITS = r"(MOST|LEAST(?!_SQUARES)|LARGEST|SMALLEST|LONGEST|SHORTEST|FEWEST|HIGHEST|LOWEST)_"


def module_of(path: Path) -> str:
    """The dotted name of a file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join((PACKAGES[parts[0]], *parts[1:])).removesuffix(".__init__")


@cache
def modules() -> dict[str, Path]:
    """Every module of the product by name."""
    return {module_of(path): path for top in PACKAGES for path in (ROOT / top).rglob("*.py")}


@cache
def tree(path: Path) -> ast.Module:
    """A file's source, parsed once for all who read it."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported(name: str) -> tuple[str, ...]:
    """Modules that a module imports, late and for types only too."""
    return tuple(_imported(name))


def _imported(name: str) -> Iterator[str]:
    path = modules()[name]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.ImportFrom):
            above = package.rsplit(".", node.level - 1)[0] if node.level else ""
            source = ".".join(filter(None, (above, node.module)))
            for alias in node.names:
                inner = f"{source}.{alias.name}"
                yield from (each for each in (inner, source)[inner not in modules() :][:1])
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def room_of(name: str) -> str:
    """The room, leaf or face that a module of `tyrecal` stands in."""
    return [*name.split("."), "__init__"][1]


def test_the_rooms_are_those_of_the_map() -> None:
    shown = {
        path.stem
        for path in (ROOT / "tyrecal").iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert shown == {*ROOMS, *LEAVES, *FACES}
    assert len(ROOMS) <= 8


def test_imports_run_downwards() -> None:
    """Imports run from the command to the leaves; the package hands on the names of `api`."""
    order = ["__main__", *ROOMS[: ROOMS.index("api")], "__init__", *ROOMS[ROOMS.index("api") :]]
    for name in modules():
        here = room_of(name)
        for other in imported(name):
            if not (name.startswith("tyrecal.") and other.startswith("tyrecal.")):
                continue
            there = room_of(other)
            if here in LEAVES:
                assert there in LEAVES, f"{name} imports {other}"
            elif there not in LEAVES:
                assert order.index(here) <= order.index(there), f"{name} imports {other}"


def test_no_circle() -> None:
    """Late imports and imports for types count, too."""
    below = {name: {x for x in imported(name) if x in modules()} - {name} for name in modules()}
    done: set[str] = set()

    def visit(name: str, way: tuple[str, ...]) -> None:
        assert name not in way, " -> ".join([*way[way.index(name) :], name])
        if name not in done:
            for other in sorted(below[name]):
                visit(other, (*way, name))
            done.add(name)

    for name in below:
        visit(name, ())


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["studies", "benchmarks"])
def test_programs_that_no_test_runs_import_what_is_there(folder: str) -> None:
    """Names that a program imports from the tests and from tyrecal are bound in that module."""
    for path in sorted((ROOT / "tests" / folder).glob("*.py")):
        for node in tree(path).body:
            if isinstance(node, ast.ImportFrom) and node.module:
                above = ["tests", folder][: 3 - node.level] if node.level else []
                file = ROOT.joinpath(*above, *node.module.split(".")).with_suffix(".py")
                if file.is_file():
                    bound = {name for each in tree(file).body for name in bound_names(each)}
                    assert {each.name for each in node.names} <= bound, f"{path}: {node.module}"


def bound_names(node: ast.stmt) -> set[str]:
    """Names that a statement of a module binds."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return {node.name}
    if isinstance(node, ast.Import | ast.ImportFrom):
        return {alias.asname or alias.name for alias in node.names}
    return {
        each.id
        for each in ast.walk(node)
        if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
    }


def test_studies_stand_on_inference_not_on_diagnosis() -> None:
    """`inference` imports no room of the studies, and `blind` and `plan` alone import
    `diagnose`."""
    studies = ROOT / "tyrecal" / "studies"
    rooms = {path.parent.name for path in studies.glob("*/__init__.py")}
    assert "inference" in rooms
    uses: dict[str, set[str]] = {room: set() for room in rooms}
    for name in modules():
        here = name.split(".")[2:3] if name.startswith("tyrecal.studies.") else []
        for other in imported(name) if set(here) & rooms else ():
            there = other.split(".")[2] if other.startswith("tyrecal.studies.") else ""
            if there in rooms - {here[0]}:
                uses[here[0]].add(there)
    assert not uses["inference"]
    assert {room for room in rooms if "diagnose" in uses[room]} == {"blind", "plan"}


@pytest.mark.parametrize("file", sorted(set(re.findall(r"`([\w/]+\.py)`", MAP))))
def test_files_of_the_map(file: str) -> None:
    assert (ROOT / "tyrecal" / file).is_file() or (ROOT / file).is_file()


def test_names_of_the_map() -> None:
    """A name in backticks behind a file, before the next one, is defined there."""
    count = 0
    for line in MAP.replace("\n   ", " ").splitlines():
        marks = re.findall(r"`([^`]+)`", line)
        files = [mark for mark in marks if re.fullmatch(r"[\w/]+\.py", mark)]
        for file in files:
            path = next(p for p in (ROOT / "tyrecal" / file, ROOT / file) if p.is_file())
            defined = set(
                re.findall(r"^(?: *(?:class|def) )?(\w+)", path.read_text(), re.MULTILINE)
            )
            follows = marks[marks.index(file) + 1 :][:1]
            if follows and re.fullmatch(r"[A-Za-z_]+", follows[0]) and follows[0] not in ("deck",):
                assert follows[0] in defined, f"{file} has no {follows[0]}"
                count += 1
    assert count >= 15


def test_a_constants_name_means_one_thing() -> None:
    """Few are defined twice: where somebody else's way of doing the same is wanted, as of the
    blind trials' judge, or every file of a kind has its own, as an effect."""
    files: dict[str, set[str]] = {}
    for module, path in modules().items():
        for node in tree(path).body:
            targets = getattr(node, "targets", [getattr(node, "target", None)])
            for each in (x for target in targets if target for x in ast.walk(target)):
                if isinstance(each, ast.Name) and each.id.isupper():
                    files.setdefault(each.id, set()).add(module)
    twice = {name: sorted(values) for name, values in files.items() if len(values) > 1}
    assert len(twice) <= 10, twice
    assert not list(filter(re.compile(OTHER_LIMITS).match, files)), "name limits MAX_ or MIN_"


def test_a_class_name_means_one_thing() -> None:
    places: dict[str, list[str]] = {}
    for module, path in modules().items():
        for node in tree(path).body:
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(module)
    assert not {name: where for name, where in places.items() if len(where) > 1}


KINDS = {"Stations", "SectionDeck", "DecksIn3D", "UserDecks", "OwnDeck", "OwnDecks", "OwnDeckMesh"}


BRANCHES_BY_KIND_LEFT = 5  # may only fall: a tyre's kind answers (`tyre/case/kinds`)


def conditions(path: Path) -> Iterator[ast.expr]:
    """The expressions on which a file decides something."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.If | ast.IfExp | ast.While | ast.Assert):
            yield node.test
        elif isinstance(node, ast.comprehension):
            yield from node.ifs
        elif isinstance(node, ast.BoolOp):
            yield from node.values


def branches_by_kind(path: Path) -> Iterator[ast.expr]:
    """Parts of a file that tell stations, section decks and decks in three dimensions apart."""
    for node in (x for condition in conditions(path) for x in ast.walk(condition)):
        if isinstance(node, ast.Attribute) and node.attr in ("deck", "decks", "drawn"):
            yield node
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Call):
            words = set(re.findall(r"\w+", ast.unparse(node)))
            called = ast.unparse(node.func)
            if called == "stands_in_space" or (called == "isinstance" and words & KINDS):
                yield node


def test_few_branches_by_kind_of_tyre() -> None:
    """Whoever needs to know how a case gives its tyre calls `TyreKind`."""
    inside = ("tyrecal.tyre.case.kinds.", "tyrecal.tyre.own_deck.")
    branches = {
        (name, node.lineno, ast.unparse(node))
        for name, path in modules().items()
        if name.startswith("tyrecal.") and not name.startswith(inside)
        for node in branches_by_kind(path)
    }
    assert len(branches) == BRANCHES_BY_KIND_LEFT, "\n".join(map(str, sorted(branches)))


SHAPE = re.compile(r"\(((?:\d*[a-z]|\d)(?:, (?:\d*[a-z]|\d|[a-z]{2,}))*,?)\)")


COORDINATES = frozenset("rzxycui")  # tuples with one of these are places, labels, vectors


LETTERS = [
    (re.findall(r"`([\w/]+)`", folders), set(re.findall(r"`(\w)`", letters)))
    for folders, letters in re.findall(
        r"^\| ([^|]+) \| ([^|]+) \|$",
        MAP.partition("## Letters in docstrings")[2].partition("\nIn `solvers`")[0],
        re.MULTILINE,
    )
]


def shape_letters(text: str) -> set[str]:
    """Letters of the shapes of arrays, as n and v of "(n, v)", in a docstring or comment."""
    letters: set[str] = set()
    for (inner,) in map(re.Match.groups, SHAPE.finditer(text)):
        sizes = {size.lstrip("0123456789") for size in re.findall(r"\w+", inner)}
        if "," in inner and not inner.startswith("a, b") and not sizes & COORDINATES:
            letters |= {size for size in sizes if len(size) == 1}
    return letters


@pytest.mark.parametrize("package", PACKAGES)
def test_letters_of_shapes_are_in_the_map_or_explained(package: str) -> None:
    """In the table of letters, by folder, or in the file as "q: ...", "q and w: ...", "q rows" or
    "rows (q, ...)"."""
    unknown = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        docs = [ast.get_docstring(n) or "" for n in ast.walk(tree(path)) if isinstance(n, DOCS)]
        words = "\n".join([*docs, *re.findall(r"(?:^ *|  )# (.*)$", text, re.MULTILINE)])
        name = path.relative_to(ROOT).as_posix()
        known = {
            letter
            for folders, letters in LETTERS
            if name.startswith(tuple(f"{folder}/" for folder in folders))
            for letter in letters
        }
        explained = r"\b{0}(, \w)*( and \w)?(:| [a-z]{{4,}}| = )|s \({0},"
        left = [
            x for x in shape_letters(words) - known if not re.search(explained.format(x), words)
        ]
        if left:
            unknown[name] = sorted(left)
    assert not unknown


TOP = Path(tyrecal_solvers.bundled.__file__).parent


FLOORS = [["deck"], ["section"], ["modes", "solid3d"], ["nonuniform", "road"], [""]]


FLOOR = {room: i for i, rooms in enumerate(FLOORS) for room in rooms}


def imports(path: Path) -> set[Path]:
    """The solver's files that a file imports."""
    paths = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            modules = [folder / name.name for name in node.names] if folder.is_dir() else [folder]
            paths |= {m.with_suffix(".py") for m in modules if m.with_suffix(".py").exists()}
    return {path for path in paths if path.is_relative_to(TOP)}  # not what all solvers share


def room(path: Path) -> str:
    return path.relative_to(TOP).parts[0] if path.parent != TOP else ""


def test_imports_of_the_solver_run_downwards() -> None:
    graph = {path: imports(path) for path in TOP.rglob("*.py")}
    for path, needed in graph.items():
        for other in needed:
            here, there = room(path), room(other)
            assert here == there or FLOOR[there] < FLOOR[here], (path, other)
    assert sum(map(len, graph.values())) > 100  # the reading of imports works
    TopologicalSorter(graph).prepare()


def test_at_most_seven_rooms_at_first_sight() -> None:
    folders = {path.name for path in TOP.iterdir() if (path / "__init__.py").exists()}
    assert folders == set(FLOOR) - {""} and len(folders) <= 7
