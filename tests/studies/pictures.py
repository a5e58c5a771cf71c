"""The pictures of the guides, drawn by the commands that the guides show.

    python -m tests.studies.pictures                # draw all again, in cases/pictures
    python -m tests.studies.pictures --check        # name those whose numbers differ; exits with 1

About five minutes of processor time, most of it for the diagnosis. The tests compare those of the
commands that take seconds (`test_pages`).
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tyrecal.report.figure import Panel, read_drawn_numbers

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "cases" / "pictures"
CASE = "cases/p235_75r17.yaml"
FITTED = "--fitted p235_75r17/fit.json"
WITHIN = 0.01  # of the largest number of a panel: what a picture may differ by


@dataclass(frozen=True)
class Drawn:
    """Commands, and the pictures that the guides take from the last one."""

    commands: Sequence[str]
    pictures: dict[str, str]  # name in cases/pictures -> path in the working folder
    is_quick: bool = False  # whether the tests run it


DRAWN = [
    Drawn(["init 205/60R15"], {"own_tyre_section.png": "205_60r15.png"}, is_quick=True),
    Drawn(["init 315/80R22.5"], {"own_truck_section.png": "315_80r22_5.png"}, is_quick=True),
    Drawn(
        [
            "measured import cases/measured/p235_75r17_240kPa_1.uff"
            " cases/measured/p235_75r17_240kPa_2.uff cases/measured/p235_75r17_240kPa_3.uff"
            " --pressure-kPa 240 --directions cylindrical --band 28,132 --highest-harmonic 8"
            " --output at_240.csv"
        ],
        {"measured.png": "at_240.png"},
        is_quick=True,
    ),
    Drawn(
        [
            f"fit {CASE}",
            f"effects bead_filler --case {CASE} {FITTED} --output bead_filler",
            f"effects spindle_tilt --case {CASE} {FITTED} --output spindle_tilt",
        ],
        {
            "modes.png": "p235_75r17/fit_modes.png",
            "section.png": "p235_75r17/fit_section.png",
            "effect_bead_filler.png": "bead_filler/effect_bead_filler.png",
            "effect_spindle_tilt.png": "spindle_tilt/effect_spindle_tilt.png",
        },
        is_quick=True,
    ),
    Drawn(
        [f"fit {CASE} --no-pictures", f"sweep-pressure {CASE} {FITTED}"],
        {"pressure_sweep.png": "p235_75r17/pressure_sweep.png"},
    ),
    Drawn(
        [f"diagnose {CASE} --measured cases/p235_75r17_wheeler.csv --output diagnosis"],
        {
            f"diagnosis_{name}.png": f"diagnosis/diagnosis_{name}.png"
            for name in ("residuals", "probabilities", "section")
        },
    ),
]


def draw(drawn: Drawn, folder: Path) -> dict[str, Path]:
    """Run the commands in ``folder``, with a copy of the cases; paths of pictures by their name in
    the guides. Raises CalledProcessError."""
    shutil.copytree(ROOT / "cases", folder / "cases", dirs_exist_ok=True)
    for command in drawn.commands:
        words = [sys.executable, "-m", "tyrecal", *command.split()]
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
    return {name: folder / place for name, place in drawn.pictures.items()}


def numbers_apart(fresh: Path, recorded: Path) -> Iterator[str]:
    """Panels of two pictures whose words differ, or numbers by more than `WITHIN` of the panel's
    largest. Raises ValueError where a picture keeps no numbers."""
    new, old = read_drawn_numbers(fresh), read_drawn_numbers(recorded)
    if len(new) != len(old):
        yield f"{len(new)} panels, {len(old)} on record"
        return
    for k, (panel, kept) in enumerate(zip(new, old, strict=True)):
        if _words(panel) != _words(kept):
            yield f"panel {k}: words {_words(panel)}, on record {_words(kept)}"
        if [len(row) for row in panel["numbers"]] != [len(row) for row in kept["numbers"]]:
            yield f"panel {k}: {len(panel['numbers'])} parts, {len(kept['numbers'])} on record"
            continue
        for row, before in zip(panel["numbers"], kept["numbers"], strict=True):
            scale = max(map(abs, before), default=0.0)
            if not np.allclose(row, before, rtol=0, atol=WITHIN * scale):
                yield f"panel {k}: {row}, on record {before}"


def _words(panel: Panel) -> list[str]:
    """Texts without their digits, which `numbers_apart` compares where they are drawn."""
    return ["".join("#" if sign.isdigit() else sign for sign in text) for text in panel["words"]]


def main(check: bool) -> int:
    """Draw, or compare. The exit code."""
    differing = 0
    for drawn in DRAWN:
        with TemporaryDirectory() as place:
            for name, path in draw(drawn, Path(place)).items():
                if not check:
                    shutil.copy(path, PICTURES / name)
                    continue
                for difference in numbers_apart(path, PICTURES / name):
                    print(f"{name}: {difference}", flush=True)
                    differing += 1
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv))
