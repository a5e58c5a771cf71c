"""What holds the touching nodes to the road while the tyre vibrates.

As ABAQUS in a *FREQUENCY step: contact neither opens nor closes, and where there is friction
nothing slides. The contact's own stiffness holds a node, along the normal and along the road,

    K = k A share diag(1, t, t),   t = 1 with friction, 0 without

with the share of the node's area that the patch covers, its edge placed between nodes: the hold
grows steadily with the load, from nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..solid3d.circumference import Circumference
from .contact import Contact
from .patch import edge

Array = np.ndarray


def held(contact: Contact, areas: Array, around: Circumference) -> Contact:
    """The contact with the stiffness that holds; ``areas`` (k, c): deformed ones of its nodes."""
    road = contact.road
    stiffness = road.stiffness * road.area * covered(contact, areas, around)
    K = np.zeros((*stiffness.shape, 3, 3))
    K[..., 0, 0] = stiffness
    if road.friction > 0:
        K[..., 1, 1] = K[..., 2, 2] = stiffness
    return replace(contact, K=K)


def covered(contact: Contact, areas: Array, around: Circumference) -> Array:
    """Share (k, c) of each node's length along the road that lies in the patch, 0 to 1."""
    force, x = contact.local[..., 0], contact.positions[..., 1]
    depth = contact.positions[..., 0] - contact.height
    angles = around.angles[: len(force)]
    length = around.shares[: len(force), None] * np.gradient(x, angles, axis=0)
    begin = np.cumsum(length, axis=0) - length
    share = np.zeros_like(force)
    for c in np.flatnonzero((force > 0).any(0)):
        last = int(np.flatnonzero(force[:, c] > 0)[-1])
        if last:
            end = edge(x[:, c], force[:, c] / areas[:, c], last)
        else:  # a round tyre's depth falls with x^2 from the only nodes that touch, at x = 0
            end = x[1, c] * np.sqrt(depth[0, c] / (depth[0, c] - depth[1, c]))
        share[:, c] = np.clip((end - begin[:, c]) / length[:, c], 0.0, 1.0)
        share[:last, c] *= force[:last, c] > 0
    return share
