"""plan.json: what to measure, in which order, what that can find, and how well it determines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field

from ...units import in_engineers_units
from .. import named
from ..result import NAME_COLUMNS, Column, CsvRow, Named, Result, ResultPart, StudyInput, Table
from ..sensors import SensorPlace

Percent = Annotated[float, Field(ge=0)]
PLAN = "tyrecal.studies.plan.study:plan"  # not imported by those who read results
NOISE_PERCENT = 0.2  # standard deviation of every frequency where none is given
PLAN_STAGES = ("evaluate the tyre and each effect", "choose the measurements")
HALF_95 = 1.96  # half of a 95 % interval of a normal distribution, in standard deviations
LABELLED = 0.9  # share of drawn tests in which sensors must label a mode for it to count


class PlanStep(ResultPart):
    """A measurement of the plan."""

    what: Annotated[str, Column("measure", "")]  # measurement in words
    hours: Annotated[float, Column("hours", ".2f")]  # duration
    total_hours: Annotated[float, Column("in all", ".2f")]  # duration of the plan up to here
    # chance that an effect is found up to here, mean over the effects
    chance: Annotated[float, Column("chance of a find", ".2f")]
    # standard deviation of a frequency at the case's pressure up to here, rms over the modes
    predicted_percent: Annotated[float, Column("f ± %", ".2f")]


class PlannedEffect(ResultPart):
    """An effect of the catalogue, and what the plan shows of it."""

    id: Annotated[str, Column("effect", "")]  # id of the effect
    # chance that it is found after each step, over sizes from a fifth of its range
    chance: list[float]
    unit: str  # unit of its parameter
    base: float  # what the case has of it
    largest_lambda: Annotated[float, Column("largest lambda", ".0f")]  # detectability at full size
    detectable_from: float | None  # least change with lambda = 10; null beyond its range
    named_from: float | None  # least change with lambda = 25; null beyond its range
    similar: list[str]  # effects that the whole plan hardly tells from it

    @property
    def at_end(self) -> float:
        """Chance after the whole plan."""
        return self.chance[-1]

    def size(self, change: float | None) -> str:
        """A change as an engineer reads it."""
        return "-" if change is None else in_engineers_units(self.base + change, self.unit, 2)


class PlannedVariable(ResultPart):
    """A design variable before and after the plan, if no effect is there."""

    name: Annotated[str, Column("variable", "")]  # name of the variable
    before_percent: Annotated[Percent, Column("before ± %", ".1f")]  # standard deviation
    after_percent: Annotated[Percent, Column("after ± %", ".1f")]  # standard deviation


class PlannedMode(Named):
    """A frequency at the case's pressure before and after the plan, if no effect is there."""

    before_percent: Annotated[Percent, Column("before ± %", ".2f")]  # standard deviation
    after_percent: Annotated[Percent, Column("after ± %", ".2f")]  # standard deviation


class PlanResult(Result):
    """plan.json"""

    study, stem, heading = "plan", "plan", "Plan of a test"
    figures = "tyrecal.report.plan:figures"
    is_seldom = True

    noise_percent: float  # scatter of every frequency, one standard deviation
    step_hours: dict[str, float]  # assumed hours of each step in the laboratory
    steps: list[PlanStep]  # measurements in their order
    effects: list[PlannedEffect]  # effects, the likeliest find first
    false_alarm: float  # chance that an effect is found on a tyre that has none
    draws: int  # tyres drawn for each chance
    variables: list[PlannedVariable]  # variables of the case
    modes: list[PlannedMode]  # frequencies at the case's pressure
    sensors: list[SensorPlace] = Field(default=[])  # places of the sensors
    axes: str = ""  # directions that each sensor measures
    not_labelled: list[str] = Field(default=[])  # modes that these sensors do not distinguish

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        hours: float | None = None,
        sensors: int | None = None,
        pressures_kPa: Sequence[float] = (),
        noise_percent: float = NOISE_PERCENT,
        step_hours: Mapping[str, float] | None = None,
    ) -> PlanResult:
        """Plan a test of the case, of at most so many hours, with so many sensors."""
        noise, hours_by_step = noise_percent / 100, step_hours or {}
        result: PlanResult = named(PLAN)(given, hours, sensors, pressures_kPa, noise, hours_by_step)
        return given.stamped(result)

    @property
    def hours(self) -> float:
        """Duration of the plan."""
        return self.steps[-1].total_hours

    def quantities(self) -> dict[str, float]:
        numbers = {"hours": self.hours, "chance": self.steps[-1].chance}
        return numbers | {f"percent {each.name}": each.after_percent for each in self.variables}

    def csv_rows(self) -> Mapping[str, Sequence[CsvRow]]:
        steps = [each.model_dump() for each in self.steps]
        effects = [each.model_dump() for each in self.effects]
        return {"steps": steps, "effects": effects}

    def tables(self) -> list[Table]:
        steps = [[str(k), *each.cells()] for k, each in enumerate(self.steps, 1)]
        columns = [Column("step", ""), *PlanStep.columns().values()]
        sizes = [Column(name, "") for name in ("named from", "detectable from", "similar")]
        rows = [
            [
                each.id,
                f"{each.at_end:.2f}",
                each.size(each.named_from),
                each.size(each.detectable_from),
                ", ".join(each.similar),
            ]
            for each in self.effects
        ]
        heads = [Column("effect", ""), Column("chance"), *sizes]
        effects = Table(heads, rows, "Chance of a find, at the end")
        return [Table(columns, steps, "Measure in this order"), effects]

    def numbers(self) -> list[Table]:
        variables = [each.cells() for each in self.variables]
        modes = [[*each.named(), f"{each.frequency_Hz:.2f}", *each.cells()] for each in self.modes]
        named = [*NAME_COLUMNS, Column("Hz"), *PlannedMode.columns().values()]
        places = [each.cells() for each in self.sensors]
        tables = [
            Table([*PlannedVariable.columns().values()], variables, "Variables"),
            Table(named, modes, "Frequencies"),
        ]
        if places:
            tables.append(Table([*SensorPlace.columns().values()], places, "Sensors"))
        return tables

    def sentences(self) -> list[str]:
        sure = [each.id for each in self.effects if each.at_end >= 0.8]
        never = [each.id for each in self.effects if each.at_end < 0.2]
        hours = ", ".join(f"{name} {value:g}" for name, value in self.step_hours.items())
        words = [
            f"{len(self.steps)} measurements in {self.hours:.1f} h find an effect of the catalogue"
            f" with a chance of {self.steps[-1].chance:.2f} (sizes from a fifth of its range, mean"
            " over all effects)",
            f"found in 80 % or more: {', '.join(sure) or 'none'}",
            f"found in less than 20 %: {', '.join(never) or 'none'}",
            f"{round(self.draws * self.false_alarm)} of {self.draws} drawn tyres without an effect"
            f" are accused; a chance is the share of {self.draws} drawn tyres, known to ±"
            f" {HALF_95 * 0.5 / self.draws**0.5:.1g} or better (95 %)",
            "found means that 'tyrecal diagnose' gives the effect a probability of 0.9: stop as"
            " soon as it does",
            f"assumed hours: {hours}; assumed scatter {self.noise_percent:g} %",
        ]
        if self.sensors:
            words.append(f"{len(self.sensors)} sensors, each {self.axes}, at the places below")
        if self.not_labelled:
            words.append(f"not counted, the sensors confuse them: {', '.join(self.not_labelled)}")
        return words

    def page(self) -> str:
        """One page of Markdown, to print."""
        parts = ["# Plan of a test", *(f"* {each}." for each in self.sentences())]
        for table in [*self.tables(), *self.numbers()]:
            heads = [column.name for column in table.columns]
            lines = [
                heads,
                ["---"] * len(heads),
                *([str(c or "") for c in row] for row in table.rows),
            ]
            parts += ["", f"## {table.title}", "", *(f"| {' | '.join(line)} |" for line in lines)]
        return "\n".join(parts) + "\n"
