"""A case and what was measured, sampled: a box, its emulator, draws, and what they predict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import Json
from ...measured.measurement import Measurement
from ...measured.targets import in_states, readings_of
from ...simulate.deck.decks_design import design_of
from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from ...tyre.case.parts import RimSupport
from ...tyre.effects.edit import changed
from ...tyre.state import AS_THE_CASE, SPRINGS, WHEEL_FREE, TyreState
from ...tyre.values import set_values
from ..emulator import Emulator, emulator
from ..fit.calibrate import noise_Hz
from ..fit.problem import Problem
from ..fit.targets import is_loss_factor, read_targets, rims_of
from ..inference.check_units import check_units
from ..inference.covariance import covariance
from ..inference.inverse_problem import Assumed, places
from ..inference.model import Answer, Query
from ..inference.observations import Observable, Observations, observe
from ..inference.plain_fit import plain_fit
from ..inference.run_estimate import estimate, model_of, selection_runs
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source, calibrated, sources
from ..result import StudyInput
from ..run_plan import RunPlan, runs_in_words
from ..variable import DesignVariable, read_variables
from .box import Draws, grow_box
from .chains import needs_emcee
from .posterior import Posterior
from .predict import conditional

Array = np.ndarray
SAMPLE_STAGES = ("calibrate", "emulate", "sample", "evaluate the uncertain numbers")
PRESSURE_NAME = "pressure_kPa"
MANY_DRAWS = 100_000  # where nobody says how many
OTHER_PRESSURES = (0.8, 1.2)  # times the case's, where no others are asked for
EACH = (10, 20)  # designs of a box for each of its coordinates; where they are too few
WIDE = 4.5  # standard deviations, of half a box at first
WIDEST_BOX = 0.7  # at first, of ln x: so far it was tried how good an emulator is
ROUGH = 0.2  # of a row's standard deviation in Sigma: above, twice as many designs are evaluated
# An emulator's rms error, of that standard deviation, up to which it is an error among others:
# cords that go slack make frequencies jump, which no polynomial follows. It is 12 % larger then.
MAX_EMULATOR_ERROR = 0.5


@dataclass(frozen=True)
class Sample:
    """Draws, and what they predict at ``rows``."""

    variables: tuple[DesignVariable, ...]
    units: tuple[str, ...]  # of theirs
    observations: Observations
    sources: tuple[Source, ...]  # of error
    drawn: Draws
    rows: tuple[Observable, ...]
    ln_f: Array  # (draws, m) of thinned draws
    linear: Array  # (m,) standard deviations by the linear theory
    # the emulator's error over the standard deviation of a measured row, the worst one's
    rough: float
    noise_Hz: float | None  # of targets that state none, as the fit leaves it
    # share by which the emulator's error makes the worst measured row's deviation larger
    widened: float = 0.0
    left_out: tuple[str, ...] = ()  # variables that set loss factors alone


def run(
    given: StudyInput,
    readings: Sequence[Measurement] | None,
    draws: int,
    seed: int = 0,
    at_kPa: Sequence[float] = (),
    stage: Callable[[str], None] = lambda stage: None,
    say: Callable[[str], None] = lambda words: None,
) -> Sample:
    """Sample the case's variables under ``readings``; None: under its targets.

    at_kPa: pressures to predict at beside those of the case and of the readings, ``()``: a fifth
    below and above the case's; on every rim that the case or a reading has; say: hears how long it
    takes where the solver gives no exact sensitivities. Raises InputError; EvaluationFailed where
    the start or the first box cannot be evaluated.
    """
    check(given.case, readings)
    case, left_out = without_losses(given.case)
    evaluator, jobs = given.evaluator, given.jobs
    stage(SAMPLE_STAGES[0])
    noise = None if readings is not None else noise_Hz(Problem(case, evaluator))
    if readings is None:
        readings = targets_as_readings(case, noise)
    observations = observe(modal(readings), split=Assumed().split)
    known = list(dict.fromkeys(row.row for row in observations.rows))
    own_sources, _ = sources(case)
    model = TyreModel(case, evaluator, known, own_sources, {}, jobs)
    pressures = _pressures(case, {row.pressure_kPa for row in observations.rows}, at_kPa)
    rims = list(dict.fromkeys([None, *(row.rim for row in observations.rows)]))
    if not evaluator.has_gradients:
        say(runs_in_words(evaluator, model.first_design, _runs(model, len(rims)), jobs))
    check_units(model, observations, ["what was measured"])
    where = places(observations, known)
    x = plain_fit(model, observations, where)
    answer = _answer(model, x)
    assert answer.constants is not None
    constants = answer.constants[where]
    sigma = covariance(observations, constants, model.material_laws)
    spread, white = np.sqrt(np.diag(sigma)), whitening(sigma)

    tyres = [_held(model, rim) for rim in rims]
    variables = tuple(read_variables(model.case))
    bounds = np.array([[v.scaled(v.lower), v.scaled(v.upper)] for v in variables])
    ends = DesignVariable(PRESSURE_NAME, case.case.pressure_kPa, min(pressures), max(pressures))
    states = [TyreState(p, 0.0, rim) for rim in rims for p in pressures]
    others = [ends] * (len(pressures) > 1)  # coordinates beside the variables
    coordinates = np.array(
        [[rims.index(s.rim), *(v.scaled(s.pressure_kPa or 0.0) for v in others)] for s in states]
    )
    labels = sorted({row.label for row in observations.rows if row.label}, key=str)
    on_rim = [np.array([row.rim == rim for row in observations.rows]) for rim in rims]
    before: list[Emulator | None] = [None] * len(rims)

    def made_on(rim: int, box: Array) -> Emulator:
        whole = np.vstack([box, *([[v.scaled(v.lower), v.scaled(v.upper)]] for v in others)])
        own = [row.label for row, here in zip(observations.rows, on_rim[rim], strict=True) if here]
        for each in EACH:
            numbers = (*variables, *others)
            made = before[rim] = emulator(
                tyres[rim], numbers, whole, labels, each * len(numbers), jobs, before[rim]
            )
            errors = made.stated_errors[[made.labels.index(label) for label in own if label]]
            if (errors <= ROUGH * spread[on_rim[rim]]).all():
                break
        return made

    def ask(box: Array) -> Posterior:
        made = tuple(made_on(rim, box) for rim in range(len(rims)))
        at = rows_of(observations.rows, states, [made[rims.index(s.rim)].labels for s in states])
        alone = Posterior(made, coordinates, at, observations.y, white, box)
        return replace(alone, whitened=whitening(sigma + alone.emulator_covariance))

    J = white @ answer.jacobian[where]
    drawn = grow_box(
        ask,
        first_box(x, J.T @ J, variables, bounds),
        bounds,
        MAX_EMULATOR_ERROR * spread,
        draws,
        seed,
        lambda sampling: stage(SAMPLE_STAGES[1 + sampling]),
    )
    stage(SAMPLE_STAGES[3])
    posterior, best = drawn.posterior, drawn.optima[0]
    known_in = [posterior.emulators[rims.index(state.rim)].labels for state in states]
    rows = tuple(
        Observable("frequency_Hz", label, state.pressure_kPa or 0.0, rim=state.rim)
        for state, own in zip(states, known_in, strict=True)
        for label in own
    )
    asked_of = [row.row for row in rows]
    there = _answer(TyreModel(case, evaluator, asked_of, own_sources, {}, jobs), best)
    total = sigma + posterior.emulator_covariance
    assert there.constants is not None
    under_data = conditional(
        observations.rows, total, constants, rows, there.constants, model.material_laws
    )
    at = rows_of(rows, states, known_in)
    thin = drawn.chains.thinned
    off = observations.y - posterior.ln_f(thin, posterior.rows)
    J, other = (posterior.slopes(best[None], which)[0] for which in (posterior.rows, at))
    return Sample(
        variables,
        tuple(map(model.designs.unit, model.variables)),
        observations,
        tuple(own_sources),
        drawn,
        rows,
        under_data.drawn(posterior.ln_f(thin, at), off, seed),
        under_data.sigma(J, other, drawn.covariance),
        float((posterior.stated_errors / spread).max()),
        noise,
        float((np.sqrt(np.diag(total)) / spread).max()) - 1,
        left_out,
    )


def planned(
    case: LoadedCase, evaluator: Evaluator, readings: Sequence[Measurement] | None, jobs: int
) -> RunPlan:
    """About how often the solver runs, before it does."""
    case, _ = without_losses(case)
    rows = targets_as_readings(case, None) if readings is None else modal(readings)
    model = model_of(case, evaluator, rows)
    return estimate(model, _runs(model, len({None, *(row.rim for row in rows)})), jobs)


def _runs(model: TyreModel, rims: int) -> int:
    """About how many runs: the calibration, one box for each rim, and what is predicted. Almost
    always there are several pressures, which count as a coordinate of a box."""
    count = len(model.start) + 1
    each = 1 if model.evaluator.has_gradients else 1 + count
    return rims * EACH[0] * count * each + selection_runs(model)


def whitening(sigma: Array) -> Array:
    """W (n, n) with W^T W = Sigma^-1."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(sigma)))


def check(case: LoadedCase, readings: Sequence[Measurement] | None) -> None:
    """Raises InputError where nothing can be sampled, before anything is evaluated."""
    needs_emcee()
    if not read_variables(without_losses(case)[0]):
        raise InputError(
            "the case has no variables that move a frequency: there is nothing to sample"
        )
    if PRESSURE_NAME in calibrated(case):
        raise InputError(
            "a variable of the case sets pressure_kPa, which the measurements state: take it out"
            " of the variables"
        )
    rims = {reading.rim for reading in readings or targets_as_readings(case, None)} - {None}
    for name, variable in case.case.variables.items():
        if rims and not {*SPRINGS, WHEEL_FREE}.isdisjoint(variable.sets):
            raise InputError(
                f"{name} sets the rim's compliance, and the measurements have several rims: take"
                " it out of the variables, or take the other rims out of the file"
            )
    if not (read_targets(case) if readings is None else modal(readings)):
        raise InputError("there is no frequency of the unloaded tyre to sample the variables by")


def without_losses(case: LoadedCase) -> tuple[LoadedCase, tuple[str, ...]]:
    """The case without the variables that set loss factors alone, and their names: frequencies, by
    which variables are sampled, do not depend on them."""
    every = case.case.variables
    names = tuple(name for name, each in every.items() if all(map(is_loss_factor, each.sets)))
    kept = {name: each for name, each in every.items() if name not in names}
    return changed(case, variables=kept), names


def measured_readings(case: LoadedCase, measured: Path | None = None) -> list[Measurement] | None:
    """Readings of the file, by default the one that the case's targets stand in; None: they stand
    in the case. Raises InputError, OSError."""
    path = measured or case.measured
    return in_states(case, readings_of(case, path)) if path else None


def states_sampled(case: LoadedCase, readings: Sequence[Measurement] | None) -> Json:
    """The states of the readings, or of the case's targets, as `provenance` takes them."""
    rows = targets_as_readings(case, None) if readings is None else modal(readings)
    states = [each.state for each in rows]
    several = any(each.rim for each in states)
    return {"load_N": 0.0, "rim": rims_of(case, [AS_THE_CASE, *states]) if several else ()}


def modal(readings: Sequence[Measurement]) -> list[Measurement]:
    """The frequencies of the unloaded tyre."""
    return [each for each in readings if each.quantity == "frequency_Hz" and not each.load_N]


def targets_as_readings(case: LoadedCase, noise_Hz: float | None) -> list[Measurement]:
    """The case's target modes that have a weight, as they were measured."""
    return [
        Measurement(
            "frequency_Hz",
            target.label,
            "",
            target.state.with_defaults(case).pressure_kPa or 0.0,
            0.0,
            target.frequency_Hz,
            target.sigma_Hz or noise_Hz or 0.0,
            rim=target.state.rim,
        )
        for target in read_targets(case)
        if target.weight
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
    rows: Sequence[Observable], states: Sequence[TyreState], labels: Sequence[Sequence[object]]
) -> Array:
    """Places (n, 2) of rows among states and the labels of the state's emulator."""
    where = [states.index(row.state) for row in rows]
    return np.array([[k, labels[k].index(r.label)] for k, r in zip(where, rows, strict=True)])


def _held(model: TyreModel, rim: RimSupport | None) -> Evaluator:
    """The evaluator of the tyre with its rim so; None: as the case has it."""
    held = TyreState(rim=rim).numbers(model.case)
    return model.evaluator.of(design_of(set_values(model.case, held))) if held else model.evaluator


def _answer(model: TyreModel, x: Array) -> Answer:
    (answer,) = model.answers([Query(x, constants=True)])
    if isinstance(answer, Exception):
        raise answer
    return answer


def _pressures(case: LoadedCase, measured: Iterable[float], at_kPa: Sequence[float]) -> list[float]:
    """Pressures of the measurements, of the case, and those requested, rising."""
    own = case.case.pressure_kPa
    return sorted({*measured, own, *(at_kPa or [factor * own for factor in OTHER_PRESSURES])})
