"""Tyres by `init` pressed on the road: every size, pressure and load of a user's first day.

    python -m tests.studies.pressed_sizes [SIZE ...] [--mesh LEVEL]

Each size at 0.5 (trucks), 0.75, 1 and 1.25 of the pressure that `init` writes, at half and the
whole of its rated load. The first pressure begins at the inflated tyre, the others at its state.
Printed: deflection, vertical stiffness, and processor time of each pressure; or why it failed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.section.size import parse_size

from .sizes_calculix import SIZES
from .wrinkles import by_size

SHARES = (1.0, 0.75, 1.25)  # of the pressure that `init` writes
TRUCK_SHARE, TRUCK_KPA = 0.5, 500.0  # one more of tyres whose pressure is above
LOAD_SHARES = (0.5, 1.0)  # of the rated load


def main(sizes: Sequence[str], level: str) -> None:
    """Print the table."""
    print("| size | kPa | loads, N | deflection, mm | stiffness, N/mm | processor, s |")
    print("|---" * 6 + "|")
    for code in sizes:
        case, size = with_level(by_size(code), level), parse_size(code)
        evaluator, base = Evaluator(TyreDesign(case)), start_values(case)
        loads = [share * size.load_N for share in LOAD_SHARES]
        nominal = case.case.pressure_kPa
        for share in (*SHARES, *([TRUCK_SHARE] if nominal > TRUCK_KPA else [])):
            values = base | ({} if share == 1 else {"pressure_kPa": share * nominal})
            begun = time.process_time()
            head = f"| {code} | {share * nominal:.0f} | {', '.join(f'{x:.0f}' for x in loads)} |"
            try:
                pressed = evaluator.press(values, loads, base=base)
            except EvaluationFailed as failure:
                print(f"{head} {failure} | | {time.process_time() - begun:.0f} |", flush=True)
                continue
            mm = ", ".join(f"{1e3 * each.deflection_m:.1f}" for each in pressed.footprints)
            stiff = ", ".join(f"{each.stiffness_N_per_m / 1e3:.1f}" for each in pressed.footprints)
            words = f"{mm}; {pressed.failed}" if pressed.failed else mm
            print(f"{head} {words} | {stiff} | {time.process_time() - begun:.0f} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sizes", nargs="*", default=SIZES)
    parser.add_argument("--mesh", default="default")
    given = parser.parse_args()
    main(given.sizes, given.mesh)
