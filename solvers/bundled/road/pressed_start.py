"""A tyre on the road as the start of another one.

The other's equilibrium begins at its own inflated shape and at the displacements that the load
added to the start's. Where both have the same mesh, GMRES is preconditioned by the start's tangent.
Its factor is of the start's own decks and state, so it is the same whether it is remembered or
formed anew: a deck that is run alone gives the same bytes. From another mesh, a coarse one as a
rule, the displacements are carried over by its shape functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.spatial import cKDTree

from ...errors import Indefinite
from ..deck.start import PressedStart
from ..section.locate import hosts_of
from ..section.mesh import DeckMesh
from ..section.model import Model
from ..section.parts.cords import CordsAtStations
from ..section.parts.pressure import Pressure
from ..section.shapes import TYPES
from ..solid3d.revolved import Revolved
from .contact import flat_road
from .contact_newton import ContactNewton, FirstGuess
from .contact_update import ContactUpdate
from .multifrontal import Elimination, Factor
from .road_data import RoadData
from .tread import tread_of

Array = np.ndarray
ReadTyre = Callable[[Mapping[str, str]], tuple[Model, list[Pressure], RoadData]]
MAX_OUTSIDE = 2e-3  # m, of a node from the mesh of a start: arcs and their chords differ by it

# of the last start, by its hash: one takes about 0.7 GB with the default mesh
_FACTORS: dict[str, tuple[ContactUpdate, float]] = {}


def begin(start: PressedStart, read: ReadTyre, work: ContactNewton, numbers: Array) -> None:
    """Give ``work`` its first guess; ``numbers`` (n,): its nodes in the deck. A start of other
    stations round the tyre, or one that is not stable, is passed over. Raises DeckError."""
    around, rings = work.symmetry.around, len(work.symmetry.around.angles)
    if around.waves.size or len(start.displacement) != 2 * (rings - 1):
        return
    pressed = start.displacement[:rings]
    inflated = np.multiply.outer(around.turn(0).real, start.inflated)
    if not np.array_equal(start.nodes, numbers):
        work.first = _of_another_mesh(start, read, work, pressed, pressed - inflated)
        return
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


def _of_another_mesh(
    start: PressedStart, read: ReadTyre, work: ContactNewton, pressed: Array, added: Array
) -> FirstGuess | None:
    """The start's displacements ``pressed`` and what the load ``added`` to them (ring, n, 3),
    carried over, and which cords are taut; None where the start has other layers."""
    model, loads, _ = read(start.texts)
    other = Revolved(model, loads, work.tyre.around)
    other.residual(pressed)
    named: dict[str, int] = {}
    for name in (name for part in other.cords for name in part.layers):
        named.setdefault(name, len(named))
    mine, its = (
        [_places(part, mesh.X, named) for part in tyre.cords]
        for tyre, mesh in ((work.tyre, work.tyre.model.mesh), (other, model.mesh))
    )
    if not its or any(np.isnan(each).any() for each in mine):
        return None
    tree = cKDTree(np.concatenate(its))
    taut = np.concatenate([part.are_taut() for part in other.cords])
    moved = work.symmetry.parts(_carried(model.mesh, work.tyre.model.mesh.X, added))
    return FirstGuess(
        start.load_N,
        moved * work.symmetry.mask,
        start.deflection_m,
        taut=[taut[tree.query(each)[1]] for each in mine],
    )


def _places(part: CordsAtStations, X: Array, named: Mapping[str, int]) -> Array:
    """Middles of the elements (e, 3), m; those of other layers are far apart, and nan if not
    ``named``."""
    layer = [named.get(name, np.nan) for name in part.layers]
    return np.column_stack([X[part.connectivity].mean(1), layer])


def _carried(mesh: DeckMesh, places: Array, field: Array) -> Array:
    """The field (k, n, 3) of a mesh at ``places`` (p, 2), m; zero far outside, as at the rim's
    reference node."""
    solids = {kind: rows for kind, rows in mesh.connectivity.items() if TYPES[kind].faces}
    result = np.zeros((len(field), len(places), 3))
    for i, host in enumerate(hosts_of(places, mesh.X, solids, MAX_OUTSIDE)):
        if host is not None:
            weights = host.kind.at(host.xi[None])[0][0]
            result[:, i] = np.tensordot(field[:, host.nodes], weights, (1, 0))
    return result


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
