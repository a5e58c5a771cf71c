"""The bundled solver against CalculiX: frequencies and shapes of one discrete problem.

    python tests/studies/calculix.py [RECORD] > table.md

RECORD: a folder for CalculiX's answers; the same command goes on where it was stopped. (The bundled
solver is asked anew, since its record would not know what is switched here.)

Made common: cords after St Venant and Kirchhoff, W = EA/(2s) E^2 with E = (lambda^2 - 1)/2; sides
straight in the section; plies of the same thickness t, in the bundled solver as two lines with
half the cords each, where CalculiX's reduced integration has its points: t / sqrt(12) to either
side of the cord line. "as shipped": the bundled solver's own law, curved sides, cords on lines.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from tyrecal_solvers.bundled.section.parts import cords

from tyrecal.simulate.deck.calculix import PLY_THICKNESS_M
from tyrecal.simulate.deck.sector import with_plies
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, Mode, label_modes
from tyrecal.simulate.modes.rings import mac
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.section import mesh as mesh_module
from tyrecal.tyre.section.mesh import SectionMesh, build_mesh, kept_mesh
from tyrecal.tyre.values import with_values

ROOT = Path(__file__).parents[2]
CASES = ("p235_75r17", "p235_75r17_narrow_rim")
INITIAL = (2.118683e-7, 4.208352e-7, 1e6)  # A_belt, m2; A_carcass, m2; C10, Pa
OPTIMISED = (3.64826e-7, 8.01133e-8, 1e6)  # by the paper
DRAWN = [  # once: default_rng(0), uniform in ln, within a factor of 3 of the initial, in the box
    ((3.25e-7, 2.54e-7, 3.65e5), 100.0),
    ((1.03e-7, 8.38e-7, 2.48e6), 144.0),
    ((3.07e-7, 6.97e-7, 1.1e6), 188.0),
    ((5.64e-7, 8.42e-7, 3.35e5), 232.0),
    ((4.88e-7, 1.51e-7, 1.66e6), 276.0),
    ((1.38e-7, 9.35e-7, 1.1e6), 320.0),
]
POINTS = [
    *(("initial", INITIAL, kPa) for kPa in (100.0, 200.0, 240.0, 320.0)),
    *(("optimised", OPTIMISED, kPa) for kPa in (100.0, 200.0, 240.0, 320.0)),
    *((f"drawn {i}", values, kPa) for i, (values, kPa) in enumerate(DRAWN, start=1)),
]
IN_FULL = 240.0  # kPa, where all nine frequencies are listed


class StVenantKirchhoff(cords.LogarithmicCord):
    """Cords with W = EA / (2 s) E^2, E = (lambda^2 - 1) / 2."""

    def energy(self, z: np.ndarray) -> np.ndarray:
        return self.stiffness * _strain(z) ** 2 / 2

    def force(self, z: np.ndarray) -> np.ndarray:
        return (self.stiffness * _strain(z))[:, None] * z

    def tangent(self, z: np.ndarray, weights: np.ndarray | float = 1.0) -> np.ndarray:
        D = self.stiffness[:, None, None] * z[:, :, None] * z[:, None, :]
        D = D + (self.stiffness * _strain(z) + self.tension)[:, None, None] * np.eye(3)
        return D * np.reshape(weights, (-1, 1, 1))


def _strain(q: np.ndarray) -> np.ndarray:
    return ((q * q).sum(-1) - 1) / 2


def split(case: LoadedCase, thickness: float, faces_at: frozenset[str] = frozenset()) -> LoadedCase:
    """The case with each layer as two halves at +- thickness / sqrt(12) of its line, and one more
    line at the ply's outer face where another rubber begins there, or at ``faces_at``: a ply lies
    in the rubber inside it."""
    c = case.case
    level = c.mesh.levels[c.mesh.level]
    lines, outer = case.section.names, with_plies(case.section, thickness)
    inner = with_plies(case.section, thickness / np.sqrt(3))
    edges = faces_at | {name for solid in c.solids for name in solid.between or ()}
    faces = {name: f"{name}face" for name in lines[1:-1] if name in edges}
    names, points = [lines[0]], [case.section.points[0]]
    rows, grading = [level.rows[0]], [level.grading[0] if level.grading else 1.0]
    for k, name in enumerate(lines[1:-1], start=1):
        halves = [inner.names.index(name + sign) for sign in "-+"]
        names += [inner.names[i] for i in halves]
        points += [inner.points[i] for i in halves]
        if name in faces:
            names.append(faces[name])
            points.append(outer.points[outer.names.index(name + "+")])
        thin = 1 + (name in faces)
        rows += [*[1] * thin, level.rows[k]]
        grading += [*[1.0] * thin, level.grading[k] if level.grading else 1.0]
    names.append(lines[-1])
    points.append(case.section.points[-1])
    split_level = level.model_copy(update={"rows": rows, "grading": grading})
    layers = {
        f"{name}_{side}": layer.model_copy(
            update={"line": layer.line + sign, "area_m2": layer.area_m2 / 2}
        )
        for name, layer in c.rebar_layers.items()
        for side, sign in (("in", "-"), ("out", "+"))
    }
    solids = [
        s.model_copy(update={"between": [faces.get(n, n) for n in s.between]}) if s.between else s
        for s in c.solids
    ]
    mesh = c.mesh.model_copy(update={"levels": {c.mesh.level: split_level}})
    new = c.model_copy(
        update={"mesh": mesh, "rebar_layers": layers, "variables": {}, "solids": solids}
    )
    section = replace(case.section, names=tuple(names), points=np.array(points))
    return replace(case, case=new, drawn=section)


def straight(*arguments: object) -> SectionMesh:
    """`build_mesh` with sides straight in the section; columns of nodes are 1000 apart."""
    mesh = build_mesh(*arguments)  # type: ignore[arg-type]
    for n in [n for n in mesh.nodes if (n // 1000) % 2 == 0]:
        a, b = np.array(mesh.nodes[n - 1000]), np.array(mesh.nodes[n + 1000])
        mesh.nodes[n] = tuple((a + b) / 2)
    return mesh


@contextmanager
def common(law: bool = True, sides: bool = True) -> Iterator[None]:
    """The bundled solver with CalculiX's cord law, sides, or both, in this process."""
    kept_mesh.cache_clear()
    with ExitStack() as switched:
        if law:
            switched.enter_context(patch.object(cords, "LogarithmicCord", StVenantKirchhoff))
        if sides:
            switched.enter_context(patch.object(mesh_module, "build_mesh", straight))
        yield
    kept_mesh.cache_clear()


@contextmanager
def rewritten(deck: Callable[[str], str]) -> Iterator[None]:
    """Write all decks with the text that ``deck`` gives them."""
    plain = TyreDesign.texts

    def texts(design: TyreDesign, dialect: str, request: Mapping[str, Any]) -> dict[str, str]:
        return {name: deck(text) for name, text in plain(design, dialect, request).items()}

    with patch.object(TyreDesign, "texts", texts):
        yield


def on_common_nodes(a: HarmonicShape, b: HarmonicShape) -> tuple[HarmonicShape, HarmonicShape]:
    """Shapes on the nodes that the two meshes share, to 10 micrometres."""
    places = [{tuple(np.round(p, 5)): i for i, p in enumerate(s.points)} for s in (a, b)]
    both = sorted(places[0].keys() & places[1].keys())
    result = []
    for shape, place in zip((a, b), places, strict=True):
        rows = [place[p] for p in both]
        result.append(
            HarmonicShape(shape.n, np.arange(len(rows)), shape.points[rows], shape.amplitude[rows])
        )
    return result[0], result[1]


@dataclass(frozen=True)
class Row:
    """One mode: CalculiX's Hz; % from the bundled solver on the common problem; MAC; % from it as
    shipped."""

    mode: str
    frequency_Hz: float
    common: float
    mac: float
    shipped: float


def compare(case: LoadedCase, store: Store | None) -> list[Row]:
    """The case's target modes in both solvers. Raises EvaluationFailed."""
    theirs = modes_of(case, "calculix", store)
    shipped = modes_of(case, "bundled")
    with common():
        ours = modes_of(split(case, PLY_THICKNESS_M), "bundled")
    rows = []
    for key, b in theirs.items():
        a = ours[key]
        assert isinstance(a.raw.shape, HarmonicShape) and isinstance(b.raw.shape, HarmonicShape)
        same = mac(*on_common_nodes(a.raw.shape, b.raw.shape))
        rows.append(Row(key, b.frequency_Hz, off(b, a), same, off(b, shipped[key])))
    return rows


def modes_of(case: LoadedCase, solver: str, store: Store | None = None) -> dict[str, Mode]:
    """The case's target modes by the text of their label. Raises EvaluationFailed."""
    try:
        answer = Evaluator(TyreDesign(case), solver, store=store).evaluate(Question({}))
    except EvaluationFailed as failure:
        raise EvaluationFailed(failure.cause, f"{solver}: {failure.words}") from None
    targets = [Label(t.c, t.m, t.kind) for t in case.case.targets.modes]
    return {str(label): mode for label, mode in match(label_modes(answer.modes), targets).items()}


def off(mode: Mode, other: Mode) -> float:
    """Deviation of a mode's frequency from another's, %."""
    return 100 * (mode.frequency_Hz / other.frequency_Hz - 1)


def at(name: str, values: tuple[float, ...], pressure: float) -> LoadedCase:
    """A design of the case ``name`` at a pressure in kPa."""
    variables = dict(zip(("A_belt", "A_carcass", "C10"), values, strict=True))
    case = load_case(ROOT / "cases" / f"{name}.yaml")
    return with_values(case, {**variables, "pressure_kPa": pressure})


def switches(values: tuple[float, ...]) -> list[tuple[str, float, float]]:
    """Effect of single changes on the bundled solver: name, least and largest %, 240 kPa."""
    case = at(CASES[0], values, 240.0)
    plain = modes_of(case, "bundled")
    rows = []
    for what, law, sides, thickness in (
        ("cord law: St Venant and Kirchhoff for logarithmic strain", True, False, 0.0),
        ("sides straight in the section, for curved", False, True, 0.0),
        ("plies 0.2 mm thick, for lines", False, False, 2e-4),
        ("plies 0.1 mm thick, for lines", False, False, 1e-4),
        ("all, plies 0.2 mm", True, True, 2e-4),
    ):
        with common(law, sides):
            changed = modes_of(split(case, thickness) if thickness else case, "bundled")
        changes = [off(changed[key], plain[key]) for key in plain]
        rows.append((what, min(changes), max(changes)))
    return rows


def c3d8(store: Store | None) -> tuple[float, float]:
    """Least and largest % of C3D8 above the bundled solver: main case, initial, 240 kPa."""
    case = at(CASES[0], INITIAL, 240.0)
    solver = case.case.solver.model_copy(update={"options": {"element": "C3D8"}})
    linear = replace(case, case=case.case.model_copy(update={"solver": solver}))
    ours, theirs = modes_of(case, "bundled"), modes_of(linear, "calculix", store)
    changes = [off(theirs[key], ours[key]) for key in ours]
    return min(changes), max(changes)


def main(store: Store | None) -> None:
    print("| switched | initial | optimised |\n|---|---|---|")
    for (what, *one), (_, *other) in zip(switches(INITIAL), switches(OPTIMISED), strict=True):
        print(f"| {what} | {one[0]:+.2f} to {one[1]:+.2f} | {other[0]:+.2f} to {other[1]:+.2f} |")
    low, high = c3d8(store)
    print(f"\nC3D8, initial, 240 kPa: {low:+.1f} to {high:+.1f} % from the bundled solver\n")
    print("| case | design | kPa | worst mode | its deviation | smallest MAC | as shipped |")
    print("|---|---|---|---|---|---|---|")
    full, every = [], []
    for name in CASES:
        for design, values, pressure in POINTS:
            where = f"| {name} | {design} | {pressure:g}"
            try:
                rows = compare(at(name, values, pressure), store)
            except EvaluationFailed as failure:
                print(f"{where} | {failure} | | | |", flush=True)
                continue
            worst = max(rows, key=lambda row: abs(row.common))
            least, most = min(r.mac for r in rows), max((r.shipped for r in rows), key=abs)
            print(f"{where} | {worst.mode} | {worst.common:+.3f} %", end=" | ")
            print(f"{least:.5f} | {most:+.2f} % |", flush=True)
            every += rows
            if pressure == IN_FULL:
                full += [(where, row) for row in rows]
    print("\n| case | design | kPa | mode | CalculiX, Hz | common problem | MAC | as shipped |")
    print("|---|---|---|---|---|---|---|---|")
    for where, r in full:
        print(f"{where} | {r.mode} | {r.frequency_Hz:.3f} | {r.common:+.3f} %", end=" | ")
        print(f"{r.mac:.5f} | {r.shipped:+.2f} % |")
    print(
        f"\n{len(every)} modes; largest deviation from the common problem"
        f" {max(abs(r.common) for r in every):.3f} %, smallest MAC {min(r.mac for r in every):.5f},"
        f" largest deviation as shipped {max(abs(r.shipped) for r in every):.2f} %"
    )


if __name__ == "__main__":
    main(Store(Path(sys.argv[1])) if len(sys.argv) > 1 else None)
