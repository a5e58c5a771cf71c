"""Frequencies and slopes at the reference points, by mesh and element: deviations in per cent.

    python tests/studies/accuracy.py

The reference (tests/data/reference.json) is an independent implementation on a (32, 32, 32, 8)
mesh. Slopes are compared with the largest slope of their mode.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json
from dataclasses import replace
from pathlib import Path

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

ROOT = Path(__file__).parents[2]
REFERENCE = json.loads((ROOT / "tests/data/reference.json").read_text())
VARIABLES = ("A_belt", "A_carcass", "C10")
LAYOUTS = [  # element, elements per region, rows, grading
    ("CGAX8R", (8, 8, 8, 2), [1, 1, 1, 3], [1.0, 1.0, 1.0, 0.7]),  # the default level
    ("CGAX8R", (8, 8, 8, 2), [1, 1, 1, 2], None),
    ("CGAX8R", (16, 16, 16, 4), [1, 1, 1, 4], None),  # the refined level
    ("CGAX8R", (32, 32, 32, 8), [1, 1, 1, 6], None),
    ("CGAX4R", (16, 16, 16, 4), [1, 1, 1, 4], None),
    ("CGAX4R", (32, 32, 32, 8), [2, 2, 2, 8], None),
]


def label(text: str) -> Label:
    c, m, *kind = text.split(",")
    return Label(int(c), int(m), kind[0] if kind else None)


def with_layout(
    case: LoadedCase,
    element: str,
    elements: tuple[int, ...],
    rows: list[int],
    grading: list[float] | None,
) -> LoadedCase:
    """The case on another mesh."""
    counts = {name: n for (name, _), n in zip(case.section.regions, elements, strict=True)}
    mesh = case.case.mesh
    level = mesh.levels["default"].model_copy(
        update={"elements": counts, "rows": rows, "grading": grading}
    )
    mesh = mesh.model_copy(update={"element": element, "levels": {"default": level}})
    return replace(case, case=case.case.model_copy(update={"mesh": mesh}))


def main() -> None:
    for layout in LAYOUTS:
        print(f"{layout[0]} {layout[1]} x {layout[2]}, grading {layout[3]}")
        for name, points in REFERENCE["sections"].items():
            case = with_layout(load_case(ROOT / "cases" / f"{name}.yaml"), *layout)
            worst: dict[str, float] = {}
            for point in points:
                at = with_values(case, {"pressure_kPa": point["pressure_kPa"]})
                answer = Evaluator(TyreDesign(at)).evaluate(
                    Question({v: point[v] for v in VARIABLES})
                )
                modes = match(label_modes(answer.modes), [label(k) for k in point["modes"]])
                for key, frequency in point["modes"].items():
                    off = 100 * (modes[label(key)].frequency_Hz / frequency - 1)
                    worst[key] = max(worst.get(key, 0.0), off, key=abs)
            print(f"  {name:22s} " + "  ".join(f"{k}: {v:+.2f}" for k, v in worst.items()))
        _slopes(layout)


def _slopes(layout: tuple) -> None:
    known = REFERENCE["derivatives_Hz_per_ln"]
    case = with_layout(load_case(ROOT / "cases" / f"{known['section']}.yaml"), *layout)
    for i, where in enumerate(("initial", "optimised")):
        point = REFERENCE["sections"][known["section"]][i]
        answer = Evaluator(TyreDesign(case)).evaluate(
            Question({v: point[v] for v in VARIABLES}, VARIABLES)
        )
        modes = match(label_modes(answer.modes), [label(k) for k in point["modes"]])
        worst = 0.0
        for key, expected in known[where].items():
            largest = max(abs(x) for x in expected.values())
            for v in VARIABLES:
                slope = answer.gradients[v][modes[label(key)].position] * point[v]
                worst = max(worst, 100 * abs(slope - expected[v]) / largest)
        print(f"  slopes, {where}: within {worst:.2f} % of the mode's largest")


if __name__ == "__main__":
    main()
