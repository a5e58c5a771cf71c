"""Modes of the revolved tyre, one Hermitian problem per circumferential harmonic n.

u = Re[U(R, Z) exp(i n Theta)], U complex (n, 3): K(n) = K0 + i n K1 + n^2 K2 exactly, the limit
of infinitely many sectors. A mode with n >= 1 stands for a pair turned by a quarter wave.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...errors import Indefinite
from ..section import mechanics
from ..section.kept_fields import Coordinates, Factor
from ..section.model import Model
from ..section.parts.part import TyrePart, of_each_component
from ..section.point_elements import PointElements
from ..section.stability import unstable
from . import bordered, lanczos
from .bordered import Border, Bordered
from .cavity import GasCavity, GasCoupling, coupling
from .wheel import Wheel

Array = np.ndarray
MAX_HARMONICS = 60  # that are searched for the lowest modes
# share of a mode's kinetic energy above which it is the cavity's, not the tyre's
MIN_AIR_SHARE = 0.5


class Combination(Protocol):
    """Modes that are not one harmonic of a tyre at rest, as combinations of harmonics."""

    def forms(self) -> tuple[Array, Array, Array, Array]:
        """As `HarmonicModes.forms`."""

    def rates(self, forms: Array, change: SeededTyre) -> Array:
        """d lambda / dp (m,) from the forms (m,) and what else has p's tangent."""

    def where(self, keep: Array | slice) -> Combination:
        """Combinations of some of the modes."""


@dataclass
class SeededTyre:
    """Model, spin and attached elements that carry the tangent of a number p."""

    model: Model
    spin: complex | float  # Omega, rad/s
    attached: PointElements


@dataclass
class HarmonicModes:
    """The m modes of harmonic n.

    Shapes have u^H M u = 1, M being the mass per radian: over the whole circle the modal mass is
    2 pi kg for n = 0, pi kg else.
    """

    n: int  # number of waves round the circumference
    eigenvalues: Array  # (m,) lambda = omega^2, 1/s2, rising
    shapes: Array  # (m, nodes, 3) amplitudes of r, theta, z, complex if n is not 0
    # amplitudes of the q motions of the rim (m, q), which are in ``shapes`` too, and of the
    # w terms of the cavity's flow (m, w), see `bordered`
    rim: Array = field(default_factory=lambda: np.zeros((0, 0)))
    air: Array = field(default_factory=lambda: np.zeros((0, 0)))
    # (m,), where each doublet has split into two modes, 1 and 2 in turn; the shape is then the part
    # of harmonic n
    members: Array | None = None
    combination: Combination | None = None  # what modes that are more than that are made of

    def forms(self) -> tuple[Array, Array, Array, Array]:
        """Shapes that the modes are sums of, for the derivatives phi^H (K' - lambda M') phi: their
        harmonics (p,), the shapes (p, nodes, 3), the index of each one's mode (p,), and lambda of
        all modes (m,)."""
        if self.combination is not None:
            return self.combination.forms()
        modes = len(self.eigenvalues)
        return np.full(modes, self.n), self.shapes, np.arange(modes), self.eigenvalues

    def below(self, frequency_Hz: float) -> HarmonicModes:
        """The modes up to a frequency."""
        return self.where(self.eigenvalues <= (2 * np.pi * frequency_Hz) ** 2)

    def where(self, keep: Array | slice) -> HarmonicModes:
        """The modes of a mask or slice."""
        rim, air = (a[keep] if len(a) else a for a in (self.rim, self.air))
        members = None if self.members is None else self.members[keep]
        combination = self.combination.where(keep) if self.combination else None
        return HarmonicModes(
            self.n, self.eigenvalues[keep], self.shapes[keep], rim, air, members, combination
        )


class Vibration:
    """The inflated tyre's small vibrations: factors per harmonic on demand.

    wheel: the rim's motions, None = held; air: in the cavity, None = a constant pressure;
    lowest_Hz: modes below are left out (the rigid ones of a free wheel).
    """

    def __init__(
        self,
        model: Model,
        U: Array,
        loads: Sequence[TyrePart],
        numbering: Coordinates,
        shift: float,
        wheel: Wheel | None = None,
        air: GasCavity | None = None,
        lowest_Hz: float = 0.0,
    ):
        self.numbering, self.shift = numbering, shift
        self.wheel, self.air, self.lowest_Hz = wheel, air, lowest_Hz
        self._model, self._U = model, U
        # the whole, then what each law of frequency adds per unit of its ratio less 1
        parts = [mechanics.tangents(model, U, loads, harmonics=True)]
        parts += [
            mechanics.tangents(m, U, [], harmonics=True) for m in model.frequency_dependent_models()
        ]
        self._parts = parts
        self._bands = [[numbering.assemble(p) for p in three] for three in parts]
        self.weights = np.array([1.0] + [0.0] * (len(parts) - 1))
        self.mass = mechanics.mass(model)
        self._X = model.mesh.X.real
        self._symmetry = model.mesh.symmetry
        self._forces = U
        if wheel:
            self._forces = self._symmetry.force(mechanics.gradient(model, U, loads))
        self._borders: dict[int, Border | None] = {}
        self._couplings: dict[int, GasCoupling] = {}
        self._shifted_mass = None
        if shift:
            masses = mechanics.mass_matrices(model)
            three = [(c, of_each_component(m.real, np.eye(3))) for c, m in masses]
            self._shifted_mass = numbering.assemble(three)

    def at(self, ratios: Array) -> Vibration:
        """The vibration with the modulus ratios ``ratios`` of the model's frequency-dependent laws,
        one each."""
        other = copy.copy(self)
        other.weights = np.concatenate([[1.0], np.asarray(ratios) - 1])
        other._borders = {}
        return other

    def forms(self, n: int, shape: Array) -> Array:
        """phi^H dK_l phi of a shape (nodes, 3) for every law of frequency."""
        field, values = shape[..., None], []
        for K0, K1, K2 in self._parts[1:]:
            image = bordered.apply(K0, field)
            if n:
                image = (
                    image + 1j * n * bordered.apply(K1, field) + n * n * bordered.apply(K2, field)
                )
            values.append(self._symmetry.copies * float(np.vdot(field, image).real))
        return np.array(values)

    def factor(self, n: int) -> Factor | Bordered:
        """Factor of K(n) - shift M. Raises RunFailed."""
        three = self._bands[0]
        if len(self.weights) > 1:
            three = [
                sum(w * b[i] for w, b in zip(self.weights, self._bands, strict=True))
                for i in range(3)
            ]
        K0, K1, K2 = three
        if n == 0:
            band = K0.copy(order="F")
        else:
            band = np.empty(K0.shape, complex, order="F")
            np.add(K0, n * n * K2, out=band.real)
            np.multiply(n, K1, out=band.imag)
        if self._shifted_mass is not None:
            band -= self.shift * self._shifted_mass
        try:
            tyre, border = self.numbering.factor(band), self._border(n)
            return Bordered(tyre, border, self.shift) if border else tyre
        except Indefinite:
            raise unstable(self._model, self._U, n) from None

    @property
    def plain(self) -> bool:
        """The tyre alone moves: neither its rim nor air in the cavity."""
        return self.wheel is None and self.air is None

    def times_mass(self, x: Array) -> Array:
        """The tyre's M x for (size,) or (size, b), per radian."""
        return self.numbering.times(self.mass, x)

    def _border(self, n: int) -> Border | None:
        if n not in self._borders:
            self._borders[n] = self._new_border(n)
        return self._borders[n]

    def _new_border(self, n: int) -> Border | None:
        """Border of harmonic n for a rim that moves and for the cavity's air; None if there is
        neither."""
        moving = self.wheel is not None and self.wheel.motions(n)
        if not moving and self.air is None:
            return None
        fields = np.zeros((*self._U.shape, 0), complex if n else float)
        own = np.zeros(0), np.zeros(0)
        if self.wheel is not None and moving:
            real, imag = self.wheel.fields(n, self._X)
            fields = self._symmetry.kept(real + 1j * imag if n else real)
            own = self.wheel.own(n, self._X, self._forces)
        stiffness = np.zeros_like(fields)
        for weight, three in zip(self.weights, self._parts, strict=True):
            for factor, part in zip((1.0, 1j * n, n * n), three, strict=True):
                if weight and factor and moving:
                    stiffness = stiffness + weight * factor * bordered.apply(part, fields)
        mass = (self.mass @ fields.reshape(len(fields), -1)).reshape(fields.shape)
        stiffness, mass = self._symmetry.force(stiffness), self._symmetry.force(mass)
        if self.air and n not in self._couplings:
            self._couplings[n] = coupling(self.air, self._X, self._U, n)
        air = self._couplings.get(n)
        return bordered.assemble(self.numbering, self._symmetry, fields, own, stiffness, mass, air)

    def _times_mass(self, n: int, x: Array) -> Array:
        border = self._border(n)
        tyre = self.times_mass(x[: self.numbering.size])
        return border.times_mass(x, tyre) if border else tyre

    def modes(self, n: int, count: int, factor: Factor | Bordered | None = None) -> HarmonicModes:
        """The ``count`` lowest modes of harmonic n that are the tyre's, from ``lowest_Hz`` on.

        Raises RunFailed.
        """
        factor, wanted = factor or self.factor(n), count
        while True:
            modes, is_tyres = self._lowest(n, wanted, factor)
            if is_tyres.sum() >= count or len(is_tyres) < wanted:
                return modes.where(np.flatnonzero(is_tyres)[:count])
            wanted += count - int(is_tyres.sum())

    def _lowest(self, n: int, count: int, factor: Factor | Bordered) -> tuple[HarmonicModes, Array]:
        """The lowest modes, and which of them are the tyre's."""
        border, size = self._border(n), self.numbering.size
        start = self.numbering.gather(_start_fields(self._X, n))
        if border:
            q, w, _ = border.widths
            start = np.concatenate([start, np.ones((q, 3)), np.zeros((w, 3))])
        values, vectors = lanczos.lowest(
            factor.solve, lambda x: self._times_mass(n, x), start, count, self.shift
        )
        shapes = self.numbering.spread(vectors[:size])  # (nodes, 3, modes)
        rim, flow = vectors[size:size], vectors[size:size]
        is_tyres = np.ones(len(values), bool)
        if self.lowest_Hz:
            is_tyres = values >= (2 * np.pi * self.lowest_Hz) ** 2
        if border:
            rim, flow = vectors[size : size + q], vectors[size + q :]
            shapes = shapes + border.fields @ rim
        if n == 0:  # of a kept field the real one, see `symmetry`
            shapes = shapes.real + shapes.imag
        if border and w:
            air = self._couplings[n]
            modes = zip(np.moveaxis(shapes, -1, 0), values, strict=True)
            flow = np.stack([air.flow(u, value) for u, value in modes], -1)
            energy = np.einsum("wm,wv,vm->m", flow.conj(), border.flow_mass, flow).real
            is_tyres &= energy < MIN_AIR_SHARE
        return HarmonicModes(n, values, np.moveaxis(shapes, -1, 0), rim.T, flow.T), is_tyres


def _start_fields(X: Array, n: int) -> Array:
    """Smooth fields (nodes, 3, 3) that hold much of the lowest modes of harmonic n.

    Axial shift and tilt; spin for n = 0, else bending without stretching the circumference,
    u_r + i n u_theta = 0. Those of n >= 1 are kept by half turn and conjugation, see `symmetry`.
    """
    tilt = X[:, 1] / np.ptp(X[:, 1])
    lop = 0.3  # at n = 0, where half a turn reverses all three
    fields = np.zeros((len(X), 3, 3), complex if n else float)
    fields[:, 2, 0] = 1j if n else 1.0 + lop * tilt
    fields[:, 0, 1] = 1j * tilt if n else tilt + lop
    fields[:, 0, 2] = 1.0 if n else 0.0
    fields[:, 1, 2] = 1j / n if n else X[:, 0] / X[:, 0].max() * (1.0 + lop * tilt)
    return fields


class HasModes(Protocol):
    """A vibration, of one modulus or of each mode's own."""

    def modes(self, n: int, count: int, factor: Factor | Bordered | None = None) -> HarmonicModes:
        """The lowest modes of a harmonic."""


def lowest_of_all(
    vibration: HasModes, wanted: int, check: Callable[[], None]
) -> list[HarmonicModes]:
    """The ``wanted`` lowest modes over all harmonics, doublets counted twice.

    Harmonics are added until one starts above the highest mode kept; ``check`` may raise to stop.
    """
    kept: list[HarmonicModes] = []
    for n in range(MAX_HARMONICS):
        check()
        count = 2
        while True:
            count = min(2 * count, wanted)
            modes = vibration.modes(n, count)
            limit = _highest_kept([*kept, modes], wanted)
            if modes.eigenvalues[-1] > limit or count == wanted:
                break
        kept.append(modes)
        if n >= 2 and modes.eigenvalues[0] > limit:
            break
    limit = _highest_kept(kept, wanted)
    return [m.below(np.sqrt(limit) / (2 * np.pi) * (1 + 1e-12)) for m in kept]


def _highest_kept(kept: list[HarmonicModes], wanted: int) -> float:
    values = np.sort(np.concatenate([np.repeat(m.eigenvalues, 2 if m.n else 1) for m in kept]))
    return float(values[wanted - 1]) if len(values) >= wanted else float("inf")
