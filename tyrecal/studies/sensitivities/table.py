"""Logarithmic sensitivities d ln q / d ln x of quantities q to numbers x of a case.

One evaluation serves all numbers. The solver gives d q / d x exactly, through the text of the decks
(`simulate/deck/decks.py` `tangents`), and on the road from load to load. A number that is 0, or an
angle, has no useful logarithm: then d ln q / d x, per unit or per degree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...simulate.deck.decks import Decks
from ...simulate.evaluate.evaluator import Evaluator, Question
from ...simulate.evaluate.failure import DeckRefused
from ...simulate.modes.find import LabelledModes, find_modes
from ...simulate.modes.label import Label, Mode, labelled
from ...tyre.case import LoadedCase, number_at
from ...tyre.case.mistakes import suggestion
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ...tyre.number_units import unit_of
from ...tyre.own_deck.numbers import as_known
from ...tyre.state import TyreState
from ...tyre.templates import TemplateFailed
from ...tyre.values import paths_of, tyre_numbers
from ..fit.road import press_with_slopes
from ..fit.targets import ValueTarget, target_labels
from ..result import ResultPart
from ..variable import read_variables

Array = np.ndarray
FREQUENCY_KIND, MASS_KIND = "frequency_Hz", "mass_kg"
QUANTITY_KINDS = (FREQUENCY_KIND, MASS_KIND, *FOOTPRINT_QUANTITIES)
KIND_UNITS = ("_Hz", "_kg", "_N_per_m", "_m2", "_m")  # with which names of kinds end
PER_DEGREE = "degree"
# parts of a case on which no frequency depends, or only by the discretisation
NOT_OF_A_TYRE = ("format", "mesh", "variables", "targets", "uncertainties", "solver")


class Sensitivity(ResultPart):
    """d ln q / d ln x or, where ``per`` is not empty, d ln q / d x per that unit."""

    quantity: str  # quantity that moves
    by: str  # number that moves it: a variable by name, another number by path
    value: float  # d ln q / d ln x, or with per: d ln q / d x
    per: str = ""  # unit of x, if the sensitivity is not to its logarithm


@dataclass(frozen=True)
class Sensitivities:
    """Sensitivities of a design."""

    numbers: Mapping[str, float]  # x by name, in its own unit
    quantities: Mapping[str, float]  # q by name, in the unit of its name
    rows: list[Sensitivity]
    unmoved: list[str]  # numbers that no quantity depends on, not in ``rows``
    refused: Mapping[str, str]  # numbers without a sensitivity, and why


def short_name(kind: str) -> str:
    """A kind of quantity without its unit: ``vertical_stiffness``."""
    return next(kind.removesuffix(unit) for unit in KIND_UNITS if kind.endswith(unit))


def kinds_of(names: Iterable[str]) -> list[str]:
    """Kinds of quantities by their names, with or without the unit. Raises InputError."""
    known = {short_name(kind): kind for kind in QUANTITY_KINDS} | {
        kind: kind for kind in QUANTITY_KINDS
    }
    kinds = []
    for name in names:
        if name not in known:
            raise InputError(f"there is no quantity '{name}'{suggestion(name, known)}")
        kinds.append(known[name])
    return list(dict.fromkeys(kinds)) or [FREQUENCY_KIND]


def numbers_of(case: LoadedCase, by: Sequence[str]) -> list[str]:
    """The numbers named by ``by``; without any, all variables and all other numbers of the tyre
    that are not 0. Raises InputError for a name that is none, or a number that a variable sets."""
    variables = case.case.variables
    if not by:
        return [*variables, *tyre_numbers(case)]
    names = list(dict.fromkeys(as_known(name, case.deck_numbers) for name in by))
    for name in names:
        paths = paths_of(case, name)
        for own, variable in variables.items():
            if name not in variables and not set(paths).isdisjoint(variable.sets):
                raise InputError(f"{name} is set by the variable '{own}': name {own} instead")
        if name not in variables and paths[0].partition(".")[0] in NOT_OF_A_TYRE:
            raise InputError(f"{name} is no number of the tyre: no quantity depends on it")
        if name not in variables:
            number_at(case, name)
    return names


def needs_gradients(evaluator: Evaluator) -> None:
    """Raises DeckRefused where the solver gives no exact sensitivities of the case."""
    if not evaluator.has_gradients:
        raise DeckRefused(
            f"solver '{evaluator.solver.name}' gives no exact sensitivities of this case: 'tyrecal"
            " solvers' shows which one does (gradients)"
        )


def sensitivities(
    case: LoadedCase,
    evaluator: Evaluator,
    values: Mapping[str, float],
    by: Sequence[str] = (),
    of: Sequence[str] = (),
    loads_N: Sequence[float] = (),
    jobs: int = 1,
) -> Sensitivities:
    """Sensitivities of the design ``values`` to the numbers ``by`` (see `numbers_of`).

    of: kinds of quantities (`QUANTITY_KINDS`), by default all frequencies; loads_N: of those on the
    road.
    Raises InputError, DeckRefused, EvaluationFailed.
    """
    kinds, names = kinds_of(of), numbers_of(case, by)
    needs_gradients(evaluator)
    x = _next_to_0(case, {n: values[n] if n in values else number_at(case, n) for n in names})
    design = {**values, **x}
    refused: dict[str, str] = {}
    try:
        answer = _modes(case, evaluator, design, names)
    except TemplateFailed:
        if by:
            raise
        refused = _without_sensitivity(evaluator, design, names)
        names = [name for name in names if name not in refused]
        answer = _modes(case, evaluator, design, names)
    quantities, slopes = _unloaded(answer, kinds, names)
    if road := [kind for kind in kinds if kind in FOOTPRINT_QUANTITIES]:
        more = _on_the_road(case, evaluator, design, names, road, loads_N, jobs)
        quantities, slopes = quantities | more[0], np.vstack([slopes, more[1]])
    rows, unmoved = [], []
    for k, name in enumerate(names):
        if not by and not slopes[:, k].any():
            unmoved.append(name)
            continue
        per = _per(case, name, x[name])
        for (quantity, q), slope in zip(quantities.items(), slopes[:, k], strict=True):
            value = float(slope / q * (1.0 if per else x[name]))
            rows.append(Sensitivity(quantity=quantity, by=name, value=value, per=per))
    return Sensitivities({n: x[n] for n in names}, quantities, rows, unmoved, refused)


def _next_to_0(case: LoadedCase, x: Mapping[str, float]) -> dict[str, float]:
    """The numbers, with variables of effects at a bound of 0 next to it, as a fit has them."""
    least = {v.name: v for v in read_variables(case)}
    return {
        name: min(max(value, least[name].lower), least[name].upper) if name in least else value
        for name, value in x.items()
    }


def _modes(
    case: LoadedCase, evaluator: Evaluator, design: Mapping[str, float], names: Sequence[str]
) -> LabelledModes:
    """The design's modes with their sensitivities. Raises DeckRefused, EvaluationFailed."""
    question = Question(design, tuple(names))
    ((_, answer),) = find_modes(evaluator, [question], target_labels(case))
    if not isinstance(answer, LabelledModes):
        raise answer
    return answer


def _without_sensitivity(
    evaluator: Evaluator, design: Mapping[str, float], names: Sequence[str]
) -> dict[str, str]:
    """Numbers with which the decks change otherwise than as numbers of data lines, and why."""
    tyre, refused = evaluator.design.at(design), {}
    for name in names:
        try:
            Decks(tyre, (name,)).tangents(evaluator.solver.dialect)
        except TemplateFailed as error:
            refused[name] = str(error)
    return refused


def _unloaded(
    answer: LabelledModes, kinds: Sequence[str], names: Sequence[str]
) -> tuple[dict[str, float], Array]:
    """Frequencies and mass by name, and d q / d x (quantities, numbers)."""
    evaluation = answer.evaluation
    quantities, slopes = dict[str, float](), list[list[float]]()
    modes: dict[Label, Mode] = {mode.label: mode for mode in labelled(evaluation)}
    for label, mode in modes.items() if FREQUENCY_KIND in kinds else ():
        quantities[f"{FREQUENCY_KIND} {label}"] = mode.frequency_Hz
        slopes.append([float(evaluation.gradients[name][mode.position]) for name in names])
    if MASS_KIND in kinds:
        quantities[MASS_KIND] = evaluation.mass_kg
        slopes.append([evaluation.mass_gradients[name] for name in names])
    return quantities, np.array(slopes, float).reshape(len(quantities), len(names))


def _on_the_road(
    case: LoadedCase,
    evaluator: Evaluator,
    design: Mapping[str, float],
    names: Sequence[str],
    kinds: Sequence[str],
    loads_N: Sequence[float],
    jobs: int,
) -> tuple[dict[str, float], Array]:
    """Quantities under each load by name, and d q / d x (quantities, numbers)."""
    evaluator.needs_road()
    if "footprint_gradients" not in evaluator.solver.capabilities:
        raise DeckRefused(
            f"solver '{evaluator.solver.name}' gives no exact sensitivities on a road: 'tyrecal"
            " solvers' shows which one does (footprint_gradients)"
        )
    wanted = [
        ValueTarget(kind, value=1.0, sigma=1.0, state=TyreState(None, load))
        for load in loads_N or loads_of(case)
        for kind in kinds
    ]
    values, slopes = press_with_slopes(case, evaluator, wanted, design, names, design, jobs)
    words = [f"{each.quantity} {each.state.load_N:g} N" for each in wanted]
    return dict(zip(words, values.tolist(), strict=True)), slopes


def loads_of(case: LoadedCase) -> list[float]:
    """Loads at which something on the road was measured; without any the case's middle load."""
    own = case.case.road.loads_N
    return case.case.targets.loads_N or [own[len(own) // 2]]


def _per(case: LoadedCase, name: str, x: float) -> str:
    """The unit per which a sensitivity is stated; "" where it is that of the logarithm."""
    unit = unit_of(paths_of(case, name)[0])
    if unit == "degrees":
        return PER_DEGREE
    return "" if x else unit or "1"
