"""Measurements on the road against tyres that were fitted without a load: held out by kind."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log, sqrt

from ...measured.measurement import Measurement
from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ...simulate.modes.label import Label
from ...simulate.modes.loaded import Member
from ...tyre.case import LoadedCase
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ...tyre.templates import TemplateFailed
from ..footprint import footprint_row
from ..inference.tyre_model import asked_for
from ..loaded import load_tyres

LoadedKey = tuple[str, Member | None, float]  # a "place" here: quantity, mode, load in N
Values = Mapping[str, float]  # numbers of the case by variable or path


@dataclass(frozen=True)
class LoadedRow:
    """A measured quantity of the patch, a vertical stiffness or a mode at a load."""

    quantity: str
    member: Member | None  # of a mode
    pressure_kPa: float
    load_N: float
    value: float  # in the unit of ``quantity``
    sigma: float  # standard deviation of ``value``
    off: Mapping[str, float]  # ln value less ln of each tyre's, where it has one


@dataclass(frozen=True)
class UnderLoad:
    """Measurements on the road, with the values that tyres have there."""

    rows: tuple[LoadedRow, ...]  # by pressure and load
    tyres: tuple[str, ...]  # names of those compared, the calibrated one first
    failed: tuple[str, ...]  # what a tyre lacks and why

    def rms_percent(self, tyre: str, load_N: float | None = None) -> float | None:
        """RMS of ``off``, per cent, over the rows (of all loads, or of one) that every tyre with
        any rows has; None: there is none."""
        able = {each for row in self.rows for each in row.off}
        rows = [row for row in self.rows if able == set(row.off) and load_N in (None, row.load_N)]
        if tyre not in able or not rows:
            return None
        return 100 * sqrt(sum(row.off[tyre] ** 2 for row in rows) / len(rows))


def compare(
    case: LoadedCase,
    evaluator: Evaluator,
    readings: Sequence[Measurement],
    tyres: Mapping[str, Values],
) -> UnderLoad:
    """Each tyre (name to values of the case's numbers) pressed at the measured pressures and loads.

    The rim of a pressed tyre is held; for modes it is as the case's ``road.wheel`` has it. The same
    measured several times counts as its mean.
    """
    rows: list[LoadedRow] = []
    failed: dict[str, None] = {}
    for pressure, here in _grouped(readings):
        places = sorted(here, key=lambda place: (place[2], place[0], str(place[1] or "")))
        tables: dict[str, dict[LoadedKey, float]] = {}
        for name, values in tyres.items():
            tables[name] = {}
            for part in (_footprints, _modes):
                try:  # what comes before a failure is kept
                    inflated = {**values, "pressure_kPa": pressure}
                    tables[name].update(part(case, evaluator, inflated, places))
                except (EvaluationFailed, DeckRefused, TemplateFailed) as failure:
                    failed[f"{name}, {pressure:g} kPa: {failure}"] = None
        for place in places:
            quantity, member, load = place
            value, sigma = here[place]
            known = {name: table[place] for name, table in tables.items() if place in table}
            off = {name: log(value / computed) for name, computed in known.items()}
            rows.append(LoadedRow(quantity, member, pressure, load, value, sigma, off))
    return UnderLoad(tuple(rows), tuple(tyres), tuple(failed))


def _grouped(
    readings: Sequence[Measurement],
) -> Iterator[tuple[float, dict[LoadedKey, tuple[float, float]]]]:
    """Mean and its standard deviation by place, grouped by pressure."""
    every: defaultdict[float, defaultdict[LoadedKey, list[Measurement]]]
    every = defaultdict(lambda: defaultdict(list))
    for each in readings:
        member = Member(each.label, each.member) if each.label else None
        every[each.pressure_kPa][each.quantity, member, each.load_N].append(each)
    for pressure, places in sorted(every.items()):
        yield pressure, {place: _mean(same) for place, same in places.items()}


def _mean(same: Sequence[Measurement]) -> tuple[float, float]:
    variance = sum(each.sigma**2 for each in same)
    return sum(each.value for each in same) / len(same), sqrt(variance) / len(same)


def _footprints(
    case: LoadedCase, evaluator: Evaluator, values: Values, places: Sequence[LoadedKey]
) -> Iterator[tuple[LoadedKey, float]]:
    """Computed quantities of the footprint at their loads."""
    wanted = [place for place in places if place[1] is None]
    loads = sorted({load for _, _, load in wanted})
    if not loads:
        return
    pressed = evaluator.of(TyreDesign(case)).press(values, loads)
    mesh = TyreDesign(case, values).tyre.mesh
    rows = {each.load_N: footprint_row(pressed, each, mesh) for each in pressed.footprints}
    for quantity, member, load in wanted:
        if load in rows:
            yield (quantity, member, load), rows[load][FOOTPRINT_QUANTITIES[quantity].row]
    if pressed.failed:
        raise pressed.failed


def _modes(
    case: LoadedCase, evaluator: Evaluator, values: Values, places: Sequence[LoadedKey]
) -> Iterator[tuple[LoadedKey, float]]:
    """Computed frequencies (Hz) of modes under load."""
    wanted = [place for place in places if place[1]]
    loads = sorted({load for _, _, load in wanted})
    if not loads:
        return
    labels: list[Label] = sorted({member.label for _, member, _ in wanted if member}, key=str)
    case = asked_for(case, labels)
    (outcome,) = load_tyres(case, evaluator.of(TyreDesign(case)), {"": values}, loads).values()
    if isinstance(outcome, EvaluationFailed):
        raise outcome
    at = {
        (each.load_N, mode.member): mode.frequency_Hz
        for each in outcome.loads
        for mode in each.modes
    }
    for quantity, member, load in wanted:
        if member and (load, member) in at:
            yield (quantity, member, load), at[load, member]
    if outcome.failed:
        raise outcome.failed
