"""The tyre as plain data for deck templates: numbers, names and element tables, nothing else.

So is what moves beside it, rim and gas, and what sits at one place of its tread.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ...tyre.case import Case
from ...tyre.case.parts import Rim, Rubber
from ...tyre.case.schema import Analysis
from ...tyre.own_deck.solver_mesh import REFERENCE_NODE
from ...tyre.resolve import Tyre
from ...tyre.section.mesh import SectionMesh
from ...tyre.templates import TemplateNames

FIRST_WHEEL_ELEMENT = 999_000_001  # beyond all that a revolve makes
# of a free wheel's modes: above its rigid motions; the shift in Hz squared, as *FREQUENCY has it
MIN_MODE_HZ, SHIFT = 1.0, -100.0
GAS = "CAVITY_GAS"
ATMOSPHERE = 101_325.0  # Pa
GASES = {  # specific gas constant (J/kg/K) and ratio of specific heats at 20 C
    "air": (287.05, 1.400),
    "helium": (2077.1, 1.667),
    "sulphur_hexafluoride": (56.93, 1.094),
}
TABLE_HZ = np.geomspace(1.0, 1000.0, 13)  # of tables of moduli over frequency
FIRST_ATTACHED_ELEMENT = 999_100_001  # beyond all that a revolve makes
AXES = {"radial": 1, "lateral": 2, "tangential": 3}  # of the revolved tyre in the plane Theta = 0
ROAD_NODE = 900002
WELL_ELEMENT = 900001
CLEARANCE = 0.05  # m from the section, not inflated, to the road


def context(tyre: Tyre) -> TemplateNames:
    """Names for the templates; the guide to own templates lists them."""
    c, mesh = tyre.case, tyre.mesh
    gas = gas_material(c)
    names = tyre.written.kind.template_names(tyre) or _section(tyre)
    return {
        **names,
        "name": c.name,
        "well": _well(mesh) if c.rim.moves or gas else None,
        "wheel": wheel(c.rim) if c.rim.moves else None,
        "gas": gas,
        "attached": attached(c, mesh),
        "turning": turning(c, names["sets"]),
        "pressure": c.pressure_kPa * 1e3,
        "long_term": c.analysis.static_moduli == "long_term",
        "increments": c.analysis.static_increments,
        "vibration_frequency": c.analysis.vibration_frequency_Hz,
        "sectors": c.analysis.sectors,
        "road": {
            "reference_node": ROAD_NODE,
            "height": names["mesh"]["radius"] + CLEARANCE,
            "angles": c.road.element_angles_deg + c.road.element_angles_deg[::-1],
            "stiffness": c.road.stiffness_Pa_per_m,
            "friction": c.road.friction,
            "elastic_slip": c.road.elastic_slip_m,
            "wheel": wheel(c.rim)["mass"] if c.road.wheel == "free_along_load" else None,
        },
    }


def _section(tyre: Tyre) -> TemplateNames:
    """Mesh, rubbers, layers and materials of a section of stations."""
    c, mesh = tyre.case, tyre.mesh
    materials = [
        {"name": deck_name(name), **_material(material, c.analysis)}
        for name, material in c.materials.items()
    ]
    layers: dict[tuple[Any, ...], TemplateNames] = {}
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
        "mesh": tables,
        "sets": [block["name"] for block in (*tables["solids"], *tables["lines"])],
        "solids": [
            {"set": block["name"], "material": deck_name(c.solids[block["entry"]].material)}
            for block in tables["solids"]
        ],
        "layers": list(layers.values()),
        "materials": materials,
        "hourglass": hourglass,
    }


def deck_name(text: str) -> str:
    """A name of the case as decks have it."""
    return text.upper().replace("-", "_").replace(" ", "_")


def _well(mesh: SectionMesh) -> TemplateNames:
    """A surface element over the rim's well, which closes the cavity: its left side is inside."""
    left, right = mesh.inner_ends
    return {"element": WELL_ELEMENT, "nodes": (right, left)}


def _material(material: Any, analysis: Analysis) -> TemplateNames:
    """A material's numbers for a template, in SI."""
    if material.kind == "cord":
        return {
            "kind": "cord",
            "youngs_modulus": material.youngs_modulus_Pa,
            "poissons_ratio": material.poissons_ratio,
            "density": material.density_kg_per_m3,
            "bears_compression": material.bears_compression,
        }
    if material.frequency_exponent or isinstance(material.loss_factor, list):
        return frequency_rubber(material, analysis)
    return {
        "kind": "rubber",
        "C10": material.C10_Pa,
        "C01": material.C01_Pa,
        "D1": material.D1_per_Pa,
        "moduli": material.moduli.upper().replace("_", " "),
        "storage": [],
        "prony": [{"g": t.g, "k": t.k, "tau": t.tau_s} for t in material.prony],
        "damping": material.loss_factor,
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


@lru_cache(maxsize=32)
def _tables(
    mesh: SectionMesh,
    lines: tuple[str, ...],
    rows: tuple[int, ...],
    claims: Claims,
    sets: tuple[tuple[str, str, tuple[str, ...]], ...],
    reference: tuple[float, float],
    element: str,
) -> TemplateNames:
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


def aside(tyre: Tyre) -> TemplateNames:
    """Requests that no deck of keywords holds: which surfaces hold the gas, whose frequency
    counts."""
    request = tyre.written.kind.request()
    if "frequency_modulus" in tyre.needs:
        request["own_frequency"] = True
    if "cavity" in tyre.needs:
        request["cavity"] = {"material": GAS, "surfaces": ["CAVITY", "WELL"]}
    if tyre.case.splice.share:
        request["sector"] = {"job": "splice", "width_deg": tyre.case.splice.width_deg}
    return request


def wheel(rim: Rim) -> TemplateNames:
    """The rim's point elements, which degrees of freedom stay held, and how to look for modes.

    The axle is the second axis of the revolved tyre.
    """
    s = rim.spindle
    compliances = {
        (2,): ("LATERAL", s.lateral_m_per_N),
        (1, 3): ("RADIAL", s.radial_m_per_N),
        (5,): ("TORSIONAL", s.torsional_rad_per_N_m),
        (4, 6): ("TILT", s.tilt_rad_per_N_m),
    }
    springs = [
        {"name": f"SPINDLE_{name}_{dof}", "dof": dof, "stiffness": 1 / compliance}
        for dofs, (name, compliance) in compliances.items()
        for dof in dofs
        if compliance
    ]
    numbered = [
        {**spring, "element": FIRST_WHEEL_ELEMENT + 2 + i} for i, spring in enumerate(springs)
    ]
    moving = {spring["dof"] for spring in springs}
    return {
        "mass": {"element": FIRST_WHEEL_ELEMENT, "value": rim.mass_kg},
        "inertia": {
            "element": FIRST_WHEEL_ELEMENT + 1,
            "polar": rim.polar_inertia_kg_m2,
            "diametral": rim.diametral_inertia_kg_m2,
        },
        "springs": numbered,
        "held": [] if rim.free else [dof for dof in range(1, 7) if dof not in moving],
        "search": {"lowest": MIN_MODE_HZ, "shift": SHIFT} if rim.free else None,
    }


def gas_material(case: Case) -> TemplateNames | None:
    """The share of an ideal gas: density p / (R T), adiabatic bulk modulus gamma p; p absolute."""
    cavity = case.cavity
    if not cavity.share:
        return None
    R, gamma = GASES[cavity.gas]
    p = case.pressure_kPa * 1e3 + ATMOSPHERE
    return {
        "name": GAS,
        "density": cavity.share * p / (R * (cavity.temperature_C + 273.15)),
        "bulk_modulus": cavity.share * gamma * p,
    }


def frequency_rubber(m: Rubber, analysis: Analysis) -> TemplateNames:
    """Constants of the inflated state as long-term ones, and the shear modulus over frequency:
    G(f)/G0 = (f / f_ref)^beta times the Prony series' at the vibration frequency; with the losses
    of a table of loss factors."""
    shear, bulk = 1 - sum(t.g for t in m.prony), 1 - sum(t.k for t in m.prony)
    static = (1.0, 1.0)
    if m.moduli != analysis.static_moduli:
        static = (1 / shear, 1 / bulk) if m.moduli == "long_term" else (shear, bulk)
    level = 1.0
    if analysis.vibration_frequency_Hz is not None:
        squares = [(2 * np.pi * analysis.vibration_frequency_Hz * t.tau_s) ** 2 for t in m.prony]
        dynamic = shear + sum(t.g * x / (1 + x) for t, x in zip(m.prony, squares, strict=True))
        level = dynamic / (shear if analysis.static_moduli == "long_term" else 1.0)
    hertz = TABLE_HZ if m.frequency_exponent else np.zeros(0)
    loss, damping = np.zeros(len(hertz)), m.loss_factor
    if isinstance(damping, list):
        known, factors = np.array(damping).T
        hertz = np.unique([*hertz, *known])
        loss, damping = np.interp(np.log(hertz), np.log(known), factors), None
    ratios = [level * (f / m.reference_frequency_Hz) ** m.frequency_exponent for f in hertz]
    return {
        "kind": "rubber",
        "C10": m.C10_Pa * static[0],
        "C01": m.C01_Pa * static[0],
        "D1": m.D1_per_Pa / static[1],
        "moduli": "LONG TERM",
        "prony": [],
        # as *VISCOELASTIC has them: 1 - G'/G, G''/G and K''/K, G and K long-term; K' = K
        "storage": [
            {
                "frequency": float(f),
                "shear": 1 - float(ratio),
                "shear_loss": float(ratio * factor),
                "bulk_loss": float(factor),
            }
            for f, ratio, factor in zip(hertz, ratios, loss, strict=True)
        ],
        "damping": damping,
        "density": m.density_kg_per_m3,
    }


def attached(c: Case, mesh: SectionMesh) -> list[TemplateNames]:
    """Mass and spring elements on nodes of the tread: name, keyword, elements, lines of data."""
    groups: list[tuple[str, str, list[int], tuple[int, float] | None]] = []
    number = FIRST_ATTACHED_ELEMENT
    if c.point_mass.mass_kg:
        groups.append(("POINT_MASS", "MASS", _nodes(mesh, c.point_mass.z_m, 0.0), None))
    for direction, stiffness in c.road_spring.stiffnesses.items():
        nodes = _nodes(mesh, 0.0, c.road_spring.width_m)
        groups.append((f"ROAD_{direction.upper()}", "SPRING", nodes, (AXES[direction], stiffness)))
    result = []
    for name, keyword, nodes, spring in groups:
        result.append(
            {
                "name": name,
                "keyword": keyword,
                "type": "SPRING1" if spring else "MASS",
                "elements": [(number + i, node) for i, node in enumerate(nodes)],
                "dof": spring[0] if spring else None,
                "value": spring[1] / len(nodes) if spring else c.point_mass.mass_kg,
            }
        )
        number += len(nodes)
    return result


def turning(c: Case, sets: list[str]) -> TemplateNames | None:
    """Speed of a tyre that turns, rad/s, and the element sets that hold its mass."""
    if not c.spin_rad_per_s:
        return None
    return {"omega": c.spin_rad_per_s, "omega2": c.spin_rad_per_s**2, "sets": sets}


def _nodes(mesh: SectionMesh, z: float, width: float) -> list[int]:
    """Nodes of the tread within half a width of a height; the nearest one at least."""
    away = {node: abs(mesh.nodes[node][1] - z) for node in mesh.crown_outer}
    nearest = min(away, key=lambda node: (away[node], node))
    return [node for node in away if away[node] <= width / 2 or node == nearest]
