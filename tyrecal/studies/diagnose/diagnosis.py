"""The whole diagnosis: observations and a model go in, an honest answer comes out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...errors import InputError
from ...files import Json
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.label import Label
from ..inference.expansion import MIDDLE, Expansion, anchored, carried, expand, refined
from ..inference.inverse_problem import Assumed, InverseProblem, Toggle, places
from ..inference.model import ModelRow, Query, ResponseModel
from ..inference.observations import Observations
from ..inference.plain_fit import plain_fit
from ..inference.regions import SectionPart
from ..inference.separability import Separability, separate
from .evidence import NONE, Hypothesis, quantile, refit
from .gap import Gap, chi2_tail, find_gap, projection
from .labelings import (
    REFUTED,
    Reading,
    averaged,
    exchange_shifts,
    exchanged,
    over_labels,
    shares,
    with_exchanged,
)
from .next_measurement import SIZES, Choice, OtherStates, rank
from .robustness import Robustness, robustness
from .several import probabilities, weigh_hypotheses, with_sets
from .shrinkage import Shrinkage, shrink
from .verdict import CHECK, NAMED, NO_GAP, Verdict, decide, holds
from .where import PartChange, section_map

Array = np.ndarray
IN_PLAY_WITHIN = 8.0  # ln evidence behind the best, up to which an effect is asked again
MAX_IN_PLAY = 6
MAX_JOINT, CARRIES_WEIGHT = 3, 0.02  # sets of effects that are asked together; probability of one
CARRIED_WITHIN = 0.7  # of x, from where effects are followed by their slopes
STAGES = (
    "calibrate and evaluate each effect",
    "evaluate the likeliest effects again",
    "parts of the section",
    "the next measurements",
)
# of an effect's range, and of x: no effect is evaluated again as near as that to where it was, and
# at 0, without effects, all is known
KNOWN_WITHIN = 0.05


@dataclass(frozen=True)
class Diagnosis:
    """Result of a diagnosis, with the problem as it was solved."""

    problem: InverseProblem  # as it was solved
    bare: InverseProblem  # before effects were asked again, near modes coupled as without effects
    variables: tuple[str, ...]  # names of x
    sources: tuple[str, ...]  # names of the sources of error
    hypotheses: tuple[Hypothesis, ...]
    probabilities: Mapping[str, float]  # by key of hypothesis
    verdict: Verdict
    gap: Gap
    separability: Separability
    parts: tuple[PartChange, ...]  # the section map
    effective_rank: int  # combinations of its parts that the data see
    shrinkage: Shrinkage | None
    rung: int  # of the ladder of proof, 1 to 4
    choices: tuple[Choice, ...]
    robustness: Robustness  # of the verdict
    exchanged: tuple[Label, Label] | None = None  # labels that were put right before all else
    readings: tuple[float, ...] = (1.0,)  # their probabilities; all else is of the likeliest

    def __repr__(self) -> str:
        return f"Diagnosis({self.verdict.kind}: {self.verdict.words})"

    @property
    def damping_ratios(self) -> int:
        """Number of measured damping ratios that are used."""
        damping = self.problem.damping
        return damping.count if damping else 0

    @property
    def left_out(self) -> tuple[str, ...]:
        """Sentences about measurements that are not used."""
        seen = self.problem.observations
        unused = len(seen.damping.rows) - self.damping_ratios
        more = f"{unused} damping ratios: the solver computes none of these modes"
        return (*seen.left_out, *[more] * bool(unused))

    def hypothesis(self, key: str) -> Hypothesis:
        """The hypothesis of that key."""
        return next(h for h in self.hypotheses if h.key == key)

    @property
    def best(self) -> str | None:
        """The likeliest effects, named or not; None where the catalogue is empty."""
        keys = [h.key for h in self.hypotheses if h.values]
        return max(keys, key=lambda key: self.probabilities[key], default=None)

    @property
    def leading(self) -> str | None:
        """The likeliest explanation that has all that is named or, where there may be a gap, of
        all; else None."""
        return self.verdict.best if self.verdict.kind != NO_GAP else None

    def parameter(self, key: str, id: str = "") -> Json:
        """Mean and 90 % interval of the effect ``id`` of ``key``, the first by default, with its
        unit, alone or with others; what the case has of it is counted in."""
        id = id or key.split("+")[0]
        span = self.problem.ranges[id]
        with_it = [h for h in self.hypotheses if h.values and holds(h.key, key)]
        e = np.concatenate([h.values[id] for h in with_it])
        ln = np.array([h.ln_evidence + np.log(h.prior) for h in with_it])
        weights = np.exp(ln - ln.max())
        p = np.concatenate([w * h.posterior for w, h in zip(weights, with_it, strict=True)])
        p = p / p.sum()
        return {
            "value": span.base + float(p @ e),
            "low": span.base + quantile(e, p, 0.05),
            "high": span.base + quantile(e, p, 0.95),
            "unit": span.unit,
        }


def diagnose(
    model: ResponseModel,
    rows: Sequence[ModelRow],
    observations: Observations | Sequence[Reading],
    changes: tuple[Toggle, ...] = (),
    assumed: Assumed = Assumed(),  # noqa: B008
    parts: Callable[[Array], Sequence[SectionPart]] | None = None,
    further: OtherStates | None = None,
    ranked: bool = True,
    known: Expansion | None = None,
    stage: Callable[[str], None] = lambda stage: None,
    begin: Array | None = None,
) -> Diagnosis:
    """Diagnose observations with a model of ``rows`` (label or None, kPa).

    observations: or readings of them where frequencies came without labels, see `labelings`;
    changes: what was switched in runs 1, 2, ...; parts: slopes by the section's parts at x;
    further: other rows of the tyre, for the next measurement; ranked: whether `choices` are wanted;
    known: expansion of the same model anywhere, from where effects are carried to the fit and only
    the likeliest are asked there; stage: hears of each of ``STAGES``; begin (v,): first guess of x.
    Raises the model's failure where the plain tyre has no solution.
    """
    labelled = isinstance(observations, Observations)
    readings = [Reading(observations)] if isinstance(observations, Observations) else observations
    stage(STAGES[0])
    bares, first, labels = list[InverseProblem](), list[list[Hypothesis]](), None
    for reading in readings:
        seen = reading.observations
        bare = _calibrated(model, rows, seen, changes, assumed, known, begin)
        hypotheses = weigh_hypotheses(bare)
        enough = labelled and len(bare.places) > len(model.start)
        labels = exchanged(bare, hypotheses, rows) if enough else None
        if labels:
            there = with_exchanged(bare.observations, *labels)
            bare = _calibrated(model, rows, there, changes, assumed, known, begin)
            hypotheses = weigh_hypotheses(bare)
        bares.append(bare)
        first.append(hypotheses)
        known = known or bare.expansion
    stage(STAGES[1])
    share = shares(readings, first)
    kept = np.flatnonzero(share > REFUTED).tolist()
    settled = [_settled(bares[k], model, first[k]) for k in kept]
    every = [h for _, own in settled for h in own]
    per_reading = [with_sets(problem, own, every) for problem, own in settled]
    readings = [readings[k] for k in kept]
    among = shares(readings, per_reading)
    share[:], share[kept] = 0.0, among
    best = int(np.argmax(among))
    bare, problem, hypotheses = bares[kept[best]], settled[best][0], per_reading[best]
    p = averaged(among, per_reading)
    plain = next(h for h in hypotheses if h.key == NONE).fitted
    d, bare = plain.d[0], replace(bare, zeta=float(plain.zeta[0]))
    verdict = decide(hypotheses, p, len(bare.places), len(d))
    alone = decide(hypotheses, probabilities(hypotheses), len(bare.places), len(d))
    robust = robustness(problem, hypotheses, alone, tuple(model.sources))
    if len(readings) > 1:
        robust = over_labels(robust, readings, per_reading, among, verdict, len(d))
    gap = find_gap(bare, d, tuple(model.variables))
    P, _, _ = projection(replace(problem, zeta=bare.zeta), d)
    means = {h.key: h.mean() for h in hypotheses if h.values}
    sizes = {key: value[key] for key, value in means.items() if key in value}
    separability = separate(bare, P, sizes)
    stage(STAGES[2])
    regions = list(parts(problem.expansion.x0 + d)) if parts else []
    mapped, effective_rank = section_map(bare, P, gap.residuals, regions)
    named = verdict.best if verdict.key else None
    shrinkage = shrink(problem, named) if problem.expansion.nodes else None
    stage(STAGES[3])
    typical = {h.key: h.typical(SIZES) for h in hypotheses if h.values}
    choices = rank(bare, d, p, typical, model.sources, further) if ranked else []
    return Diagnosis(
        problem,
        bare,
        tuple(model.variables),
        tuple(model.sources),
        tuple(hypotheses),
        p,
        verdict,
        gap,
        separability,
        tuple(mapped),
        effective_rank,
        shrinkage,
        _rung(verdict, shrinkage, problem),
        tuple(choices),
        robust,
        labels,
        tuple(share.tolist()),
    )


def _calibrated(
    model: ResponseModel,
    rows: Sequence[ModelRow],
    observations: Observations,
    changes: tuple[Toggle, ...],
    assumed: Assumed,
    known: Expansion | None,
    begin: Array | None,
) -> InverseProblem:
    """Observations and the model, expanded about the plain tyre that fits them.

    Where none does, an effect or an exchange of labels may have driven it far off: then about the
    tyre that fits them if any of these may have moved them.
    """
    where = places(observations, rows)
    x0 = plain_fit(model, observations, where, assumed.form, known, begin=begin)
    expansion = carried(known, model, x0) if known else expand(model, x0)
    problem = InverseProblem(
        observations,
        expansion,
        model.ranges,
        where,
        model.start,
        model.spread,
        changes,
        assumed,
        damping_places=places(observations.damping, rows),
    )
    if _fits(problem):
        return problem
    shifts = (known or expansion).range_shifts(where)
    moved = np.hstack([shifts, exchange_shifts(observations)])
    x0 = plain_fit(model, observations, where, assumed.form, known, moved, begin)
    near = known or abs(x0 - expansion.x0).max() < CARRIED_WITHIN
    try:
        there = carried(known or expansion, model, x0) if near else expand(model, x0)
    except (EvaluationFailed, InputError):  # there is no such tyre
        return problem
    return replace(problem, expansion=there)


def _fits(problem: InverseProblem) -> bool:
    """Whether the plain tyre does; as it does where it has as many variables as data."""
    freedom = len(problem.places) - len(problem.centre)
    return freedom <= 0 or chi2_tail(float(refit(problem, {}, 1).chi2[0]), freedom) > CHECK


def _settled(
    problem: InverseProblem, model: ResponseModel, hypotheses: list[Hypothesis]
) -> tuple[InverseProblem, list[Hypothesis]]:
    """The problem with the model evaluated again for active hypotheses, and all weighed by it:
    first at the calibration's x near their sizes, then where their re-fits are."""
    for look in (_nearer_sizes, _asked_again) if problem.expansion.nodes else ():
        again, changed = look(problem, model, hypotheses)
        if changed:
            problem, hypotheses = again, weigh_hypotheses(again, before=(problem, hypotheses))
    return problem, hypotheses


def _in_play(problem: InverseProblem, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The likeliest effects, and after them the likeliest sets of effects."""
    singles = [h for h in hypotheses if h.key in problem.expansion.nodes]
    best = max(h.ln_evidence for h in hypotheses)
    play = [h for h in singles if h.ln_evidence > best - IN_PLAY_WITHIN]
    play = sorted(play, key=lambda h: -h.ln_evidence)[:MAX_IN_PLAY]
    p = probabilities(hypotheses)
    sets = [h for h in hypotheses if len(h.values) > 1 and p[h.key] > CARRIES_WEIGHT]
    return play + sorted(sets, key=lambda h: -p[h.key])[:MAX_JOINT]


def _nearer_sizes(
    problem: InverseProblem, model: ResponseModel, hypotheses: Sequence[Hypothesis]
) -> tuple[InverseProblem, bool]:
    """The problem with each active effect evaluated at one more size near its likeliest one, at the
    calibration's x; whether there was any to evaluate."""
    expansion, wanted = problem.expansion, dict[str, float]()
    for h in _in_play(problem, hypotheses):
        for id, values in h.values.items():
            e, nodes = float(values[h.best]), expansion.nodes[id]
            low, high = nodes.reach
            end = high if e > 0 else low
            size = end * min(MIDDLE, key=lambda share: abs(share * end - e))
            apart = min(abs(each - e) for each in nodes.values.tolist())
            same = min(abs(each - size) for each in nodes.values.tolist())
            if id not in wanted and apart > KNOWN_WITHIN * (high - low) and same > 0:
                wanted[id] = size
    if not wanted:
        return problem, False
    return replace(problem, expansion=refined(expansion, model, wanted)), True


def _asked_again(
    problem: InverseProblem, model: ResponseModel, hypotheses: Sequence[Hypothesis]
) -> tuple[InverseProblem, bool]:
    """The problem with the model evaluated where the active effects have their re-fits, each at its
    likeliest size, and those of likely sets two by two; whether anything was left to evaluate."""
    expansion = problem.expansion
    wanted: dict[tuple[str, ...], Query] = {}
    for h in _in_play(problem, hypotheses):
        d = h.fitted.d[h.best]
        size = {id: float(e[h.best]) for id, e in h.values.items()}
        for ids in combinations(size, min(len(size), 2)):
            here = {id: size[id] for id in ids}
            if ids not in wanted and not _known(expansion, here, d):
                wanted[ids] = Query(expansion.x0 + d, here, near=expansion.x0)
    if not wanted:
        return problem, False
    return replace(problem, expansion=anchored(expansion, model, list(wanted.values()))), True


def _known(expansion: Expansion, size: Mapping[str, float], d: Array) -> bool:
    """Whether the model was already evaluated within `KNOWN_WITHIN` of these sizes; a size of 0 is
    no effect."""
    near = {}
    for id in size:
        low, high = expansion.nodes[id].reach
        near[id] = KNOWN_WITHIN * (high - low)
    if len(size) > 1:
        joint = expansion.joint.get(tuple(size))
        small = any(abs(e) < near[id] for id, e in size.items())
        there = zip(size.items(), joint.e, strict=True) if joint else ()
        same = joint and abs(d - joint.d).max() < KNOWN_WITHIN
        return small or bool(same and all(abs(e - at) < near[id] for (id, e), at in there))
    ((id, e),) = size.items()
    nodes = expansion.nodes[id]
    evaluated = [(float(each), np.zeros_like(d)) for each in nodes.values]  # 0 among them
    evaluated += [(nodes.anchor.e, nodes.anchor.d)] if nodes.anchor else []
    return any(
        abs(e - at) < near[id] and (at == 0 or abs(d - x).max() < KNOWN_WITHIN)
        for at, x in evaluated
    )


def _rung(verdict: Verdict, shrinkage: Shrinkage | None, problem: InverseProblem) -> int:
    """1: fits in sample; 2: held-out error falls beyond the placebo's; 4: a toggled run moved the
    frequencies as the named effect says (its posterior check holds with that run among the data).

    3, agreement with an independent measurement of the parameter, is the engineer's to state.
    """
    switched = {change.id for change in problem.changes}
    if verdict.key and set(verdict.key.split("+")) <= switched:
        return 4
    proven = shrinkage is not None and verdict.kind == NAMED
    return 2 if proven and shrinkage and shrinkage.fraction > shrinkage.placebo_95 else 1
