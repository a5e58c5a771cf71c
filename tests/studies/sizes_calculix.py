"""Tyres by `init` on CalculiX: those whose cords are all taut, and the slack layers of the others.

    python -m tests.studies.sizes_calculix [SIZE ...]

The ten sizes of `pressed_sizes` by default, as `tyrecal init` writes them, inflated to their
pressure, coarse mesh. Printed for each: the deviations of five modes of one discrete problem
(`calculix`), with the static moduli in vibration, in per cent; or CalculiX's reason for none.
"""

from __future__ import annotations

import sys

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import with_level
from tyrecal.tyre.case.schema import TargetMode, Targets
from tyrecal.tyre.effects.edit import changed, with_part

from . import calculix
from .belts import ANY_HZ, MODES
from .pressed_sizes import SIZES
from .wrinkles import by_size


def outcome(size: str) -> str:
    """The deviations of a tyre's modes from CalculiX, or why there are none."""
    case = with_level(by_size(size), "coarse")
    analysis = with_part(case.case.analysis, vibration_frequency_Hz=None)
    targets = Targets(modes=[TargetMode(c=c, m=m, frequency_Hz=ANY_HZ) for c, m in MODES])
    try:
        rows = calculix.compare(changed(case, analysis=analysis, targets=targets), None)
    except EvaluationFailed as failure:
        return f"{failure.cause}: {failure.words}"
    return " ".join(f"{row.common:.3f}" for row in rows)


if __name__ == "__main__":
    for size in sys.argv[1:] or SIZES:
        print(f"{size}: {outcome(size)}", flush=True)
