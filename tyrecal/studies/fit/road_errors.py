"""Changes of the r values on the road by each source of error: stiffnesses, areas, lengths,
widths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import EvaluationFailed
from ...tyre.case import LoadedCase, number_at
from ...tyre.number_units import EFFECT_PATH
from ..inference.regions import split_by_region
from ..inference.section_design import SectionDesign
from ..inference.section_fields import OF_COMPOUNDS
from ..inference.uncertainties import Source, values_of
from .road import press, press_with_slopes
from .targets import ValueTarget

Array = np.ndarray
# of the model itself, relative: agreement with CalculiX and GetFEM (tests/benchmarks/FOOTPRINT.md)
STIFFNESS_ERROR, PATCH_ERROR = 0.02, 0.05


def road_form(targets: Sequence[ValueTarget]) -> Array:
    """Relative standard deviations (r,) of the model's own values."""
    stiff = [each.quantity == "vertical_stiffness_N_per_m" for each in targets]
    return np.where(stiff, STIFFNESS_ERROR, PATCH_ERROR)


def road_changes(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    values: Mapping[str, float],
    known: Sequence[Source],
    jobs: int = 1,
) -> Array:
    """Changes (r, k) of ln q of targets, none a mode, by one standard deviation of each source.

    The design ``values`` is pressed with sensitivities to all numbers and nodes, and once more with
    a compound of its own in each part of the section; effects by a step. Raises EvaluationFailed,
    DeckRefused, and ValueError where a target is a mode.
    """
    if any(each.member for each in targets):
        raise ValueError("it is not computed for modes under load")
    if "footprint_gradients" not in evaluator.solver.capabilities:
        raise ValueError(f"solver '{evaluator.solver.name}' gives no sensitivities on the road")
    fields = {s.name: s.field for s in known if s.field and s.field.moves}
    numbers = values_of(case, list(known))
    design = {**numbers, **dict.fromkeys(fields, 0.0), **values}
    names = [*numbers, *fields]
    own = evaluator.of(SectionDesign(case, fields))
    q, slopes = press_with_slopes(case, own, targets, design, names, design, jobs)
    rates = dict(zip(names, slopes.T, strict=True))
    changes = np.zeros((len(targets), len(known)))
    for k, source in enumerate(known):
        if source.name in fields:
            changes[:, k] = rates[source.name]
        for path, step in source.steps.items():
            if path.startswith(EFFECT_PATH):
                present = case.case.effects.get(path.removeprefix(EFFECT_PATH), 0.0)
                there = next(press(case, own, targets, [{**design, path: present + step}], jobs))
                if isinstance(there, EvaluationFailed):
                    raise there
                changes[:, k] += there - q
            else:
                changes[:, k] += step * rates[path]
    of_parts = [
        (k, s.field) for k, s in enumerate(known) if s.field and s.field.kind in OF_COMPOUNDS
    ]
    if of_parts:
        by_part = _by_part(case, evaluator, targets, values, jobs)
        for k, field in of_parts:
            changes[:, k] = by_part[field.kind] @ field.values
    return changes / q[:, None]


def _by_part(
    case: LoadedCase,
    evaluator: Evaluator,
    targets: Sequence[ValueTarget],
    values: Mapping[str, float],
    jobs: int,
) -> dict[str, Array]:
    """d q / d ln stiffness and density (r, parts) of each part of rubber."""
    split, parts = split_by_region(case)
    # by path: 1 or, of the compressibility D1, -1: the power to which stiffness has the number
    signs = {m: case.kind.moduli(split.case, m) for m in parts}
    rubbers = [m for m in parts if len(signs[m]) > 1]  # C10, C01, D1; a cord has E alone
    paths = [path for m in rubbers for path in signs[m]]
    numbers = {path: float(number_at(split, path)) for path in paths}
    taken = {p: values[n] for n, v in split.case.variables.items() for p in v.sets if n in values}
    design = {**numbers, **taken}
    own = evaluator.of(TyreDesign(split))
    _, slopes = press_with_slopes(split, own, targets, design, paths, design, jobs)
    by_path = dict(zip(paths, slopes.T, strict=True))
    stiffness = [
        sum(sign * design[path] * by_path[path] for path, sign in signs[m].items()) for m in rubbers
    ]
    return {
        "stiffness": np.array(stiffness).T,
        "density": np.zeros((len(targets), len(rubbers))),  # no weight acts on the road
    }
