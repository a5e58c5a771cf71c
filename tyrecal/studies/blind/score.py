"""Answers against the truth, trial by trial: difficulty by the ruler, right or wrong, held out.

Nothing here is shared with the diagnosis but the names of modes and the form error on record.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from ...measured.measurement import Measurement
from ...measured.tables import read_measurements
from ...simulate.modes.label import Label
from .answer import case_of
from .baselines import guesses
from .make import labels_of
from .protocol import Protocol, read_json, read_protocol
from .ruler import Difficulty, Ruler, difficulty, read_ruler
from .seal import open_truth

Array = np.ndarray


@dataclass(frozen=True)
class Scored:
    """A trial, its answer next to the truth."""

    id: str
    kind: str
    law: str
    size: float
    swapped: bool
    truth: str  # the true key: "none", "outside" or an id
    group: tuple[str, ...]  # keys that count as right
    lam: float  # lambda, 0 without an effect
    band: float  # min(lambda, min_j delta_j^2), likewise
    verdict: str
    named: str | None
    ranked: tuple[str, ...]  # keys by falling probability
    probabilities: dict[str, float]
    on_truth: float  # probability
    on_group: float
    in_set: bool
    parameter_held: bool | None  # whether its interval holds the equivalent one; None: not named
    before: float  # rms error held out, in ln f
    after: float
    baselines: dict[str, str]

    @property
    def right(self) -> bool:
        """The likeliest answer is of the true group."""
        return self.ranked[0] in self.group

    @property
    def shrinkage(self) -> float:
        """1 - after / before."""
        return 1 - self.after / self.before

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        kept = {k: v for k, v in asdict(self).items() if k not in ("probabilities", "ranked")}
        kept["top"] = list(self.ranked[:3])
        kept["band"] = min(self.band, 1e9)
        return kept


def score(folder: Path, sealed: Path) -> list[Scored]:
    """Every trial, scored. Raises InputError."""
    return rescored(folder, sealed, sorted((folder / "answers").glob("*.json")))


def rescored(folder: Path, sealed: Path, answers: Sequence[Path]) -> list[Scored]:
    """Other answers, to some of the trials of a folder whose own are sealed. Raises InputError."""
    content, answered = open_truth(folder, sealed), {path.stem: path for path in answers}
    protocol = read_protocol(folder)
    labels = labels_of(case_of(folder))
    ruler = read_ruler(folder, labels)
    return [
        scored(
            truth,
            read_json(answered[truth["id"]]),
            read_measurements(folder / "trials" / f"{truth['id']}.csv"),
            ruler,
            protocol,
            labels,
        )
        for truth in content["trials"]
        if truth["id"] in answered
    ]


def scored(
    truth: Mapping[str, Any],
    answer: Mapping[str, Any],
    readings: Sequence[Measurement],
    ruler: Ruler,
    protocol: Protocol,
    labels: Sequence[Label],
) -> Scored:
    """One trial."""
    y, places, counts = means(readings, ruler)
    d = np.array([log(v) for v in truth["variables"].values()]) - ruler.x0
    key = truth["law"] if truth["kind"] == "effect" else truth["kind"]
    hard = Difficulty(0.0, 0.0, (key,), None)
    if truth["kind"] != "none":
        shift, split = true_shift(truth, ruler, places, labels)
        hard = difficulty(ruler, protocol, truth["law"], d, places, counts, shift, split)
    group = hard.group if truth["kind"] == "effect" else (key,)
    diagnosis = answer["diagnosis"]
    p = diagnosis["probabilities"]
    named, held = diagnosis["effect"], None
    if truth["kind"] == "effect" and named == key and hard.equivalent is not None:
        held = diagnosis["parameter"]["low"] <= hard.equivalent <= diagnosis["parameter"]["high"]
    out = answer["held_out"]
    sigma = ruler.sigma(places, counts, protocol, constants=False)
    return Scored(
        truth["id"],
        truth["kind"],
        truth["law"],
        truth["size"],
        truth["swapped"],
        key,
        group,
        hard.lam,
        hard.band,
        diagnosis["verdict"],
        named,
        tuple(sorted(p, key=lambda k: -p[k])),
        p,
        p.get(key, 0.0),
        sum(p.get(k, 0.0) for k in group),
        key in diagnosis["candidate_set"],
        held,
        held_out_error(truth["held_out"], out["plain_Hz"]),
        held_out_error(truth["held_out"], out["with_effect_Hz"] or out["plain_Hz"]),
        guesses(ruler, y, places, sigma),
    )


def means(readings: Sequence[Measurement], ruler: Ruler) -> tuple[Array, Array, Array]:
    """ln of each row's mean of members (n,), its place in the ruler (n,), number of values (n,)."""
    logarithms: dict[tuple[Label | None, float], list[float]] = {}
    for each in readings:
        pressure = each.pressure_kPa if each.label else 0.0
        logarithms.setdefault((each.label, pressure), []).append(log(each.value))
    place = {row: i for i, row in enumerate(ruler.rows)}
    return (
        np.array([np.mean(values) for values in logarithms.values()]),
        np.array([place[row] for row in logarithms]),
        np.array([len(values) for values in logarithms.values()]),
    )


def true_shift(
    truth: Mapping[str, Any], ruler: Ruler, places: Array, labels: Sequence[Label]
) -> tuple[Array, Array]:
    """Shift of the effect (n,), and how far it splits pairs (n,), from runs without noise."""
    names = {str(label) for label in labels}
    tables: list[dict[tuple[str, float], list[float]]] = []
    for key in ("with_effect", "without"):
        tables.append({("None", 0.0): [truth[key][0]["ln_mass"]] * 2})
        for entry in truth[key]:
            for name in names:
                tables[-1][name, entry["pressure_kPa"]] = entry["ln_f"][name]
    rows = [(str(ruler.rows[i][0]), ruler.rows[i][1]) for i in places]
    after, before = (np.array([table[row] for row in rows]) for table in tables)
    apart = [pairs[:, 1] - pairs[:, 0] for pairs in (after, before)]
    return after.mean(1) - before.mean(1), apart[0] - apart[1]


def held_out_error(
    measured: Mapping[str, Sequence[float]], predicted: Mapping[str, float]
) -> float:
    """RMS of ln measured (mean of members) - ln predicted."""
    errors = [
        np.mean(np.log(values)) - log(predicted[name])
        for name, values in measured.items()
        if values and name in predicted
    ]
    return float(np.sqrt(np.mean(np.square(errors))))
