"""An evaluation with slopes, or a whole fit, of a user's deck over that of the case that wrote it.

python -m tests.benchmarks.own_deck [--mesh LEVEL] [--rounds N] [--fit]: the deck of
`cases/p235_75r17.yaml` is read as anybody's, its nodes in another order, with the same variables;
processor time, both sides in turn: in one process, each design anew, or with --fit whole commands
`tyrecal fit --no-pictures --no-store`, with the case's bounds and targets, its variables as marks
in the deck's text, on its refined mesh of two more rows: 3035 nodes.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.values import with_values

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"


def shuffled(text: str) -> str:
    """The deck with the lines of its nodes, which the numbers follow, in another order."""
    head, rest = text.split("*NODE, NSET=TYRE\n")
    nodes, tail = rest.split("*NODE, NSET=RIM_REFERENCE\n")
    lines = nodes.splitlines(keepends=True)
    return head + "*NODE, NSET=TYRE\n" + "".join(lines[::-1]) + "*NODE, NSET=RIM_REFERENCE\n" + tail


def marked(text: str) -> str:
    """The deck with marks for the case's variables."""
    text = re.sub(r"^(BELT_[12], )[^,]+", r"\1{{ A_belt }}", text, flags=re.MULTILINE)
    text = re.sub(r"^(CARCASS, )[^,]+", r"\1{{ A_carcass }}", text, flags=re.MULTILINE)
    return re.sub(r"(\*HYPERELASTIC.*\n)[^,]+", r"\1{{ C10 }}", text)


def fit_case(case: LoadedCase, own: Path) -> None:
    """Give a marked deck's case the variables' starts and bounds, and the targets, of the case."""
    data = yaml.safe_load(own.read_text(encoding="utf-8"))
    data["variables"] = {
        name: {**variable, "sets": [f"deck.numbers.{name}"]}
        for name, variable in case.file_data["variables"].items()
    }
    data["targets"] = case.file_data["targets"]
    own.write_text(yaml.safe_dump(data), encoding="utf-8")


def fit_seconds(path: Path, mesh: str) -> tuple[float, dict[str, Any]]:
    """Processor time of a whole fit, and its result."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with TemporaryDirectory() as folder:
        level = ["--mesh", mesh] if mesh else []
        words = ["fit", str(path), "--no-pictures", "--no-store", "--output", folder, *level]
        subprocess.run([sys.executable, "-m", "tyrecal", *words, "--quiet"], check=True)
        fit = json.loads((Path(folder) / "fit.json").read_text())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, fit


def finer(folder: Path) -> Path:
    """A copy of the case with more rows in its refined mesh."""
    text = CASE.read_text(encoding="utf-8").replace("rows: [1, 1, 1, 4]", "rows: [1, 1, 2, 5]")
    (folder / CASE.name).write_text(text, encoding="utf-8")
    shutil.copy(CASE.with_suffix(".csv"), folder)
    return folder / CASE.name


def compare_fits(of: Path, own: Path, mesh: str, rounds: int) -> None:
    """Print both medians, their ratio, and how far apart the fits end."""
    spent: dict[str, list[float]] = {"case": [], "deck": []}
    results = {}
    for _ in range(rounds):
        for name, path, level in (("case", of, mesh), ("deck", own, "")):
            seconds, results[name] = fit_seconds(path, level)
            spent[name].append(seconds)
    ratios = [deck / case for case, deck in zip(*spent.values(), strict=True)]
    for name, fit in results.items():
        print(
            f"{name}: {statistics.median(spent[name]):.2f} s, {fit['evaluations']} evaluations,"
            f" objective {fit['objective_Hz']:.6f} Hz"
        )
    print(f"a fit of the deck over one of the case: {statistics.median(ratios):.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", default="refined")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--fit", action="store_true")
    given = parser.parse_args()
    with TemporaryDirectory() as folder:
        of = finer(Path(folder)) if given.fit else CASE
        case = with_level(load_case(of), given.mesh)
        case = with_values(case, start_values(case))
        design = TyreDesign(case)
        text = design.texts("abaqus", Decks(design).request)["inflate.inp"]
        path = Path(folder) / "tyre.inp"
        text = marked(shuffled(text)) if given.fit else shuffled(text)
        path.write_text(text, encoding="utf-8")
        deck = read_own_deck(path)
        flat = deck.flat(start_values(case) if given.fit else {})
        path.with_suffix(".yaml").write_text(own_case(deck, flat, "P235/75R17", None))
        if given.fit:
            print(f"{len(flat.mesh.nodes)} nodes, marks {', '.join(deck.marks)}")
            fit_case(case, path.with_suffix(".yaml"))
            return compare_fits(of, path.with_suffix(".yaml"), given.mesh, given.rounds)
        own = load_case(path.with_suffix(".yaml"))
    sides = {"case": case, "deck": own}
    spent: dict[str, list[float]] = {name: [] for name in sides}
    hertz = {}
    for k in range(given.rounds + 1):
        for name, each in sides.items():
            start = start_values(each)
            values = {v: x * (1 + 0.01 * k) for v, x in start.items()}
            evaluator = Evaluator(TyreDesign(with_values(each, start)), "bundled")
            evaluator.evaluate(Question(start))  # the nominal shape, which a fit has once
            began = time.process_time()
            result = evaluator.evaluate(Question(values, tuple(start)))
            spent[name].append(time.process_time() - began)
            hertz[name] = [mode.frequency_Hz for mode in result.modes]
    medians = {name: statistics.median(times[1:]) for name, times in spent.items()}
    print(f"{len(flat.mesh.nodes)} nodes, {len(start_values(own))} variables")
    print({name: round(value, 3) for name, value in medians.items()})
    print(f"deck over case: {medians['deck'] / medians['case']:.2f}")
    off = max(abs(a / b - 1) for a, b in zip(*hertz.values(), strict=True))
    print(f"largest difference of a frequency {off:.1e}")


if __name__ == "__main__":
    main()
