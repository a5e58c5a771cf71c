"""Sense of measured frequencies before any fit: exchanged pressures or labels, single slips.

Frequencies of tyres follow a pattern: they rise with pressure, all by nearly the same share, and
with the waves c along a smooth curve for each m. As a normal distribution of ln f:

    ln f = a + ln F(label) + o_m + g ln(c / 2) + t_label + (s + s_label) ln(p / mean p) + noise

F are the rounded frequencies of two passenger tyres; o_m is common to the modes of an m, which is 0
for both [0,0]; mean p is geometric. a is free, the others have the standard deviations below, which
are assumed; [0,0] torsional has an s of its own. A doubt is a change of the data, two pressures or
two labels exchanged or one value left out, that makes them far more probable. Where the next change
is nearly as probable, it is named too. These are questions to the user: nothing is changed here.
`measured import` and `fit` report them; the pattern must never enter a fit.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from heapq import nlargest
from itertools import combinations
from pathlib import Path

import numpy as np

from ..simulate.modes.label import Label
from .measurement import Measurement
from .tables import read_measurements

Array = np.ndarray
USUAL_HZ = {  # by m, from c = 1
    0: (67, 90, 110, 131, 153, 174, 193, 212, 229),
    1: (45, 78, 118, 148, 168, 186, 202, 216, 231),
}
ZERO_HZ = {"axial": 37, "torsional": 44}  # of [0,0] by kind
# by c, and kind or m: of a tyre on a free rim, where these differ
FREE_HZ = {(0, "axial"): 45, (0, "torsional"): 74, (1, 0): 81, (1, 1): 73}
SCALE_SD, OFFSET_SD, GROWTH_SD = 2.0, 0.06, 0.08  # of a, o_m, g
SHAPE_SD = {0: 0.12, 1: 0.05}  # of t_label by c
SHAPE_SD_ELSE, SHAPE_SD_FREE = 0.02, 0.2  # with more waves; on a free rim with fewer
RISE, RISE_SD, OWN_RISE_SD = 0.35, 0.08, 0.05  # of s and s_label
# of [0,0] torsional, in which cords carry nearly all: computed for tyres of ten sizes
TORSIONAL_RISE, TORSIONAL_RISE_SD = 0.24, 0.08
MIN_NOISE = 0.003  # of ln f
EXCHANGED, OFF = 16.0, 25.0  # chi-squared that a doubt takes away, at least: 4² and 5²
NEXT_SLIP = 6.0  # chi-squared between a slip and the next likely: below, both are named
MAX_DOUBTS = 5  # sentences


def doubts_of_file(path: Path) -> list[str]:
    """`doubts` about a measurements CSV. Raises InputError, OSError."""
    return doubts(read_measurements(path, labelled=False))


def doubts(rows: Sequence[Measurement]) -> list[str]:
    """Sentences, each with file and line, about frequencies of the unloaded tyre that are far more
    probable with pressures or labels exchanged, or without one of them."""
    groups: dict[object, list[Measurement]] = defaultdict(list)
    for row in rows:
        if row.quantity == "frequency_Hz" and not row.load_N and _usual(row):
            groups[row.rim].append(row)
    return [doubt for group in groups.values() for doubt in _of_one_rim(group)]


def _of_one_rim(rows: list[Measurement]) -> Iterator[str]:
    """Sentences on values measured on one rim that fit better if they are exchanged."""
    rows = list(rows)
    for _ in range(min(MAX_DOUBTS, len(rows) - 1)):
        weight, deviation = _pattern(rows)
        base = deviation @ weight @ deviation

        def gain(order: Sequence[int]) -> float:
            """Chi-squared that values in another order take away: row k has the value of row
            order[k]."""
            moved = deviation + np.log([rows[i].value for i in order])  # noqa: B023
            moved -= np.log([row.value for row in rows])  # noqa: B023
            return float(base - moved @ weight @ moved)  # noqa: B023

        best, following = _likeliest_exchanges(rows, gain)
        weighted = weight @ deviation
        # chi-squared that leaving out each value takes away
        single = weighted**2 / np.diag(weight)
        second, worst = map(int, np.argsort(single)[-2:])
        if best[0] > EXCHANGED and best[0] > single[worst]:
            other = following[2] if best[0] - following[0] < NEXT_SLIP else ""
            yield best[2] + f" Nearly as likely: {other}" * bool(other)
            values = [row.value for row in rows]
            rows = [replace(row, value=values[i]) for row, i in zip(rows, best[1], strict=True)]
        elif single[worst] > OFF and len(rows) > 3:
            rival = rows[second] if single[worst] - single[second] < NEXT_SLIP else None
            row = rows.pop(worst)
            smooth = row.value * np.exp(-weighted[worst] / weight[worst, worst])
            yield (
                f"{row.place}: {row.name} is {row.value:.4g} Hz at {row.pressure_kPa:g} kPa, where"
                f" a smooth curve through the other frequencies has {smooth:.3g} Hz: is it a slip,"
                " or another mode?"
                + (f" Nearly as likely is {rival.place}: {rival.name}" if rival else "")
                + (f" is {rival.value:.4g} Hz at {rival.pressure_kPa:g} kPa." if rival else "")
            )
        else:
            return


def likeliest_exchange(
    rows: list[Measurement], gain: Callable[[Sequence[int]], float]
) -> tuple[float, list[int], str]:
    """The exchange of two pressures or labels, among frequencies of one rim, with most
    ``gain``, a function of the order of the values: gain, order, question; "": there is none."""
    return _likeliest_exchanges(rows, gain)[0]


def _likeliest_exchanges(
    rows: list[Measurement], gain: Callable[[Sequence[int]], float]
) -> list[tuple[float, list[int], str]]:
    """`likeliest_exchange` and the one after it."""
    none: list[tuple[float, list[int], str]] = [(0.0, [], "")] * 2
    return nlargest(2, [*_exchanges(rows, gain), *none], key=lambda each: each[0])


def _exchanges(
    rows: list[Measurement], gain: Callable[[Sequence[int]], float]
) -> Iterator[tuple[float, list[int], str]]:
    """Gain, order of the values and question, of all that can be exchanged."""
    at = {(row.label, row.member, row.pressure_kPa): i for i, row in enumerate(rows)}
    pressures = sorted({row.pressure_kPa for row in rows})
    names = sorted({(row.label, row.member) for row in rows}, key=str)

    def exchanged(pairs: Sequence[tuple[int, int]]) -> list[int]:
        """The order of the rows with those of each pair exchanged."""
        order = list(range(len(rows)))
        for i, j in pairs:
            order[i], order[j] = j, i
        return order

    for p, q in combinations(pressures, 2):
        pairs = [(at[*n, p], at[*n, q]) for n in names if (*n, p) in at and (*n, q) in at]
        if pairs:
            order = exchanged(pairs)
            i, j = pairs[0]
            yield (
                gain(order),
                order,
                f"{rows[i].place}, {rows[j].place}: frequencies do not rise with pressure as those"
                f" of tyres do: are {p:g} and {q:g} kPa exchanged?",
            )
    for one, other in combinations(names, 2):
        both = [
            (at[*one, p], at[*other, p]) for p in pressures if {(*one, p), (*other, p)} <= {*at}
        ]
        for pairs in [[pair] for pair in both] + [both] * (len(both) > 1):
            order = exchanged(pairs)
            i, j = pairs[0]
            yield (
                gain(order),
                order,
                f"{rows[i].place}, {rows[j].place}: {rows[i].name} is {rows[i].value:.4g} Hz and"
                f" {rows[j].name} {rows[j].value:.4g} Hz at {rows[i].pressure_kPa:g} kPa, which"
                " does not go with the other frequencies: are the two labels exchanged?",
            )


def _usual(row: Measurement) -> float:
    """F of a label, Hz; 0 where no pattern is known."""
    label = row.label or Label(0, 9)  # which has no pattern
    low = FREE_HZ.get((label.c, label.kind or label.m)) if row.rim == "free" else None
    if label.kind:
        return low or ZERO_HZ[label.kind]
    known = USUAL_HZ.get(label.m, ())
    if not known or not label.c:
        return low or 0
    beyond = max(0, label.c - len(known))  # where the tyres' own modes end, on a straight line
    return low or known[label.c - 1 - beyond] + beyond * (known[-1] - known[-2])


def _pattern(rows: Sequence[Measurement]) -> tuple[Array, Array]:
    """The inverse covariance (n, n) of ln f by the pattern, and the deviations (n,) from its
    mean."""
    labels = [row.label or Label(0, 9) for row in rows]
    y = np.log([row.value / _usual(row) for row in rows])
    p = np.log([row.pressure_kPa for row in rows])
    p -= p.mean()
    c = np.array([label.c for label in labels])
    m = np.array([label.m for label in labels])
    free = np.array([row.rim == "free" for row in rows])
    shape = np.array([SHAPE_SD.get(each, SHAPE_SD_ELSE) for each in c])
    shape[free & (c < 2)] = SHAPE_SD_FREE
    growth = GROWTH_SD * np.log(np.maximum(c, 2) / 2)
    same = np.array([[a == b for b in labels] for a in labels])
    torsional = np.array([label.kind == "torsional" for label in labels])
    own_rise = np.where(torsional, TORSIONAL_RISE_SD, OWN_RISE_SD)
    noise = np.array([np.hypot(np.nan_to_num(row.sigma / row.value), MIN_NOISE) for row in rows])
    covariance = (
        SCALE_SD**2
        + OFFSET_SD**2 * (m[:, None] == m)
        + np.outer(growth, growth)
        + same * np.outer(shape, shape)
        + (RISE_SD**2 + np.outer(own_rise, own_rise) * same) * np.outer(p, p)
        + np.diag(noise**2)
    )
    return np.linalg.inv(covariance), y - np.where(torsional, TORSIONAL_RISE, RISE) * p
