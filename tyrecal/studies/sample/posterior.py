"""The posterior density of the design variables, on an emulator.

    ln p(x | y) = -1/2 r^T Sigma^-1 r + constant,   r = y - eta(x),   x within the variables' bounds

eta: ln f of the measured modes; Sigma: scatter, the model's form and what nobody calibrates, as a
diagnosis has it (inference/covariance.py), and the emulator's error. Before the measurement every x
within the bounds is as good as another: of a variable on a logarithmic scale, every ratio.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..emulator import Emulator, spread

Array = np.ndarray
AT_ONCE = 512  # designs: what is computed of them stays in the processor's cache
STARTS, STEPS = 64, 60  # of `optima`
AT_OPTIMUM = 1e-6  # standard deviations: starts as near as this have arrived
SAME_OPTIMUM = 0.1  # standard deviations: optima closer than this are one
FIRST_DAMPING, STIFFEST = 1e-3, 1e6  # of a step, in units of the information


@dataclass(frozen=True)
class Posterior:
    """Logarithm of the posterior density, for many x at a time."""

    emulators: tuple[Emulator, ...]  # one for each way of holding the rim
    states: Array  # (s, 1 + k): the emulator, and values of its further coordinates (pressure)
    rows: Array  # (n, 2): of every measured value the places of its state and its label
    y: Array  # (n,) ln of the measured values
    whitened: Array  # (n, n): W with W^T W = Sigma^-1
    box: Array  # (v, 2): within it alone the density is known

    def __call__(self, x: Array) -> Array:
        """ln p (p,) at x (p, v) but for a constant; -inf outside the box."""
        inside = ((self.box[:, 0] <= x) & (x <= self.box[:, 1])).all(1)
        ln_p = np.full(len(x), -np.inf)
        if inside.any():
            ln_p[inside] = -0.5 * (self.residuals(x[inside]) ** 2).sum(1)
        return ln_p

    def residuals(self, x: Array) -> Array:
        """W r (p, n) at x (p, v)."""
        off = self.y - self.ln_f(x, self.rows)
        return np.asarray(off @ self.whitened.T)

    def ln_f(self, x: Array, rows: Array) -> Array:
        """ln f (p, n) of rows of states and labels at x (p, v)."""
        result = np.empty((len(x), len(rows)))
        for first in range(0, len(x), AT_ONCE):
            here, terms = slice(first, first + AT_ONCE), {}
            for state in sorted(set(rows[:, 0].tolist())):
                emulator, own = self._at_states[state], rows[:, 0] == state
                which = self.states[state, 0]
                if which not in terms:  # the same for all states of one emulator
                    terms[which] = emulator.products(x[here])
                result[here, own] = emulator.ln_f_of(terms[which])[:, rows[own, 1]]
        return result

    def slopes(self, x: Array, rows: Array) -> Array:
        """d ln f / d x (p, n, v) of rows at x (p, v)."""
        result = np.empty((len(x), len(rows), x.shape[1]))
        for state, emulator in enumerate(self._at_states):
            own = rows[:, 0] == state
            if own.any():
                result[:, own] = emulator.slopes(x)[:, rows[own, 1]]
        return result

    @cached_property
    def _at_states(self) -> list[Emulator]:
        """Emulators of the variables alone, state by state."""
        return [self.emulators[int(which)].restricted(at) for which, *at in self.states]

    @property
    def stated_errors(self) -> Array:
        """Stated errors of the measured values (n,), by their emulators."""
        errors = [self._at_states[state].stated_errors[label] for state, label in self.rows]
        return np.array(errors)

    @property
    def emulator_covariance(self) -> Array:
        """Covariance (n, n) of the emulators' errors in the measured values. How alike those of one
        design are at two pressures is not known: half of it is taken as common."""
        state, label = self.rows.T
        rim = self.states[state, 0].astype(int)
        covariance = np.zeros((len(rim), len(rim)))
        for which, emulator in enumerate(self.emulators):
            own = np.flatnonzero(rim == which)
            at = np.ix_(label[own], label[own])
            covariance[np.ix_(own, own)] = emulator.error_covariance[at]
        return np.asarray(covariance * (0.5 + 0.5 * (state[:, None] == state)))

    @property
    def evaluations(self) -> int:
        """Number of designs that the emulators evaluated."""
        return sum(each.evaluations + each.failed for each in self.emulators)

    @cached_property
    def optima(self) -> tuple[Array, Array]:
        """Optima (o, v) of the posterior and ln p (o,), see the function `optima`."""
        return optima(self)

    def information(self, x: Array) -> Array:
        """J^T Sigma^-1 J (p, v, v): its inverse is the linear covariance of the variables."""
        J = np.einsum("ij,pjv->piv", self.whitened, self.slopes(x, self.rows))
        return np.einsum("piv,piw->pvw", J, J)


def optima(posterior: Posterior) -> tuple[Array, Array]:
    """The o maxima x (o, v) of the density in the box from many starts, the highest first,
    and ln p (o,).

    Damped Gauss-Newton steps from all starts at a time, each with a damping of its own; what leaves
    the box stops at its edge.
    """
    low, high = posterior.box.T
    x = low + (high - low) * (spread(STARTS, len(low)) + 1) / 2
    value, damping = posterior(x), np.full(len(x), FIRST_DAMPING)
    for _ in range(STEPS):
        J = np.einsum("ij,pjv->piv", posterior.whitened, posterior.slopes(x, posterior.rows))
        pull = np.einsum("piv,pi->pv", J, posterior.residuals(x))
        H = np.einsum("piv,piw->pvw", J, J)
        # an edge holds what is pushed against it
        held = ((x <= low) & (pull < 0)) | ((x >= high) & (pull > 0))
        free = ~held[:, :, None] & ~held[:, None, :]
        scale = np.einsum("pvv->pv", H) * (1 + damping[:, None]) + 1e-300
        H = np.where(free, H, 0.0)
        H[:, range(len(low)), range(len(low))] = scale
        pull = np.where(held, 0.0, pull)
        step = np.linalg.solve(H, pull[:, :, None])[:, :, 0]
        if (pull * step).sum(1).max() < AT_OPTIMUM**2:
            break
        trial = np.clip(x + step, low, high)
        there = posterior(trial)
        better = there > value
        x, value = np.where(better[:, None], trial, x), np.where(better, there, value)
        damping = np.where(better, damping / 5, np.minimum(damping * 4, STIFFEST))
    order = np.argsort(-value, kind="stable")
    x, value = x[order], value[order]
    kept: list[int] = []
    for i, H in enumerate(posterior.information(x)):
        apart = [(x[i] - x[j]) @ H @ (x[i] - x[j]) for j in kept]
        if all(each > SAME_OPTIMUM**2 for each in apart):
            kept.append(i)
    return x[kept], value[kept]
