"""Results of an evaluation, whichever solver ran: frequencies with shapes, and their slopes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .solver import SolverAnswer

Array = np.ndarray


@dataclass(frozen=True)
class HarmonicShape:
    """u(R, Theta, Z) = Re[amplitude(R, Z) exp(i n Theta)], in cylindrical components. For n >= 1
    the shape stands for a pair."""

    n: int  # circumferential harmonic
    nodes: Array  # (k,) deck numbers
    points: Array  # (k, 2) R, Z in m, uninflated
    amplitude: Array  # (k, 3) complex: r, theta, z, any scale


@dataclass(frozen=True)
class RingShape:
    """A real shape sampled at points anywhere on the tyre (3-D solvers, measurements)."""

    points: Array  # (k, 3) R (m), Theta (rad), Z (m), uninflated
    displacement: Array  # (k, 3) r, theta, z, any scale; NaN where a component was not measured


@dataclass(frozen=True)
class RawMode:
    """A mode as the solver gives it: frequency (Hz), shape, how many modes it stands for.

    members: where something splits a doublet, the frequencies (Hz) of its two modes, the lower
    first; ``frequency_Hz`` is then their mean, and the shape the lower one's part of harmonic n.
    """

    frequency_Hz: float
    shape: HarmonicShape | RingShape = field(repr=False)
    multiplicity: int  # 2: a pair with n > 0, 1: a single mode
    members: tuple[float, float] | None = None
    damping_ratio: float | None = None  # fraction of critical damping; None: not known


@dataclass(frozen=True)
class Evaluation:
    """Modes of one deck at one pressure."""

    pressure_kPa: float
    mass_kg: float  # of the tyre without rim
    modes: tuple[RawMode, ...]
    # variable name to d f / d variable (m,), Hz per unit of the variable, in the order of ``modes``
    gradients: dict[str, Array] = field(default_factory=dict)
    nodes: Array = field(default_factory=lambda: np.empty(0, int))  # (k,) deck numbers
    # (k, 3) r, theta, z in m of these nodes by the inflation; (0, 3) if the solver does not give it
    displacement: Array = field(default_factory=lambda: np.empty((0, 3)))
    # variable name to d mass, kg per unit
    mass_gradients: dict[str, float] = field(default_factory=dict)
    response: SolverAnswer = field(default_factory=dict)  # as `Solver.read` has it


def evaluation(answer: SolverAnswer) -> Evaluation:
    """The typed form of what `Solver.read` gave and `recorded.check` has passed."""
    nodes, points, displacement = (  # laid out alike, so that sums are too, recorded or not
        np.ascontiguousarray(answer[name]) for name in ("nodes", "points", "displacement")
    )
    modes = []
    for mode in answer["modes"]:
        shape: HarmonicShape | RingShape
        if "amplitude" in mode:
            amplitude = np.ascontiguousarray(mode["amplitude"])
            shape = HarmonicShape(mode["n"], nodes, points, amplitude)
        else:
            shape = RingShape(points, np.ascontiguousarray(mode["displacement"]))
        members = tuple(mode["members"]) if mode.get("members") else None
        hertz, damping = mode["frequency_Hz"], mode.get("damping_ratio")
        modes.append(RawMode(hertz, shape, mode["multiplicity"], members, damping))
    return Evaluation(
        pressure_kPa=answer["pressure_Pa"] / 1e3,
        mass_kg=answer["mass_kg"],
        modes=tuple(modes),
        gradients={name: np.array(slope) for name, slope in answer["gradients"].items()},
        nodes=nodes,
        displacement=displacement,
        mass_gradients=dict(answer.get("mass_gradients", {})),
        response=dict(answer.get("response", {})),
    )
