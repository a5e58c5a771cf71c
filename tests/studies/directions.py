"""Tests that do not say what their directions 1, 2, 3 are: is the right meaning taken?

    python -m tests.studies.directions [count] [seed]

Each is a set of mode shapes of the main tyre, measured along x, y, z or along r, theta, z, at 8 to
24 angles on one to three rings, all points or a ring at each angle in turn, one to three of the
directions, 2 to 14 modes, 2 to 10 % noise, 3 % errors of gain. Printed is how often the right
meaning was taken, the user was asked, and the wrong meaning was taken.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections import Counter
from pathlib import Path

import numpy as np

from tyrecal.errors import InputError
from tyrecal.measured.modal import Geometry, Layout, read_modal_test
from tyrecal.measured.sensors import sensors_of
from tyrecal.measured.universal import MeasuredShape, Universal

from ..measured.tyres import HIGHEST, measured, modes, shape_of

RINGS = ((0.0,), (-0.5, 0.5), (-0.9, 0.9), (-0.9, 0.0, 0.9), (-0.5, 0.0, 0.5))  # of the half width
COMPONENTS = ((0,), (0, 2), (0, 1, 2))
MEANINGS = ("cartesian", "cylindrical")


def drawn(rng: np.random.Generator) -> tuple[Universal, str]:
    """A test, and what its directions are."""
    R, Z = shape_of(modes()[0]).points.T
    half_width = Z[R.max() * 0.95 < R].max()
    rings = RINGS[rng.integers(len(RINGS))]
    components = COMPONENTS[rng.integers(len(COMPONENTS))]
    meaning = MEANINGS[rng.integers(2)]
    count, in_turn = int(rng.integers(8, 25)), bool(rng.integers(2))
    angles = (np.arange(count) + 0.1 * rng.standard_normal(count)) * 2 * np.pi / count
    nodes, at = dict[int, tuple[float, float, float]](), list[int]()
    for k, angle in enumerate(angles + rng.uniform(0, 7)):
        for ring in rings if not in_turn else rings[k % len(rings) : k % len(rings) + 1]:
            i = int(np.argmax(R - 5 * abs(Z - ring * half_width)))
            nodes[len(nodes) + 1] = (R[i] * np.cos(angle), R[i] * np.sin(angle), Z[i])
            at.append(i)
    signals = [(node, k + 1) for node in nodes for k in components]
    sensors = sensors_of(signals, nodes, "z", cylindrical=meaning == "cylindrical")
    rows = np.repeat(at, len(components))
    noise, shapes = rng.uniform(0.02, 0.1), []
    chosen = rng.permutation(len(modes()))[: rng.integers(2, len(modes()) + 1)]
    for mode in (modes()[k] for k in chosen):
        values = np.full((len(nodes), 3), np.nan, complex)
        u = measured(mode, sensors, rows, rng, noise)
        values[:, components] = u.reshape(len(nodes), len(components))
        shapes.append(MeasuredShape(mode.frequency_Hz, np.nan, tuple(nodes), values, "drawn"))
    return Universal(Path("drawn"), nodes, shapes, []), meaning


def outcome(rng: np.random.Generator) -> str:
    """``right``, ``asked`` or ``wrong``."""
    file, meaning = drawn(rng)
    layout = Layout(axle="z", highest=HIGHEST)
    try:
        test = read_modal_test(file, Geometry(file.nodes, {}), layout)
    except InputError as error:
        if "do not show whether directions" not in str(error):
            raise
        return "asked"
    taken = MEANINGS[any("--directions cylindrical is taken" in note for note in test.notes)]
    return "right" if taken == meaning else "wrong"


def main() -> None:
    count, seed = [int(word) for word in sys.argv[1:]] + [1500, 1][len(sys.argv) - 1 :]
    counts = Counter(outcome(np.random.default_rng([seed, k])) for k in range(count))
    print(", ".join(f"{name} {counts[name]}" for name in ("right", "asked", "wrong")))


if __name__ == "__main__":
    main()
