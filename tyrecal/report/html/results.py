"""Result files read back, each checked: what a page may rely on."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

TINY = 1e-6  # Hz
LARGEST = 50_000_000  # bytes of a result file; ours are a hundredth of it


class BadResults(ValueError):
    """A folder without results, or a file in it that no command of ours wrote; one sentence."""


class Part(BaseModel):
    """A piece of a result file; what else stands there is not asked for."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True)


File = TypeVar("File", bound=Part)
Positive = Annotated[float, Field(gt=0)]
Wave = Annotated[int, Field(ge=0, le=200)]


class Named(Part):
    """A mode's label and frequency."""

    c: Wave
    m: Wave
    kind: str | None
    frequency_Hz: Positive


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


class Fit(Part):
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
    modes: Annotated[list[FittedMode], Field(min_length=1)]
    footprint: list[FittedFootprint] = []
    correlations: dict[str, dict[str, float | None]]
    singular_values: list[float]
    starts: list[Any]


class Words(Part):
    """Findings in sentences."""

    words: list[str] = []
    design: str = ""


class Modes(Part):
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


class PressureSweep(Part):
    """pressure_sweep.json"""

    rows: Annotated[list[PressureRow], Field(min_length=1)]
    failed: list[Failed] = []
    findings: list[Words]


class LoadRow(Part):
    """A design at a load."""

    design: str
    load_N: float
    deflection_m: float
    modes: list[ModeEntry]


class LoadSweep(Part):
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


class Footprints(Part):
    """footprint.json"""

    rows: Annotated[list[FootprintRow], Field(min_length=1)]
    failed: list[Failed]
    findings: Words


class Patch(Part):
    """Contact pressure on lines of nodes, (ring along, node across)."""

    design: str
    load_N: float
    across_mm: list[list[float]]
    along_mm: list[list[float]]
    pressure_kPa: list[list[float]]


class Patches(Part):
    """footprint_patches.json"""

    case: str
    patches: list[Patch]


class Cords(Part):
    """A layer as lines."""

    angle_deg: float
    lines: list[list[float]]


class Section(Part):
    """The section as elements and lines, mm."""

    areas: dict[str, list[list[float]]]
    cords: dict[str, Cords]
    rim: list[list[float]]
    outline: list[float]
    inflated: list[float] | None


class Shape(Named):
    """A mode on the section, or on the surface of the loaded tyre."""

    n: Wave = 0
    real: list[list[float]] = []
    imaginary: list[list[float]] = []
    symmetry: str | None = None
    displacement: list[list[list[float]]] = []


class Shapes(Part):
    """fit_shapes.json, modes_shapes.json"""

    case: str
    pressure_kPa: float
    load_N: float = 0.0
    variables: dict[str, list[str]] = {}
    section: Section | None = None
    R_m: list[float] = []
    Z_m: list[float] = []
    angles: list[float] = []
    surface_m: list[list[list[float]]] = []
    modes: list[Shape]

    def of(self, table: Sequence[ModeEntry | FittedMode]) -> bool:
        """Whether these are the modes that a table lists, and not those of another run; a split
        doublet has its mean here, both members there."""
        for mode in self.modes:
            hertz = [
                each.frequency_Hz
                for each in table
                if (each.c, each.m, each.kind) == (mode.c, mode.m, mode.kind)
                and getattr(each, "symmetry", None) == mode.symmetry
            ]
            if not hertz or not min(hertz) - TINY <= mode.frequency_Hz <= max(hertz) + TINY:
                return False
        return True


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


class Diagnosis(Part):
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


class DiagnosisSection(Part):
    """diagnosis_section.json"""

    case: str
    areas: dict[str, list[list[float]]]
    cords: dict[str, list[list[float]]]


class RunFacts(Part):
    """run.json, but for what differs from run to run."""

    case: str | None = None
    solver: str | None = None
    tyrecal: str | None = None


@dataclass(frozen=True)
class DesignPoint:
    """A line of fit_history.csv; objective None: the design could not be evaluated."""

    start: int
    objective: float | None
    values: dict[str, float]


@dataclass(frozen=True)
class Results:
    """What a folder holds; None or empty: it does not."""

    folder: Path
    fit: Fit | None = None
    fit_shapes: Shapes | None = None
    history: list[DesignPoint] = field(default_factory=list)
    modes: Modes | None = None
    modes_shapes: Shapes | None = None
    pressure: PressureSweep | None = None
    load: LoadSweep | None = None
    footprint: Footprints | None = None
    patches: Patches | None = None
    diagnosis: Diagnosis | None = None
    diagnosis_section: DiagnosisSection | None = None
    diagnosis_words: str = ""
    run: RunFacts = field(default_factory=RunFacts)

    @property
    def case(self) -> str:
        """The case's name or, in folders that do not know it, its file's."""
        known = (self.fit_shapes, self.modes_shapes, self.patches, self.diagnosis_section)
        for each in known:
            if each:
                return each.case
        return Path(self.run.case).stem if self.run.case else self.folder.resolve().name


def read_results(folder: Path) -> Results:
    """What the commands left in a folder. Raises BadResults; OSError."""
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise BadResults(f"'{folder}' {what}; give a folder of results")
    found = Results(
        folder,
        _read(folder / "fit.json", Fit),
        _read(folder / "fit_shapes.json", Shapes),
        _history(folder / "fit_history.csv"),
        _read(folder / "modes.json", Modes),
        _read(folder / "modes_shapes.json", Shapes),
        _read(folder / "pressure_sweep.json", PressureSweep),
        _read(folder / "load_sweep.json", LoadSweep),
        _read(folder / "footprint.json", Footprints),
        _read(folder / "footprint_patches.json", Patches),
        _read(folder / "diagnosis.json", Diagnosis),
        _read(folder / "diagnosis_section.json", DiagnosisSection),
        _text(folder / "diagnosis.md") or "",
        _read(folder / "run.json", RunFacts) or RunFacts(),
    )
    studies = (found.fit, found.modes, found.pressure, found.load, found.footprint)
    if not any((*studies, found.diagnosis)):
        raise BadResults(f"'{folder}' holds no results of fit, modes, sweep-pressure, footprint or"
                         " diagnose")  # fmt: skip
    return found


def _read(path: Path, kind: type[File]) -> File | None:
    text = _text(path)
    if text is None:
        return None
    try:
        return kind.model_validate(json.loads(text))
    except (json.JSONDecodeError, RecursionError):
        raise BadResults(f"'{path}' is damaged: it is no JSON") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(place) for place in first["loc"]) or "the whole"
        raise BadResults(
            f"'{path}' is not what tyrecal writes: {where}: {first['msg'][:1].lower()}"
            f"{first['msg'][1:]}"
        ) from None


def _text(path: Path) -> str | None:
    if not path.exists():
        return None
    if path.stat().st_size > LARGEST:
        raise BadResults(f"'{path}' is not what tyrecal writes: it is larger than 50 MB")
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise BadResults(f"'{path}' is damaged: it is no text") from None


def _history(path: Path) -> list[DesignPoint]:
    text = _text(path)
    if text is None:
        return []
    points = []
    try:
        for row in csv.DictReader(text.splitlines()):
            objective, start = row.pop("objective_Hz"), int(row.pop("start"))
            del row["point"], row["failure"]
            values = {name: float(value) for name, value in row.items()}
            points.append(DesignPoint(start, float(objective) if objective else None, values))
    except (KeyError, ValueError, TypeError):
        raise BadResults(f"'{path}' is not what tyrecal writes: line {len(points) + 2}") from None
    return points
