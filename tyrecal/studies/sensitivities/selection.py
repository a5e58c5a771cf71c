"""Which uncertain numbers, freed within what is known of them, reduce deviations most.

With r = ln q measured - ln q computed at the case's own numbers, S their covariance with the
variables' spread in it, W^T W = S^-1, and G the change of ln q by one standard deviation of each
number,

    chi2(A) = min |W (r - G z)|^2 over z_k, |z_k| <= 3 for k in A, z_k = 0 otherwise.

With g the column of k in G, u = g^T P (r - G z) and s = g^T P g, freeing k gains

    max over |z| <= 3 of 2 u z - s z^2,

P = S^-1 - S^-1 F (F^T S^-1 F)^-1 F^T S^-1, F the columns of the numbers in A that are not at their
limit.

1. The number with the largest gain is freed. Where r ~ N(0, S), the largest gain over all numbers
   that are left has a distribution, which draws of r show. A gain that it exceeds with a
   probability above 5 % is chance: then the selection ends.
2. A number in A is exchanged for another one if that lowers chi2(A).
3. A number in A whose gain beyond the others is chance is taken out.

Numbers that leave a chi2 within 4 of the least in the place of one in A are not distinguished from
it: a number that is off by two standard deviations changes chi2 by 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

Array = np.ndarray
CHANCE = 0.05  # probability of a gain by chance, above which no more numbers are freed
CHANCE_DRAWS = 10_000  # of the deviations: the probability is right to 0.002 at 0.05
FREED_SD = 3.0  # standard deviations within which a number is freed, as in a fit
AT_LIMIT = 1e-6  # of that limit: a number there yields no more
SAME_CHI2 = 4.0  # chi2 within which numbers are not distinguished


@dataclass(frozen=True)
class SelectedNumber:
    """A number that is freed."""

    place: int  # of the number
    gain: float  # fall of chi2 by freeing it after the others
    p_value: float  # probability of a gain so large by chance, the choice counted
    shift: float  # likeliest, in standard deviations
    alike: tuple[int, ...]  # numbers that these data do not distinguish from it


@dataclass(frozen=True)
class SelectedNumbers:
    """The numbers that are freed, the largest gain first, and what they leave."""

    numbers: tuple[SelectedNumber, ...]
    chi2: float  # with none of them
    chi2_left: float  # with all of them
    next_place: int | None  # the number with the largest gain that is left
    next_p_value: float  # of its gain, by chance alone


@dataclass(frozen=True)
class Candidates:
    """Numbers that may be freed, k of them, and n deviations, whitened: r (n,), G (n, k)."""

    r: Array
    G: Array
    seed: int = 0

    @classmethod
    def of(cls, r: Array, covariance: Array, G: Array) -> Candidates:
        """Candidates for deviations with S (n, n)."""
        factor = np.linalg.cholesky(covariance)
        return cls(np.linalg.solve(factor, r), np.linalg.solve(factor, G))

    @cached_property
    def draws(self) -> Array:
        """Whitened deviations (n, d) where no number is off."""
        shape = len(self.r), CHANCE_DRAWS
        return np.random.default_rng(self.seed).normal(size=shape)

    def left(self, freed: Sequence[int]) -> list[int]:
        """Numbers that are not freed, and move anything."""
        return [k for k in range(self.G.shape[1]) if k not in freed and self.G[:, k].any()]

    def gains(self, freed: Sequence[int]) -> tuple[dict[int, float], Array]:
        """Gain of each number that is left, and the largest one by chance (d,)."""
        left = self.left(freed)
        if not left:
            return {}, np.zeros(0)
        _, shifts = self.fit(freed)
        inside = [k for k, z in zip(freed, shifts, strict=True) if abs(z) < FREED_SD - AT_LIMIT]
        basis, _ = np.linalg.qr(self.G[:, inside])
        beyond = self.G[:, left] - basis @ (basis.T @ self.G[:, left])
        s = np.maximum((beyond**2).sum(0), 1e-12)
        own = _bounded_gain(beyond.T @ (self.r - self.G[:, list(freed)] @ shifts), s)
        by_chance = _bounded_gain(beyond.T @ self.draws, s[:, None]).max(0)
        return dict(zip(left, own.tolist(), strict=True)), by_chance

    def best(self, freed: Sequence[int]) -> tuple[int | None, float]:
        """The number with the largest gain, and the probability of that by chance."""
        gains, by_chance = self.gains(freed)
        if not gains:
            return None, 1.0
        place = max(gains, key=lambda k: gains[k])
        return place, _tail(by_chance, gains[place])

    def gain_beyond(self, freed: Sequence[int], k: int) -> tuple[float, float]:
        """Gain of a freed number after the others, and the probability of that by chance."""
        gains, by_chance = self.gains([j for j in freed if j != k])
        return gains[k], _tail(by_chance, gains[k])

    def fit(self, freed: Sequence[int]) -> tuple[float, Array]:
        """chi2 with the numbers ``freed``, and their shifts z, in standard deviations."""
        if not freed:
            return float(self.r @ self.r), np.zeros(0)
        from scipy.optimize import lsq_linear  # late: not for those who read results

        answer = lsq_linear(self.G[:, list(freed)], self.r, (-FREED_SD, FREED_SD))
        return 2 * float(answer.cost), answer.x

    def in_place_of(self, freed: Sequence[int], k: int) -> dict[int, float]:
        """chi2 with each number that is left in the place of ``k``."""
        others = [j for j in freed if j != k]
        return {j: self.fit([*others, j])[0] for j in self.left(freed)}


def select_numbers(candidates: Candidates) -> SelectedNumbers:
    """Free numbers until a gain is no better than `CHANCE`."""
    freed: list[int] = []
    tried = list[set[int]]()
    while True:
        place, p_value = candidates.best(freed)
        if place is None or p_value > CHANCE:
            break
        freed = _exchanged(candidates, [*freed, place])
        while len(freed) > 1:
            idle = {k: candidates.gain_beyond(freed, k)[1] for k in freed}
            worst = max(idle, key=lambda k: idle[k])
            if idle[worst] <= CHANCE:
                break
            freed.remove(worst)
        if set(freed) in tried:  # taken out as often as it is freed
            break
        tried.append(set(freed))
    chi2, shifts = candidates.fit(freed)
    numbers = []
    for k, shift in zip(freed, shifts.tolist(), strict=True):
        after = candidates.in_place_of(freed, k)
        alike = sorted((j for j in after if after[j] < chi2 + SAME_CHI2), key=lambda j: after[j])
        numbers.append(SelectedNumber(k, *candidates.gain_beyond(freed, k), shift, tuple(alike)))
    numbers.sort(key=lambda each: -each.gain)
    return SelectedNumbers(tuple(numbers), candidates.fit([])[0], chi2, place, p_value)


def likeliest_shifts(r: Array, covariance: Array, G: Array) -> Array:
    """Shift (k,) of every number in standard deviations with all of them free, each as likely as
    its standard deviation states: `diagnose` reports them as ``constants``."""
    return np.asarray(G.T @ np.linalg.solve(covariance + G @ G.T, r))


def _exchanged(candidates: Candidates, freed: Sequence[int]) -> list[int]:
    """The numbers after all exchanges of one for another that lower chi2."""
    freed = list(freed)
    least, improved = candidates.fit(freed)[0], len(freed) > 1
    while improved:
        improved = False
        for place, k in enumerate(freed):
            after = candidates.in_place_of(freed, k)
            best = min(after, key=lambda j: after[j], default=None)
            if best is not None and after[best] < least - 1e-9:
                freed[place], least, improved = best, after[best], True
    return freed


def _bounded_gain(u: Array, s: Array) -> Array:
    """max of 2 u z - s z^2 over |z| <= 3, (k,)."""
    z = np.clip(u / s, -FREED_SD, FREED_SD)
    return np.asarray(2 * u * z - s * z**2)


def _tail(draws: Array, value: float) -> float:
    """Probability of at least ``value``, the value counted as a draw, which keeps it above 0."""
    return float((1 + (draws >= value).sum()) / (1 + len(draws)))
