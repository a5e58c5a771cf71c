"""Chance that a diagnosis names an effect, computed before anything is measured.

The diagnosis is linear here: with the variables x integrated out, n rows of measurements y are

    y ~ N(eta0 + g_h(e), C + R_h(e)),   C = Sigma + J Sx^2 J^T

under explanation h with size e; R_h is the covariance of the error of the effect's law, and
distances of pairs are further rows. Tyres are drawn from it, and each gets the probability of every
explanation:

    p_h ~ prior_h sum_j w_j N(y; eta0 + g_h(e_j), C + R_h(e_j))

Of one effect alone, none and h, this is the noncentral law of lambda = g^T P g: ln of the odds is
N(+-lambda / 2, lambda) at a known size. Several effects that look alike have no such formula.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..diagnose.evidence import COVERAGE, NONE, OUTSIDE, PRIOR_OUTSIDE, families, grid, ln_shares
from ..diagnose.several import PRIOR_NONE, priors
from ..inference.inverse_problem import InverseProblem

Array = np.ndarray
FOUND = 0.9  # probability of an explanation from which it counts as found
DRAWN_FROM = 0.2  # of a range, of drawn effects
PER_LAW = 13  # points of the grid over sizes that share R


@dataclass(frozen=True)
class Drawn:
    """Tyres (t,) drawn by chance."""

    keys: tuple[str, ...]  # effect of each, or "none"
    y: Array  # (t, n) measured rows minus eta0

    def only(self, keep: Array) -> Drawn:
        """The tyres of a mask (t,)."""
        return Drawn(tuple(np.array(self.keys)[keep].tolist()), self.y[keep])


@dataclass(frozen=True)
class LinearDiagnosis:
    """The diagnosis of n rows, the distances of pairs last, in linear form."""

    problem: InverseProblem  # of the frequencies and readings

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """Explanations: none, outside, and the effects."""
        return (NONE, OUTSIDE, *self.problem.expansion.nodes)

    @cached_property
    def pairs(self) -> Array:
        """Rows of the problem (m,) whose pairs are measured apart."""
        return np.flatnonzero(np.isfinite(self.problem.observations.split_scatter))

    @cached_property
    def jacobian(self) -> Array:
        """J (n, v) at x0; 0 for the distances of pairs."""
        own = self.problem.plain(np.zeros(len(self.problem.centre)))[1]
        return np.vstack([own, np.zeros((len(self.pairs), own.shape[1]))])

    @cached_property
    def sigma(self) -> Array:
        """Sigma (n, n)."""
        o = self.problem.observations
        labels = [str(o.rows[i].label) for i in self.pairs]
        same = np.array([[a == b for b in labels] for a in labels]).reshape(
            len(labels), len(labels)
        )
        own = self.problem.assumed.split**2 * same + np.diag(o.split_scatter[self.pairs] ** 2)
        return self._padded(self.problem.sigma[None], own)[0]

    @cached_property
    def covariance(self) -> Array:
        """C (n, n)."""
        return np.asarray(self.sigma + self.jacobian * self.problem.spread**2 @ self.jacobian.T)

    def shifts(self, id: str, e: Array) -> tuple[Array, Array]:
        """g (q, n) and R (q, n, n) of an effect at sizes (q,)."""
        added = self.problem.added({id: e}, len(e))
        plain = self.problem.added({}, 1)
        g = np.hstack([added.shift - plain.shift, added.split[:, self.pairs]])
        return g, self._padded(self.problem.response_covariance(added))

    def _padded(self, own: Array, pairs: Array | None = None) -> Array:
        """Covariances (q, n, n) of the problem's rows and of the distances of pairs."""
        count, m = own.shape[1], len(self.pairs)
        whole = np.zeros((len(own), count + m, count + m))
        whole[:, :count, :count] = own
        if pairs is not None:
            whole[:, count:, count:] = pairs
        return whole

    @cached_property
    def _explanations(self) -> tuple[Array, ...]:
        """For points (j,) of all explanations: key (j,), ln of the prior (j,), place (j,) of their
        law, g (j, n); and of each law R (l, n, n), l: laws."""
        known = families(self.problem)
        extra = self._padded(
            np.array([np.zeros_like(self.problem.sigma), *(f.extra for f in known)])
        )
        key, law = [np.zeros(1, int), np.ones(len(known), int)], [np.arange(len(extra))]
        ln, g = [np.log([PRIOR_NONE]), np.log(PRIOR_OUTSIDE) + ln_shares(known)], [0 * extra[:, 0]]
        laws, ids = [extra], self.keys[2:]
        prior = priors(len(ids), self.problem.assumed.further, 1)[1] if ids else 0.0
        for k, id in enumerate(ids, 2):
            e, ln_weights = grid(self.problem.expansion.nodes[id])
            own, R = self.shifts(id, e)
            # a size that the case states as possible is no effect: key 0, none
            within = abs(e) <= COVERAGE * self.problem.ranges[id].prior_sd
            key.append(np.where(within, 0, k))
            ln.append(np.log(prior) + ln_weights)
            law.append(sum(map(len, laws)) + np.arange(len(e)) // PER_LAW)
            g.append(own)
            laws.append(R[PER_LAW // 2 :: PER_LAW])
        return tuple(map(np.concatenate, (key, ln, law, g, laws)))

    def probabilities(self, y: Array, rows: Array) -> Array:
        """Probability (t, k) of each of ``keys`` where rows (m,) of y (t, n) were measured."""
        key, ln, law, g, laws = self._explanations
        S = self.covariance[np.ix_(rows, rows)] + laws[:, rows[:, None], rows]
        inverse, (_, ln_det) = np.linalg.inv(S), np.linalg.slogdet(S)
        g, y = g[:, rows], np.ascontiguousarray(y[:, rows])  # else matmul is slow
        own = np.einsum("ltm,tm->lt", y @ inverse, y)
        Ag = np.einsum("jmn,jn->jm", inverse[law], g)
        square = own[law] - 2 * Ag @ y.T + (Ag * g).sum(1)[:, None]
        ln_p = (ln - ln_det[law] / 2)[:, None] - square / 2
        p = np.exp(ln_p - ln_p.max(0))
        p /= p.sum(0)
        return np.array([p[key == k].sum(0) for k in range(len(self.keys))]).T

    def draw(self, each: int, random: np.random.Generator) -> Drawn:
        """Tyres with each effect, ``each`` of them of even sizes, and as many without."""
        keys, y = [], []
        for k, id in enumerate((NONE, *self.keys[2:])):
            g, R = np.zeros((each, len(self.sigma))), np.zeros((each, 1, 1))
            if k:
                share = DRAWN_FROM + (1 - DRAWN_FROM) * (np.arange(each) + 0.5) / each
                ends = [end for end in self.problem.expansion.nodes[id].reach if end]
                g, R = self.shifts(id, share * np.resize(ends, each))
            root = np.linalg.cholesky(self.covariance + R)
            y.append(g + (root @ random.normal(size=(each, len(self.sigma), 1)))[:, :, 0])
            keys += [id] * each
        return Drawn(tuple(keys), np.concatenate(y))

    def found(self, drawn: Drawn, rows: Array) -> Array:
        """Whether each tyre's (t,) effect is found; of a sound tyre, whether nothing is named."""
        p = self.probabilities(drawn.y, rows)
        place = [self.keys.index(key) for key in drawn.keys]
        accused = p[:, 2:].max(1) >= FOUND
        return np.where(np.array(place) == 0, ~accused, p[range(len(p)), place] >= FOUND)


def shares(drawn: Drawn, hits: Array) -> dict[str, float]:
    """Share of the hits (t,) by key."""
    keys = np.array(drawn.keys)
    return {key: float(hits[keys == key].mean()) for key in dict.fromkeys(drawn.keys)}
