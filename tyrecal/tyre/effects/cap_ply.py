"""A textile layer over the belt, with cords round the tyre."""

from __future__ import annotations

from ...errors import InputError
from ..case import LoadedCase
from ..case.parts import Cord, RebarLayer
from .edit import changed, unused, with_layers
from .effect import Effect
from .parts import belt_lines, present

NYLON = Cord(kind="cord", youngs_modulus_Pa=3.5e9, poissons_ratio=0.3, density_kg_per_m3=1140.0)
SPACING_M = 1e-3  # of its cords


def add(case: LoadedCase, value: float) -> LoadedCase:
    """A nylon layer on the outer belt's line, its cords 90 degrees from the meridian, of stiffness
    E A / s = value, A a cord's area, s the spacing; without the rubber that it is laid in."""
    return _over(case, belt_lines(case)[-1], value)


def to_the_edge(case: LoadedCase, value: float) -> LoadedCase:
    """The same on the widest belt's line, so that it holds the edges of all belts. Raises
    InputError where none is wider than the outer one."""
    lines = belt_lines(case)
    length = dict(zip(case.section.names, present(case.section).sum(1), strict=True))
    widest = max(lines, key=lambda line: int(length[line]))
    if length[widest] == length[lines[-1]]:
        raise InputError("must be 0: no belt is wider than the outer one")
    return _over(case, widest, value)


def _over(case: LoadedCase, line: str, value: float) -> LoadedCase:
    """`add` on a line of the section."""
    if not value > 0:
        raise InputError("must be at least 0")
    material = unused("cap_ply_cord", case.case.materials)
    layer = RebarLayer(
        line=line,
        material=material,
        area_m2=value * SPACING_M / NYLON.youngs_modulus_Pa,
        spacing_m=SPACING_M,
        angle_deg=90.0,
    )
    case = changed(case, materials={**case.case.materials, material: NYLON})
    return with_layers(case, {unused("cap_ply", case.case.rebar_layers): layer})


EFFECT = Effect(
    id="cap_ply",
    place=60,
    title="Cap ply",
    symbol="EA/s",
    unit="N/m",
    # one layer of nylon 1400 dtex/2, 1000 cords a metre of 0.3 mm2, about 1 MN/m; two at most
    low=0.0,
    high=2e6,
    changes=("*REBAR LAYER", "*MATERIAL"),
    signature=(
        "[2,1] and [3,1] up 2 %, [1,0] to [3,0] up 1 to 2 % at 2 MN/m, less at higher "
        "pressure; [0,0] and [1,1] down 1 % by its mass; a re-fit leaves [0,0] torsional "
        "3 % too low"
    ),
    toggle="section a tyre of the same build, or read the construction on its sidewall",
    aliases=("belt_width", "bead_filler", "belt_angle"),
    add=add,
    # error of its shifts, relative: one layer or more at the edges; wound at 0 to 5 degrees; a
    # diagnosis integrates over its width
    response_error=0.10,
    shape_uncertainty=to_the_edge,
)
