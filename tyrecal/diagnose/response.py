"""What the diagnosis asks a model, and the model behind the one door that answers.

eta(x, e, c) = ln f over rows (mode, pressure) and ln mass; x: logarithms of the design variables
(linear ones: in units of the width of their bounds); e: parameters of effects; c: constants that
nobody calibrates. All else works on this alone, so that an emulator can take its place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Span:
    """An effect that can be asked for: the range of its parameter, and its unit.

    base: what the case has of it already; low, high and all parameters count from there. also:
    parameters beyond the range that toggled runs were measured at.
    """

    low: float
    high: float
    unit: str = ""
    title: str = ""
    toggle: str = ""
    base: float = 0.0
    also: tuple[float, ...] = ()


@dataclass(frozen=True)
class Point:
    """One question. x (v,); effects: parameter by id, absent = 0; constants: also their slopes."""

    x: Array
    effects: Mapping[str, float] = field(default_factory=dict)
    constants: bool = False


@dataclass(frozen=True)
class Answer:
    """eta (n,): ln f or ln mass; jacobian (n, v): d eta / d x; split (n,): ln of the ratio of a
    pair's frequencies; constants (n, k): change of eta by one standard deviation of each source
    of error, or None where it was not asked for."""

    eta: Array
    jacobian: Array
    split: Array
    constants: Array | None = None


class Response(Protocol):
    """A model that can be asked.

    variables: names of x; start (v,), spread (v,): centre and standard deviation of what x can
    be; sources: names of the sources of error behind `Answer.constants`; spans: effects by id.
    """

    variables: Sequence[str]
    start: Array
    spread: Array
    sources: Sequence[str]
    spans: Mapping[str, Span]

    def answers(self, points: Sequence[Point]) -> list[Answer | Exception]:
        """An answer for each point in order, or why there is none; rows as it was made for."""
