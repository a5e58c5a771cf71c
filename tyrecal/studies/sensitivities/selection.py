"""Which uncertain numbers, freed within what is known of them, reduce deviations most.

With r the deviations of ln q at the case's own numbers, J and G their sensitivities by the
variables and by uncertain numbers, in standard deviations, and A the numbers that are freed,

    S_A = S + J Sx J^T + sum over A of g_k g_k^T,    chi2_A = r^T S_A^-1 r,
    gain of k = chi2_A - chi2_(A + k) = u_k^2 / (1 + s_k),
    u_k = g_k^T S_A^-1 r,    s_k = g_k^T S_A^-1 g_k

(the matrix inversion lemma). S: scatter, error of the model, and what cannot be freed. A freed
number costs the square of its shift, because its knowledge stays a residual. Each step frees the
number with the largest gain. It stops where a gain this large is chance: r ~ N(0, S_A) gives the
largest gain over all numbers that are left a distribution, which draws of r show. With all numbers
in A, u is the likeliest shift of each, which `diagnose` reports as ``constants``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

Array = np.ndarray
CHANCE = 0.05  # probability of a gain by chance, above which no more numbers are freed
CHANCE_DRAWS = 10_000  # of the deviations: the probability is right to 0.002 at 0.05
SAME_GAIN = 4.0  # of chi2, two standard deviations: numbers whose gains differ by less are alike


@dataclass(frozen=True)
class SelectionStep:
    """A number that is freed."""

    place: int  # of the number
    gain: float  # of chi2
    p_value: float  # probability of a gain so large by chance, the choice counted
    alike: tuple[int, ...]  # numbers that fit as well in its place


@dataclass(frozen=True)
class ForwardSelection:
    """The numbers that are freed, in order, and what they leave."""

    steps: tuple[SelectionStep, ...]
    chi2: float  # before the first step
    chi2_left: float
    next_place: int | None  # the number with the largest gain that is left
    next_p_value: float
    shifts: Array  # (k,) likeliest, in standard deviations; 0 of numbers that are not freed
    shifts_of_all: Array  # (k,) likeliest with all numbers free


def forward_selection(
    r: Array, covariance: Array, G: Array, chance: float = CHANCE, seed: int = 0
) -> ForwardSelection:
    """Free numbers until a gain is no better than ``chance``.

    r (n,): deviations; covariance (n, n): S + J Sx J^T; G (n, k).
    """
    draws = np.random.default_rng(seed).normal(size=(len(r), CHANCE_DRAWS))
    chosen: list[int] = []
    gains: list[tuple[float, float]] = []
    while True:
        left = [k for k in range(G.shape[1]) if k not in chosen and G[:, k].any()]
        S = freed(covariance, G, chosen)
        if not left:
            best, p_value = None, 1.0
            break
        gain = _gains(S, G[:, left], r[:, None])[:, 0]
        by_chance = _gains(S, G[:, left], np.linalg.cholesky(S) @ draws).max(0)
        best, p_value = left[int(np.argmax(gain))], _tail(by_chance, gain.max())
        if p_value > chance:
            break
        chosen.append(best)
        gains.append((float(gain.max()), p_value))
    steps = [
        SelectionStep(k, *gain, _alike(r, covariance, G, chosen, k))
        for k, gain in zip(chosen, gains, strict=True)
    ]
    shifts = np.zeros(G.shape[1])
    shifts[chosen] = G[:, chosen].T @ np.linalg.solve(S, r)
    every = freed(covariance, G, range(G.shape[1]))
    return ForwardSelection(
        tuple(steps),
        chi2(covariance, r),
        chi2(S, r),
        best,
        p_value,
        shifts,
        G.T @ np.linalg.solve(every, r),
    )


def freed(covariance: Array, G: Array, chosen: Sequence[int]) -> Array:
    """S_A (n, n) with the numbers ``chosen`` free."""
    own = G[:, list(chosen)]
    return np.asarray(covariance + own @ own.T)


def chi2(S: Array, r: Array) -> float:
    """r^T S^-1 r."""
    return float(r @ np.linalg.solve(S, r))


def _gains(S: Array, G: Array, r: Array) -> Array:
    """Gain (k, d) of each number by each of d vectors of deviations (n, d)."""
    weighted = np.linalg.solve(S, G)
    u, s = weighted.T @ r, (weighted * G).sum(0)
    return np.asarray(u**2 / (1 + s)[:, None])


def _tail(draws: Array, value: float) -> float:
    """Probability of at least ``value``, the value counted as a draw, which keeps it above 0."""
    return float((1 + (draws >= value).sum()) / (1 + len(draws)))


def _alike(r: Array, covariance: Array, G: Array, chosen: Sequence[int], k: int) -> tuple[int, ...]:
    """Numbers that leave about the same chi2 as ``k`` does among the chosen, the best first."""
    others = [j for j in chosen if j != k]
    least = chi2(freed(covariance, G, chosen), r) + SAME_GAIN
    left = [j for j in range(G.shape[1]) if j not in chosen and G[:, j].any()]
    after = {j: chi2(freed(covariance, G, [*others, j]), r) for j in left}
    return tuple(j for j in sorted(after, key=lambda j: after[j]) if after[j] < least)
