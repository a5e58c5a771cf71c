"""Run the bundled solver on a deck: python -m tyrecal_solvers.bundled MODES [--oldjob INFLATE]."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .job import Failures, TimedOut, run
from .keywords import DeckError


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 done, 2 the deck was refused, 3 no solution was found."""
    parser = argparse.ArgumentParser(prog="bundled", description=__doc__)
    parser.add_argument("job", type=Path, help="the deck, with or without .inp")
    parser.add_argument("--oldjob", help="name of the section job that it revolves")
    parser.add_argument("--time-limit", type=float, default=float("inf"), metavar="SECONDS")
    options = parser.parse_args(arguments)
    job = options.job.with_suffix("") if options.job.suffix == ".inp" else options.job
    try:
        run(job.parent, job.name, options.oldjob, options.time_limit)
    except (DeckError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (*Failures, TimedOut) as error:
        print(f"failed: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
