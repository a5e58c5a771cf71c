"""About how many runs a study takes that calibrates the tyre first, counted before any is made.

`sample`, `diagnose` and `sensitivities` print it with --dry-run. The numbers of steps are those of
most cases; what a study finds decides how many it takes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ...measured.measurement import Measurement
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.number_units import EFFECT_PATH
from ..run_plan import PlannedState, RunPlan, plan_runs
from .effect_ranges import effect_ranges
from .model import Query
from .observations import Observable
from .tyre_model import TyreModel
from .uncertainties import calibrated, sources


def model_of(
    case: LoadedCase,
    evaluator: Evaluator,
    readings: Sequence[Measurement],
    effects: Collection[str] = (),
) -> TyreModel:
    """The model of the unloaded tyre in the states of the readings, with ``effects`` to weigh; a
    frequency without a label counts as one of [1,0]."""
    modal = [each for each in readings if each.quantity == "frequency_Hz" and not each.load_N]
    rows = [
        Observable(each.quantity, each.label or Label(1, 0), each.pressure_kPa, rim=each.rim).row
        for each in modal
    ]
    ids = [id for id in effects if EFFECT_PATH + id not in calibrated(case)]
    ranges, _ = effect_ranges(case, evaluator, ids)
    return TyreModel(case, evaluator, list(dict.fromkeys(rows)), sources(case)[0], ranges)


def estimate(
    model: TyreModel, runs: int, jobs: int, pressed: Sequence[PlannedState] = ()
) -> RunPlan:
    """The plan of about so many runs on no road, and of two tyres in the states ``pressed``, to
    each of which half of the runs are then counted."""
    numbers = 0 if not model.evaluator.has_gradients else len(model.variables)
    alone = PlannedState(sensitivities=numbers)
    states = [alone] * -(-runs // 2) if pressed else [alone]
    designs = 2 if pressed else runs
    return plan_runs(model.case, model.evaluator, [*states, *pressed], designs, jobs, True)


def selection_runs(model: TyreModel) -> int:
    """Runs of a calibration, and of the sensitivities to all uncertain numbers about it."""
    return model.runs_of_calibration + model.runs([Query(model.start, constants=True)])
