"""The rim as a body that moves: rigid motions, springs, closed forms, decks that are refused."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv, jvp, yv, yvp
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.modes.bordered import apply
from tyrecal_solvers.bundled.modes.cavity import coupling
from tyrecal_solvers.bundled.modes.wheel import Wheel
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.errors import RunFailed

from . import support
from .support import Rubber
from .wheel_and_gas import MOTIONS, REFERENCE, SHIFT, STEEL, inflated

Array = np.ndarray


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
