"""Air in the cavity, also not the same all round: closed forms of acoustics, modes left out."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import jvp, yvp
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.request import CavityRequest, Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import cavity
from tyrecal_solvers.bundled.modes.cavity import GasCavity, coupling
from tyrecal_solvers.bundled.road.pressed_cavity import cavity_modes
from tyrecal_solvers.bundled.section import elements, mechanics
from tyrecal_solvers.bundled.section.parts import pressure
from tyrecal_solvers.bundled.section.parts.pressure import surface_point
from tyrecal_solvers.language.text import COMPLEX_STEP

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.values import with_values

from ..effects.support import CASE
from . import support
from .test_wheel import SHIFT, STEEL, inflated

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


ANGLES = np.concatenate([np.radians([0.0, 7.0, 20.0]), np.arange(3, 24) * 2 * np.pi / 24])


def moved(field: Array, nodes: int = 4) -> Array:
    """A displacement (ring, 3) as that of all nodes."""
    return np.repeat(field[:, None], nodes, 1)


def test_the_same_all_round() -> None:
    """Both members are the rigid duct's wave (Bessel functions, `test_cavity`)."""
    X, air = rectangle(0.25, 0.40, 0.1)
    at_rest = cavity_modes(air, X, np.zeros((len(ANGLES), 4, 3)), ANGLES)
    np.testing.assert_allclose(at_rest, resonances(0.25, 0.40, 1)[0], rtol=1e-8)


@pytest.mark.parametrize("direction", ["down", "turned", "along"])
def test_a_cavity_that_moves_as_a_whole_keeps_its_frequencies(direction: str) -> None:
    X, air = rectangle(0.25, 0.40, 0.1)
    c, s, r = np.cos(ANGLES), np.sin(ANGLES), X[:, 0]
    u = {
        "down": moved(np.stack([c, -s, 0 * c], -1) * 0.01),
        "turned": np.zeros((len(ANGLES), 4, 3)) + np.stack([r * 0, r * 0, r * 0], -1),
        "along": moved(np.stack([0 * c, 0 * c, 0.02 + 0 * c], -1)),
    }[direction]
    if direction == "turned":
        u = u + np.stack([r * (np.cos(0.1) - 1), r * np.sin(0.1), 0 * r], -1)
    wanted = resonances(0.25, 0.40, 1)[0]
    np.testing.assert_allclose(cavity_modes(air, X, u, ANGLES), wanted, rtol=1e-6)


def test_the_areas_second_harmonic_splits_a_thin_torus() -> None:
    """Webster's equation with A = A0 (1 + a cos 2 phi): c / (2 pi R) (1 -+ a / 2) to first order;
    narrow at the patch, the vertical mode is the higher one."""
    R, h = 0.3, 0.01
    X, air = rectangle(R - h, R + h, 2 * h)
    first = C / (2 * np.pi * R)
    lack = []
    for a in (-0.04, -0.02, 0.02):
        scale = np.sqrt(1 + a * np.cos(2 * ANGLES)) - 1
        u = np.zeros((len(ANGLES), 4, 3))
        u[..., 0::2] = scale[:, None, None] * (X - [R, h])
        fore_aft, vertical = cavity_modes(air, X, u, ANGLES)
        assert (vertical - fore_aft) / first == pytest.approx(-a, rel=2e-3)
        lack.append((vertical + fore_aft) / 2 / first - 1)
    assert max(map(abs, lack)) < 5e-4
    # no first harmonic splits it at first order, nor a fourth
    for n in (1, 4):
        scale = np.sqrt(1 + 0.02 * np.cos(n * ANGLES)) - 1
        u = np.zeros((len(ANGLES), 4, 3))
        u[..., 0::2] = scale[:, None, None] * (X - [R, h])
        assert np.ptp(cavity_modes(air, X, u, ANGLES)) < 2e-4 * first


def test_frequencies_are_those_of_the_gas() -> None:
    X, air = rectangle(0.25, 0.40, 0.1)
    u = np.zeros((len(ANGLES), 4, 3))
    heavy = replace(air, density=4 * RHO)
    stiff = replace(air, bulk=9 * BULK)
    one = cavity_modes(air, X, u, ANGLES)
    np.testing.assert_allclose(cavity_modes(heavy, X, u, ANGLES), one / 2, rtol=1e-9)
    np.testing.assert_allclose(cavity_modes(stiff, X, u, ANGLES), one * 3, rtol=1e-9)


LOADS = (1000.0, 3000.0)


FILLED = TyreDesign(with_values(CASE, {"cavity.share": 1.0}))


def test_only_loaded_modes_ask_for_the_cavity(tmp_path: Path) -> None:
    """Loaded modes request the cavity only with a gas; the stored answer of a footprint depends
    on its decks alone."""
    filled, empty = FILLED, TyreDesign(CASE)
    Bundled().write(Decks(filled, loads_N=LOADS), tmp_path)
    Bundled().write(Decks(empty, loads_N=LOADS, loaded_modes=4), tmp_path)
    assert not list(tmp_path.glob("*.json"))
    Bundled().write(Decks(filled, loads_N=LOADS, loaded_modes=4), tmp_path)
    (path,) = tmp_path.glob("*.json")
    assert path.name == "press.request.json"
    cavity = {"material": "CAVITY_GAS", "surfaces": ["CAVITY", "WELL"]}
    assert json.loads(path.read_text()) == {"cavity": cavity}


@pytest.mark.slow
def test_a_tyre_on_the_road() -> None:
    """The mean stays where it was, near c / (2 pi R), the vertical mode rises, the fore-aft one
    falls, the split grows; without a gas there is none."""
    texts = Decks(FILLED, loads_N=LOADS).texts("abaqus")
    pair = {name: texts[f"{name}.inp"] for name in ("inflate", "press")}
    cavity = CavityRequest("CAVITY_GAS", ["CAVITY", "WELL"])
    result = Job(Deck(pair, "press", "inflate"), Request(cavity=cavity)).press()
    free, splits = result["cavity_Hz"], [0.0]
    assert free == pytest.approx(186.0, rel=0.01)
    for each in result["footprints"]:
        fore_aft, vertical = each["cavity_Hz"]
        assert fore_aft < free < vertical
        assert (fore_aft + vertical) / 2 == pytest.approx(free, rel=1e-3)
        splits.append(vertical - fore_aft)
    assert splits[0] < splits[1] < splits[2] < 5.0
    pair["press"] = Decks(FILLED, loads_N=LOADS[:1]).texts("abaqus")["press.inp"]
    plain = Job(Deck(pair, "press", "inflate"), Request()).press()
    assert "cavity_Hz" not in plain and "cavity_Hz" not in plain["footprints"][0]
