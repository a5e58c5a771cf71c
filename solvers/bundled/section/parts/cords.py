"""Cords of rebar layers, one-dimensional in logarithmic strain.

A cord along the reference unit vector a is carried to q = F a, its stretch is lambda = |q|:

    W = E A / (2 s) ln^2(lambda)            per reference area of the layer, J/m2
    dW/dq = W' t,  d2W/dqdq = (W'' - W'/lambda) t t^T + (W'/lambda) 1,   t = q / lambda

E, A, s: modulus, area and spacing (across them) of the cords; ' is d/dlambda.

One that bears no compression has W = 0 below lambda = 1: the least energy of a layer that may
wrinkle as finely as it likes (Pipkin, IMA J. Appl. Math. 36, 1986, on relaxed energies). The second
derivative of that energy jumps at lambda = 1. In a coarse mesh the frequencies of a tyre jump by up
to 10 % with it, when one point next to the rim goes slack. Real cords are not that straight: within
the logarithmic strain -w to w the stiffness grows smoothly, by the share x^2 (3 - 2 x) of E A / s
with x = (ln(lambda) + w) / 2w. Outside, W is that of a slack cord or, less a constant, a taut one.

In compression W'/lambda is negative, so that a layer buckles where the rubber does not hold it. A
steadied tangent has 0 for W'/lambda there, and W'' along the cord as before. The forces are the
same: it leads past such a state to a stable one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from ....language.text import Block, DeckError, Row
from .. import shapes
from ..elements import Lines
from ..laws.energy_law import EnergyLaw
from .elastic import Elastic, ElasticAtStations
from .part import Rows, SectionJob, TyrePart, consistent_mass, on_diagonals

Array = np.ndarray
TRANSITION = 5e-4  # w, logarithmic strain: assumed crimp that a cord without compression loses


@dataclass(frozen=True)
class LogarithmicCord(EnergyLaw):
    """Constants per Gauss point."""

    stiffness: Array  # E A / s, N/m
    tension: float = 0.0  # artificial, N/m, of slack cords at the start: in the tangent only
    compressed: Array | float = 1.0  # share of the stiffness that it has in compression: 1 or 0
    steadied: bool = False  # the tangent leaves out the compression by which cords buckle

    def _borne(self, strain: Array, order: int) -> Array:
        """W / (E A / s) (p,), or its first or second derivative by the logarithmic strain (p,):
        ``order`` 0, 1 or 2."""
        borne = (strain**2 / 2, strain, np.ones_like(strain))[order]
        if np.all(self.compressed):
            return borne
        w, x = TRANSITION, (strain + TRANSITION) / (2 * TRANSITION)
        taut = borne + w**2 / 10 if order == 0 else borne  # continuous at x = 1
        integrals = (w**2 * x**4 * (1 - 0.4 * x), w * x**3 * (2 - x), x**2 * (3 - 2 * x))
        tightening = np.where(x.real > 0, integrals[order], 0.0)
        return np.where(self.compressed, borne, np.where(x.real < 1, tightening, taut))

    def energy(self, z: Array) -> Array:
        return np.asarray(self.stiffness * self._borne(np.log(stretch(z)), 0))

    def force(self, z: Array) -> Array:
        length = stretch(z)
        borne = self._borne(np.log(length), 1)
        return np.asarray((self.stiffness * borne / length**2)[:, None] * z)

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        """d2W/dzdz (p, 3, 3) of cord vectors z (p, 3), times ``weights``."""
        length = stretch(z)
        strain = np.log(length)
        borne, slope = self._borne(strain, 1), self._borne(strain, 2)
        across = np.maximum(borne, 0.0) if self.steadied else borne
        along = self.stiffness * (slope - (borne + across)) / length**4
        D = along[:, None, None] * z[:, :, None] * z[:, None, :]
        D += (self.stiffness * across / length**2)[:, None, None] * np.eye(3)
        if self.tension:
            D[:, range(3), range(3)] += self.tension
        return D * np.reshape(weights, (-1, 1, 1))

    def tautened(self, tension: float) -> Self:
        return replace(self, tension=tension)


@dataclass(frozen=True)
class Cords(Elastic):
    """Cords of rebar layers; ``layers``: the name of each element's layer."""

    layers: tuple[str, ...] = ()

    def at_stations(self, nodes: int) -> CordsAtStations:
        return CordsAtStations(self, nodes)

    def most_compressed(self, U: Array) -> CompressedCords:
        """The lowest strain of cords that bear compression, at displacements U (n, 3)."""
        return _most_compressed(self.law, self.at(U), self.layers, self.connectivity)


class CordsAtStations(ElasticAtStations):
    """Cords at every station: where they are compressed most, and a steadied tangent."""

    def __init__(self, part: Cords, nodes: int):
        super().__init__(part, nodes)
        self._layers = part.layers

    def steady(self, on: bool) -> None:
        """Leave compression out of the tangent, at the last state, too, or take it in again."""
        own, last = self._law, self.law
        assert isinstance(own, LogarithmicCord) and isinstance(last, LogarithmicCord)
        self._law, self.law = replace(own, steadied=on), replace(last, steadied=on)
        self._A = None

    def most_compressed(self) -> CompressedCords:
        """The lowest strain of cords that bear compression."""
        return _most_compressed(self.law, self.z, self._layers, self.connectivity)


class CompressedCords(NamedTuple):
    """The most compressed cord."""

    strain: float  # logarithmic, negative in compression
    layer: str  # its name
    nodes: Array  # of its element, rows of the mesh

    def in_words(self, X: Array) -> str:
        """Message that the cords buckle, and where; X (n, 2): R, Z of all nodes, m."""
        r, z = X[self.nodes].real.mean(0)
        return (
            f"the cords of layer {self.layer} buckle, compressed by {-100 * self.strain:.2g} % at"
            f" r, z = {r:.3f}, {z:.3f} m"
        )


NOT_COMPRESSED = CompressedCords(0.0, "", np.zeros(0, int))


def _most_compressed(
    law: EnergyLaw, z: Array, layers: tuple[str, ...], connectivity: Array
) -> CompressedCords:
    """The most compressed cord by the vectors z (p, 3); the points of an element follow each
    other."""
    assert isinstance(law, LogarithmicCord)
    bear = np.asarray(law.compressed) > 0
    strain = np.where(bear, np.log(stretch(z)), 0.0)
    element = int(strain.reshape(len(layers), -1).min(1).argmin())
    return CompressedCords(float(strain.min()), layers[element], connectivity[element])


def stretch(q: Array) -> Array:
    """lambda (p,) of the cord vectors q (p, 3)."""
    return np.sqrt((q * q).sum(-1))


def cord_rows(lines: Lines, cos: Array | float, sin: Array | float) -> Rows:
    """Rows q = a + B0 u + B1 du/dTheta: the vector along a deformed cord, per unit of its length.

    cos, sin: of the cord's angle from the meridian, in the order of the line's nodes, towards
    Theta, per element (e,) or one for all. Along the cord, cos d/ds along the meridian and sin/R
    d/dTheta add up."""
    cos, sin = (np.broadcast_to(np.asarray(x).reshape(-1, 1), lines.R.shape) for x in (cos, sin))
    direction = np.stack([cos * lines.tangent[..., 0], sin, cos * lines.tangent[..., 1]], -1)
    along = cos[..., None] * lines.slope
    hoop = sin[..., None] * lines.N / lines.R[..., None]
    B0 = on_diagonals(along.astype(np.result_type(along, hoop)))
    B0[:, :, 0, 1::3] = -hoop
    B0[:, :, 1, 0::3] = hoop
    return Rows(B0, hoop, around=slice(0, 3), rest=direction, weights=lines.weights * lines.R)


def read(job: SectionJob) -> list[TyrePart]:
    """The cords of each element type, of all its rebar layers. Raises DeckError."""
    layers: dict[str, list[_Layer]] = {}
    surface: Block | None = None
    for k in job.keywords:
        if k.name in ("SURFACE SECTION", "MEMBRANE SECTION"):
            surface = k
        elif k.name == "REBAR LAYER":
            if surface is None:
                raise DeckError(k.place, "*REBAR LAYER must follow a *SURFACE SECTION")
            for kind, rows in job.by_type(surface, shapes.TYPES.keys() - shapes.solids()).items():
                block = job.mesh.blocks[kind]
                assert isinstance(block, Lines)
                own = layers.setdefault(kind, [])
                own += [_layer(job, k, row, block.pick(rows)) for row in k.rows]
    return [_cords(each) for each in layers.values()]


@dataclass(frozen=True)
class _Layer:
    name: str
    lines: Lines
    rows: Rows
    stiffness: Array  # E A / s (e, g), N/m
    mass: Array  # A rho / s (e, g), kg/m2
    tension_only: bool


def _layer(job: SectionJob, k: Block, row: Row, lines: Lines) -> _Layer:
    """Data line: name, area, spacing, position, material, angle from the meridian (degrees). Raises
    DeckError."""
    area, spacing = row.value(1), row.value(2)
    material = job.material(k, row.name(4))
    if row.value(3, 0.0) != 0.0:
        raise DeckError(row.place, "the position of a layer in a surface element is 0.0")
    if material.youngs_modulus is None:
        words = (
            f"material {material.name} of a rebar layer is not *ELASTIC: give a cord its modulus"
        )
        raise DeckError(row.place, words)
    if material.prony or material.table is not None:
        words = f"material {material.name} of a rebar layer is *VISCOELASTIC: cords do not relax"
        raise DeckError(row.place, words)
    if material in job.lossy:
        raise DeckError(
            row.place, f"the damping of material {material.name}, of cords, is not honoured"
        )
    if not (np.real(area) > 0 and np.real(spacing) > 0):
        raise DeckError(row.place, "area and spacing of a layer must be positive")
    angle = row.value(5, 0.0) * np.pi / 180
    width = spacing * np.ones_like(lines.R)
    if k.get("GEOMETRY") == "ANGULAR":  # spacing in degrees: the cords fan out with the radius
        width = spacing * np.pi / 180 * lines.R
    smeared = area / width
    rows = cord_rows(lines, np.cos(angle), np.sin(angle))
    stiffness, mass = material.youngs_modulus * smeared, material.density * smeared
    return _Layer(row.text(0), lines, rows, stiffness, mass, material.tension_only)


def _cords(layers: list[_Layer]) -> Cords:
    """All layers as one part: what is added up once is added up in one order."""
    join = lambda pick: np.concatenate([pick(layer) for layer in layers])
    rows = Rows(
        B0=join(lambda layer: layer.rows.B0),
        hoop=join(lambda layer: layer.rows.hoop),
        around=layers[0].rows.around,
        rest=join(lambda layer: layer.rows.rest),
        weights=join(lambda layer: layer.rows.weights),
    )
    one_N = layers[0].lines.N.ndim == 2  # shape functions (g, a) of all elements
    per_radian = join(lambda layer: layer.mass * layer.lines.R * layer.lines.weights)
    return Cords(
        join(lambda layer: layer.lines.connectivity),
        rows,
        LogarithmicCord(
            join(lambda layer: layer.stiffness).ravel(),
            compressed=join(lambda layer: np.full(layer.mass.size, float(not layer.tension_only))),
        ),
        consistent_mass(layers[0].lines.N if one_N else join(lambda y: y.lines.N), per_radian),
        tuple(layer.name for layer in layers for _ in layer.lines.connectivity),
    )
