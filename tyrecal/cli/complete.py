"""Completion for shells: cases, and names in them; of a wrong or missing file, nothing."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem, split_arg_string

Items = list[CompletionItem]
SUFFIXES = (".yaml", ".yml")
MAX_CASES = 200  # case files; a folder with more has the shell's own completion
PLAIN = re.compile(r"[A-Za-z0-9_.\-]+=?")  # a word that needs no quotes in a shell
PLAIN_PATH = re.compile(r"[A-Za-z0-9_.\-/]+")
MAX_DEPTH = 3  # levels of folders, that of the typed path included, searched for cases


def cases(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Case files, also those in folders below. The shell's own completion if there are none, or if
    a name needs quotes, which only the shell adds."""
    start = Path(incomplete).parent
    paths = [str(path) for path in _yaml(start, MAX_DEPTH) if str(path).startswith(incomplete)]
    if not 0 < len(paths) <= MAX_CASES or not all(map(PLAIN_PATH.fullmatch, paths)):
        return [CompletionItem(incomplete, type="file")]
    return [CompletionItem(path) for path in paths]


def solvers(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Names of the installed solvers."""
    from importlib.metadata import entry_points

    return _starting({entry.name for entry in entry_points(group="tyrecal.solvers")}, incomplete)


def effects(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Ids of effects."""
    from ..tyre.effects import IDS

    return _starting(IDS, incomplete)


def effect_values(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Ids of effects, each with the = of EFFECT=VALUE."""
    from ..tyre.effects import IDS

    return _starting((f"{id}=" for id in IDS), incomplete)


def variables(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Names of the case's variables."""
    return _starting(_part("variables"), incomplete)


def levels(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Names of the case's meshes."""
    mesh = _part("mesh")
    named = mesh.get("levels")
    return _starting(named if isinstance(named, dict) else (), incomplete)


def assignments(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """``NAME=`` of the case's variables and of its other numbers, by path, and of effects."""
    from ..tyre.effects import IDS

    names = [*_part("variables"), *_numbers(_case()), *(f"effects.{id}" for id in IDS)]
    return _starting((f"{name}=" for name in dict.fromkeys(names)), incomplete)


def numbers(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Names of the case's variables, and paths of its other numbers."""
    return _starting({*_part("variables"), *_numbers(_case())}, incomplete)


def _starting(names: Iterable[str], incomplete: str) -> Items:
    """Those ``names`` that begin with the typed word."""
    if incomplete.endswith("="):  # a number follows
        return []
    return [
        CompletionItem(name)
        for name in sorted(names)
        if name.startswith(incomplete) and PLAIN.fullmatch(name)
    ]


def _yaml(folder: Path, depth: int) -> Iterator[Path]:
    """Case files of a folder and of those inside it, ``depth`` levels deep."""
    with contextlib.suppress(OSError):
        for path in sorted(folder.iterdir()):
            if path.name.startswith("."):
                continue
            if path.suffix in SUFFIXES:
                yield path
            elif depth > 1 and path.is_dir() and not path.is_symlink():
                yield from _yaml(path, depth - 1)


def _case() -> dict[str, Any]:
    """The case on the command line as plain data, unchecked."""
    from ..tyre.case.document import read_document

    for word in split_arg_string(os.environ.get("COMP_WORDS", "")):
        if word.endswith(SUFFIXES):  # click has no arguments yet where an option lacks its value
            return read_document(Path(word)).data or {}
    return {}


def _part(key: str) -> dict[str, Any]:
    part = _case().get(key)
    return part if isinstance(part, dict) else {}


def _numbers(node: Any, path: str = "") -> Iterator[str]:
    """Dotted paths of a case's numbers, without those of variables and targets."""
    inner = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in inner:
        if not path and key in ("variables", "targets", "format"):
            continue
        place = f"{path}.{key}" if path else str(key)
        if isinstance(value, dict | list):
            yield from _numbers(value, place)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield place
