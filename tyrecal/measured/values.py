"""Single measured values, and what repeats make of them: a value with its standard deviation.

The value is the mean over n runs, and sigma that of the mean:

    sigma^2 = max( v / n, sum sigma_i^2 / n^2, (floor value)^2 ),
    v = (4 v_all + sum_i (x_i - mean x)^2) / (4 + n - 1)

sigma_i are what each run states itself, v_all the variance of one run (relative) pooled over all
labels: a variance from three runs is drawn towards it, as if it were known from four more. The
floor is for what repeats do not show: another bench, another day, the sensors' own mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..case.usual import LARGEST_SIGMA, MEASURED
from ..diagnose.measurements import COLUMNS, PRESSURES_kPa
from ..diagnose.observations import PRIOR_REPEATS
from ..errors import InputError
from ..modes.mode import Label

FLOOR = 0.001  # of the value
Key = tuple[str, Label | None, str, float, float]


@dataclass(frozen=True)
class Value:
    """One value of one run, in the unit of ``quantity``; member as in the measurements CSV;
    sigma: standard deviation, None where the run does not state it; place: file and line."""

    quantity: str
    label: Label | None
    member: str
    pressure_kPa: float
    load_N: float
    value: float
    sigma: float | None
    run: str
    place: str

    @property
    def key(self) -> Key:
        """What is measured."""
        return (self.quantity, self.label, self.member, self.pressure_kPa, self.load_N)


def implausible(value: Value) -> str | None:
    """A sentence, where no tyre has such a value."""
    if not value.value > 0:
        return f"{value.quantity} is {value.value:g}, must be greater than 0"
    if refusal := MEASURED[value.quantity].refusal(value.value):
        return f"{value.quantity} is {value.value:g}: no tyre has that, {refusal}"
    low, high = PRESSURES_kPa
    if value.quantity != "mass_kg" and not low <= value.pressure_kPa <= high:
        return (
            f"the pressure is {value.pressure_kPa:g} kPa, must be {low:g} to {high:g}; which unit?"
        )
    if value.sigma is not None and not value.sigma > 0:
        return f"sigma is {value.sigma:g}, must be greater than 0"
    return None


def combined(
    values: Sequence[Value], floor: float = FLOOR, assumed: float | None = None
) -> list[Value]:
    """One value a key, the mean of its runs, with the standard deviation of that mean.

    floor, assumed: relative; ``assumed`` is the standard deviation of one run that states none.
    Raises InputError where neither repeats nor anything else tell a standard deviation, or
    it is so large that no fit would read it.
    """
    groups: dict[Key, list[Value]] = {}
    for each in _one_for_both(values):
        groups.setdefault(each.key, []).append(each)
    pooled = {q: _pooled(groups, q) for q in {key[0] for key in groups}}
    rows = []
    for runs in groups.values():
        x = np.array([each.value for each in runs])
        mean, n = float(x.mean()), len(x)
        stated = [each.sigma or (assumed or 0.0) * each.value for each in runs]
        variances = [np.sum(np.square(stated)) / n**2]
        every = pooled[runs[0].quantity]
        if n > 1 and every is not None:
            own = np.sum((x - mean) ** 2)
            variances.append((PRIOR_REPEATS * every * mean**2 + own) / (PRIOR_REPEATS + n - 1) / n)
        if n == 1 and not stated[0]:
            raise InputError(
                f"{runs[0].place}: nothing tells how far {_name(runs[0])} may be off: give repeats,"
                " a column sigma, or --sigma-percent"
            )
        sigma = max(float(np.sqrt(max(variances))), floor * mean)
        if sigma > LARGEST_SIGMA * mean:
            raise InputError(
                f"{runs[0].place}: sigma of {_name(runs[0])} comes to {sigma:.3g}, more than"
                f" {LARGEST_SIGMA:.0%} of the value {mean:.4g}: is it a mistake, or another mode?"
            )
        rows.append(replace(runs[0], value=mean, sigma=sigma))
    return sorted(rows, key=_order)


def _pooled(groups: dict[Key, list[Value]], quantity: str) -> float | None:
    """Relative variance of one run, over all that was repeated; None where nothing was."""
    total, freedom = 0.0, 0
    for key, runs in groups.items():
        if key[0] == quantity and len(runs) > 1:
            x = np.array([each.value for each in runs])
            total += float(np.sum((x / x.mean() - 1) ** 2))
            freedom += len(x) - 1
    return total / freedom if freedom else None


def _one_for_both(values: Sequence[Value]) -> list[Value]:
    """The two members of a doublet as one, their mean, where some runs tell other members than
    others do."""
    places: dict[tuple[object, ...], dict[str, list[Value]]] = {}
    for each in values:
        place = (each.quantity, each.label, each.pressure_kPa, each.load_N)
        places.setdefault(place, {}).setdefault(each.run, []).append(each)
    result = []
    for runs in places.values():
        told = [{each.member for each in run} for run in runs.values()]
        for run in runs.values():
            if run[0].load_N or all(members == told[0] for members in told):
                result += run
            elif {each.member for each in run} == {"1", "2"}:
                mean = sum(each.value for each in run) / len(run)
                result.append(replace(run[0], value=mean, member="", sigma=run[0].sigma))
            else:
                result += [replace(each, member="") for each in run]
    return result


def measurements_csv(rows: Sequence[Value]) -> str:
    """The measurements CSV of ``rows``."""
    lines = [",".join(COLUMNS)]
    for row in rows:
        label = row.label
        cells = (
            row.quantity,
            "" if label is None else label.c,
            "" if label is None else label.m,
            (label.kind or "") if label else "",
            row.member,
            "" if row.quantity == "mass_kg" else f"{row.pressure_kPa:g}",
            f"{row.load_N:g}",
            f"{row.value:.6g}",
            f"{row.sigma:.3g}",
        )
        lines.append(",".join(map(str, cells)))
    return "\n".join(lines) + "\n"


def _name(value: Value) -> str:
    return value.label.said if value.label else value.quantity


def _order(row: Value) -> tuple[object, ...]:
    label = row.label or Label(99, 0)
    return (
        row.quantity != "frequency_Hz",
        row.quantity,
        row.pressure_kPa,
        row.load_N,
        label.c,
        label.m,
        label.kind or "",
        row.member,
    )
