"""What a page draws later, kept as data: the section, mode shapes, pressure in the patch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..case import LoadedCase
from ..deck.context import section_mesh
from ..effects import with_effects
from ..evaluate.pressed import Pressed
from ..evaluate.results import Evaluation, HarmonicShape
from ..modes.loaded import MIRROR
from ..modes.mode import Mode
from ..studies.loaded import LoadedTyre
from ..studies.patch import patch_of
from ..tyre.mesh import SectionMesh
from .diagnosis_pictures import cord_part, rubber_parts
from .revolve import placed, skin
from .section import outline, turns

Array = np.ndarray
DIGITS = 6  # of a shape, over its largest component


def tyre_data(case: LoadedCase, evaluation: Evaluation, modes: Sequence[Mode]) -> dict[str, Any]:
    """The content of fit_shapes.json and modes_shapes.json: the section, and the modes' shapes on
    its outer surface, from one edge of the bead to the other.

    A shape is u = Re[amplitude exp(i n Theta)], in r, theta, z; of a pair the member whose crest
    stands at Theta = 0. Modes that are not known on the section are left out.
    """
    mesh = section_mesh(case)
    moved, modes = placed(evaluation, modes, mesh)
    nodes = skin(mesh)
    R, Z = np.array([mesh.nodes[int(n)] for n in nodes]).T
    return {
        "format": 1,
        "case": case.case.name,
        "pressure_kPa": evaluation.pressure_kPa,
        "variables": {name: list(v.sets) for name, v in case.case.variables.items()},
        "section": section_data(case, mesh, moved),
        "R_m": _rounded(R),
        "Z_m": _rounded(Z),
        "modes": [{**_name(mode), **_amplitude(mode, nodes)} for mode in modes],
    }


def section_data(
    case: LoadedCase, mesh: SectionMesh, displacement: Mapping[int, Array]
) -> dict[str, Any]:
    """Elements by region, cords by layer, what the rim holds, the outline before and after the
    inflation: points z, r in mm, one after the other."""
    case = with_effects(case)
    place = {n: np.array([z, r]) * 1e3 for n, (r, z) in mesh.nodes.items()}
    areas: dict[str, list[list[float]]] = {name: [] for name, _ in case.section.regions}
    for number, (region, _) in mesh.cells.items():
        areas[region].append(_line(place, mesh.solids[number][:4]))
    held = set(mesh.rim)
    around = outline(mesh)
    inflated = None
    if displacement:
        moved = {n: place[n] + 1e3 * np.take(displacement[n], [2, 0]) for n in around}
        inflated = _line(moved, around)
    return {
        "areas": areas,
        "cords": {
            name: {
                "angle_deg": layer.angle_deg,
                "lines": [_line(place, nodes) for nodes in turns(case, mesh, name)],
            }
            for name, layer in case.case.rebar_layers.items()
        },
        "rim": [_line(place, n[:4]) for n in mesh.solids.values() if held.issuperset(n)],
        "outline": _line(place, around),
        "inflated": inflated,
    }


def parts_data(case: LoadedCase, named: Iterable[str]) -> dict[str, Any]:
    """The content of diagnosis_section.json: the section's parts under the names that they have
    in the map of parts ``named``; points as in `section_data`."""
    mesh = section_mesh(case)
    place = {n: np.array([z, r]) * 1e3 for n, (r, z) in mesh.nodes.items()}
    parts = rubber_parts(case, mesh, {name.split(",")[0] for name in named})
    cords: dict[str, list[list[float]]] = {}
    for layer in case.case.rebar_layers.values():
        lines = mesh.cords[layer.line].values()
        cords.setdefault(cord_part(layer.material), []).extend(_line(place, x) for x in lines)
    areas = {name: [_line(place, nodes) for nodes in solids] for name, solids in parts.items()}
    return {"format": 1, "case": case.case.name, "areas": areas, "cords": cords}


def loaded_data(tyre: LoadedTyre, case: LoadedCase) -> dict[str, Any]:
    """The content of modes_shapes.json for the tyre on the road, at its last load: points of the
    outer surface, deformed, and the modes' displacement there (ring, node, 3), in r, theta, z.
    Angles in rad from the patch's middle."""
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
) -> dict[str, Any]:
    """The content of footprint_patches.json: the contact pressure of every design and load on the
    lines of nodes (ring along, node across) in and round the patch."""
    patches = []
    for design, pressed in designs.items():
        for footprint in pressed.footprints:
            patch = patch_of(pressed, footprint, meshes[design])
            near = _grown(patch.touches)
            patches.append(
                {
                    "design": design,
                    "load_N": footprint.load_N,
                    "across_mm": _rounded(1e3 * patch.across[near], 3),
                    "along_mm": _rounded(1e3 * patch.along[near], 3),
                    "pressure_kPa": _rounded(1e-3 * patch.pressure[near], 3),
                }
            )
    return {"format": 1, "case": name, "patches": patches}


def _grown(touches: Array) -> tuple[slice, slice]:
    """Rows and columns of what touches and of the next beside it, which bear nothing: between them
    contours close."""
    found = [np.flatnonzero(touches.any(axis)) for axis in (1, 0)]
    rings, nodes = (slice(max(0, each[0] - 1), each[-1] + 2) for each in found)
    return rings, nodes


def _amplitude(mode: Mode, nodes: Array) -> dict[str, Any]:
    shape = mode.raw.shape
    assert isinstance(shape, HarmonicShape)
    row = {int(n): k for k, n in enumerate(shape.nodes)}
    A = shape.amplitude[[row[int(n)] for n in nodes]]
    if shape.n:  # r and z as real, theta as imaginary as they can be
        A = A * np.exp(-0.5j * np.angle((A**2 * MIRROR).sum()))
    largest = np.argmax(abs(A.real))
    A = A * (np.sign(A.real.ravel()[largest]) or 1.0)
    return {"n": shape.n, "real": _scaled(A.real, A), "imaginary": _scaled(A.imag, A)}


def _name(mode: Mode) -> dict[str, Any]:
    label = mode.label
    return {"c": label.c, "m": label.m, "kind": label.kind, "frequency_Hz": mode.frequency_Hz}


def _scaled(values: Array, over: Array | None = None) -> Any:
    return _rounded(values / np.abs(values if over is None else over).max())


def _line(place: Mapping[int, Array], nodes: Iterable[int]) -> list[float]:
    return _rounded(np.concatenate([place[n] for n in nodes]), 3)


def _rounded(values: Any, digits: int = DIGITS) -> Any:
    return (np.round(np.asarray(values, float), digits) + 0.0).tolist()  # no minus zero
