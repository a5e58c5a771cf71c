"""The rim as a body that moves: rigid motions, springs, closed forms, decks that are refused.

Derivatives of modes whose rim moves and whose cavity holds air, against central differences. The
tyre is a coarse inflated one whose cavity is closed by the rim's well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv, jvp, yv, yvp
from tyrecal_solvers.bundled.modes import harmonics, sensitivity
from tyrecal_solvers.bundled.modes.bordered import Bordered, apply
from tyrecal_solvers.bundled.modes.cavity import GasCavity, coupling
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.modes.wheel import Wheel
from tyrecal_solvers.bundled.section import mechanics, model
from tyrecal_solvers.bundled.section.band import Numbering
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.language import text as language

from . import support
from .support import Rubber

Array = np.ndarray


REFERENCE = 900001
STEEL = {"axial": 15.0, "radial": 15.0, "spin": 0.43, "tilt": 0.27}  # kg and kg m2
MOTIONS = tuple(STEEL)
SHIFT = -4e3  # rad2/s2, below the zeros of rigid motions


@dataclass(frozen=True)
class Inflated:
    """Model, equilibrium (n, 3), loads on cavity and well, equations, rows of the rim."""

    model: Model
    U: Array
    loads: list[Pressure]
    numbering: Numbering
    rim: Array

    def wheel(self, free: tuple[str, ...] = MOTIONS, **stiffness: float) -> Wheel:
        """A steel wheel with free motions, on springs."""
        row = self.model.mesh.index[REFERENCE]
        return Wheel(row, self.rim, frozenset(free), dict(stiffness), STEEL)

    def air(self, density: float = 4.06, bulk: float = 4.78e5) -> GasCavity:
        """A gas in the cavity; by default air at 240 kPa and 20 C."""
        return GasCavity(density, bulk, [load.lines for load in self.loads])

    def vibration(
        self, *others: Wheel | GasCavity | None, shift: float = 0.0
    ) -> harmonics.Vibration:
        wheel, air = (*others, None, None)[:2]
        return harmonics.Vibration(
            self.model, self.U, self.loads, self.numbering, shift, wheel, air
        )


def closed(text: str, z: float = 0.0) -> str:
    """A deck with a reference node on the axle at ``z`` and a surface WELL that closes CAVITY."""
    faces = support.model_of(text).mesh.faces["CAVITY"].connectivity[:, [0, -1]]
    X = support.model_of(text).mesh.X
    rows, count = np.unique(faces, return_counts=True)
    left, right = sorted(rows[count == 1], key=lambda row: X[row, 1])
    text = text.replace("*ELEMENT", f"*NODE\n{REFERENCE}, 0.0, {z!r}\n*ELEMENT", 1)
    well = f"*ELEMENT, TYPE=SFMGAX1, ELSET=WELL\n900001, {right + 1}, {left + 1}\n"
    return text + well + "*SURFACE, NAME=WELL\nWELL, SPOS\n"


@cache
def inflated(pressure: float = 240e3, z: float = 0.0, quadratic: bool = True) -> Inflated:
    tyre = support.tyre((3, 2, 2, 1) if quadratic else (6, 4, 4, 2), quadratic=quadratic)
    m = support.model_of(closed(tyre.deck, z))
    mask = support.held(m, [*tyre.rim, m.mesh.index[REFERENCE]])
    loads = [Pressure(m.mesh.faces[name], pressure) for name in ("CAVITY", "WELL")]
    U = support.inflate(m, mask, loads[:1])
    return Inflated(m, U, loads, support.numbering(m, mask), np.array(tyre.rim))


@pytest.mark.parametrize(("z", "quadratic"), [(0.0, True), (0.03, True), (0.0, False)])
def test_a_free_tyre_on_its_wheel_moves_rigidly(z: float, quadratic: bool) -> None:
    """A free tyre has two zeros at n = 0 (axial, spin) and two at n = 1 (radial, tilt): six
    motions with their quarter turns. The follower pressure acts on the closed cavity, and the
    reference point is anywhere on the axle. Each lambda is within 3e-11 of the first that bends
    the tyre."""
    tyre = inflated(z=z, quadratic=quadratic)
    for n in (0, 1):
        values = tyre.vibration(tyre.wheel(), shift=SHIFT).modes(n, 3).eigenvalues
        assert abs(values[:2]).max() < 3e-11 * values[2]


def test_a_type_of_element_may_have_none_at_the_rim() -> None:
    """The image of the rim's motions is that of each element's matrix on its own nodes."""
    random = np.random.default_rng(1)
    quads, triangles = np.array([[0, 1, 2, 3], [2, 3, 4, 5]]), np.array([[5, 6, 7]])
    matrices = [
        random.normal(size=(len(c), 3 * c.shape[1], 3 * c.shape[1])) for c in (quads, triangles)
    ]
    fields = np.zeros((8, 3, 2))
    fields[:2] = random.normal(size=(2, 3, 2))
    image = np.zeros_like(fields)
    image[quads[0]] = (matrices[0][0] @ fields[quads[0]].reshape(12, 2)).reshape(4, 3, 2)
    computed = apply(zip((quads, triangles), matrices, strict=True), fields)
    assert computed == pytest.approx(image, rel=1e-14)


def test_the_pressure_on_the_well_is_part_of_it() -> None:
    """Without it the open cavity's pressure would hold the tilt, at 12 Hz."""
    tyre = inflated()
    open_ended = replace(tyre, loads=tyre.loads[:1])
    values = open_ended.vibration(tyre.wheel(), shift=SHIFT).modes(1, 2).eigenvalues
    assert support.hertz(values)[1] > 10.0


def test_rigid_motions_with_air_inside() -> None:
    tyre = inflated()
    for n in (0, 1):
        values = tyre.vibration(tyre.wheel(), tyre.air(), shift=SHIFT).modes(n, 3).eigenvalues
        assert abs(values[:2]).max() < 3e-11 * values[2]


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_stiff_spring_clamps(motion: str) -> None:
    """f - f_clamped falls as 1 / k; n >= 2 knows nothing of the wheel, to the last digit."""
    tyre = inflated()
    n = 0 if motion in ("axial", "spin") else 1
    clamped = tyre.vibration().modes(n, 2).eigenvalues
    gaps = []
    for k in (1e10, 1e11):
        wheel = tyre.wheel((motion,), **{motion: k})
        gaps.append(abs(tyre.vibration(wheel).modes(n, 2).eigenvalues / clamped - 1).max())
    assert 1e-7 < gaps[1] < 1e-3
    assert gaps[0] / gaps[1] == pytest.approx(10, rel=1e-2)
    other = tyre.vibration(tyre.wheel((motion,))).modes(2, 2).eigenvalues
    np.testing.assert_array_equal(other, tyre.vibration().modes(2, 2).eigenvalues)


@pytest.mark.parametrize("motion", MOTIONS)
def test_on_a_soft_spring_tyre_and_wheel_move_as_one(motion: str) -> None:
    """omega^2 = k / (wheel + tyre), rigid: inertia of the tyre about the axle, and about a
    diameter half of that plus sum m z^2. What is left out is of order omega^2 / omega_1^2."""
    tyre = inflated()
    n = 0 if motion in ("axial", "spin") else 1
    X = tyre.model.mesh.X + tyre.U[:, [0, 2]]
    mass = mechanics.mass(tyre.model)
    r, w, z = X[:, 0], tyre.U[:, 1], X[:, 1]
    polar = 2 * np.pi * (r @ (mass @ r) + w @ (mass @ w))
    own = {
        "axial": 2 * np.pi * mass.sum(),
        "spin": polar,
        "tilt": polar / 2 + 2 * np.pi * z @ (mass @ z),
    }
    own["radial"] = own["axial"]
    k = STEEL[motion] + own[motion]  # omega = 1 rad/s
    modes = tyre.vibration(tyre.wheel((motion,), **{motion: k}), shift=-1e2).modes(n, 1)
    assert modes.eigenvalues[0] == pytest.approx(1.0, rel=1e-4)
    assert abs(modes.rim[0, 0]) ** 2 / (2 * np.pi if n == 0 else np.pi) == pytest.approx(
        1 / (STEEL[motion] + own[motion]), rel=1e-4
    )


A, B, LENGTH = 0.2, 0.3, 0.05
GUM = Rubber(C10=5e5)


def tube(motion: str, k: float, inertia: float) -> Array:
    """Lowest two omega^2 of a rubber tube whose inner face is bonded to a wheel on a spring,
    displaced along ``motion`` only."""
    b = support.block((A, B, 12), (0.0, LENGTH, 1), True)
    X = np.vstack([b.X, [0.0, 0.0]])
    text = support.deck(X, b.solids, GUM)
    m = support.model_of(text)
    bonded = np.flatnonzero(b.where(0, A))
    mask = np.ones((len(X), 3), bool)
    mask[:-1, {"axial": 2, "spin": 1}[motion]] = False
    mask[bonded] = True
    wheel = Wheel(len(b.X), bonded, frozenset({motion}), {motion: k}, {motion: inertia})
    still, number = np.zeros((len(X), 3)), support.numbering(m, mask)
    return harmonics.Vibration(m, still, [], number, 0.0, wheel).modes(0, 2).eigenvalues


@pytest.mark.parametrize("motion", ["axial", "spin"])
def test_two_masses_in_closed_form(motion: str) -> None:
    """Shear waves in the tube, G u'' = -rho omega^2 u, free outside and on the wheel inside:
    axial  u = a J0 + b Y0 of kappa r, u'(B) = 0, 2 pi A L G u'(A) = (k - omega^2 m) u(A);
    spin   u = a J1 + b Y1, (u/r)'(B) = 0, 2 pi A^3 L G (u/r)'(A) = (k - omega^2 I) u(A) / A."""
    order = {"axial": 0, "spin": 1}[motion]
    k, inertia = {"axial": (4e5, 2.0), "spin": (2e4, 0.1)}[motion]
    frequencies = tube(motion, k, inertia)

    def strain(kappa: float, r: float) -> tuple[float, float]:
        """u' or r (u/r)' of J and of Y."""
        own = [p(order, kappa * r) * kappa for p in (jvp, yvp)]
        if order:
            own = [d - f(1, kappa * r) / r for d, f in zip(own, (jv, yv), strict=True)]
        return own[0], own[1]

    def lack(omega2: float) -> float:
        kappa = np.sqrt(omega2 * GUM.density / GUM.shear)
        (a, b), (c, d) = strain(kappa, B), strain(kappa, A)
        u = [f(order, kappa * A) for f in (jv, yv)]
        face = 2 * np.pi * A * LENGTH * GUM.shear * (A if order else 1.0)
        hold = (k - omega2 * inertia) / (A if order else 1.0)
        return a * (face * d - hold * u[1]) - b * (face * c - hold * u[0])

    for value in frequencies:
        exact = brentq(lack, 0.98 * value, 1.02 * value, xtol=1e-9 * value)
        assert value == pytest.approx(exact, rel=2e-5)
    held = tube(motion, 1e15, inertia)
    assert frequencies[0] < held[0]


def test_reference_point_matters_only_to_the_springs() -> None:
    """A free wheel's flexible modes do not depend on the point that its rotation is counted
    about, once its own inertia is that of a point mass there and none."""
    values = []
    for z in (0.0, 0.05):
        tyre = inflated(z=z)
        wheel = replace(tyre.wheel(), inertia={})
        values.append(tyre.vibration(wheel, shift=SHIFT).modes(1, 4).eigenvalues[2:])
    np.testing.assert_allclose(values[0], values[1], rtol=1e-8)


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_wheel_that_is_pushed_away_is_not_stable(motion: str) -> None:
    """A spring of negative stiffness, far beyond what the tyre holds."""
    tyre = inflated()
    n = 0 if motion in ("axial", "spin") else 1
    wheel = tyre.wheel((motion,), **{motion: -1e9})
    with pytest.raises(RunFailed, match=f"for {n} waves"):
        tyre.vibration(wheel).factor(n)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_a_gas_that_gives_way_is_not_stable(n: int) -> None:
    """A negative bulk modulus, with and without a wheel beside; a positive one is stable."""
    tyre = inflated()
    for wheel in (None, tyre.wheel(axial=1e6, radial=1e6, spin=1e5, tilt=1e5)):
        tyre.vibration(wheel, tyre.air()).factor(n)
        with pytest.raises(RunFailed, match=f"for {n} waves"):
            tyre.vibration(wheel, tyre.air(bulk=-4.78e5)).factor(n)


def test_loads_and_rows_of_the_well() -> None:
    """The well's left side faces the cavity: with it the enclosed volume is that of the shoelace
    formula over the whole outline."""
    tyre = inflated()
    lines = Pressure(tyre.model.mesh.faces["WELL"], 1.0).lines
    X = tyre.model.mesh.X
    assert REFERENCE in tyre.model.mesh.index
    start, end = X[lines.connectivity[0]]
    assert (start[0] == end[0] and start[1] > 0 > end[1]) or start[1] < 0 < end[1]
    total = tyre.air().surfaces
    points = [X[line.connectivity] for line in total]
    area = 0.0
    for p in points:
        for corners in p:
            for a, b in pairwise(corners):
                area -= (b[1] - a[1]) * (a[0] ** 2 + a[0] * b[0] + b[0] ** 2) / 6
    rest = coupling(tyre.air(1.0, 1.0), X, 0 * tyre.U, 0)
    assert rest.Q[0, 0] == pytest.approx(area, rel=1e-2)  # edges are curved, chords are not


PRESSURE, HARMONICS, COUNT = 240e3, (0, 1, 2), 2
TYRE = support.tyre((3, 2, 2, 1))
DECK = closed(TYRE.deck, 0.02)
LINES = DECK.splitlines()
SPRINGS = {"axial": 1e6, "radial": 2e6, "spin": 3e4, "tilt": 2e4}
NODES = LINES.index("*NODE, NSET=ALL") + 1
BELT = next(i for i, line in enumerate(LINES) if line.startswith("L2,"))


@dataclass(frozen=True)
class Variable:
    """Numbers of the deck, (0-based line, field): each moves by ``scale`` times p."""

    places: tuple[tuple[int, int], ...]
    scale: float

    def deck(self, p: float) -> str:
        lines = LINES.copy()
        for line, field in self.places:
            fields = lines[line].split(",")
            fields[field] = repr(float(fields[field]) + p * self.scale)
            lines[line] = ",".join(fields)
        return "\n".join(lines)

    def seeded(self) -> model.Model:
        tangents = [(line + 1, field, self.scale) for line, field in self.places]
        return model.build(language.seed(language.read_keywords(DECK), tangents), None, True)


RIM = [NODES + row for row in TYRE.rim]
AXLE = LINES.index(f"{REFERENCE}, 0.0, 0.02")
VARIABLES = {
    "R of the rim": Variable(tuple((i, 1) for i in RIM), 0.001),
    "Z of one of its nodes": Variable(((RIM[0], 2),), 0.003),
    "Z of the axle's point": Variable(((AXLE, 2),), 0.01),
    "belt area": Variable(((BELT, 1),), 2.1e-7),
}


def around(m: model.Model, with_air: bool) -> tuple[Wheel, GasCavity | None, list[Pressure]]:
    """The wheel on its springs, the air, and the loads on cavity and well."""
    loads = [Pressure(m.mesh.faces[name], PRESSURE) for name in ("CAVITY", "WELL")]
    row = m.mesh.index[REFERENCE]
    wheel = Wheel(row, np.array(TYRE.rim), frozenset(MOTIONS), SPRINGS, STEEL)
    return (
        wheel,
        GasCavity(4.06, 4.78e5, [load.lines for load in loads]) if with_air else None,
        loads,
    )


def solved(text: str, with_air: bool) -> tuple[Vibration, Array, list]:
    m = support.model_of(text)
    wheel, air, loads = around(m, with_air)
    held = support.held(m, [*TYRE.rim, m.mesh.index[REFERENCE]])
    U = support.inflate(m, held, loads[:1])
    vibration = Vibration(m, U, loads, support.numbering(m, held), 0.0, wheel, air)
    return vibration, U, [vibration.modes(n, COUNT) for n in HARMONICS]


def eigenvalues(text: str, with_air: bool) -> Array:
    return np.concatenate([m.eigenvalues for m in solved(text, with_air)[2]])


@pytest.mark.parametrize("with_air", [False, True])
@pytest.mark.parametrize("name", VARIABLES)
def test_against_central_differences(name: str, with_air: bool) -> None:
    """d lambda/dp of six modes, within 1e-5 of the largest, the rim's shapes carried along with its
    nodes; with air 1e-4, since its quadrature starts from the middle of the section, which stays
    where it is for the derivative. No eigenvalue depends on a mode's phase: multiplied by i^0.3,
    the amplitudes of the rim and of the air have both parts."""
    variable = VARIABLES[name]
    vibration, U, modes = solved(DECK, with_air)
    turn = np.exp(0.3j * np.pi / 2)
    shapes = np.concatenate([m.shapes for m in modes]) * turn
    rim = [q * turn for m in modes for q in (m.rim if len(m.rim) else np.zeros((COUNT, 0)))]
    flow = [w * turn for m in modes for w in (m.air if len(m.air) else np.zeros((COUNT, 0)))]
    seeded = variable.seeded()
    wheel, air, loads = around(seeded, with_air)
    factor = vibration.factor(0)
    assert isinstance(factor, Bordered)
    V = sensitivity.state_rate(seeded, U, loads, vibration.numbering, factor.tyre)
    got = sensitivity.eigenvalue_rates(
        seeded,
        U,
        V,
        loads,
        sensitivity.ModeShapes(np.repeat(HARMONICS, COUNT), shapes),
        np.concatenate([m.eigenvalues for m in modes]),
        sensitivity.RimAndAir(wheel, air, rim, flow),
    )
    h = 5e-3
    at = {k: eigenvalues(variable.deck(k * h), with_air) for k in (-2, -1, 1, 2)}
    wanted = (8 * (at[1] - at[-1]) - at[2] + at[-2]) / (12 * h)
    assert abs(got - wanted).max() <= (1e-4 if with_air else 1e-5) * abs(wanted).max()
    assert abs(wanted[:4]).max() > 1.0  # of the modes in which the rim moves
