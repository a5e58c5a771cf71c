"""Installed and missing packages, and what the machine has."""

from __future__ import annotations

import os
import platform
import re
import shutil
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
GB = 1e9


def packages() -> list[dict[str, Any]]:
    """Packages that tyrecal needs: ``name``, ``needed``, ``version`` (None: missing), ``ok``."""
    return [_found(each) for each in _required("")]


def extras() -> list[dict[str, Any]]:
    """Extras that can be added: ``name``, ``missing`` packages, ``install``, the command for them
    in a clone of tyrecal: no package index has it."""
    named = {extra for text in _all() for extra in re.findall(r"extra == ['\"](.+?)['\"]", text)}
    entries = []
    for extra in sorted(named):
        missing = [e["name"] for e in map(_found, _required(extra)) if not e["ok"]]
        install = f"pip install '.[{extra}]'"
        entries.append({"name": extra, "missing": missing, "install": install})
    return entries


def machine() -> dict[str, Any]:
    """``python``, ``system``, ``cores`` that this process may use, ``memory_GB``, of which
    ``free_memory_GB`` (both None where the system does not say), ``free_disc_GB`` here,
    ``threads``."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "python": platform.python_version(),
        "system": platform.platform(),
        "cores": cores,
        "memory_GB": _memory(),
        "free_memory_GB": _free_memory(),
        "free_disc_GB": round(shutil.disk_usage(".").free / GB, 1),
        "threads": {name: os.environ.get(name) for name in THREADS},
    }


def records(shared: Path | None) -> list[dict[str, Any]]:
    """The record shared between cases, or those in the results folders here: ``folder``,
    ``records``, ``MB``."""
    from ..evaluate.store import Store

    folders = [shared] if shared else sorted(Path().glob("*/record"))
    summaries = [Store(folder, opened=float("inf")).summary() for folder in folders]
    return [
        {"folder": each["folder"], "records": each["records"], "MB": round(each["bytes"] / 1e6, 1)}
        for each in summaries
    ]


def _all() -> list[str]:
    return requires("tyrecal") or []


def _required(extra: str) -> Iterator[Requirement]:
    for requirement in map(Requirement, _all()):
        marker = requirement.marker
        if extra and (not marker or marker.evaluate({"extra": ""})):
            continue  # needed without the extra, too
        if not marker or marker.evaluate({"extra": extra}):
            yield requirement


def _found(requirement: Requirement) -> dict[str, Any]:
    try:
        there: str | None = version(requirement.name)
    except PackageNotFoundError:
        there = None
    fits = there is not None and requirement.specifier.contains(there, prereleases=True)
    needed = str(requirement.specifier)
    return {"name": requirement.name, "needed": needed, "version": there, "ok": fits}


def _memory() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GB, 1)
    except (AttributeError, OSError, ValueError):  # Windows has no such question
        return None


def _free_memory() -> float | None:
    try:
        (line,) = (
            line
            for line in Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()
            if line.startswith("MemAvailable")
        )
        return round(1024 * int(line.split()[1]) / GB, 1)
    except (OSError, ValueError):
        return None
