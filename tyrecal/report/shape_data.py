"""Data from which the report page draws the section, mode shapes and the pressure in the patch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import Field

from ..files import Json
from ..simulate.deck.abaqus import claimed, solid_claims
from ..simulate.evaluate.pressed import Pressed
from ..simulate.evaluate.results import Evaluation, HarmonicShape
from ..simulate.modes.label import Mode
from ..simulate.modes.loaded import MIRROR
from ..studies.footprint import patch_of
from ..studies.loaded import LoadedTyre
from ..studies.result import Named, Result, ResultPart, Wave
from ..tyre.case import LoadedCase
from ..tyre.effects.bead_seat import GAP_ENDING
from ..tyre.resolve import resolved
from ..tyre.section.mesh import SectionMesh
from .revolve import placed

Array = np.ndarray
Flat = list[float]  # points as z, r, z, r, ... in mm
SHAPE_DIGITS = 6  # decimals of a shape, whose largest component is 1
TOLERANCE_HZ = 1e-6  # between frequencies in a table and those of the shapes


class PatchData(ResultPart):
    """Contact pressure on a grid of nodes (ring, node): a ring per angle, its nodes across."""

    design: str
    load_N: float
    across_mm: list[list[float]]
    along_mm: list[list[float]]
    pressure_kPa: list[list[float]]
    edge_mm: list[Flat]  # closed lines round the patch, points as across, along, across, ...


class Patches(Result):
    """footprint_patches.json"""

    case: str
    patches: list[PatchData]


class CordLines(ResultPart):
    """The cords of a layer as lines along the section."""

    angle_deg: float
    lines: list[Flat]


class SectionData(ResultPart):
    """The section of a tyre as polygons and lines."""

    areas: dict[str, list[Flat]]  # elements by region or compound
    cords: dict[str, CordLines]  # by layer
    rim: list[Flat]  # elements that the rim holds, and held lines of the outline of other elements
    outline: Flat  # before the inflation
    inflated: Flat | None  # the outline after the inflation; None: not known


class Shape(Named):
    """A mode of the unloaded tyre on its section, or of the loaded tyre on its surface. Components
    are r, theta, z, the largest one 1."""

    # unloaded: amplitude (node, 3) of Re[amplitude exp(i n Theta)]
    n: Wave = 0
    real: list[list[float]] = Field(default=[])
    imaginary: list[list[float]] = Field(default=[])
    # loaded: symmetric or antisymmetric about the patch, and displacement (ring, node, 3)
    symmetry: str | None = None
    displacement: list[list[list[float]]] = Field(default=[])


class Shapes(Result):
    """Content of fit_shapes.json and modes_shapes.json: the outer surface, and the modes there."""

    case: str
    pressure_kPa: float
    load_N: float = 0.0
    variables: dict[str, list[str]] = Field(default={})  # paths that each variable sets
    section: SectionData | None = None
    # unloaded: nodes (node,) of `Shape.real`
    R_m: list[float] = Field(default=[])
    Z_m: list[float] = Field(default=[])
    # loaded: angles (ring,) from the middle of the patch, rad; points (ring, node, 3): r, way along
    # theta from the angle, z
    angles: list[float] = Field(default=[])
    surface_m: list[list[list[float]]] = Field(default=[])
    modes: list[Shape]

    def are_of(self, table: Sequence[Named]) -> bool:
        """Whether ``table`` lists these modes, and not those of another run. A split doublet has
        its mean frequency here, and both of them in the table."""
        for mode in self.modes:
            hertz = [
                each.frequency_Hz
                for each in table
                if (each.c, each.m, each.kind) == (mode.c, mode.m, mode.kind)
                and getattr(each, "symmetry", None) == mode.symmetry
            ]
            low, high = min(hertz, default=np.inf), max(hertz, default=-np.inf)
            if not low - TOLERANCE_HZ <= mode.frequency_Hz <= high + TOLERANCE_HZ:
                return False
        return True


class DiagnosisSection(Result):
    """Content of diagnosis_section.json: elements and cords by part of the section."""

    case: str
    areas: dict[str, list[Flat]]
    cords: dict[str, list[Flat]]


def tyre_data(case: LoadedCase, evaluation: Evaluation, modes: Sequence[Mode]) -> Json:
    """The content of `Shapes`: the section, and the modes on its outer surface from bead to bead.
    Both are left out for a tyre without a section.

    A shape is u = Re[amplitude exp(i n Theta)], in r, theta, z; for a pair the mode with its crest
    at Theta = 0. Modes that are not known on the whole section are left out.
    """
    common = {
        "format": 1,
        "case": case.case.name,
        "pressure_kPa": evaluation.pressure_kPa,
        "variables": {name: list(v.sets) for name, v in case.case.variables.items()},
    }
    if case.drawn is None:
        return {**common, "modes": []}
    mesh = resolved(case).mesh
    inflation, modes = placed(evaluation, modes, mesh)  # displacements on the nodes of this mesh
    nodes = mesh.skin()
    R, Z = np.array([mesh.nodes[int(n)] for n in nodes]).T
    return {
        **common,
        "section": section_data(case, mesh, inflation).model_dump(),
        "R_m": _rounded(R),
        "Z_m": _rounded(Z),
        "modes": [{**_name(mode), **_amplitude(mode, nodes)} for mode in modes],
    }


def section_data(
    case: LoadedCase, mesh: SectionMesh, displacement: Mapping[int, Array]
) -> SectionData:
    """The section on ``mesh``; displacement: node number to (r, theta, z) of the inflation, m;
    empty: unknown."""
    case = resolved(case).written  # its effects written into its other numbers
    place = {n: np.array([z, r]) * 1e3 for n, (r, z) in mesh.nodes.items()}
    areas: dict[str, list[Flat]] = {}
    for number, name in areas_of(case, mesh).items():
        areas.setdefault(name, []).append(_line(place, mesh.solids[number][:4]))
    around = mesh.outline()
    inflated = None
    if displacement:
        moved = {n: place[n] + 1e3 * np.take(displacement[n], [2, 0]) for n in around}
        inflated = _line(moved, around)
    angles = {name: layer.angle_deg for name, layer in case.case.rebar_layers.items()}
    layers = {name: turns(case, mesh, name) for name in angles}
    angles, layers = {**angles, **mesh.angles}, {**layers, **mesh.layers}
    cords = {
        name: CordLines(angle_deg=angles[name], lines=[_line(place, nodes) for nodes in lines])
        for name, lines in layers.items()
    }
    return SectionData(
        areas=areas,
        cords=cords,
        rim=[_line(place, nodes) for nodes in _held(mesh, around)],
        outline=_line(place, around),
        inflated=inflated,
    )


def _held(mesh: SectionMesh, around: list[int]) -> list[tuple[int, ...]]:
    """Corner nodes of the elements that the rim holds, and the held lines of the outline that
    belong to other elements."""
    held = set(mesh.rim)
    whole = [nodes for nodes in mesh.solids.values() if held.issuperset(nodes)]
    sides = pairwise([*around, *around[:1]])
    of_whole = set[int]().union(*whole)
    lines = [side for side in sides if held.issuperset(side) and not of_whole.issuperset(side)]
    return [nodes[:4] for nodes in whole] + lines


def areas_of(case: LoadedCase, mesh: SectionMesh) -> dict[int, str]:
    """Name under which each element is drawn: its region, or its compound if there are several."""
    solids = case.case.solids
    if len({solid.material for solid in solids}) < 2:
        order = [name for name, _ in case.section.regions]
        cells = sorted(mesh.cells.items(), key=lambda cell: order.index(cell[1][0]))
        return {number: region for number, (region, _) in cells}
    rows = tuple(case.case.mesh.levels[case.case.mesh.level].rows)
    # an entry of ``solids`` names regions or two lines; the last one that fits an element counts
    claims, lines = solid_claims(case.case), case.section.names
    claimants = {n: claimed(claims, lines, rows, *cell) for n, cell in mesh.cells.items()}
    return {n: solids[i].material for n, i in claimants.items() if i is not None}


def parts_data(case: LoadedCase, named: Iterable[str]) -> DiagnosisSection:
    """Elements and cords by part of the section.

    named: names of parts in the diagnosis's section map, "region" or "region, detail".
    """
    mesh = resolved(case).mesh
    place = {n: np.array([z, r]) * 1e3 for n, (r, z) in mesh.nodes.items()}
    parts = mesh.compounds or rubber_parts(case, mesh, {name.split(",")[0] for name in named})
    cords = {k: [_line(place, x) for x in lines] for k, lines in mesh.lines_by_cord.items()}
    for layer in case.case.rebar_layers.values():
        lines = mesh.cords[layer.line].values()
        name = f"{layer.material.replace('_', ' ')}s"
        cords.setdefault(name, []).extend(_line(place, x) for x in lines)
    areas = {name: [_line(place, nodes) for nodes in solids] for name, solids in parts.items()}
    return DiagnosisSection(format=1, case=case.case.name, areas=areas, cords=cords)


def turns(case: LoadedCase, mesh: SectionMesh, name: str) -> list[tuple[int, ...]]:
    """Nodes of the elements with which a layer is drawn: layers on one line share them in turn."""
    layers = case.case.rebar_layers
    layer = layers[name]
    sharing = [
        other
        for other, its in layers.items()
        if (its.line, its.regions) == (layer.line, layer.regions)
    ]
    own = [
        nodes
        for cord, nodes in mesh.cords[layer.line].items()
        if not layer.regions or mesh.region_of(cord) in layer.regions
    ]
    return own[sharing.index(name) :: len(sharing)]


def rubber_parts(
    case: LoadedCase, mesh: SectionMesh, named: set[str]
) -> dict[str, list[tuple[int, ...]]]:
    """Corner nodes of the elements of each part, by its name in the section map.

    The crown is divided into the tread and the rest, unless ``named`` has the crown. The part of a
    bead that the rim does not hold counts as bead.
    """
    regions = [name for name, _ in case.section.regions]
    crown = regions[0]
    rows = case.case.mesh.levels[case.case.mesh.level].rows
    parts: dict[str, list[tuple[int, ...]]] = {}
    for number, (region, row) in mesh.cells.items():
        own = region if region in regions else region.removesuffix(GAP_ENDING)
        name = own.replace("_", " ")
        if region == crown and name not in named:
            name = "tread" if row >= sum(rows[:-1]) else f"{name} under the tread"
        parts.setdefault(name, []).append(mesh.solids[number][:4])
    return parts


def loaded_data(tyre: LoadedTyre, case: LoadedCase) -> Json:
    """The content of `Shapes` for the tyre on the road at its last load: points of the deformed
    outer surface, and the displacement of the modes there."""
    last = tyre.loads[-1]
    assert tyre.angles is not None and last.surface is not None
    order = np.argsort(last.surface[0, :, 2])
    return {
        "format": 1,
        "case": case.case.name,
        "pressure_kPa": tyre.pressure_kPa,
        "load_N": last.load_N,
        "angles": _rounded(tyre.angles),
        "surface_m": _rounded(last.surface[:, order]),
        "modes": [
            {
                "c": mode.member.label.c,
                "m": mode.member.label.m,
                "kind": mode.member.label.kind,
                "symmetry": mode.member.symmetry,
                "frequency_Hz": mode.frequency_Hz,
                "displacement": _scaled(mode.shape[:, order]),
            }
            for mode in last.modes
            if mode.shape is not None
        ],
    }


def patches_data(
    name: str, designs: Mapping[str, Pressed], meshes: Mapping[str, SectionMesh]
) -> Patches:
    """The contact pressure of every design and load on the nodes in the patch and next to it."""
    patches = []
    for design, pressed in designs.items():
        for footprint in pressed.footprints:
            patch = patch_of(pressed, footprint, meshes[design])
            near = _grown(patch.touches)
            patches.append(
                PatchData(
                    design=design,
                    load_N=footprint.load_N,
                    across_mm=_rounded(1e3 * patch.across[near], 3),
                    along_mm=_rounded(1e3 * patch.along[near], 3),
                    pressure_kPa=_rounded(1e-3 * patch.pressure[near], 3),
                    edge_mm=[_rounded(1e3 * line.ravel(), 2) for line in patch.edges()],
                )
            )
    return Patches(format=1, case=name, patches=patches)


def _grown(touches: Array) -> tuple[slice, slice]:
    """Rings and nodes of the patch, and one more on each side, without pressure, so that contours
    are closed."""
    touched = [np.flatnonzero(touches.any(axis)) for axis in (1, 0)]
    rings, nodes = (slice(max(0, each[0] - 1), each[-1] + 2) for each in touched)
    return rings, nodes


def _amplitude(mode: Mode, nodes: Array) -> Json:
    """The fields of `Shape` for an unloaded mode."""
    shape = mode.raw.shape
    assert isinstance(shape, HarmonicShape)
    row = {int(n): k for k, n in enumerate(shape.nodes)}
    A = shape.amplitude[[row[int(n)] for n in nodes]]
    if shape.n:  # turn the mode so that r and z are as real, and theta as imaginary, as possible
        A = A * np.exp(-0.5j * np.angle((A**2 * MIRROR).sum()))
    largest = np.argmax(abs(A.real))
    A = A * (np.sign(A.real.ravel()[largest]) or 1.0)
    return {"n": shape.n, "real": _scaled(A.real, A), "imaginary": _scaled(A.imag, A)}


def _name(mode: Mode) -> Json:
    label = mode.label
    return {"c": label.c, "m": label.m, "kind": label.kind, "frequency_Hz": mode.frequency_Hz}


def _scaled(values: Array, over: Array | None = None) -> Any:
    """Values over the largest size of ``over``, or of the values."""
    return _rounded(values / np.abs(values if over is None else over).max())


def _line(place: Mapping[int, Array], nodes: Iterable[int]) -> Flat:
    """The points of nodes; ``place``: z, r in mm by node."""
    return _rounded(np.concatenate([place[n] for n in nodes]), 3)


def _rounded(values: Any, digits: int = SHAPE_DIGITS) -> Any:
    return (np.round(np.asarray(values, float), digits) + 0.0).tolist()  # no minus zero
