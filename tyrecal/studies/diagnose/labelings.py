"""Doubtful labels as evidence: two of them exchanged in the measurements, or none given.

A laboratory reads the order of a mode from its shape at few sensors. Two modes of like frequency
that took each other's label make a gap that no tyre has; every hypothesis would answer for it. So
the reading, the file with two labels exchanged or none, is inferred with them, and put right before
all else: P(reading) times the sum over hypotheses of prior times evidence.

Frequencies without labels: explanations h, averaged over likely labelings a,

    P(h | y) ~ P(h) sum over a of P(a) Z(y_a | h),   P(a | y) ~ P(a) sum over h of P(h) Z(y_a | h)

y_a: the frequencies with the labels of a, less those that are foreign under it; Z: `evidence`, by
one covariance for all. So a labeling that an effect makes likelier counts under that effect. P(a):
what of the tree's weight of a is not its own evidence of y_a (`labelling.tree`): modes that were
missed, foreign frequencies, the `VIEWS`, about the plain tyre. Labelings are looked for about that
too, its modes off smoothly; those that have `MIN_READING_PROBABILITY` are weighed, the first
`MAX_READINGS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...measured.measurement import Measurement
from ...simulate.modes.label import Label
from ...tyre.state import TyreState
from ..inference.inverse_problem import InverseProblem, places
from ..inference.model import ModelRow
from ..inference.observations import Observations
from ..labelling.label import Labelled
from ..labels import FOREIGN_WORDS
from .evidence import NONE, OUTSIDE, Hypothesis, refit
from .robustness import Robustness, in_words, verdict_probability
from .several import probabilities, weigh_hypotheses
from .verdict import Verdict, decide

Array = np.ndarray
MIN_READING_PROBABILITY, MAX_READINGS = 0.01, 5
REFUTED = 1e-6  # probability of a reading for which the model is not asked again
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


@dataclass(frozen=True)
class Reading:
    """Measurements under one labeling: ln P(a), and the labels, in words, of the frequencies that
    came without."""

    observations: Observations
    ln_prior: float = 0.0  # ln P(a), before the diagnosis
    labels: Sequence[tuple[str, Label | None]] = ()


def likely(
    labelled: Labelled, observed: Callable[[list[Measurement]], Observations]
) -> list[Reading]:
    """The readings to be weighed, the tree's likeliest first."""
    labelings = labelled.found.labelings
    count = max(1, int((labelings.probabilities[:MAX_READINGS] >= MIN_READING_PROBABILITY).sum()))
    hertz = [None if own.label else f"{own.value:.4g} Hz" for own, *_ in labelled.frequencies]
    return [
        Reading(
            observed(labelled.under(k)),
            float(labelings.ln_prior[k]),
            [(f, x) for f, x in zip(hertz, labelled.found.labels(k), strict=True) if f],
        )
        for k in range(count)
    ]


def with_probabilities(labelled: Labelled, p: Sequence[float]) -> Labelled:
    """The labelings with the probabilities ``p`` of the first ones' readings."""
    anew = labelled.found.labelings.with_probabilities(np.array(p))
    return replace(labelled, found=replace(labelled.found, labelings=anew))


def shares(readings: Sequence[Reading], per_reading: Sequence[Sequence[Hypothesis]]) -> Array:
    """P(a | y) by the hypotheses under each reading, one each."""
    ln = np.array(
        [
            own.ln_prior + np.logaddexp.reduce([h.ln_evidence + np.log(h.prior) for h in here])
            for own, here in zip(readings, per_reading, strict=True)
        ]
    )
    return np.asarray(np.exp(ln - np.logaddexp.reduce(ln)))


def averaged(p: Array, per_reading: Sequence[Sequence[Hypothesis]]) -> dict[str, float]:
    """P(h | y) by key, of readings that have ``p``."""
    total: dict[str, float] = {}
    for share, here in zip(p.tolist(), per_reading, strict=True):
        for key, own in probabilities(here).items():
            total[key] = total.get(key, 0.0) + share * own
    return total


def over_labels(
    alone: Robustness,
    readings: Sequence[Reading],
    per_reading: Sequence[Sequence[Hypothesis]],
    p: Array,
    verdict: Verdict,
    variables: int,
) -> Robustness:
    """Robustness of a verdict over all readings: it depends on labels, too, where another verdict
    holds under a reading that has `MIN_READING_PROBABILITY`. alone: of the verdict under the
    likeliest reading."""
    best = int(np.argmax(p))
    same, changes = True, list[str]()
    between = [verdict_probability(averaged(p, per_reading), verdict)]
    for k in np.flatnonzero(p >= MIN_READING_PROBABILITY).tolist():
        here = probabilities(per_reading[k])
        between.append(verdict_probability(here, verdict))
        other = decide(per_reading[k], here, len(readings[k].observations.rows), variables)
        if (other.kind, other.key) != (verdict.kind, verdict.key):
            same = same and k != best
            changes.append(f"{_labels_words(readings, p, k, best)}, {in_words(other)})")
    if same:  # else what the likeliest one hangs on is another verdict
        between += [alone.low, alone.high]
        changes += alone.hangs_on
    return Robustness(not changes, tuple(changes), min(between), max(between))


def _labels_words(readings: Sequence[Reading], p: Array, k: int, best: int) -> str:
    """A reading by what it has otherwise than the likeliest one, or the next where it is that."""
    other = best if k != best else int(np.argsort(-p, kind="stable")[1])
    own = readings[k].labels
    differ = [each for each in own if each not in readings[other].labels]
    hertz = ", ".join(f for f, _ in differ)
    words = ", ".join(label.display if label else FOREIGN_WORDS for _, label in differ)
    return f"the label of {hertz} ({words}, {p[k]:.2f} probable"
