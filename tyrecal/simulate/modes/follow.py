"""Modes followed by shape from one state of a tyre to the next, without a look at their labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..evaluate.results import HarmonicShape
from .label import Label, Mode
from .rings import harmonic_of
from .subspace import mac


@dataclass(frozen=True)
class Step:
    """Where a shape went: it has the label ``before`` in one state and ``after`` in the next.

    mac: of the two shapes, 0 to 1.
    """

    before: Label
    after: Label
    mac: float


def follow(before: Sequence[Mode], after: Sequence[Mode]) -> list[Step]:
    """A step per mode of ``before`` that has a partner in ``after``: harmonic by harmonic, the
    one-to-one assignment with the largest sum of MACs. All modes on the same points.

    A sampled shape is taken as its pair (``harmonic_of``): turned by any angle it is the same.
    Raises ValueError when the points differ.
    """
    from scipy.optimize import linear_sum_assignment  # late: longer than most evaluations

    steps = []
    for c in sorted({mode.label.c for mode in before} & {mode.label.c for mode in after}):
        old, new = ([mode for mode in modes if mode.label.c == c] for modes in (before, after))
        x, y = ([_harmonic(mode) for mode in modes] for modes in (old, new))
        macs = np.array([[mac(a, b) for b in y] for a in x])
        for i, j in zip(*linear_sum_assignment(macs, maximize=True), strict=True):
            steps.append(Step(old[i].label, new[j].label, float(macs[i, j])))
    return steps


def _harmonic(mode: Mode) -> HarmonicShape:
    shape = mode.raw.shape
    return shape if isinstance(shape, HarmonicShape) else harmonic_of(shape, mode.label.c)
