"""Verdicts: named, undecided, no gap seen, or outside the catalogue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from .evidence import NONE, OUTSIDE, Hypothesis
from .gap import chi2_tail
from .several import PRIOR_NONE, before, present

VerdictKind = Literal["named", "undecided", "no_gap", "outside"]
NAMED: Final = "named"
UNDECIDED: Final = "undecided"
NO_GAP: Final = "no_gap"
SURE = 0.7  # probability from which an effect is named
RULED_OUT = 0.05  # probability of no effect, below which there is a gap
CHECK = 0.01  # p-value of chi2 of an explanation, below which it does not fit
SET = 0.9  # probability that the candidates have together
PERHAPS = 0.1  # probability of a further effect, from which it is mentioned


@dataclass(frozen=True)
class Further:
    """An effect that is perhaps there in addition to those that are named."""

    id: str  # id of the effect
    probability: float  # probability that it is present


@dataclass(frozen=True)
class Verdict:
    """Verdict of a diagnosis."""

    kind: VerdictKind
    key: str | None  # the named effects, "id1", "id1+id2", ...; others may be present too
    candidates: tuple[str, ...]  # keys that hold 90 % of the probability together
    check: float  # p-value of the likeliest effect's own fit
    words: str  # one sentence
    # key of the likeliest set of effects, of those with the named effects if any are named
    best: str | None = None
    also: tuple[Further, ...] = ()  # effects that may be present too, likeliest first


def decide(
    hypotheses: Sequence[Hypothesis], probabilities: Mapping[str, float], rows: int, variables: int
) -> Verdict:
    """The verdict by fixed rules; rows, variables: their numbers.

    named: the largest set of effects that are present with p >= 0.7, alone or with others, if
    chi2 of the likeliest fit with them has p > 0.01, p(none) < 0.05, two degrees of freedom are
    left, and no size is at the bound of its range. outside: p(none) < 0.05, and p(outside) >= 0.5
    or that fit has p <= 0.01. no_gap: "none" is the likeliest, and likelier than its prior.
    """
    order = sorted(probabilities, key=lambda key: -probabilities[key])
    totals = np.cumsum([probabilities[key] for key in order])
    candidates = order[: int(np.searchsorted(totals, SET)) + 1]
    effects = [key for key in order if key not in (NONE, OUTSIDE)]
    none = probabilities[NONE]
    by_key = {h.key: h for h in hypotheses}
    sure = most_sure(probabilities)
    # the likeliest explanation that has all of them, or of all
    best = next((key for key in effects if not sure or holds(key, sure)), None)
    check = _check(by_key[best], rows, variables) if best else 1.0

    def verdict(kind: VerdictKind, words: str, also: Sequence[Further] = ()) -> Verdict:
        key = sure if kind == NAMED else None
        return Verdict(kind, key, tuple(candidates), check, words, best, tuple(also))

    if rows <= variables:
        return verdict(UNDECIDED, "cannot tell: there are no more data than design variables")
    if best and sure and check > CHECK and none < RULED_OUT:
        if at_bound := [id for id in by_key[best].at_bound if holds(sure, id)]:
            words = (
                f"there is a gap; {best} comes nearest{_with_at_bound(at_bound)}: a size beyond it"
                " would fit better, so that its probability does not name it"
            )
            return verdict(UNDECIDED, words)
        if rows - variables - len(by_key[best].values) < 2:
            words = f"there is a gap; {best} comes nearest, but with so few data others would, too"
            return verdict(UNDECIDED, words)
        also = perhaps(probabilities, sure)
        words = " and ".join(sure.split("+")) + (" explain" if "+" in sure else " explains")
        words += " the gap"
        words += f", perhaps with {' or '.join(each.id for each in also)}" if also else ""
        return verdict(NAMED, words, also)
    if none < RULED_OUT and (probabilities[OUTSIDE] >= 0.5 or (sure and check <= CHECK)):
        nearest = _falls_short(best, check) + _with_at_bound(by_key[best].at_bound if best else [])
        words = f"there is a gap; {nearest}; likelier is that {by_key[OUTSIDE].words}"
        return verdict(OUTSIDE, words)
    if order[0] == NONE and none > before(hypotheses).get(NONE, PRIOR_NONE):
        return verdict(NO_GAP, no_gap_words(none))
    gap = "there is a gap" if none < RULED_OUT else "there may be a gap"
    words = f"{gap}, its cause is undecided: {_why_undecided(probabilities, sure, check)}"
    return verdict(UNDECIDED, words)


def _why_undecided(probabilities: Mapping[str, float], sure: str | None, check: float) -> str:
    """Reason why the probabilities decide nothing."""
    none = probabilities[NONE]
    if sure and none >= RULED_OUT:
        but = "does not fit, and" if check <= CHECK else "fits, but"
        return f"{sure} {but} no effect at all still has a probability of {none:.2f}"
    if none > max(p for key, p in probabilities.items() if key != NONE):
        return f"no effect at all is likeliest, {none:.2f}, but no likelier than before the data"
    return f"no effect has a probability of {SURE:g}"


def no_gap_words(none: float) -> str:
    """Sentence that no gap is seen, by the probability of no effect: below `SET` none is excluded
    either."""
    return "no gap is seen" if none >= SET else f"not seen, not excluded: no effect {none:.2f}"


def holds(key: str, ids: str) -> bool:
    """Whether the hypothesis ``key`` has all effects of the key ``ids``."""
    return set(ids.split("+")) <= set(key.split("+"))


def most_sure(probabilities: Mapping[str, float]) -> str | None:
    """Key of the largest set of effects that are present together with p >= 0.7; of several such
    sets the likeliest; None if there is none."""
    keys = [key for key in probabilities if key not in (NONE, OUTSIDE)]
    sure = [
        (key.count("+"), p, key)
        for key in keys
        if (p := present(probabilities, key.split("+"))) >= SURE
    ]
    return max(sure)[2] if sure else None


def perhaps(probabilities: Mapping[str, float], named: str) -> list[Further]:
    """Effects that are present in addition to the named ones with p >= 0.1, likeliest first."""
    ids = named.split("+")
    others = {id for key in probabilities for id in key.split("+")} - {*ids, NONE, OUTSIDE}
    also = [Further(id, present(probabilities, [*ids, id])) for id in others]
    likely = [each for each in also if each.probability >= PERHAPS]
    return sorted(likely, key=lambda each: (-each.probability, each.id))


def _with_at_bound(ids: Sequence[str]) -> str:
    """Words on effects whose size is at the bound of its range: a larger one would fit better."""
    return f", with {' and '.join(ids)} at the bound of its range" if ids else ""


def _falls_short(best: str | None, check: float) -> str:
    """Reason why the catalogue's likeliest explanation falls short."""
    if best is None:
        return "the catalogue has nothing that could explain it"
    if check <= CHECK:
        return f"{best} comes nearest in the catalogue and does not fit"
    return f"{best} would fit"


def _check(hypothesis: Hypothesis, rows: int, variables: int) -> float:
    """p-value of chi2 at the likeliest parameters."""
    freedom = max(1, rows - variables - len(hypothesis.values))
    return chi2_tail(float(hypothesis.fitted.chi2[hypothesis.best]), freedom)
