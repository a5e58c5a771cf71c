"""Score of each blind trial: its answer against the truth, its difficulty, its held-out error.

The ruler is a record of sensitivities and effects that was made before the study; it gives the
difficulty of a trial without the diagnosis. Code of the diagnosis is not used here, except the
names of modes and the recorded form error.

`summary` has the figures of all trials: rates with exact bounds, held-out errors, every miss, and
the calibration of stated probabilities with its measure by chance alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import log
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from ...files import Json
from ...measured.measurement import Measurement
from ...measured.tables import read_measurements
from ...simulate.modes.label import Label
from .protocol import Protocol, open_truth, read_json, read_protocol
from .ruler import Difficulty, Ruler, difficulty, read_ruler

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
    trials = []
    for truth in truths:
        path = folder / "answers" / f"{truth['id']}.json"
        if path.exists():
            readings = read_measurements(folder / "trials" / f"{path.stem}.csv")
            trials.append(scored(truth, read_json(path), readings, ruler, protocol))
    return trials


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


BINS, SIMULATIONS = 10, 2000  # of stated probabilities, 0 to 1; draws of the quantile


def clopper_pearson(right: int, count: int) -> tuple[float, float]:
    """Exact 95 % interval of a binomial share (Clopper and Pearson 1934); (0, 1) of none."""
    if not count:
        return 0.0, 1.0
    interval = binomtest(right, count).proportion_ci(0.95)
    return float(interval.low), float(interval.high)


def calibration_error(stated: Array, right: Array) -> float:
    """ECE: mean over trials of |share right - mean stated| in ten bins of what was stated."""
    return float(_calibration_errors(stated, right[None])[0])


def _calibration_errors(stated: Array, right: Array) -> Array:
    """ECE (k,) of each row of ``right`` (k, n), trials of one and the same ``stated`` (n,)."""
    place = np.minimum((stated * BINS).astype(int), BINS - 1)
    in_bin = (place[:, None] == np.arange(BINS)).astype(float)
    return np.asarray(abs((right - stated) @ in_bin).sum(1) / max(len(stated), 1))


def calibration_quantile(stated: Array, quantile: float = 0.95) -> float:
    """Quantile of the ECE of as many trials whose stated probabilities are exactly right."""
    random = np.random.default_rng(0)
    drawn = random.random((SIMULATIONS, len(stated))) < stated
    return float(np.quantile(_calibration_errors(stated, drawn), quantile))


# ranges of `Scored.band`, and of lambda
DIFFICULTY_BANDS = ((0.0, 4.0), (4.0, 10.0), (10.0, 25.0), (25.0, float("inf")))
DETECTED = 10.0  # band from which an effect counts as detectable


def summary(trials: Sequence[Scored]) -> Json:
    """All figures, as plain data; a rate is {"right", "count", "share", "low", "high"}."""
    effects = [t for t in trials if t.kind == "effect"]
    none = [t for t in trials if t.kind == "none"]
    outside = [t for t in trials if t.kind == "outside"]
    named = [t for t in trials if t.verdict == "named"]

    stated = np.array([t.probabilities[t.ranked[0]] for t in trials])
    right = np.array([t.ranked[0] == t.truth for t in trials], float)
    # held-out shrinkage where there is no effect, by chance
    placebo = float(np.quantile([t.shrinkage for t in none], 0.95)) if none else None
    held = [t.parameter_held for t in trials if t.parameter_held is not None]
    proven = [t for t in effects if t.band >= DETECTED and t.verdict == "named"]
    shrinks = [t.shrinkage for t in proven]
    return {
        "trials": {"effect": len(effects), "none": len(none), "outside": len(outside)},
        "swapped": sum(t.swapped for t in trials),
        "by_band": [
            {"low": low, "high": high if high < 1e9 else None, **_band(effects, low, high)}
            for low, high in DIFFICULTY_BANDS
        ],
        "false_alarms": rate([t.verdict == "named" for t in none]),
        "named_right": rate([t.named in t.group for t in named]),
        "outside_recognised": rate([t.verdict == "outside" for t in outside]),
        "outside_named": rate([t.verdict == "named" for t in outside]),
        "calibration_error": calibration_error(stated, right),
        "calibration_error_95": calibration_quantile(stated),
        "set_holds_truth": rate([t.in_set for t in trials]),
        "interval_holds_parameter": rate(held),
        "held_out": {
            "count": len(proven),
            "median_shrinkage": float(np.median(shrinks)) if proven else None,
            "placebo_95": placebo,
            "beyond_placebo": rate([shrink > (placebo or 0.0) for shrink in shrinks]),
        },
        "misses": [
            t.plain()
            for t in trials
            if not t.right or (t.verdict == "named" and t.named not in t.group)
        ],
    }


def rate(hits: Sequence[bool]) -> Json:
    """A share with its exact 95 % bounds."""
    right, count = sum(hits), len(hits)
    low, high = clopper_pearson(right, count)
    share = right / count if count else None
    return {"right": right, "count": count, "share": share, "low": low, "high": high}


def _band(effects: Sequence[Scored], low: float, high: float) -> Json:
    """Rates of right first and second answers among the effects of one band of difficulty."""
    here = [t for t in effects if low <= t.band < high]
    return {
        "top_1_group": rate([t.right for t in here]),
        "top_1": rate([t.ranked[0] == t.truth for t in here]),
        "top_2_group": rate([bool(set(t.ranked[:2]) & set(t.group)) for t in here]),
    }
