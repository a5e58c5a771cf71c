"""Small matrices of a tyre on its hub's motions and its modes, as files: Matrix Market, ABAQUS
`*MATRIX INPUT`, and their description. `tyrecal export --format matrices` calls this.

The solver gives them (`Solver.read`) on its own axes; files have those of ISO 8855, as response
functions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO

import numpy as np

from ..errors import InputError
from ..simulate.deck.decks_design import design_of
from ..simulate.evaluate.evaluator import Evaluator
from ..tyre.case import LoadedCase, start_values
from ..tyre.state import TyreState
from ..tyre.usual import USUAL
from .response import (
    FIRST_TREAD_NODE,
    HUB_CHANNELS,
    HUB_NODE,
    ResponsePoint,
    read_points,
    response_request,
)

Array = np.ndarray
MODE_COORDINATES = 194  # with six of the hub 200
MATRIX_BAND_Hz, MATRIX_PATCH_mm = 300.0, 20.0
POINT_ANGLES = (0, 45, 90, 135, 180)
MATRIX_POINTS = ",".join(
    f"tread:{a}deg:{way}" for a in POINT_ANGLES for way in ("radial", "lateral")
)
FIRST_MODE_NODE, NODE_DOFS = 1001, 6  # of ABAQUS: each node has the coordinates of six modes
TERMS_PER_LINE = 4  # of an equation
MATRIX_NAMES = ("stiffness", "mass", "loss", "tread")
# of the geometric mean of the largest entries in its row and column, below which one is round-off
NEAR_NOTHING = 1e-13

README = """\
Matrices of the tyre '{name}' at {pressure:g} kPa, {state}, by {solver}: {size} coordinates

Fixed-interface reduction (Craig and Bampton): the six motions of the hub, and {modes} modes with
the hub held, the highest at {highest:.0f} Hz. Units: m, rad, N, kg, s.

    (stiffness + i loss - omega^2 mass) x = tread^T F      F: forces at the points, N
    motions of the points = tread x                        omega: 2 pi times the frequency

coordinates  1 to 3  motions of the wheel's centre (on the axle, in the tyre's middle plane), m:
                     x forward, y to the left along the axle, z upwards
             4 to 6  turns about x, y, z, rad
             7 ...   modes with the hub held, of unit modal mass: m kg^0.5

stiffness    symmetric. The hub's rows are {hub_rows}
mass         symmetric, {mass}
loss         imaginary part of the stiffness (structural damping) at {middle:g} Hz{no_loss}
tread        motions of patches of {patch:g} mm at these points, a row each. The angle 0 is below
             the hub, 90 degrees behind it.
{points}

Files        *.mtx: Matrix Market (scipy.io.mmread reads it). tyre.inp: ABAQUS, where node 1 is the
             hub with dof 1 to 6 as above, each node from 1001 on has six modes, and each node from
             101 on has in dof 1 the motion of a point.

Hold the hub, or add the rim's mass and inertia to it. The force of the tyre on a hub that is held
is minus the reaction there. Frequencies and forces on the hub are right up to {band:g} Hz; motions
of the tread near their own force lack the static part of the modes that are left out. Not tested:
the ABAQUS file in ABAQUS.
"""


def matrix_files(
    case: LoadedCase,
    solver: str = "",
    pressure_kPa: float | None = None,
    modes: int = MODE_COORDINATES,
    points: str = MATRIX_POINTS,
    load_N: float = 0.0,
) -> dict[str, bytes]:
    """Files by name: of the case at a pressure (None: the case's) and a load, the patch held, at
    most ``modes`` coordinates of modes. Raises InputError, DeckRefused, EvaluationFailed,
    ValueError."""
    chosen = read_points(points)
    # excite, respond, from, to, step: of two frequencies, whose middle is that of the losses
    request = response_request(points, points, 0.0, MATRIX_BAND_Hz, MATRIX_BAND_Hz, MATRIX_PATCH_mm)
    evaluator = Evaluator(design_of(case), solver)
    values = TyreState(pressure_kPa).design(case, start_values(case))
    if refusal := pressure_kPa is not None and USUAL["pressure_kPa"].refusal(pressure_kPa):
        raise InputError(f"the pressure is {pressure_kPa:g} kPa: {refusal}")
    answer = evaluator.respond(values, {**request, "modes": modes}, load_N)
    matrices = _on_iso_axes({k: np.asarray(answer.response[k]) for k in MATRIX_NAMES})
    matrices = {name: _without_noise(matrix) for name, matrix in matrices.items()}
    hertz = np.sqrt(np.linalg.eigvalsh(matrices["stiffness"][6:, 6:])) / (2 * np.pi)
    has_loss = bool(np.any(matrices["loss"]))
    text = README.format(
        name=case.case.name,
        pressure=answer.pressure_kPa,
        **_words(load_N, answer.deflection_m),
        solver=f"{evaluator.solver.name} {evaluator.solver.version}",
        size=6 + len(hertz),
        modes=len(hertz),
        highest=hertz.max(),
        middle=MATRIX_BAND_Hz / 2,
        no_loss="" if has_loss else ": zero, as no compound has a loss factor",
        patch=MATRIX_PATCH_mm,
        points="\n".join(f"             {k}  {point}" for k, point in enumerate(chosen, 1)),
        band=MATRIX_BAND_Hz,
    )
    files = {f"{name}.mtx": _matrix_market(name, matrix) for name, matrix in matrices.items()}
    abaqus = _abaqus(matrices, chosen, has_loss)
    return {"README.txt": text.encode(), **files, **{k: v.encode() for k, v in abaqus.items()}}


def _words(load_N: float, deflection_m: float) -> dict[str, str]:
    """Words of the README on the state."""
    if not load_N:
        return {
            "state": "unloaded",
            "hub_rows": "zero: the unloaded tyre follows its rim.",
            "mass": "with the mass and the moments of inertia of the tyre without the rim",
        }
    return {
        "state": f"{load_N:g} N on a flat road ({deflection_m * 1e3:.2f} mm)",
        "hub_rows": "those of the pressed tyre, its contact held.",
        "mass": "with what follows the hub of the tyre without the rim",
    }


def _on_iso_axes(matrices: Mapping[str, Array]) -> dict[str, Array]:
    """Matrices whose first six coordinates are motions along and about x, y, z."""
    size = len(matrices["mass"])
    turn = np.eye(size)
    turn[:6, :6] = 0.0  # then columns: x, y, z, rx, ry, rz in the solver's places
    for k, (place, sign) in enumerate(HUB_CHANNELS.values()):
        turn[place, k] = sign
    square = {name: turn.T @ matrices[name] @ turn for name in MATRIX_NAMES[:3]}
    return {name: _symmetric(each) for name, each in square.items()} | {
        "tread": matrices["tread"] @ turn
    }


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2


def _without_noise(matrix: Array) -> Array:
    """Zero for entries that are round-off; the symmetry stays."""
    size = np.abs(matrix)
    least = NEAR_NOTHING * (size.max(1)[:, None] * size.max(0)) ** 0.5
    return np.where(size > least, matrix, 0.0)


def _matrix_market(name: str, matrix: Array) -> bytes:
    from scipy.io import mmwrite
    from scipy.sparse import coo_array

    file, symmetry = BytesIO(), "general" if name == "tread" else "symmetric"
    mmwrite(file, coo_array(matrix), comment=name, precision=17, symmetry=symmetry)
    return file.getvalue()


def _abaqus(
    matrices: Mapping[str, Array], points: Sequence[ResponsePoint], has_loss: bool
) -> dict[str, str]:
    """The ABAQUS file with its matrices, by name."""
    size = len(matrices["mass"])
    places = [(HUB_NODE, k + 1) for k in range(6)]
    places += [(FIRST_MODE_NODE + k // NODE_DOFS, k % NODE_DOFS + 1) for k in range(size - 6)]
    used = {"stiffness": "STIFFNESS", "mass": "MASS"}
    used |= {"loss": "STRUCTURAL DAMPING"} if has_loss else {}
    lines = ["** Tyre: see README.txt", "*NODE"]
    nodes = [*dict.fromkeys(node for node, _ in places)]
    nodes += [FIRST_TREAD_NODE + k for k in range(len(points))]
    lines += [f"{node}, 0., 0., 0." for node in nodes]
    for name in used:
        lines.append(f"*MATRIX INPUT, NAME=TYRE_{name.upper()}, INPUT=tyre_{name}.inp")
    assembled = ", ".join(f"{key}=TYRE_{name.upper()}" for name, key in used.items())
    lines.append(f"*MATRIX ASSEMBLE, {assembled}")
    for k, (row, point) in enumerate(zip(matrices["tread"], points, strict=True)):
        terms = [f"{FIRST_TREAD_NODE + k}, 1, -1."]
        terms += [f"{n}, {d}, {x:.12e}" for (n, d), x in zip(places, row, strict=True) if x]
        lines += [f"** {point}", "*EQUATION", f"{len(terms)}"]
        lines += [
            ", ".join(terms[i : i + TERMS_PER_LINE]) for i in range(0, len(terms), TERMS_PER_LINE)
        ]
    files = {"tyre.inp": "\n".join(lines) + "\n"}
    for name in used:
        rows, columns = np.nonzero(np.tril(matrices[name]))
        entries = [
            f"{places[i][0]}, {places[i][1]}, {places[j][0]}, {places[j][1]},"
            f" {matrices[name][i, j]:.16e}"
            for i, j in zip(rows, columns, strict=True)
        ]
        files[f"tyre_{name}.inp"] = "\n".join(entries) + "\n"
    return files
