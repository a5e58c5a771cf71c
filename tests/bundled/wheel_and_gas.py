"""A coarse inflated tyre whose cavity is closed by the rim's well, and wheels for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.modes.cavity import GasCavity
from tyrecal_solvers.bundled.modes.wheel import Wheel
from tyrecal_solvers.bundled.section.band import Numbering
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure

from . import support

Array = np.ndarray
REFERENCE = 900001
STEEL = {"axial": 15.0, "radial": 15.0, "spin": 0.43, "tilt": 0.27}  # kg and kg m2
MOTIONS = tuple(STEEL)
SHIFT = -4e3  # rad2/s2, below the zeros of rigid motions


@dataclass(frozen=True)
class Inflated:
    """Model, equilibrium (n, 3), loads on cavity and well, equations, rows of the rim."""

    model: Model
    U: Array
    loads: list[Pressure]
    numbering: Numbering
    rim: Array

    def wheel(self, free: tuple[str, ...] = MOTIONS, **stiffness: float) -> Wheel:
        """A steel wheel with free motions, on springs."""
        row = self.model.mesh.index[REFERENCE]
        return Wheel(row, self.rim, frozenset(free), dict(stiffness), STEEL)

    def air(self, density: float = 4.06, bulk: float = 4.78e5) -> GasCavity:
        """A gas in the cavity; by default air at 240 kPa and 20 C."""
        return GasCavity(density, bulk, [load.lines for load in self.loads])

    def vibration(
        self, *others: Wheel | GasCavity | None, shift: float = 0.0
    ) -> harmonics.Vibration:
        wheel, air = (*others, None, None)[:2]
        return harmonics.Vibration(
            self.model, self.U, self.loads, self.numbering, shift, wheel, air
        )


def closed(text: str, z: float = 0.0) -> str:
    """A deck with a reference node on the axle at ``z`` and a surface WELL that closes CAVITY."""
    faces = support.model_of(text).mesh.faces["CAVITY"].connectivity[:, [0, -1]]
    X = support.model_of(text).mesh.X
    rows, count = np.unique(faces, return_counts=True)
    left, right = sorted(rows[count == 1], key=lambda row: X[row, 1])
    text = text.replace("*ELEMENT", f"*NODE\n{REFERENCE}, 0.0, {z!r}\n*ELEMENT", 1)
    well = f"*ELEMENT, TYPE=SFMGAX1, ELSET=WELL\n900001, {right + 1}, {left + 1}\n"
    return text + well + "*SURFACE, NAME=WELL\nWELL, SPOS\n"


@cache
def inflated(pressure: float = 240e3, z: float = 0.0, quadratic: bool = True) -> Inflated:
    tyre = support.tyre((3, 2, 2, 1) if quadratic else (6, 4, 4, 2), quadratic=quadratic)
    m = support.model_of(closed(tyre.deck, z))
    mask = support.held(m, [*tyre.rim, m.mesh.index[REFERENCE]])
    loads = [Pressure(m.mesh.faces[name], pressure) for name in ("CAVITY", "WELL")]
    U = support.inflate(m, mask, loads[:1])
    return Inflated(m, U, loads, support.numbering(m, mask), np.array(tyre.rim))
