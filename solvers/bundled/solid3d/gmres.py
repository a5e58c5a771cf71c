"""Generalised minimal residuals, preconditioned from the right (Saad, Iterative Methods, 9.3).

Not by SciPy's gmres, which preconditions from the left, and so minimises another residual.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Array = np.ndarray


def gmres(
    product: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    right: Array,
    tolerance: float,
    longest: int,
    first: Array | None = None,
) -> tuple[Array, int, float]:
    """Solution of ``product(x) = right`` (size,), iterations, and residual over ``right``'s norm.

    first: ``precondition`` of the right side over its norm, where it is known. Ends at a relative
    residual of ``tolerance`` or after ``longest`` iterations.
    """
    size = float(np.linalg.norm(right))
    if not size:
        return np.zeros_like(right), 0, 0.0
    basis, ahead = [right / size], []
    H = np.zeros((longest + 1, longest))
    target = np.zeros(longest + 1)
    target[0] = size
    for j in range(longest):
        ahead.append(precondition(basis[j]) if j or first is None else first)
        w = product(ahead[j])
        for _ in range(2):
            for i, v in enumerate(basis):
                h = float(v @ w)
                H[i, j] += h
                w = w - h * v
        H[j + 1, j] = np.linalg.norm(w)
        y, *_ = np.linalg.lstsq(H[: j + 2, : j + 1], target[: j + 2], rcond=None)
        left = float(np.linalg.norm(H[: j + 2, : j + 1] @ y - target[: j + 2])) / size
        if left <= tolerance or H[j + 1, j] <= 1e-14 * np.linalg.norm(H[:, j]):
            break  # by the second, the basis holds the solution
        basis.append(w / H[j + 1, j])
    return sum(c * v for c, v in zip(y, ahead, strict=True)), j + 1, left
