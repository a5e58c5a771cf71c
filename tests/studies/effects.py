"""Signatures of all effects on a fitted tyre, as the tables of tests/benchmarks/EFFECTS.md.

python -m tests.studies.effects cases/p235_75r17.yaml p235_75r17/fit.json
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.fitted import read_fitted
from tyrecal.studies.signature import Plain, Signature, rms, stated_size
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.load import load_case

PRESSURES_KPA = (160.0, 240.0, 320.0)
ALIKE = 0.85  # cosine of what a re-fit leaves of two effects, without their sign


def main(case_file: str, fit_file: str) -> None:
    case = load_case(case_file)
    values, _ = read_fitted(Path(fit_file), case)
    run = Plain(case, Evaluator(TyreDesign(case)), values, PRESSURES_KPA)
    one = Plain(case, Evaluator(TyreDesign(case)), values, (case.case.pressure_kPa,))
    known = run.evaluator.solver.capabilities
    sizes = {
        id: stated_size(id, case) for id, effect in catalogue().items() if effect.within(known)
    }
    several = [run.signature(id, size) for id, size in sizes.items()]
    single = [one.signature(id, size) for id, size in sizes.items()]
    small = [[p.signature(id, 0.1 * size) for id, size in sizes.items()] for p in (run, one)]
    print_all(several)
    print_shares(several, single, values, small)


def print_all(signatures: list[Signature]) -> None:
    """Every mode at every pressure: per cent as it comes, and after the re-fit."""
    print("| effect | size | kPa |", " | ".join(map(str, signatures[0].labels)), "|")
    print("|---" * (3 + len(signatures[0].labels)) + "|")
    for each in signatures:
        size = f"{each.value:g} {catalogue()[each.id].unit}".strip()
        for k, pressure in enumerate(each.pressures_kPa):
            pairs = zip(each.before[k], each.after[k], strict=True)
            cells = " | ".join(f"{b:+.2f} / {a:+.2f}" for b, a in pairs)
            print(f"| `{each.id}` | {size} | {pressure:g} | {cells} |")


def print_shares(
    run: list[Signature],
    one: list[Signature],
    values: dict[str, float],
    small: list[list[Signature]],
) -> None:
    """Print the share that the re-fit absorbs, with three pressures and with one, and the effects
    that look alike then."""
    print("\n| effect | kg | before % | after % | absorbed % | with one pressure |", end="")
    print(" | ".join(["", *values])[2:], "| left alike | with one pressure |")
    print("|---" * (8 + len(values)) + "|")
    for i, (each, alone) in enumerate(zip(run, one, strict=True)):
        shares = ["-" if s is None else f"{100 * s:.1f}" for s in (each.absorbed, alone.absorbed)]
        moved = [f"{100 * (each.refitted[k] / v - 1):+.1f}" for k, v in values.items()]
        cells = [f"`{each.id}`", f"{each.mass_kg:+.2f}", f"{rms(each.before):.2f}"]
        cells += [f"{rms(each.after):.2f}", *shares, *moved, *(_alike(s, i) for s in small)]
        print("| " + " | ".join(cells) + " |")


def _alike(signatures: list[Signature], place: int) -> str:
    """Effects whose rest points the same way, with the cosine, the nearest first."""
    rests = np.array([np.nan_to_num(s.after).ravel() for s in signatures])
    norms = np.linalg.norm(rests, axis=1)
    if norms[place] < 1e-9:
        return "-"
    cosines = rests @ rests[place] / np.maximum(norms * norms[place], 1e-12)
    near = [j for j in np.argsort(-abs(cosines)) if j != place and abs(cosines[j]) > ALIKE]
    return ", ".join(f"{signatures[j].id} {cosines[j]:+.2f}" for j in near) or "-"


if __name__ == "__main__":
    main(*sys.argv[1:])
