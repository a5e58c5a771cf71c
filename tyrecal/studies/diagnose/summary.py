"""diagnosis.json read back, as far as a page asks for it."""

from __future__ import annotations

import re
from typing import Literal

from ...simulate.modes.label import Label
from ..result import Result, ResultPart
from .observations import Observable
from .where import PartChange

ROW_PATTERN = re.compile(r"\[(\d{1,3}),(\d{1,3})\](?: (axial|torsional))? at ([\d.]{1,9}) kPa")


class Explained(ResultPart):
    """The size of the effect that a diagnosis names or likes best."""

    effect: str
    value: float
    low: float
    high: float
    unit: str


class Residual(ResultPart):
    """A measurement over the calibrated model."""

    row: str
    run: int
    percent: float
    sigma_percent: float

    @property
    def of(self) -> Observable | None:
        """What was measured, where it is a frequency."""
        found = ROW_PATTERN.fullmatch(self.row)
        if not found:
            return None
        c, m, kind, pressure = found.groups()
        return Observable("frequency", Label(int(c), int(m), kind), float(pressure), self.run)


class GapSummary(ResultPart):
    """What calibration leaves."""

    p_value: float
    chi2: float
    freedom: int
    rms_percent: float
    residuals: list[Residual]


class ShrinkageSummary(ResultPart):
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


class NextMeasurement(ResultPart):
    """Something worth to be measured."""

    what: str
    gain: float
    hours: float


class DiagnosisResult(Result):
    """diagnosis.json"""

    study, stem, heading = "diagnose", "diagnosis", "Diagnosis"

    verdict: Literal["named", "undecided", "no_gap", "outside"]
    words: str
    effect: str | None
    parameter: Explained | None
    probabilities: dict[str, float]
    candidate_set: list[str]
    groups: list[list[str]]
    detectability: dict[str, float]
    gap: GapSummary
    section_map: list[PartChange]
    effective_rank: int
    shrinkage: ShrinkageSummary | None
    rung: int
    next_measurements: list[NextMeasurement]
