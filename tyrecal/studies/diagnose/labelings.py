"""Frequencies without labels as evidence: explanations h, averaged over likely labelings a.

    P(h | y) ~ P(h) sum over a of P(a) Z(y_a | h),   P(a | y) ~ P(a) sum over h of P(h) Z(y_a | h)

y_a: the frequencies with the labels of a, less those that are foreign under it; Z: `evidence`, by
one covariance for all. So a labeling that an effect makes likelier counts under that effect. P(a):
what of the tree's weight of a is not its own evidence of y_a (`labelling.tree`): modes that were
missed, foreign frequencies, the `VIEWS`, about the plain tyre. Labelings are looked for about that
too, its modes off smoothly; those that have `MIN_READING_PROBABILITY` are weighed, the first
`MAX_READINGS`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...measured.measurement import Measurement
from ...simulate.modes.label import Label
from ..inference.observations import Observations
from ..labelling.label import Labelled
from ..labels import FOREIGN_WORDS
from .evidence import Hypothesis
from .robustness import Robustness, in_words, verdict_probability
from .several import probabilities
from .verdict import Verdict, decide

Array = np.ndarray
MIN_READING_PROBABILITY, MAX_READINGS = 0.01, 5
REFUTED = 1e-6  # probability of a reading for which the model is not asked again


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
