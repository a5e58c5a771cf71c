"""The linearised equations of a tyre on the road, whose height is one more unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from .contact import Contact
from .half_turn_symmetry import HalfTurn

Array = np.ndarray


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
