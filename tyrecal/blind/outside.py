"""What the catalogue does not hold: families of errors for trials whose answer is "outside"."""

from __future__ import annotations

from ..case import LoadedCase
from ..effects.edit import with_gauge, with_layers, with_part
from ..effects.edit import with_rubbers_at as rubbers_at
from ..effects.parts import belt_lines, belts, carcass, carcass_line, crown, sidewall
from .laws import Law, stiffer
from .regions import divided


def belt_imbalance(case: LoadedCase, e: float) -> LoadedCase:
    """The two belts differ: cord area of the inner times 1 + e, of the outer times 1 - e."""
    first, *others = belts(case)
    layers = case.case.rebar_layers
    new = {first: with_part(layers[first], area_m2=(1 + e) * layers[first].area_m2)}
    for name in others:
        new[name] = with_part(layers[name], area_m2=(1 - e) * layers[name].area_m2)
    return with_layers(case, new)


def heavy_liner(case: LoadedCase, e: float) -> LoadedCase:
    """Rubber inside the carcass of the sidewall is denser by e: a sealant, a repair."""
    lines = (case.section.names[0], carcass_line(case))
    return rubbers_at(
        case, sidewall(case), lines, "liner",
        lambda m: with_part(m, density_kg_per_m3=(1 + e) * m.density_kg_per_m3),
    )  # fmt: skip


def aged_shoulder(case: LoadedCase, e: float) -> LoadedCase:
    """Rubber has aged in the half of the upper sidewall next to the belt: moduli times 1 + e."""
    case, (name, _) = divided(case, sidewall(case)[0], 2)
    lines = (case.section.names[0], case.section.names[-1])
    return rubbers_at(case, [name], lines, "aged", stiffer(1 + e))


def thick_cushion(case: LoadedCase, e: float) -> LoadedCase:
    """Rubber between carcass and inner belt is thicker by e."""
    return with_gauge(case, (carcass_line(case), belt_lines(case)[0]), crown(case), 1 + e)


def bias_carcass(case: LoadedCase, e: float) -> LoadedCase:
    """Carcass cords are ``e`` degrees off the meridian."""
    layers = case.case.rebar_layers
    return with_layers(
        case,
        {name: with_part(layers[name], angle_deg=layers[name].angle_deg + e)
         for name in carcass(case)},
    )  # fmt: skip


FAMILIES = {
    "belt_imbalance": Law(-0.8, 0.8, belt_imbalance),
    "heavy_liner": Law(0.0, 3.0, heavy_liner),
    "aged_shoulder": Law(0.0, 3.0, aged_shoulder),
    "thick_cushion": Law(0.0, 1.5, thick_cushion),
    "bias_carcass": Law(0.0, 12.0, bias_carcass),
}
