"""Rubber, and what else fills solid elements: one part for each element type and law.

The rows are the deformation gradient F, row by row (p, 9): F_rR, F_rTheta, F_rZ, F_thetaR, ...

Hourglass control, of patterns that one Gauss point does not see (Flanagan and Belytschko, 1981):

W = k / 2 (gamma . u_i)^2 per radian, for each component i of the displacements,   k = 0.005 G

gamma (m^0.5) are the hourglass vectors of `elements.Solids`, u_i (a,) of an element's nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ....language.text import WHOLE_DECK, Block, DeckError
from .. import shapes
from ..elements import Solids
from ..laws.energy_law import EnergyLaw
from ..materials import Material
from .elastic import Elastic
from .hybrid import Hybrid
from .part import Rows, SectionJob, TyrePart, consistent_mass, on_diagonals

Array = np.ndarray
SHARE_OF_SHEAR_MODULUS = 0.005  # the hourglass stiffness where a deck states none


@dataclass(frozen=True)
class Hourglass(EnergyLaw):
    """Springs between the nodes of an element."""

    stiffness: Array  # (e,), Pa

    def energy(self, z: Array) -> Array:
        return np.asarray(self.stiffness * (z**2).sum(1)) / 2

    def force(self, z: Array) -> Array:
        return self.stiffness[:, None] * z

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        return (self.stiffness * weights)[:, None, None] * np.eye(3)

    def blended(self, other: Hourglass, share: Array) -> Hourglass:
        return self


def hourglass_control(solids: Solids, stiffness: Array) -> Elastic:
    """The hourglass control of one-point elements; stiffness (e,): k."""
    assert solids.hourglass is not None
    gamma = solids.hourglass[:, None]
    ones = np.ones(gamma.shape[:2])
    rows = Rows(
        on_diagonals(gamma), 0 * gamma.real, around=slice(0, 3), rest=np.zeros(3), weights=ones
    )
    return Elastic(solids.connectivity, rows, Hourglass(stiffness))


@dataclass
class _Section:
    """A *SOLID SECTION's share of the elements of one type."""

    elements: Array  # rows of the type's block
    material: Material
    hourglass: complex | float | None  # Pa; None = by default


def read(job: SectionJob) -> list[TyrePart]:
    """The rubber of each element type, and its hourglass control. Raises DeckError."""
    parts: list[TyrePart] = []
    sections: dict[str, list[_Section]] = {}
    for kind, section in _sections(job):
        sections.setdefault(kind, []).append(section)
    for kind, own in sections.items():
        parts += _rubber(job, kind, own)
    for kind in job.mesh.blocks:
        if kind in shapes.solids() and kind not in sections:
            raise DeckError(WHOLE_DECK, f"the {kind} elements have no *SOLID SECTION")
    return parts


def _sections(job: SectionJob) -> Iterator[tuple[str, _Section]]:
    """Element types and sections of the deck. Raises DeckError."""
    keywords: list[Block | None] = [None, *job.keywords, None]
    controls = {k.need("NAME") for k in job.keywords if k.name == "SECTION CONTROLS"}
    for before, k, after in zip(keywords, job.keywords, keywords[2:], strict=False):
        if k.name == "SOLID SECTION":
            material = job.material(k, k.need("MATERIAL"))
            if material.law is None:
                needed = "neither *HYPERELASTIC nor *ELASTIC"
                raise DeckError(k.place, f"material {material.name} of a solid is {needed}")
            control = k.get("CONTROLS")
            if control and control not in controls:
                raise DeckError(k.place, f"section controls {control} are not defined")
            given = after is not None and after.name == "HOURGLASS STIFFNESS"
            stiffness = after.only_row().value(0) if after and given else None
            for kind, rows in job.by_type(k, shapes.solids()).items():
                if material.law.incompressible and not shapes.TYPES[kind].hybrid:
                    words = f"material {material.name} is incompressible (D1 is 0, or not there)"
                    raise DeckError(k.place, f"{words}: {kind} would lock, {kind}H does not")
                yield kind, _Section(rows, material, stiffness)
        elif k.name == "HOURGLASS STIFFNESS" and (before is None or before.name != "SOLID SECTION"):
            raise DeckError(
                k.place, "*HOURGLASS STIFFNESS must be directly under its *SOLID SECTION"
            )


def _rubber(job: SectionJob, kind: str, sections: list[_Section]) -> list[TyrePart]:
    """The elements of one type: those of each law a part. Raises DeckError."""
    solids = job.mesh.blocks[kind]
    assert isinstance(solids, Solids)
    owner = np.full(len(solids.weights), -1)
    for i, section in enumerate(sections):
        if (owner[section.elements] >= 0).any():
            raise DeckError(WHOLE_DECK, f"a {kind} element has two *SOLID SECTION")
        owner[section.elements] = i
    if (owner < 0).any():
        raise DeckError(WHOLE_DECK, f"{(owner < 0).sum()} {kind} elements have no *SOLID SECTION")
    laws = [type(section.material.law) for section in sections]
    parts: list[TyrePart] = []
    for law in dict.fromkeys(laws):
        own = [section for section, its in zip(sections, laws, strict=True) if its is law]
        place = np.cumsum([its is law for its in laws]) - 1  # in ``own``
        mine = np.array([its is law for its in laws])[owner]
        parts += _of_one_law(
            job, solids if mine.all() else solids.pick(mine), own, place[owner[mine]]
        )
    return parts


def _of_one_law(
    job: SectionJob, solids: Solids, sections: list[_Section], owner: Array
) -> list[TyrePart]:
    """Parts of the elements of one type whose materials have the same kind of law. owner (e,): the
    section of each element; constants of a section become those of its Gauss points."""
    g = solids.weights.shape[1]
    table, laws = [], []
    for section in sections:
        material, law = section.material, section.material.law
        assert law is not None  # `_sections` has refused the others
        scaled = law.scaled(*material.static_scale(job.long_term))
        laws.append(scaled.nearly_incompressible() if law.incompressible else scaled)
        modulus_table = job.tables.index(material.table) if material.table in job.tables else -1
        ratio = (  # dynamic over static shear and bulk modulus
            (1.0, 1.0)
            if modulus_table >= 0
            else material.dynamic_ratio(job.dynamic_Hz, job.long_term)
        )
        hold = section.hourglass  # hourglass stiffness, Pa
        if hold is None:
            hold = SHARE_OF_SHEAR_MODULUS * np.ravel(laws[-1].shear_modulus)[0]
        compound = job.lossy.index(material) if material in job.lossy else -1
        table.append([*ratio, material.density, hold, modulus_table, compound])
    shear, bulk, density, hold, modulus_table, compound = np.array(table).T[:, owner]
    point = lambda values: np.repeat(values, g)  # of elements to Gauss points
    is_static = job.dynamic_Hz is None or not (np.any(shear != 1) or np.any(bulk != 1))
    law = replace(
        laws[0].of_points(laws, point(owner)),
        shear_ratio=None if is_static else point(shear),
        bulk_ratio=None if is_static else point(bulk),
        table=point(modulus_table.real.astype(int)) if job.tables else None,
        compound=point(compound.real.astype(int)) if job.lossy else None,
    )
    # z = F row by row; du/dTheta changes the rows 1, 4, 7: F_rTheta, F_thetaTheta, F_zTheta
    rows = Rows(
        solids.B0,
        solids.hoop,
        around=slice(1, None, 3),  # F row by row: its column along the circumference
        rest=np.eye(3).ravel(),
        weights=solids.weights,
    )
    mass = consistent_mass(solids.mass_N, density[:, None] * solids.mass_weights)
    rubber = Elastic(solids.connectivity, rows, law, mass)
    if solids.projection is not None:
        rubber = Hybrid(solids.connectivity, rows, law, mass, projection=solids.projection)
    return [rubber] if solids.hourglass is None else [rubber, hourglass_control(solids, hold)]
