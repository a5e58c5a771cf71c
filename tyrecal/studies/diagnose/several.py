"""Hypotheses of one, two and three effects, built by adding one effect after the other.

Priors: no effect 0.25, outside the catalogue 0.10. The rest is shared so that two effects have
``further`` times the prior of one, three ``further`` times that of two; all sets of the same number
are equally probable. 26 effects have 325 pairs and 2600 triples. So these sets are tried: the
likeliest single effects with every other one; the pairs that explain most together; and probable
pairs with the effects that are most like the residual that they leave.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from math import comb
from typing import Final

import numpy as np

from ..inference.inverse_problem import InverseProblem
from .evidence import NONE, OUTSIDE, PRIOR_OUTSIDE, Hypothesis, explain, grid, outside, refit

Array = np.ndarray
PRIOR_NONE: Final = 0.25  # probability of no effect, before the data
MAX_EFFECTS = 3  # at a time
COUPLED_POINTS = 3  # values of zeta (`veering.rule`) that are used for two and three effects
PARTNERS = 4  # single effects that are tried with every other
# number of pairs that a third effect is added to; ln probability that they may be behind the best
BASES, BASES_WITHIN = 3, 3.0
THIRDS = 4  # effects that are added to each pair
HIDDEN_PAIRS = 4  # further pairs, that explain most together
# ln probability behind the best smaller set, beyond which `evidence.FEW_POINTS` are enough
FEW_ENOUGH = 8.0


def weigh_hypotheses(
    problem: InverseProblem,
    pairs: bool = True,
    before: tuple[InverseProblem, Sequence[Hypothesis]] | None = None,
) -> list[Hypothesis]:
    """Every hypothesis with its evidence. pairs: include sets of two and three effects; before: an
    earlier problem and its hypotheses, reused if the model's answers did not change."""
    reusable = _reusable(problem, *before) if before else {}
    ids = list(problem.expansion.nodes)
    prior = priors(len(ids), problem.assumed.further, MAX_EFFECTS if pairs else 1)
    plain = refit(problem, {}, 1)
    none = Hypothesis(NONE, PRIOR_NONE, float(plain.ln_evidence[0]), {}, np.zeros(1), plain)
    hypotheses = [none, outside(problem)]
    hypotheses += [reusable.get(id) or explain(problem, [id], prior[1]) for id in ids]
    for count in range(2, len(prior) + 1):
        hypotheses += _with_one_more(problem, hypotheses, count, prior[count], reusable)
    return hypotheses


def _reusable(
    problem: InverseProblem, before: InverseProblem, hypotheses: Sequence[Hypothesis]
) -> dict[str, Hypothesis]:
    """Earlier hypotheses, by key, whose effects have not been evaluated again since."""
    now, then = problem.expansion, before.expansion
    new = {frozenset([id]) for id, nodes in now.nodes.items() if nodes is not then.nodes[id]}
    new |= {frozenset(ids) for ids, each in now.joint.items() if each is not then.joint.get(ids)}
    switched = {change.id for change in problem.changes}  # which all tyres have in some run
    return {
        h.key: h
        for h in hypotheses
        if h.values and not any(added_ids <= {*h.values, *switched} for added_ids in new)
    }


def priors(effects: int, further: float, most: int = MAX_EFFECTS) -> dict[int, float]:
    """Prior of one set of 1, 2, ... effects, of ``effects`` in all; all sets together have 0.65."""
    counts = range(1, min(most if further else 1, effects) + 1)
    total = sum(further ** (k - 1) for k in counts)
    rest = 1 - PRIOR_NONE - PRIOR_OUTSIDE
    return {k: rest * further ** (k - 1) / total / comb(effects, k) for k in counts}


def probabilities(hypotheses: Sequence[Hypothesis]) -> dict[str, float]:
    """Posterior probability by key; they sum to 1. See `Hypothesis.shares`."""
    ln = np.array([h.ln_evidence + np.log(h.prior) for h in hypotheses])
    p = np.exp(ln - ln.max())
    return _by_key(hypotheses, p / p.sum(), lambda h: h.posterior)


def before(hypotheses: Sequence[Hypothesis]) -> dict[str, float]:
    """Prior probability by key, of the hypotheses that were evaluated."""
    return _by_key(
        hypotheses, np.array([h.prior for h in hypotheses]), lambda h: np.exp(h.ln_weights)
    )


def present(p: Mapping[str, float], ids: Sequence[str]) -> float:
    """Probability that all these effects are present, alone or with others."""
    total = sum(each for key, each in p.items() if set(ids) <= set(key.split("+")))
    return min(total, 1.0)  # rounded


def _by_key(
    hypotheses: Sequence[Hypothesis], p: Array, over: Callable[[Hypothesis], Array]
) -> dict[str, float]:
    """Sum by key of the hypotheses' probabilities ``p``. If the case states an effect as uncertain,
    p is divided by the weights ``over`` its grid (`Hypothesis.shares`)."""
    totals = {h.key: 0.0 for h in hypotheses}
    for h, whole in zip(hypotheses, p.tolist(), strict=True):
        if not h.prior_sd:
            totals[h.key] += whole
            continue
        for key, share in h.shares(over(h)).items():
            totals[key if key in totals else h.key] += whole * share
    return totals


def _with_one_more(
    problem: InverseProblem,
    hypotheses: Sequence[Hypothesis],
    count: int,
    prior: float,
    reusable: Mapping[str, Hypothesis],
) -> list[Hypothesis]:
    """Sets of ``count`` effects: the likeliest sets of one effect less, each with others. reusable:
    known hypotheses by key."""
    order = [h.key for h in hypotheses if h.key in problem.expansion.nodes]
    singles = {h.key: h for h in hypotheses if h.key in order}
    fewer = [h for h in hypotheses if len(h.values) == count - 1]
    fewer = sorted(fewer, key=lambda h: -h.ln_evidence)
    if count == 2:
        wanted = {frozenset((h.key, id)) for h in fewer[:PARTNERS] for id in order if id != h.key}
        wanted |= {*hidden_pairs(problem, hypotheses[0], wanted)}
    else:
        ln = {h.key: h.ln_evidence + np.log(h.prior) for h in hypotheses if h.key != OUTSIDE}
        likely = [h for h in fewer[:BASES] if ln[h.key] > max(ln.values()) - BASES_WITHIN]
        wanted = {frozenset((*h.values, id)) for h in likely for id in next_candidates(problem, h)}
    sets = [[id for id in order if id in each] for each in wanted]
    most, result = max(h.ln_evidence + np.log(h.prior) for h in hypotheses), []
    for ids in sorted(sets, key=lambda ids: [order.index(id) for id in ids]):
        among = coupled_most([singles[id] for id in ids])
        h = reusable.get("+".join(ids)) or explain(problem, ids, prior, among, few=True)
        if h.few and h.ln_evidence + np.log(prior) > most - FEW_ENOUGH:
            h = explain(problem, ids, prior, among)
        result.append(h)
    return result


def with_sets(
    problem: InverseProblem, hypotheses: Sequence[Hypothesis], others: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """The hypotheses, and sets of effects of ``others`` that are not among them."""
    by_key = {h.key: h for h in hypotheses}
    more = {h.key: h for h in others if h.key not in by_key}
    return [
        *hypotheses,
        *(
            explain(problem, list(h.values), h.prior, coupled_most([by_key[id] for id in h.values]))
            for h in more.values()
        ),
    ]


def coupled_most(known: Sequence[Hypothesis]) -> dict[int, float]:
    """The values of zeta with the most evidence: {index in `veering.rule`: density, mean over
    ``known``}; {} if no modes are coupled."""
    share = np.mean([h.fitted.coupled.T @ h.posterior for h in known], axis=0)
    return {int(k): float(share[k]) for k in np.argsort(-share)[:COUPLED_POINTS]}


def next_candidates(problem: InverseProblem, base: Hypothesis) -> list[str]:
    """The `THIRDS` effects with the largest gain in addition to those of ``base``."""
    gains = {id: float(own.max()) for id, (own, *_) in _gains(problem, base).items()}
    return sorted(gains, key=lambda id: -gains[id])[:THIRDS]


def hidden_pairs(
    problem: InverseProblem, none: Hypothesis, tried: Container[frozenset[str]]
) -> list[frozenset[str]]:
    """The `HIDDEN_PAIRS` pairs not in ``tried`` with the largest gain together. Calibration may
    hide each of two effects alone, as with a lateral and a tilting spring."""
    gains = {}
    for (a, (own, _, Pc)), (b, (other, c, _)) in combinations(_gains(problem, none).items(), 2):
        if frozenset((a, b)) not in tried:
            gains[frozenset((a, b))] = float((own[:, None] + other - Pc @ c.T).max())
    return sorted(gains, key=lambda pair: -gains[pair])[:HIDDEN_PAIRS]


def _gains(problem: InverseProblem, base: Hypothesis) -> dict[str, tuple[Array, Array, Array]]:
    """For each effect that is not in ``base``, over its range (q,): its gain in ln likelihood, its
    shift c (q, n), and c P (q, n).

    r: residual of the base's likeliest fit; P: the part of a residual that neither x nor the sizes
    of the base's effects absorb. c gains c^T P r - c^T P c / 2; c and c' together gain -c^T P c'
    more than the sum of both.
    """
    best = base.best
    problem = replace(problem, zeta=float(base.fitted.zeta[best]))
    sizes = {id: float(e[best]) for id, e in base.values.items()}
    at = {id: np.array([e]) for id, e in sizes.items()}
    d = base.fitted.d[best]
    added = problem.added(at, 1)
    inverse = np.linalg.inv(problem.sigma + problem.response_covariance(added)[0])
    columns, information = [problem.plain(d)[1] + added.tilt[0]], [problem.spread**-2.0]
    for id, e in sizes.items():
        low, high = problem.expansion.nodes[id].reach
        ends = {**at, id: np.array([max(low, e - (high - low) / 50)])}
        other = {**at, id: np.array([min(high, e + (high - low) / 50)])}
        rise = (problem.added(other, 1).shift - problem.added(ends, 1).shift)[0]
        width = float(other[id][0] - ends[id][0])
        columns.append(rise[:, None] / width)
        information.append(np.array([12 / (high - low) ** 2]))  # of a uniform distribution
    J = np.hstack(columns)
    inner = J.T @ inverse @ J + np.diag(np.concatenate(information))
    P = inverse - inverse @ J @ np.linalg.solve(inner, J.T @ inverse)
    r = problem.observations.y - problem.predicted(at, d[None])[0]
    gains = {}
    for id, nodes in problem.expansion.nodes.items():
        if id not in sizes:
            points, _ = grid(nodes)
            c = problem.added({id: points}, len(points)).shift - problem.added({}, 1).shift
            Pc = c @ P
            gains[id] = Pc @ r - (Pc * c).sum(1) / 2, c, Pc
    return gains
