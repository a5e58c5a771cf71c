"""Files drawn by lot, to be read by someone who knows only ARCHITECTURE.md and the glossary.

    python -m tests.studies.reading [--seed 20261201]

Draws three files of 40 to 250 lines of each of six rooms. The reader notes each question that a
file leaves open although its answer is needed to check a function or a value against a textbook:
an unknown symbol, letter of a shape, unit, or word. Then each is answered in the code. Questions
on 2026-11-27, each lot read after those of the lots before were answered, and by the same reader:

| seed | tyre | simulate | measured | studies | report, batch, cli | solvers |
|---|---|---|---|---|---|---|
| 20261201 | 4 | 3 | 7 | 10 | 2 | 8 |
| 20261202 | 2 | 4 | 3 | 4 | 0 | 5 |
| 20261204 | 3 | 0 | 1 | 3 | 1 | 2 |
| 20261205 | 3 | 1 | 0 | 1 | 1 | 2 |

By two others, who had read no lot before. The second also mended the like of each question in all
files and then read most of them, so that from the fourth lot on it knew the words; of the last row
it read no pages of `solvers/bundled/road` and `solvers/language`:

| seed | tyre | simulate | measured | studies | report, batch, cli | solvers |
|---|---|---|---|---|---|---|
| 20261206 | 10 | 12 | 8 | 6 | 4 | 7 |
| 20261301 | 4 | 5 | 9 | 6 | 0 | 9 |
| 20261302 | 6 | 4 | 1 | 1 | 1 | 0 |
| 20261303 | 5 | 0 | 0 | 1 | 1 | 1 |
| 20261304 | 0 | 1 | 0 | 3 | 0 | 0 |
| 20261305 | 0 | 0 | 0 | 0 | 0 | 2 |
| 20261306 | 0 | 0 | 1 | 0 | 1 | 0 |
| 20261307 | 3 | 0 | 1 | 4 | 0 | 1 |
| 20261308 | 2 | 1 | 0 | 1 | 0 | 2 |
| 20261309 | 2 | 0 | 0 | 1 | 0 | 2 |
| 20261310 | 0 | 0 | 1 | 1 | 0 | 1 |
| 20261311 to 26, at most | 1 | 0 | 1 | 1 | 0 | 2 |

By another one, who counted also what is needed to change a page safely, and who had seen a few
files of the later lots before:

| seed | tyre | simulate | measured | studies | report, batch, cli | solvers |
|---|---|---|---|---|---|---|
| 20261501 | 9 | 3 | 1 | 5 | 3 | 5 |
| 20261502 | 1 | 0 | 1 | 3 | 1 | 5 |
| 20261503 | 1 | 0 | 2 | 4 | 0 | 3 |

By three others, who had read nothing before, each after the questions of the one before were
answered, and their like in nearly all files:

| seed | tyre | simulate | measured | studies | report, batch, cli | solvers |
|---|---|---|---|---|---|---|
| 20261701 | 5 | 6 | 6 | 6 | 4 | 6 |
| 20261702 | 3 | 2 | 2 | 8 | 3 | 9 |
| 20261703 | 4 | 7 | 2 | 5 | 2 | 7 |

By others, who had read nothing before, after all 378 files of 40 to 250 lines were read, and what
they left open answered. They did not count what the file's own code answers at once, and why a
constant has its value:

| seed | tyre | simulate | measured | studies | report, batch, cli | solvers |
|---|---|---|---|---|---|---|
| 20262801 | 1 | 0 | 2 | 2 | 1 | 2 |
| 20262802 | 3 | 2 | 0 | 3 | 2 | 4 |
| 20262803 | 4 | 1 | 2 | 2 | 2 | 2 |
| 20262911 | 2 | 0 | 2 | 8 | 0 | 0 |

Five of the eight are of a file that was cut out of another one on that day.
"""

from __future__ import annotations

import argparse
import random
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = {
    "tyre": ["tyrecal/tyre"],
    "simulate": ["tyrecal/simulate"],
    "measured": ["tyrecal/measured"],
    "studies": ["tyrecal/studies"],
    "report": ["tyrecal/report", "tyrecal/batch", "tyrecal/cli"],
    "solvers": ["solvers"],
}
MIN_LINES, MAX_LINES = 40, 250
FILES_A_ROOM = 3


def draw(seed: int) -> dict[str, list[str]]:
    """Paths of the files drawn, by room."""
    lot = random.Random(seed)
    drawn = {}
    for room, folders in ROOMS.items():
        paths = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
        lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in paths}
        names = sorted(
            path.relative_to(ROOT).as_posix()
            for path, length in lengths.items()
            if MIN_LINES <= length <= MAX_LINES
        )
        drawn[room] = lot.sample(names, FILES_A_ROOM)
    return drawn


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=20261201)
    for room, names in draw(parser.parse_args().seed).items():
        print(f"{room}: {', '.join(names)}")
