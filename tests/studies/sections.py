"""Sound tyres whose section is a little off everywhere: are they accused? And what does it cost to
doubt it: are effects still found?

    python -m tests.studies.sections            # 400 tyres, 15 minutes of a core

Sections by another law than the diagnosis' own: a meridian off by sines with falling amplitudes,
0.8 mm rms; what lies outside the carcass, and inside it, thicker or thinner by straight lines
between five places, 4 %; every part's compound by itself, 5 % in stiffness and 1 % in density.
Geometry by the model itself (coarse mesh), compounds and constants by its exact slopes, cord angles
aside (`tests.studies.veering` turns them); designs within 5 % of the start, scatter 0.2 %, three
pressures. The same tyres again with an effect, 60 to 100 % of its range, by the diagnosis' own law.
The case says nothing of its section, so that it is taken as drawn; every fourth tyre is weighed
with a section that is stated as exact, too. All effects are weighed, and pairs on sound tyres where
p(none) is small.
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
from tyrecal.studies.diagnose.gap import projection
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import expand
from tyrecal.studies.inference.inverse_problem import InverseProblem, places
from tyrecal.studies.inference.model import Answer, ModelRow, Query
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.regions import regions
from tyrecal.studies.inference.section_fields import SECTION_SIZES, UNSAID, arc_length
from tyrecal.studies.inference.separability import separate
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.effects.parts import carcass_line

from ..effects.support import coarse

Array = np.ndarray
RESULT = Path(__file__).parents[1] / "benchmarks" / "sections.jsonl"
PRESSURES_kPa, NOISE, APART, DOUBTED = (160.0, 240.0, 320.0), 0.002, 0.05, 0.2
EXACT_EACH = 4  # tyres
DETECTABLE = 25.0  # lambda


def wrong_section(case: LoadedCase, random: np.random.Generator) -> LoadedCase:
    """The case with another section than it says, by the law above."""
    meridian, _, gauge, _, _ = SECTION_SIZES[UNSAID]
    s, section = np.clip(arc_length(case), 0, 1), case.section
    line = section.names.index(carcass_line(case))
    waves = sum(random.normal() / k * np.sin(k * np.pi * (1 - s) / 2) for k in (1, 2, 3, 4))
    waves = waves * meridian * abs(random.normal()) / np.sqrt(np.mean(waves**2))
    carcass = section.points[line]
    r, z = np.gradient(carcass, axis=0).T
    normal = np.stack([-z, r], 1) / np.hypot(r, z)[:, None]
    thicker = np.zeros(section.points.shape[:2])
    for rows in (slice(0, line), slice(line + 1, None)):
        ends = np.append(gauge * random.normal(size=4), 0.0)
        thicker[rows] = np.interp(s, np.linspace(0, 1, 5), ends)
    points = carcass + (section.points - carcass) * (1 + thicker[..., None])
    return replace(case, drawn=replace(section, points=points + waves[:, None] * normal))


@click.command()
@click.option("--tyres", default=400)
@click.option("--seed", default=19)
def main(tyres: int, seed: int) -> None:
    """Draw, diagnose, and write a line a tyre."""
    case = coarse()
    case = changed(case, section=with_part(case.case.section, known_from=None))
    rows: list[ModelRow] = [(label, p) for p in PRESSURES_kPa for label in target_labels(case)]
    evaluator = Evaluator(TyreDesign(case))
    own_sources = sources(case)[0]
    model = TyreModel(case, evaluator, rows, own_sources, effect_ranges(case, evaluator)[0])
    stated = replace(expand(model, model.start, False), coupling=None)
    fields = np.array([source.field is not None for source in own_sources])
    exact = replace(stated, constants=np.where(fields, 0.0, stated.constants), material_laws=0.0)
    turned = [any(path.endswith("angle_deg") for path in source.steps) for source in own_sources]
    constants = stated.constants[:, ~fields & ~np.array(turned)]
    parts = [part for part in regions(model, model.start) if part.rubber]
    compounds = np.array([[part.stiffness for part in parts], [part.mass for part in parts]])
    random, count = np.random.default_rng(seed), Counter[tuple[str, str, str]]()
    observables = tuple(Observable("frequency_Hz", *row) for row in rows)
    unknown, scatter = np.full(len(rows), np.nan), np.full(len(rows), NOISE)

    def asked(y: Array, name: str) -> InverseProblem:
        seen = Observations(observables, y, scatter, 0.0, unknown, unknown)
        known = stated if name == "default" else exact
        where = places(seen, rows)
        return InverseProblem(seen, known, model.ranges, where, model.start, model.spread)

    power = {}
    for name in ("default", "exact"):
        at_start = asked(stated.eta, name)
        power[name] = separate(at_start, projection(at_start, np.zeros(3))[0], {}).full
    print("| effect | lambda at full size, section not in doubt | known from its drawing |")
    for id, full in sorted(power["exact"].items(), key=lambda item: -item[1]):
        print(f"| {id} | {full:.0f} | {power['default'][id]:.0f} |", flush=True)
    lines = []
    for tyre in range(tyres):
        wrong = wrong_section(case, random)
        (answer,) = TyreModel(wrong, evaluator, rows, [], {}).answers([Query(model.start)])
        if not isinstance(answer, Answer):
            continue
        d = random.uniform(-APART, APART, 3)
        plain, _ = stated.plain(stated.x0 + d)
        y = plain + constants @ random.normal(size=constants.shape[1]) + answer.eta - stated.eta
        sizes = np.array(SECTION_SIZES[UNSAID][3:])[:, None] * random.normal(
            size=compounds.shape[:2]
        )
        y += np.einsum("kp,kpn->n", sizes, compounds) + random.normal(0, NOISE, len(rows))
        id = str(random.choice(sorted(stated.nodes)))
        low, high = stated.nodes[id].reach
        e = random.uniform(0.6, 1.0) * float(random.choice([end for end in (low, high) if end]))
        shift, tilt, _ = stated.nodes[id].at(np.array([e]))
        record: dict[str, object] = {"tyre": tyre, "effect": id, "size": e}
        for kind, measured in (("sound", y), ("effect", y + shift[0] + tilt[0] @ d)):
            for name in ("default", "exact")[: 1 + (tyre % EXACT_EACH == 0)]:
                problem = asked(measured, name)
                hypotheses = weigh_hypotheses(problem, pairs=False)
                p = probabilities(hypotheses)
                if p["none"] < DOUBTED and kind == "sound":
                    hypotheses = weigh_hypotheses(problem)
                    p = probabilities(hypotheses)
                verdict = decide(hypotheses, p, len(rows), 3)
                record[f"{kind} {name}"] = [verdict.kind, verdict.key or ""]
                at = separate(problem, projection(problem, d)[0], {id: e}).lambdas[id]
                word: str = verdict.kind
                if kind == "effect":
                    right = "right" if verdict.key == id else "wrong" if verdict.key else word
                    word = f"{right}, lambda {'from' if at >= DETECTABLE else 'below'} 25"
                count[kind, name, word] += 1
        lines.append(json.dumps(record))
        print(lines[-1], flush=True)
    for key, n in sorted(count.items()):
        print(*key, n)
    if tyres >= 400:
        RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
