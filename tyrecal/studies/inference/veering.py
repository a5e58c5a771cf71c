"""Two modes of one harmonic near each other, coupled by uncalibrated constants.

Uncoupled, their a, b = (2 pi f)^2 cross as a tyre changes: slopes extrapolate these. Coupled by q
they are the eigenvalues of [[a, q], [q, b]] and veer (Leissa, ZAMP 25 (1974)):

    lambda = (a + b)/2 +- D,  D = sqrt(delta^2 + q^2),  delta = (a - b)/2,

(1 +- delta/D)/2: share of each uncoupled mode in a coupled one. In the basis of the modes at x0 a
change of a cord angle adds a proportional q, and hardly changes a and b. To first order it moves no
mode; near a crossing it moves both by up to q. So q = size * zeta, zeta ~ N(0, 1), the same for all
pairs and pressures; the evidence integrates over it. (a + b)/2 rises by rise * zeta^2. All lambda
are relative to that of the pair at x0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from .model import Coupling
from .observations import Observations

Array = np.ndarray
MAX_ZETA = 4.0  # standard deviations, from 0 to which zeta is integrated
ZETA_POINTS, ZETA_GRID = 8, 64  # Gauss-Legendre points from 0 to MAX_ZETA; points of a finer grid
NEGLIGIBLE_SHIFT = 5e-4  # shift of ln f at 3 standard deviations of q
MISLABELLED = 0.01  # probability of a label of whose uncoupled mode the measured one has no share


@cache
def rule() -> tuple[Array, Array, Array]:
    """Integration over zeta >= 0, because the sign of q does not matter.

    Returns the points zeta (k,); the matrix (m, k) from ln of the integrand there to ln on a finer
    grid of m points, by an even cubic spline; ln of weight times density (m,) on that grid.
    """
    from scipy.interpolate import CubicSpline

    zeta = MAX_ZETA * (np.polynomial.legendre.leggauss(ZETA_POINTS)[0] + 1) / 2
    fine = MAX_ZETA * (np.arange(ZETA_GRID) + 0.5) / ZETA_GRID
    even = np.vstack([np.eye(ZETA_POINTS)[::-1], np.eye(ZETA_POINTS)])
    between = CubicSpline(np.append(-zeta[::-1], zeta), even)(fine)
    return zeta, between, -(fine**2) / 2 - np.log(np.exp(-(fine**2) / 2).sum())


@dataclass(frozen=True)
class Veering:
    """Coupling of the n observed rows with other modes."""

    size: Array  # (n,) standard deviation of q; 0: the row is not coupled
    rise: Array  # (n,) rise of (a + b)/2 at zeta = 1
    scale: Array  # (n,) mean ln f of the pair at x0: lambda = exp(2 (ln f - scale))
    partner: Array  # (n,) row of the other mode, -1: it was not measured
    other: Array  # (n,) ln f of the other mode at x0
    side: Array  # (n,) 1: the upper of the two measured modes, -1: the lower

    @property
    def active(self) -> bool:
        """Whether any pair is near enough to matter."""
        return bool(self.size.any())

    def coupled(
        self, eta: Array, jacobian: Array, zeta: Array | float
    ) -> tuple[Array, Array, Array]:
        """eta (..., n) and J (..., n, v) of uncoupled modes as those of coupled ones, and ln
        probability (...) of their labels."""
        if not np.any(zeta):
            return eta, jacobian, np.zeros(eta.shape[:-1])
        eta, own, part, ln_label = self.mixed(eta, zeta)
        partners = jacobian[..., self.partner, :]
        return eta, own[..., None] * jacobian + part[..., None] * partners, ln_label

    def mixed(self, eta: Array, zeta: Array | float) -> tuple[Array, Array, Array, Array]:
        """ln f (..., n) of coupled modes from ``eta`` (..., n) of uncoupled ones; their derivatives
        by the row's and by the partner's eta (..., n); ln probability (...) of the labels, larger
        with the share of the label's uncoupled mode. zeta: a number, or one that broadcasts."""
        on = np.flatnonzero(self.size)
        q, mate, scale = zeta * self.size[on], self.partner[on], self.scale[on]
        there = np.where(mate >= 0, eta[..., mate], self.other[on])
        a, b = (np.exp(2 * np.clip(ln_f - scale, -1, 1)) for ln_f in (eta[..., on], there))
        delta = (a - b) / 2
        D = np.sqrt(delta**2 + q**2)
        side = np.where(mate >= 0, self.side[on], np.where(delta < 0, -1.0, 1.0))
        eigenvalues = (a + b) / 2 + self.rise[on] * zeta**2 + side * D
        share = (1 + side * delta / np.maximum(D, 1e-300)) / 2  # of the row's uncoupled mode
        each = np.log(MISLABELLED + (1 - MISLABELLED) * share)
        # one label decides the other, so their mean counts
        ln_label = each.sum(-1) / max(len(on), 1)
        ln_f, own, part = eta.copy(), np.ones_like(eta), np.zeros_like(eta)
        ln_f[..., on] = scale + np.log(np.maximum(eigenvalues, 1e-6)) / 2
        own[..., on] = share * a / eigenvalues
        part[..., on] = np.where(mate >= 0, (1 - share) * b / eigenvalues, 0.0)
        return ln_f, own, part, ln_label

    def weights(self, y: Array, zeta: float) -> Array:
        """d ln f of coupled by ln f of uncoupled modes (n, n), at the measured ln f ``y`` (n,)."""
        own, part = np.ones(len(y)), np.zeros(len(y))
        apart = (np.exp(2 * (y - self.scale)) - np.exp(2 * (y[self.partner] - self.scale))) / 2
        # delta / D, D being half the distance of the measured modes
        r = np.sqrt(1 - np.minimum(zeta * self.size / np.maximum(abs(apart), 1e-300), 1.0) ** 2)
        both = (self.size > 0) & (self.partner >= 0)
        own[both], part[both] = (1 + r[both]) / 2, (1 - r[both]) / 2
        matrix = np.diag(own)
        matrix[np.flatnonzero(both), self.partner[both]] = part[both]
        return matrix


def veering(
    observations: Observations, places: Array, eta: Array, coupling: Coupling | None
) -> Veering:
    """Veering of the observations at ``places`` (n,) among the model's rows, whose ln f at x0 is
    eta (m,)."""
    n = len(places)
    size, rise, partner, side = np.zeros(n), np.zeros(n), np.full(n, -1), np.ones(n)
    scale, other = eta[places], eta[places]
    if coupling is None:
        return Veering(size, rise, scale, partner, other, side)
    runs = [row.run for row in observations.rows]
    seen = {key: i for i, key in enumerate(zip(places.tolist(), runs, strict=True))}
    for i, (place, run) in enumerate(seen):
        mate, q = int(coupling.partner[place]), float(coupling.size[place])
        # |delta| at x0; a relative shift of lambda is twice that of ln f
        apart = abs(np.sinh(eta[place] - eta[mate]))
        if mate < 0 or np.hypot(apart, 3 * q) - apart < 2 * NEGLIGIBLE_SHIFT:
            continue
        size[i], rise[i] = q, coupling.rise[place]
        other[i], scale[i] = eta[mate], (eta[place] + eta[mate]) / 2
        partner[i] = j = seen.get((mate, run), -1)
        side[i] = 1.0 if j < 0 or observations.y[i] > observations.y[j] else -1.0
    return Veering(size, rise, scale, partner, other, side)
