"""Labels of two modes exchanged in the measurements: found and put right before all else.

A laboratory reads the order of a mode from its shape at few sensors. Two modes of like frequency
that took each other's label make a gap that no tyre has; every hypothesis would answer for it. So
the reading, the file with two labels exchanged or none, is inferred with them: P(reading) times the
sum over hypotheses of prior times evidence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ...simulate.modes.label import Label
from ...tyre.state import TyreState
from ..inference.inverse_problem import InverseProblem, places
from ..inference.model import ModelRow
from ..inference.observations import Observations
from .evidence import NONE, OUTSIDE, Hypothesis, refit
from .several import weigh_hypotheses

Array = np.ndarray
SWAP_PROBABILITY = 0.05  # share of laboratories' files in which two labels are exchanged
MAX_SWAP_DISTANCE = 0.30  # distance in ln f of modes that could be taken for one another
MIN_GAIN = 3.0  # in ln of evidence without effects, from which a reading is worth a closer look


def exchanged(
    problem: InverseProblem, hypotheses: Sequence[Hypothesis], rows: Sequence[ModelRow]
) -> tuple[Label, Label] | None:
    """The labels that have most probably taken each other's place at all pressures, None if none.

    problem: expanded about a fit of the file as it is; hypotheses: of that file, all of them;
    rows: of the model, see `rows_if_exchanged`.
    """

    def read(a: Label, b: Label) -> InverseProblem:
        there = with_exchanged(problem.observations, a, b)
        where, damping = places(there, rows), places(there.damping, rows)
        return replace(problem, observations=there, places=where, damping_places=damping)

    shifts = problem.expansion.range_shifts(problem.places)
    # without effects, and with any of them as scatter: neither sees every exchange
    scatters = None, shifts @ shifts.T
    seen = lambda p: np.array([refit(p, {}, 1, extra).ln_evidence[0] for extra in scatters])
    plain = seen(problem)
    readings = list(_near(problem.observations))
    pairs = [pair for pair in readings if np.any(seen(read(*pair)) > plain + MIN_GAIN)]
    if not pairs:
        return None
    # with sets of effects: two strong ones, beside which no single one fits, look like an exchange
    best, most = None, _all(hypotheses) + float(np.log(1 - SWAP_PROBABILITY))
    for pair in pairs:
        ln = _all(weigh_hypotheses(read(*pair))) + float(np.log(SWAP_PROBABILITY / len(readings)))
        if ln > most:
            best, most = pair, ln
    return best


def rows_if_exchanged(observations: Observations) -> list[ModelRow]:
    """All rows that the observations need of a model, whichever labels are exchanged."""
    read = [observations, *(with_exchanged(observations, a, b) for a, b in _near(observations))]
    return list(dict.fromkeys(row.row for each in read for row in each.rows))


def exchange_shifts(observations: Observations) -> Array:
    """Shift of the observations by each exchange of labels near each other, (n, k); where one of
    the two was not measured, the shift of the other elsewhere."""
    labels = np.array([str(row.label) for row in observations.rows])
    shifts = []
    for a, b in _near(observations):
        there = with_exchanged(observations, a, b)
        shift = there.y - observations.y
        alone = np.array([str(row.label) for row in there.rows]) != labels
        for label in (str(a), str(b)):
            shift[alone & (labels == label)] = shift[~alone & (labels == label)].mean()
        shifts.append(shift)
    return np.array(shifts).reshape(-1, len(labels)).T


def with_exchanged(observations: Observations, a: Label, b: Label) -> Observations:
    """Observations with labels a and b exchanged, wherever one of them was measured."""
    other, rows = {a: b, b: a}, list(observations.rows)
    where = {(row.label, row.state, row.run): i for i, row in enumerate(rows)}
    order = np.arange(len(rows))
    for i, row in enumerate(rows):
        if row.label in other:
            label = other[row.label]
            order[i] = where.get((label, row.state, row.run), i)
            rows[i] = row if order[i] != i else replace(row, label=label)
    damping = observations.damping
    new = tuple(
        replace(row, label=other[row.label]) if row.label in other else row for row in damping.rows
    )
    damping = replace(damping, rows=new)
    return replace(observations.at(order), rows=tuple(rows), damping=damping)


def _near(observations: Observations) -> Iterator[tuple[Label, Label]]:
    """Pairs of labels near each other in a state: read there, they are followed to the others."""
    at: dict[Label, dict[tuple[TyreState, int], float]] = {}
    for row, y in zip(observations.rows, observations.y.tolist(), strict=True):
        if row.label:
            at.setdefault(row.label, {})[row.state, row.run] = y
    for a, b in combinations(sorted(at, key=str), 2):
        both = at[a].keys() & at[b].keys()
        if both and min(abs(at[a][k] - at[b][k]) for k in both) < MAX_SWAP_DISTANCE:
            yield a, b


def _all(hypotheses: Sequence[Hypothesis]) -> float:
    """ln of the sum of prior times evidence, what lies outside the catalogue left aside: it fits
    anything."""
    known = [h for h in hypotheses if h.key != OUTSIDE]
    assert known[0].key == NONE
    return float(np.logaddexp.reduce([h.ln_evidence + np.log(h.prior) for h in known]))
