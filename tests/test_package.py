"""What ships: every package of the tree, and every file in it that is not Python."""

from __future__ import annotations

import fnmatch
import tomllib
from pathlib import Path

from .conftest import ROOT

SETUP = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
FOLDERS = {name: ROOT / folder for name, folder in SETUP["package-dir"].items()}


def name_of(folder: Path) -> str:
    """The package that a folder of the tree ships as."""
    for package, top in FOLDERS.items():
        if folder.is_relative_to(top):
            return ".".join([package, *folder.relative_to(top).parts])
    raise AssertionError(folder)


def files() -> list[Path]:
    return [
        path
        for top in FOLDERS.values()
        for path in top.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]


def test_every_package_of_the_tree_ships() -> None:
    tree = {name_of(path.parent) for path in files() if path.suffix != ".md"}
    assert sorted(tree) == sorted(SETUP["packages"])


def test_every_file_of_a_package_ships() -> None:
    data = SETUP["package-data"]
    for path in files():
        if path.suffix not in (".py", ".md"):
            patterns = data.get(name_of(path.parent), [])
            assert any(fnmatch.fnmatch(path.name, p) for p in patterns), path
