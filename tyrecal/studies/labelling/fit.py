"""A fit to frequencies of which some have no label: to the likeliest ones, told anew about the
design that was found, until they are the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ...measured.measurement import Measurement
from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from ..fit.calibrate import Fit
from .label import Labelled, label
from .result import labels_told

MOST_FITS = 5
Calibrated = Callable[[Sequence[Measurement]], Fit]  # of readings with labels


def fit_unlabelled(
    case: LoadedCase,
    evaluator: Evaluator,
    readings: Sequence[Measurement],
    first: Labelled,
    calibrated: Calibrated,
    fixed: Mapping[str, float] | None = None,
    jobs: int = 1,
) -> Fit:
    """A fit, whose result tells the labels. first: those to begin with. Raises what `label` and
    ``calibrated`` do."""
    used, told = first, first
    for _ in range(MOST_FITS):
        used = told
        fit = calibrated(used.readings)
        told = label(case, evaluator, readings, None, fit.fitted.values, fixed, jobs)
        if told.labels == used.labels:
            break
    same = told.found.settled and told.labels == used.labels
    labels = labels_told(case, replace(told, found=replace(told.found, settled=same)))
    fit.found = fit.found.model_copy(update={"labels": labels})
    return fit
