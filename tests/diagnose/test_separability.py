"""Groups of effects that data cannot tell apart."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.inference.separability import Separability, smallest


def judged(distances: np.ndarray, **lambdas: float) -> Separability:
    sizes = dict.fromkeys(lambdas, 1.0)
    return Separability(
        tuple(lambdas), sizes, lambdas, lambdas, np.eye(len(lambdas)), distances, {}
    )


def test_effects_are_linked_by_what_stands_between_them() -> None:
    """a is near b, b near c, c near d, each from one side alone: one group; e is by itself, and f,
    which nothing shows, links nothing."""
    far = np.full((6, 6), 45.0)
    for i, j in ((1, 0), (1, 2), (3, 2), (4, 5), (5, 0)):
        far[i, j] = 4.5
    separability = judged(far, a=20.0, b=20.0, c=20.0, d=20.0, e=20.0, f=4.5)
    assert [sorted(group) for group in separability.groups()] == [["a", "b", "c", "d"]]
    assert separability.groups(["a", "c", "d", "e"]) == [["c", "d"]]
    assert separability.groups(["a", "e", "f"]) == []


def test_at_the_limits() -> None:
    """delta^2 = 9 is apart, lambda = 9 is seen."""
    just = np.array([[0.0, 9.0], [9.0, 0.0]])
    assert judged(just, a=9.0, b=9.0).groups() == []
    assert judged(np.nextafter(just, 0), a=9.0, b=9.0).groups() == [["a", "b"]]


def test_thesmallest_that_is_seen() -> None:
    """lambda grows as the square: 10 is reached at sqrt(10 / a), nearest to 0 on either side; None
    where the whole range stays below."""
    grid = np.linspace(0.0, 2.0, 81)
    assert smallest(grid, 1000 * grid**2) == pytest.approx(0.1)
    assert smallest(grid, 40 * grid**2) == pytest.approx(0.5)
    assert smallest(grid, 2.4 * grid**2) is None
    assert smallest(grid, 2.5 * grid**2) == pytest.approx(2.0)
    both = np.linspace(-2.0, 2.0, 81)
    assert smallest(both, np.where(both < 0, 90, 40) * both**2) == pytest.approx(-1 / 3)
