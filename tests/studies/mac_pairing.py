"""Modes that measured shapes are paired with by their MAC: how many are undecided, or wrong?

    python -m tests.studies.mac_pairing [tests] [seed]

Each test is one tyre of three (`rings.TYRES`), with its modes below 170 Hz that move the sensors,
from the tool's own exact shapes, at N signals. Half of the tests have signals at random places and
in random directions, half one even ring of radial signals on the tread, where c and N - c waves
look alike.
Sensors are 2 mm off the place that is noted, noise is 5 % of a mode's root mean square signal.
"random": shapes of normal numbers instead, which are no mode.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np

from tests.studies.rings import TYRES, OFF_m, tyre_modes
from tyrecal.measured.case_modes import CaseModes
from tyrecal.measured.sensors import Sensors
from tyrecal.measured.shapes import SensorShapes, ShapeOfMode
from tyrecal.simulate.modes.label import Mode
from tyrecal.studies.correlation import correlate

Array = np.ndarray
SIGNALS, NOISE, EDGE_Hz = (8, 12, 20, 50, 100, 200), 0.05, 170.0


def draw_sensors(points: Array, count: int, is_ring: bool, random: np.random.Generator) -> Sensors:
    """Signals on a tyre with nodes at ``points`` (R, Z): an even radial ring, or anywhere."""
    crown = int(np.argmax(points[:, 0]))
    node = np.full(count, crown) if is_ring else random.integers(0, len(points), count)
    angle = 2 * np.pi * np.arange(count) / count if is_ring else random.uniform(0, 7, count)
    axes = np.zeros(count, int) if is_ring else random.integers(0, 3, count)
    return Sensors(np.column_stack([points[node, 0], angle, points[node, 1]]), np.eye(3)[axes])


def draw_pairing(
    modes: Sequence[Mode], count: int, is_ring: bool, random: np.random.Generator
) -> list[tuple[str, str | None]]:
    """True name of each shape, "random" of one that is no mode, and the name by MAC, None where it
    is undecided."""
    case = CaseModes(modes)
    true = draw_sensors(modes[0].raw.shape.points, count, is_ring, random)  # type: ignore[union-attr]
    chosen = [m for m in modes if m.frequency_Hz < EDGE_Hz and case.is_seen(m, true)]
    shapes = []
    for mode in chosen:
        both = case.signals(mode, true)
        shapes.append(both @ random.standard_normal(both.shape[1]))
    sizes = [NOISE * np.sqrt(np.mean(u**2)) for u in shapes]
    shapes = [u + s * random.standard_normal(count) for u, s in zip(shapes, sizes, strict=True)]
    shapes.append(random.standard_normal(count))
    off = OFF_m * random.standard_normal((count, 3)) / [1.0, true.points[:, 0].max(), 1.0]
    hertz = [*(mode.frequency_Hz for mode in chosen), EDGE_Hz]
    test = SensorShapes(
        file="drawn",
        pressure_kPa=240,
        signals=[str(k) for k in range(count)],
        points=(true.points + off).tolist(),
        directions=true.directions.tolist(),
        modes=[
            ShapeOfMode(c=None, m=None, kind=None, member="", frequency_Hz=f, values=u.tolist())
            for f, u in zip(hertz, shapes, strict=True)
        ],
    )
    names = [*(str(mode.label) for mode in chosen), "random"]
    pairs = correlate(test, case).pairs
    return [(n, p.computed if p.decided else None) for n, p in zip(names, pairs, strict=True)]


def main(tests: int = 600, seed: int = 1) -> None:
    """Print a line for each number of signals and layout, and each wrong pair."""
    random = np.random.default_rng(seed)
    tallies = {(n, ring): Counter[str]() for n in SIGNALS for ring in (False, True)}
    for number in range(tests):
        count, is_ring = [*tallies][number % len(tallies)]
        modes = tyre_modes(TYRES[random.integers(len(TYRES))])
        for true, given in draw_pairing(modes, count, is_ring, random):
            kind = "random" if true == "random" else "modes"
            tallies[count, is_ring].update({kind: 1, f"{kind} decided": given is not None})
            if kind == "modes" and given not in (None, true):
                tallies[count, is_ring].update(wrong=1)
                print(f"{count} signals: {true} paired with {given}", flush=True)
    print("signals | modes | decided | wrong | random shapes | decided")
    for (count, is_ring), n in tallies.items():
        name = f"{count}{', one ring' * is_ring}"
        print(
            f"{name} | {n['modes']} | {n['modes decided'] / n['modes']:.1%}"
            f" | {n['wrong']} | {n['random']} | {n['random decided'] / n['random']:.1%}"
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
