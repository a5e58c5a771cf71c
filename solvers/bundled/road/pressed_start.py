"""A tyre on the road as the start of another one of the same mesh.

The other's equilibrium begins at its own inflated shape and at the displacements that the load
added to the start's. GMRES is preconditioned by the start's tangent. Its factor is of the start's
own decks and state, so it is the same whether it is remembered or formed anew: a deck that is run
alone gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...errors import Indefinite
from ..deck.start import PressedStart
from ..section.model import Model
from ..section.parts.pressure import Pressure
from ..solid3d.revolved import Revolved
from .contact import flat_road
from .contact_newton import ContactNewton, FirstGuess
from .contact_update import ContactUpdate
from .multifrontal import Elimination, Factor
from .road_data import RoadData
from .tread import tread_of

Array = np.ndarray
ReadTyre = Callable[[Mapping[str, str]], tuple[Model, list[Pressure], RoadData]]

# of the last start, by its hash: one takes about 0.7 GB with the default mesh
_FACTORS: dict[str, tuple[ContactUpdate, float]] = {}


def begin(start: PressedStart, read: ReadTyre, work: ContactNewton, numbers: Array) -> None:
    """Give ``work`` its first guess; ``numbers`` (n,): its nodes in the deck. A start of another
    mesh, or one that is not stable, is passed over. Raises DeckError."""
    around, rings = work.symmetry.around, len(work.symmetry.around.angles)
    same_mesh = np.array_equal(start.nodes, numbers)
    # with waves the far side has no rings of nodes to compare
    if around.waves.size or not same_mesh or len(start.displacement) != 2 * (rings - 1):
        return
    pressed = start.displacement[:rings]
    inflated = np.multiply.outer(around.turn(0).real, start.inflated)
    if start.sha256 not in _FACTORS:
        _FACTORS.clear()
        try:
            _FACTORS[start.sha256] = _factor(start, read, work, inflated, pressed)
        except Indefinite:
            return
    moved = work.symmetry.parts(pressed - inflated) * work.symmetry.mask
    factor, pressure = _FACTORS[start.sha256]
    own = _pressure([load for load in work.tyre.loads if isinstance(load, Pressure)])
    share = own / pressure if own and pressure else 1.0
    work.first = FirstGuess(start.load_N, moved, start.deflection_m, factor.copy(), share)


def _factor(
    start: PressedStart, read: ReadTyre, work: ContactNewton, inflated: Array, pressed: Array
) -> tuple[ContactUpdate, float]:
    """The start's tangent on the road, factorised, with its contact's columns; its pressure, Pa."""
    model, loads, data = read(start.texts)
    symmetry = work.symmetry
    X, faces = model.mesh.X, model.mesh.faces[data.tread].connectivity
    law = float(np.real(data.stiffness)), float(np.real(data.friction)), data.elastic_slip
    road = flat_road(X, tread_of(X, faces, symmetry.around), *law, inflated)
    contact = road.forces(pressed, road.height - start.deflection_m)
    tyre = Revolved(model, loads, symmetry.around)
    tyre.residual(pressed)
    tangents = tyre.tangents(np.float32)
    stiffness = symmetry.fold(contact.matrix(positive=True))
    factor = ContactUpdate(Factor(Elimination(tangents, symmetry), tangents, stiffness))
    factor.to(symmetry.fold(contact.matrix()))
    return factor, _pressure(loads)


def _pressure(loads: Sequence[Pressure]) -> float:
    """The highest, Pa."""
    return max((float(np.real(load.pressure)) for load in loads), default=0.0)
