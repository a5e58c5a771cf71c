"""Tyres with none, one, two and three effects: what is named, and how much of it is right?

    python -m tests.studies.several              # 100 tyres, 15 minutes of a core

Coarse mesh, the model's own laws (so this is no blind trial: it asks what becomes of effects that
come together), designs within 5 % of the start, constants by exact slopes but for turned cords,
scatter 0.2 %, three pressures, a section beyond doubt. Effects are 40 to 100 % of their range and
seen by themselves, lambda from 15 on; those of a tyre are asked of the model together. All effects
are weighed, about one shared expansion; beside it what the rule before would have named: the
likeliest explanation from 0.7 on, pairs having 0.03 together, and no triples.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE
from tyrecal.studies.diagnose.gap import projection
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import InverseProblem, places
from tyrecal.studies.inference.model import Answer, ModelRow, Query
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.separability import separate
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.effects.edit import changed, with_part

from ..effects.support import coarse

RESULT = Path(__file__).parents[1] / "benchmarks" / "several.jsonl"
PRESSURES_kPa, NOISE, APART, SEEN = (160.0, 240.0, 320.0), 0.002, 0.05, 15.0
EFFECTS_IN_TURN = (2, 0, 2, 1, 3)  # of tyres


def named_before(d: Diagnosis) -> str | None:
    """Name the likeliest explanation alone, with the earlier priors."""
    pairs, singles = 0.03, 0.62
    ids = len(d.problem.expansion.nodes)
    prior = {0: 1.0, 1: singles / ids, 2: pairs / (ids * (ids - 1) / 2), 3: 0.0}
    ln = {
        h.key: h.ln_evidence + np.log(prior[len(h.values)] if h.values else h.prior)
        for h in d.hypotheses
        if len(h.values) < 3
    }
    top = max(ln.values())
    p = {key: float(np.exp(each - top)) for key, each in ln.items()}
    key = max(p, key=lambda key: p[key])
    sure = p[key] / sum(p.values()) >= 0.7 and p[NONE] / sum(p.values()) < 0.05
    return key if sure and key not in (NONE, OUTSIDE) and d.verdict.check > 0.01 else None


def judged(key: str | None, truth: set[str], kind: str) -> str:
    """Return the verdict on a trial: all named, a part of them, with others, or another answer."""
    if key is None:
        return kind
    ids = set(key.split("+"))
    if ids == truth:
        return "all named"
    return "part named" if ids < truth else "named wrongly"


@click.command()
@click.option("--tyres", default=100)
@click.option("--seed", default=1904)
def main(tyres: int, seed: int) -> None:
    """Draw, diagnose, and write a line a tyre."""
    case = coarse()
    case = changed(case, section=with_part(case.case.section, known_from="exact"))
    rows: list[ModelRow] = [(label, p) for p in PRESSURES_kPa for label in target_labels(case)]
    evaluator = Evaluator(TyreDesign(case))
    own_sources = sources(case)[0]
    model = TyreModel(case, evaluator, rows, own_sources, effect_ranges(case, evaluator)[0])
    known = expand(model, model.start, False)
    turned = [any(path.endswith("angle_deg") for path in source.steps) for source in own_sources]
    constants = known.constants[:, ~np.array(turned)]
    random, count = np.random.default_rng(seed), Counter[tuple[int, str, str]]()
    observables = tuple(Observable("frequency_Hz", *row) for row in rows)
    unknown, scatter = np.full(len(rows), np.nan), np.full(len(rows), NOISE)
    plain = Observations(observables, known.eta, scatter, 0.0, unknown, unknown)
    where = places(plain, rows)
    problem = InverseProblem(plain, known, model.ranges, where, model.start, model.spread)
    P = projection(problem, np.zeros(len(model.start)))[0]
    lines = []
    for tyre in range(tyres):
        effects: dict[str, float] = {}
        while len(effects) < EFFECTS_IN_TURN[tyre % len(EFFECTS_IN_TURN)]:
            id = str(random.choice(sorted(known.nodes)))
            end = float(random.choice([end for end in known.nodes[id].reach if end]))
            e = random.uniform(0.4, 1.0) * end
            if id not in effects and separate(problem, P, {id: e}).lambdas[id] >= SEEN:
                effects[id] = e
        x = model.start + random.uniform(-APART, APART, len(model.start))
        drawn = constants @ random.normal(size=constants.shape[1])
        drawn += random.normal(0, NOISE, len(rows))
        (answer,) = model.answers([Query(x, effects)])
        if not isinstance(answer, Answer):
            continue
        d = diagnose(model, rows, replace(plain, y=answer.eta + drawn), expansion=known)
        truth, v = set(effects), d.verdict
        now, then = (judged(key, truth, v.kind) for key in (v.key, named_before(d)))
        in_set = any(truth == set(key.split("+")) for key in v.candidates)
        count[len(truth), "now", now] += 1
        count[len(truth), "before", then] += 1
        count[len(truth), "in the 90 % set", str(in_set)] += 1
        if v.kind == "named":
            count[len(truth), "robust" if d.robustness.robust else "hangs", now] += 1
        record = {"effects": effects, "verdict": v.kind, "named": v.key, "before": then}
        record |= {"also": {each.id: round(each.probability, 3) for each in v.also}}
        record |= {"candidates": v.candidates[:6], "robust": d.robustness.robust}
        lines.append(json.dumps(record))
        print(lines[-1], flush=True)
        if tyre % 5 == 4:
            print(*(f"{key}: {n}" for key, n in sorted(count.items())), sep="\n", flush=True)
    if tyres >= 100:
        RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
