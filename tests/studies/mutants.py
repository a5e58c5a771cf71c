"""Mutants: small changes of the product's code, each of which some test should notice.

    python tests/studies/mutants.py cover           which test executes which line
    python tests/studies/mutants.py run SEED        200 mutants of the last commit
    python tests/studies/mutants.py table           the record, by area

Works in copies of a commit beside the system's temporary files; the checkout stays as it is. `run`
draws lines, so many an area, and one change of each, of Python and of the page's templates. A
mutant meets the tests that execute its line, by what `cover` found there or on an earlier commit,
the quickest first, up to a budget of processor time, and tests of its area that are newer; one of a
template all tests of the page. It runs in a fork of a process that has
imported and collected everything, with the changed function's code exchanged; what is executed on
import, and tests that start processes, need a mutated copy.

Every mutant is a line of mutants.jsonl; where that has the commit, seed and number already, `run`
goes on behind; with a larger budget those that survived a smaller one meet more tests, with --slow
those too that are not quick, as far as `cover` knows them, and their last line counts; --areas
leaves the others out. What survived is judged by hand: the keys `verdict` and `because` of its
line.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import gc
import importlib
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import coverage
import pytest

ROOT = Path(__file__).parents[2]
# worker processes of tests import this file anew, and then the tree that is tested
sys.path[0] = os.environ.get("MUTANTS_TREE", str(ROOT))
from tests.studies.mutation import Mutant, exchange, functions, mutants_of, template_mutants_of  # noqa: E402

RECORD = ROOT / "tests" / "benchmarks" / "mutants.jsonl"
PLACE = Path(tempfile.gettempdir()) / "mutants"
QUOTA = {  # lines of every 200
    "solvers/bundled": 97,
    "solvers/calculix": 13,
    "tyrecal/studies/fit": 23,
    "tyrecal/studies/diagnose": 26,
    "tyrecal/simulate/modes": 13,
    "tyrecal/simulate/evaluate": 13,
    "tyrecal/measured": 15,
    "tyrecal/report": 20,
    "tyrecal/cli": 20,
    "tyrecal/tyre/section": 8,
    "templates/report": 8,
}
NEW = {  # where an area's tests are; else tests/AREA/
    "solvers/calculix": "tests/solvers/",
    "tyrecal/tyre/section": "tests/tyre/",
    "templates/report": "tests/report/html/",
}
PROCESSES = {  # tests whose work happens in processes that `cover` does not see into
    "solvers/calculix/": ["tests/solvers/test_calculix_runs.py"],
    "tyrecal/simulate/evaluate/pool": ["tests/evaluate/test_pool.py"],
    "tyrecal/simulate/evaluate/executor": ["tests/evaluate/test_pool.py"],
    "tyrecal/simulate/evaluate/cluster": ["tests/batch/test_cluster.py"],
}
QUICK = "not (slow or guide or ccx or browser or cluster or lint)"
SLOW = QUICK.replace("slow or ", "")
STEPS_S = (0.1, 0.5, 2.0)  # of processor time, between cheap tests and dear ones
UNKNOWN_S = 0.7  # of a test that `cover` has not met
LONGEST_S = 600.0  # the clock's; a busy machine is slow
OURS = {"tyrecal", "tyrecal_solvers", "tyrecal_templates", "tests"}


def area_of(file: str) -> str:
    """The area of QUOTA that a file is in, else its folder."""
    return next((a for a in QUOTA if file.startswith(f"{a}/")), file.rpartition("/")[0])


def drawn(tree: Path, seed: int, count: int, areas: Sequence[str] = ()) -> list[Mutant]:
    """``count`` mutants, ``areas`` (none: all) in the proportions of QUOTA, mixed."""
    chance, chosen = random.Random(seed), []
    quota = {area: share for area, share in QUOTA.items() if not areas or area in areas}
    for area, share in quota.items():
        lines: dict[tuple[str, int], list[Mutant]] = defaultdict(list)
        for path in sorted((tree / area).rglob("*")):
            file = path.relative_to(tree).as_posix()
            of = {".py": mutants_of, ".j2": template_mutants_of}.get(path.suffix)
            for mutant in of(file, path.read_bytes()) if of else ():
                lines[mutant.file, mutant.line].append(mutant)
        wanted = round(share * count / sum(quota.values()))
        for place in chance.sample(sorted(lines), wanted):
            source = (tree / place[0]).read_bytes()
            chosen.append(chance.choice([m for m in lines[place] if m.compiles(source)]))
    chance.shuffle(chosen)
    return chosen


class Cover:
    """Tests that execute each line of a copy, from the files that `mutants_cover` wrote."""

    def __init__(self, tree: Path):
        self.tree = tree
        self.seconds: dict[str, float] = {}
        self.failing: set[str] = set()
        self.lines: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        for path in sorted(PLACE.glob("cover-*.json")):
            written = json.loads(path.read_text())
            names = [name for name, _ in written["tests"]]
            self.seconds.update(written["tests"])
            self.failing |= set(written["failed"])
            for file, lines in written["lines"].items():
                if (tree / file).exists():
                    now = self._moved(written["commit"], file)
                    for line, tests in lines.items():
                        if int(line) in now:
                            self.lines[file][now[int(line)]] |= {names[i] for i in tests}

    def _moved(self, commit: str, file: str) -> dict[int, int]:
        """Lines of a file at an earlier commit to the same lines of today."""
        show = ["git", "show", f"{commit}:{file}"]
        old = subprocess.run(show, cwd=ROOT, capture_output=True, text=True, check=False).stdout
        new = (self.tree / file).read_text()
        if old == new:
            return {i: i for i in range(1, old.count("\n") + 2)}
        same = difflib.SequenceMatcher(None, old.splitlines(), new.splitlines(), False)
        blocks = same.get_matching_blocks()
        return {a + i + 1: b + i + 1 for a, b, size in blocks for i in range(size)}

    def chosen(self, mutant: Mutant, known: Iterable[str], budget_s: float) -> list[str]:
        """Node ids of ``known``, the cheap ones first, and of those its module's, file by file."""
        who, area = self._who(mutant), area_of(mutant.file)
        home = NEW.get(area, f"tests/{area.rpartition('/')[2]}/")
        own = f"test_{Path(mutant.file).stem}.py"

        def order(test: str) -> tuple[int, bool, str, float]:
            cost, file = self.seconds.get(test, UNKNOWN_S), test.partition("::")[0]
            return sum(cost > step for step in STEPS_S), Path(file).name != own, file, cost

        tests: list[str] = []
        spent, is_template = 0.0, not mutant.file.endswith(".py")
        for test in sorted(known, key=order):
            new = (test not in self.seconds or is_template) and test.startswith(home)
            if (test in who or new) and test not in self.failing:
                if (spent := spent + self.seconds.get(test, UNKNOWN_S)) > budget_s and tests:
                    break
                tests.append(test)
        return tests

    def _who(self, mutant: Mutant) -> set[str]:
        """Tests that execute a mutant: for a line in a function those that execute it; for one that
        is executed on import those that execute the function it heads, or a line with a name that
        it sets."""
        if not mutant.file.endswith(".py"):
            return set()
        lines = self.lines[mutant.file]
        function, names = place_of(mutant, (self.tree / mutant.file).read_bytes())
        if function:
            first, last = function.body[0].lineno, function.end_lineno or 0
            if mutant.line < first:
                return set().union(*(lines.get(i, set()) for i in range(first, last + 1)))
            before = [line for line in lines if first <= line <= mutant.line]
            return lines[max(before)] if before else set()
        if not names:
            return set().union(*lines.values())
        named, running = re.compile(r"\b(" + "|".join(map(re.escape, names)) + r")\b"), set()
        for file, tests in self.lines.items():
            for number, text in enumerate((self.tree / file).read_text().splitlines(), 1):
                if named.search(text):
                    running |= tests.get(number, set())
        return running


def place_of(mutant: Mutant, source: bytes) -> tuple[ast.FunctionDef | None, set[str]]:
    """The innermost function around a mutant; outside of one the names that its statement sets."""
    function: ast.FunctionDef | None = None
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.stmt) and node.lineno <= mutant.line <= (node.end_lineno or 0):
            if isinstance(node, ast.FunctionDef):
                function = node
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                names |= {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}
    return function, names


class Watch:
    """pytest plugin: the chosen tests alone, in their order; which failed, and how many ran."""

    def __init__(self, names: list[str], files: list[str]):
        self.place = {name: i for i, name in enumerate(names)}
        self.files, self.failed, self.ran = files, "", 0

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        whole = lambda item: item.nodeid.partition("::")[0] in self.files
        items[:] = [item for item in items if item.nodeid in self.place or whole(item)]
        items.sort(key=lambda item: self.place.get(item.nodeid, len(self.place)))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.ran += report.when == "call"
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed and not self.failed:
            self.failed = f"{report.nodeid} cannot be imported"


class Runner:
    """pytest plugin: in place of running what was collected, mutants meet it in forks."""

    def __init__(self, given: argparse.Namespace, commit: str, tree: Path):
        self.given, self.commit, self.tree = given, commit, tree
        self.imports = coverage.Coverage(
            data_file=None, source=[str(tree / name) for name in ("tyrecal", "solvers")]
        )
        self.items: dict[str, pytest.Item] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.imports.stop()
        data = self.imports.get_data()
        self.imported = {
            str(Path(file).resolve().relative_to(self.tree.resolve())): set(data.lines(file) or ())
            for file in data.measured_files()
        }
        cover = Cover(self.tree)
        self.items = {
            item.nodeid: item
            for item in session.items
            if item.nodeid in cover.seconds or not item.get_closest_marker("slow")
        }
        self.functions = functions(OURS)
        gc.collect()
        gc.freeze()  # forks share what nobody touches
        rows = [json.loads(line) for line in read(self.given.record)]
        key = self.commit, self.given.seed
        done = {
            row["number"]
            for row in rows
            if (row["commit"], row["seed"]) == key
            and (row["outcome"] == "killed" or row["budget"] >= self.given.budget)
        }
        mutants = list(
            enumerate(drawn(self.tree, self.given.seed, self.given.count, self.given.areas))
        )
        only = {int(number) for number in self.given.only.split(",") if number}
        todo = [(i, m) for i, m in mutants if i not in done and (not only or i in only)]
        free = [self._slot(i) for i in range(self.given.jobs)]
        busy: dict[int, tuple[Path, int, Mutant, float]] = {}
        try:
            while todo or busy:
                while free and todo:
                    slot, (number, mutant) = free.pop(), todo.pop(0)
                    names = cover.chosen(mutant, self.items, self.given.budget)
                    files = next((t for p, t in PROCESSES.items() if mutant.file.startswith(p)), [])
                    run = lambda s=slot, m=mutant, n=names, f=files: self._meet(s, m, n, f)
                    process = forked(slot, run, 60 + 10 * self.given.budget)
                    busy[process] = slot, number, mutant, time.monotonic()
                time.sleep(0.02)
                for process, (slot, number, mutant, began) in list(busy.items()):
                    if time.monotonic() - began > LONGEST_S:
                        os.killpg(process, signal.SIGKILL)
                    ended, code = os.waitpid(process, os.WNOHANG)
                    if ended:
                        del busy[process]
                        row = {
                            "commit": self.commit,
                            "seed": self.given.seed,
                            "number": number,
                            "file": mutant.file,
                            "line": mutant.line,
                            "kind": mutant.kind,
                            "old": mutant.old[:200],
                            "new": mutant.new[:200],
                            "budget": self.given.budget,
                            **outcome(slot, process, code, began),
                        }
                        with self.given.record.open("a") as out:
                            kept = {
                                k: v
                                for k, v in row.items()
                                if row["outcome"] != "killed" or k != "by"
                            }
                            out.write(json.dumps(kept) + "\n")
                        fields = number, mutant.file, mutant.line, row["outcome"], row["by"]
                        print(*fields, f"{row['seconds']} s", file=sys.__stdout__, flush=True)
                        free.append(slot)
        finally:
            for process in busy:
                with suppress(ProcessLookupError):
                    os.killpg(process, signal.SIGKILL)
        return True

    def _slot(self, number: int) -> Path:
        """A copy to be mutated, with the bytecode of the other."""
        slot = self.tree.parent / f"slot{number}"
        shutil.rmtree(slot, ignore_errors=True)
        shutil.copytree(self.tree, slot, symlinks=True)
        return slot

    def _meet(self, slot: Path, mutant: Mutant, names: list[str], files: list[str]) -> Watch:
        """Run the tests in this process with the function exchanged, or with everything imported
        again."""
        path = slot / mutant.file
        source = path.read_bytes()
        module = mutant.file.removesuffix(".py").replace("/", ".")
        module = module.replace("solvers.", "tyrecal_solvers.", 1).removesuffix(".__init__")
        is_python = mutant.file.endswith(".py")
        function = place_of(mutant, source)[0] if is_python else None
        inside = function and function.body[0].lineno <= mutant.line
        on_import = mutant.line in self.imported.get(mutant.file, set())
        watch = Watch(names, files)
        if inside and not on_import and exchange(self.functions[module], source, mutant.of(source)):
            chosen = [self.items[name] for name in names]
            if chosen:
                chosen[0].config.pluginmanager.register(watch)
            for item, following in zip(chosen, [*chosen, None][1:], strict=True):
                item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
                if watch.failed:
                    return watch
            if not files:
                return watch
            names, watch = [], Watch([], files)
        paths = [*dict.fromkeys(name.partition("::")[0] for name in names), *files]
        if not paths:
            return watch
        path.write_bytes(mutant.of(source))
        try:
            for name in [name for name in sys.modules if name.partition(".")[0] in OURS]:
                del sys.modules[name]
            os.chdir(slot)
            os.environ["MUTANTS_TREE"] = os.environ["PYTHONPATH"] = sys.path[0] = str(slot)
            importlib.invalidate_caches()
            pytest.main([*OPTIONS, "-x", *paths], [watch])
        finally:
            path.write_bytes(source)
        return watch


OPTIONS = ["-q", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "addopts=--strict-markers"]


def forked(slot: Path, run: Callable[[], Watch], seconds: float) -> int:
    """Run in a fork with so much processor time; what was found is written beside the slot."""
    Path(f"{slot}.json").unlink(missing_ok=True)
    if child := os.fork():
        return child
    code = 1
    try:
        os.setsid()
        os.nice(5)
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        log = os.open(f"{slot}.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        shutil.rmtree(f"{slot}.tmp", ignore_errors=True)
        Path(f"{slot}.tmp").mkdir()
        os.environ["TMPDIR"] = tempfile.tempdir = f"{slot}.tmp"
        watch = run()
        Path(f"{slot}.json").write_text(json.dumps({"failed": watch.failed, "ran": watch.ran}))
        code = 0
    finally:
        os._exit(code)


def outcome(slot: Path, process: int, code: int, began: float) -> dict[str, Any]:
    """Outcome of one mutant, with its processes ended."""
    with suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)
    written = Path(f"{slot}.json")
    report = json.loads(written.read_text()) if written.exists() else {}
    seconds = round(time.monotonic() - began, 1)
    if not report:
        why = "it does not end" if os.WIFSIGNALED(code) else "it ends Python"
        return {"outcome": "killed", "by": why, "seconds": seconds}
    if report["failed"]:
        return {"outcome": "killed", "by": report["failed"], "seconds": seconds}
    return {"outcome": "survived", "by": f"{report['ran']} tests", "seconds": seconds}


def copy_of(commit: str) -> Path:
    """A copy of the commit, with the names that packages are imported by."""
    tree = PLACE / commit / "base"
    if not tree.exists():
        tree.mkdir(parents=True)
        archive = subprocess.Popen(["git", "archive", commit], cwd=ROOT, stdout=subprocess.PIPE)
        subprocess.run(["tar", "-x", "-C", tree], stdin=archive.stdout, check=True)
        for short in ("solvers", "templates"):
            (tree / f"tyrecal_{short}").symlink_to(short)
    return tree


def enter(tree: Path) -> None:
    """Make this process, and those that it starts, import the copy."""
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(tree), "MUTANTS_TREE": str(tree)}
    os.chdir(tree)
    for name in [name for name in sys.modules if name.partition(".")[0] in OURS]:
        del sys.modules[name]
    sys.path[0] = str(tree)


def read(record: Path) -> list[str]:
    return record.read_text().splitlines() if record.exists() else []


def table(record: Path) -> None:
    """Per draw and area: drawn, killed, and the verdicts on those that survived."""
    counts: dict[tuple[str, int, str], Counter[str]] = defaultdict(Counter)
    rows = [json.loads(line) for line in read(record)]
    last = {(row["commit"], row["seed"], row["number"]): row for row in rows}
    for row in last.values():
        for area in (area_of(row["file"]), "all"):
            count = counts[row["commit"], row["seed"], area]
            count["drawn"] += 1
            count["killed" if row["outcome"] == "killed" else row.get("verdict", "not judged")] += 1
    heads = ["drawn", "killed", "equivalent", "search constant", "hole", "not judged"]
    print("| commit | seed | area |", " | ".join(heads), "|")
    for (commit, seed, area), count in sorted(counts.items()):
        print(
            f"| {commit} | {seed} | {area} |", " | ".join(str(count[head]) for head in heads), "|"
        )


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["cover", "run", "table"])
    parser.add_argument("seed", nargs="?", type=int, help="of the draw")
    parser.add_argument("--tests", nargs="+", default=["tests"], help="which; by default all quick")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--areas", nargs="+", default=[], help="of QUOTA; by default all")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="numbers of mutants")
    parser.add_argument("--budget", type=float, default=60.0, help="processor time of one, s")
    parser.add_argument("--slow", action="store_true", help="tests that are not quick, too")
    parser.add_argument("--record", type=Path, default=RECORD)
    parser.add_argument("--commit", default="HEAD")
    given = parser.parse_args()
    given.record = given.record.resolve()
    if given.what == "table":
        table(given.record)
        return 0
    name = ["git", "rev-parse", "--short=10", given.commit]
    commit = subprocess.run(name, cwd=ROOT, capture_output=True, text=True, check=True)
    tree = copy_of(commit.stdout.strip())
    if given.what == "cover":
        shutil.copy(ROOT / "tests" / "studies" / "mutants_cover.py", tree / "tests" / "studies")
        enter(tree)
        os.environ["MUTANTS_COVER"] = str(PLACE / f"cover-{tree.parent.name}-{os.getpid()}.json")
        os.environ["MUTANTS_COMMIT"] = tree.parent.name
        plugin = ["-p", "tests.studies.mutants_cover", "-m", QUICK]
        return int(pytest.main([*OPTIONS, *plugin, *given.tests]))
    runner = Runner(given, tree.parent.name, tree)
    enter(tree)
    runner.imports.start()
    marks = SLOW if given.slow else QUICK
    return int(pytest.main([*OPTIONS, "-m", marks, *given.tests], [runner]))


if __name__ == "__main__":
    sys.exit(main())
