"""Errors that the measured values share with the model: the covariance of ln q beyond scatter.

The r values on the road are stiffnesses, areas, lengths and widths.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ...tyre.case import LoadedCase, number_at
from ...tyre.number_units import EFFECT_PATH
from ..inference.covariance import covariance, model_form
from ..inference.observations import Observable, Observations
from ..inference.regions import split_by_region
from ..inference.section_fields import OF_COMPOUNDS, SectionDesign
from ..inference.uncertainties import Source, sources, values_of
from .prediction import linear_answer
from .problem import Point, Problem
from .road import press, press_with_slopes
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


# of the model itself, relative: agreement with CalculiX and GetFEM (tests/benchmarks/FOOTPRINT.md)
STIFFNESS_ERROR, PATCH_ERROR = 0.02, 0.05


def road_form(targets: Sequence[ValueTarget]) -> Array:
    """Relative standard deviations (r,) of the model's own values."""
    stiff = [each.quantity == "vertical_stiffness_N_per_m" for each in targets]
    return np.where(stiff, STIFFNESS_ERROR, PATCH_ERROR)


def road_changes(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    values: Mapping[str, float],
    known: Sequence[Source],
    jobs: int = 1,
) -> Array:
    """Changes (r, k) of ln q of targets, none a mode, by one standard deviation of each source.

    The design ``values`` is pressed with sensitivities to all numbers and nodes, and once more with
    a compound of its own in each part of the section; effects by a step. Raises EvaluationFailed,
    DeckRefused, and ValueError where a target is a mode.
    """
    if any(each.member for each in targets):
        raise ValueError("it is not computed for modes under load")
    if "footprint_gradients" not in evaluator.solver.capabilities:
        raise ValueError(f"solver '{evaluator.solver.name}' gives no sensitivities on the road")
    fields = {s.name: s.field for s in known if s.field and s.field.moves}
    numbers = values_of(case, list(known))
    design = {**numbers, **dict.fromkeys(fields, 0.0), **values}
    names = [*numbers, *fields]
    own = evaluator.of(SectionDesign(case, fields))
    q, slopes = press_with_slopes(case, own, targets, design, names, design, jobs)
    rates = dict(zip(names, slopes.T, strict=True))
    changes = np.zeros((len(targets), len(known)))
    for k, source in enumerate(known):
        if source.name in fields:
            changes[:, k] = rates[source.name]
        for path, step in source.steps.items():
            if path.startswith(EFFECT_PATH):
                present = case.case.effects.get(path.removeprefix(EFFECT_PATH), 0.0)
                there = next(press(case, own, targets, [{**design, path: present + step}], jobs))
                if isinstance(there, EvaluationFailed):
                    raise there
                changes[:, k] += there - q
            else:
                changes[:, k] += step * rates[path]
    of_parts = [
        (k, s.field) for k, s in enumerate(known) if s.field and s.field.kind in OF_COMPOUNDS
    ]
    if of_parts:
        by_part = _by_part(case, evaluator, targets, values, jobs)
        for k, field in of_parts:
            changes[:, k] = by_part[field.kind] @ field.values
    return changes / q[:, None]


def _by_part(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    values: Mapping[str, float],
    jobs: int,
) -> dict[str, Array]:
    """d q / d ln stiffness and density (r, parts) of each part of rubber."""
    split, parts = split_by_region(case)
    # by path: 1 or, of the compressibility D1, -1: the power to which stiffness has the number
    signs = {m: case.kind.moduli(split.case, m) for m in parts}
    rubbers = [m for m in parts if len(signs[m]) > 1]  # C10, C01, D1; a cord has E alone
    paths = [path for m in rubbers for path in signs[m]]
    numbers = {path: float(number_at(split, path)) for path in paths}
    taken = {p: values[n] for n, v in split.case.variables.items() for p in v.sets if n in values}
    design = {**numbers, **taken}
    own = evaluator.of(TyreDesign(split))
    _, slopes = press_with_slopes(split, own, targets, design, paths, design, jobs)
    by_path = dict(zip(paths, slopes.T, strict=True))
    stiffness = [
        sum(sign * design[path] * by_path[path] for path, sign in signs[m].items()) for m in rubbers
    ]
    return {
        "stiffness": np.array(stiffness).T,
        "density": np.zeros((len(targets), len(rubbers))),  # no weight acts on the road
    }
