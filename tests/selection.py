"""Which tests `pytest` runs where nothing is chosen: the quick set, and what its last lines say.

`pytest`, and `pytest FOLDER`, run the quick set and say what they left out; -m, a file and a test
that are named run what they name.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest


@dataclass(frozen=True)
class LeftOut:
    """Why tests of a marker are not in the quick set; programs they need, and who has them."""

    reason: str
    programs: tuple[str, ...] = ()
    name: str = ""
    packages: str = ""

    def missing(self) -> str:
        """Message where a program is not installed; empty where all are."""
        if all(map(shutil.which, self.programs)):
            return ""
        return f"{self.name} is not installed here (apt-get install {self.packages})"


LEFT_OUT = {  # a test with two of them counts with the first
    "ccx": LeftOut("run CalculiX", ("ccx",), "CalculiX", "calculix-ccx"),
    "browser": LeftOut(
        "look at the report's page in a browser",
        ("chromium", "chromedriver"),
        "Chromium",
        "chromium chromium-driver",
    ),
    "cluster": LeftOut("start Dask schedulers and workers"),
    "lint": LeftOut("ruff and mypy over all files"),
    "guide": LeftOut("command blocks of the guides"),
    "slow": LeftOut("take longer than those of the quick set that are as telling"),
}
COUNTS: pytest.StashKey[dict[str, int]] = pytest.StashKey()


def chosen(config: pytest.Config) -> bool:
    """The user named what to run: by -m, or by a file or a test."""
    named = (Path(argument.split("::")[0]) for argument in config.args)
    return bool(config.option.markexpr) or any(path.suffix == ".py" for path in named)


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> Iterator[None]:
    """Mark the quick set, and keep to it where nothing else was chosen."""
    left_out: dict[pytest.Item, str] = {}
    for item in items:
        for marker, why in LEFT_OUT.items():
            if item.get_closest_marker(marker):
                left_out.setdefault(item, marker)
                if missing := why.missing():
                    item.add_marker(pytest.mark.skip(reason=missing))
        if item not in left_out:
            item.add_marker("quick")
    yield  # -m and -k are heeded here
    if not chosen(config):
        gone = [item for item in items if item in left_out]
        items[:] = [item for item in items if item not in left_out]
        config.hook.pytest_deselected(items=gone)
        config.stash[COUNTS] = dict(Counter(left_out[item] for item in gone))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker of pytest-xdist tells what it left out: who reports collects nothing."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left_out"] = session.config.stash.get(COUNTS, {})


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Each worker collected the same tests: any of them may tell."""
    if counts := getattr(node, "workeroutput", {}).get("left_out"):
        node.config.stash[COUNTS] = counts


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Say what was left out, or skipped, and why."""
    skipped = Counter(
        report.longrepr[2].removeprefix("Skipped: ")
        for report in terminalreporter.stats.get("skipped", [])
    )
    for reason, count in sorted(skipped.items()):
        terminalreporter.write_line(f"skipped: {count}: {reason}")
    if counts := config.stash.get(COUNTS, {}):
        terminalreporter.write_line('left out of the quick set (all of it: pytest -m "not quick"):')
    for marker, why in LEFT_OUT.items():
        if marker in counts:
            words = why.missing() or why.reason
            terminalreporter.write_line(f"{counts[marker]:5} {marker}: {words}; pytest -m {marker}")
