"""Materials of the section of a new case: rubbers, cords, where they are, and how well known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..section.construction import BASE, CAP, TURN_UP, Compound, Construction, CordMaterial, Ply
from ..section.curve import length_along
from ..section.section import Section, SectionError

Keys = dict[str, Any]
RELAXATION_S = 0.1  # of the one Prony term: above 10 Hz its modulus is the instantaneous one
# estimated standard deviations over makers
COMPOUND_DENSITY_PERCENT, CORD_MODULUS_PERCENT, BELT_ANGLE_DEG = 2.0, 5.0, 2.0
WIRE_ANGLE_DEG = 90.0  # of bead wires; all angles are from the meridian
BELT_CORD = CordMaterial(172.2e9, 0.3, 5900.0)  # Bekakos et al. (2016), like the carcass
CARCASS_CORD = CordMaterial(9.87e9, 0.3, 1500.0, bears_compression=False)


@dataclass(frozen=True)
class ConstructionParts:
    """Parts of a case by its keys, in their units."""

    materials: Mapping[str, Keys]
    solids: list[Keys]
    layers: Mapping[str, Keys]
    variables: Mapping[str, Keys]  # paths that each sets, start and bounds
    uncertainties: Mapping[str, Keys] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)  # words next to a material
    # frequency of the rubber's modulus in the modes, None: the modulus of the static step
    modes_at_Hz: float | None = None


def one_rubber(section: Section, carcass_plies: int = 1) -> ConstructionParts:
    """A section of which only the lines are known, of the materials of Bekakos et al. (2016).

    Lines from the crown to the bead become the carcass (each of ``carcass_plies`` layers), lines
    that end at the shoulder the belts. Unlike theirs, the carcass goes slack where compressed, as
    textile cords do. Raises SectionError where no line can be the carcass.
    """
    there = ~np.isnan(section.points).any(-1)
    inside = list(zip(section.names, there, strict=True))[1:-1]
    plies = [line for line, present in inside if present.all() for _ in range(carcass_plies)]
    belts = [line for line, present in inside if present[0] and not present.all()]
    if not plies:
        raise SectionError(
            "no line between the surfaces runs from the crown to the bead: the carcass needs one"
        )
    cord, steel = Ply("carcass_cord", 4.208352e-7, 1.0e-3, 0.0), ("belt_cord", 2.118683e-7, 1.16e-3)
    layers = {name: _layer(line, cord) for name, line in _numbered("carcass", plies).items()}
    variables = {"A_carcass": _areas(list(layers), cord.area, 1e-8)}
    angles = {f"belt_{i}": 110.0 if i % 2 == 0 else 70.0 for i in range(1, len(belts) + 1)}
    for line, (name, angle) in zip(belts, angles.items(), strict=True):
        layers[name] = _layer(line, Ply(*steel, angle))
    if belts:
        variables = {"A_belt": _areas(list(angles), steel[1], 1e-7), **variables}
    variables["C10"] = _stiffness("rubber", 1e6)
    rubber = {"C10_Pa": 1e6, "C01_Pa": 0.0, "D1_per_Pa": 5.085e-8}
    materials = {
        "rubber": {"kind": "rubber", **rubber, "prony": _prony(0.3), "density_kg_per_m3": 1100.0},
        **({"belt_cord": _cord(BELT_CORD)} if belts else {}),
        "carcass_cord": _cord(CARCASS_CORD),
    }
    return ConstructionParts(materials, [{"material": "rubber"}], layers, variables)


def constructed(made: Construction, section: Section) -> ConstructionParts:
    """Materials of a section with the lines and regions that `from_size` gives such a tyre."""
    regions = [name for name, _ in section.regions]
    belted = regions[: regions.index("upper_sidewall")]
    last = made.lines[made.lines.index(BASE) - 1]  # the outermost cord line: cap ply or belt
    beads = ["filler", "bead"]
    solids: list[Keys] = [
        {"material": "inner_liner", "between": ["inner", "ply"]},
        {"material": "belt_skim", "regions": belted, "between": ["ply", last]},
        {"material": "under_tread", "regions": belted, "between": [last, BASE]},
        {"material": "tread", "regions": belted, "between": [BASE, "outer"]},
        {
            "material": "sidewall",
            "regions": ["upper_sidewall", "lower_sidewall"],
            "between": ["ply", "outer"],
        },
        {"material": "bead_filler", "regions": beads, "between": ["ply", TURN_UP]},
        {"material": "rim_strip", "regions": beads, "between": [TURN_UP, "outer"]},
    ]
    carcass = _numbered("carcass", [ply.cord for ply in made.carcass])
    layers = {name: _layer("ply", ply) for name, ply in zip(carcass, made.carcass, strict=True)}
    up = [*(["lower_sidewall"] if made.high else []), *beads]
    turned = {
        f"{name}_turn_up": {**layer, "line": TURN_UP, "regions": up}
        for name, layer in layers.items()
    }
    belts = {}
    for i, belt in enumerate(made.belts, start=1):
        line = made.lines[1 + i]  # after inner and ply; the first belt's is TURN_UP
        own = {"regions": belted} if line == TURN_UP else {}
        belts[f"belt_{i}"] = {**_layer(line, belt.ply), **own}
    layers |= {**turned, **belts}
    if made.cap:
        layers["cap_ply"] = _layer(CAP, made.cap)
    layers["bead_wire"] = _bead_wire(made, section)
    compounds = made.compounds
    return ConstructionParts(
        materials={
            **{name: _rubber(compound) for name, compound in compounds.items()},
            **{name: _cord(cord) for name, cord in made.cords.items()},
        },
        solids=solids,
        layers=layers,
        variables={
            "A_belt": _areas(list(belts), made.belts[0].ply.area, made.belts[0].ply.area / 10),
            "A_carcass": _areas(
                [*carcass, *turned], made.carcass[0].area, made.carcass[0].area / 10
            ),
            **{
                f"C10_{name}": _stiffness(name, _three(compounds[name].C10_Pa))
                for name in ("sidewall", "tread")
            },
        },
        uncertainties=_uncertainties(made, belts),
        notes={name: f"{each.hardness:g} Shore A" for name, each in compounds.items()},
        modes_at_Hz=60.0,
    )


def _uncertainties(made: Construction, belts: Mapping[str, Keys]) -> dict[str, Keys]:
    """Standard deviations over makers of the usual values; by ``signs`` all belts turn towards the
    circumference at once."""
    stiff = {
        f"{name}_C10": {"sets": [f"materials.{name}.C10_Pa"], "percent": round(own.spread_percent)}
        for name, own in made.compounds.items()
    }
    densities = [f"materials.{name}.density_kg_per_m3" for name in made.compounds]
    cords = {
        f"{name}_modulus": {
            "sets": [f"materials.{name}.youngs_modulus_Pa"],
            "percent": CORD_MODULUS_PERCENT,
        }
        for name in made.cords
    }
    angles = [f"rebar_layers.{name}.angle_deg" for name in belts]
    signs = [1 if belt["angle_deg"] < 90 else -1 for belt in belts.values()]
    return {
        **stiff,
        "rubber_density": {"sets": densities, "percent": COMPOUND_DENSITY_PERCENT},
        **cords,
        "belt_angles": {"sets": angles, "absolute": BELT_ANGLE_DEG, "signs": signs},
        "pressure": {"sets": ["pressure_kPa"], "absolute": 1.0},
    }


def _bead_wire(made: Construction, section: Section) -> Keys:
    """Wires round the bead, as close on the held carcass as all of them are on its length."""
    held = section.points[section.names.index("ply"), section.rigid]
    length = float(length_along(held)[-1])
    wires = Ply("steel_cord", made.wire, _three(length / made.wires), WIRE_ANGLE_DEG)
    return {**_layer("ply", wires), "regions": ["bead"]}


def _rubber(compound: Compound) -> Keys:
    """Entry of ``materials`` for a compound, Pa and kg/m3."""
    return {
        "kind": "rubber",
        "C10_Pa": _three(compound.C10_Pa),
        "C01_Pa": 0.0,
        "D1_per_Pa": _three(compound.D1_per_Pa),
        "prony": _prony(compound.relaxed),
        "density_kg_per_m3": compound.density,
    }


def _prony(g: float) -> list[Keys]:
    """One term by which a share g of the shear modulus relaxes, none of the bulk modulus."""
    return [{"g": g, "k": 0.0, "tau_s": RELAXATION_S}]


def _cord(cord: CordMaterial) -> Keys:
    """Entry of ``materials`` for a cord, Pa and kg/m3."""
    keys: Keys = {
        "kind": "cord",
        "youngs_modulus_Pa": cord.youngs_modulus,
        "poissons_ratio": cord.poissons_ratio,
        "density_kg_per_m3": cord.density,
    }
    return keys if cord.bears_compression else {**keys, "bears_compression": False}


def _layer(line: str, ply: Ply) -> Keys:
    """Entry of ``rebar_layers`` for a ply on a line of the section."""
    return {
        "line": line,
        "material": ply.cord,
        "area_m2": ply.area,
        "spacing_m": ply.spacing,
        "angle_deg": ply.angle,
    }


def _areas(layers: list[str], start: float, lower: float) -> Keys:
    """Variable that sets the cord areas of layers; start and bounds in m2."""
    return {
        "sets": [f"rebar_layers.{name}.area_m2" for name in layers],
        "start": start,
        "lower": lower,
        "upper": 1e-5,
    }


def _stiffness(rubber: str, start: float) -> Keys:
    """Variable that sets C10, Pa, of a rubber."""
    sets = [f"materials.{rubber}.C10_Pa"]
    return {"sets": sets, "start": start, "lower": start / 10, "upper": 10 * start}


def _numbered(word: str, lines: list[str]) -> dict[str, str]:
    """Layers by name, each with its line."""
    if len(lines) == 1:
        return {word: lines[0]}
    return {f"{word}_{i}": line for i, line in enumerate(lines, start=1)}


def _three(value: float) -> float:
    """Round to three significant digits."""
    return float(f"{value:.3g}")
