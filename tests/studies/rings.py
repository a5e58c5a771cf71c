"""Labels of modes measured on rings of sensors: how many are given, and how many are wrong?

    python -m tests.studies.rings [modes] [seed] [edge of the band in Hz] [--case]

Each test is one tyre of three (`TYRES`), with its modes up to an edge of the band drawn between
110 and 170 Hz (or the one given), from the tool's own exact shapes. One, two or three rings are at
20 to 100 % of the tread's half width, on either side; 8 to 24 angles, off an even spacing by up to
30 % of it; radial (r), radial and axial (rz) or triaxial sensors (rtz); each is 2 mm off the place
that is noted. Noise is 2 to 10 % of a mode's root mean square signal. Labels are those that
`measured import` gives without a case, with the band's highest harmonic and one more. "can tell":
labels that `measured sensors` says these sensors can tell.

With --case labels are those of `measured label CASE FILE`, and the measured tyre is one of
`OTHER_DESIGNS` with variables off the case's by a factor of 1.65 (a standard deviation).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.cli.test_cli import run
from tests.conftest import CASES
from tyrecal.measured.case_modes import CaseModes
from tyrecal.measured.labels import Labeller
from tyrecal.measured.modal import label_in_turn
from tyrecal.measured.sensors import MeasuredMode, Sensors
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import HarmonicShape
from tyrecal.simulate.modes.label import Label, Mode, labelled
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

Array = np.ndarray

TYRES = ("p235_75r17.yaml", "205_60r15.yaml", "225/45R17")  # cases, or what `init` makes of a size
RINGS, DIRECTIONS = (1, 2, 3), {"r": (0,), "rz": (0, 2), "rtz": (0, 1, 2)}
GROUPS = tuple((count, name) for count in RINGS for name in DIRECTIONS)
BAND_EDGE, NOISE, ANGLES = (110.0, 170.0), (0.02, 0.10), (8, 24)
TREAD = 0.95  # of the largest radius, from which the tread's width is counted
OFF_m = 0.002
OTHER_DESIGNS = 6  # of each tyre


@dataclass(frozen=True)
class RingTest:
    """A drawn test: the true modes in its band, and what its sensors measure of each."""

    modes: list[Mode]
    sensors: Sensors
    signals: list[Array]  # (k,) a mode
    highest: int  # c


@cache
def tyre_modes(name: str, design: int = 0) -> tuple[Mode, ...]:
    """Modes by rising frequency, up to c = 10; design: 0, as the case has it, or another."""
    with TemporaryDirectory() as folder:
        path = CASES / name if name.endswith(".yaml") else Path(folder) / "tyre.yaml"
        if not path.exists() and run(
            "init", name, "--output", str(path), "--no-pictures", "--quiet"
        ):
            raise RuntimeError(f"init {name} failed")
        case = with_values(load_case(path), {"analysis.highest_harmonic": 10})
    random = np.random.default_rng(design)
    off = lambda: np.clip(0.5 * random.standard_normal(), -0.9, 0.9) if design else 0.0
    values = {key: float(v.start * np.exp(off())) for key, v in case.case.variables.items()}
    return tuple(labelled(Evaluator(TyreDesign(case)).evaluate(Question(values, (), 4))))


def draw_test(
    modes: Sequence[Mode],
    rings: int,
    directions: Sequence[int],
    random: np.random.Generator,
    edge_Hz: tuple[float, float] = BAND_EDGE,
) -> RingTest:
    """The modes below an edge of the band, on rings of sensors."""
    shapes = [mode.raw.shape for mode in modes]
    assert all(isinstance(shape, HarmonicShape) for shape in shapes)
    R, Z = shapes[0].points.T
    half_width = np.abs(Z[TREAD * R.max() < R]).max()
    across = half_width * random.uniform(0.2, 1.0, rings) * random.choice([-1, 1], rings)
    nodes = [int(np.argmax(R - 5 * np.abs(Z - z))) for z in across]
    count = int(random.integers(ANGLES[0], ANGLES[1] + 1))
    angles = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2 * np.pi / count
    rows = [(i, angle, d) for i in nodes for angle in angles for d in directions]
    node, angle = np.array([i for i, *_ in rows]), np.array([a for _, a, _ in rows])
    along = np.eye(3)[[d for *_, d in rows]]
    points = np.column_stack([R[node], angle, Z[node]])
    off = OFF_m * random.standard_normal(points.shape) / [1.0, R.max(), 1.0]
    noise, edge = random.uniform(*NOISE), random.uniform(*edge_Hz)
    chosen = [mode for mode in modes if mode.frequency_Hz < edge]
    signals = []
    for mode in chosen:
        shape = mode.raw.shape
        assert isinstance(shape, HarmonicShape)
        turn = np.exp(1j * (shape.n * angle + (random.uniform(0, 7) if shape.n else 0.0)))
        u = np.sum((shape.amplitude[node] * turn[:, None]).real * along, axis=1)
        signals.append(u + noise * np.sqrt(np.mean(u**2)) * random.standard_normal(len(u)))
    highest = 1 + max(mode.label.c for mode in chosen)
    return RingTest(chosen, Sensors(points + off, along), signals, highest)


def labels_given(
    test: RingTest, case: CaseModes | None = None
) -> Iterator[tuple[Label, Label | None, bool]]:
    """True label of each mode, the label given, and whether the sensors can distinguish it."""
    labeller = Labeller(test.sensors, test.highest, case)
    alike = labeller.looks_like()
    measured = [
        (MeasuredMode(mode.frequency_Hz, u), labeller, "")
        for mode, u in zip(test.modes, test.signals, strict=True)
    ]
    for mode, given in zip(test.modes, label_in_turn(measured), strict=True):
        yield mode.label, given.judged.label, not alike[mode.label]


def main(count: int = 5000, seed: int = 1, edge_Hz: int = 0, with_case: bool = False) -> None:
    """Print a line for each number of rings and set of directions, and each wrong label."""
    random = np.random.default_rng(seed)
    tallies = {group: Counter[str]() for group in GROUPS}
    number = 0
    while sum(each["modes"] for each in tallies.values()) < count:
        rings, name = group = GROUPS[number % len(GROUPS)]
        number += 1
        tyre = TYRES[random.integers(len(TYRES))]
        case = CaseModes(tyre_modes(tyre)) if with_case else None
        modes = tyre_modes(tyre, int(random.integers(1, OTHER_DESIGNS + 1)) if with_case else 0)
        edge = (edge_Hz, edge_Hz) if edge_Hz else BAND_EDGE
        test = draw_test(modes, rings, DIRECTIONS[name], random, edge)
        for true, given, can_tell in labels_given(test, case):
            is_given, is_wrong = given is not None, given not in (None, true)
            tallies[group].update(
                modes=1, given=is_given, wrong=is_wrong, can=can_tell, both=can_tell and is_given
            )
            if is_wrong:
                print(f"{rings} {name}: {true} called {given}", flush=True)
    print("rings, directions | modes | given | wrong | can tell | given of those")
    total = sum(tallies.values(), Counter[str]())
    for title, n in [*((f"{a} {b}", n) for (a, b), n in tallies.items()), ("all", total)]:
        print(
            f"{title} | {n['modes']} | {n['given'] / n['modes']:.1%} | {n['wrong']}"
            f" | {n['can'] / n['modes']:.1%} | {n['both'] / max(n['can'], 1):.1%}"
        )


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word != "--case"]
    main(*numbers, with_case="--case" in sys.argv)  # type: ignore[misc]
