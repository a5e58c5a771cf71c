"""Thicker or thinner parts of a deck's section.

A node X of the part moves by (factor - 1) d(X) n(X): d is its distance to that boundary of the part
which is no free outer surface, n the normal of the outer surface nearest to it. A layer becomes
``factor`` times as thick; what it shares with other parts, and cords below it, stay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ...errors import InputError
from .model import DeckModel
from .scope import Point, corner_areas, faces_of, nearest
from .surfaces import Face

Array = np.ndarray
Sets = tuple[str, ...]  # of a part, in upper case
Gauges = tuple[tuple[Sets, float], ...]  # factors on the thickness of parts


@lru_cache(maxsize=8)
def thickened(model: DeckModel, factors: Gauges) -> DeckModel:
    """The section with the thickness of parts times their factors. Raises OwnDeckError where one
    has no free outer surface, or an element folds over; InputError for a set of no section."""
    nodes = dict(model.nodes)
    for sets, factor in factors:
        for n, (r, z) in _growth(model, sets).items():
            nodes[n] = (nodes[n][0] + (factor - 1) * r, nodes[n][1] + (factor - 1) * z)
    for number, element in model.elements.items():
        if element.is_solid and (corner_areas(element, nodes) <= 0).any():
            raise element.block.refused(f"gauges fold element {number} over", element.row)
    return replace(model, nodes=nodes)


@lru_cache(maxsize=8)
def _growth(model: DeckModel, sets: Sets) -> Mapping[int, Point]:
    """Displacement (r, z) of the part's nodes as it becomes twice as thick, in the deck's unit."""
    known = [s.name.upper() for s in model.solids]
    for name in sets:
        if name not in known:
            raise InputError(
                f"deck.gauges: needs sets of sections in deck.parts: {name} is none of"
                f" {', '.join(known)}"
            )
    sections = [s for s in model.solids if s.name.upper() in sets]
    own = {n for section in sections for n in section.elements}
    held, pressed = set(model.rim), {face[:2] for face in model.cavity}
    free = {face[:2] for face in model.boundary if face[:2] not in pressed}
    outer = list[Face]()
    unmatched: dict[frozenset[int], Face] = {}
    for number in sorted(own):
        for name, nodes in faces_of(model.elements[number]):
            face = number, name, nodes
            if (number, name) in free and not held.issuperset(nodes):
                outer.append(face)
            elif unmatched.pop(frozenset(nodes), None) is None:
                unmatched[frozenset(nodes)] = face
    inner = list(unmatched.values())  # of one element of the part alone
    if not outer or not inner:
        raise sections[0].block.refused(f"a gauge of {sets[0]} needs a free outer surface")
    members = sorted({n for number in own for n in model.elements[number].nodes})
    below = {n for _, _, nodes in inner for n in nodes}
    for ply in model.plies:
        lines = [model.elements[n].nodes for n in ply.elements]
        if any(set(members).issuperset(line) and not below.issuperset(line) for line in lines):
            raise sections[0].block.refused(
                f"a gauge needs a part outside all cords, {ply.name} is in {sets[0]}"
            )
    X = np.array([model.nodes[n] for n in members])
    distance, _ = nearest(X, _segments(model, inner))
    _, normal = nearest(X, _segments(model, outer))
    grown = distance[:, None] * normal
    return {n: (float(r), float(z)) for n, (r, z) in zip(members, grown, strict=True)}


def _segments(model: DeckModel, faces: Sequence[Face]) -> Array:
    """Straight pieces (k, 2, 2) of faces: start and end, r and z; the solid on their left."""
    pairs = [pair for _, _, nodes in faces for pair in pairwise(nodes)]
    return np.array([[model.nodes[n] for n in pair] for pair in pairs])
