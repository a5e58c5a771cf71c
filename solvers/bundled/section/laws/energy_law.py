"""Base class of every law: an energy W of rows z (see `parts.elastic`), its force and its tangent.

A law is a dataclass; its arrays are constants per Gauss point (p,), or per Gauss point and station
round the tyre (p, s). Rows and constants may be complex, which is how slopes are formed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from typing import ClassVar, Self

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class EnergyLaw(ABC):
    """Energy W of a row z: J/m3 of rubber, J/m2 of cords, as the rows' integration weights are
    volumes or areas."""

    # whether `tangent` is given the weights at stations too, which saves a pass over 81 numbers a
    # point; else `ElasticAtStations` multiplies its result
    weighted_tangent: ClassVar[bool] = False

    @abstractmethod
    def energy(self, z: Array) -> Array:
        """W (p,) of rows z (p, k)."""

    @abstractmethod
    def force(self, z: Array) -> Array:
        """dW/dz (p, k)."""

    @abstractmethod
    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        """d2W/dzdz (p, k, k) times ``weights`` (p,)."""

    def bears(self, z: Array) -> bool:
        """Whether the law is defined at these rows, so that an iteration may go on from there."""
        return True

    def stiffened(self, factor: float) -> Self:
        """The law with ``factor`` times the stiffness of rubber, so that nothing wrinkles on the
        way to a load; cords keep theirs."""
        return self

    def tautened(self, tension: float) -> Self:
        """The law with an artificial tension (N/m), as slack parts have it at the start."""
        return self

    def eased(self, ratio: float) -> Self:
        """The law with no bulk modulus above ``ratio`` times the shear modulus."""
        return self

    def frequency_dependent_part(self, table: int) -> Self | None:
        """The part of the tangent that scales with the modulus of table number ``table``; None: no
        part."""
        return None

    def material_part(self, compound: int, modulus: int) -> Self | None:
        """The part of the tangent that is proportional to a modulus (0: shear, 1: bulk) of the
        model's lossy material number ``compound``; None: no part."""
        return None

    def at_stations(self, points: int, stations: int) -> Self:
        """The law with the constants of ``points`` Gauss points repeated for every station."""

        def spread(constant: Array) -> Array:
            if constant.ndim == 2:
                return constant.ravel()
            return np.repeat(np.broadcast_to(constant, points), stations)

        return self._with({name: spread(value) for name, value in self._constants().items()})

    def blended(self, other: Self, share: Array) -> Self:
        """Constants per Gauss point and station (p, s): ``share`` (s,) of the ``other`` law's."""
        constants = {
            name: value[:, None] + np.outer(getattr(other, name) - value, share)
            for name, value in self._constants().items()
        }
        return self._with(constants)

    def _constants(self) -> dict[str, Array]:
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: v for name, v in values.items() if isinstance(v, np.ndarray)}

    def _with(self, constants: dict[str, Array]) -> Self:
        return replace(self, **constants)
