"""Targets on the road: contact areas, vertical stiffnesses and modes at a load.

Every design is pressed, in each state, at all loads of the case's road up to the last one with a
target, in one run, for friction remembers the loads on the way; for modes at their loads alone.

Areas are reproducible to 1e-12 of themselves, stiffnesses to 1e-10, so slopes over 1e-5 have five
digits. The bundled solver's are smooth; another's may jump as nodes come to touch or to slide, by a
node's share of the patch at most. The small step sees the slope of a piece; a jump between two
neighbours is rare, and known by its steepness.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.evaluate.pressed import Pressed
from ...tyre.case import LoadedCase
from ..footprint import footprint_row
from ..loaded import LoadedTyre, load_tyres
from .targets import ValueTarget

Array = np.ndarray
Designs = Sequence[Mapping[str, float]]
Placed = Mapping[int, ValueTarget]  # targets by their places among all
Quantities = dict[int, tuple[float, float]]  # by place, and by which share of itself it may jump
PRESS_STEP = 1e-5  # of a scaled variable: the root of the precision of a stiffness
MAX_SLOPE = 20.0  # d ln q / d x; a jump of 0.1 % within a step is 100
ROW = {"contact_area_m2": "area_m2"}  # quantities with another name in a row of a footprint


def press(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    designs: Designs,
    jobs: int,
) -> Iterator[Array | EvaluationFailed]:
    """Of each design the targets' quantities and, behind them, by which share of itself each may
    jump (2 targets,): a touching node's share of the patch; or why a load was not reached."""
    answers: list[list[Quantities | EvaluationFailed]] = [[] for _ in designs]
    for state, modal in dict.fromkeys((t.state.unloaded, bool(t.member)) for t in targets):
        here = {
            place: t
            for place, t in enumerate(targets)
            if (t.state.unloaded, bool(t.member)) == (state, modal)
        }
        asked = [state.design(case, values) for values in designs]
        ask = _modes if modal else _footprints
        for known, outcome in zip(answers, ask(case, evaluator, here, asked, jobs), strict=True):
            known.append(outcome)
    for outcomes in answers:
        found: Quantities = {}
        for outcome in outcomes:
            if isinstance(outcome, EvaluationFailed):
                yield outcome
                break
            found |= outcome
        else:
            yield np.array([found[place] for place in range(len(targets))]).T.ravel()


def _footprints(
    case: LoadedCase, evaluator: Evaluator, targets: Placed, designs: Designs, jobs: int
) -> Iterator[Quantities | EvaluationFailed]:
    measured = {t.state.load_N for t in targets.values()}
    loads = sorted({*measured, *(x for x in case.case.road.loads_N if x <= max(measured))})
    for values, outcome in zip(designs, evaluator.press_all(designs, loads, jobs), strict=True):
        if isinstance(outcome, EvaluationFailed):
            yield outcome
        elif outcome.failed:
            yield outcome.failed
        else:
            yield _of_patches(case, values, outcome, targets)


def _of_patches(
    case: LoadedCase, values: Mapping[str, float], pressed: Pressed, targets: Placed
) -> Quantities:
    mesh = TyreDesign(case, values).tyre.mesh
    rows = {each.load_N: footprint_row(pressed, each, mesh) for each in pressed.footprints}
    share = {each.load_N: 1 / len(each.node) for each in pressed.footprints}
    return {
        place: (rows[t.state.load_N][ROW.get(t.quantity, t.quantity)], share[t.state.load_N])
        for place, t in targets.items()
    }


def _modes(
    case: LoadedCase, evaluator: Evaluator, targets: Placed, designs: Designs, jobs: int
) -> Iterator[Quantities | EvaluationFailed]:
    loads = sorted({t.state.load_N for t in targets.values()})
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
    hertz = {(at.load_N, m.member): m.frequency_Hz for at in tyre.loads for m in at.modes}
    for t in targets.values():
        if t.member and (t.state.load_N, t.member) not in hertz:
            return EvaluationFailed("lost_label", f"no {t.member} at {t.state.load_N:g} N")
    return {
        place: (hertz[t.state.load_N, t.member], 0.0) for place, t in targets.items() if t.member
    }
