"""Hold of the road on the patch while the tyre vibrates.

As ABAQUS in a *FREQUENCY step: contact neither opens nor closes, and where there is friction
nothing slides. The contact's own stiffness holds every point of the patch, along the normal and
along the road,

    K = int k diag(1, t, t) dA,   t = 1 with friction, 0 without

so the hold grows steadily with the load, from nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from .contact import Contact


def held(contact: Contact) -> csr_matrix:
    """The stiffness of fields (k n 3, k n 3) that holds the patch, N/m."""
    road, points = contact.road, contact.points
    kinds = np.diag([1.0, 1.0, 1.0] if road.friction > 0 else [1.0, 0.0, 0.0])
    return points.matrix(road.stiffness * points.area[..., None, None] * kinds)
