"""A mass and a stiff sector against a tyre of finite elements round the circumference."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, kron
from scipy.sparse.linalg import eigsh, splu
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform import coupled, splice
from tyrecal_solvers.bundled.nonuniform.splice import SpliceSector
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.point_elements import PointElements
from tyrecal_solvers.bundled.solid3d.circumference import Circumference, functions, points
from tyrecal_solvers.bundled.solid3d.revolved import Revolved

from . import support
from .conftest import Inflated
from .split_modes import COUNT, frequencies, plain_of

Array = np.ndarray
ELEMENTS = 12


class Bricks:
    """A tyre in three dimensions, independently: finite elements round the whole circle (spans of
    1, cos, sin), the first one about Theta = 0, with sparse matrices over all free components."""

    def __init__(self, model: support.Model, free: Array, loads: list, other: support.Model):
        self.model, self.free, self.loads, k = model, free, loads, 2 * ELEMENTS
        length = 2 * np.pi / ELEMENTS
        count = points(length)
        xi, w = np.polynomial.legendre.leggauss(count)
        N, slope = functions(xi * length / 2, length / 2)
        s = ELEMENTS * count
        rows = np.arange(s)
        element = rows // count
        self.cols = (2 * element[:, None] + np.arange(3)) % k
        self.N, self.slope = np.tile(N, (ELEMENTS, 1)), np.tile(slope, (ELEMENTS, 1))
        self.weights = np.tile(w * length / 2, ELEMENTS)
        full_N, full_slope = np.zeros((2, s, k))
        full_N[rows[:, None], self.cols] = self.N
        full_slope[rows[:, None], self.cols] = self.slope
        angles = np.arange(k) * length / 2 - length / 2
        around = Circumference(angles, full_N, full_slope, self.weights)
        self.inside = (element == 0).astype(float)
        self.tyre = Revolved(splice.blended(model, other, self.inside), loads, around)
        self.mass = mechanics.mass(model), mechanics.mass(other)
        self.keep = np.tile(free.ravel(), k)

    def matrix(self, blocks: list[tuple[Array, Array, Array, Array]]) -> csr_array:
        """Assemble parts (s, e, 3a, 3a) of u u, u v and v v with their connectivity, v =
        du/dTheta."""
        n, size = self.free.size, len(self.keep)
        rows, cols, values = [], [], []
        for connectivity, uu, uv, vv in blocks:
            e = (3 * connectivity[:, :, None] + np.arange(3)).reshape(len(connectivity), -1)
            outer = "si,sj,seab->sijeab"
            full = np.einsum(outer, self.N, self.N, uu) + np.einsum(outer, self.N, self.slope, uv)
            full += np.einsum("si,sj,seba->sijeab", self.slope, self.N, uv)
            full += np.einsum(outer, self.slope, self.slope, vv)
            values.append((full * self.weights[:, None, None, None, None, None]).ravel())
            place = n * self.cols[:, :, None, None] + e
            rows.append(np.broadcast_to(place[:, :, None, :, :, None], full.shape).ravel())
            cols.append(np.broadcast_to(place[:, None, :, :, None, :], full.shape).ravel())
        where = np.concatenate(rows), np.concatenate(cols)
        total = csr_array((np.concatenate(values), where), (size, size))
        return total[self.keep][:, self.keep]

    def inflate(self, U: Array) -> csr_array:
        """Newton's method from the plain state; the tangent there."""
        state = np.repeat(U[None], 2 * ELEMENTS, 0)
        for _ in range(8):
            force = self.tyre.residual(state).reshape(-1)[self.keep]
            K = self.matrix(self.tyre.tangents())
            if np.linalg.norm(force) < 1e-7 * 240e3 * 0.1:
                return K
            step = np.zeros(len(self.keep))
            step[self.keep] = splu(K.tocsc()).solve(-force)
            state = state + step.reshape(state.shape)
        raise AssertionError("no equilibrium")

    def masses(self) -> csr_array:
        k = 2 * ELEMENTS
        plain, more = np.zeros((2, k, k))
        for s, cols in enumerate(self.cols):
            NN = self.weights[s] * np.outer(self.N[s], self.N[s])
            plain[np.ix_(cols, cols)] += NN
            more[np.ix_(cols, cols)] += self.inside[s] * NN
        M, other = (support.full(m) for m in self.mass)
        whole = kron(csr_array(plain), kron(M, np.eye(3))) + kron(
            csr_array(more), kron(other - M, np.eye(3))
        )
        return csr_array(whole)[self.keep][:, self.keep]

    def mean(self, row: int) -> Array:
        """p (components, 3): mean displacement of a node over the first element."""
        p = np.zeros((2 * ELEMENTS, *self.free.shape, 3))
        own = self.inside * self.weights
        for s in np.flatnonzero(own):
            for i in range(3):
                p[self.cols[s], row, i, i] += own[s] / own.sum() * self.N[s]
        return p.reshape(-1, 3)[self.keep]


@pytest.fixture(scope="module")
def small() -> Inflated:
    tyre = support.tyre((2, 1, 1, 1), (1, 1, 1, 1), quadratic=False)
    model = support.model_of(tyre.deck)
    held, loads = support.held(model, tyre.rim), support.cavity(model, 240e3)
    return Inflated(tyre, model, held, loads, support.inflate(model, held, loads))


@pytest.mark.slow
def test_against_bricks(small: Inflated) -> None:
    """Frequency by frequency, the change that a stiff sector of 30 degrees, or 0.1 kg spread
    over it, makes in a tyre of finite elements round the circumference, its inflated state found
    by its own Newton's method: within 2 % of the largest change (12 elements round are up to 1.5 %
    too stiff in lambda, and harmonics end at 8 for the sector)."""
    model, free = small.model, ~small.held
    vibration = Vibration(model, small.U, small.loads, support.numbering(model, small.held), 0.0)
    waves, stiff = [0, 1, 2], support.stiffer(model, 0.3)

    def lowest(K: csr_array, M: csr_array) -> Array:
        return np.sort(eigsh(K, 10, M, sigma=0.0, return_eigenvectors=False))

    bare = Bricks(model, free, small.loads, model)
    K, M = bare.inflate(small.U), bare.masses()
    was = lowest(K, M)
    crown = int(np.argmax(model.mesh.X[:, 0]))
    p = csr_array(bare.mean(crown))
    heavy = lowest(K, M + 0.1 * (p @ p.T))
    spliced = Bricks(model, free, small.loads, stiff)
    split = lowest(spliced.inflate(small.U), spliced.masses())
    known = np.sort(plain_of(vibration, waves))
    a = PointElements(
        np.full(3, crown), np.arange(3), np.full(3, 0.1 + 0j), np.zeros(3, complex), ELEMENTS
    )
    mine_heavy = frequencies(coupled.attached_modes(vibration, a, waves, COUNT))
    mine_split = frequencies(
        splice.sector_modes(
            vibration,
            small.U,
            small.loads,
            model,
            SpliceSector(2 * np.pi / ELEMENTS, stiff),
            waves,
            COUNT,
        )
    )
    for bricks, mine in ((heavy, mine_heavy), (split, mine_split)):
        wanted = bricks / was - 1
        got = np.sort(mine) / known - 1
        assert abs(wanted - got).max() < 0.02 * abs(wanted).max()
