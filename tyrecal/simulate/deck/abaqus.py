"""The tyre as plain data for deck templates: numbers, names and element tables, nothing else."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ...tyre.case import Case
from ...tyre.case.analysis import Analysis
from ...tyre.resolve import Tyre
from ...tyre.section.mesh import SectionMesh
from .nonuniform import attached, turning
from .wheel_and_gas import frequency_rubber, gas_material, wheel

REFERENCE_NODE, ROAD_NODE = 900001, 900002
WELL_ELEMENT = 900001
CLEARANCE = 0.05  # m from the section, not inflated, to the road


def context(tyre: Tyre) -> dict[str, Any]:
    """Names for the templates; the guide to own templates lists them."""
    c, mesh = tyre.case, tyre.mesh
    materials = [
        {"name": deck_name(name), **_material(material, c.analysis)}
        for name, material in c.materials.items()
    ]
    gas = gas_material(c)
    layers: dict[tuple[Any, ...], dict[str, Any]] = {}
    sets: list[tuple[str, str, tuple[str, ...]]] = []
    for name, layer in c.rebar_layers.items():
        angular = layer.geometry == "angular"
        key = layer.line, angular, tuple(layer.regions or ())
        if key not in layers:  # layers of one kind and place share their surface elements
            same = sum(line == layer.line for _, line, _ in sets)
            own = deck_name(layer.line) + (f"_{same + 1}" if same else "")
            sets.append((own, layer.line, key[2]))
            layers[key] = {"set": own, "angular": angular, "cords": []}
        layers[key]["cords"].append(
            {
                "name": deck_name(name),
                "area": layer.area_m2,
                "spacing": layer.spacing_deg if angular else layer.spacing_m,
                "material": deck_name(layer.material),
                "angle": layer.angle_deg,
            }
        )
    rows = tuple(c.mesh.levels[c.mesh.level].rows)
    claims = solid_claims(c)
    point = c.rim.reference_point_m
    tables = _tables(
        mesh, tyre.section.names, rows, claims, tuple(sets), (point.r, point.z), c.mesh.element
    )
    hourglass = None if mesh.quadratic else {"stiffness": c.mesh.hourglass_stiffness_Pa}
    return {
        "name": c.name,
        "mesh": tables,
        "well": _well(mesh) if c.rim.moves or gas else None,
        "wheel": wheel(c.rim) if c.rim.moves else None,
        "gas": gas,
        "attached": attached(c, mesh),
        "turning": turning(c, [block["name"] for block in (*tables["solids"], *tables["lines"])]),
        "solids": [
            {"set": block["name"], "material": deck_name(c.solids[block["entry"]].material)}
            for block in tables["solids"]
        ],
        "layers": list(layers.values()),
        "materials": materials,
        "hourglass": hourglass,
        "pressure": c.pressure_kPa * 1e3,
        "long_term": c.analysis.static_moduli == "long_term",
        "increments": c.analysis.static_increments,
        "vibration_frequency": c.analysis.vibration_frequency_Hz,
        "sectors": c.analysis.sectors,
        "road": {
            "reference_node": ROAD_NODE,
            "height": tables["radius"] + CLEARANCE,
            "angles": c.road.element_angles_deg + c.road.element_angles_deg[::-1],
            "stiffness": c.road.stiffness_Pa_per_m,
            "friction": c.road.friction,
            "elastic_slip": c.road.elastic_slip_m,
        },
    }


def deck_name(text: str) -> str:
    """A name of the case as decks have it."""
    return text.upper().replace("-", "_").replace(" ", "_")


def _well(mesh: SectionMesh) -> dict[str, Any]:
    """A surface element over the rim's well, which closes the cavity: its left side is inside."""
    right, left = mesh.solids[mesh.inner[-1]][3], mesh.solids[mesh.inner[0]][0]
    return {"element": WELL_ELEMENT, "nodes": (right, left)}


def _material(material: Any, analysis: Analysis) -> dict[str, Any]:
    if material.kind == "cord":
        return {
            "kind": "cord",
            "youngs_modulus": material.youngs_modulus_Pa,
            "poissons_ratio": material.poissons_ratio,
            "density": material.density_kg_per_m3,
        }
    if material.frequency_exponent:
        return frequency_rubber(material, analysis)
    return {
        "kind": "rubber",
        "C10": material.C10_Pa,
        "C01": material.C01_Pa,
        "D1": material.D1_per_Pa,
        "moduli": material.moduli.upper().replace("_", " "),
        "storage": [],
        "prony": [{"g": t.g, "k": t.k, "tau": t.tau_s} for t in material.prony],
        "density": material.density_kg_per_m3,
    }


Claims = tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]


def solid_claims(case: Case) -> Claims:
    """Per entry of ``solids``: the regions and the pair of lines it names, empty where none."""
    return tuple((tuple(s.regions or ()), tuple(s.between or ())) for s in case.solids)


def claimed(
    claims: Claims, lines: tuple[str, ...], rows: tuple[int, ...], region: str, row: int
) -> int | None:
    """The last entry of ``solids`` that claims an element of ``region`` in element row ``row``."""
    edges = [sum(rows[:k]) for k in range(len(rows) + 1)]
    for i, (wanted, between) in reversed(list(enumerate(claims))):
        low, high = sorted(edges[lines.index(n)] for n in between) if between else (0, edges[-1])
        if low <= row < high and (not wanted or region in wanted):
            return i
    return None


def _surface(
    mesh: SectionMesh, line: str, regions: tuple[str, ...], offset: int
) -> list[tuple[int, ...]]:
    """Surface elements on a line, in some regions or all; ``offset`` of their numbers."""
    return [
        (offset + n, *nodes)
        for n, nodes in mesh.cords[line].items()
        if not regions or mesh.region_of(n) in regions
    ]


@lru_cache(maxsize=8)
def _tables(
    mesh: SectionMesh,
    lines: tuple[str, ...],
    rows: tuple[int, ...],
    claims: Claims,
    sets: tuple[tuple[str, str, tuple[str, ...]], ...],
    reference: tuple[float, float],
    element: str,
) -> dict[str, Any]:
    """Node and element tables; elements go to the last entry of ``solids`` that claims them.

    sets: of surface elements, each with its line and the regions it is in (none: all).
    """
    blocks: dict[int, list[tuple[int, ...]]] = {}
    regions: dict[str, list[int]] = {}
    for number, (region, row) in mesh.cells.items():
        regions.setdefault(region, []).append(number)
        entry = claimed(claims, lines, rows, region, row)
        if entry is not None:
            blocks.setdefault(entry, []).append((number, *mesh.solids[number]))
    return {
        "nodes": [(n, r, z) for n, (r, z) in mesh.nodes.items()],
        "solid_type": element,
        "cord_type": "SFMGAX2" if mesh.quadratic else "SFMGAX1",
        "solids": [
            {"name": f"SOLID_{i + 1}", "entry": i, "elements": b} for i, b in sorted(blocks.items())
        ],
        "lines": [
            {"name": name, "elements": _surface(mesh, line, regions, 100_000 * k)}
            for line in mesh.cords
            for k, (name, regions) in enumerate((s[0], s[2]) for s in sets if s[1] == line)
        ],
        "regions": [{"name": f"REGION_{deck_name(k)}", "members": v} for k, v in regions.items()],
        "inner": mesh.inner,
        "outer": mesh.outer,
        "rim": mesh.rim,
        "crown": mesh.crown_outer,
        "reference_node": REFERENCE_NODE,
        "radius": max(r for r, _ in mesh.nodes.values()),
        "reference_r": reference[0],
        "reference_z": reference[1],
    }
