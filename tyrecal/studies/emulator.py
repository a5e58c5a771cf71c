"""A tyre's frequencies within a box of its variables, from a few dozen evaluations with slopes.

In the box, t = (x - centre) / half, |t_j| <= 1, x the logarithms of the variables:

    q(t) = sum over |k| <= D of a_k P_k1(t_1) P_k2(t_2) ...    (P: Legendre's polynomials)

by least squares of values and slopes together: an evaluation gives 1 + v equations. q is ln f of
every mode except the two [0, 0] ones. Where those meet, they avoid each other and change names.
Then their frequencies are not smooth, but the trace and the discriminant of the 2 x 2 problem that
they solve are (`fit.crossing`),

    m = (ln f_axial + ln f_torsional) / 2,    s = (ln f_axial - ln f_torsional)^2

and so is the difference without their coupling, d = (ln f_axial - ln f_torsional) c, c the
smaller clarity of their labels; its sign says which of m +- sqrt(s) / 2 is the axial one.

The error: each design is left out in turn, and what the others say there is compared with it. With
the equations M a = q, M = Q R, rows i of one design, H = Q Q^T (Cook and Weisberg, Residuals and
Influence, sec. 2.2):

    residual of the design left out = (1 - H_ii)^-1 (q - M a)_i

The degree D is that of the least such error; stated is a bound that 99 % of designs keep, see
`bound`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement
from math import log
from numbers import Real

import numpy as np

from ..errors import InputError
from ..simulate.evaluate.evaluator import Evaluator, Question
from ..simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ..simulate.modes.find import LabelledModes, find_modes
from ..simulate.modes.label import Label
from .fit.crossing import AXIAL, PAIR, TORSIONAL
from .variable import DesignVariable

Array = np.ndarray
DEGREES = range(1, 9)
SPARE_EQUATIONS = 1.3  # equations for each coefficient, at least
MIN_DESIGNS = 3  # designs that a bound can be told from
SIDE_DEGREE = 2  # of d, whose sign alone counts; from values, for the slopes of c are not known
SEEN = 1e-12  # a relative error that rounding makes
SHARE_Z, SURE_Z = 2.326, 1.645  # normal quantiles of 99 and 95 %


@dataclass(frozen=True)
class Evaluated:
    """An evaluated design."""

    x: Array  # (v,) logarithms of the variables
    ln_f: Mapping[Label, float]  # ln of Hz
    slopes: Mapping[Label, Array]  # (v,) d ln f / d x
    apart: float  # d, see above; 0 if the two [0, 0] modes are not both there


@dataclass(frozen=True)
class Emulator:
    """Frequencies of n labels for any design in the box, by polynomials.

    >>> import tyrecal
    >>> surrogate = tyrecal.emulate(case, reach=0.1, evaluations=10)
    >>> min(surrogate.frequencies({"C10": 1.05e6}).values()) > 36
    True
    """

    variables: tuple[DesignVariable, ...]
    labels: tuple[Label, ...]
    centre: Array  # (v,) middle of the box in x
    half: Array  # (v,) half widths of the box in x
    degrees: Array  # (k, v) degrees of the k products of polynomials
    coefficients: Array  # (k, n + 1) of ln f of each label, m and s for the two [0, 0], then of d
    designs: tuple[Evaluated, ...]  # from which it was made
    failed: int  # number of designs of the box that could not be evaluated
    median_error: float  # relative, of all frequencies
    stated_errors: Array  # (n,) relative errors that 99 % of designs keep, by label
    stated_error: float  # relative error that 99 % of designs keep in all labels
    error_covariance: Array  # (n, n) covariance of the relative errors of the labels in a design

    def __repr__(self) -> str:
        names = ", ".join(v.name for v in self.variables)
        made = f"{self.evaluations} evaluations, stated error {self.stated_error:.2g}"
        return f"Emulator({len(self.labels)} modes by {names}: {made})"

    def frequencies(self, values: Mapping[str, float]) -> dict[Label, float]:
        """Hz by label of a design, by the values of its variables; those not given are at their
        start. Raises InputError for an unknown name, and outside the box."""
        names = [v.name for v in self.variables]
        if not isinstance(values, Mapping):
            raise InputError(f"values must be names with values, got {values!r}")
        for name, value in values.items():
            if name not in names:
                raise InputError(f"there is no variable '{name}', only {', '.join(names)}")
            if not isinstance(value, Real):
                raise InputError(f"{name} is {value!r}, must be a number")
        given = [(v, values.get(v.name, v.start)) for v in self.variables]
        x = np.array([v.scaled(y) if y > 0 or not v.log else -np.inf for v, y in given])
        for v, t, edges in zip(
            self.variables, (x - self.centre) / self.half, self.box, strict=True
        ):
            if not abs(t) <= 1 + 1e-9:
                low, high = map(v.value, edges)
                raise InputError(
                    f"{v.name} is {values.get(v.name, v.start):g}: the emulator covers"
                    f" {low:g} to {high:g}"
                )
        hertz = np.exp(self.ln_f(x[None])[0])
        return dict(zip(self.labels, hertz.tolist(), strict=True))

    @cached_property
    def pair(self) -> tuple[int, int] | None:
        """`places` of its labels."""
        return places(self.labels)

    @property
    def evaluations(self) -> int:
        """Number of designs that could be evaluated."""
        return len(self.designs)

    @property
    def box(self) -> Array:
        """Ends (v, 2) of the box in x."""
        return np.stack([self.centre - self.half, self.centre + self.half], 1)

    def restricted(self, last: Array) -> Emulator:
        """Emulator of the first variables alone, the coordinates x of the others being ``last``
        (s,)."""
        v = len(self.half) - len(last)
        t = (last - self.centre[v:]) / self.half[v:]
        degrees, place = np.unique(self.degrees[:, :v], axis=0, return_inverse=True)
        coefficients = np.zeros((len(degrees), self.coefficients.shape[1]))
        factors = products(self.degrees[:, v:], t[None]).T
        np.add.at(coefficients, place.ravel(), factors * self.coefficients)
        return replace(
            self,
            variables=self.variables[:v],
            centre=self.centre[:v],
            half=self.half[:v],
            degrees=degrees,
            coefficients=coefficients,
        )

    def ln_f(self, x: Array) -> Array:
        """ln f (p, n) at designs x (p, v), whether they are in the box or not."""
        return self.ln_f_of(self.products(x))

    def products(self, x: Array) -> Array:
        """Products of which all polynomials consist, (p, k) at designs x (p, v), at any
        `restricted`."""
        return products(self.degrees, (x - self.centre) / self.half)

    def ln_f_of(self, terms: Array) -> Array:
        """`ln_f` (p, n) of the p designs that have these ``products``."""
        q = terms @ self.coefficients
        return unpaired(self.pair, q[:, :-1], q[:, -1])

    def slopes(self, x: Array) -> Array:
        """d ln f / d x (p, n, v) at designs x (p, v)."""
        t = (x - self.centre) / self.half
        q = products(self.degrees, t) @ self.coefficients
        rise = [products(self.degrees, t, j) @ self.coefficients for j in range(len(self.half))]
        slopes = np.stack(rise, 2)[:, :-1] / self.half
        if self.pair is not None:
            # the slope of sqrt(s) is that of s over 2 sqrt(s); none where s is cut at 0
            a, b = self.pair
            root = np.sqrt(np.where(q[:, b] > SEEN**2, q[:, b], np.inf))
            root *= np.where(q[:, -1] < 0, -1.0, 1.0)
            mean, gap = slopes[:, a].copy(), slopes[:, b] / (2 * root[:, None])
            slopes[:, a], slopes[:, b] = mean + gap / 2, mean - gap / 2
        return slopes


def emulator(
    evaluator: Evaluator,
    variables: Sequence[DesignVariable],
    box: Sequence[Sequence[float]] | Array,
    wanted: Sequence[Label],
    count: int,
    jobs: int = 1,
    before: Emulator | None = None,
) -> Emulator:
    """Ask for ``count`` designs of a box (v, 2) of x, all at once, and fit their frequencies.

    wanted: labels that every design must have; others with m <= 1 are taken where all have them;
    before: of the same box or a part of it; its designs stand for as many as would lie there.
    Raises InputError of too small a count; EvaluationFailed where too few designs could be
    evaluated; DeckRefused.
    """
    if count < MIN_DESIGNS:
        raise InputError(f"an emulator needs {MIN_DESIGNS} evaluations at least, got {count}")
    centre, half = np.mean(box, 1), np.ptp(box, axis=1) / 2
    names = tuple(v.name for v in variables)
    x, samples, failed = centre + half * spread(count, len(names)), [], 0
    if before:
        samples, failed = list(before.designs), before.failed
        there = ((before.box[:, 0] <= x) & (x <= before.box[:, 1])).all(1)
        x = x[~there | (np.cumsum(there) > len(samples) + failed)]
    designs = [
        {v.name: v.value(float(xi)) for v, xi in zip(variables, each, strict=True)} for each in x
    ]
    questions = [Question(design, names) for design in designs]
    answers = dict(find_modes(evaluator, questions, wanted, jobs)) if questions else {}
    for place, answer in sorted(answers.items()):
        if isinstance(answer, DeckRefused):
            raise answer
        if isinstance(answer, LabelledModes):
            samples.append(_evaluated(x[place], answer, variables))
        else:
            failed += 1
    if len(samples) < MIN_DESIGNS:
        raise next(a for a in answers.values() if isinstance(a, EvaluationFailed))
    shared = set.intersection(*(set(each.ln_f) for each in samples))
    more = {label for label in shared if label.m <= 1} - set(wanted)
    labels = [*wanted, *sorted(more, key=lambda x: (x.c, x.m, x.kind or ""))]
    return fitted(tuple(variables), labels, centre, half, samples, failed)


def _evaluated(x: Array, answer: LabelledModes, variables: Sequence[DesignVariable]) -> Evaluated:
    """The design x (v,) with ln f and its slopes by x, from the labelled modes."""
    modes, gradients = {mode.label: mode for mode in answer.modes}, answer.evaluation.gradients
    per_x = [v.slope(v.value(float(xi))) for v, xi in zip(variables, x, strict=True)]
    by_name = np.array([gradients[v.name] for v in variables])  # (v, modes)
    rise = {label: by_name[:, m.position] * per_x / m.frequency_Hz for label, m in modes.items()}
    modes = {label: m for label, m in modes.items() if np.isfinite(rise[label]).all()}
    apart = 0.0
    if set(PAIR) <= set(modes):
        axial, torsional = (modes[label] for label in PAIR)
        clear = min(axial.clarity, torsional.clarity)
        apart = log(axial.frequency_Hz / torsional.frequency_Hz) * clear
    return Evaluated(x, {label: log(m.frequency_Hz) for label, m in modes.items()}, rise, apart)


def fitted(
    variables: tuple[DesignVariable, ...],
    labels: Sequence[Label],
    centre: Array,
    half: Array,
    samples: Sequence[Evaluated],
    failed: int = 0,
) -> Emulator:
    """The polynomials of evaluated designs, and how far they are off those that are left out."""
    t = np.array([(each.x - centre) / half for each in samples])
    own = np.array([[each.ln_f[label] for label in labels] for each in samples])
    rise = np.array([[each.slopes[label] * half for label in labels] for each in samples])
    pair = places(labels)
    value, slope = paired(pair, own, rise)
    apart = np.array([each.apart for each in samples])
    equations = np.concatenate([value, *np.moveaxis(slope, 2, 0)])
    best: Emulator | None = None
    for degree in DEGREES:
        degrees = up_to(t.shape[1], degree)
        if len(degrees) * SPARE_EQUATIONS > len(equations) and best:
            break
        rows = [products(degrees, t), *(products(degrees, t, j) for j in range(t.shape[1]))]
        coefficients, left_out = _left_out(np.concatenate(rows), equations, len(samples))
        signed = unpaired(pair, value - left_out, apart) - own
        error = abs(signed)
        stated = bound(error.max(1))
        if best is None or stated < best.stated_error:
            few = (degrees.sum(1) <= SIDE_DEGREE).sum()
            side = np.zeros(len(degrees))
            side[:few] = np.linalg.lstsq(rows[0][:, :few], apart, None)[0]
            best = Emulator(
                variables,
                tuple(labels),
                centre,
                half,
                degrees,
                np.column_stack([coefficients, side]),
                tuple(samples),
                failed,
                float(np.median(error)),
                np.minimum([bound(each) for each in error.T], stated),
                stated,
                signed.T @ signed / len(samples),
            )
    assert best
    return best


def _left_out(matrix: Array, equations: Array, count: int) -> tuple[Array, Array]:
    """Coefficients (k, n), and residuals (count, n) of the values of each design left out."""
    orthonormal, triangle = np.linalg.qr(matrix)
    a = np.linalg.lstsq(triangle, orthonormal.T @ equations, None)[0]
    of_designs = lambda rows: rows.reshape(-1, count, rows.shape[1]).swapaxes(0, 1)
    own = of_designs(orthonormal)  # (count, 1 + v, k): of its value, and of its slopes
    rest = np.eye(own.shape[1]) - own @ own.swapaxes(1, 2)
    residual = of_designs(equations - matrix @ a)
    return a, (np.linalg.pinv(rest, hermitian=True)[:, :1] @ residual)[:, 0]


def bound(errors: Array) -> float:
    """Bound that 99 % of designs keep, with a confidence of 95 %: the one-sided tolerance limit of
    log-normal errors (n,) (NIST/SEMATECH e-Handbook, sec. 7.2.6.3), and no less than any seen.

        ln bound = mean + K sd,  K = (z_p + sqrt(z_p^2 - a b)) / a,
        a = 1 - z_g^2 / (2 (n - 1)),  b = z_p^2 - z_g^2 / n,

    z_p and z_g the normal quantiles of the share, 99 %, and of the confidence.
    """
    ln, n = np.log(errors + SEEN), len(errors)
    a, b = 1 - SURE_Z**2 / (2 * (n - 1)), SHARE_Z**2 - SURE_Z**2 / n
    limit = np.exp(ln.mean() + (SHARE_Z + np.sqrt(SHARE_Z**2 - a * b)) / a * ln.std(ddof=1))
    return float(max(limit, errors.max()))


def places(labels: Sequence[Label]) -> tuple[int, int] | None:
    """Where the two [0, 0] modes stand, the axial one first; None where they are not both there."""
    if not set(PAIR) <= set(labels):
        return None
    return labels.index(AXIAL), labels.index(TORSIONAL)


def paired(pair: tuple[int, int] | None, ln_f: Array, slopes: Array) -> tuple[Array, Array]:
    """q (p, n) and d q / d t (p, n, v) of ln f and its slopes: m and s in the `places` of the two
    [0, 0] modes."""
    q, slope = ln_f.copy(), slopes.copy()
    if pair is not None:
        a, b = pair
        gap, rise = q[:, a] - q[:, b], slope[:, a] - slope[:, b]
        q[:, a], q[:, b] = (q[:, a] + q[:, b]) / 2, gap**2
        slope[:, a], slope[:, b] = (slope[:, a] + slope[:, b]) / 2, 2 * gap[:, None] * rise
    return q, slope


def unpaired(pair: tuple[int, int] | None, q: Array, apart: Array) -> Array:
    """ln f (p, n) of what is smooth, q (p, n); pair: the `places`; apart (p,): d."""
    mixed = q.copy()
    if pair is not None:
        a, b = pair
        gap = np.where(apart < 0, -1.0, 1.0) * np.sqrt(np.maximum(q[:, b], 0.0))
        mixed[:, a], mixed[:, b] = q[:, a] + gap / 2, q[:, a] - gap / 2
    return mixed


def up_to(count: int, degree: int) -> Array:
    """Degrees (k, count) of all products up to a total degree, the constant first."""
    rows = [np.zeros(count, int)]
    for total in range(1, degree + 1):
        for chosen in combinations_with_replacement(range(count), total):
            rows.append(np.bincount(chosen, minlength=count))
    return np.array(rows)


def products(degrees: Array, t: Array, by: int = -1) -> Array:
    """P_k(t) (p, k) at t (p, v), or their slopes by one coordinate."""
    P = legendre(t, int(degrees.max(initial=0)))
    result = np.ones((len(degrees), len(t)))
    for j, own in enumerate(degrees.T):
        result *= (_rates(P) if j == by else P)[own, j]
    return result.T


def legendre(t: Array, highest: int) -> Array:
    """P_n(t) (highest + 1, v, p): (n + 1) P_n+1 = (2 n + 1) t P_n - n P_n-1 (Bonnet)."""
    P = np.ones((highest + 1, *t.T.shape))
    P[1:2] = t.T
    for n in range(1, highest):
        P[n + 1] = ((2 * n + 1) / (n + 1) * t.T) * P[n] - n / (n + 1) * P[n - 1]
    return P


def _rates(P: Array) -> Array:
    """P'_n of `legendre`, of its shape: P'_n+1 = P'_n-1 + (2 n + 1) P_n."""
    rates = np.zeros_like(P)
    for n in range(len(P) - 1):
        rates[n + 1] = (rates[n - 1] if n else 0.0) + (2 * n + 1) * P[n]
    return rates


def spread(count: int, dimensions: int) -> Array:
    """Designs t (count, dimensions), evenly spread: the numbers 1, 2, ... with their digits behind
    the point in reverse order, to the base of a prime for each coordinate (Halton 1960)."""
    primes = [n for n in range(2, 20 + dimensions**2) if all(n % k for k in range(2, n))]
    t = np.zeros((count, dimensions))
    for j, base in enumerate(primes[:dimensions]):
        rest, place = np.arange(1, count + 1), 1.0
        while rest.any():
            place /= base
            t[:, j] += place * (rest % base)
            rest //= base
    return 2 * t - 1
