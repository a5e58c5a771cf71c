"""The linearised equations of a tyre on the road, whose height is one more unknown, solved by
preconditioned GMRES.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ...errors import NoEquilibrium
from ..solid3d.gmres import gmres_together
from ..solid3d.revolved import Revolved
from .contact import Contact
from .contact_update import ContactUpdate
from .half_turn_symmetry import HalfTurn

Array = np.ndarray
MAX_GMRES = 60


@dataclass(frozen=True)
class Tangent:
    """Linearised equations of half the tyre: the contact's stiffness on the parts, and the road's
    height as one more unknown with its column and row."""

    contact: Contact
    touching: csr_matrix  # (k n 3, k n 3), N/m
    by_height: Array  # (2, f, q, 3), N/m
    of_force: Array  # (2, f, q, 3), N/m
    stiffness: float  # N/m
    turned: bool = False  # it is the transposed tangent

    @classmethod
    def of(cls, contact: Contact, symmetry: HalfTurn) -> Tangent:
        """The tangent at a contact."""
        column, row = (symmetry.gather(f) for f in (contact.by_height(), contact.force_by_height()))
        return cls(contact, contact.matrix(), column, row, contact.stiffness)

    @property
    def transposed(self) -> Tangent:
        """The tyre's part is symmetric."""
        return Tangent(
            self.contact,
            csr_matrix(self.touching.T),
            self.of_force,
            self.by_height,
            self.stiffness,
            not self.turned,
        )


@dataclass(frozen=True)
class Equations:
    """Linear equations of half the tyre: ``force`` (2, f, q, 3) on the parts and ``lacking`` on the
    road (half its force), N."""

    tangent: Tangent
    force: Array
    lacking: float


def solve(
    tyre: Revolved,
    symmetry: HalfTurn,
    factor: ContactUpdate,
    equations: Sequence[Equations],
    tolerance: float,
) -> tuple[list[Array], list[float], int, list[float]]:
    """Displacements' parts and rises of the road, m, that solve equations of the first one's
    tangent, or of that transposed, at the tyre's last state; the iterations; and the relative
    residuals that are left. factor: the preconditioner. Raises NoEquilibrium."""
    tangents, count = [each.tangent for each in equations], len(equations)
    shape, scale = symmetry.mask.shape, max(tangents[0].stiffness, 1.0) ** -0.5
    rights = [np.append(e.force.ravel(), e.lacking * scale) for e in equations]
    factor.to(symmetry.fold(tangents[0].touching))
    # several right-hand sides at once cost little more than one: all wait for the memory
    both = np.stack([t.by_height for t in tangents] + [e.force for e in equations])
    turned = [t.turned for t in tangents]
    answers, first = np.split(factor.solve(both, 2 * turned), [count])
    schur = [
        t.stiffness - float((t.of_force * y).sum()) for t, y in zip(tangents, answers, strict=True)
    ]
    if not all(schur):
        raise NoEquilibrium("no force answers to the road's height")

    def product(vectors: Array, which: list[int]) -> Array:
        images = []
        for v, i in zip(vectors, which, strict=True):
            t, parts, rise = tangents[i], v[:-1].reshape(shape), v[-1] * scale
            V = symmetry.spread(parts)
            image = symmetry.gather(tyre.product(V) + (t.touching @ V.ravel()).reshape(V.shape))
            image += t.by_height * rise
            more = float((t.of_force * parts).sum()) + t.stiffness * rise
            images.append(np.append(image.ravel(), more * scale))
        return np.stack(images)

    def bordered(i: int, v: Array, y: Array) -> Array:
        rise = (v[-1] / scale - float((tangents[i].of_force * y).sum())) / schur[i]
        return np.append((y - answers[i] * rise).ravel(), rise / scale)

    def precondition(vectors: Array, which: list[int]) -> Array:
        ys = factor.solve(vectors[:, :-1].reshape(-1, *shape), [turned[i] for i in which])
        return np.stack([bordered(*each) for each in zip(which, vectors, ys, strict=True)])

    # a number that moves nothing has no right side
    begin = np.stack(
        [
            bordered(i, right, y) / (float(np.linalg.norm(right)) or 1.0)
            for i, (right, y) in enumerate(zip(rights, first, strict=True))
        ]
    )
    solutions, used, left = gmres_together(
        product, precondition, rights, tolerance, MAX_GMRES, begin
    )
    rises = [float(x[-1]) * scale for x in solutions]
    return [x[:-1].reshape(shape) for x in solutions], rises, used, left
