"""Does damping tell effects apart that frequencies confuse? Sealed trials, judged with and without.

    python -m tests.studies.damping make FOLDER [--trials 120] [--sound 60]
    python -m tests.studies.damping answer FOLDER [--sets]
    python -m tests.studies.damping table [--record damping_sound]

The P235/75R17 (coarse mesh, section taken as drawn, three pressures, nine modes). Tyres: one effect
of `KINDS` by another law than the catalogue's (`tests.blind.laws`), 20 to 100 % of its range, or
none; constants and section drawn as stated; computed by the solver; errors of the model drawn by
its own covariance, frequencies with 0.2 %, damping ratios with 25 % scatter and 10 % of each mode.
Loss: rate-independent and by stiffening add as a root of squares; 1 % less per kelvin. Two cases:
loss factor `LOSS` stated (15 %), or none stated, and the tyre's about `DRAWN_LOSS`, factor 2.

``make`` seals: the truth is in one file, its sha256 heads the record, before anything is answered.
The judge: all single effects by `weigh_hypotheses`, each at further sizes, carried to the plain fit
with near modes coupled as `diagnose` does; what it evaluates anew at re-fits is left out. The same
frequencies, with their noise, are judged three times: alone, with damping of either case. Damping
moves no re-fit, so that it is added to the evidence of each, on the grids of the frequencies.
A pair: the effect, and that effect of another kind which its frequencies are most like (`rivals`).
Ceiling: mean of the larger of the pair's two stated probabilities, normed to their sum. An answerer
is right as often if its probabilities are; over both members of a pair alike, no other is oftener.
"""

from __future__ import annotations

import json
import secrets
from dataclasses import replace
from hashlib import sha256
from math import exp, log, pi, tan
from pathlib import Path
from typing import Any

import click
import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.blind.make import Truth, tyre
from tyrecal.studies.diagnose.evidence import NONE, Hypothesis
from tyrecal.studies.diagnose.gap import projection
from tyrecal.studies.diagnose.several import present, probabilities, weigh_hypotheses
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.inference.covariance import model_form
from tyrecal.studies.inference.damping import (
    ASSUMED_LOSS,
    ASSUMED_LOSS_SD,
    DAMPING_FORM,
    STATED_LOSS_SD,
)
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.expansion import MIDDLE, carried, expand, refined
from tyrecal.studies.inference.inverse_problem import InverseProblem
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.observations import DampingRatios, Observable, Observations
from tyrecal.studies.inference.plain_fit import plain_fit
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.effects.edit import changed, with_part, with_rubbers

from ..blind.laws import other_laws
from ..effects.support import coarse

Array = np.ndarray
Row = dict[str, Any]
BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
NAME = "damping"  # of a record: NAME.jsonl, NAME_truth.json
PRESSURES_kPa = (160.0, 240.0, 320.0)
NOISE, DAMPING_NOISE, SPLIT, SPREAD, SMALLEST = 0.002, 0.25, 0.003, 0.1, 0.2
LOSS, LOSS_PER_KELVIN = 0.12, -0.01
DRAWN_LOSS = 0.1  # median where none is stated; the diagnosis assumes 0.15
KINDS = {
    "spindle": ("spindle_lateral", "spindle_radial", "spindle_torsional", "spindle_tilt"),
    "stiffening": ("frequency_stiffening",),
    "mass": ("point_mass", "tread_density", "tread_wear"),
    "temperature": ("temperature",),
}
WAYS = "frequencies", "loss stated", "loss unknown"


def study_case() -> LoadedCase:
    """The tyre, its section taken as drawn."""
    case = coarse()
    return changed(case, section=with_part(case.case.section, known_from=None))


def model_of(case: LoadedCase, store: Path | None, every: bool) -> TyreModel:
    """The model of all rows, with the loss factor stated, with every effect or none."""
    case = with_rubbers(case, lambda m: with_part(m, loss_factor=LOSS))
    evaluator = Evaluator(TyreDesign(case), store=Store(store) if store else None)
    rows = [(label, p) for p in PRESSURES_kPa for label in target_labels(case)]
    ranges = effect_ranges(case, evaluator)[0] if every else {}
    return TyreModel(case, evaluator, list(rows), sources(case)[0], ranges, 1, damped=True)


def problem_of(model: TyreModel) -> InverseProblem:
    """The problem without data, about the start, each effect at further sizes."""
    expansion = expand(model, model.start)
    for share in MIDDLE[1:]:
        sizes = {
            id: share * max(nodes.reach, key=abs)
            for id, nodes in expansion.nodes.items()
            if abs(nodes.values - share * max(nodes.reach, key=abs)).min() > 0
        }
        expansion = refined(expansion, model, sizes)
    at = [Observable("frequency_Hz", label, float(p)) for label, p in model.rows]  # type: ignore[arg-type]
    pair = np.array([bool(row.label and row.label.c) for row in at])
    scatter = np.where(pair, NOISE / np.sqrt(2), NOISE)
    apart = np.where(pair, NOISE * np.sqrt(2), np.nan)
    seen = Observations(tuple(at), expansion.eta, scatter, 0.0, np.where(pair, 0.0, np.nan), apart)
    every = np.arange(len(at))
    return InverseProblem(
        seen, expansion, model.ranges, every, model.start, model.spread, damping_places=every
    )


def unstated(problem: InverseProblem) -> InverseProblem:
    """The problem of the case without a loss factor: there is one compound, so that damping ratios
    are in proportion to it, and only stiffening changes it."""
    expansion, nodes = problem.expansion, dict(problem.expansion.nodes)
    assert expansion.damping is not None and expansion.losses is not None
    own = nodes["frequency_stiffening"]
    least = np.tan(np.pi * own.values / 2)
    grown = np.maximum(1, least / ASSUMED_LOSS) / np.maximum(1, least / LOSS)
    assert own.damping is not None
    nodes["frequency_stiffening"] = replace(own, damping=own.damping * grown[:, None])
    there = replace(
        expansion,
        nodes=nodes,
        damping=expansion.damping + log(ASSUMED_LOSS / LOSS),
        losses=expansion.losses * ASSUMED_LOSS_SD / STATED_LOSS_SD,
    )
    return replace(problem, expansion=there)


def drawn(case: LoadedCase, id: str, seed: list[int], model: TyreModel) -> tuple[Row, Row]:
    """A trial: its truth, and what was measured. Raises EvaluationFailed, ValueError."""
    random = np.random.default_rng(seed)
    law = other_laws(frozenset(model.evaluator.solver.capabilities)).get(id)
    size = law.drawn(random, SMALLEST) if law else 0.0
    own = sources(case)[0]
    variables = {
        name: value * exp(random.uniform(-SPREAD, SPREAD))
        for name, value in start_values(case).items()
    }
    constants = {source.name: float(random.normal()) for source in own}
    truth = Truth("", "effect", id, size, variables, constants, 0, False)
    eta, zeta, split = [], [], []
    for p in PRESSURES_kPa:
        made = tyre(truth, case, own, p, law)
        made = with_rubbers(made, lambda m: with_part(m, loss_factor=DRAWN_LOSS))
        rows = [row for row in model.rows if row[1] == p]
        kPa = made.case.pressure_kPa
        there = TyreModel(made, Evaluator(TyreDesign(made)), [(x, kPa) for x, _ in rows], [], {})
        (answer,) = there.answers([Query(there.start)])
        if not isinstance(answer, Answer):
            raise answer
        assert answer.damping is not None
        eta.append(answer.eta)
        zeta.append(answer.damping - log(DRAWN_LOSS))
        split.append(answer.split)
    at = tuple(Observable("frequency_Hz", label, float(p)) for label, p in model.rows)  # type: ignore[arg-type]
    n, labels = len(at), [str(row.label) for row in at]
    root = np.linalg.cholesky(model_form(at, model.material_laws) + 1e-12 * np.eye(n))
    y = np.concatenate(eta) + root @ random.normal(size=n)
    uneven = {label: random.normal() * SPLIT for label in dict.fromkeys(labels)}
    members = np.concatenate(split) + [uneven[label] for label in labels]
    noise = NOISE * random.normal(size=(2, n))
    pair = np.array([bool(row.label and row.label.c) for row in at])
    y = y + np.where(pair, noise.mean(0), noise[0])
    members = np.where(pair, abs(members + noise[1] - noise[0]), 0.0)
    off = {label: random.normal() * DAMPING_FORM for label in dict.fromkeys(labels)}
    ln_zeta = np.concatenate(zeta) + [off[label] for label in labels]
    ln_zeta = ln_zeta + DAMPING_NOISE * random.normal(size=n)
    losses = {}
    for way, middle, sd in zip(
        WAYS[1:], (LOSS, DRAWN_LOSS), (STATED_LOSS_SD, ASSUMED_LOSS_SD), strict=True
    ):
        loss = middle * exp(sd * random.normal())
        if id == "frequency_stiffening":
            loss = float(np.hypot(loss, tan(pi * size / 2)))
        if id == "temperature":
            loss *= exp(LOSS_PER_KELVIN * size)
        losses[way] = log(loss)
    measured = {"y": y.tolist(), "split": members.tolist()}
    measured |= {way: (ln_zeta + loss).tolist() for way, loss in losses.items()}
    return {"effect": id, "size": size, "loss": {k: exp(v) for k, v in losses.items()}}, measured


def rivals(problem: InverseProblem) -> dict[str, str]:
    """For each effect of `KINDS` that of another kind which frequencies least separate."""
    P = projection(problem, np.zeros_like(problem.centre))[0]
    root = np.linalg.cholesky(P + 1e-9 * np.trace(P) * np.eye(len(P))).T
    kind = {id: name for name, ids in KINDS.items() for id in ids}
    g = {}
    for id in kind:
        e = np.array([max(problem.expansion.nodes[id].reach, key=abs)])
        shift = root @ (problem.added({id: e}, 1).shift[0])
        g[id] = shift / np.linalg.norm(shift)
    return {
        id: max((j for j in kind if kind[j] != kind[id]), key=lambda j: abs(float(g[id] @ g[j])))
        for id in kind
    }


def about_fit(problem: InverseProblem, model: TyreModel, measured: Row) -> InverseProblem:
    """The problem about the plain tyre that fits the measured frequencies."""
    seen, known = replace(problem.observations, y=np.array(measured["y"])), problem.expansion
    x0 = plain_fit(model, seen, problem.places, known=known)
    return replace(problem, expansion=carried(known, model, x0))


def judged(problem: InverseProblem, measured: Row, sets: bool) -> list[Hypothesis]:
    """All hypotheses by frequencies; sets: of two and three effects, too."""
    seen = problem.observations
    split = np.where(np.isfinite(seen.split), measured["split"], np.nan)
    own = replace(seen, y=np.array(measured["y"]), split=split)
    return weigh_hypotheses(replace(problem, observations=own), pairs=sets)


def with_damping(
    problem: InverseProblem, hypotheses: list[Hypothesis], ln_zeta: list[float]
) -> list[Hypothesis]:
    """The hypotheses by damping ratios, too."""
    rows = tuple(replace(row, quantity="damping_ratio") for row in problem.observations.rows)
    data = DampingRatios(rows, np.array(ln_zeta), np.full(len(rows), DAMPING_NOISE))
    both = replace(problem, observations=replace(problem.observations, damping=data))
    assert both.damping
    result = []
    for h in hypotheses:
        added = both.added(h.values, len(h.fitted.d)).damping
        information = np.linalg.inv(h.fitted.covariance)
        more = both.damping.ln_likelihood(added, h.fitted.d, information)
        if not h.values:
            result.append(replace(h, ln_evidence=h.ln_evidence + float(more[0])))
            continue
        ln = h.fitted.ln_evidence + more
        total = float(np.logaddexp.reduce(ln + h.ln_weights))
        result.append(replace(h, ln_evidence=total, fitted=h.fitted._replace(ln_evidence=ln)))
    return result


def told(problem: InverseProblem, hypotheses: list[Hypothesis]) -> Row:
    """Verdict, likeliest explanation, and probabilities of `KINDS`."""
    p = probabilities(hypotheses)
    verdict = decide(hypotheses, p, len(problem.places), len(problem.centre))
    ids = [id for ids in KINDS.values() for id in ids]
    each = {id: float(f"{max(present(p, [id]), 1e-12):.3g}") for id in ids}
    return {
        "verdict": verdict.kind,
        "named": verdict.key,
        "top": max(p, key=p.__getitem__),
        "each": each,
    }


@click.group()
def main() -> None:
    """Make, answer, or print the table."""


@main.command()
@click.argument("folder", type=Path)
@click.option("--trials", default=120)
@click.option("--sound", default=40)
@click.option("--record", default=NAME)
def make(folder: Path, trials: int, sound: int, record: str) -> None:
    """Draw and compute trials, seal the truth. Resumed."""
    folder.mkdir(parents=True, exist_ok=True)
    seed_file = folder / "seed"
    if not seed_file.exists():
        seed_file.write_text(str(secrets.randbits(63)))
    seed, case = int(seed_file.read_text()), study_case()
    model = model_of(case, None, False)
    ids = [
        id
        for ids in zip(*(np.resize(ids, 12) for ids in KINDS.values()), strict=True)
        for id in ids
    ]
    wanted = [str(ids[k % len(ids)]) for k in range(trials)] + [NONE] * sound
    truths, order = [], np.random.default_rng(seed).permutation(len(wanted))
    for place, k in enumerate(order.tolist()):
        path = folder / f"made_{place:03}.json"
        if not path.exists():
            for again in range(20):
                try:
                    both = drawn(case, wanted[k], [seed, k, again], model)
                    break
                except (EvaluationFailed, ValueError):
                    continue
            path.write_text(json.dumps(both))
        truth, measured = json.loads(path.read_text())
        truths.append(truth)
        (folder / f"trial_{place:03}.json").write_text(json.dumps(measured))
    text = json.dumps({"nonce": secrets.token_hex(32), "seed": seed, "trials": truths}, indent=0)
    (folder / "truth.json").write_text(text + "\n")
    write(
        record,
        {"sha256_of_truth": sha256((text + "\n").encode()).hexdigest(), "trials": len(truths)},
    )


@main.command()
@click.argument("folder", type=Path)
@click.option("--store", type=Path)
@click.option("--record", default=NAME)
@click.option("--sets", is_flag=True, help="Also sets of effects, 5 s of a core each.")
def answer(folder: Path, store: Path | None, record: str, sets: bool) -> None:
    """Judge each trial that is not on record, a line each; at the end the truth is published."""
    case = study_case()
    model = model_of(case, store, True)
    problem = problem_of(model)
    if len(read(record)) == 1:
        write(record, {"rivals": rivals(problem)})
    done = {(row["trial"], row["sets"]) for row in read(record) if "trial" in row}
    every = range(read(record)[0]["trials"])
    for k in every:
        if (k, sets) in done:
            continue
        measured = json.loads((folder / f"trial_{k:03}.json").read_text())
        there = about_fit(problem, model, measured)
        hypotheses = judged(there, measured, sets)
        row = {"trial": k, "sets": sets, WAYS[0]: told(there, hypotheses)}
        for way, own in {WAYS[1]: there, WAYS[2]: unstated(there)}.items():
            row[way] = told(own, with_damping(own, hypotheses, measured[way]))
        write(record, row)
    truth_file(record).write_text((folder / "truth.json").read_text())
    tell(record)


def truth_file(record: str) -> Path:
    """The truth of a record, published when all is answered."""
    return BENCHMARKS / f"{record}_truth.json"


def read(record: str) -> list[Row]:
    """All rows."""
    path = BENCHMARKS / f"{record}.jsonl"
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def write(record: str, row: Row) -> None:
    """Add a row."""
    with (BENCHMARKS / f"{record}.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


@main.command()
@click.option("--record", default=NAME)
def table(record: str) -> None:
    """Print the table of the record."""
    tell(record)


def scored(record: str = NAME, sets: bool = False) -> dict[str, Row]:
    """Counts by way: trials, right of the pair, top 1, named right and wrong, sound accused."""
    head, other, *rows = read(record)
    text = truth_file(record).read_text(encoding="utf-8")
    assert sha256(text.encode()).hexdigest() == head["sha256_of_truth"]
    truths, result = json.loads(text)["trials"], {}
    for way in WAYS:
        count = dict.fromkeys(("effects", "pair", "top", "named", "wrong", "sound", "accused"), 0)
        pairs: dict[str, list[int]] = {}
        for row in [row for row in rows if row["sets"] == sets]:
            own, id = row[way], truths[row["trial"]]["effect"]
            if id == NONE:
                count["sound"] += 1
                count["accused"] += own["named"] is not None
                continue
            right = own["each"][id] > own["each"][other["rivals"][id]]
            count["effects"] += 1
            count["pair"] += right
            pairs.setdefault(id, [0, 0])
            pairs[id][0] += right
            pairs[id][1] += 1
            count["top"] += own["top"] == id
            count["named"] += own["named"] == id
            count["wrong"] += own["named"] is not None and id not in own["named"].split("+")
        result[way] = {**count, "pairs": pairs}
    return result


def shares(way: str, record: str = NAME) -> dict[str, Array]:
    """By kind, of single effects: size of each effect, and its share of its pair (n, 2); and that
    of a point mass against a temperature, the other member of that pair."""
    _, other, *rows = read(record)
    truths = json.loads(truth_file(record).read_text(encoding="utf-8"))["trials"]
    groups = {kind: {id: other["rivals"][id] for id in ids} for kind, ids in KINDS.items()}
    groups["point mass or temperature"] = {"point_mass": "temperature"}
    result = {}
    for name, rival in groups.items():
        own = []
        for row in [row for row in rows if not row["sets"]]:
            truth, each = truths[row["trial"]], row[way]["each"]
            if (id := truth["effect"]) in rival:
                own.append((truth["size"], each[id] / (each[id] + each[rival[id]])))
        result[name] = np.array(own).reshape(-1, 2)
    return result


def ceiling(share: Array) -> tuple[float, float]:
    """The ceiling of trials by the shares (n,) of their effects, and its standard error."""
    larger = np.maximum(share, 1 - share)
    return float(larger.mean()), float(larger.std(ddof=1) / np.sqrt(len(share)))


def tell(record: str) -> None:
    """The tables: judged with single effects, and with sets of them."""
    for sets in {row["sets"] for row in read(record)[2:]}:
        counts = scored(record, sets)
        heads = list(counts[WAYS[0]])[:-1]
        print("|", " | ".join(["with sets" if sets else "single effects", *heads]), "|")
        print("|---" * (len(heads) + 1) + "|")
        for way, own in counts.items():
            print("|", " | ".join([way, *(str(own[key]) for key in heads)]), "|")
        for id, rival in read(record)[1]["rivals"].items():
            each = [counts[way]["pairs"].get(id, [0, 0]) for way in WAYS]
            print(f"{id} or {rival}:", ", ".join(f"{right} of {all}" for right, all in each))
        print()
    for way in WAYS:
        for name, own in shares(way, record).items():
            if len(own):
                mean, error = ceiling(own[:, 1])
                wrong = ", ".join(f"{size:.3g} ({p:.2f})" for size, p in own if p <= 0.5)
                print(f"{way}, {name}: {len(own)}, ceiling {mean:.2f} +- {error:.2f}", end="")
                print("; wrong: " + wrong if wrong else "")


if __name__ == "__main__":
    main()
