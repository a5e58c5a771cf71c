"""Deviations of a case from what was measured, linear in its variables and uncertain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...measured.measurement import Measurement
from ...measured.targets import in_states, readings_of
from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from ..inference.check_units import check_units
from ..inference.covariance import covariance
from ..inference.inverse_problem import Assumed, places
from ..inference.model import Answer, Query
from ..inference.observations import Observations, observe
from ..inference.plain_fit import plain_fit
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source, calibrated, sources
from .selection import Candidates

Array = np.ndarray


@dataclass(frozen=True)
class Deviations:
    """n deviations, linear about the tyre that fits them."""

    r: Array  # (n,) of ln q, at the variables' start values
    covariance: Array  # (n, n) S + J Sx J^T: of the rows, and by the variables' prior
    numbers: tuple[Source, ...]  # k numbers that may be off
    G: Array  # (n, k) change of ln q by one standard deviation of each
    chi2_exact_section: float  # of r, if the section's fields were known
    freedom: int  # of chi2: n, as the covariance has the variables' spread
    left_out: tuple[str, ...]  # measurements that are not used, and why


def measured_values(case: LoadedCase, measured: Path) -> Observations:
    """Values of the unloaded tyre in a file. Raises InputError, OSError."""
    readings = in_states(case, readings_of(case, measured))
    if not any(_is_modal(each) for each in readings):
        raise InputError(f"{measured}: it has no frequency of the unloaded tyre")
    if "pressure_kPa" in calibrated(case):
        raise InputError(
            "a variable of the case sets pressure_kPa, which the measurements state: take it out"
            " of the variables"
        )
    return observe(readings, split=Assumed().split)


def deviations(case: LoadedCase, evaluator: Evaluator, measured: Path, jobs: int = 1) -> Deviations:
    """Deviations from a file of measurements, with the covariance of a diagnosis: scatter, error of
    the model, and the section's fields, which no number of the case frees.

    Raises InputError, DeckRefused, EvaluationFailed, OSError.
    """
    observations = measured_values(case, measured)
    rows = list(dict.fromkeys(row.row for row in observations.rows))
    known, _ = sources(case)
    model = TyreModel(case, evaluator, rows, known, {}, jobs)
    check_units(model, observations, [str(measured)])
    where = places(observations, rows)
    x = plain_fit(model, observations, where)
    (answer,) = model.answers([Query(x, constants=True)])
    if not isinstance(answer, Answer):
        raise answer
    assert answer.constants is not None
    J, constants = answer.jacobian[where], answer.constants[where]
    of_section = np.array([source.field is not None for source in known], bool)
    r = observations.y - answer.eta[where] + J @ (x - model.start)
    by_variables = (J * model.spread) @ (J * model.spread).T
    laws, by_section = model.material_laws, constants[:, of_section]
    exact = covariance(observations, np.zeros_like(by_section), laws) + by_variables
    return Deviations(
        r,
        covariance(observations, by_section, laws) + by_variables,
        tuple(source for source in known if source.field is None),
        constants[:, ~of_section],
        Candidates.of(r, exact, np.zeros((len(r), 0))).fit([])[0],
        len(observations.y),
        observations.left_out,
    )


def _is_modal(reading: Measurement) -> bool:
    return reading.quantity == "frequency_Hz" and not reading.load_N
