"""Measurements of one tyre as vectors: logarithms, their scatter, and the splits of pairs.

A pair f_a, f_b becomes mu = (ln f_a + ln f_b)/2 with variance (s_a^2 + s_b^2)/4 and the split
s = |ln f_a - ln f_b|, whose scatter is tau^2 = s_a^2 + s_b^2; s_a, s_b are relative.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import isnan
from pathlib import Path

import numpy as np

from ...measured.measurement import DAMPING_RATIO, DAMPING_SIGMA, Measurement
from ...measured.repeats import PRIOR_REPEATS, mean_damping
from ...simulate.modes.label import Label
from ...tyre.case.parts import RimSupport
from ...tyre.state import TyreState
from .model import ModelRow, state_of

Array = np.ndarray
ObservationKey = tuple[str, Label | None, float, RimSupport | None]


@dataclass(frozen=True)
class Observable:
    """Identity of one row of the observations: quantity, mode, state and run."""

    quantity: str
    label: Label | None  # of the mode; None: the mass
    pressure_kPa: float  # 0 for the mass
    run: int = 0  # 0: the tyre as it is; 1, 2, ...: toggled runs, in which one thing was switched
    rim: RimSupport | None = None  # None: as the case has it

    def __str__(self) -> str:
        if not self.label:
            return "mass"
        return f"{self.label} at {self.pressure_kPa:g} kPa" + f", rim {self.rim}" * bool(self.rim)

    @classmethod
    def of(cls, row: ModelRow) -> Observable:
        """The observable of a row of the model."""
        label, state = row[0], state_of(row[1])
        quantity = "frequency_Hz" if label else "mass_kg"
        return cls(quantity, label, state.pressure_kPa or 0.0, rim=state.rim)

    @property
    def state(self) -> TyreState:
        """State of the tyre when it is measured."""
        return TyreState(self.pressure_kPa, 0.0, self.rim)

    @property
    def row(self) -> ModelRow:
        """Row of the model that predicts it: label, and the pressure (kPa) or, on another rim than
        the case's, the whole state."""
        return self.label, self.state if self.rim else self.pressure_kPa


@dataclass(frozen=True)
class DampingRatios:
    """The m damping ratios that were measured on the tyre as it is, means over repeats."""

    rows: tuple[Observable, ...] = ()
    y: Array = field(default_factory=lambda: np.zeros(0))  # (m,) ln of the damping ratio
    scatter: Array = field(default_factory=lambda: np.zeros(0))  # (m,) standard deviation of y


@dataclass(frozen=True)
class Observations:
    """The n frequencies and masses that were measured on one tyre."""

    rows: tuple[Observable, ...]
    y: Array  # (n,) ln value, of a pair the mean of those measured
    scatter: Array  # (n,) standard deviation of y by repeatability, without ``common``
    # standard deviation of the mean, over the repeats, of a shift that all frequencies of one run
    # share, in addition to scatter
    common: float
    split: Array  # (n,) distance of the two modes of a pair in ln f; NaN unless both were measured
    split_scatter: Array  # (n,) its standard deviation
    left_out: tuple[str, ...] = ()  # sentences about measurements that are not used
    damping: DampingRatios = DampingRatios()  # of the same modes

    def at(self, places: Array) -> Observations:
        """The numbers at these indices; ``rows`` stays."""
        names = ("y", "scatter", "split", "split_scatter")
        return replace(self, **{name: getattr(self, name)[places] for name in names})

    def only(self, keep: Array) -> Observations:
        """The rows of a mask (n,) alone."""
        rows = tuple(row for row, k in zip(self.rows, keep, strict=True) if k)
        return replace(self.at(keep), rows=rows)


def observe(
    readings: Sequence[Measurement],
    repeats: Sequence[Sequence[Measurement]] = (),
    toggled: Sequence[Sequence[Measurement]] = (),
    split: float = 0.0,
) -> Observations:
    """Observations of a tyre from its measurements.

    repeats: the same measurements after mounting the tyre again; their mean is used, and their
    scatter replaces the stated sigma. toggled: measurements of runs 1, 2, ... split: relative
    distance of the modes of a pair by non-uniformity; if only one was measured, it is off by half
    of that. Values under load are not used; `under_load` compares those of ``readings``.
    """
    left_out: list[str] = []
    unloaded = [[r for r in run if not r.load_N] for run in (readings, *repeats)]
    used = [_used(run, left_out) for run in (*unloaded, *toggled)]
    left_out += _unrepeated(used[: 1 + len(repeats)])
    scattered, common = _scatter(used[: 1 + len(repeats)])
    runs = [scattered, *(_stated(run) for run in used[1 + len(repeats) :])]
    rows, numbers = [], []
    for index, run in enumerate(runs):
        for key in sorted({key[:4] for key in run}, key=_order):
            rows.append(Observable(key[0], key[1], key[2], index, key[3]))
            numbers.append(_pair(run, key, split))
    table = np.array(numbers, float).reshape(-1, 4).T
    damping = _damping([r for run in unloaded for r in run])
    return Observations(
        tuple(rows), table[0], table[1], common, table[2], table[3], tuple(left_out), damping
    )


def _damping(readings: Sequence[Measurement]) -> DampingRatios:
    """Damping ratios that came with frequencies: means over repeats and the modes of a pair."""
    by_mode: dict[ObservationKey, list[Measurement]] = {}
    for each in readings:
        if each.label and not isnan(each.damping_ratio):
            key: ObservationKey = (DAMPING_RATIO, each.label, each.pressure_kPa, each.rim)
            by_mode.setdefault(key, []).append(each)
    keys = sorted(by_mode, key=_order)
    y, scatter = np.zeros((2, len(keys)))
    for i, key in enumerate(keys):
        mean = mean_damping(by_mode[key])
        y[i] = np.log(mean["damping_ratio"])
        scatter[i] = mean["damping_sigma"] / mean["damping_ratio"]
        if isnan(scatter[i]):
            scatter[i] = DAMPING_SIGMA / np.sqrt(len(by_mode[key]))
    return DampingRatios(tuple(Observable(*key[:3], rim=key[3]) for key in keys), y, scatter)


def _used(run: Sequence[Measurement], left_out: list[str]) -> dict[tuple[str, ...], Measurement]:
    """Readings by (quantity, label, pressure, rim, member); of two members, 1 is the lower."""
    by_key: dict[tuple, Measurement] = {}
    for each in run:
        if each.load_N or each.quantity not in ("frequency_Hz", "mass_kg"):
            what = f"{each.label} under load" if each.load_N and each.label else each.quantity
            left_out.append(f"{Path(each.place).name}, {what}: not used by the diagnosis")
            continue
        pressure = each.pressure_kPa if each.label else 0.0
        by_key[each.quantity, each.label, pressure, each.rim, each.member] = each
    for key in [key for key in by_key if key[4] == "1"]:
        twin = (*key[:4], "2")
        if twin in by_key and by_key[twin].value < by_key[key].value:
            by_key[key], by_key[twin] = by_key[twin], by_key[key]
    return by_key


def _unrepeated(runs: Sequence[dict]) -> Iterator[str]:
    """Sentences about repeats that `_scatter` cannot use, because a value is not in every file."""
    keys = dict.fromkeys(key for run in runs for key in run)
    some = [key for key in keys if not all(key in run for run in runs)]
    first, later = [k for k in some if k in runs[0]], [k for k in some if k not in runs[0]]
    if first:
        yield f"repeats of {_names(first)}: not in every file, the first one's value and sigma hold"
    if later:
        yield f"{_names(later)}: in repeats only"
    if len(runs) > 1 and len(keys) - len(some) < 2:
        yield "all repeats: fewer than two values are in every file"


def _names(keys: Sequence[ObservationKey]) -> str:
    return ", ".join(dict.fromkeys(str(Observable(*key[:3], rim=key[3])) for key in keys))


def _stated(run: dict) -> dict:
    """ln value and relative sigma by key, as stated."""
    return {key: (np.log(each.value), each.sigma / each.value) for key, each in run.items()}


def _scatter(runs: Sequence[dict]) -> tuple[dict, float]:
    """Mean over repeats and its standard deviation by key, and that of the shift of a whole run.

    Two-way analysis of variance: y_ik = m_i + b_k + e_ik, values i, runs k. With few repeats, var e
    of one value is uncertain, so the variance of all values counts as `PRIOR_REPEATS` more repeats.
    """
    stated = [_stated(run) for run in runs]
    keys = [key for key in stated[0] if key[0] == "frequency_Hz" and all(key in s for s in stated)]
    if len(runs) < 2 or len(keys) < 2:
        return stated[0], 0.0
    y = np.array([[s[key][0] for s in stated] for key in keys])
    count, freedom = len(runs), len(runs) - 1
    off = y - y.mean(1, keepdims=True)
    shift = off.mean(0)
    rest = ((off - shift) ** 2).sum(1)
    pooled = rest.sum() / (freedom * (len(keys) - 1))
    each = (PRIOR_REPEATS * pooled + rest) / (PRIOR_REPEATS + freedom)
    common = max(0.0, (shift**2).sum() / freedom - pooled / len(keys))
    result = dict(stated[0])
    for key, mean, variance in zip(keys, y.mean(1), each, strict=True):
        result[key] = mean, float(np.sqrt(variance / count))
    return result, float(np.sqrt(common / count))


def _pair(run: dict, key: ObservationKey, split: float) -> tuple[float, float, float, float]:
    """y, its scatter, the split and its scatter, from one value or from the two of a pair."""
    if (*key, "") in run:
        return (*run[(*key, "")], np.nan, np.nan)
    members = [run[(*key, m)] for m in "12" if (*key, m) in run]
    if len(members) == 1:
        return (members[0][0], float(np.hypot(members[0][1], split / 2)), np.nan, np.nan)
    (a, sa), (b, sb) = members
    tau = float(np.hypot(sa, sb))
    return (a + b) / 2, tau / 2, abs(a - b), tau


def _order(key: ObservationKey) -> tuple:
    """Key that sorts by pressure, so that the mass is first, then by rim and mode."""
    label = key[1]
    mode = (label.c, label.m, label.kind or "") if label else ()
    return (key[2], key[3] or "", label is None, mode)
