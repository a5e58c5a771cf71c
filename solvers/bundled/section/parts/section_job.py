"""What the parts of a section's job are read from."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

import numpy as np

from ...deck.keywords import DeckError, Keyword
from ..materials import Material, ModulusTable
from ..mesh import DeckMesh

Array = np.ndarray


@dataclass(frozen=True)
class SectionJob:
    """A job's model, and the moduli that its rubber is to have."""

    keywords: list[Keyword]
    mesh: DeckMesh
    materials: dict[str, Material]
    tables: list[ModulusTable]  # whose rubber keeps its static modulus: the table is the model's
    dynamic_Hz: float | None  # at which the vibration's modulus is evaluated; None = static
    long_term: bool  # the static state is relaxed, else its moduli are the instantaneous ones

    def material(self, k: Keyword, name: str) -> Material:
        """A material that a keyword names. Raises DeckError."""
        if name not in self.materials:
            raise DeckError(k.line, f"material {name} is not defined")
        return self.materials[name]

    def by_type(self, k: Keyword, kinds: Container[str]) -> dict[str, Array]:
        """The elements of a keyword's set: element type to rows of its block. Raises DeckError."""
        name = k.need("ELSET")
        if name not in self.mesh.element_sets:
            raise DeckError(k.line, f"element set {name} is not defined")
        rows: dict[str, list[int]] = {}
        for number in self.mesh.element_sets[name]:
            kind, position = self.mesh.place[number]
            if kind not in kinds:
                raise DeckError(k.line, f"element {number} of type {kind} cannot have *{k.name}")
            rows.setdefault(kind, []).append(position)
        return {kind: np.array(r) for kind, r in rows.items()}
