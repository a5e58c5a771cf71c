"""The bundled solver against CalculiX: frequencies and shapes of one discrete problem.

    python tests/studies/calculix.py > table.md

Made common: cords after St Venant and Kirchhoff, W = EA/(2s) E^2 with E = (lambda^2 - 1)/2; sides
straight in the section; plies of the same thickness t, in the bundled solver as two lines with
half the cords each, where CalculiX's reduced integration has its points: t / sqrt(12) to either
side of the cord line. "as shipped": the bundled solver's own law, curved sides, cords on lines.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
from tyrecal_solvers.bundled import cords

from tyrecal.case import LoadedCase, load_case, with_values
from tyrecal.deck import context
from tyrecal.deck.calculix import PLY_THICKNESS_M
from tyrecal.deck.sector import interleaved, with_plies
from tyrecal.evaluate.door import Door, Question
from tyrecal.evaluate.failure import EvaluationFailed
from tyrecal.evaluate.results import Evaluation, HarmonicShape
from tyrecal.modes.label import label_modes
from tyrecal.modes.mode import Mode
from tyrecal.modes.subspace import mac
from tyrecal.tyre.mesh import SectionMesh, build_mesh

ROOT = Path(__file__).parents[2]
CASES = ("p235_75r17", "p235_75r17_narrow_rim")
INITIAL = {"A_belt": 2.118683e-7, "A_carcass": 4.208352e-7, "C10": 1e6}
OPTIMISED = {"A_belt": 3.64826e-7, "A_carcass": 8.01133e-8, "C10": 1e6}  # by the paper
ANOTHER = {"A_belt": 6e-7, "A_carcass": 1.5e-7, "C10": 7e5}
POINTS = [  # design, variables, kPa
    ("initial", INITIAL, 240.0),
    ("optimised", OPTIMISED, 240.0),
    ("another", ANOTHER, 160.0),
    ("initial", INITIAL, 100.0),
    ("optimised", OPTIMISED, 320.0),
]


def energy(q: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """St Venant-Kirchhoff cords in place of `cords.energy`."""
    return stiffness * _strain(q) ** 2 / 2


def force(q: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """dW/dq."""
    return (stiffness * _strain(q))[:, None] * q


def tangent(q: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """d2W/dqdq."""
    along = stiffness[:, None, None] * q[:, :, None] * q[:, None, :]
    return along + (stiffness * _strain(q))[:, None, None] * np.eye(3)


def _strain(q: np.ndarray) -> np.ndarray:
    return ((q * q).sum(-1) - 1) / 2


def split(case: LoadedCase, thickness: float) -> LoadedCase:
    """The case with each layer as two halves at +- thickness / sqrt(12) of its line."""
    c = case.case
    level = c.mesh.levels[c.mesh.level]
    gaps = len(level.rows)
    thin = level.model_copy(
        update={
            "rows": interleaved(list(level.rows), [1] * (gaps - 1)),
            "grading": interleaved(list(level.grading or [1.0] * gaps), [1.0] * (gaps - 1)),
        }
    )
    layers = {
        f"{name}_{side}": layer.model_copy(
            update={"line": layer.line + sign, "area_m2": layer.area_m2 / 2}
        )
        for name, layer in c.rebar_layers.items()
        for side, sign in (("in", "-"), ("out", "+"))
    }
    mesh = c.mesh.model_copy(update={"levels": {c.mesh.level: thin}})
    new = c.model_copy(update={"mesh": mesh, "rebar_layers": layers, "variables": {}})
    return replace(case, case=new, section=with_plies(case.section, thickness / np.sqrt(3)))


def straight(*arguments: object) -> SectionMesh:
    """`build_mesh` with sides straight in the section; columns of nodes are 1000 apart."""
    mesh = build_mesh(*arguments)  # type: ignore[arg-type]
    for n in [n for n in mesh.nodes if (n // 1000) % 2 == 0]:
        a, b = np.array(mesh.nodes[n - 1000]), np.array(mesh.nodes[n + 1000])
        mesh.nodes[n] = tuple((a + b) / 2)
    return mesh


@contextmanager
def common() -> Iterator[None]:
    """The bundled solver with CalculiX's cord law and sides, in this process."""
    laws = {"energy": energy, "force": force, "tangent": tangent}
    context._mesh.cache_clear()
    with patch.multiple(cords, **laws), patch.object(context, "build_mesh", straight):
        yield
    context._mesh.cache_clear()


def on_common_nodes(a: HarmonicShape, b: HarmonicShape) -> tuple[HarmonicShape, HarmonicShape]:
    """Both shapes on the nodes that the two meshes share, to 10 micrometres."""
    places = [{tuple(np.round(p, 5)): i for i, p in enumerate(s.points)} for s in (a, b)]
    both = sorted(places[0].keys() & places[1].keys())
    result = []
    for shape, place in zip((a, b), places, strict=True):
        rows = [place[p] for p in both]
        result.append(
            HarmonicShape(shape.n, np.arange(len(rows)), shape.points[rows], shape.amplitude[rows])
        )
    return result[0], result[1]


def labelled(answer: Evaluation) -> dict[str, Mode]:
    """Modes by the text of their label."""
    return {str(mode.label): mode for mode in label_modes(answer.modes)}


def main() -> None:
    print("| case | design | kPa | mode | CalculiX, Hz | common problem | MAC | as shipped |")
    print("|---|---|---|---|---|---|---|---|")
    worst: list[float] = []
    for design, variables, pressure in POINTS:
        for name in CASES:
            case = with_values(
                load_case(ROOT / "cases" / f"{name}.yaml"),
                {**variables, "pressure_kPa": pressure},
            )
            rows = _compare(case)
            if rows is None:
                print(f"| {name} | {design} | {pressure:g} | CalculiX failed | | | | |")
                continue
            for row in rows:
                print(f"| {name} | {design} | {pressure:g} | {row[0]}", end=" | ")
                print(f"{row[1]:.3f} | {row[2]:+.3f} % | {row[3]:.5f} | {row[4]:+.2f} % |")
            sys.stdout.flush()
            worst.append(max(abs(row[2]) for row in rows))
    print(f"\nLargest deviation from the common problem: {max(worst):.3f} %")


def _compare(case: LoadedCase) -> list[tuple[str, float, float, float, float]] | None:
    """Per target mode: label, CalculiX's Hz, deviation (%), MAC, deviation as shipped (%)."""
    try:
        theirs = labelled(Door(case, "calculix").evaluate(Question({})))
    except EvaluationFailed as failure:
        print(failure, file=sys.stderr)
        return None
    shipped = labelled(Door(case, "bundled").evaluate(Question({})))
    with common():
        thick = split(case, PLY_THICKNESS_M)
        ours = labelled(Door(thick, "bundled").evaluate(Question({})))
    rows = []
    for target in case.case.targets.modes:
        key = f"[{target.c},{target.m}]" + (f" {target.kind}" if target.kind else "")
        a, b = ours[key], theirs[key]
        assert isinstance(a.raw.shape, HarmonicShape) and isinstance(b.raw.shape, HarmonicShape)
        f = b.frequency_Hz
        same = mac(*on_common_nodes(a.raw.shape, b.raw.shape))
        rows.append((key, f, off(f, a), same, off(f, shipped[key])))
    return rows


def off(frequency: float, mode: Mode) -> float:
    """Deviation of a frequency from a mode's, %."""
    return 100 * (frequency / mode.frequency_Hz - 1)


if __name__ == "__main__":
    main()
