"""Half of the section stands for the whole, where the section is its own mirror image.

Half a turn about the vertical, (Theta, z) -> (-Theta, -z), then carries the tyre into itself,
biased cords and twist included, and displacements u = (u_r, u_theta, u_z) into S u, S = diag(1, -1,
-1). So the state under pressure keeps u(z) = S u(-z). The half turn makes exp(i n Theta) run the
other way round, complex conjugation turns it back: both together,

    U(z) -> S conj U(-z),

commute with K(n) and M, with the rim's motions, the air and, as the spin changes its sign too,
with the Coriolis matrix 2 i Omega M (e_z x). Their square is 1, so what they keep is a real space
that K(n) maps into itself: fields c = a + i b, a real and its own half turn, b real and reversed.
At n = 0 a and b are apart, and u = a + b are all real fields.

Sums over the elements of z >= 0 are half of all. What breaks the symmetry is solved on the whole.
"""

from __future__ import annotations

from collections import Counter
from functools import cached_property

import numpy as np

from ...errors import Refused

Array = np.ndarray
MIRROR_SIGNS = np.array([1.0, 1.0, -1.0])  # in the middle plane z = 0: r, theta, z
HALF_TURN = np.array([1.0, -1.0, -1.0])  # about the vertical: r, theta, z
SAME_PLACE = 1e-6  # m
EXACT = 1e-12  # m, the last digits of a deck


def mirror_images(X: Array) -> Array:
    """Each node's mirror image (n,) in the middle plane, -1 if it has none; X (n, 2). If several
    nodes have one place, the first is the image of the first, and so on."""
    seen: Counter[tuple[int, int]] = Counter()
    places = []
    for r, z in np.round(X.real / SAME_PLACE).astype(int).tolist():
        places.append((r, z, seen[r, z]))
        seen[r, z] += 1
    rows = {place: i for i, place in enumerate(places)}
    return np.array([rows.get((r, -z, k), -1) for r, z, k in places])


class Whole:
    """A model of all elements: fields and sums are those of the whole tyre."""

    copies = 1  # factor from sums over the model's elements to those of the whole tyre

    def share(self, rows: Array) -> Array:
        """Factor (e, 1) on the integration weights of elements with the nodes ``rows`` (e, a)."""
        return np.ones((len(rows), 1))

    def field(self, u: Array) -> Array:
        """The field (n, 3, ...) on all nodes, from its values on z >= 0."""
        return u

    def force(self, f: Array) -> Array:
        """Forces (n, 3, ...) of the whole tyre in a kept field, by those of its elements here."""
        return f

    def kept(self, u: Array) -> Array:
        """c = a + i b (n, 3, ...) of a real field: a its kept part, b its reversed part. A complex
        field is kept already."""
        return u


class MirrorHalf(Whole):
    """A model of the elements of z >= 0; those that are their own mirror images count by half.

    X (n, 2): R, Z of all nodes; other (n,): their mirror images; here, middle (n,): those of
    z >= 0, of z = 0.
    Raises Refused.
    """

    copies = 2

    def __init__(self, X: Array):
        self.other = mirror_images(X)
        known = (self.other >= 0) & (self.other[self.other] == np.arange(len(X)))
        if not known.all() or abs(X.real - X.real[self.other] * [1, -1]).max() > EXACT:
            raise Refused("a node has no mirror image")
        self.here = X[:, 1].real > -SAME_PLACE
        self.middle = self.here & self.here[self.other]

    @cached_property
    def _nodes(self) -> tuple[Array, Array]:
        """Nodes (k,) beyond the middle plane and their images before it."""
        beyond = np.flatnonzero(~self.here)
        return beyond, self.other[beyond]

    def turned(self, u: Array) -> Array:
        """S conj u(-z) of u (n, 3): the field turned by half a turn."""
        return _signed(u[self.other].conj())

    def images(self, rows: Array) -> Array:
        """Nodes (e, a) of the elements' mirror images, in the opposite order as the sense turns."""
        return np.asarray(self.other[rows][:, ::-1])

    def keeps(self, rows: Array) -> Array:
        """Mask (e,) of the elements that the model has."""
        own = (np.sort(rows) == np.sort(self.other[rows])).all(1)
        return np.asarray(own | self.here[rows].all(1))

    def share(self, rows: Array) -> Array:
        beside = self.here[rows].all(1) & ~self.middle[rows].all(1)
        return np.where(beside, 1.0, 0.5)[:, None]

    def alike(self, X: Array) -> Array:
        """X (n, 2) with tangents (imaginary) that move both sides alike. The half turn reverses the
        rest of the tangents, so that it changes no eigenvalue at first order."""
        if not np.iscomplexobj(X):
            return X
        return X.real + 0.5j * (X.imag + X.imag[self.other] * [1, -1])

    def field(self, u: Array) -> Array:
        beyond, images = self._nodes
        whole = u.copy()
        whole[beyond] = _signed(u[images].conj())
        return whole

    def force(self, f: Array) -> Array:
        return f + self.turned(f)

    def kept(self, u: Array) -> Array:
        if np.iscomplexobj(u):
            return u
        turned = self.turned(u)
        return (u + turned) / 2 + 0.5j * (u - turned)


def _signed(u: Array) -> Array:
    """S u (n, 3), S = diag(1, -1, -1)."""
    return u * HALF_TURN.reshape(3, *[1] * (u.ndim - 2))
