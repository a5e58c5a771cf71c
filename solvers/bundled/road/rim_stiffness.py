"""Stiffness of the rim on the road while the patch is held: the pressed tyre's tangent, condensed.

    C = K_bb - K_bf K_ff^-1 K_fb + G

b: six motions of the rim, f: free displacements of the tyre, K: tangent of the tyre and of
`hold_of_patch`.
G is of turns w alone, which move a node of the rim, at d from the wheel's centre, by w x d + w x (w
x d) / 2. The second part works against the forces f that hold the rim. And the tyre's -p V
(`parts.pressure`) counts caps of radius r at the cavity's open ends z, which the rim closes: about
a diameter they turn with it. So

    G = sum f . (w x (w x d)),   and about a diameter  - sum p pi r^2 |z|  in addition

Without a road nothing that the rim does costs anything, then.

The half turn separates down and turn about the vertical (parity 1) from the other four (-1). Each
parity has a factor of its own; that of parity 1 is the footprint's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import csr_matrix

from ...errors import RunFailed
from ..section.parts.part import TyrePart
from ..section.parts.pressure import Pressure
from ..solid3d.circumference import HalfCircle
from ..solid3d.gmres import gmres
from ..solid3d.revolved import Revolved
from .contact_update import ContactUpdate
from .half_turn_symmetry import HalfTurn
from .loaded_modes import TyreOnRoad, factor_with_hold, forces_on

Array = np.ndarray
MOTION_PARITY = np.array(
    [1, -1, -1, 1, -1, -1]
)  # of shifts down, along, across, and turns about these
# matrices (3, 3) of w x d for unit turns w about the three axes, by the last index
TURN = np.cross(np.eye(3)[:, None], np.eye(3)[None], axis=-1).transpose(1, 2, 0) * -1.0
# shift and turn of each motion
UNIT_MOTIONS = [(axis, 0 * axis) for axis in np.eye(3)] + [(0 * axis, axis) for axis in np.eye(3)]
SAMPLES = 8  # angles, which tell harmonics 0 to 2 apart
RIM_RTOL = 1e-6  # residual of the displacements; a stiffness is off by its square
MAX_RIM_RESIDUAL = 1e-3  # above it there is no result
MAX_RIM_GMRES = 60  # iterations
# the deck's axes 1, 2, 3 in those of the road: down, across (the axle), against along
ROAD_OF_DECK = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def rim_stiffness(
    pressed: TyreOnRoad,
    hold: csr_matrix,
    reference_z: float = 0.0,
    factor: ContactUpdate | None = None,
) -> Array:
    """Stiffness (6, 6) of the whole tyre's rim: forces (N) along and moments (N m) about down,
    along, across by shifts (m) and turns (rad) at the wheel's centre.

    hold (k n 3, k n 3), N/m: holds the patch; reference_z: the centre's place on the axle, m;
    factor: of the tangent on fields of parity 1 near U, None: one is formed. Raises RunFailed, and
    what ``check`` raises to stop.
    """
    tyre, check = pressed.tyre, pressed.check
    tyre.residual(pressed.U)  # sets the state of the tangents
    motions = rim_motions(pressed, reference_z)
    C = np.zeros((6, 6))
    for parity in (1, -1):
        symmetry = pressed.symmetry.of_parity(parity)
        own = np.flatnonzero(parity == MOTION_PARITY)
        factor = factor or factor_with_hold(tyre, symmetry, hold, check)
        factor.to(symmetry.fold(hold))
        follow = [followed(tyre, symmetry, hold, motions[j], factor, check) for j in own]
        images = [forces_on(tyre, hold, V) for V in follow]
        # by the energy of both halves, which is off by the square of the displacements' errors
        C[np.ix_(own, own)] = [[2 * float((V * F).sum()) for F in images] for V in follow]
        factor = None
    C += turning_stiffness(pressed, reference_z)
    return (C + C.T) / 2


def rim_motions(pressed: TyreOnRoad, reference_z: float = 0.0) -> list[Array]:
    """Fields (k, n, 3) of the rim's nodes alone by its six unit motions, m and rad."""
    symmetry, X = pressed.symmetry, np.real(pressed.tyre.model.mesh.X) - [0.0, reference_z]
    fields = [rigid(X, symmetry.around, shift, TURN @ turn) for shift, turn in UNIT_MOTIONS]
    return [field * ~symmetry.free for field in fields]


def turning_stiffness(pressed: TyreOnRoad, reference_z: float = 0.0) -> Array:
    """G (6, 6) of the forces that hold the rim, and of caps at the cavity's open ends."""
    G, X = np.zeros((6, 6)), np.real(pressed.tyre.model.mesh.X) - [0.0, reference_z]
    symmetry = pressed.symmetry
    for i, j in zip(*np.nonzero(np.equal.outer(MOTION_PARITY[3:], MOTION_PARITY[3:])), strict=True):
        bent = (TURN[..., i] @ TURN[..., j] + TURN[..., j] @ TURN[..., i]) / 2
        second = ~symmetry.free * rigid(X, symmetry.around, np.zeros(3), bent)
        G[3 + i, 3 + j] += 2 * float((pressed.forces * second).sum())
    G[[3, 4], [3, 4]] += _caps(pressed.tyre.loads, X)
    return G


def reactions(C: Array, motions: Array) -> Array:
    """Reactions (m, 6) along and about the deck's axes to motions (m, 6) along and about them, by a
    stiffness (6, 6) of `rim_stiffness`."""
    turned = np.kron(np.eye(2), ROAD_OF_DECK)
    return np.asarray(motions @ (turned.T @ C @ turned))


def rigid(X: Array, around: HalfCircle, shift: Array, matrix: Array) -> Array:
    """The field (k, n, 3) of the displacements shift + matrix x, both along down, along and across,
    at the places x of points X (n, 2): R, Z from the wheel's centre, m."""
    angles = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    R, Z = X.T
    place = np.stack([c * R, s * R, np.broadcast_to(Z, (SAMPLES, len(Z)))], -1)
    down, along, across = np.moveaxis(shift + place @ matrix.T, -1, 0)
    # amplitudes of exp(i n theta) for n = 0, 1, 2; `turn`: their coefficients (k,)
    waves = np.fft.rfft(np.stack([c * down + s * along, c * along - s * down, across], -1), axis=0)
    waves[1:] *= 2
    turns = [around.turn(n)[:, None, None] * waves[n] for n in range(3)]
    return np.real(sum(turns)) / SAMPLES


def _caps(loads: Sequence[TyrePart], X: Array) -> float:
    """Stiffness, N m/rad, of a turn about a diameter that caps at the open ends of the pressed
    surfaces add; zero if surfaces close the cavity. A surface runs from z > 0 to z < 0 (V > 0), so
    each open end adds - p pi r^2 |z|."""
    thrust = np.zeros(len(X))
    for load in loads:
        assert isinstance(load, Pressure)  # `Spin.at_stations` refuses a spin
        np.add.at(thrust, load.connectivity[:, -1], np.real(load.pressure))
        np.subtract.at(thrust, load.connectivity[:, 0], np.real(load.pressure))
    return float(np.pi * (thrust * X[:, 0] ** 2 * X[:, 1]).sum())


def followed(
    tyre: Revolved,
    symmetry: HalfTurn,
    hold: csr_matrix,
    motion: Array,
    factor: ContactUpdate,
    check: Callable[[], None],
    tolerance: float = RIM_RTOL,
) -> Array:
    """The field (k, n, 3) of a motion of the rim that the free displacements follow; ``tolerance``:
    of the forces that are left. Raises RunFailed, and what ``check`` raises to stop."""
    shape = symmetry.mask.shape

    def product(v: Array) -> Array:
        check()
        V = symmetry.spread(v.reshape(shape))
        return symmetry.gather(forces_on(tyre, hold, V)).ravel()

    def precondition(v: Array) -> Array:
        return factor.solve(v.reshape(shape)).ravel()

    right = -symmetry.gather(forces_on(tyre, hold, motion)).ravel()
    parts, _, left = gmres(product, precondition, right, tolerance, MAX_RIM_GMRES)
    if left > MAX_RIM_RESIDUAL:
        raise RunFailed(
            "no_equilibrium", f"the rim's stiffness was not found in {MAX_RIM_GMRES} iterations"
        )
    return motion + symmetry.spread(parts.reshape(shape))
