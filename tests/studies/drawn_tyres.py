"""Drawn tyres by `init` pressed on the road: how many, how smoothly, and with which slopes.

    python -m tests.studies.drawn_tyres [COUNT] [SEED] [FIRST] [A1,A2,...] >> drawn_tyres.jsonl
    python -m tests.studies.drawn_tyres tests/benchmarks/drawn_tyres.jsonl

Ten sizes in turn, coarse mesh, each with gauges, belts, areas of cords, moduli of rubber and a
pressure drawn; A1, A2, ...: other elements round half the tyre, degrees. A line of JSON says why
one of eight loads up to the rated one was not reached; how far the stiffness is from a fitted cubic
of the load; how far the slopes of stiffness and area at two loads, along a drawn direction of the
variables' logarithms, are from central differences of whole presses; and how many points of cords
are slack on one side of these and taut on the other at the higher load.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json
import math
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tyrecal_solvers.bundled.section.parts.cords import LogarithmicCord, stretch

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.pressed import Footprint
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.section.from_size import usual
from tyrecal.tyre.section.size import TyreSize, parse_size

from .belts import ANGLES_DEG, with_belts
from .sizes_calculix import SIZES
from .wrinkles import by_size

Array = np.ndarray
GAUGES = {"crown": 0.15, "sidewall": 0.2, "bead": 0.1, "belt": 0.05}  # relative, either side
VARIABLES = 0.25  # of the logarithm of areas of cords and moduli of rubber, either side
PRESSURES = (0.8, 1.2)  # of the size's
LOADS = tuple(share / 10 for share in range(3, 11))  # of the rated load
COMPARED = (0.5, 1.0)  # those of the slopes
STEP = 5e-3  # of the logarithms
QUANTITIES = {"stiffness": "stiffness_N_per_m", "area": "contact_area_m2"}


def drawn(size: TyreSize, random: np.random.Generator, angles: Sequence[float] = ()) -> LoadedCase:
    """A tyre of the size, coarse mesh; its variables as `init` writes them. angles: of the elements
    round half of it, degrees, where not `init`'s."""
    own = usual(size)
    lengths = {
        name: getattr(own, name) * (1 + random.uniform(-share, share))
        for name, share in GAUGES.items()
    }
    case = with_level(by_size(size.text, lengths), "coarse")
    pressure_kPa = case.case.pressure_kPa * random.uniform(*PRESSURES)
    case = with_belts(case, random.uniform(*ANGLES_DEG), pressure_kPa)
    if not angles:
        return case
    road = case.case.road.model_copy(update={"element_angles_deg": list(angles)})
    return replace(case, case=case.case.model_copy(update={"road": road}))


@contextmanager
def watched_cords() -> Iterator[list[Array]]:
    """The strains (p,) of cords that bear no compression where forces were asked for last."""
    force, last = LogarithmicCord.force, [np.zeros(0)]

    def watch(law: LogarithmicCord, z: Array) -> Array:
        last[0] = np.log(stretch(z.real))[np.asarray(law.compressed) == 0]
        return force(law, z)

    LogarithmicCord.force = watch  # type: ignore[method-assign]
    try:
        yield last
    finally:
        LogarithmicCord.force = force  # type: ignore[method-assign]


def line_of(size: TyreSize, random: np.random.Generator, angles: list[float]) -> dict[str, Any]:
    """The results of one drawn tyre."""
    case = drawn(size, random, angles)
    evaluator = Evaluator(TyreDesign(case))
    start = {
        name: value * math.exp(random.uniform(-VARIABLES, VARIABLES))
        for name, value in start_values(case).items()
    }
    loads = [share * size.load_N for share in LOADS]
    begun = time.process_time()
    try:
        pressed = evaluator.press(start, loads)
        own: dict[str, Any] = {"reached": len(pressed.footprints)}
        if pressed.failed:
            raise pressed.failed
        stiffness = np.array([each.stiffness_N_per_m for each in pressed.footprints])
        cubic = np.polyval(np.polyfit(LOADS, stiffness, 3), LOADS)
        own["cubic_percent"] = round(100 * float(abs(stiffness / cubic - 1).max()), 3)
        own["slopes"] = slopes(evaluator, start, random, [x * size.load_N for x in COMPARED])
    except EvaluationFailed as failure:
        own["failed"] = f"{failure.cause}: {failure.words}"
    return own | {"processor_s": round(time.process_time() - begun, 1)}


def slopes(
    evaluator: Evaluator,
    start: Mapping[str, float],
    random: np.random.Generator,
    loads: Sequence[float],
) -> list[dict[str, float]]:
    """How far the slopes at loads are from differences, relative, and the cords that change.
    Raises EvaluationFailed."""
    direction = {name: float(random.normal()) for name in start}
    exact = evaluator.press(start, loads, gradients=tuple(start), base=start).footprints
    sides = list[tuple[Footprint, ...]]()
    strains = []
    for side in (1, -1):
        values = {name: x * math.exp(side * STEP * direction[name]) for name, x in start.items()}
        with watched_cords() as last:
            sides.append(evaluator.press(values, loads, base=start).footprints)
        strains.append(last[0])
    changed = int(((strains[0] < 0) != (strains[1] < 0)).sum())
    rows = []
    for at, above, below in zip(exact, *sides, strict=True):
        own: dict[str, float] = {"load_N": at.load_N, "changed": changed}
        for name, q in QUANTITIES.items():
            by_slopes = sum(at.slopes[v][q] * start[v] * direction[v] for v in start)
            by_differences = (getattr(above, q) - getattr(below, q)) / (2 * STEP)
            own[name] = float(f"{by_slopes / by_differences - 1:.3g}")
            own[f"{name}_slope"] = float(f"{by_differences / getattr(at, q):.3g}")
        rows.append(own)
    return rows


def table(lines: Sequence[dict[str, Any]]) -> Iterator[str]:
    """The counts in words."""
    reached = [line for line in lines if "failed" not in line]
    cubic = np.array([line["cubic_percent"] for line in reached])
    yield f"{len(reached)} of {len(lines)} drawn tyres pressed at all loads"
    yield from (f"{line['size']}: {line['failed']}" for line in lines if "failed" in line)
    yield (
        f"stiffness off a cubic: median {np.median(cubic):.2f}, worst {cubic.max():.2f} %,"
        f" {(cubic <= 0.5).sum()} of {len(cubic)} within 0.5 %"
    )
    points = [each for line in reached for each in line["slopes"]]
    changing = [each for each in points if each["changed"]]
    yield f"{len(points)} points, cords change between slack and taut in {len(changing)}"
    for kind, chosen in (("all", points), *([("changing", changing)] if changing else [])):
        for name in QUANTITIES:
            off = 100 * abs(np.array([each[name] for each in chosen]))
            within = int((off <= 5).sum())
            yield (
                f"{kind}: slopes of {name} off differences by {np.median(off):.2f} % in the median,"
                f" {off.max():.2f} % at worst, {within} of {len(off)} within 5 %"
            )


def main(count: int, seed: int, first: int, angles: list[float]) -> None:
    """Print the lines of tyres from the ``first`` on, and the counts to stderr."""
    lines = []
    for k in range(first, first + count):
        code = SIZES[k % len(SIZES)]
        random = np.random.default_rng([seed, k])
        line = {
            "size": code,
            "seed": seed,
            "number": k,
            **line_of(parse_size(code), random, angles),
        }
        lines.append(line)
        print(json.dumps(line), flush=True)
    print("\n".join(table(lines)), file=sys.stderr)


if __name__ == "__main__":
    if sys.argv[1:] and Path(sys.argv[1]).is_file():
        print("\n".join(table([json.loads(x) for x in Path(sys.argv[1]).read_text().splitlines()])))
    else:
        given = [int(x) for x in sys.argv[1:4]]
        around = [float(x) for x in "".join(sys.argv[4:]).split(",") if x]
        main(*given, *(50, 1, 0)[len(given) :], around)
