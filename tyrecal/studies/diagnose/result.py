"""diagnosis.json: numbers in the units of their names, None where there is none.

What a page does not ask for may be missing from a file that an earlier version wrote.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from ...errors import InputError
from ...files import Json
from ...simulate.modes.label import Label
from ...units import signed
from .. import named
from ..inference.observations import Observable
from ..labels import Labels
from ..result import Column, CsvRow, Result, ResultPart, StudyInput, Table, rows_csv
from .evidence import NONE, OUTSIDE
from .gap import projection
from .posteriors import ConstantShift, constants_posterior
from .shrinkage import Shrinkage
from .verdict import Further, VerdictKind, holds
from .where import FieldValue, PartChange

if TYPE_CHECKING:
    from .diagnosis import Diagnosis
    from .under_load import UnderLoad

ROW_PATTERN = re.compile(
    r"\[(\d{1,3}),(\d{1,3})\](?: (axial|torsional))? at ([\d.]{1,9}) kPa"
    r"(?:, rim (fixed|springs|free))?"
)
# not imported by who reads results
DIAGNOSE_STUDY = "tyrecal.studies.diagnose.study"
FURTHER_FILES = "tyrecal.report.diagnosis:further_files"  # a room above
MIN_LISTED_PROBABILITY = 1e-6  # of an effect that is listed


class EffectSize(ResultPart):
    """Mean and 90 % interval of an effect's size, what the case has of it counted in."""

    value: float  # mean size of the effect, including what the case already contains
    low: float  # lower end of the 90 % interval
    high: float  # upper end of the 90 % interval
    unit: str  # unit of the parameter


class EffectEstimate(ResultPart):
    """The size of the effect that a diagnosis names or likes best."""

    effect: str  # ids of the effects, joined by +
    value: float  # mean size of the effect, including what the case already contains
    low: float  # lower end of the 90 % interval
    high: float  # upper end of the 90 % interval
    unit: str  # unit of the parameter
    detectability: float = Field(default=0.0, alias="lambda")  # detectability lambda at its size


class Residual(ResultPart):
    """A measurement over the calibrated model."""

    row: str  # measured value in words: mode, pressure, rim
    run: int  # 0: the tyre as it is; 1, 2, ...: with something added, in the order of the files
    percent: float  # 100 ln(measured over calibrated model)
    sigma_percent: float  # its standard deviation without a gap

    @property
    def of(self) -> Observable | None:
        """Observable that was measured, where it is a frequency."""
        match = ROW_PATTERN.fullmatch(self.row)
        if not match:
            return None
        c, m, kind, pressure, rim = match.groups()
        label = Label(int(c), int(m), kind)
        return Observable("frequency", label, float(pressure), self.run, rim)  # type: ignore[arg-type]


class GroupTest(ResultPart):
    """Whether a group of modes is off by more than chance."""

    kind: str  # what the group has in common
    name: str  # name of the group
    p_value: float  # probability of such deviations by chance
    holm: float  # the same, corrected for the number of groups


class ContrastPart(ResultPart):
    """A combination of residuals."""

    name: str  # combination in words
    percent: float  # weighted sum of residuals, 100 ln(measured over calibrated model)
    sigma_percent: float  # its standard deviation without a gap


class GapPart(ResultPart):
    """Gap that calibration leaves; rms in per cent by group."""

    p_value: float  # probability of a gap so large by chance
    chi2: float  # chi2 of the residuals
    freedom: int  # degrees of freedom
    rms_percent: float  # rms of the residuals
    by_family: dict[str, float] = Field(default={})  # rms in percent by family of modes
    by_harmonic: dict[str, float] = Field(default={})  # rms in percent by number of waves
    by_pressure: dict[str, float] = Field(default={})  # rms in percent by pressure
    # rms in percent by rim, if it was held in several ways
    by_rim: dict[str, float] = Field(default={})
    by_load: dict[str, float] = Field(default={})  # rms in percent by load
    groups: list[GroupTest] = Field(default=[])  # tests of groups of modes
    contrasts: list[ContrastPart] = Field(default=[])  # combinations of residuals
    residuals: list[Residual]  # measured values over the calibrated model


class LoadedPart(ResultPart):
    """Something measured on the road, and how far the tyres are off."""

    quantity: str  # measured quantity
    mode: str | None  # label of the mode, if it is one
    pressure_kPa: float
    load_N: float
    measured: float  # measured value, in the unit of the quantity
    sigma: float  # standard deviation of the measured value
    calibrated_percent: float | None  # 100 ln(measured over calibrated tyre)
    effect_percent: float | None  # 100 ln(measured over tyre with the effect)


class UnderLoadPart(ResultPart):
    """The calibrated tyre on the road, and the one with the effect, neither fitted there."""

    effect: str | None  # ids of the effects, joined by +
    rows: list[LoadedPart]  # measured values on the road
    calibrated_rms_percent: float | None  # rms deviation of the calibrated tyre
    effect_rms_percent: float | None  # rms deviation of the tyre with the effect
    failed: list[str]  # states that were not reached


class NextMeasurement(ResultPart):
    """Something worth to be measured."""

    what: str  # measurement in words
    gain: float  # gain of information, nats per hour of work
    hours: float  # duration


class RobustPart(ResultPart):
    """Dependence of the verdict on the assumptions."""

    robust: bool  # whether the verdict holds under all assumptions
    hangs_on: list[str]  # assumptions that change the verdict
    range: list[float]  # least and largest probability of what the verdict states


class DiagnosisResult(Result):
    """diagnosis.json"""

    study, stem, heading = "diagnose", "diagnosis", "Diagnosis"
    part = "tyrecal.report.html.diagnosis:part"

    verdict: VerdictKind  # verdict; outside: no effect of the catalogue explains the gap
    words: str  # verdict in words
    effect: str | None  # ids of the named effects, joined by +
    parameter: EffectEstimate | None  # size of the named or likeliest effect
    parameters: dict[str, EffectSize] = Field(default={})  # sizes of several effects by id
    also: list[Further] = Field(default=[])  # effects that are perhaps present too
    # uncalibrated numbers, the largest shift first
    constants: list[ConstantShift] = Field(default=[])
    robust: RobustPart | None = None  # dependence of the verdict on assumptions
    likeliest: str | None = None  # ids of the likeliest effects
    # variables with value, standard_error and unit: without, and with the effect
    calibrated: Json | None = None
    # probability by effects; none, and outside: an effect that the catalogue lacks
    probabilities: dict[str, float]
    candidate_set: list[str]  # effects that hold 90 % of the probability together
    fit_p_value: float | None = None  # p-value of the likeliest explanation's own fit
    groups: list[list[str]]  # effects that these data do not distinguish
    detectability: dict[str, float]  # detectability lambda by effect, at the sizes in judged_at
    judged_at: dict[str, float] = Field(default={})  # size by effect
    # lambda at the far end of the effect's range
    full_size: dict[str, float | None] = Field(default={})
    # least change from the case with lambda = 10
    smallest_visible: dict[str, float | None] = Field(default={})
    gap: GapPart  # gap that calibration leaves
    under_load: UnderLoadPart | None = None  # prediction of what was measured on the road
    section_map: list[PartChange]  # parts of the section by falling evidence
    section_fields: list[FieldValue] = Field(default=[])  # uncertain fields of the section
    effective_rank: int  # combinations of parts that the data determine
    shrinkage: Shrinkage | None  # errors on held-out values with and without the effect
    rung: int  # rung of the ladder of proof, 1 to 4
    absorbed: dict[str, float] = Field(default={})  # share of an effect that calibration absorbs
    # bias of each variable if an effect has its full size and is ignored
    bias_percent: dict[str, dict[str, float]] = Field(default={})
    next_measurements: list[NextMeasurement]  # measurements that would tell most
    exchanged_labels: list[str] = Field(default=[])  # labels that may be exchanged
    labels: Labels | None = None  # labels of frequencies that came without one
    left_out: list[str] = Field(default=[])  # measurements that are not used
    damping_ratios: int = 0  # number of measured damping ratios that are used
    # effects that could not be evaluated, and why
    not_evaluated: dict[str, str] = Field(default={})

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        measured: Path | None = None,
        repeats: Sequence[Path] = (),
        effects: Sequence[str] | None = None,
    ) -> DiagnosisResult:
        """Weigh the effects by a file of measurements, by default that of the case's targets."""
        case, file = given.case, measured or given.case.measured
        if file is None:
            raise InputError(
                "the case has no file of measurements to diagnose: add one, as in"
                " targets: {file: measured.csv}"
            )
        study = import_module(DIAGNOSE_STUDY)
        options = {"jobs": given.jobs, "effects": effects}
        diagnosed = study.study(case, given.evaluator, file, repeats, **options)
        states = study.states_measured(case, file, repeats)
        result = given.stamped(diagnosed.result, measured=[file, *repeats], **states)
        further: DiagnosisResult = result.with_files(named(FURTHER_FILES)(diagnosed, result, file))
        return further

    def quantities(self) -> dict[str, float]:
        verdict = " ".join(filter(None, ("verdict", self.verdict, self.effect)))
        numbers = {
            verdict: 1.0,  # gone where it is another
            "gap_p_value": self.gap.p_value,
            "gap_rms_percent": self.gap.rms_percent,
        }
        for key in dict.fromkeys(filter(None, (NONE, OUTSIDE, self.likeliest))):
            numbers[f"probability {key}"] = self.probabilities[key]
        without = (self.calibrated or {}).get("without") or {}
        return numbers | {f"calibrated {name}": each["value"] for name, each in without.items()}

    def conclusion(self) -> dict[str, str | None]:
        return {"verdict": self.verdict, "effect": self.effect, "words": self.words}

    def tables(self) -> list[Table]:
        """Parts of the section, each changed alone."""
        if not self.section_map:
            return []
        evidence = Column("ln evidence", "+z.1f")
        heads = [Column("part", ""), Column("stiffness, %"), Column("mass, %"), evidence]
        rows = [
            [
                part.region.replace("_", " "),
                f"{_change(part.stiffness_percent, 0)} ± {part.stiffness_sigma:.0f}",
                f"{_change(part.mass_percent, 0)} ± {part.mass_sigma:.0f}",
                _change(part.evidence, 1),
                ", ".join(part.same_as).replace("_", " "),
            ]
            for part in self.section_map
        ]
        return [
            Table([*heads, Column("looks like", "")], rows, "One part changed alone", "", "section")
        ]

    def csv(self) -> str:
        residuals: list[CsvRow] = [each.model_dump() for each in self.gap.residuals]
        return rows_csv(residuals)

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """The tables of the diagnosis page."""
        sizes: dict[str, Mapping[str, float | None]] = {
            "lambda": self.detectability,
            "judged_at": self.judged_at,
            "full_size": self.full_size,
            "smallest_visible": self.smallest_visible,
            "absorbed": self.absorbed,
        }
        ids = list(dict.fromkeys(id for by_effect in sizes.values() for id in by_effect))
        tables: dict[str, list[CsvRow]] = {
            "probabilities": [
                {"explanation": key, "probability": p} for key, p in self.probabilities.items()
            ],
            "groups": [each.model_dump() for each in self.gap.groups],
            "section": [asdict(each) for each in self.section_map],
            "constants": [asdict(each) for each in self.constants],
            "effects": [
                {"effect": id} | {key: by_effect.get(id) for key, by_effect in sizes.items()}
                for id in ids
            ],
            "next": [each.model_dump() for each in self.next_measurements],
        }
        if self.under_load:
            tables["under_load"] = [each.model_dump() for each in self.under_load.rows]
        return tables | ({"labels": self.labels.csv_rows()} if self.labels else {})


def _change(value: float, digits: int) -> str:
    """A number with its sign, and 0 without one."""
    text = signed(value, digits)
    return text if float(text) else text[1:]


def diagnosis_result(
    diagnosis: Diagnosis,
    under_load: UnderLoad | None = None,
    calibrated: Json | None = None,
    section: Sequence[FieldValue] = (),
    labels: Labels | None = None,
) -> DiagnosisResult:
    """Result of a diagnosis for its files. ``calibrated``: see `calibrated_variables`."""
    d, shown = diagnosis, diagnosis.verdict.key or diagnosis.best
    result = DiagnosisResult(
        format=1,
        verdict=d.verdict.kind,
        words=d.verdict.words,
        effect=d.verdict.key,
        parameter=_explained(d, shown),
        parameters={
            id: EffectSize(**d.parameter(shown, id))
            for id in d.problem.ranges
            if shown and holds(shown, id)
        },
        also=list(d.verdict.also),
        constants=constants_posterior(d),
        robust=RobustPart(
            robust=d.robustness.robust,
            hangs_on=list(d.robustness.hangs_on),
            range=[d.robustness.low, d.robustness.high],
        ),
        likeliest=d.best,
        probabilities=_listed(d.probabilities),
        candidate_set=list(d.verdict.candidates),
        fit_p_value=d.verdict.check,
        groups=d.separability.groups(),
        detectability=dict(d.separability.lambdas),
        judged_at={id: d.problem.ranges[id].base + e for id, e in d.separability.sizes.items()},
        full_size=dict(d.separability.full),
        smallest_visible=dict(d.separability.smallest),
        gap=_gap(d, under_load),
        under_load=_under_load(under_load),
        section_map=list(d.parts),
        section_fields=list(section),
        effective_rank=d.effective_rank,
        shrinkage=d.shrinkage,
        rung=d.rung,
        absorbed=dict(d.gap.absorbed),
        bias_percent={name: dict(by_effect) for name, by_effect in d.gap.bias_percent.items()},
        next_measurements=[
            NextMeasurement(what=c.what, gain=c.gain, hours=c.hours) for c in d.choices
        ],
        exchanged_labels=[str(label) for label in d.exchanged or ()],
        labels=labels,
        left_out=list(d.left_out),
        not_evaluated=dict(d.problem.expansion.failed),
    )
    more = {"calibrated": calibrated, "damping_ratios": d.damping_ratios}
    return result.model_copy(update={key: value for key, value in more.items() if value})


def _gap(diagnosis: Diagnosis, under_load: UnderLoad | None) -> GapPart:
    """The part ``gap`` of diagnosis.json."""
    gap, rows = diagnosis.gap, diagnosis.problem.observations.rows
    by = {
        kind: {g.name: g.rms_percent for g in gap.groups if g.kind == kind}
        for kind in ("family", "harmonic", "pressure", "rim")
    }
    loads = sorted({row.load_N for row in under_load.rows}) if under_load else []
    rms = {load: under_load.rms_percent(NONE, load) for load in loads} if under_load else {}
    return GapPart(
        p_value=gap.p_value,
        chi2=gap.chi2,
        freedom=gap.freedom,
        rms_percent=gap.rms_percent,
        by_family=by["family"],
        by_harmonic=by["harmonic"],
        by_pressure=by["pressure"],
        **({"by_rim": by["rim"]} if by["rim"] else {}),
        by_load={f"{load:g}": value for load, value in rms.items() if value is not None},
        groups=[
            GroupTest(kind=g.kind, name=g.name, p_value=g.p_value, holm=g.corrected)
            for g in gap.groups
        ],
        contrasts=[
            ContrastPart(name=c.name, percent=c.percent, sigma_percent=c.sigma_percent)
            for c in gap.contrasts
        ],
        residuals=[
            Residual(row=str(row), run=row.run, percent=100 * r, sigma_percent=100 * sd)
            for row, r, sd in zip(rows, gap.residuals.tolist(), gap.spread.tolist(), strict=True)
        ],
    )


def _under_load(comparison: UnderLoad | None) -> UnderLoadPart | None:
    """The part ``under_load`` of diagnosis.json; None if nothing was measured under load."""
    if comparison is None:
        return None
    effect = comparison.tyres[1] if len(comparison.tyres) > 1 else None
    return UnderLoadPart(
        effect=effect,
        rows=[
            LoadedPart(
                quantity=row.quantity,
                mode=str(row.member) if row.member else None,
                pressure_kPa=row.pressure_kPa,
                load_N=row.load_N,
                measured=row.value,
                sigma=row.sigma,
                calibrated_percent=100 * row.off[NONE] if NONE in row.off else None,
                effect_percent=100 * row.off[effect] if effect and effect in row.off else None,
            )
            for row in comparison.rows
        ],
        calibrated_rms_percent=comparison.rms_percent(NONE),
        effect_rms_percent=comparison.rms_percent(effect) if effect else None,
        failed=list(comparison.failed),
    )


def _explained(diagnosis: Diagnosis, key: str | None) -> EffectEstimate | None:
    """``detectability``: lambda of all that ``key`` names, at its likeliest size."""
    if key is None:
        return None
    hypothesis = diagnosis.hypothesis(key)
    effects = {id: np.array([e]) for id, e in hypothesis.mean().items()}
    shift = (diagnosis.bare.added(effects, 1).shift - diagnosis.bare.added({}, 1).shift)[0]
    P, _, _ = projection(diagnosis.bare, hypothesis.fitted.d[hypothesis.best])
    size = {**diagnosis.parameter(key), "lambda": float(shift @ P @ shift)}
    return EffectEstimate(effect=key.split("+")[0], **size)


def _listed(probabilities: Mapping[str, float]) -> dict[str, float]:
    """Probabilities with the likeliest first; none and outside always."""
    order = sorted(probabilities.items(), key=lambda item: -item[1])
    return {key: p for key, p in order if p > MIN_LISTED_PROBABILITY or key in (NONE, OUTSIDE)}
