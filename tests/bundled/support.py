"""Decks, meshes and shorthands that the tests of the bundled solver share; and pairs of jobs
as the tool writes them, edited, with their results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array
from tyrecal_solvers.bundled.deck import steps
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton, PressedState
from tyrecal_solvers.bundled.section import inflation, mechanics, model
from tyrecal_solvers.bundled.section.band import Numbering
from tyrecal_solvers.bundled.section.kept_fields import KeptFields
from tyrecal_solvers.bundled.section.loads import spinning
from tyrecal_solvers.bundled.section.model import Model, build
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.bundled.section.symmetry import MirrorHalf
from tyrecal_solvers.errors import NoEquilibrium
from tyrecal_solvers.language import text as language
from tyrecal_solvers.language.text import read_keywords

from tyrecal.tyre.section.mesh import build_mesh
from tyrecal.tyre.section.section import read_section

from ..effects.support import CASE, decks
from . import support

Array = np.ndarray


SECTION = Path(__file__).parents[2] / "cases" / "p235_75r17.csv"


def bears(patch: pytest.MonkeyPatch, most_N: float) -> None:
    """Newton's method finds no tyre on a road above ``most_N``: the long way down to a real rim is
    gone once, by `tests/cli/test_footprint.py`."""
    newton = ContactNewton._newton

    def at_most(press: ContactNewton, load: float) -> PressedState:
        if load > most_N:
            raise NoEquilibrium("too much")
        return newton(press, load)

    patch.setattr(ContactNewton, "_newton", at_most)


def full(matrix: csr_array) -> Array:
    """All its entries (n, n)."""
    return np.asarray(matrix.toarray())


@dataclass(frozen=True)
class Rubber:
    """Constants of a deck: Pa, 1/Pa, kg/m3."""

    C10: float = 1e6
    C01: float = 0.0
    D1: float = 5.085e-8
    density: float = 1100.0
    loss: float = 0.0  # loss factor

    @property
    def shear(self) -> float:
        return 2 * (self.C10 + self.C01)

    @property
    def plane_strain(self) -> float:
        """E / (1 - nu^2) of the small strains, from the shear modulus and the bulk's 2 / D1."""
        G, K = self.shear, 2 / self.D1
        return 4 * G * (3 * K + G) / (3 * K + 4 * G)


@dataclass(frozen=True)
class Layer:
    """Cords along lines of node rows (e, 2 or 3); ``angle`` in degrees from the meridian."""

    lines: Array
    area: float
    spacing: float
    modulus: float
    density: float
    angle: float
    tension_only: bool = False


@dataclass(frozen=True)
class Block:
    """A rectangle of elements: X (n, 2); solids (e, 4 or 8); ``inner``: 1-based elements at the
    smallest R; column(i): the lines along z at the i-th edge of elements, counted from inside."""

    X: Array
    solids: Array
    inner: list[int]
    columns: list[Array]

    def where(self, axis: int, value: float) -> Array:
        """Nodes (n,) whose coordinate has a value."""
        return abs(self.X[:, axis] - value) < 1e-9


def block(r: tuple[float, float, int], z: tuple[float, float, int], quadratic: bool) -> Block:
    """Elements between two radii and two heights, (from, to, elements) each."""
    step = 2 if quadratic else 1
    R, Z = (np.linspace(a, b, step * m + 1) for a, b, m in (r, z))
    number = np.arange(R.size * Z.size).reshape(R.size, Z.size)
    corner = [(0, 0), (step, 0), (step, step), (0, step)]
    midside = [(1, 0), (2, 1), (1, 2), (0, 1)] if quadratic else []
    starts = [(step * i, step * j) for i in range(r[2]) for j in range(z[2])]
    full = np.array([[number[i + a, j + b] for a, b in corner + midside] for i, j in starts])
    used, solids = np.unique(full, return_inverse=True)
    place = np.full(number.size, -1)
    place[used] = np.arange(used.size)
    columns = [
        np.array([place[number[i, step * j : step * (j + 1) + 1]] for j in range(z[2])])
        for i in range(0, R.size, step)
    ]
    X = np.stack(np.meshgrid(R, Z, indexing="ij"), -1).reshape(-1, 2)[used]
    return Block(X, solids.reshape(full.shape), list(range(1, z[2] + 1)), columns)


def deck(
    X: Array, solids: Array, rubber: Rubber, layers: Sequence[Layer] = (), inner: Sequence[int] = ()
) -> str:
    """Deck of solids 1, 2, ... with face S4 of ``inner`` as surface CAVITY; node = row + 1."""
    kind = {8: "CGAX8R", 4: "CGAX4R", 0: ""}[solids.shape[1] if len(solids) else 0]
    out = ["*HEADING", "test", "*NODE, NSET=ALL"]
    out += [f"{i}, {r!r}, {z!r}" for i, (r, z) in enumerate(X.tolist(), 1)]
    if kind:
        out += [f"*ELEMENT, TYPE={kind}, ELSET=RUBBER", *_rows(solids, 1)]
        out += ["*SOLID SECTION, ELSET=RUBBER, MATERIAL=RUBBER"]
    if inner:
        out += ["*SURFACE, NAME=CAVITY", *(f"{e}, S4" for e in inner)]
    for k, layer in enumerate(layers, 1):
        out += [f"*ELEMENT, TYPE=SFMGAX{layer.lines.shape[1] - 1}, ELSET=L{k}"]
        out += [*_rows(layer.lines, 1000000 * k), f"*SURFACE SECTION, ELSET=L{k}", "*REBAR LAYER"]
        out += [f"L{k}, {layer.area!r}, {layer.spacing!r}, 0.0, CORD{k}, {layer.angle!r}"]
    if kind:
        out += ["*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, MOONEY-RIVLIN"]
        out += [f"{rubber.C10!r}, {rubber.C01!r}, {rubber.D1!r}", "*DENSITY", f"{rubber.density!r}"]
        out += [f"*DAMPING, STRUCTURAL={rubber.loss!r}"] if rubber.loss else []
    for k, layer in enumerate(layers, 1):
        out += [f"*MATERIAL, NAME=CORD{k}", "*ELASTIC", f"{layer.modulus!r}, 0.3"]
        out += ["*NO COMPRESSION"] if layer.tension_only else []
        out += ["*DENSITY", f"{layer.density!r}"] if layer.density else []
    return "\n".join(out) + "\n"


def _rows(connectivity: Array, first: int) -> list[str]:
    return [", ".join(map(str, (first + e, *(nodes + 1)))) for e, nodes in enumerate(connectivity)]


@dataclass(frozen=True)
class Tyre:
    """A tyre's deck and the rows of its nodes on the rim."""

    deck: str
    rim: list[int]
    outline: list[Array]


def tyre(
    elements: Sequence[int] = (4, 3, 3, 1),
    rows: Sequence[int] = (1, 1, 1, 1),
    quadratic: bool = True,
    rubber: Rubber = Rubber(C01=1e5),
) -> Tyre:
    """The tyre of the case study: a radial ply and two belts at +-20 degrees to the crown."""
    mesh = build_mesh(read_section(SECTION), list(elements), list(rows), quadratic)
    row = {number: i for i, number in enumerate(mesh.nodes)}
    look = np.vectorize(row.__getitem__)
    solids = {number: i for i, number in enumerate(mesh.solids, 1)}
    cord = {
        "ply": (4.2e-7, 1e-3, 9.87e9, 1500.0, 0.0),
        "belt1": (2.1e-7, 1.16e-3, 1.722e11, 5900.0, 70.0),
    }
    cord["belt2"] = (*cord["belt1"][:4], 110.0)
    layers = [Layer(look(list(mesh.cords[name].values())), *cord[name]) for name in cord]
    connectivity = look(list(mesh.solids.values()))
    text = deck(
        np.array(list(mesh.nodes.values())),
        connectivity,
        rubber,
        layers,
        [solids[e] for e in mesh.inner],
    )
    return Tyre(text, [row[n] for n in mesh.rim], _outline(connectivity))


def _outline(solids: Array) -> list[Array]:
    """Edges (corner, middle, corner) of eight-node elements that belong to one element only."""
    if solids.shape[1] != 8:
        return []
    edges = np.concatenate([solids[:, [i, 4 + i, (i + 1) % 4]] for i in range(4)])
    middle, count = np.unique(edges[:, 1], return_counts=True)
    return list(edges[np.isin(edges[:, 1], middle[count == 1])])


def model_of(text: str) -> Model:
    """The model of a deck with static moduli."""
    return model.build(steps.check(language.read_keywords(text), False)[0], None, True)


def numbering(m: Model, held: Array | None = None) -> Numbering:
    """Equations with the components ``held`` (n, 3) or none taken out."""
    free = np.ones((len(m.mesh.X), 3), bool) if held is None else ~held
    return Numbering([part.connectivity for part in m.parts], free)


def turning(m: Model, spin: float) -> Model:
    """The model with the forces of a spin about the axle, rad/s."""
    return replace(m, parts=m.parts + spinning(m.parts, m.mesh.X, spin**2))


def stiffer(m: Model, share: float) -> Model:
    """Rubber and cords (1 + share) times as stiff, and cords as heavy too."""
    *rubbers, cords = m.with_laws(lambda law: law.stiffened(1 + share)).parts
    law = replace(cords.law, stiffness=cords.law.stiffness * (1 + share))
    cords = replace(cords, law=law, mass=cords.mass * (1 + share))
    return replace(m, parts=[*rubbers, cords])


def held(m: Model, rows: Array | list[int] = (), axial: bool = False) -> Array:
    """Mask (n, 3): the nodes ``rows`` wholly and, for plane strain, u_z everywhere."""
    mask = np.zeros((len(m.mesh.X), 3), bool)
    mask[list(rows)] = True
    mask[:, 2] |= axial
    return mask


def cavity(m: Model, pressure: float) -> list[Pressure]:
    return [Pressure(m.mesh.faces["CAVITY"], pressure)]


def inflate(m: Model, mask: Array, loads: list[Pressure]) -> Array:
    """Equilibrium displacements (n, 3)."""
    return inflation.equilibrium(m, numbering(m, mask), loads, np.zeros((len(m.mesh.X), 3)))[0]


def eigenvalues(
    m: Model, U: Array, loads: list[Pressure], mask: Array, n: int, count: int, shift: float = -1e3
) -> Array:
    """Lowest omega^2 (count,) of a harmonic; the shift below zero allows for rigid modes."""
    vibration = harmonics.Vibration(m, U, loads, numbering(m, mask), shift)
    return vibration.modes(n, count).eigenvalues


def hertz(omega2: Array) -> Array:
    """Frequencies, negative where omega^2 is."""
    return np.sign(omega2) * np.sqrt(abs(omega2)) / (2 * np.pi)


def matrices(m: Model, U: Array, loads: list[Pressure]) -> tuple[Array, Array, Array]:
    """Dense K0, K1, K2 (3n, 3n) over all components."""
    return tuple(dense(part, len(U)) for part in mechanics.tangents(m, U, loads, True))


def dense(parts: list[tuple[Array, Array]], n: int) -> Array:
    """Element matrices added up over all components (3n, 3n)."""
    K = np.zeros((3 * n, 3 * n))
    for connectivity, values in parts:
        e = (3 * connectivity[:, :, None] + np.arange(3)).reshape(len(connectivity), -1)
        np.add.at(K, (e[:, :, None], e[:, None, :]), values)
    return K


def sparse(parts: list[tuple[Array, Array]], n: int) -> csr_array:
    """The same without the zeros."""
    places, values = [], []
    for connectivity, matrices in parts:
        e = (3 * connectivity[:, :, None] + np.arange(3)).reshape(len(connectivity), -1)
        pair = np.repeat(e, e.shape[1], 1).ravel(), np.tile(e, (1, e.shape[1])).ravel()
        places.append(np.stack(pair))
        values.append(matrices.ravel())
    return csr_array((np.concatenate(values), np.hstack(places)), (3 * n, 3 * n))


def order(errors: Sequence[float], ratio: float = 2.0) -> Array:
    """Observed orders between successive meshes."""
    e = abs(np.asarray(errors))
    return np.log(e[:-1] / e[1:]) / np.log(ratio)


WAVES, COUNT = [0, 1, 2, 3], 2


def frequencies(modes: list[harmonics.HarmonicModes]) -> Array:
    return np.concatenate([m.eigenvalues for m in modes])


def plain(vibration: Vibration) -> Array:
    """omega^2 of the plain tyre, each doublet twice, in the order of the split ones."""
    return plain_of(vibration, WAVES)


def plain_of(vibration: Vibration, waves: list[int]) -> Array:
    each = [(n, vibration.modes(n, COUNT).eigenvalues) for n in waves]
    return np.concatenate([np.repeat(values, 2 if n else 1) for n, values in each])


@dataclass(frozen=True)
class Halves:
    """A small tyre inflated on the whole, its model of half, coordinates of its vibrations."""

    whole: Model
    half: Model
    symmetry: MirrorHalf
    free: Array
    fields: KeptFields
    U: Array
    loads: list[Pressure]


def inflated_halves() -> Halves:
    tyre = support.tyre((3, 2, 2, 1))
    section = read_keywords(tyre.deck)
    whole, half = build(section, None, True), build(section, None, True, half=True)
    held, loads = support.held(whole, tyre.rim), support.cavity(whole, 240e3)
    symmetry = half.mesh.symmetry
    assert isinstance(symmetry, MirrorHalf)
    free = ~held & symmetry.here[:, None]
    fields = KeptFields(list(half.mesh.connectivity.values()), free, symmetry)
    U = support.inflate(whole, held, loads)
    return Halves(whole, half, symmetry, ~held, fields, U, loads)


PLAIN: tuple[tuple[str, float], ...] = ()
WHEEL, TURNING, MASS = (("wheel_free", 0.1),), (("rotation", 5.0),), (("point_mass", 0.1),)
FREQUENCY = "*FREQUENCY, EIGENSOLVER=LANCZOS, NORMALIZATION=MASS\n20\n"
STEP = "*STEP, NAME=EQUILIBRIUM"


@cache
def texts(effects: tuple[tuple[str, float], ...]) -> dict[str, str]:
    """inflate and modes."""
    written = decks(CASE, **dict(effects))
    return {name: written[f"{name}.inp"] for name in ("inflate", "modes")}


def run(effects: tuple[tuple[str, float], ...], *edits: tuple[str, str], **request: Any) -> list:
    """Results of the pair with (old, new) edits, the revolve job's where it stands in both."""
    pair = dict(texts(effects))
    for old, new in edits:
        name = "modes" if old in pair["modes"] else "inflate"
        assert old in pair[name]
        pair[name] = pair[name].replace(old, new, 1)
    return Job(Deck(pair, "modes", "inflate"), Request(**request)).run()
