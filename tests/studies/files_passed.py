"""The files that one frequency passes: where a function is called between case and result.

    python tests/studies/files_passed.py [COMMAND ...]      default: modes, on the coarse mesh

Prints each file of ``tyrecal`` and ``solvers`` in which a function is called (`sys.setprofile`),
but for what importing a module calls, and how many files they are.
"""

from __future__ import annotations

import sys
import tempfile
from inspect import CO_OPTIMIZED
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parents[2]
COMMAND = ["modes", "cases/p235_75r17.yaml", "--mesh", "coarse", "--no-store", "--no-pictures"]


def files_passed(arguments: list[str]) -> list[str]:
    """Files below the repository's root in which the command calls a function, in that order."""
    sys.path.insert(0, str(ROOT))
    from tyrecal.cli.main import main

    files: dict[str, None] = {}
    product = tuple(f"{ROOT / folder}/" for folder in ("tyrecal", "solvers"))

    def called(frame: FrameType, event: str, argument: Any) -> None:
        name = frame.f_code.co_filename
        new = event == "call" and name not in files and name.startswith(product)
        if new and frame.f_code.co_flags & CO_OPTIMIZED and not importing(frame):  # a function's
            files[name] = None

    with tempfile.TemporaryDirectory() as folder:
        sys.setprofile(called)
        try:
            main([*arguments, "--quiet", "--output", folder])
        except SystemExit:
            pass
        finally:
            sys.setprofile(None)
    return [name.removeprefix(f"{ROOT}/") for name in files]


def importing(frame: FrameType | None) -> bool:
    """Return whether a call is part of an import."""
    while frame := frame and frame.f_back:
        if frame.f_code.co_name == "<module>" and frame.f_globals["__name__"] != "__main__":
            return True
    return False


if __name__ == "__main__":
    found = files_passed(sys.argv[1:] or COMMAND)
    print(*found, f"{len(found)} files", sep="\n")
