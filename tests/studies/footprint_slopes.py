"""Exact slopes of the pressed tyre against central differences of whole presses.

    python -m tests.studies.footprint_slopes LEVEL LOADS_N [--step 1e-4]

The main case on a mesh, its initial variables, pressed at LOADS_N (as in 2000,4000) in one run:
d ln q / d ln x of each quantity q at each load by each variable x, exact and by differences over
the step of ln x to either side; and the processor time of a press with slopes and without.
"""

from __future__ import annotations

import math
import sys
import time

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.pressed import Pressed
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES

QUANTITIES = ("deflection_m", "stiffness_N_per_m", "contact_area_m2", "contact_length_m")
QUANTITIES += ("contact_width_m",)


def main(level: str, loads: list[float], step: float) -> None:
    """Print both of each."""
    case = with_level(load_case(CASES / "p235_75r17.yaml"), level)
    start, evaluator = start_values(case), Evaluator(TyreDesign(case))

    def press(name: str, change: float, gradients: tuple[str, ...] = ()) -> Pressed:
        values = {**start, name: start[name] * math.exp(change)}
        return evaluator.press(values, loads, gradients=gradients)

    for gradients in ((), tuple(start)):
        began = time.process_time()
        pressed = press("C10", 0.0, gradients)
        print(f"{len(gradients)} slopes: {time.process_time() - began:.1f} s", flush=True)
    for name in start:
        sides = zip(*(press(name, side * step).footprints for side in (1, -1)), strict=True)
        for at, (above, below) in zip(pressed.footprints, sides, strict=True):
            for q in QUANTITIES:
                value = getattr(at, q)
                exact = at.slopes[name][q] * start[name] / value
                differences = (getattr(above, q) - getattr(below, q)) / (2 * step * value)
                off = 100 * (exact / differences - 1)
                print(f"{name:10} {at.load_N:5.0f} N {q:18} {exact:+.5f} off {off:+.3f} %")


if __name__ == "__main__":
    given = float(sys.argv[sys.argv.index("--step") + 1]) if "--step" in sys.argv else 1e-4
    main(sys.argv[1], [float(each) for each in sys.argv[2].split(",")], given)
