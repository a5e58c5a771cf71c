"""Targets on the road: contact areas, lengths and widths, vertical stiffnesses, modes at a load.

Every design is pressed, in each state, at the loads with a target alone, in one run; friction
remembers the loads on the way, which changes a stiffness by 0.2 % at most.

Slopes d q / d variable are in the unit of the quantity q over that of the variable. The solver's
own ones are used if it has them, except for modes at a load. All others are differences: areas,
lengths and widths are reproducible to 1e-12 of themselves, stiffnesses to 1e-10, so that over 1e-5
they have five digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import cast

import numpy as np

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator, PressQuestion
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.evaluate.pressed import Pressed
from ...tyre.case import LoadedCase
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ...tyre.state import without
from ..footprint import footprint_row
from ..loaded import LoadedTyre, load_tyres
from .targets import ValueTarget

Array = np.ndarray
Designs = Sequence[Mapping[str, float]]
Placed = Mapping[int, ValueTarget]  # targets by their places among all
Quantities = dict[int, float]  # values of targets by their places, each in its own unit
PRESS_STEP = 1e-5  # of a variable's coordinate: the root of the precision of a stiffness


def press(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    designs: Designs,
    jobs: int,
) -> Iterator[Array | EvaluationFailed]:
    """The targets' quantities (targets,) of each design, or why a load was not reached."""
    answers: list[list[Quantities | EvaluationFailed]] = [[] for _ in designs]
    for state, modal in dict.fromkeys((t.state.unloaded, bool(t.member)) for t in targets):
        here = {
            place: t
            for place, t in enumerate(targets)
            if (t.state.unloaded, bool(t.member)) == (state, modal)
        }
        in_state = [state.design(case, values) for values in designs]
        ask = _modes if modal else _footprints
        for known, outcome in zip(answers, ask(case, evaluator, here, in_state, jobs), strict=True):
            known.append(outcome)
    for outcomes in answers:
        quantities: Quantities = {}
        for outcome in outcomes:
            if isinstance(outcome, EvaluationFailed):
                yield outcome
                break
            quantities |= outcome
        else:
            yield np.array([quantities[place] for place in range(len(targets))])


def press_with_slopes(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    values: Mapping[str, float],
    names: Sequence[str],
    base: Mapping[str, float],
    jobs: int,
) -> tuple[Array, Array]:
    """Quantities (targets,) of a design, none a mode, and their exact slopes (targets,
    variables) by the variables ``names``; ``base``: the design at whose states the states begin,
    or the design itself, whose other states begin at its first one. ``jobs`` states at a time.
    Raises EvaluationFailed, DeckRefused."""
    quantities, slopes = np.empty(len(targets)), np.zeros((len(targets), len(names)))
    groups = {
        state: {i: t for i, t in enumerate(targets) if t.state.unloaded == state}
        for state in dict.fromkeys(t.state.unloaded for t in targets)
    }
    questions = []
    for state, here in groups.items():
        loads = _loads(here)
        # a variable that sets a number of the state, such as the pressure, has no slope
        left = tuple(without(case, dict.fromkeys(names, 0.0), state.numbers(case)))
        first = next(iter(groups))
        begin: dict[str, float] | None = (first if base == values else state).design(case, base)
        if base == values and _loads(groups[first]) != loads:
            begin = None
        design = state.design(case, values)
        questions.append(PressQuestion(design, loads, gradients=left, base=begin))
    answers = list(evaluator.press_all(questions, jobs))
    for here, question, pressed in zip(groups.values(), questions, answers, strict=True):
        if isinstance(pressed, EvaluationFailed):
            raise pressed
        if pressed.failed:
            raise pressed.failed
        at = {each.load_N: each.slopes for each in pressed.footprints}
        for place, quantity in _of_patches(evaluator, question.values, pressed, here).items():
            own = here[place]
            rates, name = at[own.state.load_N], FOOTPRINT_QUANTITIES[own.quantity].slope
            quantities[place] = quantity
            slopes[place] = [rates[v][name] if v in rates else 0.0 for v in names]
    return quantities, slopes


def _loads(targets: Placed) -> list[float]:
    """Loads (N) of targets, rising."""
    return sorted({t.state.load_N for t in targets.values()})


def _footprints(
    case: LoadedCase, evaluator: Evaluator, targets: Placed, designs: Designs, jobs: int
) -> Iterator[Quantities | EvaluationFailed]:
    """Quantities of the footprint of each design, or why it has none."""
    questions = [PressQuestion(values, _loads(targets)) for values in designs]
    outcomes = evaluator.press_all(questions, jobs)
    for values, outcome in zip(designs, outcomes, strict=True):
        if isinstance(outcome, EvaluationFailed):
            yield outcome
        elif outcome.failed:
            yield outcome.failed
        else:
            yield _of_patches(evaluator, values, outcome, targets)


def _of_patches(
    evaluator: Evaluator, values: Mapping[str, float], pressed: Pressed, targets: Placed
) -> Quantities:
    """Quantities of the footprint at their targets, from one pressed tyre."""
    mesh = cast(TyreDesign, evaluator.design.at(values)).tyre.mesh
    rows = {each.load_N: footprint_row(pressed, each, mesh) for each in pressed.footprints}
    return {
        place: rows[t.state.load_N][FOOTPRINT_QUANTITIES[t.quantity].row]
        for place, t in targets.items()
    }


def _modes(
    case: LoadedCase, evaluator: Evaluator, targets: Placed, designs: Designs, jobs: int
) -> Iterator[Quantities | EvaluationFailed]:
    """Frequencies under load of each design, or why it has none."""
    loads = _loads(targets)
    labels = list(dict.fromkeys(t.member.label for t in targets.values() if t.member))
    named = {str(place): values for place, values in enumerate(designs)}
    for outcome in load_tyres(case, evaluator, named, loads, jobs, labels=labels).values():
        if isinstance(outcome, EvaluationFailed):
            yield outcome
        elif outcome.failed:
            yield outcome.failed
        else:
            yield _at_loads(outcome, targets)


def _at_loads(tyre: LoadedTyre, targets: Placed) -> Quantities | EvaluationFailed:
    """Frequencies (Hz) of a loaded tyre at their targets, or why one is missing."""
    hertz = {(at.load_N, m.member): m.frequency_Hz for at in tyre.loads for m in at.modes}
    for t in targets.values():
        if t.member and (t.state.load_N, t.member) not in hertz:
            return EvaluationFailed("lost_label", f"no {t.member} at {t.state.load_N:g} N")
    return {place: hertz[t.state.load_N, t.member] for place, t in targets.items() if t.member}
