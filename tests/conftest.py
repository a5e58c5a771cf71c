"""Shared by all tests: where the cases are, one BLAS thread, nothing of the user's own settings."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["TYRECAL_SETTINGS"] = ""  # not those of whoever runs the tests
os.environ.pop("TYRECAL_SOLVER_COMMAND", None)
os.environ.pop("TYRECAL_STORE", None)

import gc
import shutil
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from . import chance as chances
from . import selection

# a shell starts what runs in its background with SIGINT ignored, and commands would inherit that
if threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):  # which nohup has ignored
        signal.signal(signal.SIGHUP, signal.SIG_DFL)

ROOT = Path(__file__).parents[1]
CASES = ROOT / "cases"
SOLVED_ONCE = ("cli", "deck", "effects", "fit")  # folders whose tests only need a tyre's answers


@pytest.fixture(autouse=True)
def solved_once(request: pytest.FixtureRequest) -> None:
    """Solve each tyre once for all tests of these folders."""
    if request.path.parent.name in SOLVED_ONCE:
        from .solved import recall

        recall(request.getfixturevalue("monkeypatch"), request.getfixturevalue("tmp_path_factory"))


@pytest.fixture
def case_folder(tmp_path: Path) -> Path:
    """A copy of the main case and its section, to be edited."""
    folder = tmp_path / "my cases"
    folder.mkdir()
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        shutil.copy(CASES / name, folder)
    return folder


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--seed", type=int, default=0, help="of all that tests draw at random")


def pytest_configure(config: pytest.Config) -> None:
    chances.seed = config.option.seed
    config.pluginmanager.register(selection)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Iterator[object]:
    """Look for no garbage among 300,000 objects that stay: that took a quarter of the collection,
    and again and again some time of the tests."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        gc.set_threshold(20_000, 20, 20)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give each file to one worker of pytest-xdist: what a file computes once for all its tests is
    not computed by every worker."""
    from xdist.scheduler import LoadFileScheduling

    return LoadFileScheduling(config, log) if config.getoption("dist") == "load" else None


@pytest.fixture
def chance(request: pytest.FixtureRequest) -> Iterator[chances.Chance]:
    """Draws, and claims about them whose false failures the test's docstring states."""
    here = chances.Chance(request.node.name)
    yield here
    request.node.user_properties.append(("seen", here.seen))  # for tests/studies/chance.py
    stated = chances.stated(request.function.__doc__)
    assert here.spent <= 1.001 * stated, f"claims fail falsely at {here.spent:g}, not {stated:g}"
