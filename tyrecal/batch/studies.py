"""The studies of a batch: what each writes for a case, and the numbers that are compared.

Result files are those of the command of the same name. Where a batch fits, the pressure sweep and
the footprint study the fitted design beside the initial one, as with their --fitted.

The numbers are named ``KIND`` or ``KIND WHERE``: ``mass_kg``, ``fitted_Hz [2,1]``,
``area_m2 fitted 4000 N``; units are in the kind's name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import json_text
from ..simulate.evaluate.evaluator import Evaluator
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.provenance import provenance, stamped
from ..studies import footprint as pressed
from ..studies import modes as evaluated
from ..studies import pressure_result
from ..studies.fit.calibrate import history_csv
from ..studies.fit.prediction import FitResponses
from ..studies.fit.study import FitStudy
from ..studies.fit.verdict import DOES_NOT_FIT, does_not_fit_words
from ..studies.fitted import NOT_CONVERGED
from ..studies.pressure_range import PressureRange
from ..studies.result import Failed, Result, ResultPart
from ..studies.sample import study as sampling
from ..studies.sample.result import draws_csv, result
from ..tyre.case import LoadedCase

Numbers = dict[str, float]


@dataclass(frozen=True)
class Asked:
    """Options of the studies, beyond the case. loads_N: of the footprint, None for the case's own;
    pressures: of the sweep."""

    loads_N: tuple[float, ...] | None
    pressures: PressureRange


@dataclass
class Studied:
    """A case under study. designs: values of the variables by name of the design, ``fitted`` once a
    fit has it; no_fit: a fit was requested and has no result."""

    case: LoadedCase
    evaluator: Evaluator
    designs: dict[str, dict[str, float]]
    asked: Asked
    no_fit: bool = False
    responses: FitResponses | None = None  # of the fit to its data

    @property
    def measured(self) -> list[Path]:
        """The file that the case's targets stand in, where it names one."""
        return [self.case.measured] if self.case.measured else []


@dataclass
class StudyOutcome:
    """Outcome of a study (see `case`), its numbers, and its result files, name to text."""

    status: str = "good"
    cause: str | None = None
    words: str | None = None
    quantities: Numbers = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    verdict: dict[str, str | None] = field(default_factory=dict)  # of a diagnosis


def fit(state: Studied) -> StudyOutcome:
    """Calibrate from the case's own start. Raises what `FitStudy` does."""
    state.no_fit = True
    fitted = FitStudy(state.case, state.evaluator).run()
    result = fitted.found
    state.no_fit = False
    state.responses = FitResponses(responses=result.responses, chi2_per_dof=result.chi2_per_dof)
    state.designs["fitted"] = {n: fitted.fitted.values[n] for n in state.designs["initial"]}
    numbers = {"objective": result.objective_Hz, "mass_kg": result.mass_kg}
    numbers |= {f"variable {name}": each.value for name, each in result.variables.items()}
    for mode in result.modes:
        where = " ".join(filter(None, (str(mode.label), mode.symmetry, mode.state)))
        numbers[f"fitted_Hz {where}"] = mode.fitted_Hz
    for each in result.footprint:
        numbers[f"fitted_{each.quantity} {each.state}"] = each.fitted
    files = result.texts() | {"fit_history.csv": history_csv(fitted.history)}
    if result.verdict == DOES_NOT_FIT and result.chi2_per_dof:
        words = does_not_fit_words(result.chi2_per_dof, result.reason)
        return StudyOutcome("failed", DOES_NOT_FIT, words, numbers, files)
    if result.is_good:
        return StudyOutcome(quantities=numbers, files=files)
    words = result.message if result.moved else "the fit did not move"
    return StudyOutcome("failed", NOT_CONVERGED, f"not converged: {words}", numbers, files)


def modes(state: Studied) -> StudyOutcome:
    """Evaluate the case's own design. Raises what `modes.run` does."""
    values = state.designs["initial"]
    result, _, _ = evaluated.run(state.case, state.evaluator, values)
    numbers = {"mass_kg": result.mass_kg}
    for mode in result.modes:
        member = f" member {mode.member}" if mode.member else ""
        numbers[f"frequency_Hz {mode.label}{member}"] = mode.frequency_Hz
    return StudyOutcome(quantities=numbers, files=_files(state, result))


def sweep_pressure(state: Studied) -> StudyOutcome:
    """Every design over the pressure. Raises what `pressure_result.run` does."""
    pressures = state.asked.pressures.on(state.case)
    result = pressure_result.run(
        state.case, state.evaluator, state.designs, pressures, fit=state.responses
    )
    numbers = {
        f"frequency_Hz {row.design} {row.pressure_kPa:g} kPa {mode.label}": mode.frequency_Hz
        for row in result.rows
        for mode in row.modes
    }
    files = _files(state, result, pressure_kPa=pressures)
    return _reached(result.rows, result.failed, numbers, files)


def footprint(state: Studied) -> StudyOutcome:
    """Every design at rising loads. Raises what `footprint.run` does."""
    state.evaluator.needs_road()
    loads = state.asked.loads_N or state.case.case.loads_N
    result, _, _ = pressed.run(state.case, state.evaluator, state.designs, loads)
    numbers = {
        f"{kind} {row.design} {row.load_N:g} N": value
        for row in result.rows
        for kind, value in row.model_dump(exclude={"design", "load_N"}).items()
    }
    return _reached(result.rows, result.failed, numbers, _files(state, result, load_N=loads))


def sample(state: Studied) -> StudyOutcome:
    """Draw the variables under the case's targets. Raises what `sample.study.run` does."""
    readings = sampling.measured_readings(state.case)
    drawn = sampling.run(state.case, state.evaluator, readings, sampling.MANY_DRAWS)
    summary = result(drawn, 0)
    numbers = {f"median {name}": each.median for name, each in summary.variables.items()}
    for row in summary.predicted:
        numbers[f"predicted_Hz {row.pressure_kPa:g} kPa {row.label}"] = row.frequency_Hz
    states = sampling.states_sampled(state.case, readings)
    files = _files(state, summary, measured=state.measured, **states)
    files["sample_draws.csv"] = draws_csv(drawn)
    if doubts := summary.doubts():
        return StudyOutcome("failed", "not_sampled", "; ".join(doubts), numbers, files)
    return StudyOutcome(quantities=numbers, files=files)


def diagnose(state: Studied) -> StudyOutcome:
    """Weigh the effects by the file that the case's targets stand in. Raises what
    `diagnose.study.study` does."""
    from ..report.diagnosis import page
    from ..report.shape_data import parts_data
    from ..studies.diagnose import study as diagnosing
    from ..studies.diagnose.evidence import NONE, OUTSIDE

    case, measured = state.case, state.case.measured
    if measured is None:
        raise InputError(
            "the case has no file of measurements to diagnose: add one, as in"
            " targets: {file: measured.csv}"
        )
    diagnosed = diagnosing.study(case, state.evaluator, measured)
    states = diagnosing.states_measured(case, measured)
    block = provenance(case, state.evaluator.solver, [measured], **states)
    diagnosis = diagnosed.result.stamped(block)
    section = parts_data(case, [part.region for part in diagnosis.section_map])
    parts = stamped(section.model_dump(exclude_unset=True), block)
    files = {
        **diagnosis.texts(),
        "diagnosis_section.json": json_text(parts),
        "diagnosis.md": page(diagnosed, case.case.name, measured.name),
    }
    verdict = " ".join(filter(None, ("verdict", diagnosis.verdict, diagnosis.effect)))
    numbers = {
        verdict: 1.0,  # gone where it is another
        "gap_p_value": diagnosis.gap.p_value,
        "gap_rms_percent": diagnosis.gap.rms_percent,
    }
    for key in dict.fromkeys(filter(None, (NONE, OUTSIDE, diagnosis.likeliest))):
        numbers[f"probability {key}"] = diagnosed.diagnosis.probabilities[key]
    for name, each in diagnosed.variables["without"].items():
        numbers[f"calibrated {name}"] = each["value"]
    facts = {"verdict": diagnosis.verdict, "effect": diagnosis.effect}
    return StudyOutcome("good", None, diagnosis.words, numbers, files, facts)


STUDIES: dict[str, Callable[[Studied], StudyOutcome]] = {  # in the order in which they are done
    "fit": fit,
    "modes": modes,
    "sweep-pressure": sweep_pressure,
    "footprint": footprint,
    "sample": sample,
    "diagnose": diagnose,
}
OF_FITTED = ("sweep-pressure", "footprint")  # they want the fitted design where there is a fit


def study(name: str, state: Studied) -> StudyOutcome:
    """One study; skipped where it wants a fit that has no result. Raises what the study does."""
    if state.no_fit and name in OF_FITTED:
        return StudyOutcome("skipped", None, "the fit before it has no result")
    return STUDIES[name](state)


def _reached(
    rows: Sequence[ResultPart], failed: Sequence[Failed], numbers: Numbers, files: dict[str, str]
) -> StudyOutcome:
    """Good, or failed at the first of some places. Raises EvaluationFailed where nothing was
    reached."""
    if not failed:
        return StudyOutcome(quantities=numbers, files=files)
    first = failed[0]
    if not rows:
        raise EvaluationFailed(first.cause, first.words)
    words = f"{first.place}: {first.words}"
    if len(failed) > 1:
        words += f" (and {len(failed) - 1} more)"
    return StudyOutcome("failed", first.cause, words, numbers, files)


def _files(state: Studied, result: Result, **of: Any) -> dict[str, str]:
    """The result's files; its provenance's state is the case's but for ``of``."""
    return result.stamped(provenance(state.case, state.evaluator.solver, **of)).texts()
