"""Sound tyres whose two [0,0] lie within 8 % of each other: are they accused because cords turned?

    python -m tests.studies.veering            # 200 tyres, 25 minutes of a core
    python -m tests.studies.veering --tyres 20

Drawn: a design by +-40 % of its variables, kept where the pair is so near at 240 kPa; cord angles
uniformly within 3 of their standard deviations, all other constants normally; scatter 0.2 %. The
case's own model makes the data, coarse mesh, so this is no blind trial: it asks for one thing, what
the expansion of constants misses. Weighed with all effects, and pairs where p(none) is small, at
three pressures, and with slopes alone as before; twenty tyres share the expansion about a design
near them.
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
from tyrecal.simulate.modes.find import LabelledModes
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import InverseProblem, places
from tyrecal.studies.inference.model import ModelRow, Query
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources

from ..effects.support import coarse

RESULT = Path(__file__).parents[1] / "benchmarks" / "veering.jsonl"
PRESSURES_kPa, NOISE, NEAR, REACH = (160.0, 240.0, 320.0), 0.002, 0.08, np.log(1.4)
EACH, APART = 20, 0.05  # tyres about one expansion, and how far from it in ln x
DOUBTED = 0.2  # p(none), from which pairs of effects are weighed, too
AXIAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")


def made(model: TyreModel, x: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, dict]:
    """ln f of a tyre at x (v,) with drawn constants, by the model itself, and what was drawn."""
    values = {**model.designs.constants, **model.designs.values(x)}
    drawn = {}
    for source in model.found:
        turned = any(path.endswith("angle_deg") for path in source.steps)
        z = float(random.uniform(-3, 3) if turned else random.normal())
        drawn[source.name] = round(z, 2)
        for path, step in source.steps.items():
            values[path] = values.get(path, 0.0) + z * step
    own = values["pressure_kPa"] - model.case.case.pressure_kPa
    designs = [{**values, "pressure_kPa": p + own} for p in PRESSURES_kPa]
    by_pressure = dict(
        zip(PRESSURES_kPa, model.modes([(each, ()) for each in designs]), strict=True)
    )
    ln_f = []
    for label, p in model.rows:
        answer = by_pressure[p]
        assert isinstance(answer, LabelledModes) and label, answer
        ln_f.append(np.log(answer.wanted[label].frequency_Hz))
    return np.array(ln_f), drawn


def near(model: TyreModel, random: np.random.Generator) -> np.ndarray:
    """A design (v,) whose two [0,0] are near each other at 240 kPa."""
    rows = {row: i for i, row in enumerate(model.rows)}
    while True:
        x = model.start + random.uniform(-REACH, REACH, len(model.start))
        (answer,) = model.answers([Query(x)])
        if isinstance(answer, Exception):
            continue
        a, b = (answer.eta[rows[label, 240.0]] for label in (AXIAL, TORSIONAL))
        if abs(a - b) < NEAR:
            return x


@click.command()
@click.option("--tyres", default=200)
@click.option("--seed", default=19)
def main(tyres: int, seed: int) -> None:
    """Draw, diagnose, and write a line a tyre."""
    case = coarse()
    rows: list[ModelRow] = [(label, p) for p in PRESSURES_kPa for label in target_labels(case)]
    evaluator = Evaluator(TyreDesign(case))
    model = TyreModel(case, evaluator, rows, sources(case)[0], effect_ranges(case, evaluator)[0])
    random, count = np.random.default_rng(seed), Counter[tuple[str, str]]()
    lines = []
    observables = tuple(Observable("frequency_Hz", *row) for row in rows)
    unknown, scatter = np.full(len(rows), np.nan), np.full(len(rows), NOISE)
    for tyre in range(tyres):
        if tyre % EACH == 0:
            centre = near(model, random)
            expansion = expand(model, centre, False)
        x = centre + random.uniform(-APART, APART, len(centre))
        ln_f, drawn = made(model, x, random)
        y = ln_f + random.normal(0, NOISE, len(rows))
        seen = Observations(observables, y, scatter, 0.0, unknown, unknown)
        record = {"tyre": tyre, "drawn": drawn, "apart": round(abs(y[0] - y[1]), 4)}
        for name, known in (("now", expansion), ("slopes", replace(expansion, coupling=None))):
            problem = InverseProblem(
                seen, known, model.ranges, places(seen, rows), model.start, model.spread
            )
            hypotheses = weigh_hypotheses(problem, pairs=False)
            p = probabilities(hypotheses)
            if p["none"] < DOUBTED:
                hypotheses = weigh_hypotheses(problem)
                p = probabilities(hypotheses)
            verdict = decide(hypotheses, p, len(rows), len(x))
            count[name, verdict.kind] += 1
            chances = round(p["none"], 4), round(p["outside"], 4)
            record[name] = [verdict.kind, verdict.key or "", *chances]
        print(json.dumps(record), flush=True)
        lines.append(json.dumps(record))
    for name in ("now", "slopes"):
        kinds = {kind: n for (which, kind), n in sorted(count.items()) if which == name}
        print(f"{name}: {kinds}")
    if tyres >= 200:
        RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
