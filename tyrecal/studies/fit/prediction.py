"""How far frequencies of a fitted design may be off where nothing was measured.

A fit answers measured values q by x = x_0 + R (ln q - ln q_0) (`FitResponse`, for `total_error`
too). ln q of the tyre
is eta(x_t) with scatter, form and constants c; its frequency elsewhere is eta'(x_t) with form' and
c. So the computed ln f' = eta'(x) is off by

    J' R (scatter + form + G c) - (form' + G' c),    variance A Sigma A^T,  A = (J' R, -1)

With what was known before of the variables, (I - R J) (x_0 - x_t) adds to x - x_t (`prior`).
Sigma is the covariance of measured and other rows together, without scatter of the others. It is
multiplied by chi2 per degree of freedom where the standard errors of the variables are. The tyre's
own frequency is meant: another measurement adds its scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from ...files import read_json
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.case.parts import RimSupport
from ...tyre.state import TyreState
from ..inference.covariance import model_form
from ..inference.model import Answer, Query
from ..inference.observations import Observable
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source, sources
from ..result import ResultPart
from ..variable import read_variable

Array = np.ndarray


class FitResponse(ResultPart):
    """A measured value that counts: a mode at a pressure on a rim, the mass (no c and m), or one
    on the road (load_N)."""

    c: int | None = None
    m: int | None = None
    kind: str | None = None
    pressure_kPa: float = 0.0
    load_N: float = 0.0
    rim: RimSupport | None = None
    scatter: float  # relative standard deviation of the measured value
    # d x / d ln value by variable; x: ln of the variable, or its share of the bounds' width
    response: dict[str, float]

    @property
    def label(self) -> Label | None:
        """[c, m], None of the mass."""
        if self.c is None or self.m is None:
            return None
        return Label(self.c, self.m, self.kind)


def linear_answer(
    case: LoadedCase,
    evaluator: Evaluator,
    values: Mapping[str, float],
    rows: Sequence[Observable],
    known: list[Source],
    jobs: int = 1,
) -> tuple[Array, Array, float]:
    """Sensitivities d ln q / d x (n, v) of rows at the design ``values``, changes of ln q (n, k) by
    one standard deviation of each source of error, and the standard deviation of ln f by each part
    of the error of material laws (`form_error`). Raises DeckRefused, EvaluationFailed."""
    distinct = list(dict.fromkeys(row.row for row in rows))
    model = TyreModel(case, evaluator, distinct, known, {}, jobs)
    own = (read_variable(case, name) for name in model.variables)
    x = np.array([each.scaled(values[each.name]) for each in own])
    (answer,) = model.answers([Query(x, constants=True)])
    if not isinstance(answer, Answer):
        raise answer if isinstance(answer, EvaluationFailed) else ValueError(str(answer))
    assert answer.constants is not None
    places = [distinct.index(row.row) for row in rows]
    return answer.jacobian[places], answer.constants[places], model.material_laws


MAX_PRESSURES = 4  # at which a fitted design is evaluated with all sensitivities


class AtBound(ResultPart):
    """Part of a variable in a fit.json."""

    at_bound: bool = False


class FitResponses(ResultPart):
    """Part of a fit.json that predictions need; one of an earlier version has no responses."""

    responses: list[FitResponse] = Field(default=[])
    chi2_per_dof: float | None = None
    prior: bool = False
    variables: dict[str, AtBound] = Field(default={})


def read_responses(path: Path) -> FitResponses:
    """How the fit in a fit.json, or in a folder with one, answers its data. Raises ValueError,
    OSError."""
    return FitResponses.model_validate(read_json(path / "fit.json" if path.is_dir() else path))


def predicted_errors(
    case: LoadedCase,
    evaluator: Evaluator,
    values: Mapping[str, float],
    fit: FitResponses,
    wanted: Sequence[tuple[Label, float]],
    jobs: int = 1,
) -> Array:
    """Standard deviations (m,) of ln f of modes (label, kPa) on the case's rim, as the design
    ``values`` of the fit has them. It is evaluated with its sensitivities to all sources of error
    in the measured states and at ``MAX_PRESSURES`` pressures, between which these are interpolated
    in ln p. Raises DeckRefused, EvaluationFailed; ValueError where a variable is at its bound: no
    linear error holds there, or values on the road were fitted."""
    if held := [name for name, each in fit.variables.items() if each.at_bound]:
        raise ValueError(f"the fit ended with {held[0]} at its bound, where no linear error holds")
    if any(each.load_N for each in fit.responses):
        raise ValueError("it is not computed for a fit to values on the road")
    names = list(case.case.variables)
    measured = tuple(_observable(case, each) for each in fit.responses)
    others = tuple(Observable("frequency_Hz", label, p) for label, p in wanted)
    pressures = sorted({p for _, p in wanted})
    chosen = np.linspace(0, len(pressures) - 1, min(len(pressures), MAX_PRESSURES)).round()
    nodes = [pressures[int(i)] for i in chosen]
    labels = list(dict.fromkeys(label for label, _ in wanted))
    evaluated = tuple(Observable("frequency_Hz", label, p) for label in labels for p in nodes)
    R = np.array([[each.response.get(name, 0.0) for each in fit.responses] for name in names])
    known, _ = sources(case)
    # d ln q / d x and changes of ln q by each source of error, rows as in the tuple
    J, G, laws = linear_answer(case, evaluator, values, (*measured, *evaluated), known, jobs)
    both, n = np.hstack([J, G]), len(measured)
    curves = both[n:].reshape(len(labels), len(nodes), -1)
    there = [_interpolated(curves[labels.index(x)], np.log(nodes), np.log(p)) for x, p in wanted]
    J, G = np.split(np.vstack([both[:n], *there]), [J.shape[1]], axis=1)
    model = model_form((*measured, *others), laws) + G @ G.T
    scatter = np.array([each.scatter for each in fit.responses])
    unseen = np.eye(len(names)) - R @ J[:n]
    unseen *= [read_variable(case, name).spread * fit.prior for name in names]
    variance = prediction_variance(J[n:], R, scatter, model)
    variance += ((J[n:] @ unseen) ** 2).sum(1)
    return np.asarray(np.sqrt(variance * (1.0 if fit.prior else max(1.0, fit.chi2_per_dof or 0.0))))


def prediction_variance(J: Array, R: Array, scatter: Array, model: Array) -> Array:
    """Variances (m,) of ln f' as above; J (m, v): d ln f' / d x, R (v, n), scatter (n,), model
    (n + m, n + m): covariance of form and constants."""
    A = np.hstack([J @ R, -np.eye(len(J))])
    whole = model + np.diag(np.concatenate([scatter**2, np.zeros(len(J))]))
    return np.asarray(np.einsum("ij,jk,ik->i", A, whole, A))


def _interpolated(curve: Array, nodes: Array, at: float) -> Array:
    """Rows (k,) of a curve (nodes, k) between its nodes."""
    return np.array([np.interp(at, nodes, column) for column in curve.T])


def _observable(case: LoadedCase, each: FitResponse) -> Observable:
    if each.label is None:
        return Observable("mass_kg", None, 0.0)
    state = TyreState(each.pressure_kPa, 0.0, each.rim).of(case)
    return Observable("frequency_Hz", each.label, each.pressure_kPa, rim=state.rim)
