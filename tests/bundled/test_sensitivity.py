"""Modes of a harmonic, and their derivatives by numbers of the deck, against dense algebra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import eigh
from tyrecal_solvers.bundled.modes import harmonics, sensitivity
from tyrecal_solvers.bundled.section import mechanics, model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.language import text as language

from . import support
from .conftest import Inflated

pytestmark = pytest.mark.numbers


Array = np.ndarray
HARMONICS, COUNT, PRESSURE = (0, 1, 2, 3), 2, 240e3


TYRE = support.tyre((3, 2, 2, 1))


LINES = TYRE.deck.splitlines()


def line(start: str, after: str = "*HEADING") -> int:
    """0-based line of the deck, the first that starts so behind ``after``."""
    return next(i for i in range(LINES.index(after), len(LINES)) if LINES[i].startswith(start))


@dataclass(frozen=True)
class Place:
    """Numbers of the deck that one variable moves: 0-based lines, a field, the variable's scale."""

    lines: tuple[int, ...]
    field: int
    scale: float

    def moved(self, by: float) -> str:
        """The deck with the numbers increased by ``by`` times the scale."""
        lines = LINES.copy()
        for i in self.lines:
            fields = lines[i].split(",")
            fields[self.field] = repr(float(fields[self.field]) + by * self.scale)
            lines[i] = ",".join(fields)
        return "\n".join(lines)

    @property
    def tangents(self) -> list[tuple[int, int, float]]:
        return [(i + 1, self.field, self.scale) for i in self.lines]


BELTS, PLY = (line("L2,"), line("L3,")), (line("L1,"),)


NODE = (line("80,"),)  # on the inner surface, so that the pressure meets it too


RUBBER = (line("1000000.0,"),)


VARIABLES = {
    "belt area": Place(BELTS, 1, 2.1e-7),
    "carcass area": Place(PLY, 1, 4.2e-7),
    "belt angle": Place(BELTS[:1], 5, 20.0),
    "carcass spacing": Place(PLY, 2, 1e-3),
    "rubber density": Place((line("1100.0"),), 0, 1100.0),
    "cord density": Place((line("1500.0"),), 0, 1500.0),
    "belt modulus": Place((line("1722", "*MATERIAL, NAME=CORD2"),), 0, 1.722e11),
    "C10": Place(RUBBER, 0, 1e6),
    "C01": Place(RUBBER, 1, 1e6),
    "D1": Place(RUBBER, 2, 5.085e-8),
    "R of a node": Place(NODE, 1, 0.003),
    "Z of a node": Place(NODE, 2, 0.003),
}


@dataclass(frozen=True)
class Modes:
    state: Array
    vibration: harmonics.Vibration
    n: Array
    shapes: Array
    eigenvalues: Array


def solve(text: str, pressure: float = PRESSURE) -> Modes:
    m = support.model_of(text)
    mask, loads = support.held(m, TYRE.rim), support.cavity(m, pressure)
    U = support.inflate(m, mask, loads)
    vibration = harmonics.Vibration(m, U, loads, support.numbering(m, mask), 0.0)
    modes = [vibration.modes(n, COUNT) for n in HARMONICS]
    return Modes(
        U,
        vibration,
        np.repeat(HARMONICS, COUNT),
        np.concatenate([f.shapes for f in modes]),
        np.concatenate([f.eigenvalues for f in modes]),
    )


@pytest.fixture(scope="module")
def base() -> Modes:
    return solve(TYRE.deck)


def fields_of(base: Modes) -> sensitivity.ModeShapes:
    return sensitivity.ModeShapes(base.n, base.shapes)


def rates(
    base: Modes,
    tangents: list[tuple[int, int, float]],
    pressure: complex,
    fields: sensitivity.ModeShapes | None = None,
) -> Array:
    """d lambda by the solver's complex step, for tangents on the deck and on the pressure."""
    seeded = model.build(language.seed(language.read_keywords(TYRE.deck), tangents), None, True)
    loads = [Pressure(seeded.mesh.faces["CAVITY"], pressure)]
    factor = base.vibration.factor(0)
    number = base.vibration.numbering
    V = sensitivity.state_rate(seeded, base.state, loads, number, factor)
    return sensitivity.eigenvalue_rates(
        seeded, base.state, V, loads, fields or fields_of(base), base.eigenvalues
    )


def difference(at: Callable[[float], Array]) -> Array:
    """Derivative at 0, central difference of fourth order."""
    h = 5e-3
    return (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)


def hertz_per_unit(rate: Array, eigenvalues: Array) -> Array:
    return rate / (8 * np.pi**2 * support.hertz(eigenvalues))


def agree(got: Array, wanted: Array) -> None:
    assert abs(wanted).max() > 1e-3  # Hz per scale of the variable: something to compare
    assert abs(got - wanted).max() <= 1e-5 * abs(wanted).max()


LIKE_OTHERS = {"carcass area", "cord density", "belt modulus", "C01", "Z of a node"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n in LIKE_OTHERS)) for n in VARIABLES]
)
def test_against_central_differences(base: Modes, name: str) -> None:
    """d f/dp of eight modes, the change of the inflated state included: within 1e-5 of the mode
    that moves most. f = sqrt(lambda) / 2 pi."""
    place = VARIABLES[name]
    got = hertz_per_unit(rates(base, place.tangents, PRESSURE), base.eigenvalues)
    agree(got, difference(lambda s: support.hertz(solve(place.moved(s)).eigenvalues)))


def test_pressure_against_central_differences(base: Modes) -> None:
    """The same by ln p."""
    got = rates(base, [], complex(PRESSURE, language.COMPLEX_STEP * PRESSURE))
    wanted = difference(lambda s: support.hertz(solve(TYRE.deck, PRESSURE * np.exp(s)).eigenvalues))
    agree(hertz_per_unit(got, base.eigenvalues), wanted)


def test_remembered_strains_change_nothing(base: Modes) -> None:
    """The memory of the modes' gradients gives the same rates to the last digit for all
    variables, also for a node, whose operators differ."""
    fields = fields_of(base)
    for name in ("C10", "R of a node", "belt area"):
        tangents = VARIABLES[name].tangents
        shared = rates(base, tangents, PRESSURE, fields)
        np.testing.assert_array_equal(shared, rates(base, tangents, PRESSURE))
    assert len(fields.known) == 2


def test_preload_matters(base: Modes) -> None:
    """The derivative by the carcass' area is wrong by more than its own size if the state is
    frozen: the change of the preload is part of it."""
    tangents = VARIABLES["carcass area"].tangents
    whole = rates(base, tangents, PRESSURE)
    seeded = model.build(language.seed(language.read_keywords(TYRE.deck), tangents), None, True)
    loads = support.cavity(seeded, PRESSURE)
    frozen = sensitivity.eigenvalue_rates(
        seeded, base.state, 0 * base.state, loads, fields_of(base), base.eigenvalues
    )
    assert abs(frozen - whole).max() > abs(whole).max()


def test_euler_identity(base: Modes) -> None:
    """lambda is homogeneous of degree 0 in (moduli, 1/D1, pressure, densities) scaled together:
    stiffness and mass grow alike, the shape stays. sum of p d lambda/dp = 0."""
    total = rates(base, [], complex(PRESSURE, language.COMPLEX_STEP * PRESSURE))
    C10, C01, D1 = map(float, LINES[RUBBER[0]].split(","))
    places = [Place(RUBBER, 0, C10), Place(RUBBER, 1, C01), Place(RUBBER, 2, -D1)]
    places += [VARIABLES["rubber density"], VARIABLES["cord density"], VARIABLES["belt modulus"]]
    belt3 = "*MATERIAL, NAME=CORD3"
    places += [Place((line("1722", belt3),), 0, 1.722e11), Place((line("9870"),), 0, 9.87e9)]
    places += [Place((line("5900", m),), 0, 5900.0) for m in ("*MATERIAL, NAME=CORD2", belt3)]
    tangents = [t for place in places for t in place.tangents]
    total = total + rates(base, tangents, PRESSURE)
    assert abs(total).max() <= 1e-9 * base.eigenvalues.max()


def test_four_node_elements() -> None:
    """Likewise by C10, which their hourglass stiffness goes with, and by a node's radius, at modes
    high enough to hold hourglass patterns."""
    tyre = support.tyre((3, 2, 2, 1), quadratic=False)
    lines = tyre.deck.splitlines()
    gum = next(i for i, text in enumerate(lines) if text.startswith("1000000.0,"))
    inner = next(i for i, text in enumerate(lines) if text.startswith("10,"))

    def solved(text: str) -> tuple[Modes, harmonics.Vibration]:
        m = support.model_of(text)
        mask, loads = support.held(m, tyre.rim), support.cavity(m, PRESSURE)
        U = support.inflate(m, mask, loads)
        vibration = harmonics.Vibration(m, U, loads, support.numbering(m, mask), 0.0)
        modes = [vibration.modes(n, 8) for n in (0, 2)]
        shapes = np.concatenate([f.shapes for f in modes])
        values = np.concatenate([f.eigenvalues for f in modes])
        return Modes(U, vibration, np.repeat((0, 2), 8), shapes, values), vibration

    base, vibration = solved(tyre.deck)
    for place, field, scale in ((gum, 0, 1e6), (inner, 1, 0.003)):

        def at(s: float, place: int = place, field: int = field, scale: float = scale) -> Array:
            row = lines[place].split(",")
            row[field] = repr(float(row[field]) + s * scale)
            return solved("\n".join([*lines[:place], ",".join(row), *lines[place + 1 :]]))[
                0
            ].eigenvalues

        tangents = [(place + 1, field, scale)]
        seeded = model.build(language.seed(language.read_keywords(tyre.deck), tangents), None, True)
        loads = support.cavity(seeded, PRESSURE)
        factor = vibration.factor(0)
        V = sensitivity.state_rate(seeded, base.state, loads, vibration.numbering, factor)
        got = sensitivity.eigenvalue_rates(
            seeded, base.state, V, loads, fields_of(base), base.eigenvalues
        )
        wanted = difference(at)
        assert abs(got - wanted).max() <= 1e-5 * abs(wanted).max()


@pytest.mark.parametrize("n", [0, 1, 2, 3, 4])
def test_modes_are_the_lowest(inflated: Inflated, n: int) -> None:
    """Eigenvalues of K(n) x = lambda M x: the lowest one to six agree with LAPACK's dense solver,
    and u^H M u = 1 per radian."""
    m, free = inflated.model, ~inflated.held.ravel()
    K0, K1, K2 = support.matrices(m, inflated.U, inflated.loads)
    K = (K0 + 1j * n * K1 + n * n * K2)[free][:, free]
    mass = mechanics.mass(m)
    M = np.kron(support.full(mass), np.eye(3))[free][:, free]
    wanted = eigh(K, M, eigvals_only=True, subset_by_index=[0, 5])
    number = support.numbering(m, inflated.held)
    vibration = harmonics.Vibration(m, inflated.U, inflated.loads, number, 0.0)
    for count in range(1, 7):  # a missed mode may come in late, by round-off
        modes = vibration.modes(n, count)
        for shape in modes.shapes:
            assert (shape.conj() * (mass @ shape)).sum().real == pytest.approx(1.0, rel=1e-9)
        np.testing.assert_allclose(modes.eigenvalues, wanted[:count], rtol=1e-7)


class Spectrum:
    """A vibration with known eigenvalues (m,) per harmonic; remembers what it was asked."""

    def __init__(self, eigenvalues: list[Array]):
        self.eigenvalues = eigenvalues
        self.asked: list[int] = []
        self.looks: list[int] = []

    def modes(self, n: int, count: int, factor: object = None) -> harmonics.HarmonicModes:
        self.asked.append(n)
        values = self.eigenvalues[n][:count]
        return harmonics.HarmonicModes(n, values, np.zeros((len(values), 1, 3)))


@pytest.mark.parametrize("wanted", [1, 2, 3, 4, 7, 20])
def test_the_lowest_of_all_harmonics(random: np.random.Generator, wanted: int) -> None:
    """Doublets twice, whatever harmonic they are of, and time looked at for each: up to the first
    one from the second on that starts above them."""
    for _ in range(20):
        spectra = [np.sort(random.uniform(1.0, 30.0, 30)) for _ in range(40)]
        start = np.concatenate([random.uniform(1, 12, 2), 1 + np.cumsum(random.uniform(0, 3, 38))])
        values = [own - own[0] + first for own, first in zip(spectra, start, strict=True)]
        whole = np.sort(np.concatenate([np.repeat(v, 2 if n else 1) for n, v in enumerate(values)]))
        limit, spectrum = whole[wanted - 1], Spectrum(values)
        modes = harmonics.lowest_of_all(spectrum, wanted, lambda own=spectrum: own.looks.append(1))
        last = next(n for n in range(2, 40) if start[n] > limit)
        assert [m.n for m in modes] == list(range(last + 1))
        assert (
            sorted(set(spectrum.asked)) == list(range(last + 1)) and len(spectrum.looks) == last + 1
        )
        for n, m in enumerate(modes):
            np.testing.assert_array_equal(m.eigenvalues, values[n][values[n] <= limit])


def test_a_buckling_harmonic_is_named(inflated: Inflated) -> None:
    """Ten times the pressure pushing inwards: K(n) is indefinite, said as Unstable with its n."""
    loads = [support.Pressure(inflated.loads[0].lines, -2.4e6)]
    number = support.numbering(inflated.model, inflated.held)
    vibration = harmonics.Vibration(inflated.model, 0 * inflated.U, loads, number, 0.0)
    with pytest.raises(RunFailed, match="3 waves"):
        vibration.modes(3, 2)


@pytest.mark.parametrize("n", [0, 1, 3])
def test_the_iteration_starts_from_smooth_motions(n: int) -> None:
    """Axial shift, tilt, and a spin or bending that does not stretch the circumference; three that
    do not depend on each other, lopsided where a symmetry would keep it from half of the modes."""
    X = np.column_stack([np.linspace(0.3, 0.4, 9), np.linspace(-0.1, 0.1, 9)])
    shift, tilt, third = np.moveaxis(harmonics._start_fields(X, n), -1, 0)
    turned = lambda u: (u * [1, -1, -1])[::-1].conj()  # z -> -z, and exp(i n Theta) back again
    if n:
        for field in (shift, tilt, third):
            np.testing.assert_allclose(turned(field), field, atol=1e-15)
        shift, tilt = shift / 1j, tilt / 1j
    assert not shift[:, :2].any() and (shift[:, 2].real > 0).all()
    assert not tilt[:, 1:].any() and np.ptp(tilt[:, 0]) == pytest.approx(1.0)
    assert not third[:, 2].any() and abs(third[:, 0] + 1j * n * third[:, 1]).max() < 1e-12
    if n:
        assert (third[:, 0] == 1.0).all()
        return
    assert (third[:, 1] > 0).all()
    for field in (shift[:, 2], tilt[:, 0], third[:, 1]):
        assert abs(field - field[::-1]).max() > 0.1 and abs(field + field[::-1]).max() > 0.1
