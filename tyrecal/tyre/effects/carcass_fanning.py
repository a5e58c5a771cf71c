"""A radial carcass has the same number of cords at every radius: they are closer at the bead."""

from __future__ import annotations

from math import degrees

from ...errors import InputError
from ..case import LoadedCase
from .edit import unused, with_layers, with_part
from .effect import Effect
from .parts import carcass, carcass_line, rim_edge


def add(case: LoadedCase, value: float) -> LoadedCase:
    """A share ``value`` of the carcass' cords at a constant angle, the rest at constant spacing.

    A/s = A/s0 (1 - value + value R_bead / R), R_bead at the first station that the rim holds.
    Equal there, because a tyre's specification states the spacing s0 on the building drum, of about
    the bead's diameter.
    """
    if not 0 < value <= 1:
        raise InputError("must be between 0 and 1")
    line = case.section.points[case.section.names.index(carcass_line(case))]
    bead = float(line[rim_edge(case.section), 0])
    layers = dict(case.case.rebar_layers)
    for name in carcass(case):
        layer = layers[name]
        if layer.spacing_m is None:
            raise InputError(f"must be 0: the cords of '{name}' fan out already")
        fanned = with_part(
            layer,
            area_m2=value * layer.area_m2,
            geometry="angular",
            spacing_deg=degrees(layer.spacing_m / bead),
            spacing_m=None,
        )
        if value < 1:
            layers[name] = with_part(layer, area_m2=(1 - value) * layer.area_m2)
            layers[unused(f"{name}_fanned", layers)] = fanned
        else:
            layers[name] = fanned
    return with_layers(case, layers)


EFFECT = Effect(
    id="carcass_fanning",
    place=90,
    title="Fanned carcass cords",
    symbol="e",
    unit="",
    # 1 is a radial carcass without joints; crossing plies and spread cords lie between
    low=0.0,
    high=1.0,
    changes=("*REBAR LAYER",),
    signature=(
        "all down, most those that the sidewall's tension holds: [1,0] and [0,0] lateral -3"
        " %, [4,0] -0.6 % at e = 1, more at higher pressure; A_carcass absorbs all but 0.1 %"
    ),
    toggle="count the cords per length at the crown and at the bead of a tyre that is cut open",
    aliases=("temperature_drift",),
    add=add,
    # error of its shifts, relative: cords fan as the lift of the drum was, not quite as the radius
    response_error=0.06,
)
