"""Dependence of a verdict on the assumptions: the verdict on the same data with other assumptions.

Every prior, the standard deviation of every constant, the response errors of effects
(`Effect.response_error`, the allowance for their laws) and the spread of the variables are halved
and doubled. The model's form error and the section's errors are set to zero.
Each label is left out in turn. The scatter of the data stays: the check of the fit tests it.

Only hypotheses with enough probability are evaluated again, on the grids of their parameters, about
the fits that are known. For several effects, only the grid points with enough probability are kept.
About a fit eta is linear in x, whose prior is normal with spread S_x: integrated over x

    ln Z = -r^T T^-1 r / 2 - ln|2 pi T| / 2 + ln p(labels) + ln p(splits),   T = S + J S_x J^T,

S (n, n): covariance of the n observations y = ln f; J (n, v) = d eta / dx at the fit; r: residual
of y at the centre of the prior by this linear model (Bishop, Pattern Recognition and Machine
Learning, 2.115). Where the fit is the best one this is Laplace's approximation itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..inference.compressed_cords import COMPRESSION
from ..inference.inverse_problem import Added, InverseProblem
from ..inference.observations import DampingRatios
from ..inference.section_fields import SECTION
from ..inference.veering import rule
from .evidence import (
    COUPLED_STEPS,
    NONE,
    OUTSIDE,
    REFIT_STEPS,
    Fitted,
    Hypothesis,
    families,
    ln_shares,
    model_of,
    outside,
    over_zeta,
    refit,
    refit_at,
)
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
class Perturbation:
    """The problem with one changed assumption, which ``words`` names."""

    words: str
    problem: InverseProblem  # with the same rows
    keep: Array  # (n,) mask of the rows that are used
    response_factor: float = 1.0  # factor on `Effect.response_error` of all effects

    @property
    def parts_near_modes(self) -> bool:
        """Whether a row is left out that is coupled with another mode (`veering`). The evidence of
        the labels and the partner's frequency then change, so linear fits do not hold."""
        return bool(self.problem.veering.size[~self.keep].any())


@dataclass(frozen=True)
class LinearFit:
    """A hypothesis at parameters (q,), linear in x about its re-fits, at one zeta of `veering`."""

    place: int | None  # index of zeta in `veering.rule`; None: no modes are coupled
    residual: Array  # (q, n) at the centre of x
    slopes: Array  # (q, n, v) J = d eta / dx
    by_response: Array  # (q, n, n) covariance of the effects' shifts by `Effect.response_error`
    by_shape: Array  # (q, n, n) and by `Effect.shape_uncertainty`
    ln_label: Array  # (q,) ln probability of the labels
    split: Array  # (q, n) distance of the two modes of a pair, in ln f
    ln_damping: Array | float = 0.0  # (q,) ln probability of the damping ratios

    def covariance(self, problem: InverseProblem, response_factor: float = 1.0) -> Array:
        """S (q, n, n): covariance of the observations under the hypothesis."""
        at = problem if self.place is None else problem.integrand[self.place]
        return np.asarray(at.sigma + response_factor**2 * self.by_response + self.by_shape)

    def ln_evidence(self, other: Perturbation, extra: Array | None) -> tuple[Array, Array]:
        """ln Z and chi2 of the data (q,). extra (q, n, n): more covariance."""
        problem, keep = other.problem, other.keep
        S = self.covariance(problem, other.response_factor)
        S = (S if extra is None else S + extra)[:, keep][:, :, keep]
        r, J = self.residual[:, keep], self.slopes[:, keep] * problem.spread
        T = S + J @ J.transpose(0, 2, 1)
        w = np.linalg.solve(T, r[:, :, None])
        whole, taken = (w[:, :, 0] * r).sum(1), (J.transpose(0, 2, 1) @ w)[:, :, 0]
        ln = -(whole + np.linalg.slogdet(T)[1] + keep.sum() * np.log(2 * np.pi)) / 2
        ln += self.ln_label + problem.only(keep).splits.ln_likelihood(self.split[:, keep])
        if problem.damping:
            ln += self.ln_damping
        return ln, whole - (taken**2).sum(1)  # taken: x of the likeliest fit, over its spread


def lines(
    problem: InverseProblem,
    effects: Mapping[str, Array],
    near: Array,
    among: Mapping[int, float] | None = None,
    extra: Array | None = None,
) -> list[LinearFit]:
    """One for each point of the rule in what couples near modes, or one if none are, about re-fits
    that start from x - x0 = near (q, v); the rest as in `refit`."""
    added, result = problem.added(effects, len(near)), []
    places: list[int | None] = [*(among or range(len(problem.integrand)))]
    at = [problem if k is None else problem.integrand[k] for k in places or [None]]
    fitted = refit_at(problem, at, added, extra, near, COUPLED_STEPS)
    for k, d, covariance in zip(places or [None], fitted.d, fitted.covariance, strict=True):
        line = line_about(problem, added, d, k)
        if problem.damping:
            ln = problem.damping.ln_likelihood(added.damping, d, np.linalg.inv(covariance))
            line = replace(line, ln_damping=ln)
        result.append(line)
    return result


def line_about(problem: InverseProblem, added: Added, d: Array, place: int | None) -> LinearFit:
    """About x - x0 = d (q, v), with what effects add."""
    at = problem if place is None else problem.integrand[place]
    eta, J, ln_label = (each[0] for each in model_of(problem, [at], added)(d[None]))
    back = d - (problem.centre - problem.expansion.x0)
    residual = problem.observations.y - eta + (J @ back[:, :, None])[:, :, 0]
    # with their standard deviations transformed to the coupled modes
    by_response, by_shape = problem.response_covariances(at.with_mixed_laws(added))
    return LinearFit(place, residual, J, by_response, by_shape, ln_label, added.split)


def perturbed_evidence(
    known: list[LinearFit],
    other: Perturbation,
    among: Mapping[int, float] | None = None,
    extra: Array | None = None,
) -> tuple[Array, Array]:
    """ln Z, and chi2 of the likeliest way in which near modes are coupled, (q,). among: as of
    `several.coupled_most`."""
    ln, chi2 = map(np.array, zip(*(line.ln_evidence(other, extra) for line in known), strict=True))
    if known[0].place is None:
        return ln[0], chi2[0]
    zeta = np.array([rule()[0][line.place] for line in known if line.place is not None])
    best = (ln - zeta[:, None] ** 2 / 2).argmax(0)
    return over_zeta(ln, among), chi2[best, np.arange(len(best))]


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
    slack = [k for k, name in enumerate(sources) if name.startswith(COMPRESSION)]
    constants = {
        name.replace("_", " "): [k]
        for k, name in enumerate(sources)
        if k not in (*of_section, *slack)
    }
    if len(constants) > 1:
        constants["all constants"] = [k for (k,) in constants.values()]
    if slack:
        constants["what compressed cords bear"] = slack
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
    near = refit_at(problem, [problem], added, extra, start, REFIT_STEPS).d[0]
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
