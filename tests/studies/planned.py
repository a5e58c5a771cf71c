"""Simulated campaigns: hours to a verdict of 0.9 by a plan made before, by what `diagnose` proposes
after each measurement, and by a fixed list; effects found as often as the plan promises.

    python -m tests.studies.planned run [--judge evidence] [--tyres 200] [--sound 40] [--store DIR]
    python -m tests.studies.planned hindsight [--store DIR]
    python -m tests.studies.planned table

The P235/75R17 (coarse mesh, section taken as drawn) is evaluated once, with every effect, in all
that a laboratory may measure (`plan.laboratory`). Tyres are drawn from it: one effect, 20 to 100 %
of its range, design variables within 5 %, and everything else (constants, section, form, law,
scatter of 0.2 %) by the diagnosis' own covariance. There are two judges, on the same tyres:
"linear", of all of them, is the plan's own (`LinearDiagnosis`), which does not know how the model
bends. "evidence", of as many as there is time for, is that of `diagnose` with its re-fits, single
effects only (`weigh_hypotheses`), on the recorded model: no solver runs again, and near modes are
not coupled. Every tenth of these is also judged with pairs and triples of effects.

list: `LIST`, in its order. Footprint and loaded modes cost hours and add no evidence. plan: the
order of `plan.study.order` within the list's hours. next: the plan's first item, then the most
information per hour of what is left, as `next_measurement` has it ("evidence" only). Where there
is no verdict, all hours of the list count. Hours are those of `next_measurement.STEP_HOURS`.
least: the cheapest measurements within the list's hours by which the linear judge names the tyre's
effect, a set of response functions among them, if all outcomes were known before any is taken.
Resumed: a tyre that is on record is not computed again; a second process goes ``--backwards``.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import click
import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE, Hypothesis
from tyrecal.studies.diagnose.next_measurement import (
    MAX_EXPLANATIONS,
    MIN_PROBABILITY,
    SIZES,
    STEP_HOURS,
    CandidateRows,
)
from tyrecal.studies.diagnose.several import present, probabilities, weigh_hypotheses
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.plan.chance import DRAWN_FROM, FOUND, Drawn, shares
from tyrecal.studies.plan.laboratory import Laboratory, laboratory
from tyrecal.studies.plan.study import DRAWN_TYRES, TRIED_TYRES, order
from tyrecal.tyre.effects.edit import changed, with_part

from ..effects.support import coarse

Array = np.ndarray
Row = dict[str, Any]
Judge = Callable[[Laboratory, Sequence[str]], dict[str, float]]
RESULT = Path(__file__).parents[1] / "benchmarks" / "planned.jsonl"
LIST = "160 kPa", "weigh", "240 kPa", "320 kPa", "calliper", "footprint", "clamp", "loaded modes"
LISTED_HOURS = {"footprint": 2.0, "loaded modes": 4.0}  # of what adds no evidence
WAYS = "list", "plan", "next", "least"
NOISE, APART, SEED, RESAMPLES = 0.002, 0.05, 1, 4000
MANY = 4  # times as many tyres as a user's plan draws, for the promised chances


def study_laboratory(store: Path | None = None) -> Laboratory:
    """The laboratory of all campaigns."""
    case = coarse()
    case = changed(case, section=with_part(case.case.section, known_from=None))
    evaluator = Evaluator(TyreDesign(case), store=Store(store) if store else None)
    return laboratory(case, evaluator, target_labels(case), (), NOISE, STEP_HOURS)


def hours(lab: Laboratory, done: Sequence[str]) -> float:
    """Hours of some items of the menu or of the list."""
    return sum(LISTED_HOURS.get(name) or lab.menu[name].hours for name in done)


def drawn(lab: Laboratory, id: str, random: np.random.Generator) -> tuple[float, Laboratory]:
    """A tyre with an effect, or "none", its size, and all that could be measured of it."""
    problem, e, effects = lab.problem, 0.0, dict[str, Array]()
    if id != NONE:
        ends = [end for end in problem.expansion.nodes[id].reach if end]
        e = random.uniform(DRAWN_FROM, 1) * float(random.choice(ends))
        effects = {id: np.array([e])}
    d = random.uniform(-APART, APART, len(problem.centre))
    added = problem.added(effects, 1)
    mean = problem.plain(d)[0] + added.shift[0] + added.tilt[0] @ d
    root = np.linalg.cholesky(problem.sigma + problem.response_covariance(added)[0])
    y = mean + root @ random.normal(size=len(mean))
    o = problem.observations
    names = [str(row.label) for row in o.rows]
    own = {name: random.normal() * problem.assumed.split for name in dict.fromkeys(names)}
    apart = added.split[0] + [own[name] for name in names]
    split = abs(apart + np.nan_to_num(o.split_scatter) * random.normal(size=len(y)))
    measured = replace(o, y=y, split=np.where(np.isfinite(o.split), split, np.nan))
    return e, replace(lab, problem=replace(problem, observations=measured))


def judged(
    lab: Laboratory, done: Sequence[str], sets: bool = False
) -> tuple[list[Hypothesis], dict[str, float]]:
    """The diagnosis of what was measured; ``sets``: of two and three effects, too."""
    hypotheses = weigh_hypotheses(lab.problem.only(np.isin(lab.item, done)), pairs=sets)
    return hypotheses, probabilities(hypotheses)


def by_evidence(lab: Laboratory, done: Sequence[str]) -> dict[str, float]:
    """Probabilities by `judged`."""
    return judged(lab, done)[1]


def deviations(base: Laboratory, lab: Laboratory) -> Array:
    """Measured rows (n,) of a tyre minus those of the start, distances of pairs last."""
    o = lab.problem.observations
    return np.append(o.y - base.problem.observations.y, o.split[base.linear.pairs])


def linear_judge(base: Laboratory) -> Judge:
    """The judge that is linear about the start of ``base``."""
    linear = base.linear

    def judge(lab: Laboratory, done: Sequence[str]) -> dict[str, float]:
        y = deviations(base, lab)
        return dict(zip(linear.keys, linear.probabilities(y[None], lab.rows(done))[0], strict=True))

    return judge


def least_hours(lab: Laboratory, tyres: Drawn, limit: float) -> Array:
    """Hours (t,) of the cheapest measurements that name each tyre's effect, inf above ``limit``."""
    every = [set for k in range(len(lab.menu)) for set in combinations(lab.menu, k + 1)]
    least = np.full(len(tyres.y), np.inf)
    for names in sorted(every, key=lab.hours):
        if lab.hours(names) > limit + 1e-9 or not any(lab.menu[n].pressure_kPa for n in names):
            continue
        if all(name in lab.offered(names[:k]) for k, name in enumerate(names)):
            left = np.flatnonzero(np.isinf(least))
            hits = lab.linear.found(tyres.only(np.isinf(least)), lab.rows(names))
            least[left[hits]] = lab.hours(names)
    return least


def by_order(lab: Laboratory, names: Sequence[str], judge: Judge) -> Row:
    """Take the measurements one after the other, to a verdict."""
    for count, name in enumerate(names, 1):
        if name not in LISTED_HOURS:
            p = judge(lab, names[:count])
            top = max(p, key=lambda key: p[key])
            if p[top] >= FOUND:
                return {"hours": round(hours(lab, names[:count]), 3), "verdict": top}
    return {"hours": None, "verdict": top}


def by_next(lab: Laboratory, first: str, limit: float) -> Row:
    """The most information per hour first, to a verdict."""
    done = [first]
    while True:
        hypotheses, p = judged(lab, done)
        top = max(p, key=lambda key: p[key])
        if p[top] >= FOUND:
            return {"hours": round(hours(lab, done), 3), "verdict": top, "measured": done}
        left = [n for n in lab.offered(done) if hours(lab, [*done, n]) <= limit]
        gain = {n: information(lab, hypotheses, p, done, n) / lab.menu[n].hours for n in left}
        if not left:
            return {"hours": None, "verdict": top, "measured": done}
        done.append(max(gain, key=lambda name: gain[name]))


def information(
    lab: Laboratory,
    hypotheses: Sequence[Hypothesis],
    p: Mapping[str, float],
    done: Sequence[str],
    name: str,
) -> float:
    """Information of a measurement, as `next_measurement` has it."""
    by_key = {h.key: h for h in hypotheses if h.key != OUTSIDE}
    keys = [key for key in sorted(by_key, key=lambda k: -p[k]) if p[key] > MIN_PROBABILITY]
    keys = keys[:MAX_EXPLANATIONS]
    if len(keys) < 2:
        return 0.0
    here, linear = lab.rows(done), lab.linear
    rows = np.append(here, lab.rows([name]))
    shifts = {}
    for key in keys:
        sizes = by_key[key].typical(SIZES)
        shifts[key] = (
            linear.shifts(key, sizes[key])[0] if sizes else np.zeros((1, len(linear.sigma)))
        )
        shifts[key] = shifts[key][:, rows]
    after = CandidateRows(linear.sigma[np.ix_(rows, rows)], linear.jacobian[rows], shifts)
    return after.information(len(here), {key: p[key] for key in keys}, lab.problem.spread)


def campaign(lab: Laboratory, plan: Sequence[str], tyre: int, sound: bool, judge: Judge) -> Row:
    """One tyre, by the list and by the plan."""
    ids = sorted(lab.problem.expansion.nodes)
    id = NONE if sound else ids[tyre % len(ids)]
    e, measured = drawn(lab, id, np.random.default_rng([SEED, tyre, sound]))
    at_first, at_end = judge(measured, plan[:1]), judge(measured, plan)
    row: Row = {"tyre": tyre, "effect": id, "size": float(f"{e:.6g}")}
    row["first"], row["end"] = (round(float(p.get(id, 0.0)), 4) for p in (at_first, at_end))
    accused = max(p for key, p in at_end.items() if key not in (NONE, OUTSIDE))
    row["accused"] = round(float(accused), 4)
    if not sound:
        row["list"] = by_order(measured, LIST, judge)
        row["plan"] = by_order(measured, plan, judge)
    return row


def more_of(lab: Laboratory, plan: Sequence[str], row: Row, sets: bool) -> Row:
    """Figures of a tyre that only `judged` has: `next`, and with pairs and triples."""
    id, sound = row["effect"], row["effect"] == NONE
    _, measured = drawn(lab, id, np.random.default_rng([SEED, row["tyre"], sound]))
    more: Row = {}
    if sets:
        _, p = judged(measured, plan, sets=True)
        more["with_sets"] = round(p[NONE] if sound else present(p, [id]), 4)
    if not sound:
        more["next"] = by_next(measured, plan[0], hours(lab, LIST))
    return more


@click.group()
def main() -> None:
    """Run, or print the table."""


@main.command()
@click.option("--tyres", default=200)
@click.option("--sound", default=40)
@click.option("--every", default=10)
@click.option("--judge", type=click.Choice(["linear", "evidence"]), default="linear")
@click.option("--store", type=Path)
@click.option("--backwards", is_flag=True)
def run(
    tyres: int, sound: int, every: int, judge: str, store: Path | None, backwards: bool
) -> None:
    """Campaigns that are not on record yet, a line each; the first line is the plan's promise."""
    lab = study_laboratory(store)
    if not RESULT.exists():
        linear = lab.linear
        plan = order(lab, linear.draw(TRIED_TYRES, np.random.default_rng(0)), hours(lab, LIST))
        many = linear.draw(MANY * DRAWN_TYRES, np.random.default_rng(1))
        promise = [shares(many, linear.found(many, lab.rows(plan[:k]))) for k in (1, len(plan))]
        content = {"plan": plan, "hours": hours(lab, plan), "list_hours": hours(lab, LIST)}
        write({**content, "promised_first": promise[0], "promised": promise[1]})
    plan = read()[0]["plan"]
    judges = {"linear": linear_judge(lab), "evidence": by_evidence}
    wanted = [(k, False) for k in range(tyres)] + [(k, True) for k in range(sound)]
    for tyre, is_sound in wanted[::-1] if backwards else wanted:  # two may run at a time
        there = {(row["judge"], row["tyre"], row["effect"] == NONE) for row in read()[1:]}
        if (judge, tyre, is_sound) not in there:
            row = {"judge": judge, **campaign(lab, plan, tyre, is_sound, judges[judge])}
            if judge == "evidence":
                row |= more_of(lab, plan, row, tyre % every == 0)
            write(row)
    tell(read())


@main.command()
@click.option("--store", type=Path)
def hindsight(store: Path | None) -> None:
    """Add to each linear campaign on record what it needed at least. Seven minutes of a core."""
    lab, rows = study_laboratory(store), read()
    own = of_judge(rows, "linear")[0]
    ids = tuple(row["effect"] for row in own)
    seeds = [[SEED, row["tyre"], False] for row in own]
    tyres = [
        drawn(lab, id, np.random.default_rng(seed))[1] for id, seed in zip(ids, seeds, strict=True)
    ]
    y = np.array([deviations(lab, tyre) for tyre in tyres])
    for row, least in zip(own, least_hours(lab, Drawn(ids, y), hours(lab, LIST)), strict=True):
        is_named = np.isfinite(least)
        row["least"] = {"hours": round(float(least), 3) if is_named else None}
        row["least"]["verdict"] = row["effect"] if is_named else NONE
    RESULT.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    tell(rows)


def read() -> list[Row]:
    """All rows."""
    return [json.loads(line) for line in RESULT.read_text(encoding="utf-8").splitlines()]


def write(row: Row) -> None:
    """Add a row."""
    with RESULT.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


@main.command()
def table() -> None:
    """Print the table of the rows on record."""
    tell(read())


def of_judge(rows: Sequence[Row], judge: str) -> tuple[list[Row], list[Row]]:
    """Campaigns with an effect, and those of sound tyres."""
    own = [row for row in rows[1:] if row["judge"] == judge]
    return [r for r in own if r["effect"] != NONE], [r for r in own if r["effect"] == NONE]


def groups(tyres: Sequence[Row]) -> dict[str, list[Row]]:
    """All campaigns, and those that the list or the plan settles."""
    settled = [row for row in tyres if row["list"]["hours"] or row["plan"]["hours"]]
    return {"all": list(tyres), "settled by list or plan": settled}


def cost(rows: Sequence[Row], way: str, limit: float) -> Array:
    """Hours (n,) of a way, all of the list's where there is no verdict."""
    return np.array([row[way]["hours"] or limit for row in rows])


def promised(rows: Sequence[Row], tyres: Sequence[Row]) -> dict[str, tuple[float, float, float]]:
    """Share of effects found, share promised, and the standard error of the difference: after the
    first step, and after the plan."""
    result = {}
    for step, promise in (("first", "promised_first"), ("end", "promised")):
        p = np.array([rows[0][promise][row["effect"]] for row in tyres])
        hits = np.array([row[step] >= FOUND for row in tyres])
        variance = (p * (1 - p)).mean() * (1 / len(p) + 1 / (MANY * DRAWN_TYRES * 26))
        result[step] = float(hits.mean()), float(p.mean()), float(np.sqrt(variance))
    return result


def tell(rows: list[Row]) -> None:
    """The tables."""
    limit = rows[0]["list_hours"]
    print("plan:", ", ".join(rows[0]["plan"]), f"({rows[0]['hours']:.1f} h)\n")
    heads = "judge", "campaigns", "number", "way", "verdict", "right", "mean h", "median h"
    print("|", " | ".join([*heads, "mean / list's (95 %)", "median / list's (95 %)"]), "|")
    print("|---" * 10 + "|")
    for judge in ("linear", "evidence"):
        tyres, _ = of_judge(rows, judge)
        for name, of in groups(tyres).items() if tyres else ():
            listed = cost(of, "list", limit)
            at = np.random.default_rng(0).integers(0, len(of), (RESAMPLES, len(of)))
            for way in [way for way in WAYS if way in of[0]]:
                own = cost(of, way, limit)
                reached = [row for row in of if row[way]["hours"]]
                right = sum(row[way]["verdict"] == row["effect"] for row in reached)
                cells = [f"{own.mean():.1f}", f"{np.median(own):.1f}"]
                for mean in (np.mean, np.median):
                    ratios = mean(own[at], axis=1) / mean(listed[at], axis=1)
                    low, high = np.quantile(ratios, (0.025, 0.975))
                    cells.append(f"{mean(own) / mean(listed):.2f} ({low:.2f} to {high:.2f})")
                numbers = str(len(of)), way, str(len(reached)), str(right)
                print("|", " | ".join([judge, name, *numbers, *cells]), "|")
    for judge in ("linear", "evidence"):
        tyres, sound = of_judge(rows, judge)
        for step, (share, stated, error) in promised(rows, tyres).items() if tyres else ():
            print(f"{judge}, found, {step}: {share:.3f}, promised {stated:.3f} +- {error:.3f}")
        accused = sum(row["accused"] >= FOUND for row in sound)
        print(f"{judge}, sound tyres accused: {accused} of {len(sound)}")
    both = [row for row in of_judge(rows, "evidence")[0] if "with_sets" in row]
    same = sum((row["with_sets"] >= FOUND) == (row["end"] >= FOUND) for row in both)
    print(f"found or not alike with pairs and triples: {same} of {len(both)}")


if __name__ == "__main__":
    main()
