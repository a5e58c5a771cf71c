"""The rim as a rigid body that moves in a vibration: its motions, springs, mass and inertia.

Amplitudes q of u = Re[T q exp(i n Theta)] at the rim's nodes, d = x - reference point:

    n = 0   axial   T = (0, 0, 1)          spin about the axle      T = (0, r, 0)
    n = 1   radial  T = (1, i, 0)          tilt about a diameter    T = i (d_z, i d_z, -r)

Radial is a shift along Theta = 0, tilt a turn about it. Higher harmonics leave it at rest. A
rotation w moves a node by w x d + w x (w x d) / 2; the second part works against the forces f (N
per radian) that hold the rim in the inflated state, which adds the stiffness -sum r f_r to the spin
and -sum (r f_r + 2 d_z f_z) to the tilt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...language.text import WHOLE_DECK, Block, DeckError
from ..deck.steps import DeckStep
from ..section.boundary import rim_freedoms
from ..section.materials import Scalar
from ..section.mesh import DeckMesh

Array = np.ndarray
# ABAQUS's degrees of freedom: 1 to 3 along the deck's axes, 2 the axle, 4 to 6 about them
FREEDOMS = {"axial": (2,), "spin": (5,), "radial": (1, 3), "tilt": (4, 6)}
MOTIONS = {0: ("axial", "spin"), 1: ("radial", "tilt")}


@dataclass(frozen=True)
class Wheel:
    """The rim that moves."""

    reference: int  # row of the mesh's X
    rim: Array  # rows (k,) of its nodes
    free: frozenset[str]  # its motions
    stiffness: dict[str, Scalar]  # per motion, N/m or N m/rad; absent = 0
    inertia: dict[str, Scalar]  # per motion, kg or kg m2; absent = 0

    def motions(self, n: int) -> list[str]:
        """The free motions of harmonic n."""
        return [name for name in MOTIONS.get(n, ()) if name in self.free]

    def fields(self, n: int, X: Array) -> tuple[Array, Array]:
        """Real and imaginary part of T (nodes, 3, motions); X (nodes, 2) may be complex."""
        names = self.motions(n)
        real = np.zeros((len(X), 3, len(names)), X.dtype)
        imag = np.zeros_like(real)
        r, d_z = X[self.rim, 0], X[self.rim, 1] - X[self.reference, 1]
        for k, name in enumerate(names):
            if name == "axial":
                real[self.rim, 2, k] = 1.0
            elif name == "spin":
                real[self.rim, 1, k] = r
            elif name == "radial":
                real[self.rim, 0, k] = imag[self.rim, 1, k] = 1.0
            else:
                real[self.rim, 1, k], imag[self.rim, 0, k] = -d_z, d_z
                imag[self.rim, 2, k] = -r
        return real, imag

    def own(self, n: int, X: Array, forces: Array) -> tuple[Array, Array]:
        """Stiffness and mass (motions,) per radian in addition to the tyre's; ``forces`` (nodes,
        3): gradient of the potential in the inflated state, N per radian."""
        circle = np.pi if n else 2 * np.pi  # an amplitude's energy over it, as in `harmonics`
        r, d_z = X[self.rim, 0], X[self.rim, 1] - X[self.reference, 1]
        f_r, f_z = forces[self.rim, 0], forces[self.rim, 2]
        turned = {"spin": -(r * f_r).sum(), "tilt": -(r * f_r + 2 * d_z * f_z).sum()}
        names = self.motions(n)
        stiffness = [self.stiffness.get(m, 0.0) / circle + turned.get(m, 0.0) for m in names]
        return np.array(stiffness), np.array([self.inertia.get(m, 0.0) / circle for m in names])


def read_wheel(keywords: list[Block], mesh: DeckMesh, step: DeckStep) -> Wheel | None:
    """The rim that ``step`` releases, with the point elements of the revolve job's model.

    None where every rim is held. Raises DeckError.
    """
    elements = _point_elements(keywords, mesh)
    wheels = []
    for reference, tied in mesh.reference_nodes.items():
        freedoms = rim_freedoms(mesh, step, reference)
        free = frozenset(m for m, dofs in FREEDOMS.items() if freedoms.issuperset(dofs))
        if freedoms != {dof for motion in free for dof in FREEDOMS[motion]}:
            raise DeckError(
                step.procedure.place,
                "the rim's translations 1 and 3, and its rotations 4 and 6, are free together",
            )
        row = mesh.index[reference]
        if not free:
            continue
        if mesh.X[row, 0] != 0.0:
            raise DeckError(
                step.procedure.place, "the reference point of a rim that moves must be on the axle"
            )
        rim = np.unique([mesh.index[node] for node in tied])
        wheels.append(Wheel(row, rim, free, *_properties(keywords, elements, reference)))
    if len(wheels) > 1:
        raise DeckError(step.procedure.place, "one rim that moves is honoured")
    return wheels[0] if wheels else None


def free_along_load(keywords: list[Block], mesh: DeckMesh, step: DeckStep) -> float | None:
    """Mass, kg, of the wheel whose centre ``step`` releases along the first axis; None: all is
    held. Raises DeckError."""
    elements = _point_elements(keywords, mesh)
    mass_kg = None
    for reference in mesh.reference_nodes:
        freedoms = rim_freedoms(mesh, step, reference)
        if freedoms - {1}:
            raise DeckError(
                step.procedure.place,
                f"of a tyre on a road the rim's reference node {reference} is held in 1, 6, or free"
                " along the load: held in 2, 6",
            )
        if freedoms:
            inertia = _properties(keywords, elements, reference)[1]
            mass_kg = float(np.real(inertia.get("radial", 0.0)))
    return mass_kg


def _point_elements(keywords: list[Block], mesh: DeckMesh) -> dict[str, tuple[str, list[int]]]:
    """Element set to type and nodes of the job's point elements on a rim's reference node; those on
    the tyre are of the module `point_elements`. Raises DeckError."""
    sets: dict[str, tuple[str, list[int]]] = {}
    for k in keywords:
        if k.name == "ELEMENT":
            nodes = [row.integer(1) for row in k.rows]
            missing = [node for node in nodes if node not in mesh.reference_nodes]
            if missing and all(node in mesh.index for node in missing):
                continue
            if missing:
                raise DeckError(k.place, f"node {missing[0]} is not the rim's reference node")
            sets[k.need("ELSET")] = k.need("TYPE"), nodes
    return sets


def _properties(
    keywords: list[Block], elements: dict[str, tuple[str, list[int]]], reference: int
) -> tuple[dict[str, Scalar], dict[str, Scalar]]:
    """Stiffness and inertia per motion. Raises DeckError."""
    springs: dict[int, Scalar] = {}
    inertia: dict[str, Scalar] = {}
    needed = {"SPRING": "SPRING1", "MASS": "MASS", "ROTARY INERTIA": "ROTARYI"}
    for k in keywords:
        if k.name not in needed or k.get("ELSET") not in elements:
            continue
        kind, nodes = elements.get(k.need("ELSET"), ("", []))
        if kind != needed[k.name]:
            raise DeckError(k.place, f"{k.get('ELSET')} is no set of {needed[k.name]} elements")
        if reference not in nodes:
            continue
        if k.name == "SPRING":
            if len(k.rows) != 2:
                raise DeckError(k.place, "*SPRING takes two lines: degree of freedom, stiffness")
            dof, value = k.rows[0].integer(0), k.rows[1].value(0)
            springs[dof] = springs.get(dof, 0.0) + value
        elif k.name == "MASS":
            inertia["axial"] = inertia["radial"] = k.only_row().value(0)
        else:
            across, inertia["spin"], other = (k.only_row().value(i) for i in range(3))
            inertia["tilt"] = across
            if across != other:
                raise DeckError(k.place, "the rim's inertia is that of a body of revolution")
    stiffness: dict[str, Scalar] = {}
    for motion, dofs in FREEDOMS.items():
        values = [springs.pop(dof, 0.0) for dof in dofs]
        if any(value != values[0] for value in values):
            raise DeckError(
                WHOLE_DECK, f"springs on the degrees of freedom {dofs} of the rim must be alike"
            )
        stiffness[motion] = values[0]
    if springs or any(np.real(v) < 0 for v in (*stiffness.values(), *inertia.values())):
        raise DeckError(
            WHOLE_DECK, "springs act on the degrees of freedom 1 to 6 and are not negative"
        )
    return stiffness, inertia
