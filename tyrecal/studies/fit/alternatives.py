"""How frequencies would move if the tyre had been in another state than stated, at a fitted design.

Evaluated only after a fit that does not fit: another pressure in one of several states, another
rim, and a freely hanging wheel with another mass than the default one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...simulate.modes.find import LabelledModes
from ...simulate.modes.label import Label
from ...tyre.state import PRESSURE_PATH, RIMS, TyreState, pressure_name
from .problem import Point, Problem
from .states import is_possible
from .verdict import Shift

Array = np.ndarray
# numbers of the case's rim that matter if it is free
WHEEL = ("mass_kg", "polar_inertia_kg_m2", "diametral_inertia_kg_m2")


def other_states(problem: Problem, point: Point, keep: Array) -> list[Shift]:
    """Shifts of the rows of a mask ``keep`` (n,) of what was measured; none where the solver gives
    no exact sensitivities. An alternative that cannot be evaluated is left out. Raises
    DeckRefused."""
    states = [state for state, labels in problem.labels.items() if labels]
    if problem.difference_step is not None or not states:
        return []
    wheel = _default_wheel(problem)
    defaults = {name: getattr(problem.case.case.rim, name.removeprefix("rim.")) for name in wheel}
    own_pressure = pressure_name(problem.case) == PRESSURE_PATH
    questions: list[tuple[Mapping[str, float], tuple[str, ...]]] = []
    for state in states:
        stated = state.with_defaults(problem.case)
        numbers = {PRESSURE_PATH: stated.pressure_kPa or 0.0} if own_pressure else {}
        numbers |= defaults if stated.rim == "free" else {}
        design = {**problem.question(point.values, state, ())[0], **numbers}
        questions.append((design, tuple(numbers)))
    labels = [problem.labels[state] for state in states]
    rates: dict[tuple[TyreState, str], Array] = {}  # d ln f / d ln number, of all rows
    answers = problem.modes_of(questions, labels)
    for state, answer, (values, names) in zip(states, answers, questions, strict=True):
        if not isinstance(answer, LabelledModes):
            continue
        for name in names:
            slopes = values[name] * answer.evaluation.gradients[name]  # d f / d ln number, Hz
            by_label = {
                label: float(slopes[mode.position]) / mode.frequency_Hz
                for label, mode in answer.wanted.items()
            }
            rates[state, name] = _column(problem, state, by_label)[keep]
    return [
        *_pressures(problem, rates),
        *_wheel(problem, rates, wheel, defaults),
        *_rims(problem, point, states, keep),
    ]


def _column(problem: Problem, state: TyreState, by_label: Mapping[Label, float]) -> Array:
    """A column (n,): the number of each row measured in a state, by its label; 0 for other rows."""
    column = np.zeros(len(problem.measured))
    for i, target in enumerate(problem.targets):
        if target.state == state:
            column[i] = by_label[target.label]
    return column


def _pressures(problem: Problem, rates: Mapping[tuple[TyreState, str], Array]) -> Iterator[Shift]:
    """Each state at another pressure, if there are several: the variables can take the place of the
    only one."""
    states = [state for state, name in rates if name == PRESSURE_PATH]
    several = len({state.with_defaults(problem.case).pressure_kPa for state in states}) > 1
    for (state, name), column in rates.items():
        if several and name == PRESSURE_PATH:
            stated = state.with_defaults(problem.case)
            yield Shift(
                "pressure", column[:, None], np.zeros(len(column)), partial(_pressure_words, stated)
            )


def _pressure_words(stated: TyreState, amounts: Array) -> str:
    pressure = (stated.pressure_kPa or 0.0) * float(np.exp(amounts[0]))
    return (
        f"the frequencies at {stated.pressure_kPa:g} kPa (rim {stated.rim}) go with"
        f" {pressure:.3g} kPa: was that the pressure?"
    )


def _default_wheel(problem: Problem) -> list[str]:
    """Paths of the wheel's numbers that the case does not state."""
    case = problem.case
    stated = case.file_data.get("rim") or {}
    paths = [f"rim.{name}" for name in WHEEL if name not in stated]
    return [path for path in paths if path not in case.overrides]


def _wheel(
    problem: Problem,
    rates: Mapping[tuple[TyreState, str], Array],
    wheel: Sequence[str],
    defaults: Mapping[str, float],
) -> Iterator[Shift]:
    """Other values of the free wheel's numbers that the case does not state, one for each."""
    # a state's column is 0 for the rows of all others, so that their sum is that of all states
    of_number = [[column for (_, name), column in rates.items() if name == path] for path in wheel]
    if wheel and all(of_number):
        columns = np.column_stack([np.sum(each, axis=0) for each in of_number])
        words = partial(_wheel_words, list(wheel), list(defaults.values()))
        yield Shift("wheel", columns, np.zeros(len(columns)), words)


def _wheel_words(paths: Sequence[str], defaults: Sequence[float], amounts: Array) -> str:
    likely = [value * float(np.exp(a)) for value, a in zip(defaults, amounts, strict=True)]
    pairs = zip(paths, defaults, likely, strict=True)
    numbers = ", ".join(f"{path} {old:g} (likely {new:.3g})" for path, old, new in pairs)
    return f"the free wheel has default values that matter: {numbers}: what does yours weigh?"


def _rims(
    problem: Problem, point: Point, states: Sequence[TyreState], keep: Array
) -> Iterator[Shift]:
    """Every rim that was stated taken for another one."""
    case = problem.case
    for stated in dict.fromkeys(state.with_defaults(case).rim for state in states):
        here = [state for state in states if state.with_defaults(case).rim == stated]
        for rim in RIMS:
            there = [replace(state.with_defaults(case), rim=rim).of(case) for state in here]
            if rim == stated or not all(is_possible(problem, state) for state in there):
                continue
            questions = [problem.question(point.values, state, ()) for state in there]
            answers = problem.modes_of(questions, [problem.labels[state] for state in here])
            shift = np.zeros(len(problem.measured))
            for state, answer in zip(here, answers, strict=True):
                if not isinstance(answer, LabelledModes):
                    break
                before, after = point.states[state], answer.wanted
                ratios = {x: after[x].frequency_Hz / before[x].frequency_Hz for x in before}
                shift += _column(problem, state, {x: np.log(r) for x, r in ratios.items()})
            else:
                nothing = np.empty((int(keep.sum()), 0))
                yield Shift("rim", nothing, shift[keep], partial(_rim_words, stated, rim))


def _rim_words(stated: str | None, rim: str, _: Array) -> str:
    return (
        f"the frequencies measured with the rim {stated} go with a rim that is {rim}: how was the"
        " wheel held?"
    )
