"""Sensitivities of the modes to stiffness and mass of each part of the section, with the change of
the inflated state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.modes.find import LabelledModes, modes_in_order
from ...tyre.case import LoadedCase, number_at
from ...tyre.state import TyreState
from .model import ModelRow, state_of
from .model_designs import ModelDesigns

Array = np.ndarray


@dataclass(frozen=True)
class SectionPart:
    """Sensitivities of the n rows to the material of one part of the section."""

    name: str
    stiffness: Array  # (n,) d ln f by ln of its moduli
    mass: Array  # (n,) d ln f, or d ln mass, by ln of its density
    material: str  # its name in the case of `split_by_region`
    rubber: bool = True  # or cords


class Parted(Protocol):
    """A tyre that can give its parts."""

    case: LoadedCase
    evaluator: Evaluator
    rows: list[ModelRow]
    states: list[TyreState]
    jobs: int
    designs: ModelDesigns


def regions(model: Parted, x: Array) -> list[SectionPart]:
    """The rubber of every region (at the crown in two parts: tread, and below it) and every cord;
    of a user's deck every compound and cord.

    One evaluation for each state, with exact slopes by the constants of each part. Raises
    EvaluationFailed.
    """
    case, parts = split_by_region(model.case)
    signs, density = _paths(case, parts)
    paths = (path for material in parts for path in (*signs[material], density[material]))
    numbers = {path: float(number_at(case, path)) for path in paths}
    evaluator = model.evaluator.of(TyreDesign(case))
    labels = sorted({label for label, _ in model.rows if label}, key=str)
    own = model.designs.values(x)
    taken = {
        path: number
        for name, v in case.case.variables.items()
        for path, number in zip(v.sets, v.numbers(own[name]), strict=True)
    }
    design = {**numbers, **taken}
    designs = [model.designs.in_state(state, design, list(numbers)) for state in model.states]
    at: dict[TyreState, LabelledModes] = {}
    answers = modes_in_order(evaluator, designs, labels, model.jobs)
    for state, each in zip(model.states, answers, strict=True):
        if not isinstance(each, LabelledModes):
            raise each
        at[state] = each
    first = at[model.states[0]].evaluation
    result = []
    for material, name in parts.items():
        columns = np.zeros((2, len(model.rows)))
        for i, (label, where) in enumerate(model.rows):
            if label is None:
                path = density[material]
                columns[1, i] = first.mass_gradients[path] * design[path] / first.mass_kg
                continue
            answer = at[state_of(where)]
            mode, gradients = answer.wanted[label], answer.evaluation.gradients
            f, place = mode.frequency_Hz, mode.position
            slope = {p: gradients[p][place] * design[p] / f for p in numbers}
            columns[0, i] = sum(sign * slope[path] for path, sign in signs[material].items())
            columns[1, i] = slope[density[material]]
        rubber = len(signs[material]) > 1  # a cord has one modulus
        result.append(SectionPart(name, columns[0], columns[1], material, rubber))
    return result


def count_numbers(case: LoadedCase) -> int:
    """Number of constants by which each state's evaluation has sensitivities."""
    signs, density = _paths(*split_by_region(case))
    return sum(map(len, signs.values())) + len(density)


def _paths(
    case: LoadedCase, parts: Iterable[str]
) -> tuple[dict[str, dict[str, int]], dict[str, str]]:
    """By material of a split case: paths of its moduli, each with the sign of d ln modulus / d ln
    number, and the path of its density."""
    moduli = {material: case.kind.moduli(case.case, material) for material in parts}
    return moduli, {material: case.kind.density(material) for material in parts}


def split_by_region(case: LoadedCase) -> tuple[LoadedCase, Mapping[str, str]]:
    """The tyre with a separate material in each of its parts, and the parts' names by material
    (`TyreKind.parts`)."""
    split, parts = case.kind.parts(case.case, case.section)
    return replace(case, case=split), parts
