"""A small tyre inflated on the whole of its section, and its model of half."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from tyrecal_solvers.bundled.section.kept_fields import KeptFields
from tyrecal_solvers.bundled.section.model import Model, build
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.bundled.section.symmetry import MirrorHalf
from tyrecal_solvers.language.text import read_keywords

from . import support

Array = np.ndarray


@dataclass(frozen=True)
class Halves:
    """A small tyre inflated on the whole, its model of half, coordinates of its vibrations."""

    whole: Model
    half: Model
    symmetry: MirrorHalf
    free: Array
    fields: KeptFields
    U: Array
    loads: list[Pressure]


def inflated_halves() -> Halves:
    tyre = support.tyre((3, 2, 2, 1))
    section = read_keywords(tyre.deck)
    whole, half = build(section, None, True), build(section, None, True, half=True)
    held, loads = support.held(whole, tyre.rim), support.cavity(whole, 240e3)
    symmetry = half.mesh.symmetry
    assert isinstance(symmetry, MirrorHalf)
    free = ~held & symmetry.here[:, None]
    fields = KeptFields(list(half.mesh.connectivity.values()), free, symmetry)
    U = support.inflate(whole, held, loads)
    return Halves(whole, half, symmetry, ~held, fields, U, loads)
