"""Response of the pressed tyre, its rim and its patch held, to forces on patches of its tread.

    x = (rim, q),   u = Psi rim + V q,   K = [C    0     ]   M = [Psi^T M Psi  Psi^T M V]
                                             [0  V^T K V]       [V^T M Psi        1    ]

Psi: fields that follow the six unit motions of the rim (`rim_stiffness`); C: its stiffness; V:
modes with the rim held, static responses to the forces and to the inertia of Psi, to the inertia of
these and so on, and to the losses of all that. The force of the tyre on a hub that is held is what
x has of the forces less K + i L - omega^2 M times q; the road bears the rest.

Each parity of the half turn is a problem of its own. Modal masses are those of the whole tyre. The
directions of the hub are those of `modes.response`.

Parts with a loss factor damp a mode by

    zeta_r = 1/2 sum_k eta_k(f_r) phi_r^T K_k phi_r / omega_r^2,   phi_r^T M phi_r = 1

zeta_r: damping ratio of mode r; eta_k: loss factors; K_k: the part of the tangent at U that is
proportional to a compound's shear or bulk modulus (`modes.damping`).
Initial stress, pressure, and what holds the patch have no losses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ...errors import Refused
from ..modes.harmonics import HarmonicModes
from ..modes.response import ResponseResult, TreadPatch
from ..modes.superelement import Superelement
from ..section.materials import LossFactor
from ..section.parts.part import TyrePart
from ..section.symmetry import HALF_TURN
from ..solid3d.revolved import Revolved
from . import davidson
from .contact_update import ContactUpdate
from .half_turn_symmetry import HalfTurn
from .loaded_modes import (
    Inertia,
    LoadedModes,
    TyreOnRoad,
    factor_with_hold,
    forces_on,
    standing_waves,
)
from .rim_stiffness import MOTION_PARITY, followed, rim_motions, turning_stiffness

Array = np.ndarray


class PressedLosses:
    """The parts with losses of a tyre at the field U (k, n, 3), m."""

    def __init__(self, tyre: Revolved, U: Array):
        model = tyre.model
        by_loss: dict[tuple[LossFactor, int], list[TyrePart]] = {}
        for k, material in enumerate(model.lossy):
            assert material.loss  # as it is in ``lossy``
            for modulus in (0, 1):  # shear, bulk
                # without a table both moduli have one loss factor
                law = material.loss, modulus if material.loss.frequency_Hz else 0
                by_loss.setdefault(law, []).extend(model.material_parts(k, modulus))
        laws = {law: parts for law, parts in by_loss.items() if parts}
        self._laws = list(laws)
        self.parts = [
            Revolved(replace(model, parts=parts), [], tyre.around) for parts in laws.values()
        ]
        for part in self.parts:
            part.residual(U)  # sets the state of the tangents

    def factors(self, hertz: float) -> list[float]:
        """The loss factor of each of ``parts``."""
        at = np.array([hertz])
        return [float(loss.at(at)[modulus][0]) for loss, modulus in self._laws]

    def damping_ratios(self, modes: LoadedModes) -> Array:
        """zeta (m,) of modes about U."""
        # half the circumference stores half of the energy
        energies = np.array(
            [[2 * (V * part.product(V)).sum() for part in self.parts] for V in modes.shapes]
        )
        hertz = np.sqrt(modes.eigenvalues) / (2 * np.pi)
        losses = np.array([self.factors(f) for f in hertz])
        return np.asarray((losses * energies).sum(1) / modes.eigenvalues / 2)


MODES_UP_TO = 1.2  # times the highest frequency
MODE_RTOL = 1e-7  # of an eigenvalue, omega^2
INERTIA_ROUNDS = 2  # of static responses to the inertia of the ones before
RIM_FOLLOWED_RTOL = 1e-10  # of forces that Psi leaves, which are missing in those on the hub
REFINEMENTS = 2  # of static responses; what is left of an error counts by its square
SAMPLES_OF_PATCH = 8  # angles
UNLOADED_MODES = 120  # to start from
MIN_PARITY_MODES, FURTHER_MODES = 8, 10  # of a parity that are sought
SNAPSHOTS = 40  # frequencies in the band
NO_RESPONSE = 1e-12  # of the largest, round-off: a force on the tread gives about 1e-6 of it


@dataclass(frozen=True)
class _OneParity:
    """One parity of the tyre on the rim's motions (b,) and q."""

    places: Array  # (b,) of its motions of the rim
    stiffness: Array  # (b + q, b + q)
    mass: Array
    lossy: list[Array]  # stiffness of each part with losses
    tread: Array  # (p, b + q) motions of the points

    def at(self, omega: float, losses: Sequence[float]) -> tuple[Array, Array]:
        """Motions of the points (p, p), and forces on the hub (b, p), per N at each point."""
        Z = self.stiffness - omega**2 * self.mass + 0j
        for eta, part in zip(losses, self.lossy, strict=True):
            Z += 1j * eta * part
        b = len(self.places)
        q = np.linalg.solve(Z[b:, b:], self.tread[:, b:].T)
        return self.tread[:, b:] @ q, self.tread[:, :b].T - Z[:b, b:] @ q


class PressedResponse:
    """Reduced problems of a tyre whose patch ``hold`` (k n 3, k n 3) holds, N/m.

    unloaded: modes of the inflated tyre; points: angle (rad) and component of points of the tread.
    Raises RunFailed, and what ``check`` raises to stop.
    """

    def __init__(
        self,
        pressed: TyreOnRoad,
        hold: csr_matrix,
        unloaded: list[HarmonicModes],
        patch: TreadPatch,
        points: Sequence[tuple[float, int]],
        highest_Hz: float,
        factor: ContactUpdate | None = None,
    ):
        self._pressed, self._hold = pressed, hold
        self._unloaded, self._patch, self._points = unloaded, patch, points
        self.highest_Hz = highest_Hz
        tyre, U = pressed.tyre, pressed.U
        tyre.residual(U)
        self._losses = PressedLosses(tyre, U)
        self._mass = Inertia(tyre.model, tyre.around)
        self._turning = turning_stiffness(pressed)
        self._motions = rim_motions(pressed)
        self.reduced = [self._of_parity(1, factor), self._of_parity(-1, None)]

    def _of_parity(self, parity: int, factor: ContactUpdate | None) -> _OneParity:
        tyre, hold, check = self._pressed.tyre, self._hold, self._pressed.check
        symmetry = self._pressed.symmetry.of_parity(parity)
        factor = factor or factor_with_hold(tyre, symmetry, hold, check)
        factor.to(symmetry.fold(hold))
        field = lambda x: symmetry.spread(x.reshape(symmetry.mask.shape))
        gather = lambda F: symmetry.gather(F).ravel()

        def operator(image: Callable[[Array], Array]) -> davidson.Operator:
            def apply(block: Array) -> Array:
                check()
                return np.array([gather(image(field(x))) for x in block])

            return apply

        stiffness = lambda V: forces_on(tyre, hold, V)
        K, M = operator(stiffness), operator(self._mass)
        inverse = lambda block: factor.solve(block.reshape(-1, *symmetry.mask.shape)).reshape(
            len(block), -1
        )

        places = np.flatnonzero(parity == MOTION_PARITY)
        psi = [
            followed(tyre, symmetry, hold, self._motions[j], factor, check, RIM_FOLLOWED_RTOL)
            for j in places
        ]
        tread = [self._motion(symmetry, *point) for point in self._points]
        rows = np.array([gather(F) for F in tread] + [gather(self._mass(V)) for V in psi])
        rows = rows[rows.any(1)]
        statics = inverse(rows)
        for _ in range(REFINEMENTS):
            statics += inverse(rows - K(statics))

        basis = self._modes(symmetry, K, M, inverse)
        newest = basis.add(statics, K, M)
        lossy = [operator(part.product) for part in self._losses.parts]
        damped = [part(basis.vectors) for part in lossy]
        for _ in range(INERTIA_ROUNDS):
            newest = basis.add(inverse(basis.inertias[-newest:]), K, M)
        if lossy:
            losses = self._losses.factors(self.highest_Hz / 2)
            images = sum(eta * image for eta, image in zip(losses, damped, strict=True))
            basis.add(inverse(images), K, M)
        lossy_images = [
            np.vstack([image, part(basis.vectors[len(image) :])])
            for image, part in zip(damped, lossy, strict=True)
        ]

        def with_rim(image: Callable[[Array], Array], of_basis: Array) -> Array:
            """A matrix (b + q, b + q) of the whole tyre."""
            images = [image(V) for V in psi]
            # the basis has unit mass on half the tyre, so sqrt(1/2) of it on the whole
            rim = 2 * np.array([[(V * F).sum() for F in images] for V in psi])
            across = np.sqrt(2) * np.array([gather(F) for F in images]) @ basis.vectors.T
            whole = np.block([[rim, across], [across.T, of_basis]])
            return np.asarray(whole + whole.T) / 2

        C = with_rim(stiffness, basis.vectors @ basis.images.T)
        b = len(places)
        C[:b, b:] = C[b:, :b] = 0.0  # the round-off of Psi
        C[:b, :b] += self._turning[np.ix_(places, places)]
        moved = [[(F * V).sum() for V in psi] for F in tread]
        own = np.array([gather(F) for F in tread]) @ basis.vectors.T / np.sqrt(2)
        return _OneParity(
            places,
            C,
            with_rim(self._mass, np.eye(len(basis.vectors))),
            [
                with_rim(part.product, basis.vectors @ images.T)
                for part, images in zip(self._losses.parts, lossy_images, strict=True)
            ],
            np.hstack([np.reshape(moved, (len(tread), b)), own]),
        )

    def _modes(
        self,
        symmetry: HalfTurn,
        K: davidson.Operator,
        M: davidson.Operator,
        inverse: davidson.Operator,
    ) -> davidson.Basis:
        """Basis of a parity's modes in the band, and about those up to `MODES_UP_TO` times its end
        and one beyond, as the search for the others leaves them."""
        band = (2 * np.pi * self.highest_Hz) ** 2
        start = [
            (symmetry.parts(V) * symmetry.mask).ravel()
            for V in standing_waves(self._unloaded, symmetry)
        ]
        unloaded = sum(int((m.eigenvalues < band).sum()) for m in self._unloaded)
        basis, count = davidson.basis_of(np.array(start), K, M), max(MIN_PARITY_MODES, unloaded)
        while davidson.lowest(K, M, inverse, basis, count, MODE_RTOL)[0][-1] < band:
            count += FURTHER_MODES
        values, turn = np.linalg.eigh(basis.vectors @ basis.images.T)
        basis.cut(turn[:, : np.searchsorted(values, MODES_UP_TO**2 * band) + 1].T)
        return basis

    def _motion(self, symmetry: HalfTurn, angle: float, way: int) -> Array:
        """Forces (k, n, 3) on half the tyre whose work on a field of the parity is the mean motion
        of the patch about a point."""
        around, patch = symmetry.around, self._patch
        F = np.zeros(symmetry.shape)
        x, w = np.polynomial.legendre.leggauss(SAMPLES_OF_PATCH)
        for place, weight in zip(angle + patch.half_angle * x, w / 2, strict=True):
            place = place % (2 * np.pi)
            nodes, sign = patch.nodes, 1.0
            if place > np.pi:  # the image of the other half
                place, nodes = 2 * np.pi - place, symmetry.other[nodes]
                sign = symmetry.parity * HALF_TURN[way]
            at = around.at(np.array([place]))[0]
            F[:, nodes, way] += sign * weight * np.multiply.outer(at, patch.weights)
        return F

    def result(self, frequencies_Hz: Array, excited: int, harmonics: int) -> ResponseResult:
        """Responses to the first ``excited`` points of the others; harmonics: that the functions
        round the tyre hold."""
        seen, f = len(self._points) - excited, len(frequencies_Hz)
        receptance = np.zeros((seen, excited, f), complex)
        hub = np.zeros((6, excited, f), complex)
        for i, hertz in enumerate(frequencies_Hz):
            losses = self._losses.factors(hertz)
            for reduced in self.reduced:
                motion, force = reduced.at(2 * np.pi * hertz, losses)
                receptance[:, :, i] += motion[excited:, :excited]
                hub[reduced.places, :, i] += force[:, :excited]
        radius = self._patch.radius
        return ResponseResult(frequencies_Hz, receptance, hub, radius, harmonics, harmonics)

    def superelement(self, count: int, first: int) -> Superelement:
        """Matrices on the rim's motions and at most ``count`` others, and motions of the points
        from ``first`` on. Raises Refused if the modes in the band are more."""
        limit = (2 * np.pi * self.highest_Hz) ** 2
        losses = self._losses.factors(self.highest_Hz / 2)
        own = [self._condensed(each, limit, losses, count // 2) for each in self.reduced]
        size = 6 + sum(len(each.mass) - len(each.places) for each in own)
        K, M, loss = (np.zeros((size, size)) for _ in range(3))
        tread = np.zeros((len(self._points), size))
        start = 6
        for each in own:
            at = np.append(each.places, start + np.arange(len(each.mass) - len(each.places)))
            start = int(at[-1]) + 1
            K[np.ix_(at, at)], M[np.ix_(at, at)] = each.stiffness, each.mass
            loss[np.ix_(at, at)] = each.lossy[0]
            tread[:, at] = each.tread
        return Superelement(K, M, loss, tread[first:])

    def _condensed(
        self, reduced: _OneParity, limit: float, losses: Sequence[float], count: int
    ) -> _OneParity:
        """The same with at most ``count`` coordinates q, and one matrix of losses: the modes in the
        band and, of the others, what holds most of their energy in responses there."""
        b, parts = len(reduced.places), zip(losses, reduced.lossy, strict=True)
        loss = sum((eta * part for eta, part in parts), np.zeros_like(reduced.mass))
        values, turn = np.linalg.eigh(reduced.stiffness[b:, b:])
        kept = int(np.searchsorted(values, limit))
        if kept > count:
            raise Refused(
                f"matrices need at least {2 * kept} coordinates of modes, got {2 * count}"
            )
        responses = []
        for square in limit * np.linspace(0, 1, SNAPSHOTS) ** 2:
            Z = reduced.stiffness + 1j * loss - square * reduced.mass
            forces = np.hstack([reduced.tread[:, b:].T, -Z[b:, :b]])
            responses.append((turn.T @ np.linalg.solve(Z[b:, b:], forces))[kept:])
        scale = np.sqrt(values[kept:, None])
        seen = scale * np.array(responses)
        # a force on the tread and a motion of the hub count alike, whatever their units
        size = np.sqrt((np.abs(seen) ** 2).sum((0, 1)))
        seen /= np.maximum(size, NO_RESPONSE * size.max())
        more = np.linalg.svd(np.hstack([*seen.real, *seen.imag]), full_matrices=False)[0]
        more = np.linalg.qr(more[:, : count - kept] / scale)[0]
        _, own = np.linalg.eigh(more.T @ (values[kept:, None] * more))
        T = np.zeros((len(loss), b + kept + more.shape[1]))
        T[:b, :b], T[b:, b : b + kept] = np.eye(b), turn[:, :kept]
        T[b:, b + kept :] = turn[:, kept:] @ more @ own
        apply = lambda matrix: T.T @ matrix @ T
        return _OneParity(
            reduced.places,
            apply(reduced.stiffness),
            apply(reduced.mass),
            [apply(loss)],
            reduced.tread @ T,
        )
