"""Signatures of all effects on the fitted tyre, for tests/benchmarks/EFFECTS.md.

python -m tests.studies.effects cases/p235_75r17.yaml p235_75r17/fit.json
"""

from __future__ import annotations

import sys
from pathlib import Path

from tyrecal.case import load_case
from tyrecal.effects import catalogue
from tyrecal.evaluate.door import Door
from tyrecal.studies.fitted import read_fitted
from tyrecal.studies.signature import Plain, Signature, rms, stated_size

PRESSURES_KPA = (160.0, 240.0, 320.0)


def main(case_file: str, fit_file: str) -> None:
    case = load_case(case_file)
    values = read_fitted(Path(fit_file), case)
    plain = Plain(Door(case), values, PRESSURES_KPA)
    single = Plain(Door(case), values, (case.case.pressure_kPa,))
    names = [str(label) for label in plain.labels]
    print("| effect | size | kPa |", " | ".join(names), "| rms | kg |")
    print("|---|" * 1 + "---|" * (len(names) + 4))
    summary = []
    for effect in catalogue().values():
        size = stated_size(effect.id)
        found = plain.signature(effect.id, size)
        for k, pressure in enumerate(PRESSURES_KPA):
            head = f"`{effect.id}` | {size:g} {effect.unit}" if not k else " | "
            for which, rows in (("before", found.before), ("after", found.after)):
                tail = f"{rms(rows[k]):.2f} | {found.mass_kg:+.2f}"
                print(f"| {head} | {pressure:g} {which} |", *_cells(rows[k]), tail, "|")
                head = " | "
        summary.append((found, single.signature(effect.id, size)))
    print(
        "\n| effect | size | before % | after % | alpha | alpha, one pressure |", *values, sep="| "
    )
    for found, alone in summary:
        print(_line(found, alone, values))


def _cells(row) -> list[str]:
    return [f"{x:+.2f} |" for x in row]


def _share(found: Signature) -> str:
    return "-" if found.absorbed is None else f"{found.absorbed:.3f}"


def _line(found: Signature, alone: Signature, values: dict[str, float]) -> str:
    moved = [f"{100 * (found.refitted[k] / v - 1):+.1f}" for k, v in values.items()]
    cells = [f"`{found.id}`", f"{found.value:g}", f"{rms(found.before):.2f}"]
    cells += [f"{rms(found.after):.2f}", _share(found), _share(alone), *moved]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main(*sys.argv[1:])
