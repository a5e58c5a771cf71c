"""Labels of modes measured on rings of sensors: how many are given, and how many are wrong?

    python -m tests.studies.rings [modes] [seed] [edge of the band in Hz]
    python -m tests.studies.rings --case [tests] [seed]      # resumable; or only the tables

Each test is one tyre of three (`TYRES`), with its modes up to an edge of the band drawn between
110 and 170 Hz (or the one given), from the tool's own exact shapes. One, two or three rings are at
20 to 100 % of the tread's half width, on either side; 8 to 24 angles, off an even spacing by up to
30 % of it; radial (r), radial and axial (rz) or triaxial sensors (rtz); each is 2 mm off the place
that is noted. Noise is 2 to 10 % of a mode's root mean square signal. Labels are those that
`measured import` gives without a case, with the band's highest harmonic and one more. "can tell":
labels that `measured sensors` says these sensors can tell.

With --case labels are those of `measured label CASE FILE`, rings have radial or triaxial sensors,
and the model (coarse mesh, start values) is not the tyre (default mesh). Its variables are off by a
factor of 1.65 (a standard deviation), its frequencies as `tree.DISCREPANCIES` say, and a tenth of
another mode of the same c is mixed into each shape. Measured are its modes less none to three, of
`SECOND` of the doublets both modes 0.5 % apart; in every second test a foreign frequency anywhere
in the band, its shape random. Frequencies have 0.5 % noise. The same test is labelled by shapes and
frequencies together, by shapes alone (frequencies known within a factor of 20), and by frequencies
alone. A label counts as decided from 90 % on.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.cli.test_cli import run
from tests.conftest import CASES
from tyrecal.files import Json
from tyrecal.measured.labels import Labeller
from tyrecal.measured.measurement import Measurement
from tyrecal.measured.modal import label_in_turn
from tyrecal.measured.sensors import MeasuredMode, Sensors
from tyrecal.measured.shapes import SensorShapes, ShapeOfMode
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import HarmonicShape
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import Label, Mode, labelled
from tyrecal.studies.blind.score import calibration_error, calibration_quantile, clopper_pearson
from tyrecal.studies.labelling.label import label
from tyrecal.studies.labelling.tree import DISCREPANCIES, FOREIGN_MARGIN, SECOND, discrepancy
from tyrecal.studies.labels import SURE_LABEL
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

Array = np.ndarray

TYRES = ("p235_75r17.yaml", "205_60r15.yaml", "225/45R17")  # cases, or what `init` makes of a size
RINGS, DIRECTIONS = (1, 2, 3), {"r": (0,), "rz": (0, 2), "rtz": (0, 1, 2)}
GROUPS = tuple((count, name) for count in RINGS for name in DIRECTIONS)
BAND_EDGE, NOISE, ANGLES = (110.0, 170.0), (0.02, 0.10), (8, 24)
TREAD = 0.95  # of the largest radius, from which the tread's width is counted
OFF_m = 0.002
# of tests with a case: share of another mode in a shape; noise of frequencies; distance of the
# modes of a doublet in ln f
MIXED, SIGMA, DOUBLET, MOST_MISSED = 0.1, 0.005, 0.005, 3
WAYS, FOREIGN = ("together", "shapes", "frequencies"), "no mode"
RECORDS = Path(__file__).parents[1] / "benchmarks"


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
    case = with_values(case_of(name), {"analysis.highest_harmonic": 10})
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


def labels_given(test: RingTest) -> Iterator[tuple[Label, Label | None, bool]]:
    """True label of each mode, the label given, and whether the sensors can distinguish it."""
    labeller = Labeller(test.sensors, test.highest)
    alike = labeller.looks_like()
    measured = [
        (MeasuredMode(mode.frequency_Hz, u), labeller, "")
        for mode, u in zip(test.modes, test.signals, strict=True)
    ]
    for mode, given in zip(test.modes, label_in_turn(measured), strict=True):
        yield mode.label, given.judged.label, not alike[mode.label]


def measured_tyre(modes: Sequence[Mode], random: np.random.Generator) -> list[Mode]:
    """Modes of a tyre that is not the model, with both modes of some doublets."""
    labels = list(dict.fromkeys(mode.label for mode in modes))
    C = discrepancy(labels, random.choice(DISCREPANCIES))
    off = random.multivariate_normal(np.zeros(len(labels)), C, method="cholesky")
    result = []
    for mode in modes:
        shape = mode.raw.shape
        same = [m.raw.shape for m in modes if m.label.c == mode.label.c and m is not mode]
        other = same[random.integers(len(same))].amplitude
        size = np.linalg.norm(shape.amplitude) / np.linalg.norm(other)
        mixed = shape.amplitude + MIXED * size * random.choice([-1, 1]) * other
        ln_f = np.log(mode.frequency_Hz) + off[labels.index(mode.label)]
        raw = replace(mode.raw, shape=replace(shape, amplitude=mixed))
        count = 1 + (mode.label.c > 0 and random.random() < SECOND)
        for apart in (0.0, DOUBLET)[:count]:
            f = float(np.exp(ln_f + apart + SIGMA * random.standard_normal()))
            result.append(replace(mode, frequency_Hz=f, raw=raw))
    return sorted(result, key=lambda mode: mode.frequency_Hz)


def case_of(name: str) -> LoadedCase:
    """A case, or what `init` makes of a size."""
    if name.endswith(".yaml"):
        return load_case(CASES / name)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tyre.yaml"
        if run("init", name, "--output", str(path), "--no-pictures", "--quiet"):
            raise RuntimeError(f"init {name} failed")
        return load_case(path)


@cache
def model_of(name: str, store: Path | None) -> tuple[LoadedCase, Evaluator]:
    """The case that labels a tyre, and its evaluator."""
    case = with_level(case_of(name), "coarse")
    return case, Evaluator(TyreDesign(case), store=Store(store) if store else None)


def labelled_with_case(
    number: int, seed: int, store: Path | None = None, ways: Sequence[str] = WAYS
) -> Json:
    """A drawn test: the true label of each frequency, and by each way the likeliest one with its
    probability, and the probability of all together."""
    random = np.random.default_rng([seed, number])
    rings, name = (1, 2, 3)[number % 3], ("r", "rtz")[number // 3 % 2]
    tyre = TYRES[random.integers(len(TYRES))]
    case, evaluator = model_of(tyre, store)
    own = measured_tyre(tyre_modes(tyre, 1 + 1000 * seed + number), random)
    test = draw_test(own, rings, DIRECTIONS[name], random)
    kept = random.permutation(len(test.modes))[random.integers(MOST_MISSED + 1) :]
    measured = [
        (test.modes[i].frequency_Hz, str(test.modes[i].label), test.signals[i]) for i in kept
    ]
    if random.random() < 0.5:
        low, high = (np.log(end(f for f, *_ in measured)) for end in (min, max))
        f = np.exp(random.uniform(low - FOREIGN_MARGIN, high + FOREIGN_MARGIN))
        measured.append((float(f), FOREIGN, random.standard_normal(len(test.sensors.points))))
    measured.sort(key=lambda each: each[0])
    kPa = case.case.pressure_kPa
    shapes = SensorShapes(
        file="",
        pressure_kPa=kPa,
        signals=[str(k) for k in range(len(test.sensors.points))],
        points=test.sensors.points.tolist(),
        directions=test.sensors.directions.tolist(),
        modes=[
            ShapeOfMode(c=None, m=None, kind=None, member="", frequency_Hz=f, values=u.tolist())
            for f, _, u in measured
        ],
    )
    record: Json = {"test": number, "tyre": tyre, "rings": rings, "directions": name}
    record["true"] = [label for _, label, _ in measured]
    elsewhere = shapes.model_copy(update={"pressure_kPa": 2 * kPa})
    for way in ways:
        sigma = 3.0 if way == "shapes" else SIGMA
        there = elsewhere if way == "frequencies" else shapes
        readings = [
            Measurement("frequency_Hz", None, "", kPa, 0.0, f, sigma * f) for f, *_ in measured
        ]
        search = label(case, evaluator, readings, shapes=[there]).found
        best = search.labelings
        record[way] = {
            "labels": [str(each or FOREIGN) for each in search.labels()],
            "p": [round(float(best.each[i, j]), 4) for i, j in enumerate(best.modes[0])],
            "together": round(float(best.probabilities[0]), 4),
        }
    return record


def tables(records: Sequence[Json]) -> None:
    """Print a line for each way, of all tests and of each kind."""
    print("rings, way | tests | labels | right | stated | undecided | right of decided | stated")
    for way in WAYS:
        if any(way in each for each in records):
            tell(way, records, way)
    for rings, name, way in product(RINGS, ("r", "rtz"), WAYS):
        chosen = [r for r in records if (r["rings"], r["directions"]) == (rings, name)]
        if any(way in each for each in chosen):
            tell(f"{rings} {name}, {way}", chosen, way)


def tell(title: str, records: Sequence[Json], way: str) -> None:
    """Print how often labels are right, and how often that is stated, over the tests with a way;
    then the same of all labels of a test together, and the calibration error."""
    labelled_tests = [r for r in records if way in r]
    pairs = [zip(r["true"], r[way]["labels"], strict=True) for r in labelled_tests]
    right = np.array([a == b for each in pairs for a, b in each])
    p = np.array([each for r in labelled_tests for each in r[way]["p"]])
    whole = np.array([r["true"] == r[way]["labels"] for r in labelled_tests])
    stated = np.array([r[way]["together"] for r in labelled_tests])
    low, high = clopper_pearson(int(right.sum()), len(right))
    sure = p >= SURE_LABEL
    print(
        f"{title} | {len(whole)} | {len(right)} | {right.mean():.1%} ({low:.1%} to {high:.1%}) |"
        f" {p.mean():.1%} | {np.mean(~sure):.1%} | {right[sure].mean():.1%} |"
        f" {p[sure].mean():.1%}; whole tests {whole.mean():.1%}, stated {stated.mean():.1%};"
        f" calibration error {calibration_error(p, right):.3f}, of a calibrated answerer"
        f" {calibration_quantile(p):.3f}; decided and wrong: {np.sum(sure & ~right)}, expected"
        f" {np.sum(1 - p[sure]):.1f}"
    )


def with_case(count: int = 200, seed: int = 1) -> None:
    """Label the tests that are not recorded, one way after the other, and print the tables."""
    record = RECORDS / f"ring_labels_{seed}.jsonl"
    lines = record.read_text().splitlines() if record.exists() else []
    records = [json.loads(line) for line in lines] + [{} for _ in range(count - len(lines))]
    with TemporaryDirectory() as folder:
        for ways, number in product((WAYS[:1], WAYS[1:]), range(count)):
            if not records[number].keys() >= {*ways}:
                records[number] |= labelled_with_case(number, seed, Path(folder), ways)
                record.write_text("".join(f"{json.dumps(each)}\n" for each in records if each))
    tables(records)


def main(count: int = 5000, seed: int = 1, edge_Hz: int = 0) -> None:
    """Print a line for each number of rings and set of directions, and each wrong label."""
    random = np.random.default_rng(seed)
    tallies = {group: Counter[str]() for group in GROUPS}
    number = 0
    while sum(each["modes"] for each in tallies.values()) < count:
        rings, name = group = GROUPS[number % len(GROUPS)]
        number += 1
        tyre = TYRES[random.integers(len(TYRES))]
        edge = (edge_Hz, edge_Hz) if edge_Hz else BAND_EDGE
        test = draw_test(tyre_modes(tyre), rings, DIRECTIONS[name], random, edge)
        for true, given, can_tell in labels_given(test):
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
    (with_case if "--case" in sys.argv else main)(*numbers)
