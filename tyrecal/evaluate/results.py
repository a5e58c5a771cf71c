"""What an evaluation returns, whichever solver ran: frequencies with shapes, and their slopes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class HarmonicShape:
    """u(R, Theta, Z) = Re[amplitude(R, Z) exp(i n Theta)], in cylindrical components.

    n: circumferential harmonic; nodes (k,): deck numbers; points (k, 2): R, Z in m, uninflated;
    amplitude (k, 3) complex: r, theta, z. For n >= 1 the shape stands for a pair.
    """

    n: int
    nodes: Array
    points: Array
    amplitude: Array


@dataclass(frozen=True)
class RingShape:
    """A real shape sampled at points anywhere on the tyre (3-D solvers, measurements).

    points (k, 3): R (m), Theta (rad), Z (m), uninflated; displacement (k, 3): r, theta, z,
    NaN where a component was not measured.
    """

    points: Array
    displacement: Array


@dataclass(frozen=True)
class RawMode:
    """A mode as the solver gives it: frequency (Hz), shape, how many modes it stands for."""

    frequency_Hz: float
    shape: HarmonicShape | RingShape
    multiplicity: int


@dataclass(frozen=True)
class Evaluation:
    """Modes of one deck at one pressure.

    mass_kg: of the tyre without rim; gradients: variable name to d f / d variable (mode,), in
    Hz per unit of the variable; displacement (k, 3): the inflation's, at ``nodes`` (k,).
    """

    pressure_kPa: float
    mass_kg: float
    modes: tuple[RawMode, ...]
    gradients: dict[str, Array] = field(default_factory=dict)
    nodes: Array = field(default_factory=lambda: np.empty(0, int))
    displacement: Array = field(default_factory=lambda: np.empty((0, 3)))
