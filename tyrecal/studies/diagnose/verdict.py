"""What may be said: named, undecided, no gap seen, or outside the catalogue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from .evidence import NONE, OUTSIDE, PRIOR_NONE, Hypothesis
from .gap import chi2_tail

VerdictKind = Literal["named", "undecided", "no_gap", "outside"]
NAMED: Final = "named"
UNDECIDED: Final = "undecided"
NO_GAP: Final = "no_gap"
SURE, RULED_OUT, CHECK, SET = 0.7, 0.05, 0.01, 0.9


@dataclass(frozen=True)
class Verdict:
    """What may be said."""

    kind: VerdictKind
    key: str | None  # of what is named, an id or "id1+id2"
    candidates: tuple[str, ...]  # keys that hold 90 % of the probability together
    check: float  # p-value of the likeliest effect's own fit
    words: str  # one sentence


def decide(
    hypotheses: Sequence[Hypothesis], probabilities: Mapping[str, float], rows: int, variables: int
) -> Verdict:
    """The verdict by fixed rules.

    named: p >= 0.7, the fit with it has p > 0.01, p(none) < 0.05, and no size at the bound of its
    range; outside: p >= 0.5 and p(none) < 0.05, or nothing that fits; no_gap: "none" is likelier
    than it was before, and likeliest.
    """
    order = sorted(probabilities, key=lambda key: -probabilities[key])
    totals = np.cumsum([probabilities[key] for key in order])
    candidates = order[: int(np.searchsorted(totals, SET)) + 1]
    effects = [key for key in order if key not in (NONE, OUTSIDE)]
    none = probabilities[NONE]
    by_key = {h.key: h for h in hypotheses}
    best = effects[0] if effects else None
    check = _check(by_key[best], rows, variables) if best else 1.0

    def verdict(kind: VerdictKind, words: str) -> Verdict:
        return Verdict(kind, best if kind == NAMED else None, tuple(candidates), check, words)

    if rows <= variables:
        return verdict(UNDECIDED, "cannot tell: there are no more data than design variables")
    sure = best is not None and probabilities[best] >= SURE
    if sure and check > CHECK and none < RULED_OUT:
        assert best is not None
        if at_bound := by_key[best].at_bound:
            ids = " and ".join(at_bound)
            words = f"there is a gap; {best} comes nearest, with {ids} at the bound of its range"
            return verdict(UNDECIDED, words)
        return verdict(NAMED, f"{best} explains the gap")
    if none < RULED_OUT and (probabilities[OUTSIDE] >= 0.5 or (sure and check <= CHECK)):
        likely = f"{best} explains most of it and does not fit"
        gap = likely if sure else "no effect of the catalogue is as likely as something else"
        return verdict(OUTSIDE, f"there is a gap, and {gap}: {by_key[OUTSIDE].words}")
    if order[0] == NONE and none > PRIOR_NONE:
        return verdict(NO_GAP, "no gap is seen")
    gap = "there is a gap" if none < RULED_OUT else "there may be a gap"
    return verdict(UNDECIDED, f"{gap}, its cause is undecided")


def _check(hypothesis: Hypothesis, rows: int, variables: int) -> float:
    """p-value of chi2 at the likeliest parameters."""
    freedom = max(1, rows - variables - len(hypothesis.values))
    return chi2_tail(float(hypothesis.fitted.chi2[hypothesis.best]), freedom)
