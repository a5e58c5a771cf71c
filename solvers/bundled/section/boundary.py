"""Which displacement components are free: *BOUNDARY rows and the rigid rim as a mask."""

from __future__ import annotations

import numpy as np

from ...language.text import Block, DeckError, Row, is_label
from ..deck.steps import DeckStep
from .band import Numbering
from .half_mesh import half_mesh
from .kept_fields import KeptFields
from .mesh import DeckMesh
from .model import Model
from .symmetry import MirrorHalf

# give elements their properties
FILLED = ("SOLID SECTION", "SURFACE SECTION", "MEMBRANE SECTION")
Array = np.ndarray
SECTION_DOFS = {1: 0, 2: 2, 5: 1}  # ABAQUS's r, z, twist to our components r, theta, z
REVOLVED_DOF = {2: 2}  # the axle; axes 1 and 3 are no fixed mix of r and theta round the tyre
REVOLVED_DOFS = {1: 0, 2: 1, 3: 2}  # of a row that holds all three, whatever their order


def numbering(model: Model, step: DeckStep) -> Numbering:
    """Equations of the state's components that ``step`` leaves free, remembered with the mesh.

    Raises DeckError.
    """
    mesh = model.mesh
    free = _free(mesh, step)
    if isinstance(mesh.symmetry, MirrorHalf):
        free[mesh.symmetry.middle, 1:] = False  # the state is its own half turn
    key = "state", free.tobytes()
    if key not in mesh.derived:
        mesh.derived[key] = Numbering(list(mesh.connectivity.values()), free)
    known: Numbering = mesh.derived[key]
    return known


def vibrating(model: Model, step: DeckStep) -> Numbering | KeptFields:
    """Coordinates of the vibrations that ``step`` leaves free. Raises DeckError."""
    mesh, symmetry = model.mesh, model.mesh.symmetry
    if not isinstance(symmetry, MirrorHalf):
        return numbering(model, step)
    free = _free(mesh, step)
    key = "vibrations", free.tobytes()
    if key not in mesh.derived:
        mesh.derived[key] = KeptFields(list(mesh.connectivity.values()), free, symmetry)
    known: KeptFields = mesh.derived[key]
    return known


def keeps_half_turn(mesh: DeckMesh, section: list[Block], steps: list[DeckStep]) -> bool:
    """Whether a job is its own half turn: the mesh, the sets that are filled with something, what
    loads and what holds them, all nodes of elements across the middle plane among that. Raises
    DeckError."""
    half = half_mesh(mesh)
    if half is None or not isinstance(half.symmetry, MirrorHalf):
        return False
    filled = {k.need("ELSET") for k in section if k.name in FILLED}
    filled |= {name for step in steps for name in (*step.centrifugal, *step.spin)}
    loaded = {name for step in steps for name in step.pressures}
    if not (filled <= half.element_sets.keys() and loaded <= half.edges.keys()):
        return False
    across = [rows[half.symmetry.share(rows)[:, 0] < 1] for rows in half.connectivity.values()]
    masks = [_free(mesh, step) for step in steps]
    return all(
        (free == free[half.symmetry.other]).all() and not any(free[rows].any() for rows in across)
        for free in masks
    )


def check_open_ends(mesh: DeckMesh, step: DeckStep) -> None:
    """Refuses a pressure on a surface with an end that is free along the axle.

    -p V would load it with a closed cap's thrust p r^2 / 2 per radian, which is not there; without
    it a pressure that follows has no symmetric stiffness (see `parts.pressure`). Raises DeckError.
    """
    thrust = np.zeros(len(mesh.X))
    for surface, pressure in step.pressures.items():
        lines = mesh.edges[surface]
        np.add.at(thrust, lines[:, -1], np.real(pressure))
        np.subtract.at(thrust, lines[:, 0], np.real(pressure))
    open_ends = (abs(thrust) > 1e-9 * step.pressure) & (mesh.X[:, 0].real > 0)
    if isinstance(mesh.symmetry, MirrorHalf):  # it is cut in the middle plane
        open_ends &= mesh.symmetry.here & ~mesh.symmetry.middle
    loose = open_ends & _free(mesh, step)[:, 2]
    for reference, tied in mesh.reference_nodes.items():
        if rim_freedoms(mesh, step, reference) & {2, 4, 6}:  # along the axle, tilted
            rim = [mesh.index[n] for n in tied]
            loose[rim] = open_ends[rim]
    if loose.any():
        row = int(np.argmax(loose))
        node = next(number for number, own in mesh.index.items() if own == row)
        raise DeckError(
            step.procedure.place,
            f"the surface under pressure ends at node {node}, which is free along the axle: hold it"
            " there (2), or close it by a surface under the same pressure",
        )


def _free(mesh: DeckMesh, step: DeckStep) -> Array:
    """Mask (n, 3) of the components r, theta, z that a step leaves free. Raises DeckError."""
    free = np.zeros((len(mesh.X), 3), bool)
    for rows in mesh.connectivity.values():
        free[rows] = True
    for reference, tied in mesh.reference_nodes.items():
        moves = step.revolved and step.procedure.name == "FREQUENCY"
        if rim_freedoms(mesh, step, reference) and not moves:
            raise DeckError(
                step.procedure.place,
                f"the rim's reference node {reference} must be held in 1, 6: a wheel moves only"
                " in the *FREQUENCY step of a revolved tyre",
            )
        free[[mesh.index[n] for n in tied]] = False
    for row in step.held:
        name = row.name(0)
        if any(_names(mesh, row, reference) for reference in mesh.reference_nodes):
            continue
        nodes = mesh.node_sets.get(name) or ([int(name)] if is_label(name) else [])
        if not nodes or any(n not in mesh.index for n in nodes):
            raise DeckError(row.place, f"node or node set {name} is not defined")
        for component in _components(row, step.revolved):
            free[[mesh.index[n] for n in nodes], component] = False
    return free


def rim_freedoms(mesh: DeckMesh, step: DeckStep, reference: int) -> set[int]:
    """Degrees of freedom 1 to 6 of a rim's reference node that are not held."""
    return set(range(1, 7)) - rim_motion(mesh, step, reference).keys()


def rim_motion(mesh: DeckMesh, step: DeckStep, reference: int) -> dict[int, float]:
    """Displacements (m, rad) that a step prescribes at a rim's reference node, by degree of freedom
    1 to 6. Raises DeckError where one is not zero and the step is no linear one."""
    motion: dict[int, float] = {}
    for row in step.held:
        if _names(mesh, row, reference):
            first, last = _range(row)
            value = float(np.real(row.value(3, 0.0)))
            if value and not step.is_perturbation:
                raise DeckError(row.place, "only zero displacements are honoured")
            motion |= dict.fromkeys(range(first, last + 1), value)
    return motion


def _names(mesh: DeckMesh, row: Row, reference: int) -> bool:
    name = row.name(0)
    return name == str(reference) or mesh.node_sets.get(name) == [reference]


def _range(row: Row) -> tuple[int, int]:
    """First and last degree of freedom of a row of *BOUNDARY."""
    first = row.integer(1)
    return first, row.integer(2) if row.text(2) else first


def _components(row: Row, revolved: bool) -> list[int]:
    """Components (0, 1, 2 of r, theta, z) that a row of *BOUNDARY holds. Raises DeckError."""
    first, last = _range(row)
    if row.text(3) and row.value(3) != 0.0:
        raise DeckError(row.place, "only zero displacements are honoured")
    known = (
        (REVOLVED_DOFS if first == 1 and last >= 3 else REVOLVED_DOF) if revolved else SECTION_DOFS
    )
    chosen = [known[d] for d in range(first, last + 1) if d in known]
    if not chosen:
        raise DeckError(
            row.place, f"degrees of freedom {first} to {last} of a set cannot be held here"
        )
    return chosen
