"""Response of the inflated tyre to a force on a patch of its tread, its rim held or in motion.

A patch of half angle b about Theta_0 that is loaded evenly by a force F in all has the harmonics

    f_0 = F / (2 pi),   f_n = F / pi  sin(n b) / (n b)  exp(-i n Theta_0)   (N per radian)

and a point of the tread moves as the mean over the same patch about it. In each harmonic

    (K + i sum_k eta_k(w) K_k - w^2 M) U = f

is projected on a few fields (`reduction`). With T the rigid motions of rim and tyre, the force of
the tyre on the hub is

    h(w) = T^H f + w^2 T^H M U

because K T = 0 and K_k T = 0 on all that is free. Harmonics from 2 on exert none. A rim that moves
by T q, on springs k or free, with a mass m of its own, has in place of that force

    (k - w^2 m) q = h(w) + w^2 T^H M T q,    and -w^2 M T q in the tyre's equation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import RunFailed
from ..section import mechanics
from ..section.kept_fields import Coordinates, KeptFields
from ..section.materials import Material
from ..section.model import Model
from .harmonics import Vibration
from .reduction import PartOfStiffness, ResponseBasis
from .wheel import MOTIONS, Wheel

Array = np.ndarray
SETTLES_UP_TO = 1.5  # times the highest frequency
LAST_HARMONIC = 0.8  # of that at which sin(n b) is zero: shorter waves hold 1 % of the motion there
MIN_HARMONICS = 20  # whose waves must be stable; shorter ones are those of cords that buckle


@dataclass(frozen=True)
class ResponseResult:
    """Responses to unit forces, as `Response.at` has them, at frequencies (f,) in Hz."""

    frequency_Hz: Array
    receptance: Array  # m/N or rad/N
    hub: Array  # N/N or N m/N; of a rim that moves m/N or rad/N
    radius_m: float  # of the inflated tread
    harmonics: int  # that were summed
    harmonics_wanted: int  # more than that where cords buckle in the shorter waves
    matrices: dict[str, Array] = field(default_factory=dict)  # as `superelement` has them


@dataclass(frozen=True)
class TreadPatch:
    """Tread patch of a size, m, and the nodes (k,) whose weighted mean motion is its motion."""

    size: float
    radius: float  # of the inflated tread there, m
    nodes: Array
    weights: Array  # (k,), 1 together

    @property
    def half_angle(self) -> float:
        """b, rad."""
        return self.size / 2 / self.radius

    def share(self, n: int) -> float:
        """sin(n b) / (n b)"""
        return float(np.sinc(n * self.half_angle / np.pi))


def tread_patch(X: Array, U: Array, tread: Array, size: float) -> TreadPatch:
    """The patch about the middle of the tread's nodes (rows); between two of them motion is linear
    in z. X (n, 2): R, Z; U (n, 3): displacements of the inflated tyre; size: both ways, m."""
    z = X[tread, 1].real + U[tread, 2]
    tread, z = tread[np.argsort(z)], np.sort(z)
    inside = np.linspace(-size / 2, size / 2, 201)
    hats = np.array([np.interp((inside[1:] + inside[:-1]) / 2, z, row) for row in np.eye(len(z))])
    weights = hats.mean(1)
    radius = float(weights @ (X[tread, 0].real + U[tread, 0]))
    return TreadPatch(size, radius, tread[weights > 0], weights[weights > 0])


class Response:
    """Reduced problems of all harmonics that the patch excites, of a model's ``vibration`` about
    its inflated state U (n, 3), with the rim held; ``highest_Hz``: of the band; ``check`` may raise
    to stop; ``wheel``: the rim's motions, None = held. Raises RunFailed."""

    def __init__(
        self,
        vibration: Vibration,
        model: Model,
        U: Array,
        patch: TreadPatch,
        highest_Hz: float,
        check: Callable[[], None],
        wheel: Wheel | None = None,
    ):
        self.patch, self._vibration, self._model, self._U = patch, vibration, model, U
        self._wheel = wheel

        def part(model: Model) -> PartOfStiffness:
            return PartOfStiffness(mechanics.tangents(model, U, [], harmonics=True), len(U))

        self._lossy: list[tuple[Material, int, PartOfStiffness]] = [
            (material, modulus, part(replace(model, parts=parts)))
            for k, material in enumerate(model.lossy)
            for modulus in (0, 1)
            if (parts := model.material_parts(k, modulus))
        ]
        self._tables = [part(each) for each in model.frequency_dependent_models()]
        self.highest_Hz, self._middle = highest_Hz, np.array([highest_Hz / 2])
        limit = (2 * np.pi * SETTLES_UP_TO * highest_Hz) ** 2
        self.harmonics: list[_Reduced] = []
        self.wanted = int(LAST_HARMONIC * np.pi / patch.half_angle) + 1
        for n in range(self.wanted):
            check()
            try:
                self.harmonics.append(self._harmonic(n, limit))
            except RunFailed:
                if n < MIN_HARMONICS:
                    raise
                break

    def _harmonic(self, n: int, limit: float) -> _Reduced:
        numbering = self._vibration.numbering
        patch = np.zeros((*self._U.shape, 3))
        for i in range(3):
            patch[self.patch.nodes, i, i] = self.patch.weights
        forces = _coordinates(numbering, patch, n)
        rigid, moved, rigid_mass = self._rigid(n)
        basis = ResponseBasis(self._vibration, n, np.hstack([forces.real, forces.imag, moved]))
        static = basis.V
        basis.settle(limit)
        if self._lossy:
            damped = np.hstack([static, basis.modes(limit)])
            losses = self._losses(self._middle)
            basis.add(sum(eta * self._times(K, damped, n) for eta, K in losses))
        V = basis.V
        return _Reduced(
            n,
            basis.K,
            [V.conj().T @ self._times(part, V, n) for _, _, part in self._lossy],
            [V.conj().T @ self._times(part, V, n) for part in self._tables],
            V.conj().T @ forces,
            moved.conj().T @ V,
            rigid,
            rigid_mass,
            self._rim(n),
        )

    def _rim(self, n: int) -> _Rim | None:
        """The rim's free motions of a harmonic; None if it has none."""
        names = self._wheel.motions(n) if self._wheel else []
        if not self._wheel or not names:
            return None
        circle, wheel = np.pi if n else 2 * np.pi, self._wheel
        own = [[of.get(m, 0.0) / circle for m in names] for of in (wheel.stiffness, wheel.inertia)]
        stiffness, mass = np.real(own)
        return _Rim([MOTIONS[n].index(m) for m in names], stiffness, mass)

    def _times(self, part: PartOfStiffness, V: Array, n: int) -> Array:
        return part.times(V, n, self._vibration.numbering, self._model.mesh.symmetry)

    def _losses(self, frequencies_Hz: Array) -> Iterator[tuple[Array, PartOfStiffness]]:
        """Loss over static stiffness of each part with losses, (f,)."""
        for material, modulus, part in self._lossy:
            assert material.loss is not None
            losses = material.loss.at(frequencies_Hz)[modulus]
            if material.table in self._model.tables and not modulus:
                losses = losses * [np.real(material.table.ratio(f)) for f in frequencies_Hz]
            yield losses, part

    def at_middle(self, reduced: _Reduced) -> tuple[Array, Array]:
        """Real and imaginary part (basis, basis) of a reduced stiffness in the middle of the
        band."""
        stiffness, loss = reduced.K, np.zeros_like(reduced.K)
        for table, part in zip(self._model.tables, reduced.tables, strict=True):
            stiffness = stiffness + (np.real(table.ratio(self._middle[0])) - 1) * part
        for (eta, _), part in zip(self._losses(self._middle), reduced.lossy, strict=True):
            loss = loss + eta[0] * part
        return stiffness, loss

    def _rigid(self, n: int) -> tuple[Array, Array, Array]:
        """T^H of the patch's forces (motions, 3), M T in coordinates (size, motions), and T^H M T
        (motions, motions), per radian."""
        vibration, symmetry = self._vibration, self._model.mesh.symmetry
        X, U = self._model.mesh.X.real, self._U
        if n > 1:
            return np.zeros((0, 3)), np.zeros((vibration.numbering.size, 0)), np.zeros((0, 0))
        r, t, z = X[:, 0] + U[:, 0], U[:, 1], X[:, 1] + U[:, 2]
        if self._wheel:
            z = z - X[self._wheel.reference, 1]
        o, one = np.zeros(len(X)), np.ones(len(X))
        motions = [[o, o, one], [-t, r, o]]
        if n:
            motions = [[one, 1j * one, o], [1j * z, -z, t - 1j * r]]
        fields = np.moveaxis(np.array(motions), (0, 1), (2, 1))
        forces = np.einsum("k,kim->mi", self.patch.weights, fields[self.patch.nodes].conj())
        flat = fields.reshape(len(X), 3, -1)
        images = np.stack([vibration.mass @ flat[:, i] for i in range(3)], 1)
        # what half of the section couples the other half uncouples
        mass = symmetry.copies * np.einsum("kim,kij->mj", flat.conj(), images)
        mass = mass if symmetry.copies == 1 else np.diag(np.diag(mass))
        fields = symmetry.kept(fields)
        inertia = (vibration.mass @ fields.reshape(len(X), -1)).reshape(fields.shape)
        return forces, vibration.numbering.gather(symmetry.force(inertia)), mass

    def at(
        self, frequencies_Hz: Array, excited: list[tuple[float, int]], seen: list[tuple[float, int]]
    ) -> tuple[Array, Array]:
        """Receptances (seen, excited, f), m/N or rad/N, and forces on the hub (6, excited, f), or
        motions of a rim that moves, per N of force.

        excited, seen: angle (rad) and component of each point of the tread. Of the hub: force
        along Theta = 0, along Theta = 90 degrees and along the axle, then moments about them; or
        shifts and turns.
        """
        omega = 2 * np.pi * np.asarray(frequencies_Hz)
        losses = [each for each, _ in self._losses(frequencies_Hz)]
        known = self._model.tables
        tables = [np.array([np.real(t.ratio(f)) - 1 for f in frequencies_Hz]) for t in known]
        receptance = np.zeros((len(seen), len(excited), len(omega)), complex)
        hub = np.zeros((6, len(excited), len(omega)), complex)
        for reduced in self.harmonics:
            n, share = reduced.n, self.patch.share(reduced.n)
            moved, forces = reduced.at(omega, losses, tables)
            circle = np.pi if n else 2 * np.pi
            if self._wheel:
                forces = forces / circle if reduced.rim else 0 * forces
            for e, (angle, component) in enumerate(excited):
                for s, (at, other) in enumerate(seen):
                    turned = _turned(moved[:, :, other, component], n * (at - angle))
                    receptance[s, e] += share**2 / circle * turned
                if n == 0:
                    hub[2, e], hub[5, e] = (
                        _turned(forces[:, :, i, component], 0.0) for i in (0, 1)
                    )
                for i in (0, 1) if n == 1 else ():
                    for q, axis in enumerate((0.0, np.pi / 2)):
                        about = share * _turned(forces[:, :, i, component], axis - angle)
                        hub[3 * i + q, e] = about
        return receptance, hub


@dataclass(frozen=True)
class _Rim:
    """The free motions of the rim in a harmonic, and what it adds to each, per radian."""

    places: list[int]  # of its motions among T
    stiffness: Array  # (q,)
    mass: Array  # (q,)


@dataclass(frozen=True)
class _Reduced:
    """A harmonic on its basis, in which M is 1."""

    n: int  # harmonic
    K: Array  # (basis, basis), rad2/s2
    lossy: list[Array]  # of each part with losses: its share of K (basis, basis)
    tables: list[Array]  # of each law of frequency: its share of K (basis, basis)
    forces: Array  # of the patch in each direction (basis, 3)
    moved: Array  # T^H M (motions, basis)
    rigid: Array  # T^H of the patch's forces (motions, 3)
    rigid_mass: Array  # T^H M T (motions, motions)
    rim: _Rim | None  # that moves in this harmonic

    def at(self, omega: Array, losses: list[Array], tables: list[Array]) -> tuple[Array, Array]:
        """Two pairs (2, f, 3, 3) and (2, f, motions, 3): motion of the patch, force on the hub, or
        motion of a rim that moves."""
        K = self.K - omega[:, None, None] ** 2 * np.eye(len(self.K))
        for table, part in zip(tables, self.tables, strict=True):
            K = K + table[:, None, None] * part
        loss = np.zeros_like(K)
        for eta, part in zip(losses, self.lossy, strict=True):
            loss = loss + eta[:, None, None] * part
        # The i of the response is not the i of exp(i n Theta): a number a + j b of both is known by
        # its values for j = i and j = -i.
        forces, rim = self.forces, self.rim
        if rim:
            K, loss, forces = self._with_rim(rim, omega, K, loss)
        both = np.stack([np.linalg.solve(K + i * loss, forces[None] + 0j) for i in (1j, -1j)])
        a, b = (both[0] + both[1]) / 2, (both[0] - both[1]) / 2j
        motion = np.stack([forces.conj().T @ a, forces.conj().T @ b])
        if rim:
            hub = np.zeros((2, len(omega), len(self.rigid), 3), complex)
            hub[:, :, rim.places] = np.stack([a, b])[:, :, : len(rim.places)]
            return motion, hub
        hub = omega[:, None, None] ** 2 * np.stack([self.moved @ a, self.moved @ b])
        hub[0] += self.rigid
        return motion, hub

    def _with_rim(
        self, rim: _Rim, omega: Array, K: Array, loss: Array
    ) -> tuple[Array, Array, Array]:
        """Dynamic stiffness K and losses (f, q + basis, q + basis), forces (q + basis, 3)."""
        q, square = len(rim.places), omega[:, None, None] ** 2
        whole = np.zeros((len(K), q + K.shape[1], q + K.shape[1]), complex)
        mass = self.rigid_mass[np.ix_(rim.places, rim.places)] + np.diag(rim.mass)
        whole[:, :q, :q] = np.diag(rim.stiffness) - square * mass
        whole[:, :q, q:] = -square * self.moved[rim.places]
        whole[:, q:, :q] = whole[:, :q, q:].conj().swapaxes(1, 2)
        whole[:, q:, q:] = K
        losses = np.zeros_like(whole)
        losses[:, q:, q:] = loss
        return whole, losses, np.vstack([self.rigid[rim.places], self.forces])


def _coordinates(numbering: Coordinates, forces: Array, n: int) -> Array:
    """Coordinates (size, k) of real forces (n, 3, k) on waves cos(n Theta). On half of the section
    they are those of what half a turn keeps, less i times those of what it reverses."""
    if n == 0 or not isinstance(numbering, KeptFields):
        return numbering.gather(forces)
    kept, reversed_ = np.hsplit(numbering.apart(forces), 2)
    return np.asarray(kept - 1j * reversed_)


def _turned(pair: Array, angle: float) -> Array:
    """Re_i[exp(i angle) (a + j b)] of a pair (2, f) as a + i b."""
    real, imag = (np.exp(1j * angle) * pair).real
    return np.asarray(real + 1j * imag)
