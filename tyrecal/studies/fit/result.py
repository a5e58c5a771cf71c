"""What a fit found: fit.json, fit.csv, and its tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import Field

from ...tyre.values import with_values
from ..result import (
    NAME_COLUMNS,
    Column,
    Deviation,
    Named,
    PositiveNumber,
    Result,
    ResultPart,
    Table,
    csv_text,
)
from . import slsqp
from .problem import Point, Problem, objective_unit
from .uncertainty import FitUncertainty, uncertainty

MIN_STEP = 1e-6  # of a scaled variable, below which the fit did not move, or is at a bound
NEAR_BEST_HZ = 0.05  # of the objective: the fit could have ended there
ROAD_QUANTITIES = {  # targets on the road
    "contact_area_m2": Column("contact area, cm²", ".1f", 1e4),
    "vertical_stiffness_N_per_m": Column("vertical stiffness, N/mm", ".1f", 1e-3),
}
HERTZ, RESULT_DIGITS = Column("Hz"), Column("", ".4g")


@dataclass
class StartReport:
    """One start of a fit: where it began and ended."""

    initial: dict[str, float]
    point: Point
    message: str  # the optimiser's own words
    converged: bool
    history: list[dict[str, Any]]


class FittedVariable(ResultPart):
    """A design variable."""

    initial: float
    value: float
    lower: float
    upper: float
    standard_error: float | None  # None: the data do not tell
    at_bound: bool

    @property
    def error_percent(self) -> str | None:
        """Two digits, and never 1.9e+02."""
        if self.standard_error is None or not self.value:
            return None
        percent = abs(100 * self.standard_error / self.value)
        return f"{percent:.0f}" if percent >= 10 else f"{percent:.2g}"


class FittedMode(Named):
    """A mode that has a target."""

    multiplicity: int
    initial_Hz: PositiveNumber
    fitted_Hz: PositiveNumber
    target_Hz: PositiveNumber
    deviation_percent: float


class FittedFootprint(ResultPart):
    """A target on the road, SI."""

    load_N: float
    quantity: Literal["contact_area_m2", "vertical_stiffness_N_per_m"]
    initial: float
    fitted: float
    target: float
    sigma: float | None = None
    deviation_percent: float


class FitResult(Result):
    """fit.json"""

    study, stem, heading = "fit", "fit", "Fit"

    method: str
    pressure_kPa: float
    mass_kg: float
    objective_Hz: float
    objective_unit: str = "Hz"  # or "sigma"
    initial_objective_Hz: float
    evaluations: int
    evaluations_to_best: int = Field(default=0, alias="evaluations_to_0.05_Hz")
    gradient_evaluations: int = 0
    failed_evaluations: int
    converged: bool
    moved: bool
    message: str
    projected_gradient_norm: float
    label_margin: float  # least clarity of a label
    variables: dict[str, FittedVariable]
    fixed: dict[str, float]
    modes: list[FittedMode]
    footprint: list[FittedFootprint] = Field(default=[])
    noise_Hz: float | None = None  # standard deviation of a frequency
    correlations: dict[str, dict[str, float | None]]
    singular_values: list[float]
    starts: list[dict[str, Any]]
    replaced_starts: int = 0

    @property
    def is_good(self) -> bool:
        """Whether it converged and moved."""
        return self.converged and self.moved

    def csv(self) -> str:
        keys = ["c", "m", "kind", "multiplicity", "initial_Hz", "fitted_Hz", "target_Hz"]
        keys.append("deviation_percent")
        if self.footprint:
            keys += ["load_N", "quantity", "initial", "fitted", "target", "sigma"]
        return csv_text(keys, (each.model_dump() for each in (*self.modes, *self.footprint)))

    def tables(self) -> list[Table]:
        in_hertz = self.objective_unit == "Hz"
        units = f"frequencies{' and objective' * in_hertz} in Hz"
        heads = [*NAME_COLUMNS, *map(Column, ("initial", "fitted", "target", "deviation %"))]
        rows: list[list[Any]] = [
            [
                *mode.named(),
                *map(HERTZ.cell, (mode.initial_Hz, mode.fitted_Hz, mode.target_Hz)),
                Deviation(mode.deviation_percent),
            ]
            for mode in self.modes
        ]
        for each in self.footprint:
            quantity = ROAD_QUANTITIES[each.quantity]
            figures = map(quantity.cell, (each.initial, each.fitted, each.target))
            off = Deviation(each.deviation_percent)
            rows.append([f"{each.load_N:g} N", quantity.name, *figures, off])
        words = "equation (1)" if in_hertz else "deviations in sigmas"
        objective = [f"{x:.3f}" for x in (self.initial_objective_Hz, self.objective_Hz)]
        caption = "; ".join(filter(None, (units, str(self.provenance or ""))))
        return [
            Table(heads, rows, caption=caption),
            self._variables(),
            Table((), [["objective", words, *objective, "", ""]]),
        ]

    def _variables(self) -> Table:
        heads = [Column("variable", ""), Column("", "")]
        heads += map(Column, ("initial", "fitted", "bounds", "std. err. %"))
        rows: list[list[Any]] = [
            [
                name,
                "at bound" if each.at_bound else "",
                *map(RESULT_DIGITS.cell, (each.initial, each.value)),
                f"{each.lower:g}..{each.upper:g}",
                each.error_percent,
            ]
            for name, each in self.variables.items()
        ]
        rows += [
            [name, "held", *map(RESULT_DIGITS.cell, (value, value)), None, None]
            for name, value in self.fixed.items()
        ]
        return Table(heads, rows)


def fit_result(
    problem: Problem,
    initial: Point,
    best: StartReport,
    reports: Sequence[StartReport],
    history: Sequence[dict[str, Any]],
    replaced: int,
    method: str,
) -> FitResult:
    """The result of a fit whose ``best`` start is one of ``reports``; ``replaced``: drawn starts
    that could not be evaluated."""
    point = best.point
    objectives = [row["objective_Hz"] for row in history]
    known = uncertainty(problem, point)
    names = [v.name for v in problem.variables]
    pressed = [
        {
            "load_N": target.load_N,
            "quantity": target.quantity,
            "initial": float(initial.footprint[i]),
            "fitted": float(point.footprint[i]),
            "target": target.value,
            "sigma": target.sigma,
            "deviation_percent": 100 * (float(point.footprint[i]) / target.value - 1),
        }
        for i, target in enumerate(problem.footprint)
    ]
    content = {
        "format": 1,
        "method": method,
        "pressure_kPa": with_values(problem.case, point.values).case.pressure_kPa,
        "mass_kg": point.mass_kg,
        "objective_Hz": point.objective,
        "objective_unit": objective_unit(problem.case),
        "initial_objective_Hz": initial.objective,
        "evaluations": len(history),
        "evaluations_to_0.05_Hz": next(
            i
            for i, f in enumerate(objectives, start=1)
            if f is not None and f < point.objective + NEAR_BEST_HZ
        ),
        "gradient_evaluations": sum(f is not None for f in objectives),
        "failed_evaluations": sum(f is None for f in objectives),
        "converged": best.converged,
        "moved": float(abs(point.x - initial.x).max()) > MIN_STEP,
        "message": best.message,
        "projected_gradient_norm": slsqp.projected_gradient(problem, point),
        "label_margin": point.clarity,
        "variables": _variables(problem, initial, point, known),
        "fixed": dict(problem.fixed),
        "modes": _modes(problem, initial, point),
        **({"footprint": pressed} if pressed else {}),
        "noise_Hz": known.noise_Hz,
        "correlations": {
            a: {b: _finite(known.correlations[i, j]) for j, b in enumerate(names)}
            for i, a in enumerate(names)
        },
        "singular_values": [float(s) for s in known.singular_values],
        "starts": [
            {
                "initial": r.initial,
                "objective_Hz": r.point.objective,
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


def _variables(
    problem: Problem, initial: Point, point: Point, known: FitUncertainty
) -> dict[str, FittedVariable]:
    variables = {}
    for i, v in enumerate(problem.variables):
        room = point.x[i] - problem.lower[i], problem.upper[i] - point.x[i]
        variables[v.name] = FittedVariable(
            initial=initial.values[v.name],
            value=point.values[v.name],
            lower=problem.case.case.variables[v.name].lower,
            upper=problem.case.case.variables[v.name].upper,
            standard_error=known.standard_errors[i],
            at_bound=bool(min(room) < MIN_STEP),
        )
    return variables


def _modes(problem: Problem, initial: Point, point: Point) -> list[FittedMode]:
    return [
        FittedMode(
            c=target.label.c,
            m=target.label.m,
            kind=target.label.kind,
            frequency_Hz=point.modes[target.label].frequency_Hz,
            multiplicity=point.modes[target.label].multiplicity,
            initial_Hz=initial.modes[target.label].frequency_Hz,
            fitted_Hz=(fitted := point.modes[target.label].frequency_Hz),
            target_Hz=target.frequency_Hz,
            deviation_percent=100 * (fitted / target.frequency_Hz - 1),
        )
        for target in problem.targets
    ]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
