"""Errors that the measured values share with the model: the covariance of ln q beyond scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...simulate.evaluate.failure import DeckRefused
from ...tyre.case import LoadedCase
from ..inference.covariance import covariance, model_form
from ..inference.observations import Observable, Observations
from ..inference.uncertainties import Source, sources
from .problem import Point, Problem
from .responses import linear_answer
from .road_errors import road_changes, road_form
from .targets import WITHOUT_MODEL_ERROR, Target, ValueTarget

Array = np.ndarray


@dataclass(frozen=True)
class ModelErrors:
    """Possible errors of the n values that count.

    Values other than unloaded modes are rows without a label: they have no error of form of a mode.
    """

    rows: tuple[Observable, ...]
    known: list[Source]  # the k sources of error
    by_constants: Array  # (n, k) changes of ln q by one standard deviation of each of ``known``
    # standard deviation of ln f by each part of the error of material laws (`form_error`)
    laws: float
    road: Array  # (n,) standard deviation of ln q, on the road, by the model itself; else 0

    @property
    def form(self) -> Array:
        """Covariance (n, n) by mesh and material laws."""
        return model_form(self.rows, self.laws) + np.diag(self.road**2)

    def covariance(self, scatter: Array) -> Array:
        """Sigma (n, n) of ln q; scatter (n,): relative standard deviations."""
        none = np.full(len(self.rows), np.nan)
        observed = Observations(
            self.rows, none, scatter, common=0.0, split=none, split_scatter=none
        )
        of_frequencies = covariance(observed, self.by_constants, self.laws)
        return of_frequencies + np.diag(self.road**2)


def model_errors(problem: Problem, point: Point) -> ModelErrors:
    """Possible errors at the design ``point``, which is evaluated with all sensitivities in every
    state.

    Raises DeckRefused if the solver has no exact sensitivities; EvaluationFailed; ValueError for
    targets on the road, see `road_changes`, and those of a fit without prior, which does not press
    the tyre for it.
    """
    if not problem.evaluator.has_gradients:  # by differences, each constant would be another run
        name = problem.evaluator.solver.name
        raise DeckRefused(f"solver '{name}' gives no exact sensitivities of this case")
    if problem.road and problem.spread is None:
        raise ValueError("for targets on the road it is computed with --prior alone")
    case, counted = problem.case, problem.counted
    on_road = np.array([bool(each.state.load_N) for each in counted])
    unloaded = ~on_road & np.array([each.quantity not in WITHOUT_MODEL_ERROR for each in counted])
    rows = tuple(_observable(case, each) for each in counted)
    known, _ = sources(case)
    by_constants = np.zeros((len(rows), len(known)))
    own = [row for row, modal in zip(rows, unloaded, strict=True) if modal]
    _, by_constants[unloaded], laws = linear_answer(
        case, problem.evaluator, point.values, own, known, problem.jobs
    )
    pressed = [each for each in counted if isinstance(each, ValueTarget) and each.state.load_N]
    road = np.zeros(len(rows))
    if pressed:
        road[on_road] = road_form(pressed)
        by_constants[on_road] = road_changes(
            case, problem.evaluator, pressed, point.values, known, problem.jobs
        )
    return ModelErrors(rows, known, by_constants, laws, road)


def needs_model_errors(problem: Problem) -> None:
    """Raises InputError for targets whose model errors are not computed, DeckRefused if the solver
    lacks the sensitivities, before anything is evaluated."""
    pressed = [each for each in problem.counted if each.state.load_N]
    if any(isinstance(each, ValueTarget) and each.member for each in pressed):
        raise InputError(
            "--prior takes no frequencies under load: leave them out of the measurements, or fit"
            " without --prior"
        )
    evaluator, solver = problem.evaluator, problem.evaluator.solver
    lacking = "" if evaluator.has_gradients else "gradients"
    if pressed and "footprint_gradients" not in solver.capabilities:
        lacking = "footprint_gradients"
    if lacking:
        raise DeckRefused(
            f"solver '{solver.name}' gives no exact sensitivities of this case, which --prior"
            f" needs: 'tyrecal solvers' shows which one does ({lacking})"
        )


def _observable(case: LoadedCase, target: Target | ValueTarget) -> Observable:
    if target.state.load_N or not isinstance(target, Target):
        return Observable(target.quantity, None, 0.0)
    pressure = target.state.with_defaults(case).pressure_kPa or 0.0
    return Observable("frequency_Hz", target.label, pressure, rim=target.state.rim)
