"""Interface between the diagnosis and the model that answers it.

    eta(x, e, c)

eta (n,): ln f of n rows, each a mode in a state, and ln mass. x (v,): logarithms of the v design
variables (linear ones: in units of the width of their bounds). e: parameters of effects, 0 if
absent. c: constants that no fit calibrates, the sources of error. The diagnosis works on this
interface alone, so that an emulator can take the place of the finite element model.
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
class EffectRange:
    """An effect that the solver can express on this case, and the range of its parameter e."""

    low: float  # lowest e
    high: float  # highest e
    unit: str = ""  # of e
    title: str = ""  # the effect's name in words
    toggle: str = ""  # the experiment that would prove it
    base: float = 0.0  # value that the case has; low, high and e count from there
    extra_nodes: tuple[float, ...] = ()  # e beyond the range, where toggled runs were measured
    response_error: float = 0.04  # see `Effect.response_error`
    has_shape_uncertainty: bool = False  # whether the effect has `Effect.shape_uncertainty`
    # standard deviation of e by the case's `uncertainties`; 0: the case states none
    prior_sd: float = 0.0


@dataclass(frozen=True)
class Query:
    """A point at which the model is evaluated."""

    x: Array  # (v,)
    effects: Mapping[str, float] = field(default_factory=dict)  # parameter by id, absent: 0
    constants: bool = False  # whether `Answer.constants` is wanted
    slopes: tuple[str, ...] = ()  # ids of the effects of which `Answer.slopes` are wanted
    coupled: bool = False  # whether `Answer.coupling` is wanted
    shape_uncertainty: bool = False  # whether `Answer.shape_uncertainty` is wanted
    # (v,) x of a plain tyre: a model may evaluate the lowest and the highest pressure only, and
    # interpolate the shift from that tyre between them
    near: Array | None = None


@dataclass(frozen=True)
class Coupling:
    """Coupling of modes by the sources of error, see `veering`."""

    partner: Array  # (n,) row of the other mode at the same pressure, -1: there is none
    size: Array  # (n,) standard deviation of the coupling q over lambda = (2 pi f)^2
    # (n,) relative rise of the mean of both modes' lambda if q is one standard deviation
    rise: Array


@dataclass(frozen=True)
class Answer:
    """Answer of the model to one query; None is what was not wanted, or is not known."""

    eta: Array  # (n,) ln f, of a split pair the mean of both, or ln mass
    jacobian: Array  # (n, v) d eta / d x
    split: Array  # (n,) ln of the upper over the lower frequency of a split pair, else 0
    # (n, k) change of eta by one standard deviation of each of the k sources of error
    constants: Array | None = None
    slopes: Mapping[str, Array] = field(default_factory=dict)  # (n,) d eta / d e; NaN: unknown
    coupling: Coupling | None = None
    # (n,) change of eta by one standard deviation of the effect's `Effect.shape_uncertainty`
    shape_uncertainty: Array | None = None
    by_pressure: Array | None = None  # (n,) d eta / d ln(pressure), if it was evaluated
    damping: Array | None = None  # (n,) ln of the damping ratio, NaN: unknown; None: of all rows
    # (n, k) change of ``damping`` by one standard deviation of each of k parts of the loss factors
    losses: Array | None = None


def state_of(where: Where) -> TyreState:
    """The state of a row."""
    return where if isinstance(where, TyreState) else TyreState(where)


class ResponseModel(Protocol):
    """A model that answers queries."""

    variables: Sequence[str]  # names of x
    start: Array  # (v,) mean of the prior of x
    spread: Array  # (v,) standard deviation of the prior of x
    sources: Sequence[str]  # names of the k sources of error: constants that no fit calibrates
    ranges: Mapping[str, EffectRange]  # effects by id
    # standard deviation of ln f by each part of the error of material laws (`form_error`)
    material_laws: float

    @property
    def sloped(self) -> Collection[str]:
        """Effects that `Query.slopes` may name at parameters other than 0."""

    @property
    def sloped_at_0(self) -> Collection[str]:
        """Effects that `Query.slopes` may name where their parameter is 0."""

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """An answer for each point in order, or why there is none, with the rows for which the
        model was made."""
