"""Dependence of a verdict on the assumptions: the verdict on the same data with other assumptions.

Every prior, the standard deviation of every constant, the response errors of effects
(`Effect.response_error`, the allowance for their laws) and the spread of the variables are halved
and doubled. The model's form error and the section's errors are set to zero.
Each label is left out in turn. The scatter of the data stays: the check of the fit tests it.

Only hypotheses with enough probability are evaluated again, on the grids of their parameters, with
the model linear in the variables about the fits that are known (`reweighed`). For several effects,
only the grid points with enough probability are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..inference.inverse_problem import InverseProblem
from ..inference.observations import DampingRatios
from ..inference.section_fields import SECTION
from .evidence import (
    NONE,
    OUTSIDE,
    REFIT_STEPS,
    Fitted,
    Hypothesis,
    families,
    ln_shares,
    outside,
    refit,
    refit_at,
)
from .reweighed import Perturbation, lines, perturbed_evidence
from .several import coupled_most, present, probabilities
from .verdict import NAMED, NO_GAP, UNDECIDED, Verdict, decide, holds

Array = np.ndarray
FACTORS = {0.5: "half", 2.0: "twice"}
# least probability of a hypothesis that is evaluated again, over that of the likeliest one
MIN_WEIGHED = 1e-5
MAX_WEIGHED = 20  # hypotheses with effects that are evaluated again
MAX_LN_BELOW_BEST = 8.0  # ln posterior below the best one, up to which grid points are kept
JUDGED = {UNDECIDED: "undecided", NO_GAP: "no gap", "outside": "not explained by the catalogue"}


@dataclass(frozen=True)
class Robustness:
    """How much a verdict depends on its assumptions."""

    robust: bool  # whether no change of an assumption changes the verdict
    hangs_on: tuple[str, ...]  # the changes that do, each with the verdict that follows
    # range of `verdict_probability` over all changes
    low: float
    high: float


def robustness(
    problem: InverseProblem,
    hypotheses: Sequence[Hypothesis],
    verdict: Verdict,
    sources: Sequence[str],
) -> Robustness:
    """Robustness of the verdict on these hypotheses.

    sources: names of the sources of error, in the order of `InverseProblem.constants`.
    """
    kept = _probable(hypotheses)
    p = [verdict_probability(probabilities(hypotheses), verdict)]
    changes: list[str] = []
    for words, judged, rows in _variants(problem, kept, verdict, sources):
        share = probabilities(judged)
        p.append(verdict_probability(share, verdict))
        other = decide(judged, share, rows, len(problem.centre))
        if (other.kind, other.key) != (verdict.kind, verdict.key):
            changes.append(f"{words} ({in_words(other)})")
    return Robustness(not changes, tuple(changes), min(p), max(p))


def verdict_probability(p: Mapping[str, float], verdict: Verdict) -> float:
    """Probability that the verdict is right.

    Named or undecided: that the named, or else the likeliest, effects are present, alone or with
    others. No gap: that there is no effect. Outside: that the cause is not in the catalogue.
    """
    if verdict.kind in (NAMED, UNDECIDED):
        key = verdict.key or verdict.best
        return present(p, key.split("+")) if key else 0.0
    return present(p, [NONE if verdict.kind == NO_GAP else OUTSIDE])


def _variants(
    problem: InverseProblem, kept: Sequence[Hypothesis], verdict: Verdict, sources: Sequence[str]
) -> Iterator[tuple[str, list[Hypothesis], int]]:
    """For each change of an assumption: the change in words, the hypotheses with it, and the number
    of rows that are used."""
    count = len(problem.places)
    for words, power in _priors(verdict):
        for factor, times in FACTORS.items():
            # `probabilities` makes them sum to 1
            changed = [replace(h, prior=h.prior * factor ** power(h)) for h in kept]
            yield f"the prior of {words} {times} as large", changed, count
    changes = list(_changes(problem, sources))
    by_hypothesis = [_reevaluate(problem, h, changes) for h in kept]
    for other, *changed in zip(changes, *by_hypothesis, strict=True):
        yield other.words, changed, int(other.keep.sum())


def _priors(verdict: Verdict) -> Iterator[tuple[str, Callable[[Hypothesis], int]]]:
    """Priors in words, and the power to which a hypothesis's prior contains each."""
    yield "no effect", lambda h: int(h.key == NONE)
    yield "an unlisted cause", lambda h: int(h.key == OUTSIDE)
    yield "each further effect", lambda h: max(len(h.values) - 1, 0)
    if key := verdict.key or verdict.best:
        words = " and ".join(key.split("+"))
        yield words, lambda h: int(bool(h.values) and holds(h.key, key))


def _changes(problem: InverseProblem, sources: Sequence[str]) -> Iterator[Perturbation]:
    """All changes of the assumptions except the priors."""
    rows = problem.observations.rows
    every = np.ones(len(rows), bool)
    of_section = [k for k, name in enumerate(sources) if name.startswith(SECTION)]
    constants = {
        name.replace("_", " "): [k] for k, name in enumerate(sources) if k not in of_section
    }
    if len(constants) > 1:
        constants["all constants"] = [k for (k,) in constants.values()]
    if of_section:
        constants["the section"] = of_section
        yield Perturbation("the section taken as exact", _scaled(problem, of_section, 0.0), every)
    for factor, times in FACTORS.items():
        for name, places in constants.items():
            words = f"the standard deviation of {name} {times} as large"
            yield Perturbation(words, _scaled(problem, places, factor), every)
        yield Perturbation(
            f"the allowance for effects' laws {times} as large", problem, every, factor
        )
        looser = replace(problem, spread=factor * problem.spread)
        yield Perturbation(
            f"the prior standard deviation of variables {times} as large", looser, every
        )
    if problem.damping:
        plain = replace(problem.observations, damping=DampingRatios())
        undamped = replace(problem, observations=plain, damping_places=np.zeros(0, int))
        yield Perturbation("without damping ratios", undamped, every)
    sure = replace(problem, assumed=replace(problem.assumed, form=0.0))
    yield Perturbation("no model error", sure, every)
    for label in sorted({row.label for row in rows if row.label}, key=str):
        keep = np.array([row.label != label for row in rows])
        if keep.any():
            yield Perturbation(f"without {label.display}", problem, keep)


def _scaled(problem: InverseProblem, places: Sequence[int], factor: float) -> InverseProblem:
    """The problem with the standard deviations of some sources of error times a factor."""
    return replace(problem, reduced={**problem.reduced, **dict.fromkeys(places, factor)})


def _probable(hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses that are evaluated again: "none", "outside", and the likeliest with effects. Those
    with several effects keep only their probable grid points."""
    ln = {h.key: h.ln_evidence + np.log(h.prior) for h in hypotheses}
    least = max(ln.values()) + np.log(MIN_WEIGHED)
    likely = [h for h in hypotheses if h.values and ln[h.key] > least]
    likely = sorted(likely, key=lambda h: -ln[h.key])[:MAX_WEIGHED]
    kept = [h for h in hypotheses if not h.values]
    for h in likely:
        p = h.posterior
        is_kept = p > p.max() * np.exp(-MAX_LN_BELOW_BEST)
        if len(h.values) > 1:
            values = {id: e[is_kept] for id, e in h.values.items()}
            fitted = Fitted(*(each[is_kept] for each in h.fitted))
            h = replace(h, values=values, ln_weights=h.ln_weights[is_kept], fitted=fitted)
        kept.append(h)
    return kept


def _reevaluate(
    problem: InverseProblem, h: Hypothesis, changes: Sequence[Perturbation]
) -> list[Hypothesis]:
    """The hypothesis with its evidence under each of the changes."""
    if h.key == OUTSIDE:
        return _reevaluate_outside(problem, h, changes)
    # only the few values of zeta, the coupling of near modes, that have most of the evidence
    d, among, result = h.fitted.d, coupled_most([h]), []
    fits = lines(problem, h.values, d, among)
    for other in changes:
        if other.parts_near_modes:  # the linear fits do not hold: fit again
            fewer = other.problem.only(other.keep)
            refitted = refit(fewer, h.values, len(d), among=among, near=d)
            ln, chi2 = refitted.ln_evidence, refitted.chi2
        else:
            ln, chi2 = perturbed_evidence(fits, other, among)
        total = float(np.logaddexp.reduce(ln + h.ln_weights))
        fitted = h.fitted._replace(ln_evidence=ln, chi2=chi2)
        result.append(replace(h, ln_evidence=total, fitted=fitted))
    return result


def _reevaluate_outside(
    problem: InverseProblem, h: Hypothesis, changes: Sequence[Perturbation]
) -> list[Hypothesis]:
    """The hypothesis "outside" with its evidence under each of the changes. Families of errors that
    concern only rows that are left out, such as the misreading of their label, do not count."""
    extra = np.array([family.extra for family in families(problem)])
    added, start = problem.added({}, len(extra)), np.zeros((len(extra), len(problem.centre)))
    near = refit_at(problem, problem, added, extra, start, REFIT_STEPS).d
    fits, result = lines(problem, {}, near, extra=extra), []
    for other in changes:
        if other.parts_near_modes:
            total = outside(other.problem.only(other.keep)).ln_evidence
        else:
            now = families(other.problem)
            more = np.array([family.extra for family in now])
            ln, _ = perturbed_evidence(fits, other, extra=more)
            there = np.array([each[np.ix_(other.keep, other.keep)].any() for each in more])
            shares = ln_shares([family for family, on in zip(now, there, strict=True) if on])
            total = float(np.logaddexp.reduce(ln[there] + shares))
        result.append(replace(h, ln_evidence=total))
    return result


def in_words(verdict: Verdict) -> str:
    """A verdict in a few words."""
    named = f"{' and '.join(verdict.key.split('+'))} named" if verdict.key else ""
    return f"then {named or JUDGED[verdict.kind]}"
