"""Footprint targets: contact area and vertical stiffness at a load, as a footprint's row has them.

Every design is pressed at all loads of the case up to the last one with a target, in one run, for
friction remembers the loads on the way.

Areas are reproducible to 1e-12 of themselves, stiffnesses to 1e-10, so slopes over 1e-5 have five
digits. The bundled solver's are smooth; another's may jump as nodes come to touch or to slide, by a
node's share of the patch at most. The small step sees the slope of a piece; a jump between two
neighbours is rare, and known by its steepness.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.evaluate.pressed import Pressed
from ...tyre.case import LoadedCase
from ...tyre.case.schema import MEASURED_SIGMA
from ..footprint import footprint_row

Array = np.ndarray
PRESS_STEP = 1e-5  # of a scaled variable: the root of the precision of a stiffness
MAX_SLOPE = 20.0  # d ln q / d x; a jump of 0.1 % within a step is 100
ROW = {"contact_area_m2": "area_m2"}  # quantities with another name in a row of a footprint


@dataclass(frozen=True)
class FootprintTarget:
    """A measured contact area (m2) or tangent vertical stiffness (N/m) at a load in N, its
    standard deviation in the same unit, and its weight in the objective."""

    load_N: float
    quantity: str
    value: float
    sigma: float
    weight: float = 1.0

    @property
    def scale(self) -> float:
        """Residual per unit of the quantity, sqrt(weight) / sigma."""
        return math.sqrt(self.weight) / self.sigma


def read_footprint_targets(case: LoadedCase) -> list[FootprintTarget]:
    """Footprint targets of a case; an empty list where it has none."""
    return [
        FootprintTarget(t.load_N, quantity, getattr(t, quantity), getattr(t, sigma), t.weight)
        for t in (case.case.targets.footprint if case.case.targets else ())
        for quantity, sigma in MEASURED_SIGMA.items()
        if getattr(t, quantity) is not None
    ]


def press(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[FootprintTarget],
    designs: Sequence[Mapping[str, float]],
    jobs: int,
) -> Iterator[Array | EvaluationFailed]:
    """Of each design the targets' quantities and, behind them, by which share of itself each may
    jump (2 targets,): a touching node's share of the patch; or why a load was not reached."""
    last = max(t.load_N for t in targets)
    loads = [load for load in case.case.loads_N if load <= last]
    for values, outcome in zip(designs, evaluator.press_all(designs, loads, jobs), strict=True):
        if isinstance(outcome, EvaluationFailed):
            yield outcome
        elif outcome.failed:
            yield outcome.failed
        else:
            yield _quantities(case, values, outcome, targets)


def _quantities(
    case: LoadedCase,
    values: Mapping[str, float],
    pressed: Pressed,
    targets: Sequence[FootprintTarget],
) -> Array:
    mesh = TyreDesign(case, values).tyre.mesh
    rows = {each.load_N: footprint_row(pressed, each, mesh) for each in pressed.footprints}
    share = {each.load_N: 1 / len(each.node) for each in pressed.footprints}
    found = [rows[t.load_N][ROW.get(t.quantity, t.quantity)] for t in targets]
    return np.array(found + [share[t.load_N] for t in targets])
