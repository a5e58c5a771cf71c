"""Sensitivities to all numbers of a case, and the numbers worth freeing: sensitivities.json."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pydantic import Field

from ...errors import InputError
from ...measured.targets import in_states, readings_of
from ...simulate.modes.label import FAMILIES, Label, in_words
from ...tyre.case import LoadedCase
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ..inference.run_estimate import model_of, selection_runs
from ..inference.section_fields import known_from
from ..result import Cell, Column, CsvRow, Result, ResultPart, StudyInput, Table, csv_text
from ..run_plan import PlannedState, RunPlan, plan_evaluations, plan_runs
from .deviations import deviations, measured_values
from .selection import CHANCE, Candidates, likeliest_shifts, select_numbers
from .table import FREQUENCY_KIND, Sensitivity, kinds_of, loads_of, sensitivities

MIN_SENSITIVITY_SHOWN = (
    0.005  # of a sensitivity: numbers below in all columns are in the CSV file only
)
MAX_NUMBERS_SHOWN = 20  # numbers in a table, the most influential ones


class FreedNumber(ResultPart):
    """A number that the selection frees."""

    name: str  # name of the uncertainty
    sets: list[str]  # paths that it sets
    gain: float  # fall of chi2 by freeing it after the others
    p_value: float  # probability of a gain so large by chance, with the choice counted
    shift_in_sd: float  # likeliest shift in standard deviations, with the others that are freed
    alike: list[str]  # uncertainties that these data do not distinguish from it


class UncertainNumber(ResultPart):
    """An uncertain number with all of them free, as ``constants`` of a diagnosis."""

    name: str  # name of the uncertainty
    sets: list[str]  # paths that it sets
    shift_in_sd: float  # likeliest shift in standard deviations


class Selection(ResultPart):
    """Which numbers, freed within what is known of them, reduce the deviations most."""

    chi2: float  # chi2 of the deviations after the variables are fitted
    chi2_left: float  # chi2 with the numbers that are freed
    chi2_exact_section: float  # chi2 if the section were exact
    freedom: int  # degrees of freedom
    known_from: str  # source of the section
    steps: list[FreedNumber]  # numbers to free, in this order
    next_name: str | None  # the best number that is not freed
    next_p_value: float  # probability of its gain by chance
    numbers: list[UncertainNumber]  # uncertain numbers with all of them free
    left_out: list[str] = Field(default=[])  # measurements that are not used


class SensitivitiesResult(Result):
    """sensitivities.json"""

    study, stem, heading = "sensitivities", "sensitivities", "Sensitivities"
    figures = "tyrecal.report.sensitivities:figures"
    is_seldom = follows_fit = True

    design: str  # name of the design: initial, fitted or set
    number_values: dict[str, float]  # values of the numbers by name, in their own units
    quantity_values: dict[str, float]  # values of the quantities, in the units of their names
    rows: list[Sensitivity]  # sensitivities
    unmoved: list[str] = Field(default=[])  # numbers that move nothing
    # numbers without a sensitivity, and why
    without_sensitivity: dict[str, str] = Field(default={})
    selection: Selection | None = None  # numbers to free
    selection_unknown: str = ""  # why there is none, though the case's targets are in a file

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        by: Sequence[str] = (),
        of: Sequence[str] = (),
        loads_N: Sequence[float] | None = None,
        measured: Path | None = None,
    ) -> SensitivitiesResult:
        """Sensitivities of the last design by the numbers ``by`` (none: all) of the kinds of
        quantities ``of`` (none: frequencies). With a measured file, given or the case's own, the
        numbers worth freeing too."""
        case, loads = given.case, loads_on_road(given.case, of, loads_N)
        design, values = list(given.designs.items())[-1]
        table = sensitivities(case, given.evaluator, values, by, of, loads, given.jobs)
        file, unknown = measured or case.measured, ""
        if case.measured and not measured:
            try:
                measured_values(case, case.measured)
            except InputError as error:
                file, unknown = None, str(error)
        result = cls(
            format=1,
            design=design,
            number_values=dict(table.numbers),
            quantity_values=dict(table.quantities),
            rows=table.rows,
            unmoved=table.unmoved,
            without_sensitivity=dict(table.refused),
            selection=select(given, file) if file else None,
            selection_unknown=unknown,
        )
        return given.stamped(result, measured=[file] if file else [], load_N=loads or 0.0)

    def quantities(self) -> dict[str, float]:
        return {f"sensitivity {row.quantity} by {row.by}": row.value for row in self.rows}

    def csv(self) -> str:
        return csv_text(list(Sensitivity.model_fields), (row.model_dump() for row in self.rows))

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """The steps of the selection, and all uncertain numbers."""
        if not self.selection:
            return {}
        steps: list[CsvRow] = [each.model_dump() for each in self.selection.steps]
        numbers: list[CsvRow] = [each.model_dump() for each in self.selection.numbers]
        return {"selection": steps, "uncertain": numbers}

    def by_number(self) -> dict[str, dict[str, Sensitivity]]:
        """Rows by number and quantity, the most influential number first."""
        table: dict[str, dict[str, Sensitivity]] = {}
        for row in self.rows:
            table.setdefault(row.by, {})[row.quantity] = row
        largest = {by: max(abs(each.value) for each in own.values()) for by, own in table.items()}
        return {by: table[by] for by in sorted(table, key=lambda by: -largest[by])}

    def tables(self) -> list[Table]:
        groups: dict[str, list[str]] = {family: [] for family in FAMILIES}
        for quantity in self.quantity_values:
            groups.setdefault(family_of(quantity), []).append(quantity)
        tables = [self._table(title, names) for title, names in groups.items() if names]
        return [*tables, *([self._steps(self.selection)] if self.selection else [])]

    def _table(self, title: str, quantities: Sequence[str]) -> Table:
        """Numbers by quantities of one kind."""
        columns = [Column("number", ""), *(Column(heading_of(each), ".3f") for each in quantities)]
        rows: list[list[Cell]] = []
        for own in self.by_number().values():
            cells = [own[each].value for each in quantities]
            if (
                max(map(abs, cells)) < MIN_SENSITIVITY_SHOWN
                and len(self.number_values) > MAX_NUMBERS_SHOWN
            ):
                continue
            rows.append(
                [
                    named(own[quantities[0]]),
                    *(columns[-1].cell(round(each, 3) + 0.0) for each in cells),
                ]
            )
        hidden = len(self.number_values) - len(self.unmoved) - len(rows[:MAX_NUMBERS_SHOWN])
        caption = "d ln q / d ln x" + f"; {hidden} numbers are in sensitivities.csv only" * bool(
            hidden
        )
        return Table(columns, rows[:MAX_NUMBERS_SHOWN], title, caption)

    def _steps(self, selection: Selection) -> Table:
        columns = [
            Column("freed", ""),
            gain := Column("gain in chi2", ".1f"),
            p_value := Column("chance", ".2g"),
            shift := Column("shift, std. dev.", "+z.2f"),
            Column("not distinguished from it", ""),
        ]
        rows = [
            [
                each.name,
                gain.cell(each.gain),
                p_value.cell(each.p_value),
                shift.cell(each.shift_in_sd),
                ", ".join(each.alike) or "none",
            ]
            for each in selection.steps
        ]
        if selection.next_name:
            last = [f"stop: {selection.next_name}", None, p_value.cell(selection.next_p_value)]
            rows.append([*last, None, None])
        caption = (
            "gain: after the others are freed; chance: probability that the best of all numbers"
            " gains as much by chance"
        )
        return Table(columns, rows, "Numbers to free", caption, "selection")

    def sentences(self) -> list[str]:
        sentences = []
        if self.unmoved:
            sentences.append(f"No quantity depends on {', '.join(self.unmoved)}.")
        for name, why in self.without_sensitivity.items():
            sentences.append(f"{name} has no sensitivity: {why}.")
        if self.selection_unknown:
            sentences.append(f"No numbers are selected to free: {self.selection_unknown}.")
        return sentences + (selection_words(self.selection) if self.selection else [])

    def summary(self) -> list[str]:
        return selection_words(self.selection)[:1] if self.selection else []


def loads_on_road(
    case: LoadedCase, of: Sequence[str], loads_N: Sequence[float] | None
) -> list[float]:
    """Loads of the quantities ``of`` on the road, N; none where there is no such quantity. Raises
    InputError."""
    if FOOTPRINT_QUANTITIES.keys().isdisjoint(kinds_of(of)):
        return []
    return list(loads_N or loads_of(case))


def planned(
    given: StudyInput, names: Sequence[str], loads_N: Sequence[float], measured: Path | None
) -> RunPlan:
    """How often the solver runs, before it does; about how often, where a file of measurements is
    fitted before numbers are selected."""
    case, evaluator, values = given.case, given.evaluator, [*given.designs.values()][-1]
    plan = plan_evaluations(case, evaluator, [values], len(names), given.jobs)
    if loads_N:
        road = PlannedState(len(loads_N), sensitivities=len(names))
        pressed = plan_runs(case, evaluator, [*plan.states, road], 1, given.jobs)
        plan = replace(pressed, starts=plan.starts)
    if not measured:
        return plan
    readings = in_states(case, readings_of(case, measured))
    runs = selection_runs(model_of(case, evaluator, readings))
    return replace(plan, starts=plan.starts + runs, is_estimate=True)


def family_of(quantity: str) -> str:
    """The table of a quantity: the family of a mode, or what it is."""
    kind, _, where = quantity.partition(" ")
    if kind != FREQUENCY_KIND:
        return "other quantities"
    c, m = map(int, re.findall(r"\d+", where)[:2])
    return Label(c, m, where.partition(" ")[2] or None).family or "overtones"


def named(row: Sensitivity) -> str:
    """The number of a row, and the unit per which its sensitivity is stated."""
    return f"{row.by}, per {row.per}" if row.per else row.by


def heading_of(quantity: str) -> str:
    """A quantity as the heading of a column."""
    kind, _, where = quantity.partition(" ")
    return in_words(where) if kind == FREQUENCY_KIND else quantity


def selection_words(selection: Selection) -> list[str]:
    """Sentences on the numbers to free, the gain, and why there are no more."""
    names = [each.name for each in selection.steps]
    chi2 = f"chi2 {selection.chi2:.4g} with {selection.freedom} degrees of freedom"
    if names:
        words = f"Free {', '.join(names)}: {chi2} falls to {selection.chi2_left:.4g}."
        words += f" Run 'tyrecal fit' with --free {','.join(names)}."
    else:
        words = f"Free no number: no gain is better than chance at {100 * CHANCE:.0f} % ({chi2})."
    sentences = [words]
    if selection.chi2_exact_section > 1.5 * selection.chi2:
        sentences.append(
            f"The section is known from {selection.known_from} and cannot be freed: it counts as"
            f" scatter. With an exact section chi2 would be {selection.chi2_exact_section:.4g}."
        )
    return sentences + [f"Not used: {each}." for each in selection.left_out]


def select(given: StudyInput, measured: Path) -> Selection:
    """The numbers to free, by a file of measurements. Raises as `deviations`."""
    left = deviations(given.case, given.evaluator, measured, given.jobs)
    chosen = select_numbers(Candidates.of(left.r, left.covariance, left.G))
    shifts = likeliest_shifts(left.r, left.covariance, left.G)
    names = [source.name for source in left.numbers]
    sets = [list(source.steps) for source in left.numbers]
    return Selection(
        chi2=chosen.chi2,
        chi2_left=chosen.chi2_left,
        chi2_exact_section=left.chi2_exact_section,
        freedom=left.freedom,
        known_from=known_from(given.case),
        steps=[
            FreedNumber(
                name=names[each.place],
                sets=sets[each.place],
                gain=each.gain,
                p_value=each.p_value,
                shift_in_sd=each.shift,
                alike=[names[k] for k in each.alike],
            )
            for each in chosen.numbers
        ],
        next_name=None if chosen.next_place is None else names[chosen.next_place],
        next_p_value=chosen.next_p_value,
        numbers=[
            UncertainNumber(name=name, sets=paths, shift_in_sd=float(shift))
            for name, paths, shift in zip(names, sets, shifts, strict=True)
        ],
        left_out=list(left.left_out),
    )
