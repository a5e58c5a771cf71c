"""Figures of our own studies next to those of `blind score`: by lambda, by family, of rivals."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from tyrecal.files import Json
from tyrecal.studies.blind.score import DETECTED, DIFFICULTY_BANDS, Scored, rate, summary


def full_summary(
    trials: Sequence[Scored], rivals: Mapping[str, Mapping[str, str]] | None = None
) -> Json:
    """All figures; rivals: answers of simpler methods, by trial and method (`baselines`)."""
    effects = [t for t in trials if t.kind == "effect"]
    detected = [t for t in effects if t.band >= DETECTED]
    outside = [t for t in trials if t.kind == "outside"]
    return {
        **summary(trials),
        "by_lambda": [
            {"low": low, "top_1_group": rate([t.right for t in effects if low <= t.lam < high])}
            for low, high in DIFFICULTY_BANDS
        ],
        "mean_probability_on_group": float(np.mean([on_group(t) for t in detected])),
        "families": {
            law: {
                "recognised": rate([t.verdict == "outside" for t in outside if t.law == law]),
                "named": rate([t.verdict == "named" for t in outside if t.law == law]),
            }
            for law in sorted({t.law for t in outside})
        },
        "brier": brier([t.probabilities for t in trials], [t.truth for t in trials]),
        "baselines": _baselines(trials, rivals or {}),
        "confusion": _confusion(trials),
    }


def on_group(trial: Scored) -> float:
    """Probability of all keys that count as right."""
    return sum(trial.probabilities.get(key, 0.0) for key in trial.group)


def brier(probabilities: Sequence[Mapping[str, float]], truth: Sequence[str]) -> float:
    """Mean over trials of sum over keys of (p - 1 or 0)^2: 0 is certain and right, 2 the worst."""
    scores = []
    for p, key in zip(probabilities, truth, strict=True):
        scores.append(sum((value - (name == key)) ** 2 for name, value in p.items()))
        scores[-1] += key not in p
    return float(np.mean(scores)) if scores else 0.0


def _baselines(trials: Sequence[Scored], rivals: Mapping[str, Mapping[str, str]]) -> Json:
    """Right by group over all trials: the diagnosis, chance, the commonest answer, and rivals."""
    keys = [t.truth for t in trials]
    known = sorted(set(keys))
    commonest = max(known, key=keys.count)
    result: Json = {"diagnosis": rate([t.right for t in trials])}
    chances = [len(set(t.group) & set(known)) / len(known) for t in trials]
    result["random"] = {"share": float(np.mean(chances))}
    result["commonest"] = rate([commonest in t.group for t in trials])
    for name in rivals.get(trials[0].id, ()):
        result[name] = rate([rivals[t.id][name] in t.group for t in trials])
        alarms = [rivals[t.id][name] != "none" for t in trials if t.kind == "none"]
        result[name]["false_alarms"] = rate(alarms)
    return result


def _confusion(trials: Sequence[Scored]) -> dict[str, dict[str, int]]:
    """How often each likeliest answer was given, by truth."""
    table: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for t in trials:
        table[t.truth][t.ranked[0]] += 1
    return {key: dict(row.most_common()) for key, row in sorted(table.items())}
