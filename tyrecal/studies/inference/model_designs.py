"""Designs of a case in the coordinates x of its variables, and in each measured state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import exp, log

import numpy as np

from ...tyre.case import LoadedCase, start_values
from ...tyre.number_units import EFFECT_PATH, unit_of
from ...tyre.state import TyreState, without
from ..variable import read_variables

Array = np.ndarray


class ModelDesigns:
    """Numbers of the case by name or path, at x (v,): ln of a variable, of a linear one its place
    between the bounds. Bounds are not enforced."""

    def __init__(self, case: LoadedCase, constants: Mapping[str, float]):
        self._case, self._variables = case, case.case.variables
        self.names = list(self._variables)
        self.start = np.array([self._coordinate(n, x) for n, x in start_values(case).items()])
        self.spread = np.array([v.spread for v in read_variables(case)])  # of the prior
        # of the sources of error, as the case has them
        self.constants = {**constants}
        self.constants.setdefault("pressure_kPa", case.case.pressure_kPa)

    def _coordinate(self, name: str, value: float) -> float:
        v = self._variables[name]
        return log(value) if v.scale == "log" else (value - v.lower) / (v.upper - v.lower)

    def values(self, x: Array) -> dict[str, float]:
        """Design variables at x, in their own units."""
        return {
            name: exp(xi) if v.scale == "log" else v.lower + xi * (v.upper - v.lower)
            for (name, v), xi in zip(self._variables.items(), map(float, x), strict=True)
        }

    def slope(self, name: str, values: Mapping[str, float]) -> float:
        """d value / d coordinate of a variable."""
        v = self._variables[name]
        return values[name] if v.scale == "log" else v.upper - v.lower

    def unit(self, variable: str) -> str:
        """The unit of a design variable, "" where it has none."""
        return unit_of(self._variables[variable].sets[0])

    def present(self, effect: str) -> float:
        """Size of an effect in the case."""
        return self._case.case.effects.get(effect, 0.0)

    def at(self, x: Array, effects: Mapping[str, float]) -> dict[str, float]:
        """Variables, and effects on top of those that the case has."""
        added = {EFFECT_PATH + id: self.present(id) + float(e) for id, e in effects.items()}
        return {**self.values(x), **added}

    def in_state(
        self, state: TyreState, design: Mapping[str, float], names: Sequence[str] = ()
    ) -> tuple[dict[str, float], tuple[str, ...]]:
        """A design in a state, which wins over an effect that holds the rim otherwise, and those
        of the slopes ``names`` that it has there."""
        held = replace(state, pressure_kPa=None).numbers(self._case)
        pressure = state.with_defaults(self._case).pressure_kPa or 0.0
        left = without(self._case, dict.fromkeys(names, 0.0), held)
        there = {**without(self._case, design, held), "pressure_kPa": pressure, **held}
        return there, tuple(name for name in left if name not in held)
