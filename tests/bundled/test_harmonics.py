"""The modes of a harmonic are the lowest of the dense problem, none left out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.errors import RunFailed

from . import support
from .conftest import Inflated

pytestmark = pytest.mark.numbers

Array = np.ndarray


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
