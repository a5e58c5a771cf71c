"""One evaluation, labelled: the content of modes.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ..errors import InputError
from ..files import Json
from ..simulate.evaluate.results import Evaluation
from ..simulate.modes.label import Label, Mode, labelled
from ..tyre.case import LoadedCase
from .result import (
    NAME_COLUMNS,
    CavityMode,
    Column,
    ModeEntry,
    Result,
    ResultPart,
    StudyInput,
    Table,
    csv_text,
)

if TYPE_CHECKING:
    from ..simulate.evaluate.evaluator import Evaluator

EXTRA = {  # further columns of the table, of fields of `ModeEntry`
    "measured_Hz": Column("measured"),
    "deviation_percent": Column("deviation %", "+z.2f"),
    "damping_ratio": Column("damping %", ".2f", 100),
    "sliding_Hz": Column("sliding, Hz"),
    "grip_mm": Column("grip, mm"),
    "symmetry": Column("symmetry", ""),
    "member": Column("member", ".0f"),
    "clarity": Column("clarity"),
    "overlap": Column("overlap"),
}


class ModesFindings(ResultPart):
    """Doubts about the names of modes under a load."""

    words: list[str] = Field(default=[])  # findings in words


class ModesResult(Result):
    """modes.json"""

    study, stem, heading = "modes", "modes", "Modes"
    part = "tyrecal.report.html.modes:part"

    pressure_kPa: float
    load_N: float
    mass_kg: float  # mass of the tyre without its rim
    variables: dict[str, float]  # values of the variables
    deflection_m: float | None = None  # deflection under the load
    modes: Annotated[list[ModeEntry], Field(min_length=1)]  # modes by rising frequency
    # first wave of the gas in the cavity of the tyre on the road
    cavity: list[CavityMode] = Field(default=[])
    findings: ModesFindings = ModesFindings()  # doubts about labels under a load

    @classmethod
    def run(cls, given: StudyInput) -> ModesResult:
        """Evaluate the initial design."""
        return given.stamped(run(given.case, given.evaluator, given.designs["initial"])[0])

    def compared(self, case: LoadedCase) -> ModesResult:
        """The result with the targets of ``case``, of the unloaded tyre in its own state, next to
        its modes. Raises InputError if it has none."""
        measured = {
            Label(target.c, target.m, target.kind): target.frequency_Hz
            for target in case.case.targets.modes
            if target.pressure_kPa is None and target.rim is None and not target.load_N
        }
        if not measured:
            raise InputError(
                f"no frequency of the unloaded tyre was measured at {self.pressure_kPa:g} kPa; give"
                " --pressure-kPa of one in the file"
            )
        modes = [
            mode.model_copy(
                update={
                    "measured_Hz": measured[mode.label],
                    "deviation_percent": 100 * (mode.frequency_Hz / measured[mode.label] - 1),
                }
            )
            if mode.label in measured
            else mode
            for mode in self.modes
        ]
        return self.model_copy(update={"modes": modes})

    def quantities(self) -> dict[str, float]:
        numbers = {"mass_kg": self.mass_kg}
        for mode in self.modes:
            member = f" member {mode.member}" if mode.member else ""
            numbers[f"frequency_Hz {mode.label}{member}"] = mode.frequency_Hz
            if mode.damping_ratio is not None:
                numbers[f"damping_ratio {mode.label}{member}"] = mode.damping_ratio
        return numbers

    def csv(self) -> str:
        rows = [each.model_dump() for each in self.modes]
        rows += [{"kind": f"cavity {each.direction}", **each.model_dump()} for each in self.cavity]
        known = (key for key in ModeEntry.model_fields if any(row.get(key) for row in rows))
        return csv_text(list(dict.fromkeys(["c", "m", "kind", *known])), rows)

    def tables(self) -> list[Table]:
        extra = [key for key in EXTRA if any(getattr(m, key) is not None for m in self.modes)]
        columns = [*NAME_COLUMNS, Column("Hz"), *(EXTRA[key] for key in extra)]
        rows = [
            [
                *m.named(),
                *(
                    c.cell(getattr(m, k))
                    for c, k in zip(columns[2:], ["frequency_Hz", *extra], strict=True)
                ),
            ]
            for m in self.modes
        ]
        gap = [None] * len(extra)
        rows += [[*c.named(), columns[2].cell(c.frequency_Hz), *gap] for c in self.cavity]
        load = f", {self.load_N:g} N" if self.load_N else ""
        title = f"{self.pressure_kPa:g} kPa{load}, {self.mass_kg:.2f} kg"
        return [Table(columns, rows, title, str(self.provenance or ""))]


def run(
    case: LoadedCase, evaluator: Evaluator, values: Mapping[str, float]
) -> tuple[ModesResult, Evaluation, list[Mode]]:
    """One design: the result, and what it was made of. Raises what `Evaluator.evaluate` does.

    >>> from tyrecal.tyre.case import start_values
    >>> result, evaluation, modes = run(case, evaluator, start_values(case))
    >>> print(modes[0].label, f"{modes[0].frequency_Hz:.1f} Hz of {result.mass_kg:.2f} kg")
    [0,0] axial 37.0 Hz of 12.81 kg
    """
    from ..simulate.evaluate.evaluator import Question  # late: not for those who read results

    evaluation = evaluator.evaluate(Question(values))
    result, modes = modes_result(case, values, evaluation)
    return result, evaluation, modes


def modes_result(
    case: LoadedCase, values: Mapping[str, float], evaluation: Evaluation
) -> tuple[ModesResult, list[Mode]]:
    """The result, and the labelled modes, both by rising frequency."""
    modes = labelled(evaluation)
    result = ModesResult(
        format=1,
        pressure_kPa=evaluation.pressure_kPa,
        load_N=0.0,
        mass_kg=evaluation.mass_kg,
        variables=dict(values),
        modes=sorted(
            (entry for mode in modes for entry in _entries(mode)),
            key=lambda entry: entry.frequency_Hz,
        ),
    )
    return result, modes


def _entries(mode: Mode) -> list[ModeEntry]:
    """A mode, or the two members of a doublet that is split."""
    entry = mode_entry(mode)
    if mode.raw.members is None:
        return [ModeEntry(**entry)]
    return [
        ModeEntry(**{**entry, "frequency_Hz": hertz, "multiplicity": 1, "member": member})
        for member, hertz in enumerate(mode.raw.members, start=1)
    ]


def mode_entry(mode: Mode) -> Json:
    """A mode as result files hold it; a doublet that is split at its mean."""
    return {
        "c": mode.label.c,
        "m": mode.label.m,
        "kind": mode.label.kind,
        "frequency_Hz": mode.frequency_Hz,
        "multiplicity": mode.multiplicity,
        **({} if mode.raw.damping_ratio is None else {"damping_ratio": mode.raw.damping_ratio}),
        "clarity": round(float(mode.clarity), 6),
    }
