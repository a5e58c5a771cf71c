"""Slopes of the modes by stiffness and mass of each part of the section, preload included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.modes.find import LabelledModes
from ...tyre.case import LoadedCase, number_at
from ...tyre.case.schema import Rubber, Solid
from ...tyre.own_deck.numbers import moduli
from ...tyre.resolve import resolved
from ...tyre.state import TyreState
from ..fit import problem as fit
from .model import ModelRow, state_of

Array = np.ndarray
TREAD = "tread"


@dataclass(frozen=True)
class SectionPart:
    """A part of the section."""

    name: str
    stiffness: Array  # (n,) d ln f by its logarithm
    mass: Array  # likewise
    material: str  # what the split case calls it
    rubber: bool = True  # or cords


class Parted(Protocol):
    """A tyre that can give its parts."""

    case: LoadedCase
    evaluator: Evaluator
    rows: list[ModelRow]
    states: list[TyreState]
    jobs: int

    def values(self, x: Array) -> dict[str, float]:
        """Design variables at x, in their own units."""

    def in_state(
        self, state: TyreState, design: Mapping[str, float], names: Sequence[str] = ()
    ) -> tuple[dict[str, float], tuple[str, ...]]:
        """A design in a state, and those of the slopes ``names`` that it has there."""


def regions(model: Parted, x: Array) -> list[SectionPart]:
    """Every region's rubber (the crown's in two: tread and what lies under it), every cord; of a
    user's deck every compound and cord.

    One evaluation a state, with exact slopes by the constants of each part. Raises
    EvaluationFailed.
    """
    case, parts = split_by_region(model.case) if not model.case.deck else _of_deck(model.case)
    signs = {material: _stiffness_of(case, material) for material in parts}
    density = {material: _density_of(case, material) for material in parts}
    paths = (path for material in parts for path in (*signs[material], density[material]))
    numbers = {path: float(number_at(case, path)) for path in paths}
    evaluator = model.evaluator.of(TyreDesign(case))
    problem = fit.Problem(case, evaluator, jobs=model.jobs)
    own = model.values(x)
    taken = {path: own[name] for name, v in case.case.variables.items() for path in v.sets}
    design = {**numbers, **taken}
    designs = [model.in_state(state, design, list(numbers)) for state in model.states]
    at: dict[TyreState, LabelledModes] = {}
    for state, each in zip(model.states, problem.modes_of(designs), strict=True):
        if not isinstance(each, LabelledModes):
            raise each
        at[state] = each
    weighed = at[model.states[0]].evaluation
    result = []
    for material, name in parts.items():
        columns = np.zeros((2, len(model.rows)))
        for i, (label, where) in enumerate(model.rows):
            if label is None:
                path = density[material]
                columns[1, i] = weighed.mass_gradients[path] * design[path] / weighed.mass_kg
                continue
            answer = at[state_of(where)]
            mode, gradients = answer.wanted[label], answer.evaluation.gradients
            f, place = mode.frequency_Hz, mode.position
            slope = {p: gradients[p][place] * design[p] / f for p in numbers}
            columns[0, i] = sum(sign * slope[path] for path, sign in signs[material].items())
            columns[1, i] = slope[density[material]]
        rubber = len(signs[material]) > 1
        result.append(SectionPart(name, columns[0], columns[1], material, rubber))
    return result


def _stiffness_of(case: LoadedCase, material: str) -> dict[str, int]:
    """Paths of a material's moduli, -1 where it is their reciprocal."""
    if case.deck:
        return moduli(case.deck_numbers, material)
    rubber = isinstance(case.case.materials[material], Rubber)
    signs = {"C10_Pa": 1, "C01_Pa": 1, "D1_per_Pa": -1} if rubber else {"youngs_modulus_Pa": 1}
    return {f"materials.{material}.{key}": sign for key, sign in signs.items()}


def _density_of(case: LoadedCase, material: str) -> str:
    if case.deck:
        return f"material {material} / DENSITY / density"
    return f"materials.{material}.density_kg_per_m3"


def _of_deck(case: LoadedCase) -> tuple[LoadedCase, Mapping[str, str]]:
    """The case of a user's deck, and names of its materials that have plain numbers, not marks."""
    flat = resolved(case).flat
    names = dict.fromkeys((*flat.materials, *(ply.material for ply in flat.plies)))
    able = [
        m for m in names if _stiffness_of(case, m) and _density_of(case, m) in case.deck_numbers
    ]
    return case, dict(zip(able, able, strict=True))


def split_by_region(case: LoadedCase) -> tuple[LoadedCase, Mapping[str, str]]:
    """The tyre with a rubber of its own in every region, and names of the parts by material.

    Cords keep their materials, which are parts too. Design variables set all copies.
    """
    lines, names = case.section.names, [name for name, _ in case.section.regions]
    materials, solids, parts = dict(case.case.materials), [], {}
    copies: dict[str, list[str]] = {}
    for i, solid in enumerate(case.case.solids):
        for region in solid.regions or names:
            pieces: list[tuple[str, list[str] | None]] = [(region, solid.between)]
            if region == names[0] and solid.between is None:
                pieces = [
                    (f"{region} under the tread", [lines[0], lines[-2]]),
                    (TREAD, [lines[-2], lines[-1]]),
                ]
            for words, between in pieces:
                copy = f"part_{i}_{words.replace(' ', '_')}"
                materials[copy] = case.case.materials[solid.material]
                copies.setdefault(solid.material, []).append(copy)
                solids.append(Solid(material=copy, regions=[region], between=between))
                one = len(case.case.solids) == 1
                parts[copy] = words.replace("_", " ") + ("" if one else f", {solid.material}")
    for name, own in case.case.materials.items():
        if not isinstance(own, Rubber):
            parts[name] = name.replace("_", " ") + "s"
    variables = {}
    for name, variable in case.case.variables.items():
        sets = []
        for path in variable.sets:
            head, _, rest = path.partition(".")
            material, _, key = rest.partition(".")
            same = copies.get(material, []) if head == "materials" else []
            sets += [path, *(f"materials.{copy}.{key}" for copy in same)]
        variables[name] = variable.model_copy(update={"sets": sets})
    wanted = {"materials": materials, "solids": solids, "variables": variables}
    return replace(case, case=case.case.model_copy(update=wanted)), parts
