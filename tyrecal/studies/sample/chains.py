"""Draws from a density by an ensemble of walkers, and whether they are enough.

emcee (Foreman-Mackey, Hogg, Lang and Goodman 2013): each step moves a half of the walkers by what
the other half knows of the density, here along differences of two of them (ter Braak and Vrugt
2008). The draws of a walker are alike over tau steps, the integrated autocorrelation time; from
N steps come N / tau independent draws a walker. Of W walkers tau itself is known but for a share of

    sqrt(2 (2 M + 1) / (W N)),    M = 5 tau: the window that it is summed over

(Sokal 1989): from 20 tau steps on, four such windows, 10 % of 100 walkers and 5 % of 400.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from ...errors import InputError

Array = np.ndarray
WALKERS = (100, 400)  # at least and at most: a step of many takes hardly longer than one of few
STEPS = 400  # of each walker, which decide how many walkers share the draws
ENOUGH = 20  # tau, of steps
WARM_UP = 5  # tau, of steps that are dropped
WINDOW = 5  # tau: beyond, what is seen of rho is noise
MAX_TIMES = 20  # times the steps that were first wanted: chains that need more stop and say so
SPARE_STEPS = 1.5  # of draws that would be enough: a short chain's tau is too small
TRIES = 100  # of walkers to begin within the box
MISSING = (
    "tyrecal sample needs the package emcee, which is not installed here:"
    " run pip install '.[sample]' in a clone of tyrecal"
)


@dataclass(frozen=True)
class Chains:
    """Draws by several walkers."""

    draws: Array  # (steps, walkers, v) coordinates, without the first steps
    dropped: int  # number of first steps that are left out
    acceptance: float  # share of accepted moves
    tau: Array  # (v,) autocorrelation time of each variable, in steps

    @property
    def flat(self) -> Array:
        """All draws (n, v)."""
        return self.draws.reshape(-1, self.draws.shape[2])

    @property
    def thinned(self) -> Array:
        """Draws (n, v) half an autocorrelation time apart: further ones add nothing."""
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


def walkers(count: int, size: int) -> int:
    """Number of walkers for ``count`` draws of ``size`` variables; emcee needs 2 ``size``."""
    fewest, most = WALKERS
    return max(min(count // STEPS, most), fewest, 4 * size)


def enough_draws(tau: float) -> float:
    """How many draws in all would be enough, of some variables."""
    steps = SPARE_STEPS * (WARM_UP + ENOUGH) * tau
    return steps * (WALKERS[1] if steps > STEPS else WALKERS[0])


def needs_emcee() -> None:
    """Raises InputError where emcee is not installed."""
    try:
        import emcee  # noqa: F401
    except ImportError:
        raise InputError(MISSING) from None


def walk(
    density: Callable[[Array], Array], start: Array, covariance: Array, count: int, seed: int
) -> Chains:
    """About ``count`` draws in all, and up to `MAX_TIMES` as many until they are `Chains.enough`;
    walkers begin about the s starts, rows of ``start`` (s, v), with a ``covariance`` (v, v).
    Raises InputError if emcee is not installed."""
    needs_emcee()
    import emcee

    size = start.shape[1]
    number = walkers(count, size)
    random = np.random.default_rng(seed)
    about = start[np.arange(number) % len(start)]
    begin, width = about.copy(), 1.0
    outside = np.ones(number, bool)
    for _ in range(TRIES):  # who begins outside begins anew, nearer to the optimum in the end
        step = random.multivariate_normal(np.zeros(size), covariance, number, method="cholesky")
        begin[outside] = (about + width * step)[outside]
        outside = ~np.isfinite(density(begin))
        if not outside.any():
            break
        width *= 0.9

    class Together(emcee.moves.DEMove):
        """emcee's move, but that who is accepted is drawn for all walkers at a time: one by one,
        as its own, takes longer than the density. The same draws."""

        def propose(self, model: Any, state: Any) -> tuple[Any, Array]:
            self.setup(state.coords)
            accepted = np.zeros(len(state.coords), bool)
            half = np.arange(len(accepted)) % 2
            model.random.shuffle(half)
            for own in (half == 0, half == 1):
                others = [state.coords[~own]]
                there, _ = self.get_proposal(state.coords[own], others, model.random)
                height, _ = model.compute_log_prob_fn(there)
                chance = np.log(model.random.rand(len(there)))
                accepted[own] = height - state.log_prob[own] > chance
                moved = emcee.State(there, log_prob=height)
                state = self.update(state, moved, accepted, own)
            return state, accepted

    # one move in ten is a whole difference of two walkers, which leads from optimum to optimum
    moves = [(Together(), 0.9), (Together(gamma0=1.0), 0.1)]
    sampler = emcee.EnsembleSampler(number, size, density, moves=moves, vectorize=True)
    # its own looks at every value by itself, which takes longer than the density
    sampler.compute_log_prob = lambda x: (density(x), None)
    state = np.random.RandomState(seed % 2**32).get_state()
    steps = max(2, ceil(count / number))
    most = MAX_TIMES * steps
    sampler.run_mcmc(emcee.State(begin, random_state=state), steps)
    while not (chains := _chains_of(sampler)).enough and steps < most:
        wanted = ceil(SPARE_STEPS * (WARM_UP + ENOUGH) * chains.tau.max())
        more = min(max(wanted - steps, steps // 2), most - steps)
        sampler.run_mcmc(None, more)  # from where the walkers are
        steps += more
    return chains


def _chains_of(sampler: Any) -> Chains:
    """All steps of a sampler but those that still depend on where the walkers began."""
    draws = sampler.get_chain()
    dropped = min(ceil(WARM_UP * autocorrelation_time(draws).max()), len(draws) // 2)
    draws = draws[dropped:]
    acceptance = float(np.mean(sampler.acceptance_fraction))
    return Chains(draws, dropped, acceptance, autocorrelation_time(draws))


def autocorrelation_time(draws: Array) -> Array:
    """tau (v,) of draws (steps, walkers, v), in steps, at least 1 (Sokal 1989; Goodman and Weare
    2010): 1 + 2 sum rho(t), rho the walkers' correlation about the mean of all, up to the first
    window of `WINDOW` tau."""
    count = len(draws)
    spectrum = np.fft.rfft(draws - draws.mean((0, 1)), 2 * count, axis=0)
    covariance = np.fft.irfft(abs(spectrum) ** 2, 2 * count, axis=0)[:count].mean(1)
    tau = 2 * np.cumsum(covariance / covariance[0], 0) - 1
    within = np.arange(count)[:, None] < WINDOW * tau
    last = np.where(within.all(0), count - 1, np.argmin(within, 0))
    return np.maximum(np.take_along_axis(tau, last[None], 0)[0], 1.0)
