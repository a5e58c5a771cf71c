"""Frequencies without labels: how often the likeliest labeling is right, and as often as stated?

    python -m tests.studies.unlabelled [data sets] [seed] [--discrepancy]

The P235/75R17: truths are drawn from the prior of the variables that the labels are found with,
within the emulator's box (60 evaluations on the default mesh within +-0.9 of ln x). Measured are
the nine modes of the paper, less none to three of them, and in every second set a foreign frequency
anywhere in the band, all without labels, with 0.5 % noise. With --discrepancy the tyre's own modes
are off the model's as `DISCREPANCIES` say, too.

Right: the whole labeling. Apart: no two of the tyre's modes in the band, foreign ones included, are
within 2 %.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial

import numpy as np

from tests.conftest import CASES
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.score import calibration_error, calibration_quantile, clopper_pearson
from tyrecal.studies.emulator import Emulator, emulator
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.labelling.expansion import ModesNearDesign, Prior, admissible, find_labels
from tyrecal.studies.labelling.tree import DISCREPANCIES, FOREIGN_MARGIN, Frequencies, discrepancy
from tyrecal.studies.variable import START_SPREAD, read_variables
from tyrecal.tyre.load import load_case

Array = np.ndarray
CASE = load_case(CASES / "p235_75r17.yaml")
MEASURED = target_labels(CASE)
OTHERS = [Label(4, 1), Label(5, 0), Label(5, 1)]  # that the band may hold
SIGMA, APART, MOST_MISSED, REACH = 0.005, 0.02, 3, 0.9


def emulated() -> Emulator:
    """Modes by the variables, from the emulator."""
    analysis = CASE.case.analysis.model_copy(update={"highest_harmonic": 5})
    wider = replace(CASE, case=CASE.case.model_copy(update={"analysis": analysis}))
    variables = read_variables(CASE)
    start = np.array([v.scaled(v.start) for v in variables])
    box = np.stack([start - REACH, start + REACH], 1)
    return emulator(Evaluator(TyreDesign(wider)), variables, box, [*MEASURED, *OTHERS], 60)


def main(count: int, seed: int, discrepant: bool) -> None:
    """Tells the rates."""
    made, random = emulated(), np.random.default_rng(seed)
    print(f"emulator: {made.stated_error:.1e}", flush=True)
    labels, v = made.labels, len(made.centre)
    low, high = made.box.T
    prior = Prior(made.centre, START_SPREAD * np.eye(v), low, high)
    nominal = np.array([labels.index(label) for label in MEASURED])
    zero = np.zeros(len(labels), int)

    def expand(x: Array) -> ModesNearDesign:
        return ModesNearDesign(labels, zero, made.ln_f(x[None])[0], made.slopes(x[None])[0])

    right, stated, apart, each_right, each_stated = [], [], [], [], []
    for i in range(count):
        x = np.full(v, np.inf)
        while (abs(x - made.centre) > REACH).any():
            x = made.centre + START_SPREAD * random.normal(size=v)
        ln_f = made.ln_f(x[None])[0]
        if discrepant:
            own = discrepancy(labels, random.choice(DISCREPANCIES))
            ln_f = ln_f + random.multivariate_normal(np.zeros(len(labels)), own, method="cholesky")
        kept = random.permutation(nominal)[random.integers(MOST_MISSED + 1) :]
        y, truth = list(ln_f[kept] + SIGMA * random.normal(size=len(kept))), list(kept)
        if random.random() < 0.5:
            y.append(random.uniform(min(y) - FOREIGN_MARGIN, max(y) + FOREIGN_MARGIN))
            truth.append(-1)
        order = np.argsort(y)
        y_, truth_ = np.array(y)[order], np.array(truth)[order]
        result = find_labels(expand, partial(without_labels, y_), prior).labelings
        right.append(bool((result.modes[0] == truth_).all()))
        stated.append(result.probabilities[0])
        best = result.each.argmax(1)
        each_right += list(np.where(best == len(labels), -1, best) == truth_)
        each_stated += list(result.each.max(1))
        top = max(y) + FOREIGN_MARGIN
        every = np.sort([*ln_f[ln_f < top], *y_[truth_ < 0]])
        apart.append(bool(np.diff(every).min() > APART))
        if (i + 1) % 100 == 0:
            print(f"{i + 1}: {np.mean(right):.3f}", flush=True)
    for name, chosen in (("all", [True] * count), ("apart", apart), ("near", np.invert(apart))):
        tell(name, np.array(right)[chosen], np.array(stated)[chosen])
    tell("each frequency", np.array(each_right), np.array(each_stated))


def without_labels(y: Array, at: ModesNearDesign) -> Frequencies:
    """Measured frequencies without their labels."""
    count = len(y)
    place, none = np.zeros(count, int), np.zeros(count, bool)
    allowed = admissible([None] * count, place, at)
    return Frequencies(y, np.full(count, SIGMA), place, allowed, none)


def tell(name: str, right: Array, stated: Array) -> None:
    """A line of what was found."""
    low, high = clopper_pearson(int(right.sum()), len(right))
    print(
        f"{name}: right {right.sum()} of {len(right)}, {right.mean():.3f} ({low:.3f} to"
        f" {high:.3f});"
        f" stated {stated.mean():.3f}; calibration error {calibration_error(stated, right):.3f},"
        f" of a calibrated answerer {calibration_quantile(stated):.3f}"
    )


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdecimal()]
    sets, first_seed = numbers + [400, 1][len(numbers) :]
    main(sets, first_seed, "--discrepancy" in sys.argv)
