"""Score of each blind trial: its answer against the truth, its difficulty, its held-out error.

The ruler is a record of sensitivities and effects that was made before the study; it gives the
difficulty of a trial without the diagnosis. Code of the diagnosis is not used here, except the
names of modes and the recorded form error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import log
from pathlib import Path

import numpy as np

from ...files import Json
from ...measured.measurement import Measurement
from ...measured.tables import read_measurements
from ...simulate.modes.label import Label
from .protocol import Protocol, read_json, read_protocol
from .ruler import Difficulty, Ruler, difficulty, read_ruler
from .seal import open_truth

Array = np.ndarray


@dataclass(frozen=True)
class Scored:
    """One trial: the truth, the answer, and how they compare."""

    id: str
    kind: str  # "effect", "none" or "outside"
    law: str  # id of the true effect, or name of the family outside the catalogue, "" for none
    size: float  # true parameter, in the unit of the effect
    swapped: bool  # whether two labels were exchanged in the measurements
    # keys that count as right: the true one, "none", "outside" or an id, and effects that look the
    # same
    group: tuple[str, ...]
    lam: float  # detectability lambda, 0 without an effect
    # min(lambda, min_j delta_j^2), 0 without an effect; delta_j: distance from effect j (`ruler`)
    band: float
    verdict: str  # `VerdictKind` of the answer
    named: str | None  # key of the effects that it names; None: it names none
    probabilities: dict[str, float]  # by key, 1 together
    in_set: bool  # whether ``truth`` is one of the answer's candidates
    # whether the interval of the named parameter holds `Difficulty.equivalent`, the catalogue's
    # parameter that is closest to the true effect; None: the true effect is not named
    parameter_held: bool | None
    # rms error of held-out values in ln f, without and with the named effect
    before: float
    after: float

    @property
    def truth(self) -> str:
        """The true key."""
        return self.group[0]

    @property
    def ranked(self) -> list[str]:
        """Keys by falling probability."""
        return sorted(self.probabilities, key=lambda key: -self.probabilities[key])

    @property
    def right(self) -> bool:
        """Whether the likeliest key is in the true group."""
        return self.ranked[0] in self.group

    @property
    def shrinkage(self) -> float:
        """Reduction of the held-out error, 1 - after / before."""
        return 1 - self.after / self.before

    def plain(self) -> Json:
        """The trial as plain data for JSON."""
        kept = {key: value for key, value in asdict(self).items() if key != "probabilities"}
        return kept | {"truth": self.truth, "top": self.ranked[:3], "band": min(self.band, 1e9)}


def score(folder: Path, sealed: Path) -> list[Scored]:
    """Scores of all trials of a study. Raises InputError."""
    truths = open_truth(folder, sealed)["trials"]
    protocol, ruler = read_protocol(folder), read_ruler(folder)
    return [
        scored(
            truth,
            read_json(path),
            read_measurements(folder / "trials" / f"{path.stem}.csv"),
            ruler,
            protocol,
        )
        for truth in truths
        if (path := folder / "answers" / f"{truth['id']}.json").exists()
    ]


def scored(
    truth: Json, answer: Json, readings: Sequence[Measurement], ruler: Ruler, protocol: Protocol
) -> Scored:
    """Score of one trial; truth: its entry in truth.json (`make.sealed_trial`)."""
    _, places, counts = means(readings, ruler)
    d = np.array([log(v) for v in truth["variables"].values()]) - ruler.x0
    key = truth["law"] if truth["kind"] == "effect" else truth["kind"]
    rated = Difficulty(0.0, 0.0, (key,), None)
    if truth["kind"] != "none":
        moved = true_shift(truth, ruler, places)
        rated = difficulty(ruler, protocol, truth["law"], d, places, counts, moved)
    group = rated.group if truth["kind"] == "effect" else (key,)
    diagnosis = answer["diagnosis"]
    named, held = diagnosis["effect"], None
    if truth["kind"] == "effect" and named == key and rated.equivalent is not None:
        held = diagnosis["parameter"]["low"] <= rated.equivalent <= diagnosis["parameter"]["high"]
    out = answer["held_out"]
    return Scored(
        truth["id"],
        truth["kind"],
        truth["law"],
        truth["size"],
        truth["swapped"],
        group,
        rated.lam,
        rated.band,
        diagnosis["verdict"],
        named,
        diagnosis["probabilities"],
        key in diagnosis["candidate_set"],
        held,
        held_out_error(truth["held_out"], out["plain_Hz"]),
        held_out_error(truth["held_out"], out["with_effect_Hz"] or out["plain_Hz"]),
    )


def means(readings: Sequence[Measurement], ruler: Ruler) -> tuple[Array, Array, Array]:
    """Per row, (n,) each: mean of ln f, or ln mass, over its members, index in the ruler, number of
    members."""
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


def true_shift(truth: Json, ruler: Ruler, places: Array) -> tuple[Array, Array]:
    """Shift of ln f by the true effect (n,), and by how much it moves pairs apart (n,), from the
    maker's runs without noise."""

    def pairs(entries: Sequence[Json]) -> Array:
        at = {entry["pressure_kPa"]: entry["ln_f"] for entry in entries}
        mass = [entries[0]["ln_mass"]] * 2
        rows = [ruler.rows[i] for i in places]
        return np.array([at[state][str(label)] if label else mass for label, state in rows])

    after, before = pairs(truth["with_effect"]), pairs(truth["without"])
    return after.mean(1) - before.mean(1), (np.diff(after) - np.diff(before))[:, 0]


def held_out_error(
    measured: Mapping[str, Sequence[float]], predicted: Mapping[str, float]
) -> float:
    """Root mean square of ln measured (mean of members) - ln predicted."""
    errors = [
        np.mean(np.log(values)) - log(predicted[name])
        for name, values in measured.items()
        if values and name in predicted
    ]
    return float(np.sqrt(np.mean(np.square(errors))))
