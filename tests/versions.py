"""Installs tyrecal with the lowest versions that pyproject.toml states, and with the newest ones.

With each it runs tests of the command line, README's fit and its report:

    python -m tests.versions

Lowest: every package at its lower bound at once, on the lowest Python that is stated. Newest: on
the newest Python of this machine. Nothing is compiled. Exits with 1 if one of them fails, or if
the lowest Python is not here.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
TESTS = [
    "tests/cli/test_cli.py",
    "tests/cli/test_conventions.py",
    "tests/cli/test_suggestions.py",
    "tests/cli/test_taken.py",
]
CASE = ROOT / "cases/p235_75r17.yaml"
ENV = {**os.environ, "UV_PYTHON_DOWNLOADS": "never"}  # what is tested is what the machine has


def run(words: list[str | Path], folder: Path = ROOT) -> str:
    """What a command prints. Raises CalledProcessError."""
    return subprocess.run(
        words, check=True, cwd=folder, env=ENV, text=True, stdout=subprocess.PIPE
    ).stdout


def pythons() -> dict[int, Path]:
    """Interpreters of this machine, those of pyenv too, by the second part of their version."""
    folders = [Path(sys.executable).parent, *map(Path, os.environ["PATH"].split(os.pathsep))]
    folders += Path.home().glob(".pyenv/versions/*/bin")
    known: dict[int, Path] = {}
    for path in (path for folder in folders for path in folder.glob("python3.*")):
        version = re.fullmatch(r"python3\.(\d+)", path.name)
        if version and int(version[1]) not in known:
            started = subprocess.run([path, "-c", "import venv"], capture_output=True)
            if not started.returncode:  # on the path may be stand-ins of pyenv that start none
                known[int(version[1])] = path
    return known


def installed(uv: Path, python: Path, resolution: str, folder: Path) -> Path:
    """The Python of a new environment with tyrecal, the extras and what tests need; says with which
    versions. Raises CalledProcessError."""
    run([uv, "venv", "-q", "--python", python, folder])
    own = folder / "bin/python"
    wheels = ["--only-binary", ":all:", "--no-binary", PROJECT["name"]]
    words = [uv, "pip", "install", "-q", "--python", own, "--resolution", resolution, *wheels]
    run([*words, "-e", f"{ROOT}[dev]"])
    needed = [re.split("[<>=]", each)[0].replace(".", "-") for each in PROJECT["dependencies"]]
    versions = run([uv, "pip", "freeze", "-q", "--python", own]).splitlines()
    print(*(each for each in versions if each.partition("==")[0] in needed), flush=True)
    return own


def passes(name: str, python: Path, folder: Path) -> bool:
    """Whether tests, fit and report end with code 0."""
    start = time.monotonic()
    folder.mkdir()
    tyrecal = [python, "-m", "tyrecal"]
    try:
        tests = run([python, "-m", "pytest", "-m", "quick", "-p", "no:cacheprovider", *TESTS])
        run([*tyrecal, "fit", CASE, "--quiet"], folder)
        run([*tyrecal, "report", CASE.stem], folder)
    except subprocess.CalledProcessError as error:
        print(f"{name}: {error}\n{error.stdout}", flush=True)
        return False
    last = tests.strip().splitlines()[-1]
    print(f"{name}: {last}, fit and report end [{time.monotonic() - start:.0f} s]", flush=True)
    return True


def main() -> int:
    here = pythons()
    lowest, newest = int(PROJECT["requires-python"].removeprefix(">=3.")), max(here)
    if lowest not in here:
        print(f"not run: there is no Python 3.{lowest} here")
        return 1
    asked = {
        f"lowest versions, Python 3.{lowest}": (here[lowest], "lowest-direct"),
        f"newest versions, Python 3.{newest}": (here[newest], "highest"),
    }
    with TemporaryDirectory() as name:
        folder = Path(name)
        run([sys.executable, "-m", "pip", "install", "-q", "--target", folder / "uv", "uv"])
        jobs = []
        for number, (words, (python, resolution)) in enumerate(asked.items()):
            start = time.monotonic()
            own = installed(folder / "uv/bin/uv", python, resolution, folder / f"env{number}")
            print(f"{words}: installed [{time.monotonic() - start:.0f} s]", flush=True)
            jobs.append((words, own, folder / f"results{number}"))
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            return not all([*pool.map(lambda job: passes(*job), jobs)])  # a failure stops no other


if __name__ == "__main__":
    sys.exit(main())
