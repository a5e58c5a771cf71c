"""A tyre's frequencies within a box of its variables, from a few dozen evaluations with slopes.

In the box, t = (x - centre) / half, |t_j| <= 1, x the logarithms of the variables:

    q(t) = sum over |k| <= D of a_k P_k1(t_1) P_k2(t_2) ...    (P: Legendre's polynomials)

by least squares of values and slopes together: an evaluation gives 1 + v equations. q is ln f of
every mode but the two [0, 0] ones. Where those meet, they avoid each other and change names: not
they are smooth, but the trace and the discriminant of the 2 x 2 problem that they solve (see
fit/crossing.py),

    m = (ln f_axial + ln f_torsional) / 2,    s = (ln f_axial - ln f_torsional)^2

and so is the difference without their coupling, d = (ln f_axial - ln f_torsional) c, c the
clearness of their names; its sign says which of m +- sqrt(s) / 2 is the axial one.

The error: each design is left out in turn, and what the others say there is compared with it. With
M = Q R, rows i of one design, H = Q Q^T (Cook and Weisberg, Residuals and Influence, sec. 2.2):

    residual of the design left out = (1 - H_ii)^-1 (q - M a)_i

The degree D is that of the least such error; stated is a bound that 99 % of designs keep, see
`bound`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.polynomial import legendre

from ..errors import InputError
from ..simulate.evaluate.evaluator import Evaluator, Question
from ..simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ..simulate.modes.find import Found, find_modes
from ..simulate.modes.label import Label, labelled
from .fit.crossing import AXIAL, TORSIONAL
from .fit.variable import DesignVariable

Array = np.ndarray
PAIR = (AXIAL, TORSIONAL)
DEGREES = range(1, 9)
SPARE_EQUATIONS = 1.3  # equations for each coefficient, at least
LEAST_DESIGNS = 3  # designs that a bound can be told from
SIDE_DEGREE = 2  # of d, whose sign alone counts; from values, for the slopes of c are not known
SEEN = 1e-12  # a relative error that rounding makes
SHARE_Z, SURE_Z = 2.326, 1.645  # normal quantiles of 99 and 95 %


@dataclass(frozen=True)
class Evaluated:
    """An evaluated design: t (v,); of each label ln f (n,) and d ln f / d t (n, v); d, see above,
    0 where the two [0, 0] modes are not both wanted."""

    t: Array
    value: Array
    slope: Array
    apart: float


@dataclass(frozen=True)
class Emulator:
    """Frequencies of ``labels`` for any design in the box, by what `fitted` found.

    degrees (k, v) of the products; coefficients (k, n + 1), the last of d; errors, relative: the
    median of all; of each label (n,) what 99 % of designs keep; what they keep in all labels.
    """

    variables: tuple[DesignVariable, ...]
    labels: tuple[Label, ...]
    centre: Array
    half: Array
    degrees: Array
    coefficients: Array
    evaluations: int
    failed: int  # designs of the box that could not be evaluated
    median_error: float
    stated_errors: Array
    stated_error: float

    def frequencies(self, values: Mapping[str, float]) -> dict[Label, float]:
        """Hz by label of a design, by the values of its variables; those not given are at their
        start. Raises ValueError for an unknown name, and outside the box."""
        names = [v.name for v in self.variables]
        if unknown := set(values) - set(names):
            raise ValueError(f"there is no variable '{min(unknown)}', only {', '.join(names)}")
        x = np.array([v.scaled(values.get(v.name, v.start)) for v in self.variables])
        for v, t, edges in zip(
            self.variables, (x - self.centre) / self.half, self.box, strict=True
        ):
            if abs(t) > 1 + 1e-9:
                low, high = map(v.value, edges)
                raise ValueError(
                    f"{v.name} is {values.get(v.name, v.start):g}: the emulator knows"
                    f" {low:g} to {high:g}"
                )
        hertz = np.exp(self.ln_f(x[None])[0])
        return dict(zip(self.labels, hertz.tolist(), strict=True))

    @property
    def box(self) -> Array:
        """Ends (v, 2) of the box in x."""
        return np.stack([self.centre - self.half, self.centre + self.half], 1)

    def ln_f(self, x: Array) -> Array:
        """ln f (p, n) at designs x (p, v), whether they are in the box or not."""
        q = products(self.degrees, (x - self.centre) / self.half) @ self.coefficients
        return unpaired(self.labels, q[:, :-1], q[:, -1])

    def slopes(self, x: Array) -> Array:
        """d ln f / d x (p, n, v) at designs x (p, v)."""
        t = (x - self.centre) / self.half
        q = products(self.degrees, t) @ self.coefficients
        rise = [products(self.degrees, t, j) @ self.coefficients for j in range(len(self.half))]
        found = np.stack(rise, 2)[:, :-1] / self.half
        if (pair := places(self.labels)) is not None:
            a, b = (
                pair  # the slope of sqrt(s) is that of s over 2 sqrt(s); none where s is cut at 0
            )
            root = np.sqrt(np.where(q[:, b] > SEEN**2, q[:, b], np.inf))
            root *= np.where(q[:, -1] < 0, -1.0, 1.0)
            mean, gap = found[:, a].copy(), found[:, b] / (2 * root[:, None])
            found[:, a], found[:, b] = mean + gap / 2, mean - gap / 2
        return found


def emulator(
    evaluator: Evaluator,
    variables: Sequence[DesignVariable],
    box: Sequence[Sequence[float]] | Array,
    wanted: Sequence[Label],
    count: int,
    jobs: int = 1,
) -> Emulator:
    """Ask for ``count`` designs of a box (v, 2) of x, all at once, and fit their frequencies.

    wanted: labels that every design must have; others with m <= 1 are taken where all have them.
    Raises InputError where the solver has no slopes, or of too small a count; EvaluationFailed
    where too few designs could be evaluated; DeckRefused.
    """
    needs_slopes(evaluator)
    if count < LEAST_DESIGNS:
        raise InputError(f"an emulator needs {LEAST_DESIGNS} evaluations at least, got {count}")
    centre, half = np.mean(box, 1), np.ptp(box, axis=1) / 2
    names = tuple(v.name for v in variables)
    t = spread(count, len(names))
    designs = [
        {v.name: v.value(float(x)) for v, x in zip(variables, centre + half * each, strict=True)}
        for each in t
    ]
    questions = [Question(design, names) for design in designs]
    answers = dict(find_modes(evaluator, questions, wanted, jobs))
    found: list[tuple[int, Found]] = []
    for place, answer in sorted(answers.items()):
        if isinstance(answer, DeckRefused):
            raise answer
        if isinstance(answer, Found):
            found.append((place, answer))
    if len(found) < LEAST_DESIGNS:
        raise next(a for a in answers.values() if isinstance(a, EvaluationFailed))
    hertz = [{m.label: m for m in labelled(answer.evaluation)} for _, answer in found]
    shared = set.intersection(*map(set, hertz))
    more = {label for label in shared if label.m <= 1} - set(wanted)
    labels = [*wanted, *sorted(more, key=lambda x: (x.c, x.m, x.kind or ""))]
    samples = []
    for (place, answer), modes in zip(found, hertz, strict=True):
        own, gradients = [modes[label] for label in labels], answer.evaluation.gradients
        f = np.array([mode.frequency_Hz for mode in own])
        per_t = [h * v.slope(designs[place][v.name]) for h, v in zip(half, variables, strict=True)]
        rise = np.array([[gradients[n][mode.position] for n in names] for mode in own]) * per_t
        apart = 0.0
        if set(PAIR) <= set(labels):
            axial, torsional = (modes[label] for label in PAIR)
            clear = min(axial.clarity, torsional.clarity)
            apart = float(np.log(axial.frequency_Hz / torsional.frequency_Hz)) * clear
        samples.append(Evaluated(t[place], np.log(f), rise / f[:, None], apart))
    return fitted(tuple(variables), labels, centre, half, samples, count - len(found))


def needs_slopes(evaluator: Evaluator) -> None:
    """Raises InputError where the solver gives no exact slopes."""
    if not evaluator.has_gradients:
        raise InputError(
            f"solver '{evaluator.solver.name}' gives no exact slopes of this case, which an"
            " emulator is made of: 'tyrecal solvers' shows which one does (gradients)"
        )


def fitted(
    variables: tuple[DesignVariable, ...],
    labels: Sequence[Label],
    centre: Array,
    half: Array,
    samples: Sequence[Evaluated],
    failed: int = 0,
) -> Emulator:
    """The polynomials of evaluated designs, and how far they are off those that are left out."""
    t = np.array([each.t for each in samples])
    value, slope = paired(labels, samples)
    apart = np.array([each.apart for each in samples])
    own = np.array([each.value for each in samples])
    equations = np.concatenate([value, *np.moveaxis(slope, 2, 0)])
    best: Emulator | None = None
    for degree in DEGREES:
        degrees = up_to(t.shape[1], degree)
        if len(degrees) * SPARE_EQUATIONS > len(equations) and best:
            break
        rows = [products(degrees, t), *(products(degrees, t, j) for j in range(t.shape[1]))]
        coefficients, left_out = _left_out(np.concatenate(rows), equations, len(samples))
        error = abs(unpaired(labels, value - left_out, apart) - own)
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
                len(samples),
                failed,
                float(np.median(error)),
                np.minimum([bound(each) for each in error.T], stated),
                stated,
            )
    assert best
    return best


def _left_out(matrix: Array, equations: Array, count: int) -> tuple[Array, Array]:
    """Coefficients (k, n), and residuals (count, n) of the values of each design left out."""
    orthonormal, triangle = np.linalg.qr(matrix)
    a = np.linalg.lstsq(triangle, orthonormal.T @ equations, None)[0]
    residual = equations - matrix @ a
    found = []
    for i in range(count):
        own = orthonormal[i::count]  # its value, and its slopes
        rest = np.eye(len(own)) - own @ own.T
        found.append(np.linalg.lstsq(rest, residual[i::count], None)[0][0])
    return a, np.array(found)


def bound(errors: Array) -> float:
    """What 99 % of designs keep, with a confidence of 95 %: the one-sided tolerance limit of
    log-normal errors (n,) (NIST/SEMATECH e-Handbook, sec. 7.2.6.3), and no less than any seen.

        ln bound = mean + K sd,  K = (z_p + sqrt(z_p^2 - a b)) / a,
        a = 1 - z_g^2 / (2 (n - 1)),  b = z_p^2 - z_g^2 / n
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


def paired(labels: Sequence[Label], samples: Sequence[Evaluated]) -> tuple[Array, Array]:
    """q (p, n) and d q / d t (p, n, v): m and s in the places of the two [0, 0] modes."""
    q = np.array([each.value for each in samples])
    slope = np.array([each.slope for each in samples])
    if (pair := places(labels)) is not None:
        a, b = pair
        gap, rise = q[:, a] - q[:, b], slope[:, a] - slope[:, b]
        q[:, a], q[:, b] = (q[:, a] + q[:, b]) / 2, gap**2
        slope[:, a], slope[:, b] = (slope[:, a] + slope[:, b]) / 2, 2 * gap[:, None] * rise
    return q, slope


def unpaired(labels: Sequence[Label], q: Array, apart: Array) -> Array:
    """ln f (p, n) of what is smooth, q (p, n); apart (p,): d."""
    found = q.copy()
    if (pair := places(labels)) is not None:
        a, b = pair
        gap = np.where(apart < 0, -1.0, 1.0) * np.sqrt(np.maximum(q[:, b], 0.0))
        found[:, a], found[:, b] = q[:, a] + gap / 2, q[:, a] - gap / 2
    return found


def up_to(count: int, degree: int) -> Array:
    """Degrees (k, count) of all products up to a total degree, the constant first."""
    rows = [np.zeros(count, int)]
    for total in range(1, degree + 1):
        for chosen in combinations_with_replacement(range(count), total):
            rows.append(np.bincount(chosen, minlength=count))
    return np.array(rows)


def products(degrees: Array, t: Array, by: int = -1) -> Array:
    """P_k(t) (p, k) at t (p, v), or their slopes by one coordinate."""
    highest = int(degrees.max())
    table = legendre.legvander(t, highest)  # (p, v, degree + 1)
    if by >= 0:
        table[:, by] = legendre.legval(t[:, by], legendre.legder(np.eye(highest + 1))).T
    return np.asarray(np.prod(table[:, range(t.shape[1]), degrees], axis=2))


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
