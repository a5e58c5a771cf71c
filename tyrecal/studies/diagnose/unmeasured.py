"""Predictions for modes that were not measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..inference.inverse_problem import InverseProblem
from ..inference.model import ModelRow
from ..inference.observations import Observable, Observations
from .evidence import Hypothesis

Array = np.ndarray


def likeliest(
    problem: InverseProblem, hypothesis: Hypothesis, rows: Sequence[ModelRow], places: Array
) -> Array:
    """ln values (m,) of the rows with the indices ``places``, at the likeliest sizes and variables
    of an explanation, with constants as they are stated."""
    best = int(np.argmax(hypothesis.posterior))
    eta, unknown = problem.expansion.eta[places], np.full(len(places), np.nan)
    unseen = tuple(Observable.of(rows[i]) for i in places)
    observations = Observations(
        unseen, eta, 0 * eta, common=0.0, split=unknown, split_scatter=unknown
    )
    effects = {id: e[[best]] for id, e in hypothesis.values.items()}
    d, zeta = hypothesis.fitted.d[[best]], float(hypothesis.fitted.zeta[best])
    there = replace(problem, observations=observations, places=places, zeta=0.0)
    uncoupled = there.predicted(effects, d)[0]  # decides which of two near modes is the upper one
    return replace(there.measured(uncoupled), zeta=zeta).predicted(effects, d)[0]
