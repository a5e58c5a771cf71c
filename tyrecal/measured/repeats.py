"""Combination of repeated single values: their mean with its standard deviation.

The value is the mean over n runs, and sigma that of the mean:

    sigma^2 = max( v / n, sum sigma_i^2 / n^2, (floor value)^2 ),
    v = (4 v_all (mean x)^2 + sum_i (x_i - mean x)^2) / (4 + n - 1)

sigma_i: standard deviations that the runs state. v_all: relative variance of one run, pooled over
all values of a quantity; it is assumed to count like four more repeats of each. The floor is for
scatter that repeats do not show: another bench, another day, the mass of the sensors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, isnan, nan
from typing import Any

import numpy as np

from ..errors import InputError
from ..simulate.modes.label import Label
from ..tyre.usual import MAX_SIGMA
from .measurement import Measurement

FLOOR = 0.001  # of the value
PRIOR_REPEATS = 4.0  # number of repeats of one value that the pooled variance counts as


def combined(
    values: Sequence[Measurement], floor: float = FLOOR, assumed: float = 0.0
) -> list[Measurement]:
    """One value for each quantity, label, member and state, the mean of its runs, with the
    standard deviation of that mean.

    floor, assumed: relative; ``assumed`` is the standard deviation of one run that states none.
    Raises InputError where neither repeats nor anything else tell a standard deviation, or
    it is so large that no fit would read it.
    """
    groups: dict[object, list[Measurement]] = {}
    for each in one_for_both(values):
        own_place = each.place if each.is_unlabelled else ""  # it is no repeat of any other
        groups.setdefault((each.key, own_place), []).append(each)
    pooled = {q: _pooled(groups, q) for q in {runs[0].quantity for runs in groups.values()}}
    rows = []
    for runs in groups.values():
        x = np.array([each.value for each in runs])
        mean, n = float(x.mean()), len(x)
        stated = [assumed * each.value if isnan(each.sigma) else each.sigma for each in runs]
        variances = [np.sum(np.square(stated)) / n**2]
        every = pooled[runs[0].quantity]
        if n > 1 and every is not None:
            own = np.sum((x - mean) ** 2)
            variances.append((PRIOR_REPEATS * every * mean**2 + own) / (PRIOR_REPEATS + n - 1) / n)
        if n == 1 and not stated[0]:
            raise InputError(
                f"{runs[0].place}: nothing states how far {runs[0].name} may be off: give repeats,"
                " a column sigma, or --sigma-percent"
            )
        sigma = max(float(np.sqrt(max(variances))), floor * mean)
        if sigma > MAX_SIGMA * mean:
            raise InputError(
                f"{runs[0].place}: sigma of {runs[0].name} is {sigma:.3g}, more than"
                f" {100 * MAX_SIGMA:.0f} % of the value {mean:.4g}: is it a mistake, or another"
                " mode?"
            )
        rows.append(replace(runs[0], value=mean, sigma=sigma, **mean_damping(runs)))
    return sorted(rows, key=_order)


def mean_damping(values: Sequence[Measurement]) -> dict[str, Any]:
    """``damping_ratio``, the mean of those that are stated, and its ``damping_sigma``; NaN where
    none is stated."""
    stated = [each for each in values if not isnan(each.damping_ratio)]
    if not stated:
        return {"damping_ratio": nan, "damping_sigma": nan}
    mean = sum(each.damping_ratio for each in stated) / len(stated)
    return {
        "damping_ratio": mean,
        "damping_sigma": hypot(*(each.damping_sigma for each in stated)) / len(stated),
    }


def _pooled(groups: dict[object, list[Measurement]], quantity: str) -> float | None:
    """Relative variance of one run, pooled over all repeated values; None without repeats."""
    total, freedom = 0.0, 0
    for runs in groups.values():
        if runs[0].quantity == quantity and len(runs) > 1:
            x = np.array([each.value for each in runs])
            total += float(np.sum((x / x.mean() - 1) ** 2))
            freedom += len(x) - 1
    return total / freedom if freedom else None


def one_for_both(values: Sequence[Measurement]) -> list[Measurement]:
    """The values, with the two members of a doublet averaged where not all runs measured the same
    members. The mean keeps the first one's sigma, and a member alone stands for both; values under
    load stay as they are."""
    places: dict[tuple[object, ...], dict[str, list[Measurement]]] = {}
    for each in values:
        place = (each.quantity, each.label, each.state)
        places.setdefault(place, {}).setdefault(each.run, []).append(each)
    result = []
    for runs in places.values():
        per_run = [{each.member for each in run} for run in runs.values()]
        for run in runs.values():
            if run[0].load_N or all(members == per_run[0] for members in per_run):
                result += run
            elif {each.member for each in run} == {"1", "2"}:
                mean = sum(each.value for each in run) / len(run)
                result.append(replace(run[0], value=mean, member="", **mean_damping(run)))
            else:
                result += [replace(each, member="") for each in run]
    return result


def _order(row: Measurement) -> tuple[object, ...]:
    """Key that sorts frequencies first, by state, then by mode."""
    label = row.label or Label(99, 0)  # those without a label last
    mode = (label.c, label.m, label.kind or "", row.member, 0.0 if row.label else row.value)
    state = (row.pressure_kPa, row.load_N, row.rim or "")
    return (row.quantity != "frequency_Hz", row.quantity, *state, *mode)
