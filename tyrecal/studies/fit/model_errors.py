"""Errors that the measured values share with the model: the covariance of ln q beyond scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...tyre.case import LoadedCase
from ..inference.covariance import covariance, model_form
from ..inference.observations import Observable, Observations
from ..inference.uncertainties import Source, sources
from .problem import Point, Problem
from .responses import linear_answer
from .targets import Target

Array = np.ndarray


@dataclass(frozen=True)
class ModelErrors:
    """Possible errors of the n values that count.

    by_constants (n, k): changes of ln q by one standard deviation of each of ``known``; laws:
    standard deviation of each part of what material laws do.
    """

    rows: tuple[Observable, ...]
    known: list[Source]
    by_constants: Array
    laws: float

    @property
    def form(self) -> Array:
        """Covariance (n, n) by mesh and material laws."""
        return model_form(self.rows, self.laws)

    def covariance(self, scatter: Array) -> Array:
        """Sigma (n, n) of ln q; scatter (n,): relative standard deviations."""
        none = np.full(len(self.rows), np.nan)
        observed = Observations(self.rows, none, scatter, 0.0, none, none)
        return covariance(observed, self.by_constants, self.laws)


def model_errors(problem: Problem, point: Point) -> ModelErrors:
    """Possible errors at the design ``point``, which is evaluated with all sensitivities in every
    state.

    Raises DeckRefused if the solver has no exact sensitivities; EvaluationFailed; ValueError if
    targets are on the road.
    """
    if problem.road:
        raise ValueError("it is not computed for targets on the road")
    rows = tuple(_observable(problem.case, each) for each in problem.counted)
    known, _ = sources(problem.case)
    _, by_constants, laws = linear_answer(
        problem.case, problem.evaluator, point.values, rows, known, problem.jobs
    )
    return ModelErrors(rows, known, by_constants, laws)


def _observable(case: LoadedCase, target: object) -> Observable:
    if not isinstance(target, Target):
        return Observable("mass_kg", None, 0.0)
    pressure = target.state.with_defaults(case).pressure_kPa or 0.0
    return Observable("frequency_Hz", target.label, pressure, rim=target.state.rim)
