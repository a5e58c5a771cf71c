"""Labels of 500 random tyres by three paths: are they the same, is any lost?

    python tests/studies/labels.py [designs]

1. The harmonic shapes on all nodes of the section.
2. The same shapes like a 3-D model gives them: nine rings of 24 points on the outer surface,
   every pair turned by a random angle and split into halves, points and modes shuffled, 2 % noise.
3. No polynomials at all: of the two lowest modes of a harmonic, the one nearer to symmetric under
   the reflection z -> -z of the whole section (r, theta even, z odd) is m = 0, or torsional.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode, RingShape
from tyrecal.simulate.modes.label import Label, Mode, label_modes, pair_rings
from tyrecal.simulate.modes.rings import on_rings
from tyrecal.tyre.load import load_case

Array = np.ndarray

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
TABLE_2 = (
    Label(0, 0, "axial"),
    Label(0, 0, "torsional"),
    Label(1, 1),
    Label(1, 0),
    Label(2, 1),
    Label(2, 0),
    Label(3, 0),
    Label(3, 1),
    Label(4, 0),
)
NOISE = 0.02  # of a mode's largest motion
TREAD_Z = (-0.08, -0.04, 0.0, 0.04, 0.08)  # m
SIDEWALL_R = (0.35, 0.30)  # m


@cache
def evaluator() -> Evaluator:
    return Evaluator(TyreDesign(load_case(CASE)))


def evaluate(
    values: dict[str, float], pressure_kPa: float, modes_per_harmonic: int
) -> list[RawMode]:
    """Modes of harmonics 0 to 4, harmonic by harmonic. Raises EvaluationFailed."""
    question = Question({**values, "pressure_kPa": pressure_kPa}, (), modes_per_harmonic)
    modes = evaluator().evaluate(question).modes
    return sorted(modes, key=lambda mode: mode.shape.n)  # type: ignore[union-attr]


def ring_nodes(shape: HarmonicShape) -> Array:
    """Nodes of the outer surface nearest to the rings' places."""
    R, Z = shape.points.T
    tread = [np.argmax(R - 5 * abs(Z - z)) for z in TREAD_Z]
    side = [np.argmax(s * Z - 5 * abs(R - r)) for r in SIDEWALL_R for s in (-1, 1)]
    return shape.nodes[[*tread, *side]]


def sampled(modes: list[RawMode], rng: np.random.Generator) -> list[RawMode]:
    """The modes as a 3-D model would give them: real, halves apart, turned, noisy, shuffled."""
    angles = np.arange(24) / 24 * 2 * np.pi
    rings: list[RawMode] = []
    order = None
    for mode in modes:
        assert isinstance(mode.shape, HarmonicShape)
        nodes = ring_nodes(mode.shape)
        turn = rng.uniform(0, 2 * np.pi) if mode.shape.n else 0.0
        for phase in (turn, turn + np.pi / 2)[: mode.multiplicity]:
            ring = on_rings(mode.shape, nodes, angles, phase)
            order = rng.permutation(len(ring.points)) if order is None else order
            u = ring.displacement[order]
            u = u + NOISE * np.abs(u).max() * rng.standard_normal(u.shape)
            rings.append(RawMode(mode.frequency_Hz, RingShape(ring.points[order], u), 1))
    return [rings[i] for i in rng.permutation(len(rings))]


def mirrored(modes: list[RawMode]) -> dict[Label, float]:
    """Frequencies (Hz) by label, from the reflection of the whole section."""
    result = {}
    for n in range(5):
        pair = [
            mode for mode in modes if isinstance(mode.shape, HarmonicShape) and mode.shape.n == n
        ][:2]
        even = [_evenness(mode.shape) for mode in pair]  # type: ignore[arg-type]
        inner, outer = (pair[i] for i in np.argsort(even)[::-1])
        result[Label(n, 0) if n else TABLE_2[1]] = inner.frequency_Hz
        result[Label(n, 1) if n else TABLE_2[0]] = outer.frequency_Hz
    return result


def _evenness(shape: HarmonicShape) -> float:
    """Share of the motion that is symmetric under z -> -z."""
    even = (shape.amplitude + shape.amplitude[_images(shape.points.tobytes())] * [1, 1, -1]) / 2
    return float(np.sum(abs(even) ** 2) / np.sum(abs(shape.amplitude) ** 2))


@cache
def _images(points: bytes) -> Array:
    """Image of each node under z -> -z."""
    X = np.frombuffer(points).reshape(-1, 2)
    return np.asarray(KDTree(X).query(X * [1, -1])[1])


def frequencies(modes: list[Mode]) -> dict[Label, float]:
    return {mode.label: mode.frequency_Hz for mode in modes}


def main(designs: int) -> None:
    rng = np.random.default_rng(0)
    noise = np.random.default_rng(1)
    failed, done, seconds = 0, 0, 0.0
    wrong, lost, single, unlike = ({2: 0, 4: 0} for _ in range(4))
    clarity = {label: np.zeros(designs) for label in TABLE_2}
    while done < designs:
        belt, carcass, rubber = 10 ** rng.uniform([-7, -8, 5], [-5, -5, 7])
        pressure = rng.uniform(100, 320)
        values = {"A_belt": belt, "A_carcass": carcass, "C10": rubber}
        try:
            every = evaluate(values, pressure, 4)
        except EvaluationFailed as error:
            failed += 1
            print(f"replaced: {values} at {pressure:.0f} kPa: {error}")
            continue
        for count in (2, 4):
            modes = [mode for k, mode in enumerate(every) if k % 4 < count]
            start = time.perf_counter()
            labelled = label_modes(modes)
            seconds += time.perf_counter() - start
            one = frequencies(labelled)
            joined = pair_rings(sampled(modes, noise))
            two = frequencies(label_modes(joined))
            single[count] += len(joined) - len(modes)
            three = mirrored(modes)
            for label in TABLE_2:
                unlike[count] += one.get(label) != three[label]
                lost[count] += label not in one
                wrong[count] += one.get(label) != two.get(label)
                places = one.get(label), two.get(label), three[label]
                if len(set(places)) > 1:
                    print(f"{label} {places}: {values} {pressure:.0f}")
        for mode in labelled:
            if mode.label in clarity:
                clarity[mode.label][done] = mode.clarity
        done += 1
    print(f"{designs} designs, {failed} replaced, {len(TABLE_2) * designs} labels")
    for count in (2, 4):
        print(
            f"{count} modes per harmonic: {wrong[count]} labels differ on rings,"
            f" {unlike[count]} by reflection, {lost[count]} are lost,"
            f" {single[count]:+d} modes after joining"
        )
    print(f"labelling one evaluation: {seconds / 2 / designs * 1e3:.2f} ms")
    for label, values_ in clarity.items():
        print(
            f"{label!s:16} clarity: least {values_.min():.2f}, below 0.2: {(values_ < 0.2).sum()}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
