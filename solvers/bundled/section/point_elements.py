"""Masses and springs to the ground on nodes of the revolved tyre, in its plane Theta = 0.

The revolved mesh keeps the section's node numbers in that plane. A node there stands for one
sector of the mesh, so a mass or a spring moves with the mean of the displacement over the angle
beta = 360 degrees / sectors: a harmonic n counts by sin(n beta/2) / (n beta/2). A bare point
would yield without bound as harmonics are added.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...language.text import COMPLEX_STEP, Block, DeckError, Place
from .mesh import DeckMesh

Array = np.ndarray
# of the revolved model at Theta = 0: radial, axial, tangential
COMPONENT_OF_AXIS = {1: 0, 2: 2, 3: 1}


@dataclass(frozen=True)
class PointElements:
    """Displacement components d that carry something, their numbers with a variable's tangent."""

    rows: Array  # (d,) of the mesh's nodes
    components: Array  # (d,): 0, 1, 2 of r, theta, z
    mass: Array  # (d,), kg
    stiffness: Array  # (d,), N/m
    sectors: int  # of the mesh

    def __bool__(self) -> bool:
        return bool(self.mass.any() or self.stiffness.any())

    def rates(self, eigenvalues: Array, at: Array) -> Array:
        """sum of (k' - lambda m') p^2 per mode (m,), ' by what the numbers' tangent is of;
        at (d, m): p, the mean displacement of each component in each mode."""
        k, m = np.imag(self.stiffness) / COMPLEX_STEP, np.imag(self.mass) / COMPLEX_STEP
        return np.asarray(k @ at**2 - eigenvalues * (m @ at**2))

    @property
    def total_kg(self) -> complex:
        """The sum of the masses, each of which is in three components; its imaginary part carries
        a number's tangent."""
        return complex(self.mass.sum()) / 3

    @property
    def highest(self) -> int:
        """Harmonic at which the mean over a sector first vanishes: the sum ends there."""
        return self.sectors

    def share(self, n: int) -> float:
        """Mean of cos(n Theta) over the sector."""
        return float(np.sinc(n / self.sectors))


def read_point_elements(revolve: list[Block], mesh: DeckMesh) -> PointElements:
    """The *MASS and *SPRING elements of a revolve job. Raises DeckError."""
    nodes: dict[str, tuple[str, list[int]]] = {}
    rims: set[str] = set()  # element sets on a rim's reference node are of `wheel`
    mass = np.zeros((len(mesh.X), 3), complex)
    stiffness = np.zeros((len(mesh.X), 3), complex)
    for k in revolve:
        if k.name == "ELEMENT":
            if all(row.integer(1) in mesh.reference_nodes for row in k.rows):
                rims.add(k.need("ELSET"))
                continue
            _, members = nodes.setdefault(k.need("ELSET"), (k.need("TYPE"), []))
            members += [_row(row.integer(1), row.place, mesh) for row in k.rows]
        elif k.name in ("MASS", "SPRING") and k.need("ELSET") not in rims:
            kind, members = nodes.get(k.need("ELSET"), ("", []))
            needed = "MASS" if k.name == "MASS" else "SPRING1"
            if kind != needed:
                raise DeckError(k.place, f"{k.get('ELSET')} is no set of {needed} elements")
            value = _positive(k, 0 if k.name == "MASS" else 1)
            if k.name == "MASS":
                mass[members] += value
            elif (axis := k.rows[0].integer(0)) in COMPONENT_OF_AXIS:
                stiffness[members, COMPONENT_OF_AXIS[axis]] += value
            else:
                raise DeckError(k.place, f"a spring acts along 1, 2 or 3, got {axis}")
    rows, components = np.nonzero(mass.real + stiffness.real)
    pick = rows, components
    return PointElements(rows, components, mass[pick], stiffness[pick], _sectors(revolve))


def _row(number: int, place: Place, mesh: DeckMesh) -> int:
    if number not in mesh.index or number in mesh.reference_nodes:
        raise DeckError(place, f"node {number} is no node of the tyre's section")
    return mesh.index[number]


def _positive(k: Block, line: int) -> complex | float:
    """The positive number on data line ``line`` of a block. Raises DeckError."""
    if len(k.rows) != line + 1:
        raise DeckError(k.place, f"*{k.name} takes {line + 1} data line{'s' * line}")
    value = k.rows[line].value(0)
    if not np.real(value) > 0:
        raise DeckError(k.rows[line].place, f"*{k.name} must be positive, got {np.real(value):g}")
    return value


def _sectors(revolve: list[Block]) -> int:
    for k in revolve:
        if k.name == "SYMMETRIC MODEL GENERATION":
            return sum(int(np.real(row.value(1, 1.0))) for row in k.rows[2:])
    return 0
