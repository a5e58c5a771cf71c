"""A tyre on the road as the start of another one of the same mesh.

At each load that both have, the other's equilibrium begins at the start's displacements; the rim's
are its own. To add what the load moved to the other's inflated shape is worse: where elements turn,
the rubber's volume changes.
"""

from __future__ import annotations

import numpy as np

from ..deck.start import PressedStart
from .contact_newton import ContactNewton, FirstGuess

Array = np.ndarray


def begin(start: PressedStart, work: ContactNewton, numbers: Array) -> None:
    """Give ``work`` its guesses; ``numbers`` (n,): its nodes in the deck. A start of another mesh
    is passed over."""
    symmetry, rings = work.symmetry, len(work.symmetry.around.angles)
    same_mesh = np.array_equal(start.nodes, numbers)
    # with waves the far side has no rings of nodes to compare
    if symmetry.around.waves.size or not same_mesh or start.displacement.shape[1] != 2 * rings - 2:
        return
    for load, pressed, deflection in zip(
        start.load_N, start.displacement, start.deflection_m, strict=True
    ):
        parts = np.where(symmetry.mask, symmetry.parts(pressed[:rings]), work.parts)
        work.guesses[float(load)] = FirstGuess(parts, float(deflection))
