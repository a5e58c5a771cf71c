"""An evaluation with slopes of a user's deck, over that of the case that wrote the deck.

python -m tests.benchmarks.own_deck [--mesh LEVEL] [--rounds N]: the deck of
`cases/p235_75r17.yaml` is read as anybody's, its nodes in another order, with the same variables;
processor time, both sides in turn in one process, each design anew.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values, with_level
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", default="refined")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    case = with_level(load_case(CASE), given.mesh)
    case = with_values(case, start_values(case))
    design = TyreDesign(case)
    text = design.texts("abaqus", Decks(design).request)["inflate.inp"]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tyre.inp"
        path.write_text(shuffled(text), encoding="utf-8")
        deck = read_own_deck(path)
        path.with_suffix(".yaml").write_text(own_case(deck, deck.flat({}), "P235/75R17", None))
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
            found = evaluator.evaluate(Question(values, tuple(start)))
            spent[name].append(time.process_time() - began)
            hertz[name] = [mode.frequency_Hz for mode in found.modes]
    medians = {name: statistics.median(times[1:]) for name, times in spent.items()}
    print(f"{len(deck.flat({}).mesh.nodes)} nodes, {len(start_values(own))} variables")
    print({name: round(value, 3) for name, value in medians.items()})
    print(f"deck over case: {medians['deck'] / medians['case']:.2f}")
    off = max(abs(a / b - 1) for a, b in zip(*hertz.values(), strict=True))
    print(f"largest difference of a frequency {off:.1e}")


if __name__ == "__main__":
    main()
