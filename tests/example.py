"""The guides' examples of packages of one's own, installed into a folder and run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path


def install(guide: str, module: str, site: Path) -> Path:
    """Put the guide's Python block into ``site`` as ``module``, registered as its TOML says."""
    code, registration = (
        re.search(rf"```{language}\n(.*?)```", guide, re.S) for language in ("python", "toml")
    )
    assert code and registration
    (site / f"{module}.py").write_text(code[1])
    table, entry = registration[1].splitlines()
    group = table.split('"')[1]
    info = site / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n{entry.replace(chr(34), '')}\n")
    return site


def tyrecal(site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command with the packages of ``site`` installed."""
    return subprocess.run(
        [sys.executable, "-m", "tyrecal", *arguments],
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
    )
