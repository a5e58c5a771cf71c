"""Whether a calibrated model fits what was measured, and the likeliest reason where it does not.

A `Remainder` is what a fit leaves, linear about the fitted design. With d = ln (measured / model),
C its covariance and J = d ln q / d x of n values by v variables,

    P = C^-1 - C^-1 J (J^T C^-1 J)^-1 J^T C^-1,    chi2 = d^T P d,    n - v degrees of freedom.

A reason is a change of the data, or of the state that was computed, that lowers chi2 once the
variables are fitted again. A known shift s of ln q leaves (d - s)^T P (d - s). Unknown shifts E a,
a normal with standard deviation t, lower chi2 by g^T (E^T P E + t^-2)^-1 g with g = E^T P d. A
value that is left out has E = e_i and no t (Cook and Weisberg, Residuals and Influence, sec. 2.2).
A reason counts if what it takes away is large against the chi2 per degree of freedom that it
leaves. A slip of a value, or an exchange, counts only if the rest then fits: what is left of a
missing effect, which moves many values, still does not.

Nothing here runs a solver: `alternatives` evaluates the other states, `judge` calls both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, pairwise
from typing import Final, Literal

import numpy as np

from ...measured.measurement import Measurement
from ...measured.sense import doubts, likeliest_exchange
from ..fitted import NOT_CONVERGED
from ..result import ResultPart
from .targets import WITHOUT_MODEL_ERROR

Array = np.ndarray
FitVerdict = Literal["fits", "does_not_fit", "not_judged", "not_converged"]
FITS: Final = "fits"
DOES_NOT_FIT: Final = "does_not_fit"
NOT_JUDGED: Final = "not_judged"
FIT_VERDICT_WORDS: Final[dict[FitVerdict, str]] = {
    FITS: "fits",
    DOES_NOT_FIT: "does not fit",
    NOT_JUDGED: "converged, not judged",
    NOT_CONVERGED: "not converged",
}
MAX_CHI2_PER_DOF = 5.0  # of a model that fits
MARKED = 16.0  # chi2 that a reason takes away, over the chi2 per degree of freedom that it leaves
MARKED_UNSTATED = 49.0  # the same where the scatter is known from the residuals alone
MIN_DEGREES_LEFT = 3  # degrees of freedom that tell such a scatter
MIN_CHECKED = 1e-6  # of a value's own weight: below, nothing else checks the value
KINDS_OF_SLIP = ("value", "mode", "exchanged")  # kinds of reason after which the rest has to fit
NEXT_REASON = 6.0  # chi2 between a reason and the next, 20 times less likely: below, both are named
SAME_VALUE = 0.015  # relative, between a corrected value and the model, if 3 sd are less


class FitReason(ResultPart):
    """The likeliest reason why a model is off its targets."""

    # kind of reason; mode: one value is off, and an effect on its mode explains it nearly as
    # well
    kind: Literal["value", "mode", "exchanged", "pressure", "rim", "wheel", "pattern"]
    words: str  # a sentence that ends with a question to the user
    # chi2 per degree of freedom with the reason removed, by the linear model
    chi2_per_dof: float | None = None
    also: str = ""  # a reason that is nearly as likely, in words

    @property
    def excludes_effects(self) -> bool:
        """Whether no effect that the model lacks looks the same."""
        return self.kind != "mode"

    @property
    def sentence(self) -> str:
        """The words, what would be left, and the next reason."""
        left = ""
        if self.chi2_per_dof is not None:
            left = f" (chi2 per degree of freedom would be {self.chi2_per_dof:.2g})"
        return self.words + left + f" Nearly as likely: {self.also}" * bool(self.also)


@dataclass(frozen=True)
class Shift:
    """A possible reason other than a slip: how ln q of all values would move.

    It is a reason only if it takes half of chi2 away: real tyres are never quite as computed.
    """

    kind: Literal["pressure", "rim", "wheel"]
    columns: Array  # E (n, k): k shifts of unknown amounts; k = 0: the known shift alone
    known: Array  # s (n,): known shift
    words: Callable[[Array], str]  # the sentence, given the likeliest amounts (k,)
    spread: float = 0.2  # t: standard deviation of the amounts, ln of a number's factor


@dataclass(frozen=True)
class Remainder:
    """Remainder of a fit of n values, about the fitted design."""

    rows: Sequence[Measurement]  # the values, as they were measured
    deviation: Array  # d (n,) = ln (measured / model)
    covariance: Array  # C (n, n) of d; up to a factor if no scatter is stated
    sensitivities: Array  # J (n, v) = d ln q / d x
    is_stated: bool = True  # whether the measurements or the case state the scatter

    @cached_property
    def weight(self) -> Array:
        """P (n, n)."""
        inverse = np.linalg.inv(self.covariance)
        weighted = inverse @ self.sensitivities
        information = np.linalg.pinv(self.sensitivities.T @ weighted, hermitian=True)
        return np.asarray(inverse - weighted @ information @ weighted.T)

    @cached_property
    def freedom(self) -> int:
        """Degrees of freedom."""
        return len(self.rows) - int(np.linalg.matrix_rank(self.sensitivities))

    @cached_property
    def chi2(self) -> float:
        """Chi2 at the best design of the linear model."""
        return self.chi2_after(np.zeros(len(self.rows)))

    @property
    def chi2_per_dof(self) -> float | None:
        """None where nothing states a scatter, or there are no more values than variables."""
        return self.chi2 / self.freedom if self.is_stated and self.freedom > 0 else None

    def chi2_after(self, shift: Array) -> float:
        """chi2 with ln q of the model moved by ``shift`` (n,)."""
        moved = self.deviation - shift
        return float(moved @ self.weight @ moved)


def fit_verdict(is_good: bool, chi2_per_dof: float | None) -> FitVerdict:
    """The verdict of a fit; is_good: it converged and moved."""
    if not is_good:
        return NOT_CONVERGED
    if chi2_per_dof is None:
        return NOT_JUDGED
    return DOES_NOT_FIT if chi2_per_dof > MAX_CHI2_PER_DOF else FITS


def does_not_fit_words(chi2_per_dof: float, reason: FitReason | None) -> str:
    """Sentence that a model does not fit, and the likeliest reason."""
    words = f"THE MODEL DOES NOT FIT: chi2 per degree of freedom is {chi2_per_dof:.3g}"
    if reason is None:
        return f"{words}; no slip in the data or in the stated states explains it"
    return f"{words}; likeliest reason: {reason.sentence}"


@dataclass(frozen=True)
class _Suspicion:
    """A reason with what it leaves: chi2, and the numbers that it needs."""

    reason: FitReason
    chi2: float
    parameters: int  # numbers that it frees


def likeliest_reason(left: Remainder, shifts: Sequence[Shift] = ()) -> FitReason | None:
    """The reason that takes most of chi2 away; without one, what the pattern of frequencies of
    tyres finds odd about the values; else None."""
    likely: list[tuple[float, float, FitReason]] = []
    for each in (*_values(left), *_exchanges(left), *_shifts(left, shifts)):
        freedom = left.freedom - each.parameters
        taken = left.chi2 - each.chi2
        if freedom < (1 if left.is_stated else MIN_DEGREES_LEFT) or taken <= 0:
            continue
        per_dof = max(each.chi2, 1e-12 * left.chi2) / freedom
        if left.is_stated and each.reason.kind in KINDS_OF_SLIP and per_dof > MAX_CHI2_PER_DOF:
            continue
        scale, marked = (
            (max(1.0, per_dof), MARKED) if left.is_stated else (per_dof, MARKED_UNSTATED)
        )
        # as Schwarz's criterion: each number that is freed has to gain ln n
        score = taken - each.parameters * np.log(len(left.rows)) * scale
        if taken > marked * scale:
            known = per_dof if left.is_stated else None
            likely.append((score, scale, each.reason.model_copy(update={"chi2_per_dof": known})))
    if likely:
        (score, scale, best), *others = sorted(likely, key=lambda each: -each[0])
        also = others[0][2].words if others and score - others[0][0] < NEXT_REASON * scale else ""
        return best.model_copy(update={"also": also}) if also else best
    return next((FitReason(kind="pattern", words=each) for each in doubts(left.rows)), None)


def _values(left: Remainder) -> Iterator[_Suspicion]:
    """Each value left out."""
    weighted, own = left.weight @ left.deviation, np.diag(left.weight)
    for i, row in enumerate(left.rows):
        if row.quantity in WITHOUT_MODEL_ERROR:
            continue
        if own[i] < MIN_CHECKED / left.covariance[i, i]:
            continue
        model = row.value * float(np.exp(-weighted[i] / own[i]))
        left_chi2 = left.chi2 - float(weighted[i] ** 2 / own[i])
        per_dof = left_chi2 / max(left.freedom - 1, 1)
        scale = max(1.0, per_dof) if left.is_stated else per_dof
        is_alone = _moved_together(left, row) > left_chi2 + NEXT_REASON * scale
        reason = _slip(row, model, float(own[i] ** -0.5), is_alone)
        yield _Suspicion(reason, left_chi2, 1)


def _moved_together(left: Remainder, row: Measurement) -> float:
    """chi2 if an effect moves all values of the row's mode, or quantity, by the same factor."""
    alike = [(r.quantity, r.label) == (row.quantity, row.label) for r in left.rows]
    E = np.array(alike, dtype=float)
    weighted = left.weight @ E
    size = float(E @ weighted)
    taken = float(left.deviation @ weighted) ** 2 / size if size > 0 else 0.0
    return left.chi2 - taken


def _slip(row: Measurement, model: float, sd: float, is_alone: bool) -> FitReason:
    """A value that is off; model: what the model calibrated to the others has, sd its relative
    standard deviation; is_alone: an effect on its mode explains less."""
    unit = "Hz" if row.quantity == "frequency_Hz" else ""
    at = f" at {row.pressure_kPa:g} kPa" * bool(row.pressure_kPa)
    at += f" under {row.load_N:g} N" * bool(row.load_N)
    place = f"{row.place}: " if row.place else ""
    meant = likely_value(row.value, model, max(3 * sd, SAME_VALUE))
    kind: Literal["value", "mode"] = "value" if is_alone or meant is not None else "mode"
    question = "is it a slip, or another mode?" if unit else "is it a slip?"
    if kind == "mode":
        question = "is it a slip, or does the model lack an effect on this mode?"
    if meant is not None:
        question = f"did you mean {meant:.6g}{f' {unit}' if unit else ''}?"
    value, other = (f"{each} {unit}".rstrip() for each in (f"{row.value:.6g}", f"{model:.4g}"))
    words = (
        f"{place}{row.name} is {value}{at}, where the model calibrated to the other values has"
        f" {other}: {question}"
    )
    return FitReason(kind=kind, words=words)


def likely_value(value: float, model: float, tolerance: float) -> float | None:
    """The value with its decimal point moved, or two neighbouring digits exchanged, that is within
    a relative ``tolerance`` of the model's and nearest to it; None where none is."""
    text = f"{value:.6g}"
    candidates = [10 * value, value / 10]
    digits = [i for i, each in enumerate(text) if each.isdigit()]
    for i, j in pairwise(digits):
        letters = list(text)
        letters[i], letters[j] = letters[j], letters[i]
        candidates.append(float("".join(letters)))
    near = {each: abs(each / model - 1) for each in candidates if each > 0 and each != value}
    best = min(near, key=lambda each: near[each], default=value)
    limit = min(tolerance, abs(value / model - 1) / 3)
    return best if near.get(best, np.inf) < limit else None


def _exchanges(left: Remainder) -> Iterator[_Suspicion]:
    """On each rim, the exchange of two pressures or labels that takes most away."""
    logs = np.log([row.value for row in left.rows])
    unloaded = [i for i, r in enumerate(left.rows) if r.quantity == "frequency_Hz" and not r.load_N]
    rim = lambda i: left.rows[i].rim or ""
    for _, group in groupby(sorted(unloaded, key=rim), rim):
        places = list(group)

        def gain(order: Sequence[int], places: list[int] = places) -> float:
            shift = np.zeros(len(logs))
            shift[places] = logs[places] - logs[[places[i] for i in order]]
            return left.chi2 - left.chi2_after(shift)

        taken, _, words = likeliest_exchange([left.rows[i] for i in places], gain)
        if words:
            yield _Suspicion(FitReason(kind="exchanged", words=words), left.chi2 - taken, 0)


def _shifts(left: Remainder, shifts: Sequence[Shift]) -> Iterator[_Suspicion]:
    """The other states and constants."""
    for each in shifts:
        E, taken = each.columns, left.chi2 - left.chi2_after(each.known)
        amounts = np.zeros(E.shape[1])
        if len(amounts):
            gradient = E.T @ left.weight @ (left.deviation - each.known)
            amounts = np.linalg.solve(
                E.T @ left.weight @ E + np.eye(len(amounts)) / each.spread**2, gradient
            )
            taken += float(gradient @ amounts)
        if taken > left.chi2 / 2:
            reason = FitReason(kind=each.kind, words=each.words(amounts))
            yield _Suspicion(reason, left.chi2 - taken, len(amounts))
