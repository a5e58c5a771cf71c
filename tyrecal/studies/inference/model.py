"""Interface between the diagnosis and the model that answers it.

eta(x, e, c) = ln f over rows (mode, pressure) and ln mass; x: logarithms of the design variables
(linear ones: in units of the width of their bounds); e: parameters of effects; c: constants that
nobody calibrates. All else works on this alone, so that an emulator can take its place.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...simulate.modes.label import Label
from ...tyre.state import TyreState

Array = np.ndarray
Where = float | TyreState  # kPa on the case's own rim, or a state on another
ModelRow = tuple[Label | None, Where]  # a mode, None: the mass


@dataclass(frozen=True)
class Span:
    """An effect that can be evaluated: the range of its parameter."""

    low: float
    high: float
    unit: str = ""
    title: str = ""
    toggle: str = ""
    base: float = 0.0  # what the case has of it; low, high and all parameters count from there
    also: tuple[float, ...] = ()  # beyond the range, at which toggled runs were measured
    law: float = 0.04  # of its shift of a mode, by which a real one's may be off
    second: bool = False  # whether there is more to it than its parameter, see `Query.beside`
    stated: float = 0.0  # standard deviation of it by the case's uncertainties; 0: it states none


@dataclass(frozen=True)
class Query:
    """A point at which the model is evaluated."""

    x: Array  # (v,)
    effects: Mapping[str, float] = field(default_factory=dict)  # parameter by id, absent: 0
    constants: bool = False  # whether for slopes by the sources of error, too
    slopes: tuple[str, ...] = ()  # effects for slopes by whose parameters, too
    coupled: bool = False  # whether for what couples modes, too
    beside: bool = False  # whether for what else the nature of its effect leaves open, too
    # (v,) x of a plain tyre: a model may evaluate the lowest and the highest pressure only, and
    # interpolate the shift from that tyre between them
    near: Array | None = None


@dataclass(frozen=True)
class Coupling:
    """Coupling of modes by the sources of error, see `veering`."""

    partner: Array  # (n,) row of the other mode at the same pressure, -1: there is none
    size: Array  # (n,) standard deviation of q over lambda
    rise: Array  # (n,) of the two modes' mean, for q at one standard deviation


@dataclass(frozen=True)
class Answer:
    """Answer of the model to one query."""

    eta: Array  # (n,) ln f or ln mass
    jacobian: Array  # (n, v) d eta / d x
    split: Array  # (n,) ln of the ratio of a pair's frequencies
    constants: Array | None = None  # (n, k) change by one standard deviation of each source
    slopes: Mapping[str, Array] = field(default_factory=dict)  # (n,) d eta / d e; NaN: unknown
    coupling: Coupling | None = None
    beside: Array | None = None  # (n,) more eta, by one standard deviation of that
    by_pressure: Array | None = None  # (n,) d eta / d ln(pressure), if it was evaluated


def state_of(where: Where) -> TyreState:
    """The state of a row."""
    return where if isinstance(where, TyreState) else TyreState(where)


class ResponseModel(Protocol):
    """A model that answers queries."""

    variables: Sequence[str]  # names of x
    start: Array  # (v,) centre of what x can be
    spread: Array  # (v,) its standard deviation
    sources: Sequence[str]  # names of the sources of error
    spans: Mapping[str, Span]  # effects by id
    material_laws: float  # standard deviation of ln f by laws other than its own

    @property
    def sloped(self) -> Collection[str]:
        """Effects that `Query.slopes` may name at parameters other than 0."""

    @property
    def sloped_at_0(self) -> Collection[str]:
        """Effects that `Query.slopes` may name where their parameter is 0."""

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """An answer for each point in order, or why there is none; rows as it was made for."""
