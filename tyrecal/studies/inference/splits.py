"""Likelihood of the splits of pairs, the distances of their two modes in ln f.

In state p the measured split is s_p = |a_p + u + noise|: a_p by an effect; u ~ N(0, w^2) by the
tyre's non-uniformity, one number for a pair in all states; noise of standard deviation tau_p.
Summed over the unknown signs

    p(s) = integral N(u; 0, w^2) prod_p [N(s_p - a_p - u; tau_p^2) + N(s_p + a_p + u; tau_p^2)] du

by the trapezoidal rule, whose error for a normal integrand of standard deviation sigma with steps
h is 2 exp(-2 (pi sigma / h)^2).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .observations import Observations

Array = np.ndarray
FAR_OUT = 6.0  # standard deviations w of u that the grid reaches beyond its likeliest values
MIN_SPLIT_WIDTH = 1e-9  # smallest w


@dataclass(frozen=True)
class Splits:
    """Splits of m pairs in up to k states each."""

    places: Array  # (m, k) place of each pair and state among the observations
    there: Array  # (m, k) whether there is such a state of the pair
    s: Array  # (m, k) measured split, in ln f
    tau: Array  # (m, k) its standard deviation
    width: float  # w, in ln f
    known: dict[bytes, float] = field(default_factory=dict, repr=False)  # ln p(s) by bytes of a

    @classmethod
    def of(cls, observations: Observations, width: float) -> Splits:
        """Splits of all pairs whose two members were measured. width: w, in ln f."""
        by_label: dict[str, list[int]] = {}
        for i in np.flatnonzero(np.isfinite(observations.split)).tolist():
            by_label.setdefault(str(observations.rows[i].label), []).append(i)
        most = max(map(len, by_label.values()), default=0)
        places = np.array([each + [0] * (most - len(each)) for each in by_label.values()], int)
        places = places.reshape(len(by_label), most)
        there = np.array([[j < len(each) for j in range(most)] for each in by_label.values()], bool)
        there = there.reshape(len(by_label), most)
        s = np.where(there, observations.split[places], 0.0)
        tau = np.where(there, observations.split_scatter[places], 1.0)
        return cls(places, there, s, tau, max(width, MIN_SPLIT_WIDTH))

    @property
    def count(self) -> int:
        """Number of measured splits."""
        return int(self.there.sum())

    def ln_likelihood(self, apart: Array) -> Array:
        """ln p(s) (q,) with the splits ``apart`` (q, n) of all rows by effects."""
        if not self.count:
            return np.zeros(len(apart))
        keys = [row.tobytes() for row in apart]
        new = {key: row for key, row in zip(keys, apart, strict=True) if key not in self.known}
        if new:  # most effects split no pair, so that few values differ
            a = np.where(self.there, np.array([*new.values()])[:, self.places], 0.0)
            u, h = self._grid(float(a.max()))
            ln, _ = self._integrand(a, u)
            values = (np.logaddexp.reduce(ln, axis=-1) + np.log(h)).sum(-1)
            self.known.update(zip(new, values.tolist(), strict=True))
        return np.array([self.known[key] for key in keys])

    def chi2(self) -> float:
        """s^T C^-1 s without effects, C = tau^2 + w^2, averaged over the signs by probability. Its
        expected value is the number of splits.

        s^T C^-1 s = <u^2 / w^2 + sum (s_p - u)^2 / tau_p^2> - 1, mean over the posterior of u.
        """
        if not self.count:
            return 0.0
        u, _ = self._grid(0.0)
        ln, plus = self._integrand(np.zeros((1, *self.s.shape)), u)
        weight = np.exp(ln - ln.max(-1, keepdims=True))
        weight /= weight.sum(-1, keepdims=True)
        s, tau = self.s[..., None], self.tau[..., None]
        near, far = ((s - u) / tau) ** 2, ((s + u) / tau) ** 2
        squares = np.where(self.there[..., None], plus * near + (1 - plus) * far, 0.0)
        total = (u / self.width) ** 2 + squares.sum(-2)
        return float(((weight * total).sum(-1) - 1).sum())

    def _grid(self, most_apart: float) -> tuple[Array, float]:
        """The g points u (g,) of the trapezoidal rule, and their step."""
        measured = np.where(self.there, self.tau**-2.0, 0.0).sum(1).max()
        precision = measured + self.width**-2.0
        # the posterior mean of u is at most the share measured / precision of the largest split
        reach = FAR_OUT * self.width + measured / precision * (self.s.max() + most_apart)
        count = 2 * int(np.ceil(reach * np.sqrt(precision))) + 1
        u = np.linspace(-reach, reach, count)
        return u, float(u[1] - u[0])

    def _integrand(self, a: Array, u: Array) -> tuple[Array, Array]:
        """ln of the integrand (q, m, g) at u (g,) with the splits ``a`` (q, m, k) by effects, and
        the probability (q, m, k, g) that a + u + noise is positive."""
        s, tau = self.s[..., None], self.tau[..., None]
        centre = a[..., None] + u
        plus, minus = -(((s - centre) / tau) ** 2) / 2, -(((s + centre) / tau) ** 2) / 2
        both = np.logaddexp(plus, minus)
        ln = both - np.log(tau) - np.log(2 * np.pi) / 2
        own = -((u / self.width) ** 2) / 2 - np.log(self.width) - np.log(2 * np.pi) / 2
        return np.where(self.there[..., None], ln, 0.0).sum(-2) + own, np.exp(plus - both)
