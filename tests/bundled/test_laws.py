"""Laws of rubber and of linear elasticity, as decks give them: closed forms and derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import qr
from tyrecal_solvers.bundled.deck import steps
from tyrecal_solvers.bundled.section.laws.hyperelastic import Hyperelastic
from tyrecal_solvers.bundled.section.materials import read_materials
from tyrecal_solvers.language.text import DeckError, read_keywords, seed

Array = np.ndarray
H = 1e-30
POINTS = 5


def neo_hooke(c: list[float], I1: float, I2: float) -> tuple[float, float]:
    return c[0], 0.0


def mooney(c: list[float], I1: float, I2: float) -> tuple[float, float]:
    return c[0], c[1]


def polynomial(c: list[float], I1: float, I2: float) -> tuple[float, float]:
    x, y = I1 - 3, I2 - 3
    return c[0] + 2 * c[2] * x + c[3] * y, c[1] + c[3] * x + 2 * c[4] * y


def reduced(c: list[float], I1: float, I2: float) -> tuple[float, float]:
    """dWbar/dI1bar of as many terms as there are constants before the D."""
    n = len(c) // 2
    return sum((i + 1) * c[i] * (I1 - 3) ** i for i in range(n)), 0.0


def arruda(c: list[float], I1: float, I2: float) -> tuple[float, float]:
    mu, m, _ = c
    terms = [1 / 2, 1 / 10 * I1 / m**2, 11 / 350 * I1**2 / m**4]
    terms += [19 / 1750 * I1**3 / m**6, 519 / 134750 * I1**4 / m**8]
    return mu * sum(terms), 0.0


Slopes = Callable[[list[float], float, float], tuple[float, float]]
OF_INVARIANTS: dict[str, tuple[str, list[float], Slopes]] = {
    "neo-Hooke": ("NEO HOOKE", [1.1e6, 5e-8], neo_hooke),
    "Mooney-Rivlin": ("MOONEY-RIVLIN", [0.4e6, 0.2e6, 5e-8], mooney),
    "polynomial 1": ("POLYNOMIAL", [0.4e6, 0.2e6, 5e-8], mooney),
    "default": ("N=1", [0.4e6, 0.2e6, 5e-8], mooney),
    "polynomial 2": ("N=2", [0.4e6, 0.2e6, -2e4, 3e4, 1e4, 5e-8, 3e-7], polynomial),
    "reduced 1": ("REDUCED POLYNOMIAL, N=1", [0.6e6, 5e-8], reduced),
    "reduced 2": ("REDUCED POLYNOMIAL, N=2", [0.6e6, -9e4, 5e-8, 3e-7], reduced),
    "reduced 3": ("REDUCED POLYNOMIAL, N=3", [0.6e6, -9e4, 3e4, 5e-8, 3e-7, 2e-7], reduced),
    "Yeoh": ("YEOH", [0.6e6, -9e4, 3e4, 5e-8, 3e-7, 2e-7], reduced),
    "Arruda-Boyce": ("ARRUDA-BOYCE", [0.9e6, 2.7, 5e-8], arruda),
}
OGDEN = {
    "Ogden 1": ("OGDEN", [1.3e6, 2.6, 5e-8]),
    "Ogden 2": ("OGDEN, N=2", [1.1e6, 1.3, -2e4, -3.1, 5e-8, 3e-7]),
    "Ogden 3": ("OGDEN, N=3", [0.6e6, 1.3, 1e4, 5.0, -1e4, -2.0, 5e-8, 3e-7, 2e-7]),
}
E, NU = 2.1e11, 0.3
LINES = {name: text for name, (text, _, _) in OF_INVARIANTS.items()} | {
    name: text for name, (text, _) in OGDEN.items()
}
NUMBERS = {name: numbers for name, (_, numbers, _) in OF_INVARIANTS.items()} | {
    name: numbers for name, (_, numbers) in OGDEN.items()
}
LAW = pytest.mark.parametrize("name", [*LINES, "elastic"])


def deck(name: str) -> str:
    if name == "elastic":
        return f"*MATERIAL, NAME=WIRE\n*ELASTIC\n{E!r}, {NU!r}\n"
    numbers = NUMBERS[name]
    rows = [", ".join(map(repr, numbers[i : i + 8])) for i in range(0, len(numbers), 8)]
    return "\n".join(["*MATERIAL, NAME=GUM", f"*HYPERELASTIC, {LINES[name]}", *rows]) + "\n"


def read(text: str, tangents: list[tuple[int, int, float]] | None = None) -> Hyperelastic:
    """The one law of a deck, at `POINTS` points."""
    model, _ = steps.check(seed(read_keywords(text), tangents or []), False)
    (material,) = read_materials(model).values()
    assert material.law is not None
    return material.law.of_points([material.law], np.zeros(POINTS, int))


@pytest.fixture
def F(random: np.random.Generator) -> Array:
    """Stretches of 0.8 to 1.25 in any direction, and the last three with two, nearly two, and three
    that are alike, where principal directions are not one's own."""
    stretch = 1 + random.uniform(-0.2, 0.25, (POINTS, 3))
    stretch[2:] = [[1.2, 1.2, 0.9], [1.1, 1.1 * (1 + 1e-9), 0.95], [1.03, 1.03, 1.03]]
    left, right = (
        np.array([qr(random.normal(size=(3, 3)))[0] for _ in range(POINTS)]) for _ in "LR"
    )
    left *= np.sign(np.linalg.det(left))[:, None, None]
    right *= np.sign(np.linalg.det(right))[:, None, None]
    return (left * stretch[:, None]) @ right


def nominal(law: Hyperelastic, stretches: tuple[float, float, float]) -> Array:
    """P of a body without volume change, less what the hydrostatic pressure does to it: its third
    face is free."""
    P = law.force(np.broadcast_to(np.diag(stretches).ravel(), (POINTS, 9)))[0].reshape(3, 3)
    cauchy = np.diag(P) * stretches
    return np.asarray((cauchy - cauchy[2]) / stretches)


@pytest.mark.parametrize("name", OF_INVARIANTS)
@pytest.mark.parametrize("stretch", [0.7, 1.0 + 1e-6, 1.4, 2.0])
def test_uniaxial_biaxial_and_planar_tension(name: str, stretch: float) -> None:
    """T_U = 2 (1 - l^-3) (l W1 + W2), T_B = 2 (l - l^-5) (W1 + l^2 W2), T_S = 2 (l - l^-3) (W1 +
    W2) of incompressible rubber (Holzapfel, ch. 6.5; ABAQUS theory manual, hyperelasticity)."""
    law, s = read(deck(name)), stretch
    of = lambda I1, I2: OF_INVARIANTS[name][2](NUMBERS[name], I1, I2)
    W1, W2 = of(s**2 + 2 / s, 2 * s + s**-2)
    wanted = 2 * (1 - s**-3) * (s * W1 + W2)
    assert nominal(law, (s, s**-0.5, s**-0.5))[0] == pytest.approx(wanted, rel=1e-8)
    W1, W2 = of(2 * s**2 + s**-4, s**4 + 2 / s**2)
    wanted = 2 * (s - s**-5) * (W1 + s**2 * W2)
    assert nominal(law, (s, s, s**-2))[0] == pytest.approx(wanted, rel=1e-8)
    W1, W2 = of(s**2 + 1 + s**-2, s**2 + 1 + s**-2)
    wanted = 2 * (s - s**-3) * (W1 + W2)
    assert nominal(law, (s, 1.0, 1 / s))[0] == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize("name", OGDEN)
@pytest.mark.parametrize("stretch", [0.7, 1.0 + 1e-6, 1.4, 2.0])
def test_ogdens_tensions(name: str, stretch: float) -> None:
    """T = sum of 2 mu / alpha (l^(alpha - 1) - l^(-c alpha - 1)), c = 1/2, 2 and 1."""
    law, s, numbers = read(deck(name)), stretch, NUMBERS[name]
    n = len(numbers) // 3
    terms = list(zip(numbers[0 : 2 * n : 2], numbers[1 : 2 * n : 2], strict=True))
    for c, others in ((0.5, (s**-0.5, s**-0.5)), (2.0, (s, s**-2)), (1.0, (1.0, 1 / s))):
        wanted = sum(2 * m / a * (s ** (a - 1) - s ** (-c * a - 1)) for m, a in terms)
        assert nominal(law, (s, *others))[0] == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize("name", OF_INVARIANTS)
def test_simple_shear(name: str) -> None:
    """Shear by g: I1 = I2 = 3 + g^2, the shear stress is 2 g (W1 + W2)."""
    law, g = read(deck(name)), 0.6
    P = law.force(np.broadcast_to(np.eye(3) + g * np.outer([1, 0, 0], [0, 1, 0]), (POINTS, 3, 3)))
    W1, W2 = OF_INVARIANTS[name][2](NUMBERS[name], 3 + g * g, 3 + g * g)
    assert P[0].reshape(3, 3)[0, 1] == pytest.approx(2 * g * (W1 + W2), rel=1e-8)


def test_wire_in_tension() -> None:
    """A wire free of side forces has stress E ln(lambda) in its own cross-section, which shrinks by
    lambda^(-2 nu): the work-conjugate of logarithmic strain is J times it."""
    s = 1.004
    side = s**-NU
    P = read(deck("elastic")).force(np.broadcast_to(np.diag([s, side, side]).ravel(), (POINTS, 9)))
    kirchhoff = P[0].reshape(3, 3) @ np.diag([s, side, side])
    np.testing.assert_allclose(kirchhoff, np.diag([E * np.log(s), 0, 0]), atol=1e-8 * E * 0.004)


@pytest.mark.parametrize("name", LINES)
def test_volume(name: str) -> None:
    """F = c 1: P = dU/dJ c^2 1, U = sum of (J - 1)^(2i) / D_i, Arruda and Boyce's ((J^2 - 1) / 2 -
    ln J) / D; energies alike."""
    law, J = read(deck(name)), 1.07
    # those of tens of nanopascals and more, as against moduli and exponents
    D = [number for number in NUMBERS[name] if 0 < number < 1e-6]
    U = sum((J - 1) ** (2 * i) / of for i, of in enumerate(D, 1))
    slope = sum(2 * i * (J - 1) ** (2 * i - 1) / of for i, of in enumerate(D, 1))
    if name == "Arruda-Boyce":
        U, slope = ((J**2 - 1) / 2 - np.log(J)) / D[0], (J - 1 / J) / D[0]
    z = np.broadcast_to(J ** (1 / 3) * np.eye(3).ravel(), (POINTS, 9))
    np.testing.assert_allclose(law.energy(z), U, rtol=1e-8)
    np.testing.assert_allclose(
        law.force(z)[0].reshape(3, 3), slope * J ** (2 / 3) * np.eye(3), atol=1e-6
    )


@LAW
def test_moduli_of_small_strains(name: str) -> None:
    """A(1) = G (d_ik d_JL + d_iL d_kJ) + (K - 2G/3) d_iJ d_kL; K = 2 / D1, for wire E / (3 - 6 nu);
    Arruda and Boyce's G by its series in 1 / lambda_m^2 (ABAQUS theory manual)."""
    law, numbers = read(deck(name)), NUMBERS.get(name, [])
    G = 2 * numbers[0] if numbers else E / (2 + 2 * NU)
    K = 2 / next((n for n in numbers if 0 < n < 1e-6), 2 * (3 - 6 * NU) / E)
    if name in ("Mooney-Rivlin", "polynomial 1", "polynomial 2", "default"):
        G += 2 * numbers[1]
    if name == "Arruda-Boyce":
        mu, m, _ = numbers
        series = [3 / 5 / m**2, 99 / 175 / m**4, 513 / 875 / m**6, 42039 / 67375 / m**8]
        G = mu * (1 + sum(series))
    if name in OGDEN:
        G = sum(numbers[0 : 2 * (len(numbers) // 3) : 2])
    d = np.eye(3)
    pair = np.einsum("ik,JL->iJkL", d, d) + np.einsum("iL,kJ->iJkL", d, d)
    wanted = G * pair + (K - 2 / 3 * G) * np.einsum("iJ,kL->iJkL", d, d)
    A = law.tangent(np.broadcast_to(d.ravel(), (POINTS, 9)))[0]
    np.testing.assert_allclose(A, wanted.reshape(9, 9), atol=1e-12 * K)
    assert np.ravel(law.shear_modulus)[0] == pytest.approx(G, rel=1e-12)


def difference(function: Callable[[Array], Array], F: Array, h: float = 1e-3) -> Array:
    """d function / dF, with the nine components of F last, to fourth order."""
    steps = np.eye(9).reshape(9, 1, 3, 3) * h
    rows = []
    for s in steps:
        near, far = (function(F + k * s) - function(F - k * s) for k in (1, 2))
        rows.append((8 * near - far) / (12 * h))
    return np.stack(rows, -1)


@LAW
def test_stress_and_tangent_are_derivatives(name: str, F: Array) -> None:
    """P = dW/dF and A = dP/dF, whatever stretches are alike; A has its major symmetry."""
    law = read(deck(name))
    P, A = law.force(F), law.tangent(F)
    np.testing.assert_allclose(P, difference(law.energy, F), atol=1e-9 * abs(A).max())
    np.testing.assert_allclose(A, difference(law.force, F), atol=1e-9 * abs(A).max())
    np.testing.assert_allclose(A, A.swapaxes(1, 2), atol=1e-13 * abs(A).max())
    weights = np.linspace(1, 2, POINTS)
    np.testing.assert_allclose(law.tangent(F, weights), A * weights[:, None, None], rtol=1e-9)


@LAW
def test_slopes_by_the_rows(name: str, F: Array, random: np.random.Generator) -> None:
    """Imaginary parts of 1e-30 come out of force and tangent as derivatives."""
    law, way = read(deck(name)), random.normal(size=(POINTS, 3, 3))
    P, A = law.force(F + 1j * H * way), law.tangent(F + 1j * H * way)
    wanted = (law.tangent(F) @ way.reshape(POINTS, 9, 1))[..., 0]
    np.testing.assert_allclose(P.imag / H, wanted, atol=1e-9 * abs(wanted).max())
    up, down = (law.tangent(F + s * 1e-5 * way) for s in (1, -1))
    wanted = (up - down) / 2e-5
    np.testing.assert_allclose(A.imag / H, wanted, atol=1e-6 * abs(wanted).max())


@LAW
def test_slopes_by_every_number_of_the_deck(name: str, F: Array) -> None:
    """Energy, force and tangent agree with differences if one number at a time carries a
    tangent."""
    text = deck(name)
    start = 3
    numbers = NUMBERS.get(name, [E, NU])
    for place, number in enumerate(numbers):
        line, field = start + place // 8, place % 8
        seeded = read(text, [(line, field, number)])
        values = []
        for sign in (1, -1):
            rows = text.splitlines()
            fields = rows[line - 1].split(", ")
            fields[field] = repr(number * (1 + sign * 1e-5))
            rows[line - 1] = ", ".join(fields)
            values.append(read("\n".join(rows)))
        for method in ("energy", "force", "tangent"):
            got, (up, down) = getattr(seeded, method)(F), (getattr(v, method)(F) for v in values)
            wanted = (up - down) / 2e-5
            scale = abs(wanted).max() + 1e-6 * abs(got.real).max()
            np.testing.assert_allclose(got.imag / H, wanted, atol=1e-6 * scale)


@LAW
def test_moduli_scale_shear_and_volume_apart(name: str, F: Array) -> None:
    """A vibration, a Prony series and a path to an equilibrium scale Wbar and U of W by their own
    factors; a pressure of the element's own in place of U's has no stiffness except that of the
    stress."""
    law = read(deck(name))
    bare = law.scaled(1.0, 0.0)
    np.testing.assert_allclose(
        law.scaled(3.0, 2.0).energy(F),
        3 * bare.energy(F) + 2 * (law.energy(F) - bare.energy(F)),
        rtol=1e-9,
    )
    held = replace(law, pressure=np.full(POINTS, 2e5))
    np.testing.assert_allclose(held.energy(F), bare.energy(F), rtol=1e-12)
    pressed = difference(lambda f: bare.energy(f) + 2e5 * np.linalg.det(f), F)
    np.testing.assert_allclose(held.force(F), pressed, atol=1e-9 * abs(law.tangent(F)).max())
    np.testing.assert_allclose(
        held.tangent(F), difference(held.force, F), atol=1e-9 * abs(law.tangent(F)).max()
    )
    twice = held.scaled(1.0, 2.0).force(F) - bare.force(F)
    np.testing.assert_allclose(twice, 2 * (held.force(F) - bare.force(F)), atol=1e-6)


@pytest.mark.parametrize(
    "data", ["5E5, 2., 0., 1., 0., 1., 1E-8", "5E5, 2., 0., 1., 0., 1., 1E-8, 0.\n0."]
)
def test_constants_that_are_left_out_are_0(data: str) -> None:
    """Nine constants are on two lines, of which the second may be missing."""
    law = read(f"*MATERIAL, NAME=GUM\n*HYPERELASTIC, OGDEN, N=3\n{data}\n")
    plain = read("*MATERIAL, NAME=GUM\n*HYPERELASTIC, OGDEN\n5E5, 2., 1E-8\n")
    np.testing.assert_allclose(law.shear_modulus, plain.shear_modulus)
    assert law.inverse_D1[..., 0] == pytest.approx(plain.inverse_D1[..., 0])


@pytest.mark.parametrize(
    ("line", "data", "words"),
    [
        ("YEOH", "6E5, 0., 0., -1E-8", "D must not be negative"),
        ("YEOH", "6E5, 0., 0., 0., 1E-8", "all D are 0 then"),
        ("YEOH", "-6E5, 0., 0., 1E-8", "shear modulus of small strains must be positive"),
        ("YEOH, OGDEN", "6E5", "YEOH and OGDEN are two laws"),
        ("YEOH, N=3", "6E5", "N=3 of YEOH is not honoured, which has no N"),
        ("POLYNOMIAL, N=3", "6E5", "N=3 of POLYNOMIAL is not honoured, only N=1 or 2"),
        ("OGDEN", "6E5, 0., 1E-8", "must not be 0"),
        ("ARRUDA-BOYCE", "6E5, 0., 1E-8", "must not be 0"),
        ("OGDEN", "6E5, 2., 1E-8, 20.", "data '20.' of *HYPERELASTIC is not honoured"),
        ("OGDEN, N=3", "6E5, 2., 0., 1., 0., 1., 0., 0., 1.", "data '1.' of *HYPERELASTIC"),
        ("OGDEN, N=3", "6E5, 2., 0., 1., 0., 1.\n0.\n0.", "up to 2 data lines, got 3"),
        ("MARLOW", "1.", "the parameter MARLOW is not honoured"),
        ("OGDEN, N=4", "1.", "N=4 of OGDEN is not honoured, only N=1 or 2 or 3"),
    ],
)
def test_laws_that_are_refused(line: str, data: str, words: str) -> None:
    with pytest.raises(DeckError) as error:
        read(f"*MATERIAL, NAME=GUM\n*HYPERELASTIC, {line}\n{data}\n")
    assert words in str(error.value) and error.value.place.line in (2, 3)


@pytest.mark.parametrize("nu", ["0.5", "-1.0"])
def test_poissons_ratio_has_bounds(nu: str) -> None:
    with pytest.raises(DeckError, match=r"above -1 and below 0\.5"):
        read(f"*MATERIAL, NAME=WIRE\n*ELASTIC\n1E9, {nu}\n")
