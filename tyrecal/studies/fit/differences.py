"""Slopes from neighbouring designs, where a solver gives none."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.find import neighbours
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

    step: of a coordinate x; ask: the quantities of designs, in their order, or why there are none;
    centre: those of the design itself, evaluated with its neighbours if not known (None).
    One neighbour a variable: above, or below where that lies beyond the bound or has no solution.
    Raises EvaluationFailed where neither has one, or the design itself has none.
    """
    sides = {i: _sides(v, values[v.name], step) for i, v in enumerate(variables)}

    def around(steps: Mapping[int, float]) -> Iterator[Array | EvaluationFailed]:
        """Answers with one coordinate moved each, by its index; sets ``centre`` at first."""
        nonlocal centre
        moved = [(variables[i], step) for i, step in steps.items()]
        designs = [{**values, v.name: v.value(v.scaled(values[v.name]) + s)} for v, s in moved]
        answers = iter(ask(designs if centre is not None else [values, *designs]))
        if centre is None:
            first = next(answers)
            if isinstance(first, EvaluationFailed):
                raise first
            centre = first
        for answer in answers:
            if isinstance(answer, EvaluationFailed) and answer.denied:  # without a licence
                raise answer
            yield answer

    known, columns = neighbours(sides, around), []
    assert centre is not None
    for i in sides:
        step, answer = known[i]
        if isinstance(answer, EvaluationFailed):
            raise answer
        columns.append((answer - centre) / step)
    return centre, np.array(columns).T


def _sides(variable: DesignVariable, value: float, step: float) -> list[float]:
    """Steps of a coordinate that stay within the bounds."""
    x, lower, upper = (variable.scaled(v) for v in (value, variable.lower, variable.upper))
    step = min(step, (upper - lower) / 3)
    return [s for s in (step, -step) if lower <= x + s <= upper]
