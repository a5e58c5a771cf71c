"""Run the bundled solver on a deck: python -m tyrecal_solvers.bundled MODES [--oldjob INFLATE]."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from ..errors import Refused, RunFailed
from .job import run


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 done, 2 the deck was refused, 3 no solution was found, 130 interrupted."""
    parser = argparse.ArgumentParser(prog="bundled", description=__doc__)
    parser.add_argument("job", type=Path, help="the deck, with or without .inp")
    parser.add_argument("--oldjob", type=Path, help="name of the section job that it revolves")
    parser.add_argument(
        "--time-limit",
        type=float,
        default=float("inf"),
        metavar="SECONDS",
        help="processor time after which the run is ended",
    )
    options = parser.parse_args(arguments)
    job, oldjob = (
        given.with_suffix("") if given and given.suffix == ".inp" else given
        for given in (options.job, options.oldjob)
    )
    try:
        run(job.parent, job.name, oldjob and oldjob.name, options.time_limit)
        results = [job.with_name(f"{job.name}.{suffix}") for suffix in ("json", "npz")]
        print(
            "\n".join(
                [
                    *_words(json.loads(results[0].read_text(encoding="utf-8"))),
                    f"results in {results[0]} and {results[1]}",
                ]
            )
        )
    except (Refused, OSError) as error:
        print(f"error: {_printable(error)}", file=sys.stderr)
        return 2
    except RunFailed as error:
        print(f"failed: {_printable(error)}", file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    return 0


def _printable(error: Exception) -> str:
    """One line without control characters, which a deck may hold."""
    return "".join(c if c.isprintable() else " " for c in str(error))


def _words(result: dict[str, Any]) -> list[str]:
    """Lines for the terminal: frequencies by harmonic, or the footprint at each load."""
    words = []
    for step in result.get("steps", ()):
        words += [
            f"step {step['step']}: {step['pressure_Pa'] / 1e3:g} kPa, {step['mass_kg']:.2f} kg"
        ]
        by_harmonic: dict[int, list[str]] = {}
        for mode in step["modes"]:
            by_harmonic.setdefault(mode["n"], []).append(f"{mode['frequency_Hz']:.2f}")
        words += [f"  harmonic {n}: {', '.join(of)} Hz" for n, of in sorted(by_harmonic.items())]
    for each in result.get("footprints", ()):
        words += [
            f"{each['load_N']:g} N: deflection {1e3 * each['deflection_m']:.2f} mm,"
            f" contact area {1e4 * each['contact_area_m2']:.1f} cm²"
        ]
    return words + ([result["failure"]] if result.get("failure") else [])


if __name__ == "__main__":
    sys.exit(main())
