"""The contents of result files, as far as a page asks for them; numbers finite, SI or as named."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ...simulate.modes.mode import Label
from ...studies.diagnose.observations import Observable
from ...studies.result import Column, Part, Positive, Provenance, Result, Table, Wave

ROW = re.compile(r"\[(\d{1,3}),(\d{1,3})\](?: (axial|torsional))? at ([\d.]{1,9}) kPa")


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
    def of(self) -> Observable | None:
        """What was measured, where it is a frequency."""
        found = ROW.fullmatch(self.row)
        if not found:
            return None
        c, m, kind, pressure = found.groups()
        return Observable("frequency", Label(int(c), int(m), kind), float(pressure), self.run)


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

    @property
    def label(self) -> Label:
        """[c, m]"""
        return Label(self.c, self.m, self.kind)

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


class Effects(Result):
    """effects.json, which is a list; empty where no effect had an answer."""

    study, stem, heading = "effects", "effects", "Effects"

    entries: list[Effect]

    @model_validator(mode="before")
    @classmethod
    def _of_list(cls, content: Any) -> Any:
        first = content[0] if content and isinstance(content, list) else {}
        of = first.get("provenance") if isinstance(first, dict) else None
        return {"format": 1, "provenance": of, "entries": content}

    def tables(self) -> list[Table]:
        """One row an effect, at the pressure in the middle."""
        first = self.entries[0].rows
        middle = first[len(first) // 2].pressure_kPa
        labels = dict.fromkeys(m.label for e in self.entries for row in e.rows for m in row.modes)
        change, share = Column("left", "+.1f"), Column("absorbed, %", ".0f", 100.0)
        heads = [each for x in labels for each in (Column(x.said), change)]
        rows = []
        for each in self.entries:
            size = f"{each.symbol} = {each.value:.4g} {each.unit}".rstrip()
            modes = {m.label: m for r in each.rows if r.pressure_kPa == middle for m in r.modes}
            cells = []
            for label in labels:
                mode = modes.get(label)
                cells.append(change.cell(mode and mode.before_percent))
                cells.append(change.cell(mode and mode.after_percent))
            rows.append([each.title, size, *cells, share.cell(each.absorbed)])
        caption = (
            f"Change of frequency, %, at {middle:g} kPa: as the effect comes, and what is left once"
            " the variables are fitted again. Absorbed: the share of it, over all pressures, that"
            " calibration hides."
        )
        return [Table([Column("effect", ""), Column("", ""), *heads, share], rows, caption)]
