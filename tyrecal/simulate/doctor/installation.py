"""Installed and missing packages, and what the machine has."""

from __future__ import annotations

import os
import platform
import re
import shutil
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from packaging.requirements import Requirement

from ...files import Json

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
GB = 1e9


def packages() -> list[Json]:
    """Packages that tyrecal needs: ``name``, ``needed`` (version specifier such as ">=1.26"),
    ``version`` that is installed (None: missing), ``ok``: whether that is a version needed."""
    return [_status(each) for each in _requirements("")]


def extras() -> list[Json]:
    """Extras that can be installed: ``name``, ``missing`` packages, and ``install``, a command to
    run in a clone of tyrecal, because no package index has tyrecal."""
    texts = requires("tyrecal") or []
    names = {extra for text in texts for extra in re.findall(r"extra == ['\"](.+?)['\"]", text)}
    entries = []
    for extra in sorted(names):
        missing = [e["name"] for e in map(_status, _requirements(extra)) if not e["ok"]]
        install = f"pip install '.[{extra}]'"
        entries.append({"name": extra, "missing": missing, "install": install})
    return entries


def machine() -> Json:
    """The machine: ``python``, ``system``, ``cores`` that this process may use, ``memory_GB`` and
    ``free_memory_GB`` (None if the system does not report them), ``free_disc_GB`` of the current
    folder, ``threads``: values of the environment variables `THREADS`, None if not set."""
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


def records(shared: Path | None) -> list[Json]:
    """The evaluation store ``shared`` between cases, or else those in the results folders of the
    current folder: ``folder``, ``records`` (number of finished evaluations), ``MB``."""
    from ..evaluate.store import Store

    folders = [shared] if shared else sorted(Path().glob("*/record"))
    summaries = [Store(folder).summary() for folder in folders]
    return [
        {"folder": each["folder"], "records": each["records"], "MB": round(each["bytes"] / 1e6, 1)}
        for each in summaries
    ]


def _requirements(extra: str) -> Iterator[Requirement]:
    """Packages that tyrecal needs ("") or that only ``extra`` needs."""
    for requirement in map(Requirement, requires("tyrecal") or []):
        marker = requirement.marker
        if extra and (not marker or marker.evaluate({"extra": ""})):
            continue  # needed without the extra, too
        if not marker or marker.evaluate({"extra": extra}):
            yield requirement


def _status(requirement: Requirement) -> Json:
    """An entry of `packages`."""
    try:
        installed: str | None = version(requirement.name)
    except PackageNotFoundError:
        installed = None
    fits = installed is not None and requirement.specifier.contains(installed, prereleases=True)
    needed = str(requirement.specifier)
    return {"name": requirement.name, "needed": needed, "version": installed, "ok": fits}


def _memory() -> float | None:
    """Memory of the machine, GB; None if the system does not report it."""
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GB, 1)
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf
        return None


def _free_memory() -> float | None:
    """Memory that is available now, GB; None if the system does not report it."""
    try:
        (line,) = (
            line
            for line in Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()
            if line.startswith("MemAvailable")
        )
        return round(1024 * int(line.split()[1]) / GB, 1)  # from kB, of 1024 bytes
    except (OSError, ValueError):
        return None
