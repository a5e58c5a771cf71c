"""Result of a fit: fit.json, fit.csv, and its tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from ...files import Json
from ...measured.measurement import Measurement
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.label import Label
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ...tyre.number_units import unit_of
from ...tyre.state import AS_THE_CASE
from ...tyre.values import with_values
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
    Named,
    PositiveNumber,
    Result,
    ResultPart,
    StudyInput,
    Table,
    csv_text,
    in_lines,
    state_words,
)
from .judge import judge
from .prediction import AtBound, FitResponses
from .problem import Point, Problem
from .responses import FitResponse
from .search import projected_gradient
from .states import next_states, plain, state_reports
from .targets import KNOWLEDGE, objective_unit
from .total_error import TotalError, total_error
from .uncertainty import FitUncertainty, uncertainty
from .verdict import DOES_NOT_FIT, NOT_JUDGED, FitReason, FitVerdict, does_not_fit_words

FIT_STUDY = "tyrecal.studies.fit.study:FitStudy"  # not imported by who reads results
MIN_STEP = 1e-6  # of a scaled variable, below which the fit did not move
NEAR_BEST_HZ = 0.05  # of the objective: the fit could have ended there
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


@dataclass
class StartReport:
    """One start of a fit: where it began and ended."""

    initial: dict[str, float]
    point: Point
    message: str  # the optimiser's own words
    converged: bool
    history: list[Json]  # one entry an evaluation


class FittedVariable(ResultPart):
    """A design variable."""

    initial: float  # value before the fit
    value: float  # fitted value
    lower: float  # lower bound
    upper: float  # upper bound
    # standard error by the scatter of the measurement; null: not determined
    standard_error: float | None
    # standard error by all that is uncertain; null: not known
    standard_error_total: float | None = None
    # whether the total is small enough for a linear estimate, with no bound near
    total_holds: bool = True
    # with a prior: share of the variance known before that the data took away
    explained_by_data: float | None = None
    # shares of the total variance by cause, 1 together
    variance_by_cause: dict[str, float] = Field(default={})
    at_bound: bool  # whether the value is at a bound
    unit: str = ""  # unit of the number that it sets

    def percent(self, error: float | None) -> str | None:
        """A standard error in per cent of the value: two digits, and never 1.9e+02."""
        if error is None or not self.value:
            return None
        percent = abs(100 * error / self.value)
        return f"{percent:.0f}" if percent >= 10 else f"{percent:.2g}"


class FreedNumberFit(ResultPart):
    """A number that the fit freed: the knowledge of it, and how far it moved."""

    known: float  # value that was known before
    standard_deviation: float  # standard deviation of it, in the same unit
    shift_in_sd: float  # how far the fit moved it, in standard deviations
    numbers: dict[str, float]  # fitted values by path: the number, and others that move with it


class FittedState(ResultPart):
    """A state, as `TyreState` with nothing left to the case: what its values add, as standard
    errors of a fit without it; of one that was not measured, what they would be with it."""

    pressure_kPa: float
    load_N: float
    rim: str
    values: int = 0  # measured values in this state
    rms_sigmas: float | None = None  # rms of their deviations, in standard deviations
    # standard errors of the variables without this state
    standard_errors_without: dict[str, float | None] = Field(default={})
    # standard errors of the variables with it
    standard_errors_with: dict[str, float | None] = Field(default={})
    ratio: float | None = None  # mean ratio of the standard errors with it to those without

    @property
    def display(self) -> str:
        """State in words."""
        return state_words(self.pressure_kPa, self.load_N, self.rim)


class FittedMode(Named):
    """A mode that has a target; in a fit over several states, its own."""

    multiplicity: int  # 2: a pair of modes
    initial_Hz: PositiveNumber  # frequency before the fit
    fitted_Hz: PositiveNumber  # frequency after the fit
    target_Hz: PositiveNumber  # measured frequency
    deviation_percent: float  # fitted over measured, less 1
    sigma_Hz: float | None = None
    damping_ratio: float | None = None  # damping of the fitted tyre, fraction of critical damping
    target_damping_ratio: float | None = None  # measured damping
    pressure_kPa: float | None = None
    load_N: float = 0.0
    rim: str | None = None
    symmetry: str | None = None

    @property
    def state(self) -> str:
        """State in words; "" in a fit to one."""
        if self.pressure_kPa is None:
            return ""
        return state_words(self.pressure_kPa, self.load_N, self.rim or "")

    def named(self) -> list[str]:
        """The cells of `NAME_COLUMNS`."""
        name, motion = super().named()
        return [f"{name} {self.symmetry or ''}".rstrip(), motion]


class FittedFootprint(ResultPart):
    """A target on the road that is no mode, or the mass, SI."""

    load_N: float = 0.0
    # measured quantity
    quantity: Literal[
        "contact_area_m2",
        "contact_length_m",
        "contact_width_m",
        "vertical_stiffness_N_per_m",
        "mass_kg",
    ]
    initial: float  # value before the fit, SI
    fitted: float  # value after the fit
    target: float  # measured value
    sigma: float | None = None  # standard deviation of the measured value
    deviation_percent: float  # fitted over measured, less 1
    pressure_kPa: float | None = None
    rim: str | None = None

    @property
    def state(self) -> str:
        """State in words, of the mass none; in a fit to one state the load."""
        if self.quantity == "mass_kg":
            return ""
        if self.pressure_kPa is None:
            return f"{self.load_N:g} N"
        return state_words(self.pressure_kPa, self.load_N, self.rim or "")


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


def fit_result(
    problem: Problem,
    initial: Point,
    reports: Sequence[StartReport],
    history: Sequence[Json],
    replaced: int,
    method: str,
    readings: Sequence[Measurement] = (),
) -> FitResult:
    """The result of a fit, that of its best start; ``replaced``: drawn starts that could not be
    evaluated; ``readings``: lines of the file that the targets are from."""
    best = min(reports, key=lambda report: report.point.objective)
    point = best.point.plain
    objectives = [row["objective_Hz"] for row in history]
    known = uncertainty(problem, point)
    names = [v.name for v in problem.variables]
    several = {t.state.unloaded for t in problem.measured} != {AS_THE_CASE}
    several = several or any(t.member for t in problem.road)
    others = _others(problem, initial, point, several)
    pressed = [each for each in others if each.quantity != "mass_kg"]
    mass = [each for each in others if each.quantity == "mass_kg"]
    moved = float(abs(point.x - initial.x).max()) > MIN_STEP
    total = _total_error(problem, point, known)
    correlations = known.correlations
    if problem.spread is not None and isinstance(total, TotalError):  # of the posterior
        sd = np.sqrt(np.diag(total.of_coordinates))
        correlations = total.of_coordinates / np.outer(sd, sd)
    good = best.converged and moved
    covariance = None if isinstance(total, str) else total.of_values
    judged = judge(problem, point, known, covariance, good, readings)
    sets = problem.case.case.variables
    fixed_units = {name: unit_of(sets[name].sets[0]) for name in problem.fixed if name in sets}
    content = {
        "format": 1,
        "method": method,
        **({} if problem.spread is None else {"prior": True}),
        "pressure_kPa": with_values(problem.case, point.values).case.pressure_kPa,
        "mass_kg": point.mass_kg,
        "objective_Hz": point.objective,
        "objective_unit": objective_unit(problem.case),
        "initial_objective_Hz": initial.plain.objective,
        "evaluations": len(history),
        "evaluations_to_0.05_Hz": next(
            i
            for i, f in enumerate(objectives, start=1)
            if f is not None and f < point.objective + NEAR_BEST_HZ
        ),
        "gradient_evaluations": sum(f is not None for f in objectives),
        "failed_evaluations": sum(f is None for f in objectives),
        "converged": best.converged,
        "moved": moved,
        "verdict": judged.verdict,
        "chi2_per_dof": judged.chi2_per_dof,
        "reason": judged.reason,
        "message": best.message,
        "projected_gradient_norm": projected_gradient(problem, best.point),
        "label_margin": point.clarity,
        "variables": _variables(problem, initial, point, known, total, judged.chi2_per_dof),
        "fixed": dict(problem.fixed),
        **({"fixed_units": fixed_units} if fixed_units else {}),
        **({"freed": _freed(problem, point)} if problem.freed else {}),
        "modes": _modes(problem, initial, point, several),
        **({"footprint": pressed} if pressed else {}),
        **({"mass": mass[0]} if mass else {}),
        **(_states(problem, point, known) if several else {}),
        "noise_Hz": known.noise_Hz,
        **(
            {"total_error_unknown": total}
            if isinstance(total, str)
            else {"responses": [] if problem.freed or problem.damping else total.responses}
        ),
        "correlations": {
            a: {b: _finite(correlations[i, j]) for j, b in enumerate(names)}
            for i, a in enumerate(names)
        },
        "singular_values": [float(s) for s in known.singular_values],
        "starts": [
            {
                "initial": r.initial,
                "objective_Hz": r.point.objective,  # what is minimised: with a prior, F of `prior`
                "converged": r.converged,
                "evaluations": len(r.history),
                "message": r.message,
                "values": dict(r.point.values),
            }
            for r in reports
        ],
        "replaced_starts": replaced,
    }
    return FitResult.model_validate(content)


def _total_error(problem: Problem, point: Point, known: FitUncertainty) -> TotalError | str:
    """The total uncertainty of the variables, or why it is not known."""
    try:
        return total_error(problem, point, known)
    except Exception as error:  # the fit has ended: what only comes after it must not lose it
        if isinstance(error, (ValueError, EvaluationFailed)):
            return str(error)
        return f"{type(error).__name__}: {error}"


def _variables(
    problem: Problem,
    initial: Point,
    point: Point,
    known: FitUncertainty,
    total: TotalError | str,
    chi2_per_dof: float | None,
) -> dict[str, FittedVariable]:
    variables = {}
    more = {} if isinstance(total, str) else total.by_variable(problem, point, chi2_per_dof)
    is_free = problem.is_free(point.x)
    for i, v in enumerate(problem.variables):
        variables[v.name] = FittedVariable(
            initial=initial.values[v.name],
            value=point.values[v.name],
            lower=problem.case.case.variables[v.name].lower,
            upper=problem.case.case.variables[v.name].upper,
            standard_error=known.standard_errors[i],
            **more.get(v.name, {}),
            at_bound=not is_free[i],
            unit=unit_of(problem.case.case.variables[v.name].sets[0]),
        )
    return variables


def _freed(problem: Problem, point: Point) -> dict[str, FreedNumberFit]:
    """The numbers that were freed."""
    return {
        name: FreedNumberFit(
            known=each.start,
            standard_deviation=each.sd,
            shift_in_sd=each.in_sd(point.values[name]),
            numbers=dict(zip(each.sets, each.numbers(point.values[name]), strict=True)),
        )
        for name, each in problem.freed.items()
    }


def _modes(problem: Problem, initial: Point, point: Point, several: bool) -> list[FittedMode]:
    """Modes of the unloaded tyre, then those on the road."""
    result = []
    for target in problem.targets:
        before, after = (p.states[target.state][target.label] for p in (initial, point))
        hertz = (before.frequency_Hz, after.frequency_Hz, target.frequency_Hz)
        of = _mode(target.label, after.multiplicity, hertz)
        own = plain(problem, target.state) | {"sigma_Hz": target.sigma_Hz}
        ratios = after.raw.damping_ratio, target.damping_ratio
        known = zip(DAMPING_COLUMNS, ratios, strict=True)
        of |= {key: ratio for key, ratio in known if ratio is not None}
        result.append(FittedMode.model_validate(of | (own if several else {})))
    for i, road in enumerate(problem.road):
        if road.member:
            hertz = (float(initial.others[i]), float(point.others[i]), road.value)
            own = plain(problem, road.state) | {"symmetry": road.member.symmetry}
            of = _mode(road.member.label, 1, hertz) | own | {"sigma_Hz": road.sigma}
            result.append(FittedMode.model_validate(of))
    return result


def _mode(label: Label, multiplicity: int, hertz: tuple[float, float, float]) -> Json:
    """Entry of a mode; hertz: initial, fitted, target."""
    initial, fitted, target = hertz
    return {
        **asdict(label),
        "frequency_Hz": fitted,
        "multiplicity": multiplicity,
        "initial_Hz": initial,
        "fitted_Hz": fitted,
        "target_Hz": target,
        "deviation_percent": 100 * (fitted / target - 1),
    }


def _others(problem: Problem, initial: Point, point: Point, several: bool) -> list[FittedFootprint]:
    """All but modes."""
    result = []
    for i, target in enumerate(problem.others):
        if target.member or target.quantity == KNOWLEDGE:
            continue
        fitted = float(point.others[i])
        of = {
            "load_N": target.state.load_N,
            "quantity": target.quantity,
            "initial": float(initial.others[i]),
            "fitted": fitted,
            "target": target.value,
            "sigma": target.sigma,
            "deviation_percent": 100 * (fitted / target.value - 1),
        }
        if target.quantity == "mass_kg":
            del of["load_N"]
        elif several:
            of |= plain(problem, target.state)
        result.append(FittedFootprint.model_validate(of))
    return result


def _states(problem: Problem, point: Point, known: FitUncertainty) -> Json:
    """Entries of what each state adds, and of the states that would add most next."""
    measured = [
        {
            **plain(problem, each.state),
            "values": each.values,
            "rms_sigmas": each.rms_sigmas,
            "standard_errors_without": each.standard_errors_without,
        }
        for each in state_reports(problem, point, known)
    ]
    try:
        proposals = next_states(problem, point, known)
    except Exception as error:  # the fit has ended: what only comes after it must not lose it
        return {"states": measured, "next_states_error": f"{type(error).__name__}: {error}"}
    more = [
        {
            **plain(problem, each.state),
            "standard_errors_with": each.standard_errors_with,
            "ratio": each.ratio,
        }
        for each in proposals
    ]
    return {"states": measured, "next_states": more}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _percent_of(share: float | None) -> str | None:
    return None if share is None else f"{100 * share:.0f}"
