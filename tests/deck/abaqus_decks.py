"""Every deck that the ABAQUS templates write: of each, the product of the options that it reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

from tyrecal.simulate.deck.abaqus import context
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.templates import environment, render
from tyrecal.tyre.values import with_values

from ..effects.support import CASE, COARSE

EFFECTS: dict[str, dict[str, float]] = {  # what a deck has only of a design that has it
    "plain": {},
    "springs": {"effects.spindle_lateral": 1e-7, "effects.spindle_tilt": 1e-6},
    "free": {"effects.wheel_free": 1.0},
    "gas": {"effects.cavity_air": 1.0},
    "mass": {"effects.point_mass": 0.02},
    "road": {"effects.road_contact": 3000.0},
    "turning": {"effects.rotation": 12.0},
    "exponent": {"effects.frequency_stiffening": 0.03},
}
Names = dict[str, Any]


@cache
def names_of(effects: str = "plain", element: str = "CGAX8R") -> Names:
    """Names that the templates receive for a design."""
    case = with_values(CASE, EFFECTS[effects])
    mesh = case.case.mesh.model_copy(update={"element": element, "hourglass_stiffness_Pa": 3e4})
    few = mesh.levels["default"].model_copy(update={"elements": dict.fromkeys(COARSE, 1)})
    mesh = mesh.model_copy(update={"levels": {"default": few}})
    case = replace(case, case=case.case.model_copy(update={"mesh": mesh}))
    names = {**context(TyreDesign(case).tyre), "modes": 20, "loads": (), "loaded_modes": 0}
    names["rim_motions"] = ()
    return {**names, "mesh_block": written("mesh.inp.j2", names).rstrip("\n")}


def written(template: str, names: Names) -> str:
    """A template's text."""
    return render(environment("abaqus", None), template, names)


def rubbers(effects: str, prony: bool) -> list[Names]:
    """Materials with or without Prony terms."""
    materials = names_of(effects)["materials"]
    return [each if prony else {**each, "prony": []} for each in materials]


def inflations() -> Iterator[str]:
    """inflate.inp, which a splice's is too."""
    layers = names_of()["layers"]
    fanned = [{**layers[0], "angular": True}, *layers[1:]]
    laws = (rubbers("plain", True), rubbers("plain", False), rubbers("exponent", True))
    for element, stiff, plies, materials, gas, well, turning, long_term in product(
        ("CGAX8R", "CGAX8", "CGAX4R"), (3e4, None), (layers, fanned), laws, *4 * [(False, True)]
    ):
        names = names_of(element=element)
        if not names["hourglass"] and stiff:
            continue
        own = {
            "hourglass": names["hourglass"] and {"stiffness": stiff},
            "layers": plies,
            "materials": materials,
            "gas": names_of("gas")["gas"] if gas else None,
            "well": names_of("gas", element)["well"] if well or gas else None,
            "turning": names_of("turning")["turning"] if turning else None,
            "long_term": long_term,
        }
        yield written("inflate.inp.j2", {**names, **own})


def modes() -> Iterator[str]:
    """modes.inp."""
    attached = ([], names_of("mass")["attached"], names_of("road")["attached"])
    for wheel, groups, turning, hertz, long_term, well in product(
        ("plain", "springs", "free"),
        (*attached, [*attached[1], *attached[2]]),
        *4 * [(False, True)],
    ):
        own = {
            "wheel": names_of(wheel)["wheel"],
            "attached": groups,
            "turning": names_of("turning")["turning"] if turning else None,
            "vibration_frequency": 60.0 if hertz else None,
            "long_term": long_term,
            "well": names_of("gas")["well"] if well or wheel != "plain" else None,
        }
        yield written("modes.inp.j2", {**names_of(), **own})


def presses() -> Iterator[str]:
    """press.inp."""
    mass = {"element": 999_000_001, "value": 10.0}
    for loads, count, wheel, hertz, long_term in product(
        ((500.0,), (500.0, 1000.0, 1500.0)), (0, 12), (None, mass), *2 * [(False, True)]
    ):
        own = {
            "loads": loads,
            "loaded_modes": count,
            "rim_motions": range(1, 7) if count else (),
            "road": {**names_of()["road"], "wheel": wheel},
            "vibration_frequency": 60.0 if hertz else None,
            "long_term": long_term,
        }
        yield written("press.inp.j2", {**names_of(), **own})
