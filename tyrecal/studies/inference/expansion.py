"""The model between the few points where it was evaluated.

eta (n,) are the model's rows, ln f of each mode and state and ln mass; x (v,) the coordinates of
the design variables; e_i the parameter of effect i (see `model`). With d = x - x0, quadratic about
the plain fit x0, plus what each effect adds:

    eta(x, e) = eta0 + J0 d + d^T H d / 2 + sum over effects i of [a_i(e_i) + B_i(e_i) d]

The shift a_i (n,) and the tilt B_i (n, v) are the changes of eta and of d eta / dx at x0 by the
effect: polynomials in e_i through its nodes, 0 at e_i = 0. If the model gives d a_i / d e_i at the
nodes, a_i has these slopes, too (Hermite). First every effect is evaluated at the far end of its
range, and near 0 if its shift is bent; those that matter get one size more (`refined`).

An active effect is evaluated once more where its re-fit is, at x_a, e_a. The error of the expansion
there, of eta and of J, is added (e / e_a)^3 times (once beyond e_a), because the expansion itself
is off by terms of third order. Effects add up, except pairs that were evaluated together at e_i,
e_j: the error of their sum there is added in proportion to the product of both parameters, and no
more beyond.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .model import Answer, Coupling, EffectRange, Query, ResponseModel

Array = np.ndarray
BY_VALUES = (0.5, 1.0)  # of a one-sided range, the sizes of an effect without any slope
FALLBACK = (0.25, 0.5)  # of an end of the range that has no solution
MIDDLE = (0.25, 0.5, 0.75)  # of an end of the range, where an effect that matters is refined
MAX_BEND = 0.3  # of a shift, by which the slope at the end may differ from the chord's
CURVATURE_STEP = 0.05  # of a logarithm, for H from two Jacobians
MIN_DAMPING_RATIO = 0.05  # of the plain tyre's damping ratio, the least that an effect may leave


@dataclass(frozen=True)
class Refinement:
    """A point where an effect was evaluated again, and the expansion's error there."""

    e: float  # parameter of the effect
    d: Array  # (v,) x - x0
    shift: Array  # (n,) error of eta
    tilt: Array  # (n, v) error of d eta / dx


@dataclass(frozen=True)
class PairInteraction:
    """A point where two effects were evaluated together, and the error of their sum there."""

    e: tuple[float, float]  # parameters of the two effects
    d: Array  # (v,) x - x0
    shift: Array  # (n,) error of eta
    tilt: Array  # (n, v) error of d eta / dx

    def at(self, first: Array, second: Array) -> tuple[Array, Array]:
        """Additions to a (q, n) and B (q, n, v) at parameters (q,)."""
        grown = np.clip(first / self.e[0], 0, 1) * np.clip(second / self.e[1], 0, 1)
        shift = grown[:, None] * (self.shift - self.tilt @ self.d)
        return shift, grown[:, None, None] * self.tilt


@dataclass(frozen=True)
class EffectResponse:
    """An effect at the sizes where it was evaluated."""

    values: Array  # (k,) nodes: values of its parameter e, 0 among them
    shift: Array  # (k, n) a_i at the nodes
    slope: Array  # (k, n) d a / d e; NaN: values alone serve the row; 0 where not sloped
    sloped: Array  # (k,) whether the slope at a node is known
    tilt: Array  # (k, n, v) B_i at the nodes
    split: Array  # (k, n) distance of the two modes of a pair, in ln f
    reach: tuple[float, float]  # lowest and highest e between nodes that have a solution
    # (n,) by end of the range: `Answer.shape_uncertainty`
    shape_uncertainty: Mapping[float, Array] = field(default_factory=dict)
    anchor: Refinement | None = None
    damping: Array | None = None  # (k, n) damping ratios at the nodes over those of the plain tyre

    def damping_at(self, e: Array) -> Array:
        """ln of the damping ratios over those of the plain tyre (q, n) at parameters (q,); 0 where
        they are unknown."""
        if self.damping is None:
            return np.zeros((len(e), self.shift.shape[1]))
        ratio = lagrange(self.values, e) @ np.nan_to_num(self.damping, nan=1.0)
        return np.asarray(np.log(np.maximum(ratio, MIN_DAMPING_RATIO)))

    def at(self, e: Array) -> tuple[Array, Array, Array]:
        """a (q, n), B (q, n, v) and split (q, n) at parameters (q,)."""
        shift, weights = self.shift_at(e), lagrange(self.values, e)
        tilt = np.einsum("qk,knv->qnv", weights, self.tilt)
        if self.anchor:
            grown = np.clip(e / self.anchor.e, 0, 1) ** 3
            shift = shift + grown[:, None] * (self.anchor.shift - self.anchor.tilt @ self.anchor.d)
            tilt = tilt + grown[:, None, None] * self.anchor.tilt
        return shift, tilt, np.abs(weights @ self.split)

    def with_size(self, id: str, e: float, answer: Answer, plain: Expansion) -> EffectResponse:
        """The response with the effect's answer at one more size."""
        place = int(np.searchsorted(self.values, e))
        none = np.zeros_like(plain.eta)
        put = lambda known, new: np.insert(known, place, new, axis=0)
        return replace(
            self,
            values=put(self.values, e),
            shift=put(self.shift, answer.eta - plain.eta),
            slope=put(self.slope, answer.slopes.get(id, none)),
            sloped=put(self.sloped, id in answer.slopes),
            tilt=put(self.tilt, answer.jacobian - plain.jacobian),
            split=put(self.split, answer.split),
            damping=None if self.damping is None else put(self.damping, _damping(answer, plain)),
        )

    def range_shifts(self) -> Array:
        """Shifts (k, n) at the ends of its range over the square root of 3 k: what they make normal
        has the mean square of an effect that is uniform over the range."""
        ends = np.array([end for end in self.reach if end])
        return self.shift_at(ends) / np.sqrt(3 * len(ends))

    def shape_uncertainty_at(self, e: Array) -> Array:
        """Shift (q, n) by one standard deviation of the effect's second, uncertain number
        (`Effect.shape_uncertainty`), in proportion to the effect's parameters e (q,)."""
        more = np.zeros((len(e), self.shift.shape[1]))
        for end, each in self.shape_uncertainty.items():
            more += np.maximum(e / end, 0.0)[:, None] * each
        return more

    def shift_at(self, e: Array) -> Array:
        """a (q, n) by the nodes alone, at parameters (q,)."""
        values, slopes = hermite(self.values, self.sloped, e)
        shift = values @ self.shift + slopes @ self.slope
        return np.where(np.isnan(shift), lagrange(self.values, e) @ self.shift, shift)


@dataclass(frozen=True)
class Expansion:
    """The model about x0, there without effects."""

    x0: Array  # (v,) coordinates of the plain fit
    eta: Array  # (n,) ln f and ln mass at x0
    jacobian: Array  # (n, v) J0 = d eta / dx at x0
    hessian: Array  # (n, v, v) H = d2 eta / dx2 at x0
    split: Array  # (n,) distance of the two modes of a pair, in ln f
    constants: Array  # (n, k) change of eta by one standard deviation of each source of error
    nodes: Mapping[str, EffectResponse]  # of effects by id
    failed: Mapping[str, str] = field(default_factory=dict)  # why effects, by id, have no nodes
    coupling: Coupling | None = None  # of modes by the sources of error
    joint: Mapping[tuple[str, ...], PairInteraction] = field(default_factory=dict)  # of two effects
    material_laws: float = 0.0  # see `ResponseModel`
    damping: Array | None = None  # (n,) ln of the damping ratios at x0; None: unknown
    damping_slopes: Array | None = None  # (n, v) d damping / dx at x0, by differences
    losses: Array | None = None  # (n, k) see `Answer`

    def plain(self, x: Array) -> tuple[Array, Array]:
        """eta (n,) and Jacobian (n, v) without effects."""
        d = x - self.x0
        bent = np.einsum("nvw,w->nv", self.hessian, d)
        return self.eta + self.jacobian @ d + bent @ d / 2, self.jacobian + bent

    def range_shifts(self, places: Array) -> Array:
        """Shifts of the rows ``places`` (n,) by every effect over its range, as so many more
        constants (n, k)."""
        every = [each.range_shifts()[:, places] for each in self.nodes.values()]
        return np.vstack([np.zeros((0, len(places))), *every]).T


def expand(model: ResponseModel, x0: Array) -> Expansion:
    """The expansion about x0: curvature by x, sources of error, every effect at a few sizes.

    An effect that matters is evaluated at more sizes later, see `refined` and `anchored`.
    Raises what the model answered where it has no solution at x0 itself.
    """
    ids, count, values = list(model.ranges), len(x0), first_sizes(model)
    pairs = [(id, float(e)) for id in ids for e in values[id]]
    answers = model.answers(first_points(model, x0))
    first = answers[0]
    if isinstance(first, Exception):
        raise first
    hessian, damping_slopes = np.zeros((*first.jacobian.shape, count)), 0 * first.jacobian
    for i in range(count):
        above = answers[1 + i]
        if isinstance(above, Answer):
            hessian[:, :, i] = (above.jacobian - first.jacobian) / CURVATURE_STEP
            if first.damping is not None:
                damping_slopes[:, i] = np.log(_damping(above, first)) / CURVATURE_STEP
    hessian = (hessian + hessian.transpose(0, 2, 1)) / 2
    assert first.constants is not None
    plain = Expansion(
        x0,
        first.eta,
        first.jacobian,
        hessian,
        first.split,
        first.constants,
        {},
        material_laws=model.material_laws,
        damping=first.damping,
        damping_slopes=damping_slopes,
        losses=first.losses,
    )
    nodes, failed = {}, {}
    replies = dict(zip(pairs, answers[1 + count :], strict=True))
    by_effect = {
        id: {float(e): replies[id, float(e)] for e in values[id]} | {0.0: first} for id in ids
    }
    more = [
        (id, e)
        for id in ids
        for e in (
            *_nearer(model.ranges[id], by_effect[id]),
            *_bent(_nodes(id, plain, model.ranges[id], by_effect[id])),
        )
    ]
    again = model.answers([_with_effect(model, x0, id, e) for id, e in more]) if more else []
    for (id, e), answer in zip(more, again, strict=True):
        by_effect[id][e] = answer
    for id in ids:
        made = _nodes(id, plain, model.ranges[id], by_effect[id])
        if made is None:
            failed[id] = str(next(a for a in by_effect[id].values() if isinstance(a, Exception)))
        else:
            nodes[id] = made
    return replace(plain, nodes=nodes, failed=failed, coupling=first.coupling)


def first_sizes(model: ResponseModel) -> dict[str, Array]:
    """Sizes at which each effect is evaluated first."""
    slopes = {id: (id in model.sloped_at_0) + (id in model.sloped) for id in model.ranges}
    return {id: node_values(span, slopes[id]) for id, span in model.ranges.items()}


def first_points(model: ResponseModel, x0: Array) -> list[Query]:
    """The points that `expand` evaluates first: the plain tyre, each x a step on, each effect."""
    at_0 = tuple(id for id in model.ranges if id in model.sloped_at_0)
    points = [Query(x0, constants=True, slopes=at_0, coupled=True)]
    points += [Query(x0 + step, near=x0) for step in CURVATURE_STEP * np.eye(len(x0))]
    sizes = first_sizes(model)
    return points + [_with_effect(model, x0, id, float(e)) for id in sizes for e in sizes[id]]


def carried(known: Expansion, model: ResponseModel, x0: Array) -> Expansion:
    """The expansion about another x0, where the plain tyre is evaluated: effects follow ``known``'s
    B, and are off by a term of second order in x0; curvature and sources of error stay.

    For many tyres of one case. Raises what the model answered where it has no solution at x0.
    """
    (first,) = model.answers([Query(x0, coupled=True)])
    if isinstance(first, Exception):
        raise first
    step, nodes = x0 - known.x0, {}
    for id, own in known.nodes.items():
        steeper = derivatives(own.values) @ (own.tilt @ step)
        nodes[id] = replace(
            own,
            shift=own.shift + own.tilt @ step,
            slope=own.slope + steeper * own.sloped[:, None],
            anchor=None,
        )
    return replace(
        known,
        x0=x0,
        eta=first.eta,
        jacobian=first.jacobian,
        split=first.split,
        nodes=nodes,
        coupling=first.coupling,
        joint={},
        damping=first.damping,
    )


def node_values(span: EffectRange, slopes: int = 0) -> Array:
    """Sizes (k,) at which an effect is evaluated first: parameters other than 0, rising.

    slopes: 1 if its slope is known at 0 or at these sizes, 2 if at both: then the farther end of
    a two-sided range is enough.
    """
    far = span.high if abs(span.high) >= abs(span.low) else span.low
    if span.low < 0 < span.high and (slopes < 2 or span.has_shape_uncertainty):
        return np.sort([span.low, span.high, *span.extra_nodes])
    return np.sort([*(far * np.array([1.0] if slopes else BY_VALUES)), *span.extra_nodes])


def refined(expansion: Expansion, model: ResponseModel, sizes: Mapping[str, float]) -> Expansion:
    """The expansion with effects evaluated at one more size each, by id, at x0; one that has no
    solution there stays as it was."""
    points = [_with_effect(model, expansion.x0, id, e) for id, e in sizes.items()]
    nodes = dict(expansion.nodes)
    for (id, e), answer in zip(sizes.items(), model.answers(points), strict=True):
        if isinstance(answer, Answer):
            nodes[id] = nodes[id].with_size(id, e, answer, expansion)
    return replace(expansion, nodes=nodes)


def anchored(expansion: Expansion, model: ResponseModel, wanted: Sequence[Query]) -> Expansion:
    """The expansion with one or two effects evaluated again at each of these points; one that has
    no solution there stays as it was. What an effect alone gains, those with others know."""
    nodes, joint = dict(expansion.nodes), dict(expansion.joint)
    answered = list(zip(wanted, model.answers(wanted), strict=True))
    for point, answer in sorted(answered, key=lambda each: len(each[0].effects)):
        if not isinstance(answer, Answer):
            continue
        (id, e), *others = point.effects.items()
        d = point.x - expansion.x0
        eta, jacobian = expansion.plain(point.x)
        shift, tilt = answer.eta - eta, answer.jacobian - jacobian
        for each, size in point.effects.items():
            own = nodes[each] if others else replace(nodes[each], anchor=None)
            a, B, _ = own.at(np.array([size]))
            shift, tilt = shift - a[0] - B[0] @ d, tilt - B[0]
        if others:
            ((other, size),) = others
            joint[id, other] = PairInteraction((e, size), d, shift, tilt)
        else:
            nodes[id] = replace(nodes[id], anchor=Refinement(e, d, shift, tilt))
    return replace(expansion, nodes=nodes, joint=joint)


def _with_effect(model: ResponseModel, x: Array, id: str, e: float) -> Query:
    """The query for one effect, with its slope if the model has that and, at the ends of its range,
    the shift by `Effect.shape_uncertainty`."""
    span = model.ranges[id]
    uncertain = span.has_shape_uncertainty and e in (span.low, span.high)
    slopes = (id,) if id in model.sloped else ()
    return Query(x, {id: e}, slopes=slopes, shape_uncertainty=uncertain, near=x)


def _nodes(
    id: str, plain: Expansion, span: EffectRange, replies: Mapping[float, Answer | Exception]
) -> EffectResponse | None:
    """Nodes from 0 outwards as far as there are solutions; None where there is none at all."""
    known = {0.0: Answer(plain.eta, plain.jacobian, plain.split, damping=plain.damping), **replies}
    good = [0.0]
    reach = [max(0.0, span.low), min(0.0, span.high)]  # 0, or the near end of the range
    for side in (1, -1):
        for e in sorted((e for e in replies if e * side > 0), key=abs):
            if not isinstance(known[e], Answer):
                break
            good.append(e)
            if span.low <= e <= span.high:
                reach[0 if side < 0 else 1] = e
    if len(good) == 1:
        return None
    for place, end in enumerate((span.low, span.high)):  # a side that the other stands for
        if span.low < 0 < span.high and not any(e * end > 0 for e in replies):
            reach[place] = end
    low, high = sorted(reach)
    values = np.array(sorted(good))
    answers = [answer for e in values if isinstance(answer := known[float(e)], Answer)]
    return EffectResponse(
        values,
        np.array([each.eta - plain.eta for each in answers]),
        np.array([each.slopes.get(id, np.zeros_like(plain.eta)) for each in answers]),
        np.array([id in each.slopes for each in answers]),
        np.array([each.jacobian - plain.jacobian for each in answers]),
        np.array([each.split for each in answers]),
        (low, high),
        {
            e: each.shape_uncertainty
            for e, each in zip(map(float, values), answers, strict=True)
            if e in (low, high) and each.shape_uncertainty is not None
        },
        damping=None
        if plain.damping is None
        else np.array([_damping(each, plain) for each in answers]),
    )


def _damping(answer: Answer, plain: Answer | Expansion) -> Array:
    """Damping ratios over those of the plain tyre (n,), 1 where they are unknown."""
    if answer.damping is None or plain.damping is None:
        return np.ones_like(plain.eta)
    return np.asarray(np.nan_to_num(np.exp(answer.damping - plain.damping), nan=1.0))


def _nearer(span: EffectRange, replies: Mapping[float, Answer | Exception]) -> list[float]:
    """Parameters nearer to 0, and on its other side, where none so far has a solution."""
    if any(isinstance(reply, Answer) for e, reply in replies.items() if e):
        return []
    far = span.high if abs(span.high) >= abs(span.low) else span.low
    ends = [span.low, span.high] if span.low < 0 < span.high else [far]
    sizes = [share * end for end in ends for share in (*FALLBACK, 1.0)]
    return [e for e in map(float, sizes) if e not in replies]


def _bent(made: EffectResponse | None) -> list[float]:
    """A further size near 0 of an effect whose slope is known at its only size, if that is far from
    the chord's: a quadratic would be off by a tenth of small shifts."""
    if made is None or len(made.values) != 2 or made.sloped[made.values == 0]:
        return []
    far = int(np.flatnonzero(made.values)[0])
    rise = made.slope[far] * made.values[far]
    off = np.nan_to_num(abs(rise - made.shift[far]))
    if not made.sloped[far] or off.max() < MAX_BEND * abs(made.shift[far]).max():
        return []
    return [FALLBACK[0] * float(made.values[far])]


def hermite(nodes: Array, sloped: Array, e: Array) -> tuple[Array, Array]:
    """Hermite's polynomials at e (q,), of values and of slopes at the nodes (k,): (q, k) each.

    sloped (k,): whether the slope at a node is given; those of slopes that are not are 0.

        A_i = l_i(e) (1 - l_i'(e_i) (e - e_i)),   B_i = l_i(e) (e - e_i),
        l_i = product over j != i of ((e - e_j) / (e_i - e_j))^(1 or, with a slope at j, 2)
    """
    e = np.atleast_1d(e)[:, None]
    itself = np.eye(len(nodes), dtype=bool)
    apart = nodes[:, None] - nodes + itself
    times = np.where(itself, 0, 1 + np.asarray(sloped, int))
    values = np.prod(((e[:, :, None] - nodes) / apart) ** times, axis=2)
    slopes = values * (e - nodes) * sloped
    values -= slopes * np.sum(times / apart, axis=1)
    return values, slopes


def derivatives(nodes: Array) -> Array:
    """d l_j / d e (k, k) of Lagrange's polynomials l_j at the nodes (k,)."""
    apart = nodes[:, None] - nodes + np.eye(len(nodes))
    weights = np.prod(apart, axis=1)
    matrix = weights[:, None] / weights / apart
    np.fill_diagonal(matrix, 0.0)
    return matrix - np.diag(matrix.sum(axis=1))


def lagrange(nodes: Array, e: Array) -> Array:
    """Lagrange's polynomials of the nodes (k,) at e (q,): (q, k)."""
    return hermite(nodes, np.zeros(len(nodes), int), e)[0]
