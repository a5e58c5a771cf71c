"""How often a fit blames a slip of one value where the model lacks an effect.

    python -m tests.studies.slips_or_effects [SEED] [EFFECT ...] > lines.jsonl

Each effect of the catalogue, at the end of its range that is farther from 0, is added to a drawn
P235/75R17 of a known section; else drawn and measured as by `fit_errors`, coarse mesh. The case
without the effect is fitted to the frequencies at two pressures, and to those at the lower one. A
line of JSON is printed for each fit: its verdict, its reason, and whether the user is kept from
`diagnose`: the model does not fit, and the reason excludes effects. Counts go to stderr.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tyrecal.measured.measurement import measurements_csv
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.fit.verdict import DOES_NOT_FIT
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.effects.edit import changed
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .fit_errors import LABELS, drawn_tyre, measured_and_own
from .slips import table_of


def known_case(folder: Path) -> LoadedCase:
    """The shipped P235/75R17 with an exact section, coarse mesh."""
    for path in CASES.glob("p235_75r17*"):
        shutil.copy(path, folder)
    path = folder / "p235_75r17.yaml"
    text = path.read_text().replace("known_from: size_code", "known_from: exact")
    path.write_text(text)
    return with_level(load_case(path), "coarse")


def lines(case: LoadedCase, id: str, seed: int, folder: Path) -> Iterator[dict[str, Any]]:
    """The two fits to a tyre with an effect. Raises EvaluationFailed, InputError, ValueError."""
    effect = catalogue()[id]
    random = np.random.default_rng([48, seed, effect.place])
    size = max(effect.range_on(case), key=lambda end: (abs(end), end))
    tyre = drawn_tyre(case, random)
    tyre = replace(tyre, case=effect.add(tyre.case, size))
    rows = table_of(measured_and_own(case, tyre, random)[0])
    file = folder / "measured.csv"
    for count in (2 * len(LABELS), len(LABELS)):
        file.write_text(measurements_csv(rows[:count]))
        at = case if count > len(LABELS) else changed(case, pressure_kPa=rows[0].pressure_kPa)
        fit = FitStudy(at, Evaluator(TyreDesign(at)), file).run("gauss-newton").found
        reason = fit.reason
        yield {
            "effect": id,
            "size": size,
            "values": count,
            "verdict": fit.verdict,
            "chi2_per_dof": fit.chi2_per_dof,
            "kind": reason.kind if reason else "",
            "kept_from_diagnose": fit.verdict == DOES_NOT_FIT
            and bool(reason and reason.excludes_effects),
        }


def main(seed: int, ids: Sequence[str]) -> None:
    """Print the lines, and their counts."""
    every: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        case = known_case(Path(folder))
        for id in ids or catalogue():
            try:
                for line in lines(case, id, seed, Path(folder)):
                    every.append(line)
                    print(json.dumps(line), flush=True)
            except (EvaluationFailed, ValueError) as failure:
                print(f"{id}: {failure}", file=sys.stderr)
    off = [line for line in every if line["verdict"] == DOES_NOT_FIT]
    print(
        f"{len(every)} fits, {len(off)} do not fit; a reason in"
        f" {sum(bool(line['kind']) for line in every)},"
        f" kept from diagnose {sum(line['kept_from_diagnose'] for line in every)}",
        file=sys.stderr,
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 0, sys.argv[2:])
