"""Choice of the next measurement in a closed loop: hours to a verdict of 0.9, by `next` and by a
fixed plan.

    python -m tests.studies.sequential [--tyres 600] [--seed 1] [--hindsight 60]

The P235/75R17 (coarse mesh, section taken as drawn) is asked once, with every effect, in all that a
laboratory may measure; tyres are then drawn by algebra: one effect, 20 to 100 % of its range,
design variables within 5 %, and everything else (constants, section, form, law, scatter of 0.2 %)
by the diagnosis' own covariance. A laboratory begins with the nine modes at 160 kPa, diagnoses
(single effects), measures, and diagnoses again, until the likeliest explanation has 0.9. `next`
takes the most information per hour (`CandidateRows.information`) of what is left, pressures as it
offers them (`offered_kPa`); the plan has its order.
Hours as `next_measurement.COST_HOURS` has them; footprint and loaded modes cost hours and tell the
diagnosis nothing, which uses neither as evidence: `next` never proposes them, and the plan is told
without them, too. Where no verdict is reached all hours of the plan are counted. With --hindsight,
also the cheapest set that would have done, which no laboratory can know, of so many tyres.

A reading of an effect's size is off by a tenth of its range; of a cut section's fields by a quarter
of their standard deviations. Near modes are not coupled.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

import click
import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.diagnose.evidence import NONE, Hypothesis
from tyrecal.studies.diagnose.next_measurement import (
    CAVITY_GAS,
    CHECKED,
    COST_HOURS,
    DIRECT_READINGS,
    HELIUM,
    MASS_PERCENT,
    MAX_EXPLANATIONS,
    MIN_PROBABILITY,
    READING,
    SIZES,
    CandidateRows,
    offered_kPa,
)
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import EffectResponse, Expansion, expand
from tyrecal.studies.inference.inverse_problem import InverseProblem, Toggle
from tyrecal.studies.inference.model import ModelRow
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.section_fields import SECTION
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.number_units import EFFECT_PATH
from tyrecal.tyre.state import TyreState

from ..effects.support import coarse

Array = np.ndarray
RESULT = Path(__file__).parents[1] / "benchmarks" / "sequential.jsonl"
FIRST, OWN_kPa = "160 kPa", 240.0
PRESSURE_kPa = {f"{p:g} kPa": p for p in offered_kPa(OWN_kPa, [])}
PLAN = (FIRST, "weigh", "240 kPa", "320 kPa", "calliper", "footprint", "clamp", "loaded modes")
COST = dict.fromkeys(PRESSURE_kPa, COST_HOURS["pressure"]) | {
    **{
        name: COST_HOURS[name]
        for name in ("weigh", "calliper", "rim", "seat", "helium", "mount", "clamp", "cut")
    },
    "footprint": 2.0,
    "loaded modes": 4.0,
}
TELLS_NOTHING = ("footprint", "loaded modes")
MENU = [name for name in COST if name not in (FIRST, *TELLS_NOTHING)]
LIMIT = sum(COST[name] for name in PLAN)
SURE, NOISE, APART, LEAST_SIZE = 0.9, 0.002, 0.05, 0.2
RESAMPLES = 4000


@dataclass(frozen=True)
class Laboratory:
    """Measurements that may be taken of a tyre: what each row belongs to."""

    problem: InverseProblem  # of all rows
    item: Array  # (n,)

    @cached_property
    def jacobian(self) -> Array:
        """(n, v) at x0."""
        return self.problem.plain(np.zeros(len(self.problem.centre)))[1]

    def judged(self, done: Sequence[str]) -> tuple[list[Hypothesis], dict[str, float]]:
        """The diagnosis of what was measured."""
        hypotheses = weigh_hypotheses(self.problem.only(np.isin(self.item, done)), pairs=False)
        return hypotheses, probabilities(hypotheses)

    def information(
        self,
        hypotheses: Sequence[Hypothesis],
        p: Mapping[str, float],
        done: Sequence[str],
        name: str,
    ) -> float:
        """Information of a measurement, as `next` has it."""
        likely = {k: p[k] for k in sorted(p, key=lambda k: -p[k]) if p[k] > MIN_PROBABILITY}
        keys = [h.key for h in hypotheses if h.key in likely and (h.values or h.key == NONE)]
        keys = sorted(keys, key=lambda key: -likely[key])[:MAX_EXPLANATIONS]
        if len(keys) < 2:
            return 0.0
        here = np.flatnonzero(np.isin(self.item, done))
        order = np.append(here, np.flatnonzero(self.item == name))
        shifts = {}
        for h in hypotheses:
            if h.key in keys:
                sizes = h.typical(SIZES) if h.values else {}
                added = self.problem.added(sizes, SIZES if sizes else 1)
                shifts[h.key] = added.shift[:, order]
        sigma = self.problem.sigma[np.ix_(order, order)]
        known = {key: likely[key] for key in keys}
        after = CandidateRows(sigma, self.jacobian[order], shifts)
        return after.information(len(here), known, self.problem.spread)


@dataclass(frozen=True)
class Course:
    """Measurements of a laboratory, and their result."""

    hours: float  # to a verdict; infinite: there was none
    verdict: str  # the likeliest explanation at the end
    done: tuple[str, ...]


def offered(done: Sequence[str]) -> list[str]:
    """Measurements that remain in addition to these."""
    measured = [PRESSURE_kPa[name] for name in done if name in PRESSURE_kPa]
    near = set(PRESSURE_kPa.values()) - set(offered_kPa(OWN_kPa, measured))
    return [name for name in MENU if name not in done and PRESSURE_kPa.get(name) not in near]


def by_next(tyre: Laboratory) -> Course:
    """The most information per hour first."""
    done, hours = [FIRST], COST[FIRST]
    while True:
        hypotheses, p = tyre.judged(done)
        top = max(p, key=lambda key: p[key])
        if p[top] >= SURE:
            return Course(hours, top, tuple(done))
        left = [name for name in offered(done) if hours + COST[name] <= LIMIT]
        if not left:
            return Course(np.inf, top, tuple(done))
        gain = {name: tyre.information(hypotheses, p, done, name) / COST[name] for name in left}
        done.append(max(gain, key=lambda name: gain[name]))
        hours += COST[done[-1]]


def by_plan(tyre: Laboratory, plan: Sequence[str]) -> Course:
    """Take the measurements one after the other."""
    done: list[str] = []
    for name in plan:
        done.append(name)
        if name not in TELLS_NOTHING:
            _, p = tyre.judged(done)
            top = max(p, key=lambda key: p[key])
            if p[top] >= SURE:
                return Course(sum(COST[each] for each in done), top, tuple(done))
    return Course(np.inf, top, tuple(done))


def in_hindsight(tyre: Laboratory) -> Course:
    """The cheapest set, of up to four beside the first, after which the verdict stands."""
    sets = [
        (FIRST, *each)
        for count in range(5)
        for each in combinations(offered([FIRST]), count)
        if all(name in offered([FIRST, *each[:i]]) for i, name in enumerate(each))
    ]
    for done in sorted(sets, key=lambda each: sum(COST[name] for name in each)):
        hours = sum(COST[name] for name in done)
        if hours > LIMIT:
            break
        _, p = tyre.judged(done)
        top = max(p, key=lambda key: p[key])
        if p[top] >= SURE:
            return Course(hours, top, done)
    return Course(np.inf, "", ())


def laboratory() -> Laboratory:
    """Laboratory of the case: everything evaluated once, nothing measured yet."""
    case = coarse()
    case = changed(case, section=with_part(case.case.section, known_from=None))
    evaluator, labels = Evaluator(TyreDesign(case)), target_labels(case)
    rows: list[ModelRow] = [(label, p) for p in PRESSURE_kPa.values() for label in labels]
    rows += [(label, TyreState(OWN_kPa, 0.0, "fixed")) for label in labels]
    rows.append((None, 0.0))
    own_sources, ranges = sources(case)[0], effect_ranges(case, evaluator)[0]
    model = TyreModel(case, evaluator, rows, own_sources, ranges)
    expanded = replace(expand(model, model.start, False), coupling=None)
    items, observables, places = [], [], []

    def measured(name: str, observable: Observable, place: int) -> None:
        items.append(name), observables.append(observable), places.append(place)

    for place, row in enumerate(rows):
        what = Observable.of(row)
        name = "weigh" if not row[0] else "clamp" if what.rim else f"{what.pressure_kPa:g} kPa"
        measured(name, what, place)
    own = [place for place, row in enumerate(rows) if row[0] and row[1] == OWN_kPa]
    for place in own:
        measured("mount", Observable.of(rows[place]), place)
        measured("helium", replace(Observable.of(rows[place]), run=1), place)
    readings = [
        (tool, id)
        for tool, (_, ids) in DIRECT_READINGS.items()
        for id in expanded.nodes
        if id in ids
    ]
    fields = [k for k, name in enumerate(model.sources) if name.startswith(SECTION)]
    shows = np.zeros((len(readings) + len(fields), len(own_sources)))
    far = {id: max(abs(ranges[id].low), abs(ranges[id].high)) for id in expanded.nodes}
    for i, (_, id) in enumerate(readings):
        shows[i] = [source.steps.get(EFFECT_PATH + id, 0.0) / far[id] for source in own_sources]
    shows[range(len(readings), len(shows)), fields] = 1.0
    for i, tool in enumerate([*(tool for tool, _ in readings), *("cut" for _ in fields)]):
        measured(tool, Observable(f"reading {i}", None, 0.0), len(rows) + i)
    ids = [id for _, id in readings]
    expansion = _with_readings(expanded, shows, ids, far)
    scatter = [MASS_PERCENT / 100 if name == "weigh" else NOISE for name in items]
    scatter[-len(shows) :] = [READING] * len(readings) + [CHECKED] * len(fields)
    none = np.full(len(items), np.nan)
    seen = Observations(
        tuple(observables), np.zeros(len(items)), np.array(scatter), 0.0, none, none
    )
    changes = (Toggle(CAVITY_GAS, HELIUM, times=True),)
    problem = InverseProblem(
        seen, expansion, ranges, np.array(places), model.start, model.spread, changes
    )
    return Laboratory(problem, np.array(items))


def _with_readings(
    expanded: Expansion, shows: Array, ids: Sequence[str], far: Mapping[str, float]
) -> Expansion:
    """Add rows: readings of effects' sizes, over their ranges, and of sources."""
    m, v = len(shows), len(expanded.x0)

    def of(id: str, nodes: EffectResponse) -> EffectResponse:
        size = np.zeros((len(nodes.values), m))
        if id in ids:
            size[:, list(ids).index(id)] = nodes.values / far[id]
        return replace(
            nodes,
            shift=np.hstack([nodes.shift, size]),
            slope=np.hstack([nodes.slope, np.full_like(size, np.nan)]),
            tilt=np.concatenate([nodes.tilt, np.zeros((len(size), m, v))], axis=1),
            split=np.hstack([nodes.split, np.zeros_like(size)]),
            shape_uncertainty={
                e: np.append(each, np.zeros(m)) for e, each in nodes.shape_uncertainty.items()
            },
        )

    return replace(
        expanded,
        eta=np.append(expanded.eta, np.zeros(m)),
        jacobian=np.vstack([expanded.jacobian, np.zeros((m, v))]),
        hessian=np.concatenate([expanded.hessian, np.zeros((m, v, v))]),
        split=np.append(expanded.split, np.zeros(m)),
        constants=np.vstack([expanded.constants, shows]),
        nodes={id: of(id, nodes) for id, nodes in expanded.nodes.items()},
    )


def drawn(lab: Laboratory, random: np.random.Generator) -> tuple[str, float, Laboratory]:
    """A tyre with an effect, its size, and all that could be measured of it."""
    problem = lab.problem
    id = str(random.choice(sorted(problem.expansion.nodes)))
    ends = [end for end in problem.expansion.nodes[id].reach if end]
    e = random.uniform(LEAST_SIZE, 1) * float(random.choice(ends))
    d = random.uniform(-APART, APART, len(problem.centre))
    added = problem.added({id: np.array([e])}, 1)
    mean = problem.plain(d)[0] + added.shift[0] + added.tilt[0] @ d
    root = np.linalg.cholesky(problem.sigma + problem.response_covariance(added)[0])
    y = mean + root @ random.normal(size=len(mean))
    return id, e, replace(lab, problem=problem.measured(y))


@click.command()
@click.option("--tyres", default=600)
@click.option("--seed", default=1)
@click.option("--hindsight", default=60)
def main(tyres: int, seed: int, hindsight: int) -> None:
    """Draw, measure, and write a line a tyre."""
    lab, random, lines = laboratory(), np.random.default_rng(seed), []
    plain = [name for name in PLAN if name not in TELLS_NOTHING]
    for tyre in range(tyres):
        id, e, drawn_tyre = drawn(lab, random)
        _, p = drawn_tyre.judged([*COST])
        courses = {
            "next": by_next(drawn_tyre),
            "plan": by_plan(drawn_tyre, PLAN),
            "plan without footprint and loaded modes": by_plan(drawn_tyre, plain),
        }
        if len(courses["next"].done) > 1 and tyre < hindsight:
            courses["hindsight"] = in_hindsight(drawn_tyre)
        results = {
            name: {"hours": c.hours if np.isfinite(c.hours) else None, "verdict": c.verdict}
            for name, c in courses.items()
        }
        results["next"]["measured"] = list(courses["next"].done)
        line = {"tyre": tyre, "effect": id, "size": round(e, 12), "all": max(p.values()), **results}
        lines.append(json.dumps(line))
        print(lines[-1], flush=True)
    tell([json.loads(line) for line in lines])
    if tyres >= 600:
        RESULT.write_text("\n".join(lines) + "\n")


def tell(lines: list[dict]) -> None:
    """The table."""
    choice = [each for each in lines if len(each["next"]["measured"]) > 1]
    could = [each for each in choice if each["all"] >= SURE]
    sets = {
        "all": lines,
        "not settled by the first measurement": choice,
        "of these, settled once all is measured": could,
        "of these, with the cheapest set": [x for x in could if "hindsight" in x],
        "of these, settled by the plan": [x for x in could if x["plan"]["hours"]],
    }
    heads = "tyres", "number", "way", "verdict reached", "right of these", "mean, median h"
    heads = *heads, "mean over the plan's (95 %)", "median (95 %)"
    print("|", " | ".join(heads), "|")
    print("|---" * len(heads) + "|")
    for words, of in sets.items():
        for name in ("plan", "plan without footprint and loaded modes", "next", "hindsight"):
            own = [each for each in of if name in each]
            if not own:
                continue
            hours, plan = (
                np.array([each[way]["hours"] or LIMIT for each in own]) for way in (name, "plan")
            )
            reached = [each for each in own if each[name]["hours"]]
            right = [each[name]["verdict"] == each["effect"] for each in reached]
            at = np.random.default_rng(0).integers(0, len(own), (RESAMPLES, len(own)))
            bounds = [
                np.quantile(mean(hours[at], axis=1) / mean(plan[at], axis=1), (0.025, 0.975))
                for mean in (np.mean, np.median)
            ]
            ratios = [mean(hours) / mean(plan) for mean in (np.mean, np.median)]
            cells = [
                f"{ratio:.2f} ({low:.2f} to {high:.2f})"
                for ratio, (low, high) in zip(ratios, bounds, strict=True)
            ]
            print(
                f"| {words} | {len(own)} | {name} | {len(reached)} | {sum(right)} |"
                f" {hours.mean():.1f}, {np.median(hours):.1f} | {cells[0]} | {cells[1]} |"
            )


if __name__ == "__main__":
    main()
