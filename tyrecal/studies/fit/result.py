"""Result of a fit: fit.json, fit.csv, and its tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from ...files import Json
from ...simulate.modes.label import Label
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ...units import display_unit, printed_unit
from .. import named
from ..correlation import ShapeCorrelation
from ..fitted import NOT_CONVERGED
from ..labels import Labels
from ..result import (
    NAME_COLUMNS,
    Column,
    CsvRow,
    Deviation,
    Result,
    StudyInput,
    Table,
    csv_text,
    in_lines,
)
from .prediction import AtBound, FitResponse, FitResponses
from .result_parts import FittedFootprint, FittedMode, FittedState, FittedVariable, FreedNumberFit
from .verdict import DOES_NOT_FIT, NOT_JUDGED, FitReason, FitVerdict, does_not_fit_words

FIT_STUDY = "tyrecal.studies.fit.study:FitStudy"  # not imported by who reads results
ROAD_QUANTITIES = {  # targets that are no modes
    **{
        name: Column(f"{each.words}, {each.unit}", ".1f", each.per_SI)
        for name, each in FOOTPRINT_QUANTITIES.items()
    },
    "mass_kg": Column("mass, kg", ".2f"),
}
OTHER_RESIDUALS = (
    "A fit and a diagnosis leave different residuals: the fit weighs them by the measurement's"
    " scatter alone, the diagnosis also by the model's own error and the uncalibrated constants,"
    " and leaves what these explain."
)
BY_DATA = (
    "'by data' is the share of the variance known before that the data took away: at 0 % the value"
    " is the one that was known. Deviations are left where section, laws or constants explain them."
)
MAX_PROPOSED = 4  # states in a table
DAMPING_COLUMNS = {
    "damping_ratio": Column("damping %", ".2f", 100),
    "target_damping_ratio": Column("target %", ".2f", 100),
}
HERTZ = Column("Hz")


class FitResult(Result):
    """fit.json"""

    fits = True
    study, stem, heading = "fit", "fit", "Fit"
    part = "tyrecal.report.html.fit:part"
    figures = "tyrecal.report.convergence:figures"

    method: str  # slsqp or gauss-newton
    prior: bool = False  # whether what is known of variables and model entered the fit
    pressure_kPa: float
    mass_kg: float  # mass of the fitted tyre without its rim
    objective_Hz: float  # objective of the fitted design, in the unit of objective_unit
    objective_unit: str = "Hz"  # Hz, or sigma: standard deviations
    initial_objective_Hz: float  # objective of the case's design, in the same unit
    evaluations: int  # designs that were evaluated
    # evaluations until the objective was within 0.05 of the end
    evaluations_to_best: int = Field(default=0, alias="evaluations_to_0.05_Hz")
    gradient_evaluations: int = 0  # designs with sensitivities among them
    failed_evaluations: int  # designs without a solution
    converged: bool  # whether the optimiser converged
    moved: bool  # whether the variables moved
    verdict: FitVerdict = NOT_JUDGED  # whether the model fits the targets
    # chi2 per degree of freedom, by all that is uncertain; null: see verdict
    chi2_per_dof: float | None = None
    reason: FitReason | None = None  # the likeliest reason why values are off
    message: str  # the optimiser's own words
    projected_gradient_norm: float  # norm of the gradient within the bounds, 0 at an optimum
    label_margin: float  # least clarity of a label
    variables: dict[str, FittedVariable]  # fitted variables by name
    fixed: dict[str, float]  # variables that were held, with their values
    fixed_units: dict[str, str] = Field(default={})  # units of the numbers that these set
    # uncertain numbers that were fitted too, those among the variables
    freed: dict[str, FreedNumberFit] = Field(default={})
    modes: list[FittedMode]  # modes with a target
    footprint: list[FittedFootprint] = Field(default=[])  # targets on the road that are no modes
    mass: FittedFootprint | None = None  # the mass, if it is a target
    states: list[FittedState] = Field(default=[])  # states of a fit over several
    # states to measure next, the most telling first
    next_states: list[FittedState] = Field(default=[])
    next_states_error: str = ""  # why they could not be evaluated
    labels: Labels | None = None  # labels of frequencies that came without one
    # of the fitted tyre to measured shapes, where those were imported with the measurements
    shapes: list[ShapeCorrelation] = Field(default=[])
    noise_Hz: float | None = None  # standard deviation of a frequency
    total_error_unknown: str = ""  # why no variable has a total standard error
    # change of the variables with each measured value
    responses: list[FitResponse] = Field(default=[])
    correlations: dict[str, dict[str, float | None]]  # correlations of the variables
    singular_values: list[float]  # singular values of the sensitivities of the residuals
    # starts: initial, objective_Hz, converged, evaluations, message, values
    starts: list[Json]
    replaced_starts: int = 0  # drawn starts without a solution, replaced by others

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        measured: Path | None = None,
        fixed: Mapping[str, float] | None = None,
        free: Sequence[str] = (),
        method: str = "slsqp",
        starts: int = 1,
        seed: int = 0,
        prior: bool = False,
    ) -> FitResult:
        """Calibrate the variables, and uncertain numbers to ``free``, to the case's targets or to a
        file of measurements; prior: with what is known of them and of the model."""
        study = named(FIT_STUDY)(given.case, given.evaluator, measured, fixed, free, prior)
        result: FitResult = study.run(method, starts, seed, given.jobs).found
        return result

    @property
    def is_good(self) -> bool:
        """Whether it converged and moved."""
        return self.converged and self.moved

    def quantities(self) -> dict[str, float]:
        numbers = {"objective": self.objective_Hz, "mass_kg": self.mass_kg}
        numbers |= {f"variable {name}": each.value for name, each in self.variables.items()}
        for mode in self.modes:
            where = " ".join(filter(None, (str(mode.label), mode.symmetry, mode.state)))
            numbers[f"fitted_Hz {where}"] = mode.fitted_Hz
        for each in self.footprint:
            numbers[f"fitted_{each.quantity} {each.state}"] = each.fitted
        return numbers

    def shortfall(self) -> tuple[str, str] | None:
        if self.verdict == DOES_NOT_FIT and self.chi2_per_dof:
            return DOES_NOT_FIT, does_not_fit_words(self.chi2_per_dof, self.reason)
        if self.is_good:
            return None
        words = self.message if self.moved else "the fit did not move"
        return NOT_CONVERGED, f"not converged: {words}"

    def pass_on(self, given: StudyInput) -> None:
        values = self.fixed | {name: each.value for name, each in self.variables.items()}
        by_path = {path: x for each in self.freed.values() for path, x in each.numbers.items()}
        own = {name: values[name] for name in given.designs["initial"]}
        given.designs["fitted"] = own | by_path
        given.responses = FitResponses(
            responses=self.responses,
            chi2_per_dof=self.chi2_per_dof,
            prior=self.prior,
            variables={n: AtBound(at_bound=v.at_bound) for n, v in self.variables.items()},
        )

    def csv(self) -> str:
        keys = ["c", "m", "kind", "multiplicity", "initial_Hz", "fitted_Hz", "target_Hz"]
        keys += ["deviation_percent", *self._damping_columns]
        if self.others:
            keys += ["load_N", "quantity", "initial", "fitted", "target", "sigma"]
        if self.states:
            own = ["pressure_kPa", "load_N", "rim", "symmetry", "sigma_Hz"]
            keys += [key for key in own if key not in keys]
        rows = (*self.modes, *self.others)
        return csv_text(keys, (each.model_dump(exclude_unset=True) for each in rows))

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """Variables; what each state adds or would add; labels of frequencies without one."""
        tables: dict[str, list[CsvRow]] = {
            "variables": [
                *({"variable": name, **v.model_dump()} for name, v in self.variables.items()),
                *({"variable": name, "value": held} for name, held in self.fixed.items()),
            ],
            "states": [
                {**each.model_dump(exclude_unset=True), "measured": measured}
                for measured, states in ((True, self.states), (False, self.next_states))
                for each in states
            ],
        }
        return tables | ({"labels": self.labels.csv_rows()} if self.labels else {})

    def over_pressure(self) -> list[tuple[Label, float, float]]:
        """Label, kPa and Hz of the unloaded tyre's targets on the first one's rim."""
        return [
            (mode.label, mode.pressure_kPa or self.pressure_kPa, mode.target_Hz)
            for mode in self.modes
            if not mode.load_N and mode.rim == self.modes[0].rim
        ]

    @property
    def of_first_state(self) -> list[FittedMode]:
        """The modes whose shapes are kept: of a fit over several states those in the first."""
        return [mode for mode in self.modes if mode.state == self.modes[0].state]

    @property
    def others(self) -> list[FittedFootprint]:
        """All targets but modes."""
        return [*self.footprint, *([self.mass] if self.mass else [])]

    def tables(self) -> list[Table]:
        in_hertz = self.objective_unit == "Hz"
        words = "equation (1)" if in_hertz else "deviations in sigmas"
        objective = [f"{x:.3f}" for x in (self.initial_objective_Hz, self.objective_Hz)]
        return [
            self._side_by_side() if self.states else self._every_target(),
            self._variables(),
            Table((), [["objective", words, *objective, "", "", ""]]),
            *self._states(),
            *([self.labels.table()] if self.labels else []),
            *(each.table() for each in self.shapes),
        ]

    def sentences(self) -> list[str]:
        """How far freed numbers moved, and how far the standard errors hold."""
        moved = [f"{name} by {each.shift_in_sd:+z.2f}" for name, each in self.freed.items()]
        words = ", ".join(moved)
        freed = [f"Freed, in standard deviations of what is known: {words}."] if moved else []
        compared = [f"{words}." for each in self.shapes for words in each.sentences()]
        return freed + self._error_words() + compared

    def _error_words(self) -> list[str]:
        """How far the standard errors hold."""
        if self.total_error_unknown:
            return [
                "The standard errors hold only the scatter of the measurement. A total is not"
                f" known: {self.total_error_unknown}."
            ]
        shares: dict[str, list[float]] = {}
        for each in self.variables.values():
            for cause, share in each.variance_by_cause.items():
                shares.setdefault(cause, []).append(share)
        if not shares:
            return []
        cause, share = max(((c, float(np.mean(s))) for c, s in shares.items()), key=lambda x: x[1])
        return [
            "'std. err.' is the total by which a variable may be off: measurement, section,"
            " material laws and uncalibrated constants. 'scatter' is the share of the measurement"
            " alone: how far a repeated test would move it.",
            f"The largest part of the total is: {cause}, {100 * share:.0f} % of the variance on"
            " average.",
            *self._which_totals_hold(),
            BY_DATA if self.prior else OTHER_RESIDUALS,
        ]

    def _which_totals_hold(self) -> Iterator[str]:
        unsure = [name for name, each in self.variables.items() if not each.total_holds]
        if unsure:
            yield (
                f"The totals of {', '.join(unsure)} may be several times too small: they are"
                " linear, and large or next to a variable at its bound. These hold:"
                f" {'tyrecal sample' if self.prior else 'tyrecal fit --prior, tyrecal sample'}."
            )

    def numbers(self) -> list[Table]:
        """All targets of a fit over every target with its initial and measured value."""
        return [replace(self._every_target(), title="Every target")] if self.states else []

    def _every_target(self) -> Table:
        heads = [*NAME_COLUMNS, *map(Column, ("initial", "fitted", "target", "deviation %"))]
        heads[:0] = [Column("state", "")] * bool(self.states)
        damping = self._damping_columns
        heads += damping.values()
        rows: list[list[Any]] = [
            [
                *[mode.state] * bool(self.states),
                *mode.named(),
                *map(HERTZ.cell, (mode.initial_Hz, mode.fitted_Hz, mode.target_Hz)),
                Deviation(mode.deviation_percent),
                *(column.cell(getattr(mode, key)) for key, column in damping.items()),
            ]
            for mode in self.modes
        ]
        for each in self.others:
            quantity = ROAD_QUANTITIES[each.quantity]
            figures = map(quantity.cell, (each.initial, each.fitted, each.target))
            off = Deviation(each.deviation_percent)
            place = [each.state, ""] if self.states else [each.state]
            rows.append([*place, quantity.name, *figures, off, *[None] * len(damping)])
        in_hertz = self.objective_unit == "Hz"
        units = f"frequencies{' and objective' * in_hertz} in Hz"
        return Table(heads, rows, caption=self._caption(units))

    @property
    def _damping_columns(self) -> dict[str, Column]:
        """Columns of damping, where it is known of any mode or target."""
        return {
            key: column
            for key, column in DAMPING_COLUMNS.items()
            if any(getattr(mode, key) is not None for mode in self.modes)
        }

    def _side_by_side(self) -> Table:
        """Fitted values and their deviations from the targets, a column a state."""
        shown: dict[tuple[str, str], dict[str, Deviation]] = {}
        for mode in self.modes:
            name, motion = mode.named()
            off = Deviation(mode.deviation_percent, f"{mode.fitted_Hz:.2f}")
            shown.setdefault((name, motion), {})[mode.state] = off
        for each in self.others:
            quantity = ROAD_QUANTITIES[each.quantity]
            off = Deviation(each.deviation_percent, quantity.cell(each.fitted) or "")
            shown.setdefault((quantity.name, ""), {})[each.state] = off
        states = list(dict.fromkeys(state for row in shown.values() for state in row))
        heads = [*NAME_COLUMNS, *(Column(in_lines(state or "any state")) for state in states)]
        rows = [[*name, *(row.get(state) for state in states)] for name, row in shown.items()]
        words = "fitted values, frequencies in Hz, and their deviations from targets in %"
        return Table(heads, rows, caption=self._caption(words))

    def _caption(self, units: str) -> str:
        return "; ".join(filter(None, (units, str(self.provenance or ""))))

    def _states(self) -> list[Table]:
        """Tables of what each state adds and, below, of the states that would add most next."""
        if not self.states:
            return []
        own = {
            name: each.standard_error_total if self.prior else each.standard_error
            for name, each in self.variables.items()
        }
        heads = [Column("left out", ""), Column("values", "d"), Column("rms, sigmas")]
        heads += [Column(in_lines(f"{name}, std. err. %")) for name in own]
        rows: list[list[Any]] = [
            [each.display, f"{each.values}", heads[2].cell(each.rms_sigmas)]
            + [self._percent(n, each.standard_errors_without[n]) for n in own]
            for each in self.states
        ]
        rows.insert(0, ["nothing", "", "", *(self._percent(n, error) for n, error in own.items())])
        tables = [Table(heads, rows, title="What each state adds", csv="states")]
        if self.next_states:
            heads = [Column("added", ""), Column("errors become"), *heads[3:]]
            rows = [
                [each.display, f"{100 * (each.ratio or 0.0):.0f} %"]
                + [self._percent(n, each.standard_errors_with[n]) for n in own]
                for each in self.next_states[:MAX_PROPOSED]
            ]
            tables.append(
                Table(heads, rows, "Best state to measure next, for the same modes", csv="states")
            )
        return tables

    def _percent(self, name: str, error: float | None) -> str | None:
        """A standard error of a variable, as `FittedVariable.percent` has it."""
        return self.variables[name].percent(error)

    def _variables(self) -> Table:
        heads = [Column("variable", ""), Column("unit", "")]
        heads += map(Column, ("initial", "fitted", "bounds", "std. err. %", "scatter %"))
        heads += [Column("by data %")] * self.prior
        rows: list[list[Any]] = []
        for name, each in self.variables.items():
            unit, factor = display_unit(each.unit)
            numbers = each.initial, each.value, each.lower, each.upper
            initial, value, lower, upper = (f"{factor * x:.4g}" for x in numbers)
            rows.append(
                [
                    name,
                    ", ".join(filter(None, (printed_unit(unit), "at bound" * each.at_bound))),
                    *(initial, value, f"{lower} to {upper}"),
                    each.percent(each.standard_error_total),
                    each.percent(each.standard_error),
                    *[_percent_of(each.explained_by_data)] * self.prior,
                ]
            )
        for name, held in self.fixed.items():
            unit, factor = display_unit(self.fixed_units.get(name, ""))
            words = ", ".join(filter(None, (printed_unit(unit), "held")))
            rows.append([name, words, *[f"{factor * held:.4g}"] * 2, *[None] * (len(heads) - 4)])
        return Table(heads, rows, csv="variables")


def _percent_of(share: float | None) -> str | None:
    return None if share is None else f"{100 * share:.0f}"
