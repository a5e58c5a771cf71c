"""A known tyre found again from its frequencies, contact area and vertical stiffness.

    python -m tests.studies.footprint_fit DIR [--mesh LEVEL]

Writes DIR/known.yaml: the main case with targets that its own model has at TRUTH, frequencies with
a sigma of 0.5 Hz, areas and stiffnesses of 2 %, and a mesh ``small`` besides its own. Then fits it
with and without the footprint targets, and prints what was found and the standard errors, and the
processor time of the fits and of pressing one design with its slopes.
"""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.footprint import footprint_row
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from ..solved import calibrate

TRUTH = {"A_belt": 2.6e-7, "A_carcass": 2.5e-7, "C10": 7.0e5}
COARSE = """\
    small:
      elements: {crown: 4, upper_sidewall: 4, lower_sidewall: 4, bead: 1}
      rows: [1, 1, 1, 1]
"""
ROAD = "road: {element_angles_deg: [6, 6, 6, 12, 30, 120], loads_N: [2000, 4000]}\n\n"


def known_case(folder: Path, mesh: str) -> Path:
    """The case file with targets of TRUTH on the mesh."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(CASES / "p235_75r17.csv", folder)
    text = (
        (CASES / "p235_75r17.yaml")
        .read_text()
        .replace("    default:\n", f"{COARSE}    default:\n", 1)
    )
    text = text.replace("level: default\n", f"level: {mesh}\n", 1)
    if mesh == "small":
        text = text.replace("variables:", f"{ROAD}variables:", 1)
    path = folder / "known.yaml"
    path.write_text(text)
    case = load_case(path)
    wanted = {(t.c, t.m, t.kind) for t in case.case.targets.modes}
    evaluator = Evaluator(TyreDesign(case), store=Store(folder / "record"))
    lines = [
        f"    - {{c: {mode.label.c}, m: {mode.label.m}, frequency_Hz: {mode.frequency_Hz!r},"
        f" sigma_Hz: 0.5{f', kind: {mode.label.kind}' if mode.label.kind else ''}}}"
        for mode in paired_labels(evaluator.evaluate(Question(TRUTH)).modes)
        if (mode.label.c, mode.label.m, mode.label.kind) in wanted
    ]
    pressed = evaluator.press(TRUTH, [4000.0])
    row = footprint_row(pressed, pressed.footprints[-1], resolved(with_values(case, TRUTH)).mesh)
    area, stiffness = row["area_m2"], row["vertical_stiffness_N_per_m"]
    lines += [
        "  footprint:",
        f"    - {{load_N: 4000, contact_area_m2: {area!r}, sigma_m2: {0.02 * area!r}}}",
        f"    - {{load_N: 4000, vertical_stiffness_N_per_m: {stiffness!r},"
        f" sigma_N_per_m: {0.02 * stiffness!r}}}",
    ]
    before, rest = text.split("  modes:\n", 1)
    path.write_text("\n".join([f"{before}  modes:", *lines, "", rest[rest.index("solver:") :]]))
    return path


def without_footprint(case: LoadedCase) -> LoadedCase:
    """The case with its target modes alone."""
    targets = case.case.targets.model_copy(update={"footprint": []})
    return replace(case, case=case.case.model_copy(update={"targets": targets}))


def main(folder: Path, mesh: str) -> None:
    """Print both fits."""
    case = load_case(known_case(folder, mesh))
    print("start", start_values(case))
    began = time.process_time()
    Evaluator(TyreDesign(case)).press(start_values(case), [4000.0], gradients=tuple(TRUTH))
    print(f"one design on the road with slopes: {time.process_time() - began:.1f} s")
    for words, each in (("frequencies alone", without_footprint(case)), ("both", case)):
        evaluator = Evaluator(TyreDesign(each), store=Store(folder / "record"))
        began = time.process_time()
        result = calibrate(each, evaluator).result
        seconds, counts = time.process_time() - began, evaluator.counts
        print(f"{words}: {result['evaluations']} designs, {counts.runs} runs, {counts.recorded}")
        print(f"  from the record, {seconds:.1f} s; converged {result['converged']}:")
        print(f"  {result['message']}; objective", result["initial_objective_Hz"], "to")
        print(f"  {result['objective_Hz']:.2e} sigma")
        for name, variable in result["variables"].items():
            error = 100 * variable["standard_error"] / variable["value"]
            off = 100 * (variable["value"] / TRUTH[name] - 1)
            print(
                f"  {name} {variable['value']:.6e}, off {off:+.4f} %, standard error {error:.2f} %"
            )
        for row in result.get("footprint", ()):
            print("  ", row)
        print("   singular values", [f"{s:.3g}" for s in result["singular_values"]])
        for name, row in result["correlations"].items():
            print("   correlations of", name, [f"{x:.2f}" for x in row.values()], flush=True)


if __name__ == "__main__":
    level = sys.argv[sys.argv.index("--mesh") + 1] if "--mesh" in sys.argv else "small"
    main(Path(sys.argv[1]), level)
