"""Slopes of frequencies from neighbouring designs, where a solver gives none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..evaluate.failure import EvaluationFailed

if TYPE_CHECKING:
    from .problem import Problem, Variable

Array = np.ndarray
STEP = 1e-4  # of a logarithm: best between truncation and the solver's digits


def differences(problem: Problem, values: Mapping[str, float], frequencies: Array) -> Array:
    """d f / d x, Hz (targets, variables), about a design whose ``frequencies`` are known.

    One neighbour a variable: above, or below where that lies beyond the bound or has no solution.
    Raises EvaluationFailed where neither has one.
    """
    columns: dict[int, Array] = {}
    failures: dict[int, EvaluationFailed] = {}
    variables, step = problem.variables, problem.difference_step or STEP
    sides = [_sides(v, values[v.name], step) for v in variables]
    for side in (0, 1):
        asked = [i for i, steps in enumerate(sides) if i not in columns and side < len(steps)]
        if not asked:
            break
        designs = [
            {**values, v.name: v.value(v.scaled(values[v.name]) + sides[i][side])}
            for i, v in enumerate(variables)
            if i in asked
        ]
        for i, answer in zip(asked, problem.modes(designs), strict=True):
            if isinstance(answer, EvaluationFailed):
                if answer.cause == "licence":  # says nothing about the design
                    raise answer
                failures[i] = answer
                continue
            shifted = np.array([answer[1][t.label].frequency_Hz for t in problem.targets])
            columns[i] = (shifted - frequencies) / sides[i][side]
    for i in range(len(variables)):
        if i not in columns:
            raise failures[i]
    return np.array([columns[i] for i in range(len(variables))]).T


def _sides(variable: Variable, value: float, step: float) -> list[float]:
    """Steps of a coordinate that stay within the bounds."""
    x, lower, upper = (variable.scaled(v) for v in (value, variable.lower, variable.upper))
    step = min(step, (upper - lower) / 3)
    return [s for s in (step, -step) if lower <= x + s <= upper]
