"""A case and what was measured, sampled: a box, its emulator, draws, and what they predict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...measured.measurement import Measurement
from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from ..diagnose.covariance import covariance
from ..diagnose.inverse_problem import Assumed, places
from ..diagnose.model import Answer, ModelRow, Query
from ..diagnose.observations import Observable, Observations, observe
from ..diagnose.plain_fit import plain_fit
from ..diagnose.study import check_units
from ..diagnose.tyre_model import TyreModel
from ..diagnose.uncertainties import Source, calibrated, sources
from ..emulator import Emulator, emulator, needs_slopes
from ..fit.calibrate import calibrate
from ..fit.targets import read_targets
from ..fit.variable import DesignVariable, read_variable
from .box import Drawn, grown
from .chains import needs_emcee
from .posterior import Posterior
from .predict import conditional

Array = np.ndarray
SAMPLE_STAGES = ("calibrate", "emulate", "sample", "ask for what is uncertain")
PRESSURE_NAME = "pressure_kPa"
MANY_DRAWS = 100_000  # where nobody says how many
OTHER_PRESSURES = (0.8, 1.2)  # times the case's, where no others are asked for
EACH = (10, 20)  # designs of a box for each of its coordinates; where they are too few
WIDE = 4.5  # standard deviations, of half a box at first
WIDEST_BOX = 0.7  # at first, of ln x: so far it was tried how good an emulator is
ROUGH = 0.2  # of a row's standard deviation in Sigma: what an emulator's 99 % bound may be


@dataclass(frozen=True)
class Sample:
    """Draws, and what they predict at ``rows``: ln f (draws, m) of thinned ones, linear standard
    deviations (m,) beside; rough: the emulator's error over the standard deviation of a measured
    row, the worst one's; noise_Hz: of targets that state none, as the fit leaves it."""

    variables: tuple[DesignVariable, ...]
    units: tuple[str, ...]  # of theirs
    observations: Observations
    sources: tuple[Source, ...]  # of error
    drawn: Drawn
    rows: tuple[Observable, ...]
    ln_f: Array
    linear: Array
    rough: float
    noise_Hz: float | None


def run(
    case: LoadedCase,
    evaluator: Evaluator,
    readings: Sequence[Measurement] | None,
    draws: int,
    seed: int = 0,
    at_kPa: Sequence[float] = (),
    jobs: int = 1,
    stage: Callable[[str], None] = lambda stage: None,
) -> Sample:
    """Sample the case's variables under ``readings``; None: under its targets.

    at_kPa: pressures to predict at beside those of the case and of the readings, ``()``: a fifth
    below and above the case's. Raises InputError; EvaluationFailed where the start or the first box
    cannot be evaluated.
    """
    check(case, evaluator, readings)
    stage(SAMPLE_STAGES[0])
    noise = None if readings is not None else noise_of_targets(case, evaluator)
    if readings is None:
        readings = targets_as_readings(case, noise)
    observations = observe(modal(readings), split=Assumed().split)
    known: list[ModelRow] = list(
        dict.fromkeys((r.label, r.pressure_kPa) for r in observations.rows)
    )
    found, _ = sources(case)
    model = TyreModel(case, evaluator, known, found, {}, jobs)
    check_units(model, observations, ["what was measured"])
    where = places(observations, known)
    x = plain_fit(model, observations, where)
    answer = _answer(model, x)
    assert answer.constants is not None
    constants = answer.constants[where]
    sigma = covariance(observations, constants)
    spread, white = np.sqrt(np.diag(sigma)), np.linalg.inv(np.linalg.cholesky(sigma))

    pressures = _pressures(case, model.pressures, at_kPa)
    variables = tuple(read_variable(n, v) for n, v in model.case.case.variables.items())
    bounds = np.array([[v.scaled(v.lower), v.scaled(v.upper)] for v in variables])
    ends = DesignVariable(PRESSURE_NAME, case.case.pressure_kPa, min(pressures), max(pressures))
    states = np.array([[ends.scaled(p)] for p in pressures])[:, : len(pressures) > 1]
    asked = (*variables, *[ends] * states.shape[1])
    labels = sorted({row.label for row in observations.rows if row.label}, key=str)

    before: Emulator | None = None

    def ask(box: Array) -> Posterior:
        nonlocal before
        whole = np.vstack([box, *[states[[0, -1]].T] * states.shape[1]])
        for each in EACH:
            count = each * len(asked)
            made = before = emulator(model.evaluator, asked, whole, labels, count, jobs, before)
            at = rows_of(observations.rows, made.labels, pressures)
            if (made.stated_errors[at[:, 1]] <= ROUGH * spread).all():
                break
        return Posterior(made, states, at, observations.y, white, box)

    J = white @ answer.jacobian[where]
    drawn = grown(
        ask,
        first_box(x, J.T @ J, variables, bounds),
        bounds,
        ROUGH * spread,
        draws,
        seed,
        lambda sampling: stage(SAMPLE_STAGES[1 + sampling]),
    )
    stage(SAMPLE_STAGES[3])
    posterior, best = drawn.posterior, drawn.optima[0]
    rows = tuple(
        Observable("frequency_Hz", label, p)
        for p in pressures
        for label in posterior.emulator.labels
    )
    others: list[ModelRow] = [(row.label, row.pressure_kPa) for row in rows]
    there = _answer(TyreModel(case, evaluator, others, found, {}, jobs), best)
    assert there.constants is not None
    given = conditional(observations.rows, sigma, constants, rows, there.constants)
    at = rows_of(rows, posterior.emulator.labels, pressures)
    thin = drawn.chains.thinned
    off = observations.y - posterior.ln_f(thin, posterior.rows)
    J, other = (posterior.slopes(best[None], which)[0] for which in (posterior.rows, at))
    return Sample(
        variables,
        tuple(map(model.unit, model.variables)),
        observations,
        tuple(found),
        drawn,
        rows,
        given.drawn(posterior.ln_f(thin, at), off, seed),
        given.sigma(J, other, drawn.covariance),
        float((posterior.emulator.stated_errors[posterior.rows[:, 1]] / spread).max()),
        noise,
    )


def check(case: LoadedCase, evaluator: Evaluator, readings: Sequence[Measurement] | None) -> None:
    """Raises InputError where nothing can be sampled, before anything is evaluated."""
    needs_emcee()
    needs_slopes(evaluator)
    if not case.case.variables:
        raise InputError("the case has no variables: there is nothing to sample")
    if PRESSURE_NAME in calibrated(case):
        raise InputError(
            "a variable of the case sets pressure_kPa, which the measurements state: take it out"
            " of the variables"
        )
    if not (read_targets(case) if readings is None else modal(readings)):
        raise InputError("there is no frequency of the unloaded tyre to sample the variables by")


def modal(readings: Sequence[Measurement]) -> list[Measurement]:
    """The frequencies of the unloaded tyre."""
    return [each for each in readings if each.quantity == "frequency_Hz" and not each.load_N]


def noise_of_targets(case: LoadedCase, evaluator: Evaluator) -> float | None:
    """Standard deviation, Hz, that a fit leaves to targets without one; None where all have one.

    Raises InputError where too few targets are left over to tell.
    """
    if all(target.sigma_Hz for target in read_targets(case)):
        return None
    noise = calibrate(case, evaluator).found.noise_Hz
    if noise is None:
        raise InputError(
            "the targets have no sigma_Hz, and are too few to tell it from what a fit leaves: give"
            " it to them, or measurements by --measured"
        )
    return noise


def targets_as_readings(case: LoadedCase, noise_Hz: float | None) -> list[Measurement]:
    """The case's target modes that have a weight, as they were measured, on its own rim."""
    return [
        Measurement(
            "frequency_Hz",
            target.label,
            "",
            target.state.told(case).pressure_kPa or 0.0,
            0.0,
            target.frequency_Hz,
            target.sigma_Hz or noise_Hz or 0.0,
        )
        for target in read_targets(case)
        if target.weight and not target.state.rim
    ]


def first_box(
    x: Array, information: Array, variables: Sequence[DesignVariable], bounds: Array
) -> Array:
    """Ends (v, 2) about x (v,), `WIDE` linear standard deviations to either side within the bounds,
    and at most `WIDEST_BOX`, or that share of a linear variable's bounds."""
    x = np.clip(x, bounds[:, 0], bounds[:, 1])
    widest = np.array([WIDEST_BOX if v.log else WIDEST_BOX / 2 for v in variables])
    covariance = np.linalg.inv(information + np.diag((WIDE / widest) ** 2))
    half = WIDE * np.sqrt(np.diag(covariance))
    return np.clip(np.stack([x - half, x + half], 1), bounds[:, :1], bounds[:, 1:])


def rows_of(
    rows: Sequence[Observable], labels: Sequence[object], pressures: Sequence[float]
) -> Array:
    """Places (n, 2) of rows among pressures and an emulator's labels."""
    return np.array([[pressures.index(r.pressure_kPa), labels.index(r.label)] for r in rows])


def _answer(model: TyreModel, x: Array) -> Answer:
    (answer,) = model.answers([Query(x, constants=True)])
    if isinstance(answer, Exception):
        raise answer
    return answer


def _pressures(case: LoadedCase, measured: Sequence[float], at_kPa: Sequence[float]) -> list[float]:
    """Of the measurements, the case, and those asked for, rising."""
    own = case.case.pressure_kPa
    return sorted({*measured, own, *(at_kPa or [factor * own for factor in OTHER_PRESSURES])})
