"""Shapes of the main tyre at sensors: coarse mesh, evaluated once."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from tyrecal.measured.sensors import Sensors
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import HarmonicShape
from tyrecal.simulate.modes.label import Mode, paired_labels
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

Array = np.ndarray
CASES = Path(__file__).parents[2] / "cases"
HIGHEST = 6


@cache
def modes() -> tuple[Mode, ...]:
    """[0,0] twice, [c,0] and [c,1] to c = 6."""
    case = load_case(CASES / "p235_75r17.yaml")
    case = with_values(
        case,
        {
            "analysis.highest_harmonic": HIGHEST,
            **{
                f"mesh.levels.default.elements.{name}": 3
                for name in ("crown", "upper_sidewall", "lower_sidewall")
            },
        },
    )
    starts = {name: v.start for name, v in case.case.variables.items()}
    paired = paired_labels(Evaluator(TyreDesign(case)).evaluate(Question(starts)).modes)
    return tuple(m for m in paired if m.label.m < 2)


def shape_of(mode: Mode) -> HarmonicShape:
    assert isinstance(mode.raw.shape, HarmonicShape)
    return mode.raw.shape


def layout(
    rng: np.random.Generator, tread: int, side: int, drop: float = 0.2
) -> tuple[Sensors, Array]:
    """Sensors at random on the tread and both sidewalls, round the tyre but unevenly, some
    directions missing; and the nodes that they sit at. Where the sensors are noted to stand is
    some millimetres off."""
    points = shape_of(modes()[0]).points
    R, Z = points.T
    nodes = [int(np.argmax(R - 5 * abs(Z - z))) for z in rng.uniform(-0.075, 0.075, tread)]
    nodes += [
        int(np.argmax(rng.choice([-1, 1]) * Z - 5 * abs(R - r)))
        for r in rng.uniform(0.27, 0.36, side)
    ]
    angles = np.concatenate(
        [
            (np.arange(n) + 0.25 * rng.standard_normal(n)) / max(n, 1) * 2 * np.pi
            for n in (tread, side)
        ]
    )
    rows = [
        (i, a, k)
        for i, a in zip(nodes, angles, strict=True)
        for k in range(3)
        if rng.uniform() > drop
    ]
    where = np.array([[R[i], a, Z[i]] for i, a, _ in rows])
    return Sensors(where, np.eye(3)[[k for *_, k in rows]]), np.array([i for i, *_ in rows])


def measured(
    mode: Mode, sensors: Sensors, nodes: Array, rng: np.random.Generator, noise: float
) -> Array:
    """Complex amplitude of one member of the mode at the sensors, turned by any angle round the
    tyre and any phase; 3 % error of gain, and noise relative to the root mean square."""
    shape = shape_of(mode)
    turn = np.exp(1j * (shape.n * sensors.points[:, 1] + (rng.uniform(0, 7) if shape.n else 0)))
    u = np.sum((shape.amplitude[nodes] * turn[:, None]).real * sensors.directions, axis=1)
    size = noise * np.sqrt(np.mean(u**2))
    u = u * (1 + 0.03 * rng.standard_normal(len(u))) + size * rng.standard_normal(len(u))
    return u * np.exp(1j * (rng.uniform(0, 7) + 0.05 * rng.standard_normal(len(u))))


def noted(sensors: Sensors, rng: np.random.Generator) -> Sensors:
    """The sensors where they are noted to stand: 3 mm off."""
    off = 0.003 * rng.standard_normal(sensors.points.shape)
    return Sensors(sensors.points + off / [1.0, 0.39, 1.0], sensors.directions)
