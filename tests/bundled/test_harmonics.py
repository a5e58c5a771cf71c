"""The modes of a harmonic are the lowest of the dense problem, none left out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from tyrecal_solvers.bundled import harmonics, mechanics

from . import support
from .conftest import Inflated

pytestmark = pytest.mark.numbers


@pytest.mark.parametrize("n", [0, 1, 2, 3, 4])
def test_modes_are_the_lowest(inflated: Inflated, n: int) -> None:
    """Eigenvalues of K(n) x = lambda M x: the lowest one to six agree with LAPACK's dense solver,
    and u^H M u = 1 per radian."""
    m, free = inflated.model, ~inflated.held.ravel()
    K0, K1, K2 = support.matrices(m, inflated.U, inflated.loads)
    K = (K0 + 1j * n * K1 + n * n * K2)[free][:, free]
    mass = mechanics.mass(m)
    M = np.kron(mass.toarray(), np.eye(3))[free][:, free]
    wanted = eigh(K, M, eigvals_only=True, subset_by_index=[0, 5])
    number = support.numbering(m, inflated.held)
    vibration = harmonics.Vibration(m, inflated.U, inflated.loads, number, 0.0)
    for count in range(1, 7):  # a missed mode may come in late, by round-off
        modes = vibration.modes(n, count)
        for shape in modes.shapes:
            assert (shape.conj() * (mass @ shape)).sum().real == pytest.approx(1.0, rel=1e-9)
        np.testing.assert_allclose(modes.eigenvalues, wanted[:count], rtol=1e-7)


def test_a_buckling_harmonic_is_named(inflated: Inflated) -> None:
    """Ten times the pressure pushing inwards: K(n) is indefinite, said as Unstable with its n."""
    loads = [support.Load(inflated.loads[0].lines, -2.4e6)]
    number = support.numbering(inflated.model, inflated.held)
    vibration = harmonics.Vibration(inflated.model, 0 * inflated.U, loads, number, 0.0)
    with pytest.raises(harmonics.Unstable, match="3 waves"):
        vibration.modes(3, 2)
