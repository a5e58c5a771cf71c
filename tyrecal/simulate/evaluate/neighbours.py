"""One neighbour of a design for each number, where sensitivities are differences."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)
Reply = TypeVar("Reply")


def neighbours(
    sides: Mapping[Key, Sequence[float]], ask: Callable[[Mapping[Key, float]], Iterable[Reply]]
) -> dict[Key, tuple[float, Reply]]:
    """The neighbour of each number and what was answered there: on the first of its ``sides``, or
    on the next one if that has no solution.

    ask: answers for one neighbour of each number, in order. A failure is the answer if no side has
    a solution, or without a licence, because then the other side would fail, too.
    """
    left = {key: list(each) for key, each in sides.items()}
    known: dict[Key, tuple[float, Reply]] = {}
    while left:
        here = {key: each.pop(0) for key, each in left.items()}
        for (key, neighbour), answer in zip(here.items(), ask(here), strict=True):
            denied = getattr(answer, "denied", False)
            if not isinstance(answer, Exception) or denied or not left[key]:
                known[key] = neighbour, answer
                del left[key]
    return known
