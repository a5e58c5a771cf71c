"""Generalised minimal residuals, preconditioned from the right (Saad, Iterative Methods, 9.3).

Not by SciPy's gmres, which preconditions from the left, and so minimises another residual. Right
sides that are known at once share each pass over the preconditioner.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Array = np.ndarray
# of vectors (r, size) of the right sides with these places (r,)
Together = Callable[[Array, list[int]], Array]


def gmres(
    product: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    right: Array,
    tolerance: float,
    longest: int,
) -> tuple[Array, int, float]:
    """Solution of ``product(x) = right`` (size,), iterations, and residual over ``right``'s norm.

    Ends at a relative residual of ``tolerance`` or after ``longest`` iterations.
    """
    alone = lambda f: lambda vectors, _: np.stack([f(v) for v in vectors])
    (x,), used, left = gmres_together(
        alone(product), alone(precondition), [right], tolerance, longest
    )
    return x, used, left[0]


def gmres_together(
    product: Together,
    precondition: Together,
    rights: Sequence[Array],
    tolerance: float,
    longest: int,
    first: Array | None = None,
) -> tuple[list[Array], int, list[float]]:
    """Solutions for right sides (size,), each by a space of its own; the most iterations of one,
    and each residual over its right side's norm, 0 of a right side that is 0.

    first: ``precondition`` of the right sides over their norms, where it is known.
    """
    sizes = [float(np.linalg.norm(right)) for right in rights]
    searches = {i: _Search(r, sizes[i], longest) for i, r in enumerate(rights) if sizes[i]}
    active, used = list(searches), 0
    while active and used < longest:
        now = np.stack([searches[i].basis[-1] for i in active])
        ahead = first[active] if first is not None and not used else precondition(now, active)
        images = product(ahead, active)
        for i, z, w in zip(active, ahead, images, strict=True):
            searches[i].add(z, w)
        used += 1
        active = [i for i in active if not searches[i].ends(tolerance)]
    solutions = [searches[i].solution() if sizes[i] else 0 * r for i, r in enumerate(rights)]
    return solutions, used, [searches[i].left if sizes[i] else 0.0 for i in range(len(rights))]


class _Search:
    """The Krylov space of one right side of norm ``size``."""

    def __init__(self, right: Array, size: float, longest: int):
        self.size, self.basis, self.ahead = size, [right / size], list[Array]()
        self.H = np.zeros((longest + 1, longest))
        self.target = np.append(size, np.zeros(longest))
        self.left, self.whole = 1.0, False  # whole: the basis holds the solution

    def add(self, ahead: Array, w: Array) -> None:
        """Take in the last basis vector preconditioned, and its image ``w``."""
        self.ahead.append(ahead)
        j = len(self.ahead) - 1
        for _ in range(2):
            for i, v in enumerate(self.basis):
                h = float(v @ w)
                self.H[i, j] += h
                w = w - h * v
        self.H[j + 1, j] = np.linalg.norm(w)
        H, target = self.H[: j + 2, : j + 1], self.target[: j + 2]
        self.y = np.linalg.lstsq(H, target, rcond=None)[0]
        self.left = float(np.linalg.norm(H @ self.y - target)) / self.size
        self.whole = bool(H[j + 1, j] <= 1e-14 * np.linalg.norm(H[:, j]))
        if not self.whole:
            self.basis.append(w / H[j + 1, j])

    def ends(self, tolerance: float) -> bool:
        """Whether no further vector is wanted."""
        return self.left <= tolerance or self.whole

    def solution(self) -> Array:
        """The vector (size,) of the least residual."""
        return np.asarray(sum(c * z for c, z in zip(self.y, self.ahead, strict=True)))
