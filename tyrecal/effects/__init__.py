"""What a plain model leaves out: one file an effect, each with one parameter; 0 = absent.

Installed packages add theirs under the entry point group GROUP: the id, and where its `Effect` is.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import TYPE_CHECKING

from .effect import Effect, EffectRefused

if TYPE_CHECKING:
    from ..case import LoadedCase

GROUP = "tyrecal.effects"
SPINDLE = ("spindle_lateral", "spindle_radial", "spindle_torsional", "spindle_tilt")
# Each in a module of its own name, or in SPINDLE's; listed, and applied to a case, in this order.
OWN = (
    "dynamic_stiffening",
    "frequency_stiffening",
    "tread_density",
    "tread_wear",
    "bead_filler",
    "cap_ply",
    "belt_angle",
    "belt_width",
    "carcass_fanning",
    "carcass_turn_up",
    "sidewall_gauge",
    "rim_width",
    "pressure_offset",
    "temperature",
    "temperature_drift",
    "cavity_air",
    *SPINDLE,
    "wheel_free",
    "stiffness_splice",
    "point_mass",
    "road_contact",
    "rotation",
)
_ADDED = {entry.name: entry for entry in entry_points(group=GROUP) if entry.name not in OWN}
IDS = (*OWN, *sorted(_ADDED))

REMEMBERED = 4  # cases: an evaluation asks for its own several times
_DONE: dict[int, tuple[LoadedCase, LoadedCase]] = {}  # holds the case, so that its id stays its own

__all__ = ["IDS", "Effect", "EffectRefused", "catalogue", "with_effects"]


@cache
def catalogue() -> dict[str, Effect]:
    """Every effect by its id. (Modules are imported here: the case's schema needs the ids only.)"""
    spindle = {effect.id: effect for effect in import_module(".spindle", __package__).EFFECTS}
    own = {id: spindle.get(id) or import_module(f".{id}", __package__).EFFECT for id in OWN}
    return {**own, **{id: _ADDED[id].load() for id in sorted(_ADDED)}}


def with_effects(case: LoadedCase) -> LoadedCase:
    """The case with its effects written into its other numbers, and none left to apply.

    The very case where it has none. Raises EffectRefused for a parameter that cannot be.
    """
    present = {id: value for id, value in case.case.effects.items() if value}
    if not present:
        return case
    if id(case) not in _DONE:
        while len(_DONE) >= REMEMBERED:
            _DONE.pop(next(iter(_DONE)))
        _DONE[id(case)] = case, _with_effects(case, present)
    return _DONE[id(case)][1]


def _with_effects(case: LoadedCase, present: dict[str, float]) -> LoadedCase:
    from ..deck.context import section_mesh

    case = replace(case, case=case.case.model_copy(update={"effects": dict.fromkeys(IDS, 0.0)}))
    for id in sorted(present, key=IDS.index):
        try:
            before, case = case, catalogue()[id].add(case, present[id])
            if (case.section, case.case.section) != (before.section, before.case.section):
                section_mesh(case)  # remembered for the deck; refuses a section that folds over
        except ValueError as error:
            raise EffectRefused(id, str(error), present[id]) from None
    return case
