"""The paper's case, with other targets too, and a fake tyre that meets its own at a known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tyrecal.studies.fit.targets import read_targets
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .fake import LABELS, FakeEvaluator

CASE = load_case(CASES / "p235_75r17.yaml")
START = start_values(CASE)
START_X = np.log(list(START.values()))
TARGETS = {t.label: t.frequency_Hz for t in read_targets(CASE)}
POWERS = {
    "A_belt": np.array([-0.05, -0.05, -0.05, -0.05, -0.03, -0.05, -0.045, -0.03, -0.04]),
    "A_carcass": np.array([0.03, 0.01, 0.03, 0.04, 0.02, 0.03, 0.02, 0.01, 0.005]),
    "C10": np.array([0.04, 0.19, 0.07, 0.1, 0.11, 0.08, 0.08, 0.11, 0.08]),
}
TRUTH = {"A_belt": 4e-7, "A_carcass": 1.5e-7, "C10": 4.5e5}


def evaluator(truth: dict[str, float] = TRUTH, powers=POWERS, **options) -> FakeEvaluator:
    """A fake tyre that meets the targets exactly at ``truth``."""
    base = {
        label: TARGETS[label]
        * float(np.prod([(START[n] / truth[n]) ** p[i] for n, p in powers.items()]))
        for i, label in enumerate(LABELS)
    }
    return FakeEvaluator(base, powers, START, **options)


def with_targets(**changes: list) -> LoadedCase:
    """The case with a field of its targets replaced, target by target."""
    modes = [
        t.model_copy(update={name: values[i] for name, values in changes.items()})
        for i, t in enumerate(CASE.case.targets.modes)
    ]
    targets = CASE.case.targets.model_copy(update={"modes": modes})
    return replace(CASE, case=CASE.case.model_copy(update={"targets": targets}))
