"""A case planned: `PlanResult` of a laboratory, its order and its chances.

The order of measurements is greedy, by what an hour adds to the chance of finding an effect. The
chance is the share of drawn tyres, equally many with each effect, whose effect is found. A step
is one item of the menu, or two where they gain more together than each alone: then the better of
the two comes first. The first step is a set of response functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from itertools import combinations

import numpy as np

from ...errors import InputError
from ...measured.case_modes import evaluate_case_modes
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase, start_values
from ...tyre.case.mistakes import suggestion
from ..diagnose.next_measurement import STEP_HOURS
from ..fit.targets import labels_to_measure
from ..inference.expansion import first_points
from ..inference.run_estimate import estimate
from ..inference.separability import APART, GRID_POINTS, VISIBLE, smallest
from ..result import StudyInput
from ..run_plan import RunPlan
from ..sensors import SensorsResult, place
from ..variable import read_variables
from .chance import NONE, Drawn, shares
from .laboratory import Laboratory, laboratory, offer
from .result import (
    LABELLED,
    PLAN_STAGES,
    PlannedEffect,
    PlannedMode,
    PlannedVariable,
    PlanResult,
    PlanStep,
)

Array = np.ndarray


MIN_CHANCE_GAIN = 0.01  # of the chance, below which a step is not worth its hours
PAIRED = 4  # items that are tried in pairs


def order(lab: Laboratory, drawn: Drawn, hours: float = np.inf) -> list[str]:
    """Names of the items in their order, within ``hours``."""
    drawn = drawn.only(np.array(drawn.keys) != NONE)
    known: dict[frozenset[str], float] = {frozenset(): 0.0}

    def chance(done: Sequence[str]) -> float:
        key = frozenset(done)
        if key not in known:
            known[key] = float(lab.linear.found(drawn, lab.rows(sorted(done))).mean())
        return known[key]

    done: list[str] = []
    while step := _next(lab, chance, done, hours):
        done.append(step)
    return done


def _next(
    lab: Laboratory, chance: Callable[[Sequence[str]], float], done: Sequence[str], hours: float
) -> str:
    """The next item, "" if none is worth its hours."""
    fits = lambda *more: lab.hours([*done, *more]) <= hours
    left = [name for name in lab.offered(done) if fits(name)]
    if not done:  # a set of response functions, which alone has a pressure
        left = [name for name in left if lab.menu[name].pressure_kPa is not None]
    gain = lambda *more: chance([*done, *more]) - chance(done)
    steps: dict[tuple[str, ...], float] = {(name,): gain(name) for name in left}
    rate = lambda step: steps[step] / lab.hours(step)
    best = sorted(left, key=lambda name: -rate((name,)))
    for pair in combinations(best[:PAIRED], 2):
        if pair[1] in lab.offered([*done, pair[0]]) and fits(*pair):
            steps[pair] = gain(*pair)
    worth = [step for step in steps if steps[step] >= MIN_CHANCE_GAIN or not done]
    return max(worth, key=rate)[0] if worth else ""  # of a pair the better one: ``best`` falls


TRIED_TYRES, DRAWN_TYRES = 8, 100  # drawn of each effect: to choose steps, and for the chances
NAMED_AS_A_RULE = 25.0  # lambda from which nearly all effects were named in trials
SENSOR_AXES = "rtz"  # that planned sensors measure


def plan(
    given: StudyInput,
    hours: float | None,
    sensors: int | None,
    pressures_kPa: Sequence[float],
    noise: float,
    step_hours: Mapping[str, float],
    stage: Callable[[str], None] = lambda stage: None,
) -> PlanResult:
    """The plan of a case; see `PlanResult.run`. Raises InputError, EvaluationFailed."""
    case, evaluator = given.case, given.evaluator
    for name in step_hours:
        if name not in STEP_HOURS:
            raise InputError(f"'{name}' is no step{suggestion(name, STEP_HOURS)}")
    stage(PLAN_STAGES[0])
    labels, steps = labels_to_measure(case), {**STEP_HOURS, **step_hours}
    placed = _sensors(case, evaluator, labels, sensors) if sensors else None
    confused = [m.label for m in placed.modes if m.labelled < LABELLED] if placed else []
    seen = [label for label in labels if label not in confused]
    if not seen:
        raise InputError(f"{sensors} sensors distinguish none of the modes: give more --sensors")
    lab = laboratory(case, evaluator, seen, pressures_kPa, noise, steps, given.jobs)
    stage(PLAN_STAGES[1])
    linear, limit = lab.linear, np.inf if hours is None else hours
    done = order(lab, linear.draw(TRIED_TYRES, np.random.default_rng(0)), limit)
    if not done:
        least = min(each.hours for each in lab.menu.values() if each.pressure_kPa is not None)
        raise InputError(f"--hours {hours:g} is too short: one set of functions takes {least:g} h")
    drawn = linear.draw(DRAWN_TYRES, np.random.default_rng(1))
    parts = [done[: k + 1] for k in range(len(done))]
    chances = [shares(drawn, linear.found(drawn, lab.rows(part))) for part in parts]
    sound = [each.pop(NONE) for each in chances]
    widths = [_widths(lab, part) for part in ([], *parts)]
    rms = [float(np.sqrt(np.mean(f**2))) for _, f in widths[1:]]
    eta = lab.problem.observations.y[lab.item == "mount"]  # has each mode at the case's pressure
    result = PlanResult(
        format=1,
        noise_percent=100 * noise,
        step_hours=steps,
        steps=[
            PlanStep(
                what=lab.menu[part[-1]].what,
                hours=lab.menu[part[-1]].hours,
                total_hours=lab.hours(part),
                chance=float(np.mean([*chance.values()])),
                predicted_percent=100 * width,
            )
            for part, chance, width in zip(parts, chances, rms, strict=True)
        ],
        effects=_effects(lab, done, chances),
        false_alarm=1 - sound[-1],
        draws=DRAWN_TYRES,
        variables=[
            PlannedVariable(
                name=v.name, before_percent=percent * before, after_percent=percent * after
            )
            for v, before, after in zip(
                read_variables(case), widths[0][0], widths[-1][0], strict=True
            )
            for percent in [100 * v.slope(v.start) / abs(v.start)]
        ],
        modes=[
            PlannedMode(
                **asdict(label),
                frequency_Hz=float(np.exp(ln_f)),
                before_percent=100 * before,
                after_percent=100 * after,
            )
            for label, ln_f, before, after in zip(
                seen, eta, widths[0][1], widths[-1][1], strict=True
            )
        ],
        sensors=placed.places if placed else [],
        axes=placed.axes if placed else "",
        not_labelled=[str(label) for label in confused],
    )
    return result.with_files({"plan.md": result.page()})


def planned(
    case: LoadedCase,
    evaluator: Evaluator,
    sensors: int | None,
    pressures_kPa: Sequence[float],
    jobs: int,
) -> RunPlan:
    """About how often the solver runs for a plan, before it does. Raises InputError."""
    model = offer(case, evaluator, labels_to_measure(case), pressures_kPa).model(
        case, evaluator, jobs
    )
    runs = model.runs(first_points(model, model.start))
    return estimate(model, runs + (1 if sensors else 0), jobs)


def _sensors(
    case: LoadedCase, evaluator: Evaluator, labels: Sequence[Label], count: int
) -> SensorsResult:
    """Places of sensors, and how often they label each mode."""
    highest = max(label.c for label in labels)
    every = evaluate_case_modes(case, evaluator, start_values(case), highest)
    modes = [mode for mode in every.modes if mode.label in labels]
    return place(every, modes, count, SENSOR_AXES, 0.0, 0)


def _widths(lab: Laboratory, done: Sequence[str]) -> tuple[Array, Array]:
    """Standard deviations of the variables x (v,), and of ln f of the modes at the case's pressure,
    without the scatter of a measurement, after some items, if no effect is there."""
    linear, rows = lab.linear, lab.rows(done)
    wanted = np.flatnonzero(lab.item == "mount")
    tyre = linear.covariance.copy()
    tyre[wanted, wanted] -= lab.problem.observations.scatter[wanted] ** 2
    inverse = np.linalg.inv(linear.covariance[np.ix_(rows, rows)])
    J, prior = linear.jacobian[rows], np.diag(lab.problem.spread**2)
    of_x = prior - prior @ J.T @ inverse @ J @ prior
    cross = tyre[np.ix_(wanted, rows)]
    of_f = tyre[np.ix_(wanted, wanted)] - cross @ inverse @ cross.T
    return np.sqrt(np.diag(of_x)), np.sqrt(np.maximum(np.diag(of_f), 0.0))


def _effects(
    lab: Laboratory, done: Sequence[str], chances: Sequence[Mapping[str, float]]
) -> list[PlannedEffect]:
    """Effects by falling chance, with lambda = g^T C^-1 g of the whole plan."""
    linear, rows = lab.linear, lab.rows(done)
    inverse = np.linalg.inv(linear.covariance[np.ix_(rows, rows)])
    square = lambda g: np.einsum("qn,nm,qm->q", g, inverse, g)
    sizes, shifts, lambdas = {}, {}, {}
    for id, nodes in lab.problem.expansion.nodes.items():
        sizes[id] = np.linspace(*nodes.reach, GRID_POINTS)
        shifts[id] = linear.shifts(id, sizes[id])[0][:, rows]
        lambdas[id] = square(shifts[id])
    far = {id: shifts[id][np.argmax(each)] for id, each in lambdas.items()}
    result = [
        PlannedEffect(
            id=id,
            chance=[chance[id] for chance in chances],
            unit=lab.problem.ranges[id].unit,
            base=lab.problem.ranges[id].base,
            largest_lambda=float(each.max()),
            detectable_from=smallest(sizes[id], each, VISIBLE),
            named_from=smallest(sizes[id], each, NAMED_AS_A_RULE),
            similar=[
                other
                for other, g in shifts.items()
                if other != id and square(g - far[id]).min() < APART <= each.max()
            ],
        )
        for id, each in lambdas.items()
    ]
    return sorted(result, key=lambda effect: (-effect.at_end, effect.id))
