"""Air in the cavity: closed forms of acoustics, added mass, cavity modes left out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import jvp, yvp
from tyrecal_solvers.bundled.modes import cavity
from tyrecal_solvers.bundled.modes.cavity import GasCavity, coupling
from tyrecal_solvers.bundled.section import elements, mechanics
from tyrecal_solvers.bundled.section.parts import pressure
from tyrecal_solvers.bundled.section.parts.pressure import surface_point
from tyrecal_solvers.language.text import COMPLEX_STEP

from . import support
from .wheel_and_gas import SHIFT, STEEL, inflated

Array = np.ndarray
RHO, BULK = 4.06, 4.78e5
C = np.sqrt(BULK / RHO)  # m/s


def rectangle(a: float, b: float, height: float) -> tuple[Array, GasCavity]:
    """A rigid duct a < r < b round the axle."""
    X = np.array([[b, 0.0], [b, height], [a, height], [a, 0.0]])
    lines = elements.lines(X, np.array([[1, 0], [2, 1], [3, 2], [0, 3]]), 3)
    return X, GasCavity(RHO, BULK, [lines])


def resonances(a: float, b: float, n: int) -> Array:
    """Hz of waves with n round the duct."""
    X, gas = rectangle(a, b, 0.1)
    K = coupling(gas, X, np.zeros((4, 3)), n)
    return np.sqrt(abs(eigh(K.H, K.Q, eigvals_only=True))) / (2 * np.pi)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_waves_round_a_rigid_torus(n: int) -> None:
    """p = a Jn + b Yn of kappa r with p' = 0 at both walls, the lowest root; and n c / (2 pi R)
    for a thin duct. Right to 1e-6 where the duct is as wide as a tyre's."""
    a, b = 0.25, 0.40

    def lack(kappa: float) -> float:
        return jvp(n, kappa * a) * yvp(n, kappa * b) - jvp(n, kappa * b) * yvp(n, kappa * a)

    exact = brentq(lack, 0.8 * n / 0.325, 1.2 * n / 0.325) * C / (2 * np.pi)
    assert resonances(a, b, n)[0] == pytest.approx(exact, rel=1e-6)
    assert resonances(0.299, 0.301, n)[0] == pytest.approx(n * C / (2 * np.pi * 0.3), rel=1e-5)


def test_volume_and_slow_compression() -> None:
    """n = 0, so slow that pressure is the same everywhere: the air's stiffness against any motion
    of the walls is B dV^2 / V, V and dV from the closed cavity's volume."""
    tyre = inflated()
    gas, X = tyre.air(RHO, BULK), tyre.model.mesh.X
    u = np.stack([np.cos(9 * X[:, 1]), 0 * X[:, 0], np.sin(7 * X[:, 0])], -1)

    def volume(U: Array) -> complex:
        points = [surface_point(s, U) for s in gas.surfaces]
        weights = [s.weights for s in gas.surfaces]
        return sum(complex(pressure.volume(*p, w)) for p, w in zip(points, weights, strict=True))

    V, dV = volume(tyre.U).real, volume(tyre.U + 1j * COMPLEX_STEP * u).imag / COMPLEX_STEP
    K = coupling(gas, X, tyre.U, 0)
    assert K.Q[0, 0] == pytest.approx(V / BULK, rel=1e-12)
    assert K.C[0].ravel() @ u.ravel() == pytest.approx(dV, rel=1e-9)
    # w free: the pressure's other shapes relax
    flow = K.H[:, K.flowing]
    swept = np.tensordot(K.C, u, 2)
    stiff = np.linalg.inv(K.Q)
    w = np.linalg.solve(flow.T @ stiff @ flow, -flow.T @ stiff @ swept)
    energy = (swept + flow @ w) @ stiff @ (swept + flow @ w)
    assert energy == pytest.approx(BULK * dV**2 / V, rel=1e-6)


@pytest.mark.parametrize("motion", ["axial", "radial"])
def test_a_moving_wheel_carries_its_air(motion: str) -> None:
    """The wheel on a soft spring has omega^2 = k / (wheel + tyre + rho V)."""
    tyre = inflated()
    n = {"axial": 0, "radial": 1}[motion]
    K = coupling(tyre.air(1.0, 1.0), tyre.model.mesh.X, tyre.U, 0)
    mass = STEEL[motion] + 2 * np.pi * mechanics.mass(tyre.model).sum()
    values = []
    for density in (RHO, 100 * RHO):
        gas = tyre.air(density, BULK * density / RHO)
        wheel = tyre.wheel((motion,), **{motion: mass})
        values.append(tyre.vibration(wheel, gas, shift=-1e2).modes(n, 1).eigenvalues[0])
    carried = mass / np.array(values) - mass
    np.testing.assert_allclose(carried, 2 * np.pi * K.Q[0, 0] * np.array([RHO, 100 * RHO]), 1e-2)


def test_torsion_feels_no_air_and_vertical_motion_a_percent() -> None:
    """[1,0]: the air flows round the torus from one half to the other, as incompressible plane
    waves: continuity i n A v = -(swept rate), kinetic energy rho A v^2 / 2. More than that, since
    it also moves up and down with the belt, by less than if all of it did: about -1 %."""
    tyre = inflated()
    plain, filled = tyre.vibration(), tyre.vibration(None, tyre.air())
    axial, torsional = (filled.modes(0, 2).eigenvalues / plain.modes(0, 2).eigenvalues) ** 0.5 - 1
    assert abs(torsional) < 1e-6 and -0.01 < axial < -0.002
    shift = np.sqrt(filled.modes(1, 2).eigenvalues / plain.modes(1, 2).eigenvalues) - 1
    mode = plain.modes(1, 2).shapes[1]  # of unit mass
    K = coupling(tyre.air(RHO, BULK), tyre.model.mesh.X, tyre.U, 1)
    # H00 = int 1 / (rho r^2) dV, C0 . u = swept
    along = abs(np.tensordot(K.C[0], mode, 2)) ** 2 / K.H[0, 0].real
    crown = tyre.model.mesh.X[:, 0] > 0.95 * tyre.model.mesh.X[:, 0].max()
    across = RHO * K.Q[0, 0] * BULK * (abs(mode[crown, 0]) ** 2).max()
    assert along < -2 * shift[1] < along + across
    assert -0.015 < shift[1] < -0.007


def test_cavity_modes_are_not_the_tyres() -> None:
    """The torus resonates near 186 Hz at n = 1, below the tyre's third mode; this mode is left
    out."""
    tyre = inflated()
    plain = support.hertz(tyre.vibration().modes(1, 4).eigenvalues)
    filled = support.hertz(tyre.vibration(None, tyre.air()).modes(1, 4).eigenvalues)
    np.testing.assert_allclose(filled, plain, rtol=0.02)
    assert not ((filled > 180) & (filled < 200)).any()
    vibration = tyre.vibration(None, tyre.air())
    every, is_tyres = vibration._lowest(1, 5, vibration.factor(1))
    assert support.hertz(every.eigenvalues[~is_tyres]) == pytest.approx([186.7], abs=1.5)


def test_polynomials_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """Degree 6 instead of 4 lowers tyre modes by 3e-5 at most."""
    tyre = inflated()
    values = []
    for degree in (4, 6):
        monkeypatch.setattr(cavity, "MONOMIAL_DEGREE", degree)
        vibration = tyre.vibration(None, tyre.air())
        values.append(np.concatenate([vibration.modes(n, 2).eigenvalues for n in range(5)]))
    np.testing.assert_allclose(values[0], values[1], rtol=6e-5)


def test_thin_air_is_no_air() -> None:
    """The shift is proportional to the gas's mass and stiffness."""
    tyre = inflated()
    plain = tyre.vibration().modes(1, 2).eigenvalues
    shifts = [
        tyre.vibration(None, tyre.air(s * RHO, s * BULK), shift=SHIFT).modes(1, 2).eigenvalues
        / plain
        - 1
        for s in (1e-3, 2e-3)
    ]
    np.testing.assert_allclose(2 * shifts[0], shifts[1], rtol=5e-3)
