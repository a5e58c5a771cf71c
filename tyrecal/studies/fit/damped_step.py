"""Steps within linear bounds: Gauss and Newton's, damped, and of any positive definite Hessian.

    min |r + J d|^2 + mu |d|^2 tr(J^T J) / v   where   G d >= h

of v variables (Nocedal and Wright, Numerical Optimization, sec. 10.3). In coordinates y, d = F
H^(-1/2) y with the objective F = |r| and H = J^T J + ..., its matrix is the identity: the step is
the point of the polyhedron that is nearest to where it would lead without bounds, Lawson and
Hanson's least distance, as in SLSQP (Kraft, DFVLR-FB 88-28); `scipy.optimize`, whose import takes
as long as an evaluation, is not needed for it.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray
ROUND_OFF = 1e-12  # of numbers of the order of 1


def damped_step(J: Array, r: Array, damping: float, G: Array, h: Array) -> Array:
    """d (v,) for ``damping`` mu; no step where G d >= h has no solution."""
    H = J.T @ J
    H[np.diag_indices(len(H))] += damping * np.trace(H) / len(H)
    return quadratic_step(H, J.T @ r, max(float(np.linalg.norm(r)), 1e-300), G, h)


def quadratic_step(H: Array, g: Array, size: float, G: Array, h: Array) -> Array:
    """d (v,) of the least g . d + d . H d / 2 where G d >= h; ``size`` F of the residuals. Raises
    LinAlgError where H is not positive definite."""
    turn = size * np.linalg.inv(np.linalg.cholesky(H)).T
    return np.asarray(turn @ nearest(-turn.T @ g / size**2, G @ turn, h))


def nearest(to: Array, G: Array, h: Array) -> Array:
    """y (n,) with G y >= h that is nearest to a point; 0 where there is none (Lawson and Hanson,
    Solving Least Squares Problems, sec. 23.4, algorithm LDP)."""
    E = np.vstack([G.T, h - G @ to])
    last = np.eye(len(E))[-1]
    residual = E @ non_negative(E, last) - last
    if abs(residual[-1]) < ROUND_OFF:
        return np.zeros(len(to))
    return np.asarray(to - residual[:-1] / residual[-1])


def non_negative(E: Array, f: Array) -> Array:
    """u >= 0 with the least |E u - f| (the same, sec. 23.3, algorithm NNLS)."""
    u, free = np.zeros(E.shape[1]), np.zeros(E.shape[1], bool)
    for _ in range(10 * len(u)):  # each of its active sets comes once, few of all do
        gain = np.where(free, -np.inf, E.T @ (f - E @ u))
        if free.all() or gain.max() <= ROUND_OFF * np.linalg.norm(E[:, gain.argmax()]):
            break
        free[gain.argmax()] = True
        while True:
            wanted = np.zeros_like(u)
            wanted[free] = np.linalg.lstsq(E[:, free], f, rcond=None)[0]
            negative = free & (wanted <= 0)
            if not negative.any():
                break
            share = (u[negative] / (u[negative] - wanted[negative])).min()
            u = u + share * (wanted - u)
            free &= u > ROUND_OFF * u.max()
        u = wanted
    return u
