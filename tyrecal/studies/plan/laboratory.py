"""Measurements that a laboratory may take of a tyre, with their hours, in one linear diagnosis.

The model is evaluated once, at the case's start and in all states of the menu. Each row belongs to
one item of the menu; a plan is a sequence of items.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...errors import InputError
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.number_units import EFFECT_PATH
from ...tyre.state import TyreState
from ..diagnose.next_measurement import (
    CAVITY_GAS,
    CHECKED,
    DIRECT_READINGS,
    HELD_BY,
    HELIUM,
    MASS_PERCENT,
    MIN_OFFERED_STEP,
    READING,
    STEP_HOURS,
    cost_hours,
    offered_kPa,
)
from ..inference.effect_ranges import effect_ranges
from ..inference.expansion import EffectResponse, Expansion, expand
from ..inference.inverse_problem import InverseProblem, Toggle
from ..inference.model import EffectRange, ModelRow
from ..inference.observations import Observable, Observations
from ..inference.section_fields import SECTION
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source, calibrated, sources
from .chance import LinearDiagnosis

Array = np.ndarray
PLANNED_READINGS = DIRECT_READINGS | {
    "gauge": ("compare the pressure gauge with a second one", {"pressure_offset"}),
    "thermometer": ("measure the temperature of the tyre", {"temperature"}),
}


@dataclass(frozen=True)
class Item:
    """A measurement of the menu."""

    what: str  # in words
    hours: float
    pressure_kPa: float | None = None  # of a set of response functions


@dataclass(frozen=True)
class Laboratory:
    """All that may be measured, and the tyre's model of it."""

    problem: InverseProblem  # of all rows
    item: Array  # (n,) name of the item that each row belongs to
    menu: Mapping[str, Item]
    own_kPa: float  # pressure of the case
    any_pressure: bool  # whether pressures may lie close together

    @cached_property
    def linear(self) -> LinearDiagnosis:
        """The linear diagnosis of all rows."""
        return LinearDiagnosis(self.problem)

    def rows(self, done: Sequence[str]) -> Array:
        """Indices (m,) of the rows of some items, distances of pairs included."""
        every = np.append(self.item, self.item[self.linear.pairs])
        return np.flatnonzero(np.isin(every, done))

    def offered(self, done: Sequence[str]) -> list[str]:
        """Items that remain; a new pressure is a step away from those that were measured."""
        measured = [p for name in done if (p := self.menu[name].pressure_kPa) is not None]
        least = 0.0 if self.any_pressure else MIN_OFFERED_STEP * self.own_kPa
        far = lambda p: p is None or all(abs(p - each) >= least for each in measured)
        return [n for n, each in self.menu.items() if n not in done and far(each.pressure_kPa)]

    def hours(self, done: Sequence[str]) -> float:
        """Hours of some items."""
        return sum(self.menu[name].hours for name in done)


@dataclass(frozen=True)
class Offer:
    """Items of the menu of measurements by name, and the rows that they give."""

    ranges: Mapping[str, EffectRange]
    menu: dict[str, Item] = field(default_factory=dict)
    item: list[str] = field(default_factory=list)  # of each row
    rows: list[ModelRow] = field(default_factory=list)
    observed: list[Observable] = field(default_factory=list)
    changes: list[Toggle] = field(default_factory=list)

    def add(self, name: str, what: str, hours: float, at: Sequence[ModelRow], run: int = 0) -> None:
        """Add an item with its rows."""
        where = at[0][1] if at and at[0][0] and name.endswith("kPa") else None
        self.menu[name] = Item(what, hours, where if isinstance(where, float) else None)
        self.item.extend([name] * len(at))
        self.rows.extend(at)
        self.observed.extend(replace(Observable.of(row), run=run) for row in at)

    def model(self, case: LoadedCase, evaluator: Evaluator, jobs: int) -> TyreModel:
        """The tyre's model of the rows, each once."""
        distinct = list(dict.fromkeys(self.rows))
        return TyreModel(case, evaluator, distinct, sources(case)[0], self.ranges, jobs)


def offer(
    case: LoadedCase,
    evaluator: Evaluator,
    labels: Sequence[Label],
    pressures_kPa: Sequence[float],
    steps: Mapping[str, float] = STEP_HOURS,
) -> Offer:
    """The menu of measurements of a case; see `laboratory`.

    Raises InputError if the solver gives no exact sensitivities."""
    if not evaluator.has_gradients:
        raise InputError(
            "a plan needs exact sensitivities, which this solver does not give: --solver bundled"
        )
    own_kPa, cost = case.case.pressure_kPa, cost_hours(steps)
    taken = {path.removeprefix(EFFECT_PATH) for path in calibrated(case)}
    ranges = {id: span for id, span in effect_ranges(case, evaluator)[0].items() if id not in taken}
    made = Offer(ranges)
    for p in map(float, pressures_kPa or offered_kPa(own_kPa, [])):
        at: list[ModelRow] = [(label, p) for label in labels]
        made.add(f"{p:g} kPa", f"response functions at {p:g} kPa", cost["pressure"], at)
    own: list[ModelRow] = [(label, own_kPa) for label in labels]
    again = f"mount the tyre again and repeat {own_kPa:g} kPa"
    made.add("mount", again, cost["mount"], own)
    if HELD_BY & {*ranges}:
        held: list[ModelRow] = [(label, TyreState(own_kPa, 0.0, "fixed")) for label in labels]
        made.add("clamp", f"clamp the rim rigidly, {own_kPa:g} kPa", cost["clamp"], held)
    if CAVITY_GAS in ranges:
        made.add("helium", f"fill with helium, {own_kPa:g} kPa", cost["helium"], own, run=1)
        gas = ranges[CAVITY_GAS].base
        made.changes.append(Toggle(CAVITY_GAS, HELIUM, times=True, base=gas))
    made.add("weigh", "weigh the tyre", cost["weigh"], [(None, 0.0)])
    return made


def laboratory(
    case: LoadedCase,
    evaluator: Evaluator,
    labels: Sequence[Label],
    pressures_kPa: Sequence[float],
    noise: float,
    steps: Mapping[str, float],
    jobs: int = 1,
) -> Laboratory:
    """The laboratory of a case; nothing is measured yet.

    labels: modes that are measured; pressures_kPa: (): those that `diagnose` offers; noise:
    relative, of every frequency; steps: hours of each step, see `next_measurement.STEP_HOURS`.
    Raises InputError, EvaluationFailed.
    """
    own_kPa, cost, own_sources = case.case.pressure_kPa, cost_hours(steps), sources(case)[0]
    made = offer(case, evaluator, labels, pressures_kPa, steps)
    ranges, menu, item, rows, observed = made.ranges, made.menu, made.item, made.rows, made.observed
    model = made.model(case, evaluator, jobs)
    expanded = replace(expand(model, model.start), coupling=None)
    distinct = list(dict.fromkeys(rows))
    places = [distinct.index(row) for row in rows]
    shows, readings = _readings(expanded, model, own_sources)
    for tool, _ in readings:
        menu[tool] = Item(PLANNED_READINGS[tool][0], cost[tool])
    item += [tool for tool, _ in readings]
    count = len(distinct)
    expansion = _with_readings(expanded, model, shows, [id for _, id in readings])
    places += range(count, count + len(shows))
    observed += [Observable(f"reading {i}", None, 0.0) for i in range(len(shows))]
    is_pair = np.array([bool(row.label and row.label.c) for row in observed])
    scatter = np.where(is_pair, noise / np.sqrt(2), noise)
    scatter[np.array(item) == "weigh"] = MASS_PERCENT / 100
    scatter[len(rows) :] = [READING if id else CHECKED for _, id in readings]
    places_array, apart = np.array(places), np.where(is_pair, noise * np.sqrt(2), np.nan)
    seen = Observations(
        tuple(observed),
        expansion.eta[places_array],
        scatter,
        common=0.0,
        split=np.where(is_pair, 0, np.nan),
        split_scatter=apart,
    )
    problem = InverseProblem(
        seen, expansion, ranges, places_array, model.start, model.spread, tuple(made.changes)
    )
    return Laboratory(problem, np.array(item), menu, own_kPa, bool(pressures_kPa))


def _readings(
    expanded: Expansion, model: TyreModel, own_sources: Sequence[Source]
) -> tuple[Array, list[tuple[str, str]]]:
    """Changes (r, k) of further rows by the sources of error, and for each row its tool and the
    effect whose size it reads, "" for a field of the section."""
    readings = [
        (tool, id)
        for tool, (_, ids) in PLANNED_READINGS.items()
        for id in expanded.nodes
        if id in ids
    ]
    fields = [k for k, name in enumerate(model.sources) if name.startswith(SECTION)]
    shows = np.zeros((len(readings) + len(fields), len(model.sources)))
    for i, (_, id) in enumerate(readings):
        steps = [source.steps.get(EFFECT_PATH + id, 0.0) for source in own_sources]
        shows[i, : len(steps)] = np.array(steps) / _far(model, id)
    shows[range(len(readings), len(shows)), fields] = 1.0
    return shows, [*readings, *[("cut", "")] * len(fields)]


def _far(model: TyreModel, id: str) -> float:
    """Far end of an effect's range."""
    return max(abs(model.ranges[id].low), abs(model.ranges[id].high))


def _with_readings(
    expanded: Expansion, model: TyreModel, shows: Array, ids: Sequence[str]
) -> Expansion:
    """The expansion with rows added: readings of effects' sizes, over their ranges, and of
    sources."""
    m, v = len(shows), len(expanded.x0)

    def of(id: str, nodes: EffectResponse) -> EffectResponse:
        size = np.zeros((len(nodes.values), m))
        if id in ids:
            size[:, list(ids).index(id)] = nodes.values / _far(model, id)
        return replace(
            nodes,
            shift=np.hstack([nodes.shift, size]),
            slope=np.hstack([nodes.slope, np.full_like(size, np.nan)]),
            tilt=np.concatenate([nodes.tilt, np.zeros((len(size), m, v))], axis=1),
            split=np.hstack([nodes.split, np.zeros_like(size)]),
            shape_uncertainty={
                e: np.append(each, np.zeros(m)) for e, each in nodes.shape_uncertainty.items()
            },
        )

    return replace(
        expanded,
        eta=np.append(expanded.eta, np.zeros(m)),
        jacobian=np.vstack([expanded.jacobian, np.zeros((m, v))]),
        hessian=np.concatenate([expanded.hessian, np.zeros((m, v, v))]),
        split=np.append(expanded.split, np.zeros(m)),
        constants=np.vstack([expanded.constants, shows]),
        nodes={id: of(id, nodes) for id, nodes in expanded.nodes.items()},
    )
