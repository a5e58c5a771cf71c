"""Default selection of `pytest`, and the report of what it left out, and why.

Claims about draws: each test states how often it fails falsely, and all together stay rare.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from math import comb
from pathlib import Path

import numpy as np
import pytest

from .chance import LIMIT, RATE, Chance, budget, generator
from .conftest import ROOT
from .selection import LEFT_OUT

FILE = "import pytest\ndef test_quick(): pass\n" + "".join(
    f"@pytest.mark.{marker}\ndef test_{marker}(): pass\n" for marker in LEFT_OUT
)
FILE += "@pytest.mark.slow\n@pytest.mark.guide\ndef test_both(): pass\n"
OTHERS = {f"test_{marker}" for marker in LEFT_OUT} | {"test_both"}


@pytest.fixture(scope="module")
def tests(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of tests, one a marker."""
    folder = tmp_path_factory.mktemp("selection") / "tests"
    folder.mkdir()
    (folder / "test_all.py").write_text(FILE)
    return folder


def pytest_of(folder: Path, *arguments: str, **environment: str) -> tuple[set[str], str]:
    """The tests that ran or were skipped, and the last lines."""
    given = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    given |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(ROOT)} | environment
    command = [sys.executable, "-m", "pytest", "-c", ROOT / "pyproject.toml", "--rootdir", folder]
    command += ["-p", "tests.selection", "-p", "xdist", "-v", "-v", *arguments]
    done = subprocess.run(command, cwd=folder, env=given, capture_output=True, text=True)
    assert done.returncode in (0, pytest.ExitCode.NO_TESTS_COLLECTED), done.stdout + done.stderr
    ran = re.findall(r"::(\w+)\S* (?:PASSED|SKIPPED)|(?:PASSED|SKIPPED)\S* \S+::(\w+)", done.stdout)
    return {first or second for first, second in ran}, done.stdout.partition("left out of")[2]


@pytest.mark.parametrize("workers", [[], pytest.param(["-n", "2"], marks=pytest.mark.slow)])
def test_the_quick_set_is_run_and_the_rest_is_said(tests: Path, workers: list[str]) -> None:
    ran, report = pytest_of(tests, *workers, str(tests), PATH="")
    assert ran == {"test_quick"}
    lines = report.splitlines()
    counts = dict(re.findall(r"^ +(\d+ \w+): (.*)$", report, re.M))
    assert list(counts) == [f"{1 + (m == 'guide')} {m}" for m in LEFT_OUT], report
    assert "CalculiX is not installed here (apt-get install calculix-ccx)" in counts["1 ccx"]
    assert "Chromium is not installed here" in counts["1 browser"]
    assert counts["1 slow"] == f"{LEFT_OUT['slow'].reason}; pytest -m slow"
    assert "1 passed" in lines[-1]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["-m", "slow"], {"test_slow", "test_both"}),
        (["-m", "not quick"], OTHERS),
        pytest.param(["-m", "quick"], {"test_quick"}, marks=pytest.mark.slow),
        pytest.param(["test_all.py::test_slow"], {"test_slow"}, marks=pytest.mark.slow),
        (["test_all.py"], OTHERS | {"test_quick"}),
    ],
)
def test_what_is_chosen_is_run(tests: Path, arguments: list[str], expected: set[str]) -> None:
    ran, report = pytest_of(tests, *arguments)
    assert ran == expected and not report


@pytest.mark.slow
def test_words_choose_in_the_quick_set(tests: Path) -> None:
    ran, report = pytest_of(tests, "-k", "quick or slow")
    assert ran == {"test_quick"} and " 1 slow: " in report and "lint" not in report


@pytest.mark.slow
def test_what_is_missing_is_said_where_it_is_asked_for(tests: Path) -> None:
    assert pytest_of(tests, "-m", "ccx", PATH="")[0] == {"test_ccx"}


def test_each_marker_has_its_reason() -> None:
    """Every marker that is registered keeps tests out, or runs in the quick set by design."""
    registered = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pytest"]
    names = {line.partition(":")[0] for line in registered["ini_options"]["markers"]}
    assert names == {*LEFT_OUT, "quick", "numbers"}
    named = set(re.findall(r"^\| `(\w+)` \|", (ROOT / "tests/README.md").read_text(), re.M))
    assert named == {*LEFT_OUT, "numbers"}
    assert all(why.reason for why in LEFT_OUT.values())


def test_every_area_is_in_the_quick_set(request: pytest.FixtureRequest) -> None:
    if request.config.args != request.config.getini("testpaths") or request.config.option.keyword:
        pytest.skip("only a run of the whole quick set tells whether every area is in it")
    top = ROOT / "tests"
    areas = {path.relative_to(top).parts[0] for path in top.rglob("test_*.py")}
    quick = {
        item.path.relative_to(top).parts[0]
        for item in request.session.items
        if item.get_closest_marker("quick")
    }
    assert quick == areas


@pytest.mark.numbers
def test_all_claims_together_fail_falsely_once_in_ten_thousand_runs() -> None:
    rates = budget()
    silent = [name for name, rate in rates.items() if rate < RATE]
    assert rates and not silent, f"no rate in the docstring of {silent}"
    assert sum(rates.values()) <= LIMIT


@pytest.mark.numbers
def test_a_claim_that_is_false_is_refused() -> None:
    for claim in (
        lambda c: c.often(c.random.random(100) < 0.5, 0.9),
        lambda c: c.often(c.random.random(100) < 0.5, 0.0, 0.1),
        lambda c: c.distributed(c.random.random(400) ** 2, "uniform"),
        lambda c: c.zero_on_average(c.random.random(400) - 0.2, 1.0, 400 / 12),
        lambda c: c.mean(c.random.random(400), 0.7, 0.8),
        lambda c: c.scatter(c.random.normal(size=200), 1.6),
        lambda c: c.normal(c.random.normal(size=20) + 20),
    ):
        with pytest.raises(AssertionError):
            claim(Chance("false"))


@pytest.mark.numbers
def test_binomial_bounds_are_missed_at_the_rate() -> None:
    """The least number of hits that is let pass, by summing the distribution."""
    for count, low in ((20, 0.95), (300, 0.89)):
        passes = [k for k in range(count + 1) if _holds(count, k, low)]
        below = sum(comb(count, k) * low**k * (1 - low) ** (count - k) for k in range(min(passes)))
        assert below <= RATE


def _holds(count: int, hits: int, low: float) -> bool:
    try:
        Chance("").often(np.arange(count) < hits, low)
    except AssertionError:
        return False
    return True


@pytest.mark.numbers
def test_draws_hang_on_seed_and_key_alone() -> None:
    assert generator("a", 1).random() == generator("a", 1).random()
    assert generator("a", 1).random() != generator("a", 2).random()
