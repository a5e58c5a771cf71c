"""The studies of a batch: what each writes for a case, and the numbers that are compared.

Result files are those of the command of the same name. Where a batch fits, studies that follow a
fit study the fitted design next to the initial one, as with their --fitted.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass, field

from ..simulate.evaluate.failure import EvaluationFailed
from ..studies import study_class
from ..studies.pressure_range import PressureRange
from ..studies.result import StudyInput


@dataclass(frozen=True)
class Asked:
    """Options of the studies, by the names of arguments of `Result.run`."""

    loads_N: tuple[float, ...] | None  # None: those of the case
    pressures_kPa: PressureRange


@dataclass
class Studied:
    """A case under study."""

    given: StudyInput
    asked: Asked
    no_fit: bool = False  # a fit was requested and has no result


@dataclass
class StudyOutcome:
    """Outcome of a study (see `case`), its numbers, and its result files, name to text."""

    status: str = "good"  # or "failed", "skipped"
    cause: str | None = None  # of a failure, a key
    words: str | None = None  # of a failure, for people
    quantities: dict[str, float] = field(default_factory=dict)  # `Result.quantities`, by name
    files: dict[str, str] = field(default_factory=dict)
    conclusion: dict[str, str | None] = field(default_factory=dict)  # `Result.conclusion`


def study(name: str, state: Studied) -> StudyOutcome:
    """One study; skipped where it follows a fit that has no result. Raises what the study does."""
    kind = study_class(name)
    if state.no_fit and kind.follows_fit:
        return StudyOutcome("skipped", None, "the fit before it has no result")
    state.no_fit = state.no_fit or kind.fits
    known = inspect.signature(kind.run).parameters
    options = {key: value for key, value in vars(state.asked).items() if key in known}
    result = kind.run(state.given, **options)
    result.pass_on(state.given)
    state.no_fit = state.no_fit and not kind.fits
    failed = getattr(result, "failed", ())  # states not reached; without any row there is no result
    if failed and not getattr(result, "rows", True):
        raise EvaluationFailed(failed[0].cause, failed[0].words)
    conclusion, short = result.conclusion(), result.shortfall()
    cause, words = short or (None, conclusion.pop("words", None))
    status = "failed" if short else "good"
    return StudyOutcome(status, cause, words, result.quantities(), result.texts(), conclusion)
