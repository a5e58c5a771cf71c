"""The files that one frequency passes: where a function is called between case and result.

    python tests/studies/files_passed.py [COMMAND ...]      default: modes, on the coarse mesh

Prints each file of ``tyrecal`` and ``solvers`` in which a function is called (`sys.setprofile`),
with the number of calls, and how many files they are.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parents[2]
COMMAND = ["modes", "cases/p235_75r17.yaml", "--mesh", "coarse", "--no-store", "--no-pictures"]


def files_passed(arguments: list[str]) -> Counter[str]:
    """Calls of functions by file, below the repository's root, in a run of the command."""
    sys.path.insert(0, str(ROOT))
    from tyrecal.cli.main import main

    calls: Counter[str] = Counter()
    product = tuple(f"{ROOT / folder}/" for folder in ("tyrecal", "solvers"))

    def called(frame: FrameType, event: str, argument: Any) -> None:
        name = frame.f_code.co_filename
        if event == "call" and name.startswith(product) and frame.f_code.co_name != "<module>":
            calls[name.removeprefix(f"{ROOT}/")] += 1

    with tempfile.TemporaryDirectory() as folder:
        sys.setprofile(called)
        try:
            main([*arguments, "--quiet", "--output", folder])
        except SystemExit:
            pass
        finally:
            sys.setprofile(None)
    return calls


if __name__ == "__main__":
    found = files_passed(sys.argv[1:] or COMMAND)
    for file, count in found.most_common():
        print(f"{count:9} {file}")
    print(f"{len(found)} files")
