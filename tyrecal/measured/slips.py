"""Slips: repeated measurements of one value that contradict each other.

All repeats of one quantity together show how far two runs of one thing may differ. With y = ln x,
run i of n runs of one value (one quantity, label, member and state: `Measurement.key`) differs from
the mean of the other n - 1 by d_i; its studentised deviation is

    t_i = |d_i| sqrt((n - 1) / n) / s,    s^2 = the scatter of all repeats of the file without it.

The largest is removed, then the largest of the rest, and so on. The slips are all up to the last
one whose t_i exceeds the limit by Student's t (Rosner's generalised extreme studentised deviate).
So two slips do not hide each other, and no slip adds to the scatter that it is compared with.
`repeats.combined`, which averages repeats, must leave out all runs that are reported here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .measurement import Measurement

# share of files without a slip in which one is reported, for each quantity
FALSE_REPORTS = 0.002
FEW_REPEATS = 3  # degrees of freedom below which a file does not show the scatter of its repeats
# relative difference between repeats of such a file above which one is a slip
MAX_REPEAT_STEP = {"frequency_Hz": 0.05, "mass_kg": 0.05}
MAX_REPEAT_STEP_ELSE = 0.25  # of all other quantities
MIN_COMMON, MIN_SHIFT = 3, 0.02  # common labels of two runs, and their mean ln ratio, to report
MAX_SLIPS = 12  # largest number of slips
# of values that are rounded, or of a spectrum's lines: the largest, 500, first
USUAL_STEPS = [digit * 10.0**power for power in range(2, -8, -1) for digit in (5, 2.5, 2, 1.25, 1)]
MIN_SCATTER = 1e-4  # relative scatter that repeats of a test have at least


@dataclass(frozen=True)
class Contradiction:
    """Repeats of one value, one of which differs by more than repeats of its file do."""

    slip: Measurement  # the run that is off; of two runs, the later one
    others: tuple[Measurement, ...]  # the other repeats of the same value
    usual: float  # standard deviation of all other repeats, %; 0 if there are too few

    @property
    def left_out(self) -> tuple[Measurement, ...]:
        """Runs that must not be averaged: the slip; of two runs both, as either may be it."""
        return (self.slip,) if len(self.others) > 1 else (self.slip, *self.others)

    def __str__(self) -> str:
        return (
            f"{self.words}. Is it a slip, or another mode? Correct it, or leave it out with"
            " --keep-going"
        )

    @property
    def words(self) -> str:
        """The runs that contradict each other, and by how much."""
        slip, others = self.slip, self.others
        mean = float(np.mean([each.value for each in others]))
        which = f"{mean:.6g}" if len(others) == 1 else f"{mean:.6g}, the mean of the others,"
        places = ", ".join(each.place + _run(each) for each in others[:3])
        scatter = f", other repeats by {self.usual:.2g} %" if self.usual else ""
        return (
            f"{slip.place}: {slip.name} is {slip.value:.6g}{_run(slip)}, but {which} in {places};"
            f" they differ by {100 * abs(slip.value / mean - 1):.2g} %{scatter}"
        )


def _run(each: Measurement) -> str:
    """The run's own name, where its file has one."""
    name = each.run.removeprefix(each.place.rpartition(", line ")[0]).strip()
    return f" (run {name})" if name and not each.place.startswith(name) else ""


def contradictions(values: Sequence[Measurement]) -> list[Contradiction]:
    """Every run that differs from its label's other runs by more than the file's repeats do."""
    values = [each for each in values if not each.is_unlabelled]
    quantities = dict.fromkeys(each.quantity for each in values)
    return [
        contradiction
        for quantity in quantities
        for contradiction in _of_quantity([each for each in values if each.quantity == quantity])
    ]


def common_shifts(values: Sequence[Measurement]) -> list[str]:
    """Sentences about two runs whose frequencies all differ by nearly the same share, as those of
    another pressure do. Such a difference is no slip of one label."""
    runs: dict[str, dict[object, Measurement]] = {}
    for each in values:
        if each.quantity == "frequency_Hz":
            runs.setdefault(each.run, {})[each.key] = each
    sentences = []
    for (_, one), (_, other) in combinations(runs.items(), 2):
        common = [key for key in one if key in other]
        if len(common) < MIN_COMMON:
            continue
        shifts = np.log([one[key].value / other[key].value for key in common])
        mean, scatter = float(shifts.mean()), float(shifts.std(ddof=1))
        if abs(mean) > MIN_SHIFT and abs(mean) > 4 * scatter:
            first, second = one[common[0]], other[common[0]]
            sentences.append(
                f"{first.place}{_run(first)}: all {len(common)} frequencies are"
                f" {100 * abs(np.expm1(mean)):.1f} % {'above' if mean > 0 else 'below'} those of"
                f" {second.place}{_run(second)}: was the pressure the same?"
            )
    return sentences


def _of_quantity(values: list[Measurement]) -> list[Contradiction]:
    """Slips among the values of one quantity, in the order of ``values``."""
    from scipy.stats import t as student

    groups: dict[object, list[Measurement]] = {}
    for each in values:
        groups.setdefault(each.key, []).append(each)
    repeated = [runs for runs in groups.values() if len(runs) > 1]
    half_step = _step([each.value for each in values]) / 2  # rounding of what is written
    largest = MAX_REPEAT_STEP.get(values[0].quantity, MAX_REPEAT_STEP_ELSE)
    # a group of two is one comparison
    comparisons = sum(len(runs) if len(runs) > 2 else 1 for runs in repeated)
    removed: list[Contradiction] = []
    slips = 0
    for _ in range(min(MAX_SLIPS, comparisons)):
        squares = sum(float(np.sum(_deviations(runs) ** 2)) for runs in repeated)
        freedom = sum(len(runs) - 1 for runs in repeated)
        if not freedom:
            break
        own, worst, at = max(
            (
                (d**2 * len(runs) / (len(runs) - 1), runs, i)  # what run i adds to the squares
                for runs in repeated
                for i, d in enumerate(_deviations(runs))
            ),
            key=lambda each: each[0],
        )
        n = len(worst)
        rest, left = max(0.0, squares - own), freedom - 1
        floor = max(MIN_SCATTER, half_step / max(each.value for each in worst))
        usual = np.sqrt(rest / left) if left else 0.0
        limit = np.inf  # of t_i s
        if left:
            tail = FALSE_REPORTS / 2 / comparisons
            limit = float(student.isf(tail, left)) * max(usual, floor)
        step = float(np.sqrt(own * n / (n - 1)))  # relative, from the mean of the others
        stated = max(np.nan_to_num(each.sigma) / each.value for each in worst)
        few = left < FEW_REPEATS and step > max(largest, 4 * stated)
        runs = worst[:at] + worst[at + 1 :]
        slip = worst[at]
        if n == 2:
            runs, slip = worst[:1], worst[1]
        removed.append(
            Contradiction(slip, tuple(runs), 100 * usual if left >= FEW_REPEATS else 0.0)
        )
        if np.sqrt(own) > limit or few:
            slips = len(removed)
        repeated = [each for each in repeated if each is not worst] + [runs] * (len(runs) > 1)
    return sorted(removed[:slips], key=lambda each: values.index(each.slip))


def _deviations(runs: Sequence[Measurement]) -> np.ndarray:
    """y less the mean of all n runs: d_i (n - 1) / n."""
    y = np.log([each.value for each in runs])
    return np.asarray(y - y.mean())


def _step(values: Sequence[float]) -> float:
    """The largest usual step of which all values are multiples: the last written digit, or the line
    spacing of a spectrum. 0 if there is none."""
    x = np.array(values)
    for step in USUAL_STEPS:
        if np.all(abs(x / step - np.rint(x / step)) < 1e-6):
            return step
    return 0.0
