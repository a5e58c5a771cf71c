"""Ritz's method on fields and on responses to what is left of each mode (Davidson).

r = (K - lambda M) u; the basis grows by K0^-1 r, K0 a tangent near K (Davidson, J. Comp. Physics
17, 1975). Where a half turn keeps the tyre, K and M keep apart the fields that it keeps and those
that it reverses: two smaller problems, and one product serves a field of each, since the image of
their sum falls into the images of both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import Protocol

import numpy as np

Array = np.ndarray
INDEPENDENT = 1e-11  # of the basis' Gram matrix
ROUNDS = 2  # of responses


class Operators(Protocol):
    """K, M and K0^-1 of fields."""

    def forces(self, field: Array) -> Array:
        """K u."""

    def inertia(self, field: Array) -> Array:
        """M u."""

    def response(self, force: Array) -> Array:
        """K0^-1 f."""


class Space:
    """Fields of one kind with their images, and the modes among them."""

    def __init__(self, most: int, size: int):
        self._room, self.used = np.empty((3, most, size)), 0
        self.values, self._x = np.empty(0), np.empty((0, 0))

    def add(self, field: Array, forces: Array, inertia: Array) -> None:
        """Take a field with K and M times it."""
        scale = 1 / np.sqrt((field * inertia).sum())
        for row, values in zip(self._room[:, self.used], (field, forces, inertia), strict=True):
            np.multiply(values.ravel(), scale, out=row)
        self.used += 1

    def solve(self) -> None:
        """Eigenvalues ``values`` (m,), rising."""
        V, KV, MV = self._room[:, : self.used]
        K, self._M = V @ KV.T, V @ MV.T
        gram, turn = np.linalg.eigh((self._M + self._M.T) / 2)
        turn = turn[:, gram > INDEPENDENT] / np.sqrt(gram[gram > INDEPENDENT])
        self.values, inner = np.linalg.eigh(turn.T @ ((K + K.T) / 2) @ turn)
        self._x = turn @ inner

    def left(self, wanted: int) -> Array:
        """(K - lambda M) u (wanted, size) of the lowest modes."""
        _, KV, MV = self._room[:, : self.used]
        lowest = self._x[:, :wanted].T
        return np.asarray(lowest @ KV - self.values[:wanted, None] * (lowest @ MV))

    def mode(self, place: int) -> Array:
        """A mode's field (size,), M-normalised."""
        return np.asarray(self._x[:, place] @ self._room[0, : self.used])

    def held(self, first: int) -> Array:
        """(first, m): how much of each of the ``first`` fields the modes hold."""
        return np.asarray(self._M[:first] @ self._x)


def davidson(
    operators: Operators,
    start: Sequence[Sequence[Array]],
    wanted: Sequence[int],
    turned: Callable[[Array], Array] | None,
    check: Callable[[], None],
) -> list[Space]:
    """Spaces with the lowest ``wanted`` modes of each kind in them.

    start: fields of one kind; or of two, those that ``turned``, the half turn, keeps, and those
    that it reverses.
    """
    shape = start[0][0].shape
    spaces = [
        Space(len(fields) + ROUNDS * most, start[0][0].size)
        for fields, most in zip(start, wanted, strict=True)
    ]
    new = [list(fields) for fields in start]
    for rounds in reversed(range(ROUNDS + 1)):
        for together in zip_longest(*new):
            check()
            # of one size, lest the rounding of one drown the other
            here = {i: each / np.linalg.norm(each) for i, each in enumerate(together)
                    if each is not None}  # fmt: skip
            whole = np.sum(list(here.values()), 0)
            images = operators.forces(whole), operators.inertia(whole)
            for i, field in here.items():
                spaces[i].add(field, *(part(each, turned, i) for each in images))
        for space in spaces:
            space.solve()
        if rounds:
            new = [
                [operators.response(force.reshape(shape)) for force in space.left(most)]
                for space, most in zip(spaces, wanted, strict=True)
            ]
            new = [[part(each, turned, i) for each in fields] for i, fields in enumerate(new)]
    return spaces


def part(field: Array, turned: Callable[[Array], Array] | None, kind: int) -> Array:
    """What of a field the half turn keeps (kind 0) or reverses (1); all, without one."""
    if turned is None:
        return field
    return (field + (1 - 2 * kind) * turned(field)) / 2
