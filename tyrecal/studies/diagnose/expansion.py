"""The model between the few points where it was asked.

With d = x - x0, quadratic about the plain fit x0, plus what each effect adds:

    eta(x, e) = eta0 + J0 d + d^T H d / 2 + sum over effects i of [a_i(e_i) + B_i(e_i) d]

a_i, B_i: polynomials in e_i through its nodes, 0 at e_i = 0: differences of what the model says at
x0 with and without the effect. An effect that is in play is asked once more where its re-fit lies,
at x_a, e_a: what the expansion is off by there, eta_a and J_a, it gains (e / e_a)^3 times (once
beyond e_a), being itself off by terms of third order. Effects add up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from .model import Answer, Query, ResponseModel, Span

Array = np.ndarray
ONE_SIDED = (0.25, 0.75, 1.0)  # with 0 the Lobatto points of a cubic
TWO_SIDED = (0.5, 1.0)  # on either side
BENDING = (0.08, 0.5)  # more of them, of the range, where the cubic is not enough
MAX_LAST_TERM = 0.003  # of ln f, by Newton's polynomial, where the cubic is enough
CURVATURE_STEP = 0.05  # of a logarithm, for H from two Jacobians


@dataclass(frozen=True)
class Anchor:
    """Where an effect was asked again, and what the expansion is off by there."""

    e: float
    d: Array  # (v,) x - x0
    shift: Array  # (n,)
    tilt: Array  # (n, v)


@dataclass(frozen=True)
class Nodes:
    """An effect where it was asked."""

    values: Array  # (k,) of its parameter
    shift: Array  # (k, n) a_k
    tilt: Array  # (k, n, v) B_k
    split: Array  # (k, n)
    reach: tuple[float, float]  # of the parameter, between nodes that have a solution
    anchor: Anchor | None = None

    def at(self, e: Array) -> tuple[Array, Array, Array]:
        """a (q, n), B (q, n, v) and split (q, n) at parameters (q,)."""
        weights = lagrange(self.values, e)
        shift = weights @ self.shift
        tilt = np.einsum("qk,knv->qnv", weights, self.tilt)
        if self.anchor:
            grown = np.clip(e / self.anchor.e, 0, 1) ** 3
            shift = shift + grown[:, None] * (self.anchor.shift - self.anchor.tilt @ self.anchor.d)
            tilt = tilt + grown[:, None, None] * self.anchor.tilt
        return shift, tilt, np.abs(weights @ self.split)


@dataclass(frozen=True)
class Expansion:
    """The model about x0, there without effects."""

    x0: Array  # (v,)
    eta: Array  # (n,)
    jacobian: Array  # (n, v)
    hessian: Array  # (n, v, v)
    split: Array  # (n,)
    constants: Array  # (n, k)
    nodes: Mapping[str, Nodes]  # of effects by id
    failed: Mapping[str, str] = field(default_factory=dict)  # why effects, by id, have no nodes

    def plain(self, x: Array) -> tuple[Array, Array]:
        """eta (n,) and Jacobian (n, v) without effects."""
        d = x - self.x0
        bent = np.einsum("nvw,w->nv", self.hessian, d)
        return self.eta + self.jacobian @ d + bent @ d / 2, self.jacobian + bent


def expand(model: ResponseModel, x0: Array) -> Expansion:
    """Ask the model about x0: curvature by x, sources of error, every effect at its nodes.

    Raises what the model answered where it has no solution at x0 itself.
    """
    ids, count = list(model.spans), len(x0)
    steps = CURVATURE_STEP * np.eye(count)
    values = {id: node_values(model.spans[id]) for id in ids}
    points = [Query(x0, constants=True)]
    points += [Query(x0 + side * step) for step in steps for side in (1, -1)]
    asked = [(id, float(e)) for id in ids for e in values[id]]
    points += [Query(x0, {id: e}) for id, e in asked]
    answers = model.answers(points)
    first = answers[0]
    if isinstance(first, Exception):
        raise first
    hessian = np.zeros((*first.jacobian.shape, count))
    for i in range(count):
        above, below = answers[1 + 2 * i : 3 + 2 * i]
        if isinstance(above, Answer) and isinstance(below, Answer):
            hessian[:, :, i] = (above.jacobian - below.jacobian) / (2 * CURVATURE_STEP)
    hessian = (hessian + hessian.transpose(0, 2, 1)) / 2
    assert first.constants is not None
    plain = Expansion(x0, first.eta, first.jacobian, hessian, first.split, first.constants, {})
    nodes, failed = {}, {}
    replies = dict(zip(asked, answers[1 + 2 * count :], strict=True))
    found = {id: {e: replies[id, e] for e in map(float, values[id])} for id in ids}
    more = [
        (id, far * f)
        for id in ids
        for far in _bent(plain, model.spans[id], found[id])
        for f in BENDING
    ]
    again = model.answers([Query(x0, {id: e}) for id, e in more]) if more else []
    for (id, e), answer in zip(more, again, strict=True):
        found[id][e] = answer
    for id in ids:
        made = _nodes(plain, model.spans[id], found[id])
        if made is None:
            failed[id] = str(next(a for a in found[id].values() if isinstance(a, Exception)))
        else:
            nodes[id] = made
    return replace(plain, nodes=nodes, failed=failed)


def node_values(span: Span) -> Array:
    """Where an effect is asked: parameters other than 0, rising."""
    if span.low < 0 < span.high:
        sides = [-f * -span.low for f in reversed(TWO_SIDED)] + [f * span.high for f in TWO_SIDED]
        return np.sort([*sides, *span.also])
    far = span.high if abs(span.high) >= abs(span.low) else span.low
    return np.sort([*(far * np.array(ONE_SIDED)), *span.also])


def anchored(
    expansion: Expansion, model: ResponseModel, wanted: Mapping[str, tuple[float, Array]]
) -> Expansion:
    """The expansion with effects asked again at {id: (parameter, x (v,))}; one that has no
    solution there stays as it was."""
    answers = model.answers([Query(x, {id: e}) for id, (e, x) in wanted.items()])
    nodes = dict(expansion.nodes)
    for (id, (e, x)), answer in zip(wanted.items(), answers, strict=True):
        if isinstance(answer, Answer):
            own, d = replace(nodes[id], anchor=None), x - expansion.x0
            eta, jacobian = expansion.plain(x)
            shift, tilt, _ = own.at(np.array([e]))
            off = answer.eta - eta - shift[0] - tilt[0] @ d
            nodes[id] = replace(own, anchor=Anchor(e, d, off, answer.jacobian - jacobian - tilt[0]))
    return replace(expansion, nodes=nodes)


def _nodes(
    plain: Expansion, span: Span, replies: Mapping[float, Answer | Exception]
) -> Nodes | None:
    """Nodes from 0 outwards as far as there are solutions; None where there is none at all."""
    rows = {0.0: (np.zeros_like(plain.eta), np.zeros_like(plain.jacobian), plain.split)}
    reach = [max(0.0, span.low), min(0.0, span.high)]  # 0, or the near end of the range
    for side in (1, -1):
        for e in sorted((e for e in replies if e * side > 0), key=abs):
            answer = replies[e]
            if not isinstance(answer, Answer):
                break
            rows[e] = answer.eta - plain.eta, answer.jacobian - plain.jacobian, answer.split
            if span.low <= e <= span.high:
                reach[0 if side < 0 else 1] = e
    if len(rows) == 1:
        return None
    low, high = sorted(reach)
    values = np.array(sorted(rows))
    shift, tilt, split = (np.array([rows[float(e)][part] for e in values]) for part in range(3))
    return Nodes(values, shift, tilt, split, (low, high))


def _bent(plain: Expansion, span: Span, found: Mapping[float, Answer | Exception]) -> list[float]:
    """The far ends of the range towards which its nodes do not follow the effect closely."""
    made = _nodes(plain, span, found)
    if made is None or len(made.values) < 3:
        return []
    middles = (made.values[1:] + made.values[:-1]) / 2
    last = len(made.values) - 1 if made.reach[1] > 0 else 0  # without the farthest node
    fewer = lagrange(np.delete(made.values, last), middles) @ np.delete(made.shift, last, 0)
    if abs(lagrange(made.values, middles) @ made.shift - fewer).max() < MAX_LAST_TERM:
        return []
    return [e for e in made.reach if e]


def lagrange(nodes: Array, e: Array) -> Array:
    """Lagrange's polynomials of the nodes (k,) at e (q,): (q, k)."""
    e = np.atleast_1d(e)[:, None]
    weights = np.ones((len(e), len(nodes)))
    for k, here in enumerate(nodes):
        others = np.delete(nodes, k)
        weights[:, k] = np.prod((e - others) / (here - others), axis=1)
    return weights
