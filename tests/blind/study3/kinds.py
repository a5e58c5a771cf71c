"""Kinds of trials, and what their numbers tell of how many effects a tyre has."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt

from tyrecal.errors import InputError
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE
from tyrecal.studies.diagnose.several import MAX_EFFECTS, priors

EFFECTS_OF = {"none": 0, "one": 1, "two": 2, "three": 3, "outside": 0}
EFFECTS_OF |= {"one_strong": 1, "two_strong": 2, "three_strong": 3, "outside_strong": 0}
EFFECTS_OF |= {"one_faint": 1, "one_weak": 1}


def further(counts: Mapping[str, int]) -> float:
    """Tyres with two effects over those with one, and with three over those with two, of which the
    mean number of effects is that of ``counts`` (`Protocol.counts`): what the rules tell whoever
    answers, f in (1 + 2 f + 3 f^2) / (1 + f + f^2) = mean. 0 in the studies before, whose tyres
    have one effect at most. Raises InputError where all have three, of which no f tells."""
    numbers = {**EFFECTS_OF, "again": 1, "effect": 1}
    have = [numbers[kind] for kind, count in counts.items() for _ in range(count) if numbers[kind]]
    if not have:
        return 0.0
    if min(have) == MAX_EFFECTS:
        raise InputError("add a tyre of one or two effects: that all have three no prior can tell")
    mean = sum(have) / len(have)
    a, b, c = 3 - mean, 2 - mean, 1 - mean
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a)


def weighed_again(p: Mapping[str, float], before: float, after: float) -> dict[str, float]:
    """Probabilities by key as they were answered with one prior of a further effect, by another:
    Bayes' rule about `several.priors`, of which the number of effects in the catalogue cancels."""
    old, new = (priors(MAX_EFFECTS, further) for further in (before, after))
    times = {k: new.get(k, 0.0) / old[k] for k in old}
    sets = {key: 1.0 if key in (NONE, OUTSIDE) else times[key.count("+") + 1] for key in p}
    whole = sum(p[key] * sets[key] for key in p)
    return {key: p[key] * sets[key] / whole for key in p}
