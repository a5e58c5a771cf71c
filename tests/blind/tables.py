"""Figures of our own studies next to those of `blind score`: by lambda, by family, of rivals.

Rivals are simpler methods on the same measurements, with the sensitivities of `Ruler`, the model of
ln f by which all methods are judged. All fit the logarithms of the variables first, in the ruler's
quadratic model with weights by repeatability alone. Nearest signature: the effect whose residual,
after its own fit, points most along the measured one; "none" where the residual is below twice what
noise leaves. AIC: least chi2 + 2 x number of parameters. Evidence by repeatability: that of a
uniform prior over each range, without the other two parts of the covariance. Odds before any
measurement are the diagnosis' own.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tyrecal.files import Json
from tyrecal.measured.tables import read_measurements
from tyrecal.studies.blind.protocol import Protocol, read_protocol
from tyrecal.studies.blind.ruler import SIZE_POINTS, Ruler, read_ruler
from tyrecal.studies.blind.score import DETECTED, DIFFICULTY_BANDS, Scored, means, rate, summary

Array = np.ndarray


MAX_RULE_STEPS = 8  # of Gauss and Newton's method
MAX_LN_STEP = 0.5  # of the logarithm of a variable, a step
NONE = "none"
PRIOR_NONE = 0.25  # probability of no effect, before the data


def rivals(folder: Path) -> dict[str, dict[str, str]]:
    """`guesses` of each trial by its id."""
    protocol, ruler = read_protocol(folder), read_ruler(folder)
    answers = {}
    for path in (folder / "trials").glob("*.csv"):
        y, places, counts = means(read_measurements(path), ruler)
        scatter = repeatability(ruler, places, counts, protocol)
        answers[path.stem] = guesses(ruler, y, places, scatter)
    return answers


def repeatability(ruler: Ruler, places: Array, counts: Array, protocol: Protocol) -> Array:
    """Covariance (n, n) of rows that are means of ``counts`` (n,) values, by scatter alone."""
    is_mass = np.array([ruler.rows[i][0] is None for i in places])
    return np.diag(np.where(is_mass, protocol.mass, protocol.noise) ** 2 / counts)


def guesses(ruler: Ruler, y: Array, places: Array, sigma: Array) -> dict[str, str]:
    """Answer by baseline. y (n,): ln f, or ln mass, of the ruler's rows ``places``; sigma (n, n):
    repeatability."""
    inverse = np.linalg.inv(sigma)
    d = _fit(ruler, y, places, inverse)
    eta, _ = ruler.plain(d, places)
    r = y - eta
    P = ruler.projection(d, places, sigma)
    chi2 = float(r @ P @ r)
    near, aic, odds = {}, {NONE: chi2 + 2 * len(d)}, {NONE: np.log(PRIOR_NONE) - chi2 / 2}
    # P = root^T root, with a ridge against rounding
    root = np.linalg.cholesky(P + 1e-9 * np.trace(P) / len(P) * np.eye(len(P))).T
    residual = root @ r
    # ln of each effect's prior
    share = np.log((1 - PRIOR_NONE) / max(1, len(ruler.signatures)))
    for id, signature in ruler.signatures.items():
        _, g, _ = signature.grid(d, places)
        off = r - g
        lengths = np.einsum("qn,nm,qm->q", off, P, off)
        best = int(np.argmin(lengths))
        aic[id] = float(lengths[best]) + 2 * (len(d) + 1)
        odds[id] = float(share + np.logaddexp.reduce(-lengths / 2) - np.log(SIZE_POINTS))
        along = root @ g[best]
        near[id] = float(residual @ along / max(1e-12, np.linalg.norm(along)))
    freedom = max(1, len(y) - len(d))
    nearest = max(near, key=lambda id: near[id]) if near and chi2 > 4 * freedom else NONE
    return {
        "nearest signature": nearest,
        "AIC": min(aic, key=lambda key: aic[key]),
        "evidence by repeatability alone": max(odds, key=lambda key: odds[key]),
    }


def _fit(ruler: Ruler, y: Array, places: Array, inverse: Array) -> Array:
    """d (v,), ln of the variables less `Ruler.x0`, by Gauss and Newton's steps."""
    d = np.zeros(len(ruler.x0))
    information = np.diag(ruler.spread**-2.0)
    for _ in range(MAX_RULE_STEPS):
        eta, J = ruler.plain(d, places)
        step = np.linalg.solve(
            J.T @ inverse @ J + information, J.T @ inverse @ (y - eta) - information @ d
        )
        d = d + step * min(1.0, MAX_LN_STEP / max(abs(step).max(), 1e-300))
    return d


def full_summary(
    trials: Sequence[Scored], rivals: Mapping[str, Mapping[str, str]] | None = None
) -> Json:
    """All figures; rivals: answers of simpler methods, by trial and method (`rivals`)."""
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
