"""pytest plugin: which test executes which line of the product, for `mutants.py`.

`python -m pytest -p tests.studies.mutants_cover` writes the JSON file that $MUTANTS_COVER names,
tests: node id, processor seconds; failed: tests that fail without any mutant; lines: source file,
line, indices of the tests that execute it.
What a shared fixture executes counts for every test that asks for the fixture.
"""

from __future__ import annotations

import json
import os
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import coverage
import pytest

ROOT = Path(__file__).parents[2]
PRODUCT = ("tyrecal", "solvers")
recorder = coverage.Coverage(data_file=None, source=[str(ROOT / p) for p in PRODUCT])
tests: dict[str, float] = {}
fixtures: dict[str, list[str]] = defaultdict(list)  # context of a fixture -> tests that ask for it
failed: set[str] = set()
contexts: list[str] = [""]


def pytest_sessionstart() -> None:
    recorder.start()


def _enter(context: str) -> None:
    contexts.append(context)
    recorder.switch_context(context)


def _leave() -> None:
    contexts.pop()
    recorder.switch_context(contexts[-1])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    start = time.process_time()
    for definitions in item._fixtureinfo.name2fixturedefs.values():  # type: ignore[attr-defined]
        fixtures[f"{definitions[-1].baseid}@{definitions[-1].argname}"].append(item.nodeid)
    _enter(item.nodeid)
    try:
        return (yield)
    finally:
        _leave()
        tests[item.nodeid] = time.process_time() - start


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef) -> Iterator[None]:
    if fixturedef.scope == "function":
        return (yield)
    _enter(f"{fixturedef.baseid}@{fixturedef.argname}")
    try:
        return (yield)
    finally:
        _leave()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        failed.add(report.nodeid)


def pytest_sessionfinish() -> None:
    recorder.stop()
    data = recorder.get_data()
    names = list(tests)
    number = {name: i for i, name in enumerate(names)}
    lines: dict[str, dict[int, list[int]]] = {}
    for path in sorted(data.measured_files()):
        lines[str(Path(path).relative_to(ROOT))] = {
            line: sorted(
                {number[t] for c in contexts for t in ([c] if c in number else fixtures[c])}
            )
            for line, contexts in sorted(data.contexts_by_lineno(path).items())
        }
    Path(os.environ["MUTANTS_COVER"]).write_text(
        json.dumps(
            {
                "commit": os.environ["MUTANTS_COMMIT"],
                "tests": list(tests.items()),
                "failed": sorted(failed),
                "lines": lines,
            }
        )
    )
