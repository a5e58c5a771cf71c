"""The contents of result files, as far as a page asks for them; numbers finite, SI or as named."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ...diagnose.observations import Row
from ...modes.mode import Label
from ...studies.result import Named, Part, Positive, Provenance, Result, Wave

ROW = re.compile(r"\[(\d{1,3}),(\d{1,3})\](?: (axial|torsional))? at ([\d.]{1,9}) kPa")


class ModeEntry(Named):
    """A mode of modes.json or of a sweep."""

    multiplicity: int = 1
    symmetry: str | None = None
    member: int | None = None
    clarity: float | None = None
    overlap: float | None = None
    d_ln_f_d_ln_p: float | None = None


class FittedMode(Named):
    """A row of the fit's table."""

    multiplicity: int
    initial_Hz: Positive
    fitted_Hz: Positive
    target_Hz: Positive
    deviation_percent: float


class Variable(Part):
    """A design variable of a fit."""

    initial: float
    value: float
    lower: float
    upper: float
    standard_error: float | None
    at_bound: bool


class FittedFootprint(Part):
    """A target on the road."""

    quantity: Literal["contact_area_m2", "vertical_stiffness_N_per_m"]
    load_N: float
    initial: float
    fitted: float
    target: float
    deviation_percent: float


class Fit(Result):
    """fit.json"""

    method: str
    pressure_kPa: float
    mass_kg: float
    objective_Hz: float
    initial_objective_Hz: float
    objective_unit: str
    evaluations: int
    failed_evaluations: int
    converged: bool
    moved: bool
    message: str
    projected_gradient_norm: float
    label_margin: float
    variables: dict[str, Variable]
    fixed: dict[str, float]
    modes: list[FittedMode]
    footprint: list[FittedFootprint] = Field(default=[])
    correlations: dict[str, dict[str, float | None]]
    singular_values: list[float]
    starts: list[Any]


class Words(Part):
    """Findings in sentences."""

    words: list[str] = Field(default=[])
    design: str = ""


class Modes(Result):
    """modes.json"""

    pressure_kPa: float
    load_N: float
    mass_kg: float
    variables: dict[str, float]
    deflection_m: float | None = None
    modes: Annotated[list[ModeEntry], Field(min_length=1)]
    findings: Words = Words()


class Failed(Part):
    """What a study could not reach."""

    design: str
    words: str = ""
    cause: str = ""
    load_N: float | None = None
    pressure_kPa: float | None = None


class PressureRow(Part):
    """A design at a pressure."""

    design: str
    pressure_kPa: Positive
    modes: list[ModeEntry]


class PressureSweep(Result):
    """pressure_sweep.json"""

    rows: Annotated[list[PressureRow], Field(min_length=1)]
    failed: list[Failed] = Field(default=[])
    findings: list[Words]


class LoadRow(Part):
    """A design at a load."""

    design: str
    load_N: float
    deflection_m: float
    modes: list[ModeEntry]


class LoadSweep(Result):
    """load_sweep.json"""

    rows: Annotated[list[LoadRow], Field(min_length=1)]
    failed: list[Failed]
    findings: list[Words]


class FootprintRow(Part):
    """A line of footprint.json, SI."""

    design: str
    load_N: Positive
    deflection_m: float
    area_m2: Positive
    length_m: float
    width_m: float
    mean_pressure_Pa: float
    peak_pressure_Pa: Positive
    vertical_stiffness_N_per_m: float


class Footprints(Result):
    """footprint.json"""

    rows: Annotated[list[FootprintRow], Field(min_length=1)]
    failed: list[Failed]
    findings: Words


class Explained(Part):
    """The size of the effect that a diagnosis names or likes best."""

    effect: str
    value: float
    low: float
    high: float
    unit: str


class Region(Part):
    """A line of the section's map."""

    region: str
    stiffness_percent: float
    stiffness_sigma: float
    mass_percent: float
    mass_sigma: float
    evidence: float
    same_as: list[str]


class Residual(Part):
    """A measurement over the calibrated model."""

    row: str
    run: int
    percent: float
    sigma_percent: float

    @property
    def of(self) -> Row | None:
        """What was measured, where it is a frequency."""
        found = ROW.fullmatch(self.row)
        if not found:
            return None
        c, m, kind, pressure = found.groups()
        return Row("frequency", Label(int(c), int(m), kind), float(pressure), self.run)


class Gap(Part):
    """What calibration leaves."""

    p_value: float
    chi2: float
    freedom: int
    rms_percent: float
    residuals: list[Residual]


class Shrinkage(Part):
    """Errors on held-out data."""

    held_out: str
    effect: str
    before_percent: float
    after_percent: float
    fraction: float
    low: float
    high: float
    placebo_95: float
    floor_percent: float


class NextMeasurement(Part):
    """Something worth to be measured."""

    what: str
    gain: float
    hours: float


class Diagnosis(Result):
    """diagnosis.json"""

    verdict: Literal["named", "undecided", "no_gap", "outside"]
    words: str
    effect: str | None
    parameter: Explained | None
    probabilities: dict[str, float]
    candidate_set: list[str]
    groups: list[list[str]]
    detectability: dict[str, float]
    gap: Gap
    section_map: list[Region]
    effective_rank: int
    shrinkage: Shrinkage | None
    rung: int
    next_measurements: list[NextMeasurement]


class RunFacts(Part):
    """A study's entry in run.json, but for what differs from run to run."""

    case: str | None = None
    command: str | None = None
    finished: bool = True
    started: str = ""


class EffectMode(Part):
    """Change of a mode's frequency by an effect, as it comes and after the re-fit."""

    c: Wave
    m: Wave
    kind: str | None
    before_percent: float | None
    after_percent: float | None


class EffectRow(Part):
    """An effect at one pressure."""

    pressure_kPa: Positive
    modes: list[EffectMode]


class Effect(Part):
    """An entry of effects.json."""

    title: str
    symbol: str
    unit: str
    value: float
    before_percent: float | None
    after_percent: float | None
    absorbed: float | None
    rows: Annotated[list[EffectRow], Field(min_length=1)]
    provenance: Provenance | None = None


class Effects(Part):
    """effects.json, which is a list; empty where no effect had an answer."""

    entries: list[Effect]

    @model_validator(mode="before")
    @classmethod
    def _of_list(cls, content: Any) -> Any:
        return {"entries": content}

    @property
    def provenance(self) -> Provenance | None:
        """Of the first, as of all."""
        return self.entries[0].provenance if self.entries else None
