"""The tyre at the end of its static steps, as a frequency step finds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..deck.keywords import Keyword
from ..deck.request import Request
from ..deck.steps import Deck, DeckStep
from ..section.mesh import read_mesh
from ..section.model import Model
from ..section.point_elements import PointElements, read_point_elements
from .cavity import GasCavity, read_cavity
from .wheel import Wheel, read_wheel

Array = np.ndarray
Models = Callable[[float | None, bool, bool], Model]
"""The section's model by `model.build`'s arguments dynamic_Hz, long_term, own_frequency."""


@dataclass
class Inflated:
    """A deck's tyre, and what is asked of it."""

    deck: Deck
    request: Request
    # model blocks: of the section's job; of the job that revolves it, of the section in a splice,
    # both empty where there is none
    section: list[Keyword]
    revolve: list[Keyword]
    sector: list[Keyword]
    models: Models
    half: bool  # they are of half the section, which stands for the whole
    U: Array  # displacements (nodes, 3), m
    check: Callable[[], None]  # raises where the time is over

    @property
    def model(self) -> Model:
        """The section at its relaxed static moduli."""
        return self.models(None, True, False)

    def attached(self) -> PointElements:
        """Masses and springs on the tyre. Raises DeckError."""
        return read_point_elements(self.revolve, read_mesh(self.section))

    def wheel_and_cavity(
        self, model: Model, step: DeckStep
    ) -> tuple[Wheel | None, GasCavity | None]:
        """The rim that moves in a step and the gas in the cavity, where there are such."""
        wheel = read_wheel(self.revolve, model.mesh, step) if step.revolved else None
        cavity = self.request.cavity
        if not cavity:
            return wheel, None
        return wheel, read_cavity(self.section, read_mesh(self.section), cavity)
