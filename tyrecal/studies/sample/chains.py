"""Draws from a density by an ensemble of walkers, and whether they are enough.

emcee (Foreman-Mackey, Hogg, Lang and Goodman 2013): each step moves a half of the walkers by what
the other half knows of the density, here along differences of two of them (ter Braak and Vrugt
2008). The draws of a walker are alike over tau steps, the integrated autocorrelation time; from
N steps come N / tau independent draws a walker, and tau itself is known from 50 tau steps on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np

from ...errors import InputError

Array = np.ndarray
WALKERS = 100
ENOUGH = 50  # tau, of steps
WARM_UP = 5  # tau, of steps that are dropped
MISSING = (
    "tyrecal sample needs the package emcee, which is not installed here:"
    " pip install 'tyrecal[sample]'"
)


@dataclass(frozen=True)
class Chains:
    """draws (steps, walkers, v) after ``dropped`` steps; acceptance: share of accepted moves; tau
    (v,): of each variable, in steps."""

    draws: Array
    dropped: int
    acceptance: float
    tau: Array

    @property
    def flat(self) -> Array:
        """All draws (n, v)."""
        return self.draws.reshape(-1, self.draws.shape[2])

    @property
    def thinned(self) -> Array:
        """Draws (n, v) half an autocorrelation time apart: what more there are tells nothing."""
        apart = max(1, int(self.tau.max() / 2))
        return self.draws[::apart].reshape(-1, self.draws.shape[2])

    @property
    def effective(self) -> float:
        """How many independent draws they are worth, of the variable that moves least."""
        return float(len(self.flat) / self.tau.max())

    @property
    def enough(self) -> bool:
        """Whether they are long enough for tau to be known."""
        return bool(len(self.draws) >= ENOUGH * self.tau.max())


def needs_emcee() -> None:
    """Raises InputError where emcee is not installed."""
    try:
        import emcee  # noqa: F401
    except ImportError:
        raise InputError(MISSING) from None


def walk(
    density: Callable[[Array], Array], start: Array, covariance: Array, count: int, seed: int
) -> Chains:
    """About ``count`` draws in all; walkers begin about the rows of ``start`` (s, v) with a
    ``covariance`` (v, v). Raises InputError where emcee is not installed."""
    needs_emcee()
    import emcee

    size = start.shape[1]
    walkers = max(WALKERS, 4 * size)
    random = np.random.default_rng(seed)
    begin = start[np.arange(walkers) % len(start)]
    begin = begin + random.multivariate_normal(np.zeros(size), covariance, walkers)
    for _ in range(100):  # those outside begin nearer to where they belong
        outside = ~np.isfinite(density(begin))
        if not outside.any():
            break
        nearest = start[np.arange(walkers) % len(start)][outside]
        begin[outside] = nearest + (begin[outside] - nearest) / 2
    moves = [(emcee.moves.DEMove(), 0.9), (emcee.moves.DEMove(gamma0=1.0), 0.1)]
    sampler = emcee.EnsembleSampler(walkers, size, density, moves=moves, vectorize=True)
    state = np.random.RandomState(seed % 2**32).get_state()
    sampler.run_mcmc(emcee.State(begin, random_state=state), max(2, ceil(count / walkers)))
    draws = sampler.get_chain()
    tau = np.maximum(emcee.autocorr.integrated_time(draws, tol=0), 1.0)
    dropped = min(ceil(WARM_UP * tau.max()), len(draws) // 2)
    acceptance = float(np.mean(sampler.acceptance_fraction))
    return Chains(draws[dropped:], dropped, acceptance, tau)
