"""Tyres by `init` on CalculiX: those whose cords are all taut, and the slack layers of the others.

    python -m tests.studies.sizes_calculix [SIZE ...]

Ten sizes by default, as `tyrecal init` writes them, inflated to their
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
from .wrinkles import by_size

SIZES = (
    *("175/65R14", "185/80R14", "195/65R15", "205/60R15", "225/45R17", "245/40R18"),
    *("275/35R19", "265/70R17", "11R22.5", "385/65R22.5"),
)


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
