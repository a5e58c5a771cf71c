"""An earlier blind study's trials, answered by today's diagnosis.

    python -m tests.studies.answered_again DIR blind_study_2 exact --jobs 2
    python -m tests.studies.answered_again DIR blind_study_2 drawing --jobs 2
    python -m tests.studies.answered_again DIR blind_study_2 exact --every 5    # of five trials one
    python -m tests.studies.answered_again DIR blind_study_2           # the table
    python -m tests.studies.answered_again DIR blind_study_2 exact --every 24 --solver
    python -m tests.studies.answered_again DIR blind_study_2 exact --beside OTHER_DIR

Those tyres' sections are the case's own (`exact`); the second line answers as if they had been
taken from a drawing, the default, so that what this costs is seen. Effects are the ones that the
study's answers weighed; that tyres have one at most is told, as the rules tell it. DIR keeps what
was answered; the same command goes on from there. Each column is of the trials that both origins
answered, the recorded one, too. `--solver` answers with the solver, without an emulated model: some
12 s a trial. `--beside` compares two folders, which two commits answered, trial by trial.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import click

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.blind.answer import answer, case_of, rows_of, tyre_model
from tyrecal.studies.blind.protocol import ANSWERS, read_protocol
from tyrecal.studies.blind.score import Scored, score
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE

from ..blind.answers import one_answer
from ..blind.archive import STUDIES, unpack
from ..blind.emulated import emulate
from ..blind.study3.cases import further
from ..blind.tables import full_summary

ORIGINS = "exact", "drawing"
STATED = "section:\n", "section:\n  known_from: {}\n"
SHARES = {
    "false alarms": "false_alarms",
    "named verdicts that are right": "named_right",
    "outside: said so": "outside_recognised",
    "outside: named": "outside_named",
    "90 % set holds the truth": "set_holds_truth",
    "90 % interval holds the size": "interval_holds_parameter",
}


def weighed(answers: Path) -> list[str]:
    """Effects that the answers on record weighed."""
    keys: set[str] = set()
    for path in answers.glob("*.json"):
        probabilities = json.loads(path.read_text())["diagnosis"]["probabilities"]
        keys.update(id for key in probabilities for id in key.split("+"))
    return sorted(keys - {NONE, OUTSIDE})


def answered(
    study: str, folder: Path, origin: str, jobs: int, every: int, solver: bool = False
) -> str:
    """Answer what has no answer yet, of ``every`` so many trials by name one; the hash of all."""
    trials = folder / study / origin / "trials"
    marked = trials / "weighed.json"
    if not marked.exists():
        trials.parent.mkdir(parents=True, exist_ok=True)
        unpack(study, trials)
        marked.write_text(json.dumps(weighed(trials / "answers")))
        for path in (trials / "answers").glob("*.json"):
            path.unlink()
        for place, path in enumerate(sorted((trials / "trials").glob("*.csv"))):
            if place % every:
                path.unlink()
        case = trials / "case" / read_protocol(trials).case
        text = case.read_text()
        assert STATED[0] in text
        case.write_text(text.replace(STATED[0], STATED[1].format(origin), 1))
    case, protocol = case_of(trials), read_protocol(trials)
    evaluator = Evaluator(TyreDesign(case), store=Store((folder / "record").resolve()))
    model = tyre_model(case, evaluator, protocol, jobs, json.loads(marked.read_text()))
    on_progress = lambda done, all: print(f"{done} of {all}", file=sys.stderr, flush=True)
    one = partial(one_answer, further=further(protocol.counts))
    used = model if solver else emulate(model)
    return answer(trials, used, rows_of(case, protocol), jobs, on_progress, one)


def changes(first: Path, other: Path) -> str:
    """How the answers in two folders differ, of the trials that both have."""
    names = sorted({p.name for p in first.glob("*.json")} & {p.name for p in other.glob("*.json")})
    verdicts, effects, largest = [], [], (0.0, "", "")
    for name in names:
        one, two = (json.loads((each / name).read_text())["diagnosis"] for each in (first, other))
        trial = name.removesuffix(".json")
        if one["verdict"] != two["verdict"]:
            verdicts.append(f"{trial}: {one['verdict']}, {two['verdict']}")
        if one["effect"] != two["effect"]:
            effects.append(f"{trial}: {one['effect']}, {two['effect']}")
        p, q = one["probabilities"], two["probabilities"]
        for key in sorted({*p, *q}):
            largest = max(largest, (abs(p.get(key, 0.0) - q.get(key, 0.0)), key, trial))
    counts = f"{len(names)} trials, {len(verdicts)} other verdicts, {len(effects)} other effects"
    most = f"largest change of a probability {largest[0]:.3f} ({largest[1]}, {largest[2]})"
    return "\n".join([f"{counts}, {most}", *verdicts, *effects])


def compared(study: str, folder: Path) -> dict[str, list[Scored]]:
    """The answers on record and those of each origin, of the trials that all of these have."""
    recorded = folder / "recorded" / "trials"
    if not recorded.exists():
        unpack(study, recorded)
    sealed = recorded.with_name("trials-truth")
    by_origin = {"recorded": score(recorded, sealed)}
    for origin in ORIGINS:
        trials = folder / origin / "trials"
        if (trials / ANSWERS).exists():
            by_origin[origin] = score(trials, sealed)
    common = set.intersection(*({t.id for t in those} for those in by_origin.values()))
    return {name: [t for t in those if t.id in common] for name, those in by_origin.items()}


def figures(of: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Figures by which a study is judged, in words."""
    for band in of["by_band"][1:]:
        here = f"{band['low']:g} to {band['high']:g}" if band["high"] else f"{band['low']:g} on"
        yield f"top 1 by group, band {here}", _share(band["top_1_group"])
    for words, key in SHARES.items():
        if of[key]["count"]:
            yield words, _share(of[key])
    yield "mean probability on the true group", f"{of['mean_probability_on_group']:.2f}"
    error, chance = of["calibration_error"], of["calibration_error_95"]
    yield "calibration error (95 % of a calibrated answerer)", f"{error:.3f} ({chance:.3f})"
    held = of["held_out"]
    shrinks = f"{held['median_shrinkage']:.2f} ({held['placebo_95']:.2f})"
    yield "held-out error shrinks by, median (placebo)", shrinks


def _share(rate: dict[str, Any]) -> str:
    return f"{rate['right']} of {rate['count']}, {100 * rate['share']:.1f} %"


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.argument("study", type=click.Choice(STUDIES))
@click.argument("origin", type=click.Choice(ORIGINS), required=False)
@click.option("--jobs", default=1)
@click.option("--every", default=1)
@click.option("--solver", is_flag=True)
@click.option("--beside", type=click.Path(path_type=Path, exists=True))
def main(
    folder: Path,
    study: str,
    origin: str | None,
    jobs: int,
    every: int,
    solver: bool,
    beside: Path | None,
) -> None:
    """Answer, or tell the figures of what is answered beside those on record."""
    if origin and beside:
        place = Path(study, origin, "trials", "answers")
        print(changes(folder / place, beside / place))
        return
    if origin:
        print(answered(study, folder, origin, jobs, every, solver))
        return
    by_origin = compared(study, folder / study)
    columns = {name: dict(figures(full_summary(trials))) for name, trials in by_origin.items()}
    print(f"| {study} | {' | '.join(columns)} |\n{'|---' * (1 + len(columns))}|")
    for row in columns["recorded"]:
        print(f"| {row} | {' | '.join(each[row] for each in columns.values())} |")


if __name__ == "__main__":
    main()
