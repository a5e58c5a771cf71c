"""Names for CalculiX's deck templates: one sector, plies as thin anisotropic solids."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ...tyre.case import Case
from ...tyre.case.parts import RebarLayer
from ...tyre.resolve import Tyre
from ...tyre.section.section import SectionError
from ...tyre.templates import TemplateFailed, TemplateNames
from .abaqus import claimed, deck_name, solid_claims
from .sector import INNER_FACE, Division, PlyStrip, Sector, build_sector

ELEMENT_TYPES = ("C3D20R", "C3D20", "C3D8")
PLY_THICKNESS_M = 2e-4  # of a ply's solid: chosen, E A / (s t) makes up for it
# CalculiX's sectors in each of the case's: with C3D20R of 6 degrees, 40 mm at the crown, it found
# no inflated state for rubber of half the C10 of Bekakos et al. (2016).
PARTS = 3
FILLER = 1e-6  # of a ply's stiffness, isotropic, so that its tensor is not singular
# CalculiX's order of components: r r, theta theta, z z, r theta, r z, theta z
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def calculix_context(tyre: Tyre) -> TemplateNames:
    """Names for the templates, the same for every nodal diameter. Raises TemplateFailed."""
    c = tyre.case
    if c.analysis.vibration_frequency_Hz is not None:
        raise TemplateFailed(
            "analysis.vibration_frequency_Hz must be null: CalculiX cannot evaluate hyperelastic"
            " rubber at a frequency (--set analysis.vibration_frequency_Hz=null)"
        )
    element = c.solver.options.get("element", ELEMENT_TYPES[0])
    thickness = c.solver.options.get("ply_thickness_m", PLY_THICKNESS_M)
    if element not in ELEMENT_TYPES:
        raise TemplateFailed(
            f"solver.options.element is '{element}', must be C3D20R, C3D20 or C3D8"
        )
    if not isinstance(thickness, float) or not 0 < thickness < 1:
        raise TemplateFailed(
            f"solver.options.ply_thickness_m is '{thickness}', must be a thickness in m"
        )
    surfaces = tyre.section.names[0], tyre.section.names[-1]
    for name, layer in c.rebar_layers.items():
        if layer.line in surfaces:
            raise TemplateFailed(
                f"rebar_layers.{name}.line must be inside the section: for CalculiX a ply is a thin"
                " solid, half of it to either side of its line"
            )
    level = c.mesh.levels[c.mesh.level]
    sectors = PARTS * c.analysis.sectors
    try:
        sector = build_sector(
            tyre.gauged,
            Division(
                tuple(level.elements[name] for name, _ in tyre.section.regions),
                tuple(level.rows),
                tuple(level.grading) if level.grading else None,
            ),
            element != "C3D8",
            sectors,
            thickness,
            c.rim.holds_whole_bead,
        )
    except SectionError as error:
        raise TemplateFailed(f"plies of {thickness} m do not fit: {error}") from None
    # Without gaps from 1: CalculiX reserves memory up to the largest number.
    numbers = {cell: k for k, cell in enumerate(sector.bricks, start=1)}
    return {
        "name": c.name,
        "element": element,
        "sectors": sectors,
        "sector": sector,
        "nodes": sector.nodes,
        "node_sets": [("SECTION", sector.section), ("BEHIND", sector.behind), ("RIM", sector.rim)]
        + ([("BETWEEN", [node for node, _ in sector.between])] if sector.between else []),
        "between": sector.between,  # (node halfway between the faces, node in front of it)
        # cosine and sine of the turn, -pi / sectors about z, from a sector's face to its middle
        "half_turn": (float(np.cos(np.pi / sectors)), -float(np.sin(np.pi / sectors))),
        "inner_face": INNER_FACE,
        "solids": _solids(tyre, sector, numbers),
        "rubbers": _rubbers(c),
        "plies": _plies(c, sector),
        "cavity": [numbers[cell] for cell in sector.inner],
        "pressure": c.pressure_kPa * 1e3,
    }


def _solids(tyre: Tyre, sector: Sector, numbers: dict[int, int]) -> list[TemplateNames]:
    """Bricks by the last entry of ``solids`` that has their region and row: name of the set, of the
    material, and rows of element and node numbers."""
    case = tyre.case
    claims, rows = solid_claims(case), tuple(case.mesh.levels[case.mesh.level].rows)
    blocks: dict[int, list[tuple[int, ...]]] = {}
    for cell, nodes in sector.bricks.items():
        region, row = sector.regions[cell], sector.rows[cell]
        entry = claimed(claims, tyre.section.names, rows, region, row)
        if entry is not None:
            blocks.setdefault(entry, []).append((numbers[cell], *nodes))
    return [
        {
            "set": f"SOLID_{entry + 1}",
            "material": deck_name(case.solids[entry].material),
            "elements": elements,
        }
        for entry, elements in sorted(blocks.items())
    ]


def _rubbers(case: Case) -> list[TemplateNames]:
    """Constants, Pa and 1/Pa, of the static state, relaxed (times 1 - sum g) or instantaneous:
    CalculiX has no viscoelasticity for hyperelastic rubber."""
    rubbers = []
    for name, m in case.materials.items():
        if m.kind != "rubber":
            continue
        shear, bulk = 1 - sum(t.g for t in m.prony), 1 - sum(t.k for t in m.prony)
        if m.moduli == case.analysis.static_moduli:
            shear = bulk = 1.0
        elif m.moduli == "long_term":
            shear, bulk = 1 / shear, 1 / bulk
        rubbers.append(
            {
                "name": deck_name(name),
                "C10": m.C10_Pa * shear,
                "C01": m.C01_Pa * shear,
                "D1": m.D1_per_Pa / bulk,
                "density": m.density_kg_per_m3,
            }
        )
    return rubbers


def _plies(case: Case, sector: Sector) -> list[TemplateNames]:
    """One material a layer and strip, in bricks on top of the rubber's: stiffness E A / (s t) along
    the cords, their mass; s the cords' spacing across them, t the strip's own thickness; angles
    from the meridian, which runs from -z to +z, towards theta."""
    plies, number = [], len(sector.bricks)
    for name, layer in case.rebar_layers.items():
        cord: Any = case.materials[layer.material]
        angle = np.radians(layer.angle_deg)
        for k, strip in enumerate(sector.strips[layer.line], start=1):
            if layer.regions and sector.regions[strip.element] not in layer.regions:
                continue
            number += 1
            spacing = layer.spacing_m or np.radians(layer.spacing_deg or 0.0) * strip.radius
            share = layer.area_m2 / (spacing * strip.thickness)
            r, z = strip.along
            along = np.array([np.cos(angle) * r, np.sin(angle), np.cos(angle) * z])
            plies.append(
                {
                    "name": f"{deck_name(name)}_{k}",
                    "elements": [(number, *sector.bricks[strip.element])],
                    "stiffness": _tensor(cord.youngs_modulus_Pa * share, along),
                    "density": cord.density_kg_per_m3 * share,
                    "taut": None if cord.bears_compression else _taut(sector, strip, name, layer),
                }
            )
    return plies


def _taut(sector: Sector, strip: PlyStrip, name: str, layer: RebarLayer) -> str:
    """JSON of a ply whose cords bear no compression, as the solver's adapter reads it to refuse a
    state that compresses them. ``ends``: the two nodes at each end of the strip."""
    a, b, c, d = sector.bricks[strip.element][:4]
    return json.dumps(
        {
            "layer": name,
            "region": sector.regions[strip.element],
            "material": layer.material,
            "angle_deg": layer.angle_deg,
            "ends": [[a, b], [d, c]],
        }
    )


def _tensor(stiffness: float, along: np.ndarray) -> list[float]:
    """The 21 components of ``stiffness`` (Pa) times f f f f, f the unit vector ``along`` in r,
    theta, z, with the filler: D1111, D1122, D2222, D1133, ... as CalculiX reads them."""
    components = []
    for column, (k, m) in enumerate(PAIRS):
        for i, j in PAIRS[: column + 1]:
            ffff = along[i] * along[j] * along[k] * along[m]
            shear = ((i == k) * (j == m) + (i == m) * (j == k)) / 2
            components.append(float(stiffness * (ffff + FILLER * shear)))
    return components
