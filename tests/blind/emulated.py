"""A model evaluated once for many tyres: polynomials in the design variables between its answers.

eta (n,) are the n rows of the model, ln f of each mode and pressure and ln mass (see
`inference.model`). x (v,) are the logarithms of the v design variables. e is the parameter of an
effect, 0 if it is absent. About the centre x0, with t = (x - x0) / reach, |t| <= 1:

    eta(x, e) = sum_k a_k q_k(t) + sum over effects of sum_j L_j(e) sum_k b_jk q_k(t)

q_k: products of Legendre's polynomials, as in `studies.emulator`; their coefficients a_k and b_jk
(n,) are fitted by least squares to values and Jacobians at designs of a Halton sequence. L_j:
Lagrange's polynomials of the effect's nodes, 0 among them. Changes by the sources of error
(`ResponseModel.sources`) are emulated in the same way. Two quantities hardly change with x: the
coupling of near modes (`Coupling`) is that of the nearest design, and the shift by an effect's
uncertain shape (`Query.shape_uncertainty`) is that of the centre. Beyond the box the model goes
straight on, with the slopes at its nearest point.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from tyrecal.studies.emulator import products, up_to
from tyrecal.studies.inference.expansion import derivatives, lagrange
from tyrecal.studies.inference.model import Answer, Coupling, EffectRange, Query, ResponseModel

Array = np.ndarray
# half width of the box in ln of a variable: blind trials draw within 0.4, and an effect that a fit
# ignores moves its variables by the rest
REACH = 0.8
PLAIN_DEGREE, EFFECT_DEGREE, SOURCE_DEGREE = 4, 3, 2  # of polynomials in the variables
PLAIN_DESIGNS, EFFECT_DESIGNS, SOURCE_DESIGNS = 20, 10, 12  # designs that these are fitted to
# nodes of an effect, of each end of its range
ONE_SIDED_SHARES, TWO_SIDED_SHARES = (0.1, 0.4, 0.75, 1.0), (0.5, 1.0)
SEED = 1
REWEIGHTED = 12  # iterations of Huber's estimator
HUBER = 2.0  # medians of the absolute residual beyond which an equation weighs less
MIN_SCALE = 1e-5  # of ln f: smallest residual from which weights fall, far below model errors


@dataclass(frozen=True)
class Polynomial:
    """Polynomial in the design variables t."""

    degrees: Array  # (k, v) of each of k products of polynomials in each variable
    coefficients: Array  # (k, n) of each product in each row

    def at(self, t: Array) -> tuple[Array, Array]:
        """Values (n,) and slopes by t (n, v) at t (v,)."""
        slopes = [products(self.degrees, t[None], j)[0] for j in range(len(t))]
        values = products(self.degrees, t[None])[0] @ self.coefficients
        return values, (np.array(slopes) @ self.coefficients).T


@dataclass(frozen=True)
class EmulatedEffect:
    """Shift that an effect adds, by Lagrange interpolation between its nodes."""

    nodes: Array  # (k,) values of the parameter where it was evaluated, 0 left out
    added: tuple[Polynomial, ...]  # at each node: change of eta
    split: tuple[Polynomial, ...]  # at each node: distance of a pair's two modes, in ln f
    shape_uncertainty: Mapping[float, Array]  # (n,) by end of the range, see `Answer`

    def slope(self, e: float, t: Array) -> Array:
        """d eta / d e (n,) at parameter e."""
        nodes = np.append(self.nodes, 0.0)
        weights = (lagrange(nodes, np.array([e])) @ derivatives(nodes))[0, :-1]
        return np.tensordot(weights, [p.at(t)[0] for p in self.added], 1)

    def at(self, e: float, t: Array) -> tuple[Array, Array, Array]:
        """Added eta (n,), its slopes (n, v) by t, and split (n,) of pairs, at parameter e."""
        weights = lagrange(np.append(self.nodes, 0.0), np.array([e]))[0, :-1]
        values, tilts = zip(*(p.at(t) for p in self.added), strict=True)
        splits = [p.at(t)[0] for p in self.split]
        eta, slope, split = (np.tensordot(weights, part, 1) for part in (values, tilts, splits))
        return eta, slope, split


class Emulated:
    """A `ResponseModel` that stands for ``model`` within ``reach`` of its start, and for a straight
    one beyond."""

    def __init__(
        self,
        model: ResponseModel,
        reach: float,
        plain: Polynomial,
        constants: Polynomial,
        effects: Mapping[str, EmulatedEffect],
        couplings: Sequence[tuple[Array, Coupling | None]] = (),
    ):
        self.model, self.reach = model, reach
        self.variables, self.sources = model.variables, model.sources
        self.start, self.spread = model.start, model.spread
        self.material_laws = model.material_laws
        self.ranges: Mapping[str, EffectRange] = {
            k: s for k, s in model.ranges.items() if k in effects
        }
        self.sloped: Collection[str] = {id for id in model.sloped if id in effects}
        self.sloped_at_0: Collection[str] = {id for id in model.sloped_at_0 if id in effects}
        self._plain, self._constants, self._effects = plain, constants, effects
        self._couplings = couplings

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """Answers from the polynomials; from the model where an effect has none."""
        far = [i for i, point in enumerate(points) if not set(point.effects) <= set(self._effects)]
        far_answers = self.model.answers([points[i] for i in far]) if far else []
        known = dict(zip(far, far_answers, strict=True))
        return [known[i] if i in known else self._answer(p) for i, p in enumerate(points)]

    def _answer(self, point: Query) -> Answer:
        """Answer to a query by the polynomials."""
        there = (point.x - self.start) / self.reach
        t = np.clip(there, -1.0, 1.0)
        eta, slope = self._plain.at(t)
        split, uncertain = np.zeros(len(eta)), None
        for id, e in point.effects.items():
            added, tilt, apart = self._effects[id].at(e, t)
            eta, slope, split = eta + added, slope + tilt, np.hypot(split, apart)
            if point.shape_uncertainty:
                uncertain = self._effects[id].shape_uncertainty.get(e)
        constants = None
        if point.constants:
            constants = self._constants.at(t)[0].reshape(len(eta), -1)
        coupling = None
        if point.coupled and self._couplings:
            coupling = min(self._couplings, key=lambda known: float(abs(known[0] - t).max()))[1]
        straight, slope = eta + slope @ (there - t), slope / self.reach
        by_effect = {
            id: self._effects[id].slope(point.effects.get(id, 0.0), t) for id in point.slopes
        }
        return Answer(straight, slope, split, constants, by_effect, coupling, uncertain)


def emulate(model: ResponseModel, reach: float = REACH) -> Emulated:
    """Evaluate the model at the designs, plain and with every effect, and fit the polynomials.

    reach: half width of the box in x.

    An effect without an answer at so many designs that its polynomials are not determined is
    left out. Raises what the model says where the plain tyre has too few answers.
    """
    start = np.asarray(model.start, float)
    count = len(start)
    boxed = 2 * qmc.Halton(count, seed=SEED).random(PLAIN_DESIGNS) - 1  # t of each design
    boxed[0] = 0.0
    designs = [start + reach * t for t in boxed]
    queries = [
        Query(x, constants=i < SOURCE_DESIGNS, coupled=i < SOURCE_DESIGNS)
        for i, x in enumerate(designs)
    ]
    plain = model.answers(queries)
    # each answer gives a value and v slopes for each row
    good = [i for i, answer in enumerate(plain) if isinstance(answer, Answer)]
    degrees = up_to(count, PLAIN_DEGREE)
    if len(good) * (1 + count) < len(degrees):
        raise next(a for a in plain if isinstance(a, Exception))
    fitted = _fit(degrees, boxed[good], [plain[i] for i in good], reach)  # type: ignore[misc]
    sources = [i for i in good if i < SOURCE_DESIGNS]
    # of each row, and in it of each source of error
    constants = _values(
        up_to(count, SOURCE_DEGREE),
        boxed[sources],
        [plain[i].constants.ravel() for i in sources],  # type: ignore[union-attr]
    )
    effects = {}
    for id, span in model.ranges.items():
        emulated = _effect(model, id, span, boxed, designs, plain, reach)
        if emulated is not None:
            effects[id] = emulated
    couplings = [(boxed[i], plain[i].coupling) for i in sources]  # type: ignore[union-attr]
    return Emulated(model, reach, fitted, constants, effects, couplings)


def _effect(
    model: ResponseModel,
    id: str,
    span: EffectRange,
    boxed: Array,  # (designs, v) t of each design
    designs: Sequence[Array],
    plain: Sequence[Answer | Exception],
    reach: float,
) -> EmulatedEffect | None:
    """The emulated effect; None if so few designs have an answer that no polynomial is
    determined."""
    degrees = up_to(len(boxed[0]), EFFECT_DEGREE)
    chosen = [i for i in range(EFFECT_DESIGNS) if isinstance(plain[i], Answer)]
    nodes, added, split = [], [], []
    for e in _node_values(span):
        answers = model.answers([Query(designs[i], {id: float(e)}) for i in chosen])
        both = [(i, a) for i, a in zip(chosen, answers, strict=True) if isinstance(a, Answer)]
        if len(both) * (1 + len(boxed[0])) < len(degrees):
            continue
        differences = [
            Answer(a.eta - plain[i].eta, a.jacobian - plain[i].jacobian, a.split)  # type: ignore[union-attr]
            for i, a in both
        ]
        where = boxed[[i for i, _ in both]]
        nodes.append(float(e))
        added.append(_fit(degrees, where, differences, reach))
        split.append(_values(up_to(len(boxed[0]), 1), where, [a.split for _, a in both]))
    if not nodes:
        return None
    ends = [e for e in nodes if span.has_shape_uncertainty and e in (span.low, span.high)]
    at_ends = model.answers([Query(designs[0], {id: e}, shape_uncertainty=True) for e in ends])
    known = {
        e: answer.shape_uncertainty
        for e, answer in zip(ends, at_ends, strict=True)
        if isinstance(answer, Answer) and answer.shape_uncertainty is not None
    }
    return EmulatedEffect(np.array(nodes), tuple(added), tuple(split), known)


def _node_values(span: EffectRange) -> list[float]:
    """Parameters at which an effect is evaluated, without 0."""
    if span.low < 0 < span.high:
        return [f * end for end in (span.low, span.high) for f in TWO_SIDED_SHARES]
    far = max(span.low, span.high, key=abs)
    return [f * far for f in ONE_SIDED_SHARES]


def _fit(degrees: Array, t: Array, answers: Sequence[Answer], reach: float) -> Polynomial:
    """Least squares of values and slopes by t, equations that lie far off weighing less (Huber's
    estimator): close to a limit point, where cords of a stiff tyre buckle, slopes grow without
    bound."""
    slopes = [products(degrees, t, j) for j in range(t.shape[1])]
    A = np.concatenate([products(degrees, t), *slopes])
    values = np.array([a.eta for a in answers])
    rises = np.array([reach * a.jacobian for a in answers])
    b = np.concatenate([values, *np.moveaxis(rises, 2, 0)])
    coefficients = np.linalg.lstsq(A, b, None)[0]
    for _ in range(REWEIGHTED):
        off = abs(b - A @ coefficients)
        scale = HUBER * np.median(off, axis=0) + MIN_SCALE
        weights = np.sqrt(np.minimum(1.0, scale / np.maximum(off, scale)))
        columns = zip(weights.T, b.T, strict=True)
        coefficients = np.array(
            [np.linalg.lstsq(A * w[:, None], c * w, None)[0] for w, c in columns]
        ).T
    return Polynomial(degrees, coefficients)


def _values(degrees: Array, t: Array, values: Sequence[Array]) -> Polynomial:
    """Least squares of values alone."""
    coefficients, *_ = np.linalg.lstsq(products(degrees, t), np.array(values), None)
    return Polynomial(degrees, coefficients)
