"""Frequencies and their slopes over the pressure: pressure_sweep.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, cast

import numpy as np
from pydantic import Field

from ..simulate.evaluate.evaluator import Evaluator
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.modes.label import Label
from ..tyre.case import LoadedCase
from .modes import mode_entry
from .pressure import PressureFindings, State, SweepOutcome, findings, sweep
from .pressure_range import PressureRange
from .result import (
    NAME_COLUMNS,
    Column,
    CsvRow,
    Failed,
    ModeEntry,
    Notify,
    PositiveNumber,
    Result,
    ResultPart,
    StudyInput,
    Table,
    csv_text,
    silent,
)
from .sweep import swept_labels

if TYPE_CHECKING:
    from .fit.prediction import FitResponses

FITTED = "fitted"  # name of the design that a fit found
QUANTILE_90 = 1.645  # standard deviations: 90 % are between -1.645 and 1.645
AROUND_THE_CASE = PressureRange(None, None, 12)


class PressureRow(ResultPart):
    """A design at a pressure."""

    design: str  # name of the design: initial, fitted or set
    pressure_kPa: PositiveNumber
    modes: list[ModeEntry]  # modes by rising frequency


class PressureSweep(Result):
    """pressure_sweep.json"""

    study, stem, heading = "sweep-pressure", "pressure_sweep", "Frequencies over pressure"
    part = "tyrecal.report.html.states:pressure_part"
    figures = "tyrecal.report.frequencies:figures"
    follows_fit = True

    slopes: str = ""  # how sensitivities were computed: exact, or differences
    designs: dict[str, dict[str, float]] = Field(default={})  # values of the variables by design
    rows: list[PressureRow]  # designs at pressures
    failed: list[Failed] = Field(default=[])  # pressures that were not reached
    standard_errors_unknown: str = ""  # why the fitted design has no standard errors
    findings: list[PressureFindings]  # findings on each design with two pressures or more

    @classmethod
    def run(
        cls, given: StudyInput, *, pressures_kPa: PressureRange | Sequence[float] = AROUND_THE_CASE
    ) -> PressureSweep:
        """Every design at every pressure, kPa."""
        case = given.case
        p = pressures_kPa.on(case) if isinstance(pressures_kPa, PressureRange) else pressures_kPa
        fit = cast("FitResponses | None", given.responses)
        result = run(case, given.evaluator, given.designs, p, given.jobs, fit=fit)
        return given.stamped(result, pressure_kPa=p)

    def quantities(self) -> dict[str, float]:
        return {
            f"frequency_Hz {row.design} {row.pressure_kPa:g} kPa {mode.label}": mode.frequency_Hz
            for row in self.rows
            for mode in row.modes
        }

    def csv(self) -> str:
        keys = ["design", "pressure_kPa", "c", "m", "kind", "multiplicity", "frequency_Hz"]
        keys += ["standard_error_Hz"] * self._has_errors
        rows = ({**row.model_dump(), **m.model_dump()} for row in self.rows for m in row.modes)
        return csv_text([*keys, "d_ln_f_d_ln_p"], rows)

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """The rise of every mode from the lowest to the highest pressure."""
        rise: list[CsvRow] = [
            {"design": each.design, "from_kPa": each.from_kPa, "to_kPa": each.to_kPa, **mode}
            for each in self.findings
            for mode in each.modes
        ]
        return {"rise": rise}

    @property
    def _has_errors(self) -> bool:
        return any(m.standard_error_Hz is not None for row in self.rows for m in row.modes)

    def tables(self) -> list[Table]:
        return [self._ends(each) for each in self.findings if each.modes]

    def _ends(self, findings: PressureFindings) -> Table:
        """Hz at both ends, rise, slopes at both ends, curvature."""
        low, high = f"{findings.from_kPa:g} kPa", f"{findings.to_kPa:g} kPa"
        slope = Column(high, ".3f")
        columns = [
            *NAME_COLUMNS,
            hertz := Column(f"Hz, {low}"),
            Column(high),
            rise := Column("rise Hz", "+z.2f"),
            share := Column("rise %", "+z.1f"),
            Column("slope"),
            slope,
            Column("curvature", ""),
        ]
        own = [row for row in self.rows if row.design == findings.design]
        first, last = ({mode.label: mode for mode in row.modes} for row in (own[0], own[-1]))
        rows = []
        for mode in findings.modes:
            label = Label(mode["c"], mode["m"], mode["kind"])
            ends = first[label], last[label]
            rows.append(
                [
                    *ends[0].named(),
                    *(_with_interval(hertz, end) for end in ends),
                    rise.cell(mode["rise_Hz"]),
                    share.cell(mode["rise_percent"]),
                    *(slope.cell(end.d_ln_f_d_ln_p) for end in ends),
                    mode["curvature"],
                ]
            )
        caption = f"sensitivity: d ln f / d ln p, at {findings.from_kPa:g} and {high}"
        if any(mode.standard_error_Hz is not None for mode in own[0].modes):
            caption += "; ±: 90 % interval of the tyre's own frequency"
        return Table(columns, rows, findings.design, caption, "rise")

    def numbers(self) -> list[Table]:
        tables = []
        for design in dict.fromkeys(row.design for row in self.rows):
            own = [row for row in self.rows if row.design == design]
            columns = [*NAME_COLUMNS, *(Column(f"{row.pressure_kPa:.5g}") for row in own)]
            modes = {mode.label: mode for row in own for mode in row.modes}
            hertz = [{mode.label: mode.frequency_Hz for mode in row.modes} for row in own]
            rows = [
                [*mode.named(), *(columns[-1].cell(each.get(label)) for each in hertz)]
                for label, mode in modes.items()
            ]
            tables.append(Table(columns, rows, f"{design}: Hz at each pressure, kPa"))
        return tables


def _with_interval(hertz: Column, mode: ModeEntry) -> str | None:
    """79.50 ± 1.2: the half width of the 90 % interval, where it is known."""
    error = mode.standard_error_Hz
    own = hertz.cell(mode.frequency_Hz)
    return own if error is None else f"{own} ± {QUANTILE_90 * error:.2g}"


def run(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    pressures_kPa: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
    fit: FitResponses | None = None,
) -> PressureSweep:
    """Every design at every pressure; with ``fit`` the standard errors of the design "fitted".
    Raises as ``sweep`` does, and the first failure where no pressure could be evaluated."""
    outcomes = sweep(case, evaluator, designs, pressures_kPa, jobs, notify)
    result = sweep_result(case, designs, outcomes)
    if fit and fit.responses and FITTED in designs:
        return _with_errors(result, case, evaluator, fit, jobs)
    return result


def _with_errors(
    result: PressureSweep, case: LoadedCase, evaluator: Evaluator, fit: FitResponses, jobs: int
) -> PressureSweep:
    """The result with standard errors of the fitted design's frequencies, or why it has none."""
    from .fit.prediction import predicted_errors  # late: not for those who read results

    own = [row for row in result.rows if row.design == FITTED]
    wanted = [(mode.label, row.pressure_kPa) for row in own for mode in row.modes]
    if not wanted:
        return result
    try:
        errors = predicted_errors(case, evaluator, result.designs[FITTED], fit, wanted, jobs)
    except (ValueError, EvaluationFailed) as failure:
        return result.model_copy(update={"standard_errors_unknown": str(failure)})
    known = dict(zip(wanted, errors.tolist(), strict=True))

    def with_error(mode: ModeEntry, pressure_kPa: float) -> ModeEntry:
        hertz = mode.frequency_Hz * known[mode.label, pressure_kPa]
        return mode.model_copy(update={"standard_error_Hz": hertz})

    rows = [
        row.model_copy(update={"modes": [with_error(m, row.pressure_kPa) for m in row.modes]})
        if row.design == FITTED
        else row
        for row in result.rows
    ]
    return result.model_copy(update={"rows": rows})


def sweep_result(
    case: LoadedCase, designs: Mapping[str, Mapping[str, float]], outcomes: Sequence[SweepOutcome]
) -> PressureSweep:
    """outcomes: of ``sweep``."""
    states = [each for each in outcomes if isinstance(each, State)]
    labels = swept_labels(case, (s.frequencies for s in states)) if states else []
    by_design = [[s for s in states if s.design == name] for name in designs]
    return PressureSweep(
        format=1,
        slopes="exact" if all(s.slopes is not None for s in states) else "differences",
        designs={name: dict(values) for name, values in designs.items()},
        rows=[row for each in by_design for row in _rows(each, labels)],
        failed=[each for each in outcomes if isinstance(each, Failed)],
        findings=[findings(each, labels) for each in by_design if len(each) > 1],
    )


def slopes(states: Sequence[State], labels: Sequence[Label]) -> dict[Label, list[float | None]]:
    """d ln f / d ln p per label at each state of one design: exact where the solver has slopes,
    else by differences of the logarithms over neighbouring pressures, of second order where there
    are three (None: there is but one)."""
    known = [state.slopes for state in states if state.slopes is not None]
    if len(known) == len(states):
        return {label: [each[label] for each in known] for label in labels}
    if len(states) == 1:
        return {label: [None] for label in labels}
    x = np.log([state.pressure_kPa for state in states])
    f = np.array([[state.frequencies[label] for label in labels] for state in states])
    table: np.ndarray = np.gradient(np.log(f), x, axis=0, edge_order=2 if len(states) > 2 else 1)
    return {label: table[:, i].tolist() for i, label in enumerate(labels)}


def _rows(states: Sequence[State], labels: Sequence[Label]) -> list[PressureRow]:
    """The rows of one design."""
    table = slopes(states, labels) if states else {}
    return [
        PressureRow(
            design=state.design,
            pressure_kPa=state.pressure_kPa,
            modes=[
                ModeEntry(**mode_entry(mode), d_ln_f_d_ln_p=table[mode.label][k])
                for mode in state.modes
                if mode.label in table
            ],
        )
        for k, state in enumerate(states)
    ]
