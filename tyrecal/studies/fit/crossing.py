"""The crossing of the two [0, 0] modes, where labels change places and the objective jumps.

Two modes that are coupled, however weakly, avoid each other. With d the difference of the
frequencies that they would have alone and 2 delta their coupling, the gap between them and the
clarity of their labels, a difference of shares (Landau and Lifshitz, Quantum Mechanics, sec. 79):

    g = +- sqrt(d^2 + 4 delta^2),    c = cos^2 phi - sin^2 phi = |d / g|,    tan 2 phi = 2 delta / d

So g is least where labels change places and its slope vanishes there, but d = g c goes through 0
as straight as any frequency, with the slope (dg/dx) / c. Of a fit over several states, each has its
own crossing; what bounds a step is that of the state where labels are least clear.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...simulate.modes.label import Label
from ...tyre.state import AS_THE_CASE, TyreState
from .problem import Point, Problem

Array = np.ndarray
AXIAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")
PAIR = (AXIAL, TORSIONAL)
MIXED = 0.8  # clarity of the two labels below which the modes have met
TELLING = 0.3  # clarity above which the slope of g determines that of d


@dataclass(frozen=True)
class Crossing:
    """The linear model of d about a design, in one state."""

    x: Array  # (v,) coordinates of the variables
    value: float  # d at x, Hz
    slopes: Array  # (v,) d d / d x, Hz
    state: TyreState = AS_THE_CASE

    def at(self, x: Array) -> float:
        """d at coordinates x, Hz: positive where the axial mode is above."""
        return self.value + float(self.slopes @ (x - self.x))


def order(problem: Problem, point: Point) -> dict[TyreState, float]:
    """Order by state, 1 where the axial mode is above the torsional one, -1 below; of those states
    where both have weight."""
    weighted = {(t.state, t.label) for t in problem.targets if t.scale}
    return {
        state: float(np.sign(gap(point, state)))
        for state, label in weighted
        if label == AXIAL and (state, TORSIONAL) in weighted
    }


def gap(point: Point, state: TyreState) -> float:
    """Axial minus torsional frequency, Hz, in a state that has both."""
    modes = point.states[state]
    return modes[AXIAL].frequency_Hz - modes[TORSIONAL].frequency_Hz


def pair_clarity(point: Point, state: TyreState | None = None) -> float:
    """How clearly the two modes are distinguished, in a state or where they are least; 1 where they
    are not both wanted."""
    states = point.states if state is None else (state,)
    pairs = [[point.states[s][label] for label in PAIR if label in point.states[s]] for s in states]
    return min((min(m.clarity for m in pair) for pair in pairs if len(pair) == 2), default=1.0)


def crossing(problem: Problem, points: Iterable[Point], near: Point) -> Crossing | None:
    """d about the one of ``points`` nearest to ``near`` whose labels are clear enough, if any, in
    the state where those of ``near`` are least clear."""
    states = order(problem, near)
    if not states:
        return None
    state = min(states, key=lambda s: pair_clarity(near, s))
    telling = [point for point in points if pair_clarity(point, state) > TELLING]
    if not telling:
        return None
    point = min(telling, key=lambda p: float(np.linalg.norm(p.x - near.x)))
    targets = [(t.state, t.label) for t in problem.targets]
    i, j = (targets.index((state, label)) for label in PAIR)
    J = point.plain.jacobian
    slopes = J[i] / problem.scale[i] - J[j] / problem.scale[j]  # scale: residual per Hz
    clarity = pair_clarity(point, state)
    return Crossing(point.x, gap(point, state) * clarity, slopes / clarity, state)
