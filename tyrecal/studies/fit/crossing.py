"""The crossing of the two [0, 0] modes, where labels change places and the objective jumps.

Two modes that are coupled, however weakly, avoid each other. With d the difference of the
frequencies that they would have alone and 2 delta their coupling, the gap between them and the
clearness of their labels, a difference of shares (Landau and Lifshitz, Quantum Mechanics, sec. 79):

    g = +- sqrt(d^2 + 4 delta^2),    c = cos 2 phi = |d / g|

So g is least where labels change places and its slope vanishes there, but d = g c goes through 0
as straight as any frequency, with the slope (dg/dx) / c.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...simulate.modes.label import Label
from .problem import Point, Problem

Array = np.ndarray
AXIAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")
MIXED = 0.8  # labels of the two modes are less clear than this: they have met
TELLING = 0.3  # clearness from which on the slope of g tells that of d


@dataclass(frozen=True)
class Crossing:
    """The linear model of d, Hz, about coordinates x: its value there and slopes (variables,)."""

    x: Array
    value: float
    slopes: Array

    def at(self, x: Array) -> float:
        """d at coordinates x, Hz: positive where the axial mode is above."""
        return self.value + float(self.slopes @ (x - self.x))


def order(problem: Problem, point: Point) -> float:
    """1 where the axial mode is above the torsional one, -1 below; 0 where not both have weight."""
    weighted = [t.label for t in problem.targets if t.scale]
    if AXIAL not in weighted or TORSIONAL not in weighted:
        return 0.0
    return float(np.sign(gap(point)))


def gap(point: Point) -> float:
    """Axial minus torsional frequency, Hz, of a point that has both."""
    return point.modes[AXIAL].frequency_Hz - point.modes[TORSIONAL].frequency_Hz


def pair_clarity(point: Point) -> float:
    """How clearly the two modes are told apart; 1 where they are not both wanted."""
    modes = [point.modes[label] for label in (AXIAL, TORSIONAL) if label in point.modes]
    return min((m.clarity for m in modes), default=1.0) if len(modes) == 2 else 1.0


def crossing(problem: Problem, points: Iterable[Point], near: Point) -> Crossing | None:
    """d about the one of ``points`` nearest to ``near`` whose labels are clear enough, if any."""
    telling = [point for point in points if pair_clarity(point) > TELLING]
    if not telling:
        return None
    point = min(telling, key=lambda p: float(np.linalg.norm(p.x - near.x)))
    labels = [t.label for t in problem.targets]
    i, j = labels.index(AXIAL), labels.index(TORSIONAL)
    slopes = point.jacobian[i] / problem.scale[i] - point.jacobian[j] / problem.scale[j]
    clarity = pair_clarity(point)
    return Crossing(point.x, gap(point) * clarity, slopes / clarity)
