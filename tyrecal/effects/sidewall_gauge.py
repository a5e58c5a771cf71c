"""The sidewall is thicker or thinner than drawn."""

from __future__ import annotations

from ..case import LoadedCase
from .edit import with_gauge
from .effect import Effect
from .parts import sidewall


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Thickness of the sidewall, inner to outer surface, times 1 + value."""
    if not -0.9 <= value <= 9:
        raise ValueError("must be between -0.9 and 9")
    names = case.section.names
    return with_gauge(case, (names[0], names[-1]), sidewall(case), 1 + value)


EFFECT = Effect(
    id="sidewall_gauge",
    title="Sidewall gauge",
    symbol="e",
    unit="",
    low=-0.15,
    high=0.15,
    changes=("*NODE",),
    signature="",
    toggle="section a tyre of the same build, or probe the sidewall's thickness by ultrasound",
    aliases=("temperature", "dynamic_stiffening"),
    add=add,
)
