"""Frequencies without labels as evidence: is an effect still named, and as surely as it should be?

    python -m tests.studies.unlabelled_diagnosis            # 60 tyres, some 8 minutes of a core

The P235/75R17 (coarse mesh, section taken as drawn) is asked once, with every effect, for twelve
modes at three pressures; tyres are then drawn by algebra: three of four have one effect, 40 to
100 % of its range and seen, lambda from 15 on, design variables within 5 % of the start, everything
else (constants, section, form, law, scatter of 0.2 %) by the diagnosis' own covariance. Measured
are the paper's nine modes, less none to three; every second tyre has a frequency that is no mode,
anywhere in the band. The same tyre is diagnosed (single effects) four times: with all labels; with
none, averaged over labelings; with none, the tree's likeliest labeling taken for certain, and
exchanged labels looked for as in any labelled file; with labels of [0,0] and [1,m] alone, which
springs of the rim move most, averaged. Near modes are not coupled.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import click
import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.score import calibration_error, calibration_quantile, clopper_pearson
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE
from tyrecal.studies.diagnose.gap import projection
from tyrecal.studies.diagnose.labelings import (
    MAX_READINGS,
    MIN_READING_PROBABILITY,
    Reading,
    averaged,
    exchanged,
    shares,
    with_exchanged,
)
from tyrecal.studies.diagnose.several import weigh_hypotheses
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import InverseProblem, places
from tyrecal.studies.inference.model import ModelRow
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.separability import separate
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.labelling.expansion import ModesNearDesign, Prior, admissible, find_labels
from tyrecal.studies.labelling.tree import FOREIGN_MARGIN, Frequencies
from tyrecal.studies.variable import START_SPREAD
from tyrecal.tyre.effects.edit import changed, with_part

from ..effects.support import coarse

Array = np.ndarray
RESULT = Path(__file__).parents[1] / "benchmarks" / "unlabelled_diagnosis.jsonl"
OTHERS = [Label(4, 1), Label(5, 0), Label(5, 1)]  # that the band may hold
PRESSURES_kPa, NOISE, APART, SEEN, MOST_MISSED = (160.0, 240.0, 320.0), 0.002, 0.05, 15.0, 3
WAYS = ("all labels", "none, averaged", "none, likeliest for certain", "[0,0] and [1,m], averaged")


@dataclass(frozen=True)
class Tyre:
    """Frequencies by rising value: ln f (m,), the pressure's place of each, and the row of the
    model that it is (-1: none)."""

    y: Array
    states: Array
    truth: Array


def judged(whole: InverseProblem, readings: Sequence[Reading], effect: str) -> dict[str, object]:
    """The true explanation's and the likeliest one's probability, and what is said."""
    rows = [row.row for row in whole.observations.rows]
    seen = [each.observations for each in readings]
    there = [replace(whole, observations=o, places=places(o, rows)) for o in seen]
    weighed = [weigh_hypotheses(each, pairs=False) for each in there]
    share = shares(readings, weighed)
    best, p = int(np.argmax(share)), averaged(share, weighed)
    verdict = decide(weighed[best], p, len(there[best].places), len(whole.centre))
    top = max(p, key=lambda key: p[key])
    record = {"p": round(p.get(effect, 0.0), 4), "likeliest": top, "top": round(p[top], 4)}
    return {**record, "said": verdict.key or verdict.kind, "readings": share.round(4).tolist()}


def observed(rows: Sequence[Observable], y: Array, own: Array) -> Observations:
    """Observations of ln f and their rows, without those that are no mode."""
    kept = np.flatnonzero(own >= 0)
    kept = kept[np.argsort(own[kept])]
    none = np.full(len(kept), np.nan)
    mine = tuple(rows[i] for i in own[kept])
    return Observations(mine, y[kept], np.full(len(kept), NOISE), 0.0, none, none)


def drawn(whole: InverseProblem, random: np.random.Generator, sound: bool) -> tuple[str, Tyre]:
    """A tyre with its effect, "none" where it is sound."""
    id, e = NONE, 0.0
    P = projection(whole, np.zeros(len(whole.centre)))[0]
    while not sound:
        id = str(random.choice(sorted(whole.expansion.nodes)))
        ends = [end for end in whole.expansion.nodes[id].reach if end]
        e = random.uniform(0.4, 1.0) * float(random.choice(ends))
        if separate(whole, P, {id: e}).lambdas[id] >= SEEN:
            break
    d = random.uniform(-APART, APART, len(whole.centre))
    added = whole.added({} if sound else {id: np.array([e])}, 1)
    mean = whole.plain(d)[0] + added.shift[0] + added.tilt[0] @ d
    root = np.linalg.cholesky(whole.sigma + whole.response_covariance(added)[0])
    ln_f = mean + root @ random.normal(size=len(mean))
    labels = [row.label for row in whole.observations.rows]
    nine = [label for label in dict.fromkeys(labels) if label not in OTHERS]
    missed = random.permutation(len(nine))[: random.integers(MOST_MISSED + 1)]
    hidden = {*OTHERS, *(nine[i] for i in missed)}
    truth = np.array([i for i, label in enumerate(labels) if label not in hidden])
    per = len(labels) // len(PRESSURES_kPa)
    y, states = ln_f[truth], truth // per
    if random.random() < 0.5:
        state = int(random.integers(len(PRESSURES_kPa)))
        own = y[states == state]
        hum = random.uniform(own.min() - FOREIGN_MARGIN, own.max() + FOREIGN_MARGIN)
        y, states, truth = np.append(y, hum), np.append(states, state), np.append(truth, -1)
    order = np.argsort(y)
    return id, Tyre(y[order], states[order], truth[order])


def labelled(
    whole: InverseProblem, tyre: Tyre, known: int = -1
) -> tuple[list[Reading], list[Array]]:
    """Readings under likely labelings, and the rows that the frequencies are in each; labels of up
    to ``known`` waves came with the file."""
    rows, v = whole.observations.rows, len(whole.centre)
    labels = tuple(row.label for row in rows if row.label)
    states = np.array([PRESSURES_kPa.index(row.pressure_kPa) for row in rows])

    def at(x: Array) -> ModesNearDesign:
        return ModesNearDesign(labels, states, *whole.expansion.plain(x))

    given = [labels[i] if i >= 0 and labels[i].c <= known else None for i in tyre.truth]
    sure = np.array([label is not None for label in given])

    def measured(there: ModesNearDesign) -> Frequencies:
        allowed = admissible(given, tyre.states, there)
        return Frequencies(tyre.y, np.full(len(tyre.y), NOISE), tyre.states, allowed, sure)

    wide = np.full(v, np.inf)
    prior = Prior(whole.centre, START_SPREAD * np.eye(v), -wide, wide)
    result = find_labels(at, measured, prior).labelings
    count = max(1, int((result.probabilities[:MAX_READINGS] >= MIN_READING_PROBABILITY).sum()))
    own = list(result.modes[:count])
    see = partial(observed, rows, tyre.y)
    return [Reading(see(own[k]), float(result.ln_prior[k])) for k in range(count)], own


@click.command()
@click.option("--tyres", default=60)
@click.option("--seed", default=7)
def main(tyres: int, seed: int) -> None:
    """Draw, diagnose, and write a line a tyre."""
    case = coarse()
    case = changed(case, section=with_part(case.case.section, known_from=None))
    labels = [*target_labels(case), *OTHERS]
    rows: list[ModelRow] = [(label, p) for p in PRESSURES_kPa for label in labels]
    evaluator = Evaluator(TyreDesign(case))
    model = TyreModel(case, evaluator, rows, sources(case)[0], effect_ranges(case, evaluator)[0])
    known = replace(expand(model, model.start, False), coupling=None)
    observables = tuple(Observable.of(row) for row in rows)
    every = np.arange(len(rows))
    seen = observed(observables, known.eta, every)
    whole = InverseProblem(seen, known, model.ranges, every, model.start, model.spread)
    random, lines = np.random.default_rng(seed), list[str]()
    for tyre in range(tyres):
        id, own = drawn(whole, random, tyre % 4 == 3)
        readings, rows_of = labelled(whole, own)
        record: dict[str, object] = {"tyre": tyre, "effect": id}
        record[WAYS[1]] = judged(whole, readings, id)
        partly, rows_partly = labelled(whole, own, 1)
        record[WAYS[3]] = judged(whole, partly, id)
        certain = [observed(observables, own.y, own.truth), readings[0].observations]
        for way, o in zip((WAYS[0], WAYS[2]), certain, strict=True):
            there = replace(whole, observations=o, places=places(o, rows))
            swapped = exchanged(there, weigh_hypotheses(there))
            o = with_exchanged(o, *swapped) if swapped else o
            record[way] = judged(whole, [Reading(o)], id)
        for key, labelings in (("right", rows_of), ("right, partly", rows_partly)):
            record[key] = [bool((each == own.truth).all()) for each in labelings]
        lines.append(json.dumps(record))
        print(lines[-1], flush=True)
    tell([json.loads(line) for line in lines])
    if tyres >= 60:
        RESULT.write_text("\n".join(lines) + "\n")


def tell(lines: list[dict]) -> None:
    """The tables."""
    for way, key in ((WAYS[1], "right"), (WAYS[3], "right, partly")):
        first = [each[key][0] for each in lines]
        after = [each[key][int(np.argmax(each[way]["readings"]))] for each in lines]
        among = sum(any(each[key]) for each in lines)
        print(
            f"{way}: labeling right of {len(lines)}: {sum(first)} about the plain tyre,"
            f" {sum(after)} weighed; {among} have it among those weighed"
        )
    first = [each["right"][0] for each in lines]
    sets = {
        "all": lines,
        "likeliest labeling right": [each for each, ok in zip(lines, first, strict=True) if ok],
        "likeliest labeling wrong": [each for each, ok in zip(lines, first, strict=True) if not ok],
    }
    print("| tyres | labels | named right (95 %) | wrongly | outside | undecided, no gap |", end="")
    print(" mean p of the truth | calibration error (95 % quantile) | sound: accused, outside |")
    print("|" + "---|" * 9)
    for words, of in sets.items():
        for way in WAYS:
            own = [(each["effect"], each[way]) for each in of]
            effects = [(id, one["said"]) for id, one in own if id != NONE]
            sound = [one["said"] for id, one in own if id == NONE]
            right = sum(id == verdict for id, verdict in effects)
            low, high = clopper_pearson(right, len(effects))
            outside = sum(verdict == OUTSIDE for _, verdict in effects)
            open_ = sum(verdict in ("undecided", "no_gap") for _, verdict in effects)
            stated = np.array([one["top"] for _, one in own])
            hit = np.array([one["likeliest"] == id for id, one in own])
            error, bound = calibration_error(stated, hit), calibration_quantile(stated)
            accused = sum(verdict not in ("undecided", "no_gap", OUTSIDE) for verdict in sound)
            print(
                f"| {words} | {way} | {right} of {len(effects)} ({low:.2f} to {high:.2f}) |"
                f" {len(effects) - right - outside - open_} | {outside} | {open_} |"
                f" {np.mean([one['p'] for _, one in own]):.3f} | {error:.3f} ({bound:.3f}) |"
                f" {accused}, {sum(verdict == OUTSIDE for verdict in sound)} of {len(sound)} |"
            )


if __name__ == "__main__":
    main()
