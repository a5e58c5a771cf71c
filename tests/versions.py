"""Installs tyrecal with the lowest versions that pyproject.toml states, and with the newest ones.

With each it runs tests of the command line, a fit, a diagnosis and the report:

    python -m tests.versions

Lowest: every package at its lower bound at once, on the lowest Python that is stated. Newest: on
the newest Python of this machine, from the wheel that the source archive builds; its files
are compared with the tree's. Where an environment would have this one's versions and Python, its
tests are left out: `pytest` here is the same. Nothing is compiled. Exits with 1 if one of them
fails, or if the lowest Python is not here.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZipFile

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
TESTS = [
    "tests/cli/test_cli.py",
    "tests/cli/test_conventions.py",
    "tests/cli/test_mistakes.py",
    "tests/cli/test_after_a_good_fit.py",
    "tests/case/test_case.py",  # what Pydantic refuses, and does not
    "tests/report/test_pictures.py",  # what Matplotlib leaves out
]
LOWEST = "lowest-direct"  # of what is stated; what that needs in turn is the newest
CASE = ROOT / "cases/p235_75r17.yaml"
MEASURED = ROOT / "cases/measured/p235_75r17_soft_clamp.csv"
PACKAGES = {"tyrecal": "tyrecal", "tyrecal_solvers": "solvers", "tyrecal_templates": "templates"}
ENV = {**os.environ, "UV_PYTHON_DOWNLOADS": "never"}  # what is tested is what the machine has


def run(words: list[str | Path], folder: Path = ROOT) -> str:
    """The output of a command. Raises CalledProcessError."""
    return subprocess.run(
        words, check=True, cwd=folder, env=ENV, text=True, stdout=subprocess.PIPE
    ).stdout


def pythons() -> dict[int, Path]:
    """Interpreters of this machine, those of pyenv too, by the second part of their version."""
    folders = [Path(sys.executable).parent, *map(Path, os.environ["PATH"].split(os.pathsep))]
    folders += Path.home().glob(".pyenv/versions/*/bin")
    known: dict[int, Path] = {}
    for path in (path for folder in folders for path in folder.glob("python3.*")):
        minor = re.fullmatch(r"python3\.(\d+)", path.name)
        if minor and int(minor[1]) not in known:
            started = subprocess.run([path, "-c", "import venv"], capture_output=True)
            if not started.returncode:  # on the path may be stand-ins of pyenv that start none
                known[int(minor[1])] = path
    return known


def build(uv: Path, folder: Path) -> Path:
    """The wheel, built from the source archive. Raises CalledProcessError."""
    run([uv, "build", "-q", ROOT, "--out-dir", folder])
    (wheel,) = folder.glob("*.whl")
    return wheel


def differences(wheel: Path) -> list[str]:
    """Files of the wheel that are not the tree's, and files of the tree that it lacks: it has no
    tests, cases and guides, and all of the packages but their documents."""
    tree = {
        f"{package}/{path.relative_to(ROOT / top).as_posix()}": path
        for package, top in PACKAGES.items()
        for path in (ROOT / top).rglob("*")
        if path.is_file() and path.suffix not in (".md", ".pyc")
    }
    with ZipFile(wheel) as file:
        names = {name for name in file.namelist() if ".dist-info/" not in name}
        changed = {
            name for name in names & tree.keys() if file.read(name) != tree[name].read_bytes()
        }
    return sorted((names ^ tree.keys()) | changed)


def install(
    uv: Path, python: Path, resolution: str, folder: Path, wheel: Path
) -> dict[str, Version]:
    """The packages that tyrecal, its extras and its tests state, as installed in a new environment
    ``folder``; the lowest of a tree, of which alone uv takes these. Raises CalledProcessError."""
    run([uv, "venv", "-q", "--python", python, folder])
    into = ["--python", folder]
    wheels = ["--only-binary", ":all:", "--no-binary", PROJECT["name"]]
    tyrecal = ["-e", f"{ROOT}[dev]"] if resolution == LOWEST else [f"{wheel}[dev]"]
    how = ["-q", "--resolution", resolution, *(wheels if resolution == LOWEST else wheels[:2])]
    run([uv, "pip", "install", *how, *into, *tyrecal])
    lines = run([uv, "pip", "freeze", "-q", *into]).splitlines()
    versions = dict(line.split("==") for line in lines if "==" in line)
    return {name: Version(versions[name]) for name in stated()}


def stated() -> dict[str, Version]:
    """Lowest versions by package in pyproject.toml."""
    texts = PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]
    bounds = {}
    for requirement in map(Requirement, texts):
        (bound,) = requirement.specifier
        bounds[canonicalize_name(requirement.name)] = Version(bound.version.removesuffix(".*"))
    return bounds


def passes(name: str, python: Path, folder: Path, known: bool) -> bool:
    """Return whether tests, fit, diagnosis and report end with code 0; known: no tests."""
    start = time.monotonic()
    folder.mkdir()
    tyrecal = [python, "-m", "tyrecal"]
    command = [python, "-m", "pytest", "-m", "quick", "-p", "no:cacheprovider", *TESTS]
    try:
        tests = "the versions of this environment" if known else run(command)
        coarse = [CASE, "--mesh", "coarse", "--quiet"]
        run([*tyrecal, "fit", *coarse], folder)
        effect = ["--effect", "spindle_tilt", "--no-pictures"]
        run([*tyrecal, "diagnose", *coarse, "--measured", MEASURED, *effect], folder)
        run([*tyrecal, "report", CASE.stem], folder)
    except subprocess.CalledProcessError as error:
        print(f"{name}: {error}\n{error.stdout}", flush=True)
        return False
    last = tests.strip().splitlines()[-1]
    print(
        f"{name}: {last}, fit, diagnosis and report end [{time.monotonic() - start:.0f} s]",
        flush=True,
    )
    return True


def main() -> int:
    here = pythons()
    lowest, newest = int(PROJECT["requires-python"].removeprefix(">=3.")), max(here)
    if lowest not in here:
        print(f"not run: there is no Python 3.{lowest} here")
        return 1
    environments = {
        f"lowest versions, Python 3.{lowest}": (here[lowest], LOWEST),
        f"newest versions, Python 3.{newest}": (here[newest], "highest"),
    }
    with TemporaryDirectory() as name:
        folder = Path(name)
        run([sys.executable, "-m", "pip", "install", "-q", "--target", folder / "uv", "uv"])
        wheel = build(folder / "uv/bin/uv", folder / "dist")
        if wrong := differences(wheel):
            print("files of the wheel differ from the tree's:", *wrong)
            return 1
        jobs = []
        for number, (words, (python, resolution)) in enumerate(environments.items()):
            start, place = time.monotonic(), folder / f"env{number}"
            versions = install(folder / "uv/bin/uv", python, resolution, place, wheel)
            print(f"{words}, installed [{time.monotonic() - start:.0f} s]:")
            print(*(f"{name} {version}" for name, version in versions.items()), sep=", ")
            if resolution == LOWEST and versions != stated():
                print("these are not the lowest that pyproject.toml states")
                return 1
            here_too = {name: Version(version(name)) for name in versions}
            known = versions == here_too and python == here.get(sys.version_info.minor)
            jobs.append((words, place / "bin/python", folder / f"results{number}", known))
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            return not all([*pool.map(lambda job: passes(*job), jobs)])  # a failure stops no other


if __name__ == "__main__":
    sys.exit(main())
