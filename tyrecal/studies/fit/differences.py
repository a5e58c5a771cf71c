"""Slopes from neighbouring designs, where a solver gives none."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from ..variable import DesignVariable

Array = np.ndarray
DesignValues = Mapping[str, float]
Ask = Callable[[Sequence[DesignValues]], Iterable[Array | EvaluationFailed]]


def differences(
    variables: Sequence[DesignVariable],
    values: DesignValues,
    step: float,
    ask: Ask,
    centre: Array | None = None,
) -> tuple[Array, Array]:
    """Quantities q (q,) of a design and their slopes d q / d x (q, variables).

    ask: the quantities of designs, in their order, or why there are none; centre: those of the
    design itself, which is asked for together with its neighbours where they are not known.
    One neighbour a variable: above, or below where that lies beyond the bound or has no solution.
    Raises EvaluationFailed where neither has one, or the design itself has none.
    """
    columns: dict[int, Array] = {}
    failures: dict[int, EvaluationFailed] = {}
    sides = [_sides(v, values[v.name], step) for v in variables]
    for side in (0, 1):
        pending = [i for i, steps in enumerate(sides) if i not in columns and side < len(steps)]
        if not pending:
            break
        designs = [
            {**values, v.name: v.value(v.scaled(values[v.name]) + sides[i][side])}
            for i, v in enumerate(variables)
            if i in pending
        ]
        answers = iter(ask(designs if centre is not None else [values, *designs]))
        if centre is None:
            first = next(answers)
            if isinstance(first, EvaluationFailed):
                raise first
            centre = first
        for i, answer in zip(pending, answers, strict=True):
            if isinstance(answer, EvaluationFailed):
                if answer.denied:
                    raise answer
                failures[i] = answer
                continue
            columns[i] = (answer - centre) / sides[i][side]
    for i in range(len(variables)):
        if i not in columns:
            raise failures[i]
    assert centre is not None  # a variable has room on one side at least
    return centre, np.array([columns[i] for i in range(len(variables))]).T


def _sides(variable: DesignVariable, value: float, step: float) -> list[float]:
    """Steps of a coordinate that stay within the bounds."""
    x, lower, upper = (variable.scaled(v) for v in (value, variable.lower, variable.upper))
    step = min(step, (upper - lower) / 3)
    return [s for s in (step, -step) if lower <= x + s <= upper]
