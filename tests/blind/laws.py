"""Effects as the makers of blind trials write them: laws of their own, not the catalogue's.

The parameter means what the catalogue's does and has its range; how it enters the tyre differs.
A diagnosis that was scored on its own laws would be an inverse crime.

`divided` has a region of the section in several parts, so that a law can vary along it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import exp, radians, sin, tanh

import numpy as np

from tyrecal.studies.blind.maker import EffectLaw
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.schema import Cord, RebarLayer, Rubber
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.effects.edit import (
    changed,
    unused,
    with_gauge,
    with_layers,
    with_part,
    with_rubbers,
)
from tyrecal.tyre.effects.edit import with_rubbers_at as rubbers_at
from tyrecal.tyre.effects.parts import (
    belt_edge,
    belt_lines,
    belts,
    carcass,
    carcass_line,
    crown,
    lower_sidewall,
    rim_edge,
    sidewall,
    stations,
)

Array = np.ndarray


def divided(loaded: LoadedCase, region: str, parts: int) -> tuple[LoadedCase, list[str]]:
    """The same tyre with ``region`` in so many regions, and their names; the mesh is the same
    where its elements can be shared out evenly."""
    section, c = loaded.section, loaded.case
    count = dict(section.regions)[region]
    names = [f"{region}_{i}" for i in range(1, parts + 1)]
    ends = np.linspace(0, count, parts + 1).round().astype(int)
    pieces = list(zip(names, np.diff(ends).tolist(), strict=True))
    regions: list[tuple[str, int]] = []
    for name, size in section.regions:
        regions += pieces if name == region else [(name, size)]
    levels = {}
    for key, level in c.mesh.levels.items():
        elements: dict[str, int] = {}
        for name, size in level.elements.items():
            if name == region:
                shares = np.diff(np.linspace(0, max(size, parts), parts + 1).round().astype(int))
                elements |= dict(zip(names, shares.tolist(), strict=True))
            else:
                elements[name] = size
        levels[key] = with_part(level, elements=elements)
    solids = [with_part(s, regions=_named(s.regions, region, names)) for s in c.solids]
    layers = {
        name: with_part(layer, regions=_named(layer.regions, region, names))
        for name, layer in c.rebar_layers.items()
    }
    gauges = [
        with_part(g, regions=_named(g.regions, region, names)) for g in c.section.gauges or []
    ]
    made = changed(
        loaded,
        mesh=with_part(c.mesh, levels=levels),
        solids=solids,
        rebar_layers=layers,
        section=with_part(c.section, gauges=gauges or None),
    )
    return replace(made, drawn=replace(section, regions=tuple(regions))), names


def moved(loaded: LoadedCase, move: Callable[[Array], Array]) -> LoadedCase:
    """The case with the section's points (line, station, 2) replaced by ``move`` of them."""
    section = loaded.section
    return replace(loaded, drawn=replace(section, points=move(section.points.copy())))


def _named(regions: list[str] | None, region: str, names: list[str]) -> list[str] | None:
    if not regions:
        return regions
    return [new for old in regions for new in (names if old == region else [old])]


Add = Callable[[LoadedCase, float], LoadedCase]


def other_laws(capabilities: frozenset[str]) -> dict[str, EffectLaw]:
    """Other laws for the effects that a solver with these capabilities can express."""
    known = catalogue()
    return {
        id: EffectLaw(known[id].low, known[id].high, add)
        for id, add in _OTHER.items()
        if known[id].within(capabilities)
    }


def stiffer(factor: float) -> Callable[[Rubber], Rubber]:
    """A rubber with all moduli times a factor."""
    return lambda m: with_part(
        m, C10_Pa=factor * m.C10_Pa, C01_Pa=factor * m.C01_Pa, D1_per_Pa=m.D1_per_Pa / factor
    )


def tread_density(case: LoadedCase, e: float) -> LoadedCase:
    """Voids take stiffness with the mass: density and moduli outside the outer belt times 1 + e."""
    lines = (belt_lines(case)[-1], case.section.names[-1])
    lighter = lambda m: with_part(m, density_kg_per_m3=(1 + e) * m.density_kg_per_m3)
    softer = stiffer(1 + e)
    return rubbers_at(case, crown(case), lines, "tread", lambda m: softer(lighter(m)))


def tread_wear(case: LoadedCase, e: float) -> LoadedCase:
    """Wear by a parabola over the tread, 4/3 e in the middle and 1/3 e at the belt's edge."""
    place = case.section.names.index(belt_lines(case)[-1])
    edge = belt_edge(case)

    def worn(points: Array) -> Array:
        s = np.arange(edge + 1) / edge
        share = e * (4 / 3 - s**2)
        tread = points[-1, : edge + 1] - points[place, : edge + 1]
        points[-1, : edge + 1] -= share[:, None] * tread
        beyond = slice(edge + 1, min(2 * edge, points.shape[1]))
        fade = np.clip(1 - (np.arange(points.shape[1]) - edge) / 12, 0, 1)[beyond, None]
        points[-1, beyond] -= fade * share[-1] * tread[-1]
        return points

    return moved(case, worn)


def bead_filler(case: LoadedCase, e: float) -> LoadedCase:
    """Stiffness that falls with the height: 1 + e times 1.6, 1.2, 0.8, 0.4 from the bead up."""
    names: list[str] = []
    for region in lower_sidewall(case):
        case, parts = divided(case, region, 4)
        names += parts
    lines = (case.section.names[0], case.section.names[-1])
    for share, name in zip((0.4, 0.8, 1.2, 1.6) * (len(names) // 4), names, strict=True):
        case = rubbers_at(case, [name], lines, f"filler_{name}", stiffer(1 + share * e))
    return case


def cap_ply(case: LoadedCase, e: float) -> LoadedCase:
    """Wound there and back at 5 degrees from the circumference, of aramid and nylon."""
    cord = Cord(kind="cord", youngs_modulus_Pa=10e9, poissons_ratio=0.3, density_kg_per_m3=1300.0)
    material = unused("cover", case.case.materials)
    case = changed(case, materials={**case.case.materials, material: cord})
    spacing = 1.5e-3
    layers = {
        f"cover_{i}": RebarLayer(
            line=belt_lines(case)[-1],
            material=material,
            angle_deg=90.0 + side * 5.0,
            area_m2=e / 2 * spacing / cord.youngs_modulus_Pa,
            spacing_m=spacing,
        )
        for i, side in ((1, -1), (2, 1))
    }
    return with_layers(case, layers)


def belt_angle(case: LoadedCase, e: float) -> LoadedCase:
    """As lift turns cords: their spacing goes with sin 2a, the area between two is kept."""
    layers = {}
    for name in belts(case):
        layer = case.case.rebar_layers[name]
        side = 1 if layer.angle_deg % 180 > 90 else -1
        new = layer.angle_deg + side * e
        ratio = sin(radians(2 * new)) / sin(radians(2 * layer.angle_deg))
        layers[name] = with_part(layer, angle_deg=new, spacing_m=(layer.spacing_m or 1.0) * ratio)
    return with_layers(case, layers)


def belt_width(case: LoadedCase, e: float) -> LoadedCase:
    """The stations between slide by the square of their place: mostly the belts' edges move."""
    add = catalogue()["belt_width"].add
    wide = add(case, e).section.points
    edge = belt_edge(case)
    narrow = case.section.points
    s = np.arange(narrow.shape[1]) / edge
    share = np.where(s < 1, np.clip(s, 0, 1) ** 2, 1.0)[None, :, None]
    return moved(case, lambda points: points + share * (wide - narrow))


def carcass_fanning(case: LoadedCase, e: float) -> LoadedCase:
    """A/s = A/s0 (R_bead/R)^e, a constant spacing in each of several parts of every region."""
    line = case.section.names.index(carcass_line(case))
    bead = float(case.section.points[line, rim_edge(case.section), 0])
    for region, _ in case.section.regions:
        if stations(case.section, region)[1] <= rim_edge(case.section):
            case, _ = divided(case, region, 4)
    layers = dict(case.case.rebar_layers)
    for name in carcass(case):
        layer = layers.pop(name)
        for region, _ in case.section.regions:
            first, last = stations(case.section, region)
            radius = float(case.section.points[line, first : last + 1, 0].mean())
            ratio = max(1.0, radius / bead) ** e
            layers[f"{name}_{region}"] = with_part(
                layer, regions=[region], spacing_m=(layer.spacing_m or 1.0) * ratio
            )
    return with_layers(_without(case, carcass(case)), layers)


def carcass_turn_up(case: LoadedCase, e: float) -> LoadedCase:
    """Its cords lie 2 degrees off the meridian, as a ply does that was turned by hand."""
    made = catalogue()["carcass_turn_up"].add(case, e)
    new = {
        name: with_part(layer, angle_deg=layer.angle_deg + 2.0)
        for name, layer in made.case.rebar_layers.items()
        if name not in case.case.rebar_layers
    }
    return with_layers(made, new)


def sidewall_gauge(case: LoadedCase, e: float) -> LoadedCase:
    """All of it outside the carcass, whose place in the section stays."""
    section = case.section
    line, place = carcass_line(case), section.names.index(carcass_line(case))
    middle = slice(*stations(section, sidewall(case)[0]))
    thick = lambda a, b: float(
        np.linalg.norm(section.points[a, middle] - section.points[b, middle], axis=-1).mean()
    )
    factor = 1 + e * thick(0, -1) / thick(place, -1)
    return with_gauge(case, (line, section.names[-1]), sidewall(case), factor)


def rim_width(case: LoadedCase, e: float) -> LoadedCase:
    """Beads moved apart, the sidewall following by a smooth step of its length."""
    section = case.section
    start, end = belt_edge(case), rim_edge(section)
    line = section.points[section.names.index(carcass_line(case))]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    s = np.clip((length - length[start]) / (length[end] - length[start]), 0, 1)
    share = s * s * (3 - 2 * s)

    def apart(points: Array) -> Array:
        points[..., 1] += share[None, :] * e / 2
        return points

    return moved(case, apart)


def pressure_offset(case: LoadedCase, e: float) -> LoadedCase:
    """A gauge whose scale is off: a factor, which is the offset at the case's own pressure."""
    nominal = case.file_data["pressure_kPa"]
    return changed(case, pressure_kPa=case.case.pressure_kPa * (1 + e / nominal))


def temperature(case: LoadedCase, e: float) -> LoadedCase:
    """Exponential in the rubber, -0.7 % per kelvin, and -0.15 % per kelvin in textile cords."""
    rubber, textile = exp(-0.007 * e), exp(-0.0015 * e)
    case = with_rubbers(
        case, lambda m: with_part(m, C10_Pa=rubber * m.C10_Pa, C01_Pa=rubber * m.C01_Pa)
    )
    materials = {
        name: with_part(m, youngs_modulus_Pa=textile * m.youngs_modulus_Pa)
        if isinstance(m, Cord) and m.youngs_modulus_Pa < 50e9
        else m
        for name, m in case.case.materials.items()
    }
    return changed(case, materials=materials)


def temperature_drift(case: LoadedCase, e: float) -> LoadedCase:
    """The tyre nears a temperature, as it does in time, by the law above."""
    nominal = case.file_data["pressure_kPa"]
    return temperature(case, 1.3 * e * tanh((case.case.pressure_kPa - nominal) / 130.0))


def dynamic_stiffening(case: LoadedCase, e: float) -> LoadedCase:
    """The catalogue's, but a tenth more stiffness per decade of frequency with it."""
    made = catalogue()["dynamic_stiffening"].add(case, e)
    return catalogue()["frequency_stiffening"].add(made, 0.04 * e)


def frequency_stiffening(case: LoadedCase, e: float) -> LoadedCase:
    """About 80 Hz instead of the case's frequency, and six per cent less steep."""
    case = with_rubbers(case, lambda m: with_part(m, reference_frequency_Hz=80.0))
    return catalogue()["frequency_stiffening"].add(case, 0.94 * e)


def cavity_air(case: LoadedCase, e: float) -> LoadedCase:
    """Another gas temperature with it: 45 C, lighter and no stiffer."""
    cavity = with_part(case.case.cavity, temperature_C=45.0)
    return catalogue()["cavity_air"].add(changed(case, cavity=cavity), e)


@dataclass(frozen=True)
class Spindle:
    """Two springs in series, hub and stand; the stand gives way in another direction, too, and
    the wheel is 3 kg heavier than stated."""

    id: str
    companion: str
    share: float

    def __call__(self, case: LoadedCase, e: float) -> LoadedCase:
        rim = case.case.rim
        scale = 1 + 3.0 / rim.mass_kg
        heavier = with_part(
            rim,
            mass_kg=rim.mass_kg * scale,
            polar_inertia_kg_m2=rim.polar_inertia_kg_m2 * scale,
            diametral_inertia_kg_m2=rim.diametral_inertia_kg_m2 * scale,
        )
        known = catalogue()
        other = known[self.companion]
        case = known[self.id].add(changed(case, rim=heavier), e)
        return other.add(case, self.share * other.high * e / known[self.id].high)


def point_mass(case: LoadedCase, e: float) -> LoadedCase:
    """Off the middle of the tread by 30 mm."""
    made = catalogue()["point_mass"].add(case, e)
    assert made.case.point_mass is not None
    return changed(made, point_mass=with_part(made.case.point_mass, z_m=0.03))


def road_contact(case: LoadedCase, e: float) -> LoadedCase:
    """A patch that slips at its edge: half as stiff along the road as down."""
    made = catalogue()["road_contact"].add(case, e)
    assert made.case.road_spring is not None
    spring = made.case.road_spring
    along = 0.5 * spring.radial_N_per_m
    slipping = with_part(spring, lateral_N_per_m=along, tangential_N_per_m=along)
    return changed(made, road_spring=slipping)


def _without(case: LoadedCase, names: list[str]) -> LoadedCase:
    layers = {k: v for k, v in case.case.rebar_layers.items() if k not in names}
    return changed(case, rebar_layers=layers)


_OTHER: Mapping[str, Add] = {
    "dynamic_stiffening": dynamic_stiffening,
    "frequency_stiffening": frequency_stiffening,
    "tread_density": tread_density,
    "tread_wear": tread_wear,
    "bead_filler": bead_filler,
    "cap_ply": cap_ply,
    "belt_angle": belt_angle,
    "belt_width": belt_width,
    "carcass_fanning": carcass_fanning,
    "carcass_turn_up": carcass_turn_up,
    "sidewall_gauge": sidewall_gauge,
    "rim_width": rim_width,
    "pressure_offset": pressure_offset,
    "temperature": temperature,
    "temperature_drift": temperature_drift,
    "cavity_air": cavity_air,
    "spindle_lateral": Spindle("spindle_lateral", "spindle_tilt", 0.1),
    "spindle_radial": Spindle("spindle_radial", "spindle_torsional", 0.1),
    "spindle_torsional": Spindle("spindle_torsional", "spindle_radial", 0.1),
    "spindle_tilt": Spindle("spindle_tilt", "spindle_lateral", 0.1),
    "point_mass": point_mass,
    "road_contact": road_contact,
}
