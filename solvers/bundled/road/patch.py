"""Area of the contact patch, its edge placed between nodes.

Counting whole shares of nodes makes the area jump as nodes touch. Along the rolling direction the
pressure falls to the edge x = a as in Hertz's theory, p^2 ~ a^2 - x^2 (Johnson, Contact Mechanics,
4.2), so the last nodes that touch tell a. Across, the rows' lengths fall to nothing smoothly.
"""

from __future__ import annotations

import numpy as np

from ..solid3d.circumference import Circumference
from .contact import Contact

Array = np.ndarray
# nodes that tell the edge: of quadratic elements, corners and middles share unevenly
EDGE_NODES = 4


def contact_area(contact: Contact, shares: Array, around: Circumference) -> float:
    """Area (m2) of the whole tyre's patch; ``shares`` (k, c): deformed area of the nodes."""
    force = contact.local[..., 0]
    x = contact.positions[..., 1]
    k = len(force)
    angles = around.angles[:k]
    stretch = np.gradient(x, angles, axis=0)
    length = around.shares[:k, None] * stretch
    total = 0.0
    for column in np.flatnonzero((force > 0).any(0)):
        touching = np.flatnonzero(force[:, column] > 0)
        last = int(touching[-1])
        width = shares[touching, column].sum() / length[touching, column].sum()
        # an inner gap, as under a hollow tread, counts as whole shares
        gap = sum(length[i, column] for i in range(last) if force[i, column] <= 0)
        pressure = force[:, column] / shares[:, column]
        total += width * (edge(x[:, column], pressure, last) - gap)
    return 2 * total


def edge(x: Array, pressure: Array, last: int) -> float:
    """Where the pressure ends, beyond the node ``last`` and before the next one."""
    following = float(x[last + 1]) if last + 1 < len(x) else float(x[last])
    middle = (float(x[last]) + following) / 2
    outer = slice(max(last + 1 - EDGE_NODES, 0), last + 1)
    if last == 0:
        return middle
    fall, level = np.polyfit(x[outer] ** 2, pressure[outer] ** 2, 1)
    if fall >= 0:  # it rises to the edge, as at a sharp shoulder
        return middle
    return float(np.clip(np.sqrt(max(-level / fall, 0.0)), x[last], following))
