"""The recorded blind studies, of tyres with one effect at most, under today's prior and rule of
several: probabilities of the answers on record weighed anew, and what would then be named.

    python -m tests.studies.several_recorded
    python -m tests.studies.several_recorded --further 0.1

From what the answers hold: triples and two effects asked together are not in it, nor what the case
states as uncertain. Not blind: the truth was opened long before.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import click
import numpy as np

from tyrecal.studies.blind.score import Scored, calibration_error, score
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE
from tyrecal.studies.diagnose.several import priors
from tyrecal.studies.diagnose.verdict import CHECK, RULED_OUT, SET, most_sure
from tyrecal.studies.inference.inverse_problem import Assumed

from ..blind.archive import STUDIES, unpack
from ..blind.tables import on_group

SINGLES, PAIRS, EFFECTS = 0.62, 0.03, 20  # together, when the answers were given; considered


def again(trial: Scored, check: float, singles: float, pairs: float) -> Scored:
    """The trial with singles and pairs that much likelier before the data, and today's rule."""
    odds = {NONE: 1.0, OUTSIDE: 1.0}
    of = lambda key: odds.get(key, pairs if "+" in key else singles)
    stated = {NONE: 0.0, OUTSIDE: 0.0, **trial.probabilities}  # packed without zeros
    weight = {key: p * of(key) for key, p in stated.items()}
    total = sum(weight.values())
    p = {key: each / total for key, each in weight.items()}
    ranked = tuple(sorted(p, key=lambda key: -p[key]))
    sure = most_sure(p)
    named = sure if sure and check > CHECK and p[NONE] < RULED_OUT else None
    outside = p[NONE] < RULED_OUT and (p[OUTSIDE] >= 0.5 or (sure and check <= CHECK))
    kept = ranked[: int(np.searchsorted(np.cumsum([p[key] for key in ranked]), SET)) + 1]
    return replace(
        trial,
        probabilities=p,
        named=named,
        verdict="named" if named else "outside" if outside else "other",
        in_set=trial.truth in kept,
    )


def figures(trials: list[Scored]) -> dict[str, str]:
    """Figures that the tables of the studies show."""
    share = lambda hits: f"{sum(hits)} of {len(hits)}"
    by = lambda low, high: [t for t in trials if t.kind == "effect" and low <= t.band < high]
    of = lambda kind: [t for t in trials if t.kind == kind]
    named = [t for t in trials if t.named]
    seen = by(10, np.inf)
    mean = np.mean([on_group(t) for t in seen])
    stated = np.array([t.probabilities[t.ranked[0]] for t in trials])
    right = np.array([t.ranked[0] == t.truth for t in trials], float)
    return {
        "top 1 by group, band 25 on": share([t.right for t in by(25, np.inf)]),
        "top 1 by group, 10 to 25": share([t.right for t in by(10, 25)]),
        "top 1 by group, 4 to 10": share([t.right for t in by(4, 10)]),
        "named, band from 10": share([bool(t.named) for t in seen]),
        "named verdicts right": share([t.named in t.group for t in named]),
        "false alarms": share([bool(t.named) for t in of("none")]),
        "outside said so": share([t.verdict == "outside" for t in of("outside")]),
        "outside named": share([bool(t.named) for t in of("outside")]),
        "90 % set holds the truth": share([t.in_set for t in trials]),
        "mean probability on the true group, band from 10": f"{mean:.3f}",
        "calibration error": f"{calibration_error(stated, right):.3f}",
    }


@click.command()
@click.option("--further", default=Assumed().further, show_default=True)
def main(further: float) -> None:
    """Score the three studies three ways."""
    prior = priors(EFFECTS, further)
    singles = EFFECTS * prior[1] / SINGLES
    pairs = EFFECTS * (EFFECTS - 1) / 2 * prior[2] / PAIRS
    for study in STUDIES:
        with TemporaryDirectory() as place:
            folder = Path(place) / "trials"
            unpack(study, folder)
            recorded = score(folder, folder.with_name("trials-truth"))
            diagnoses = {
                t.id: json.loads((folder / "answers" / f"{t.id}.json").read_text())["diagnosis"]
                for t in recorded
            }
        checks = {id: each["fit_p_value"] for id, each in diagnoses.items()}
        ways = [
            recorded,
            [again(t, checks[t.id], 1.0, 1.0) for t in recorded],
            [again(t, checks[t.id], singles, pairs) for t in recorded],
        ]
        print(f"| {study} | recorded | today's rule | today's rule and prior |")
        print("|---|---|---|---|")
        for row in zip(*(figures(way).items() for way in ways), strict=True):
            print(f"| {row[0][0]} | {' | '.join(value for _, value in row)} |", flush=True)


if __name__ == "__main__":
    main()
