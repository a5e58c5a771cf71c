"""Mooney-Rivlin rubber: consistency of energy, stress and tangent, invariance, small strains."""

from __future__ import annotations

from dataclasses import replace
from operator import methodcaller

import numpy as np
import pytest
from scipy.linalg import qr
from tyrecal_solvers.bundled.section import inflation
from tyrecal_solvers.bundled.section.laws.polynomial import MooneyRivlin
from tyrecal_solvers.bundled.section.parts.cords import LogarithmicCord
from tyrecal_solvers.errors import NoEquilibrium

from . import support

Array = np.ndarray
H = 1e-30
LAWS = {
    "C10": MooneyRivlin(np.full(5, 1.1e6), np.zeros(5), np.full(5, 3e7)),
    "C01": MooneyRivlin(np.zeros(5), np.full(5, 0.7e6), np.full(5, 3e7)),
    "both": MooneyRivlin(np.linspace(1e6, 2e6, 5), np.linspace(2e5, 3e5, 5), np.full(5, 2e7)),
}
LAW = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


@pytest.fixture
def F(random: np.random.Generator) -> Array:
    return np.eye(3) + 0.25 * random.uniform(-1, 1, (5, 3, 3))


def rotations(random: np.random.Generator) -> Array:
    Q = np.array([qr(random.normal(size=(3, 3)))[0] for _ in range(5)])
    return Q * np.sign(np.linalg.det(Q))[:, None, None]


def complex_step(function, F: Array) -> Array:
    """d function / dF, with the nine components of F last."""
    steps = np.eye(9).reshape(9, 1, 3, 3) * 1j * H
    return np.stack([np.imag(function(F + s)) / H for s in steps], -1)


def stress(F: Array, law: MooneyRivlin) -> Array:
    return law.force(F).reshape(5, 3, 3)


def close(got: Array, wanted: Array, tolerance: float = 1e-13) -> None:
    assert abs(got - wanted).max() <= tolerance * abs(wanted).max()


@LAW
def test_energy_of_known_states(law: MooneyRivlin) -> None:
    """Volume change F = c 1: W = (c^3 - 1)^2 / D1, the isochoric part being blind to it; simple
    shear by g: I1 = I2 = 3 + g^2, J = 1, W = (C10 + C01) g^2 (Holzapfel 2000, ch. 6)."""
    dilation = np.broadcast_to(1.1 * np.eye(3), (5, 3, 3))
    close(law.energy(dilation), (1.1**3 - 1) ** 2 * law.inverse_D1, 1e-12)
    shear = np.eye(3) + 0.3 * np.outer([1, 0, 0], [0, 1, 0])
    wanted = (law.C10 + law.C01) * 0.3**2
    close(law.energy(np.broadcast_to(shear, (5, 3, 3))), wanted, 1e-12)


@LAW
def test_stress_is_the_gradient_of_the_energy(law: MooneyRivlin, F: Array) -> None:
    """P = dW/dF by complex step."""
    wanted = complex_step(lambda f: law.energy(f), F)
    close(law.force(F), wanted)


@LAW
def test_tangent_is_the_gradient_of_the_stress(law: MooneyRivlin, F: Array) -> None:
    """A = dP/dF by complex step, with the major symmetry A_iJkL = A_kLiJ."""
    wanted = complex_step(lambda f: law.force(f), F)
    A = law.tangent(F)
    close(A, wanted)
    close(A, A.swapaxes(1, 2), 1e-14)


@LAW
def test_frame_indifference(law: MooneyRivlin, F: Array, random: np.random.Generator) -> None:
    """W(QF) = W(F) and P(QF) = Q P(F) for every rotation Q."""
    Q = rotations(random)
    close(law.energy(Q @ F), law.energy(F), 1e-12)
    close(stress(Q @ F, law), Q @ stress(F, law), 1e-12)


@LAW
def test_isotropy(law: MooneyRivlin, F: Array, random: np.random.Generator) -> None:
    """W(FQ) = W(F): no direction of the material is preferred."""
    close(law.energy(F @ rotations(random)), law.energy(F), 1e-12)


@LAW
def test_reference_state_is_free_of_stress(law: MooneyRivlin) -> None:
    """P(1) = 0 and W(1) = 0."""
    one = np.broadcast_to(np.eye(3), (5, 3, 3))
    assert abs(stress(one, law)).max() <= 1e-14 * law.inverse_D1.max()
    assert abs(law.energy(one)).max() <= 1e-14 * law.inverse_D1.max()


@LAW
def test_small_strain_moduli(law: MooneyRivlin) -> None:
    """A(1) = G (d_ik d_JL + d_iL d_kJ) + (K - 2G/3) d_iJ d_kL with G = 2 (C10 + C01) and
    K = 2 / D1 (ABAQUS theory manual, hyperelasticity, gives both)."""
    G, K = 2 * (law.C10 + law.C01), 2 * law.inverse_D1
    d = np.eye(3)
    pair = np.einsum("ik,JL->iJkL", d, d) + np.einsum("iL,kJ->iJkL", d, d)
    trace = np.einsum("iJ,kL->iJkL", d, d)
    G, K = G[:, None, None], K[:, None, None]
    wanted = G * pair.reshape(9, 9) + (K - 2 / 3 * G) * trace.reshape(9, 9)
    close(law.tangent(np.broadcast_to(d, (5, 3, 3))), wanted)


@LAW
def test_vibration_modulus(law: MooneyRivlin, F: Array) -> None:
    """A vibration at c times the moduli about a static state: the material part is c times the
    static one, the geometric part d_ik S_JL of the initial stress S = F^-1 P stays as it is."""
    c = 1.43
    vibrating = replace(law, shear_ratio=np.full(5, c), bulk_ratio=np.full(5, c))
    S = np.linalg.solve(F, stress(F, law))
    geometric = np.einsum("ik,pJL->piJkL", np.eye(3), S).reshape(5, 9, 9)
    wanted = c * (law.tangent(F) - geometric) + geometric
    close(vibrating.tangent(F), wanted, 1e-12)


@LAW
def test_vibration_shear_and_bulk_modulus_are_separate(law: MooneyRivlin) -> None:
    """The ratios scale G = 2 (C10 + C01) and K = 2 / D1 separately at the reference."""
    one = np.broadcast_to(np.eye(3), (5, 3, 3))
    vibrating = replace(law, shear_ratio=np.full(5, 1.4), bulk_ratio=np.full(5, 1.1))
    scaled = MooneyRivlin(1.4 * law.C10, 1.4 * law.C01, 1.1 * law.inverse_D1)
    close(vibrating.tangent(one), scaled.tangent(one))
    assert np.array_equal(stress(one, vibrating), stress(one, law))


def test_stiffer_rubber_has_all_its_moduli_so_many_times() -> None:
    """Stiffer rubber takes another path to the same equilibrium."""
    plain = support.model_of(support.tyre((3, 2, 2, 1)).deck)
    stiff = plain.with_laws(methodcaller("stiffened", 3.0))
    pairs = [(a.law, b.law) for a, b in zip(plain.parts, stiff.parts, strict=True)]
    ((before, after),) = [each for each in pairs if isinstance(each[0], MooneyRivlin)]
    for name in ("C10", "C01", "inverse_D1"):
        np.testing.assert_allclose(getattr(after, name), 3 * getattr(before, name))
    assert np.real(before.C10).any() and np.real(before.inverse_D1).any()
    cords = [each for each in pairs if isinstance(each[0], LogarithmicCord)]
    assert cords and all(before is after for before, after in cords)


def test_between_the_paths_to_an_equilibrium_time_is_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The time limit is checked after the whole load at once, and before every step of the load."""
    tried: list[str] = []
    monkeypatch.setattr(inflation, "_newton", lambda *given: tried.append("try") or (None, 1, "no"))
    m = support.model_of(support.tyre((3, 2, 2, 1)).deck)
    number, loads = support.numbering(m), support.cavity(m, 1e5)
    look = lambda: tried.append("look")
    with pytest.raises(NoEquilibrium, match="no"):
        inflation.equilibrium(m, number, loads, np.zeros((len(m.mesh.X), 3)), look)
    assert tried[:6] == ["try", "look", "try", "look", "try", "look"]
    assert tried.count("look") == tried.count("try") - 1
