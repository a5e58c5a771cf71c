"""Masses, springs and sectors: tyres that are not the same all round."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array, kron
from scipy.sparse.linalg import eigsh, splu
from tyrecal_solvers.bundled.deck.keywords import COMPLEX_STEP
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform import coupled, splice
from tyrecal_solvers.bundled.nonuniform.splice import SpliceSector
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.point_elements import PointElements
from tyrecal_solvers.bundled.solid3d.circumference import Circumference, functions, points
from tyrecal_solvers.bundled.solid3d.revolved import Revolved

from . import support
from .conftest import Inflated
from .contact import ring

Array = np.ndarray
WAVES, COUNT, SECTORS = [0, 1, 2, 3], 2, 6


@pytest.fixture(scope="module")
def vibration(inflated: Inflated) -> Vibration:
    number = support.numbering(inflated.model, inflated.held)
    return Vibration(inflated.model, inflated.U, inflated.loads, number, 0.0)


def on_crown(inflated: Inflated, mass: float = 0.0, spring: float = 0.0) -> PointElements:
    """Mass (kg) in all three directions and a radial spring (N/m) on the node furthest out."""
    crown = int(np.argmax(inflated.model.mesh.X[:, 0]))
    stiffness = np.array([spring, 0.0, 0.0], complex)
    return PointElements(
        np.full(3, crown), np.arange(3), np.full(3, mass, complex), stiffness, SECTORS
    )


def frequencies(modes: list[harmonics.HarmonicModes]) -> Array:
    return np.concatenate([m.eigenvalues for m in modes])


def plain(vibration: Vibration) -> Array:
    """omega^2 of the plain tyre, each doublet twice, in the order of the split ones."""
    return plain_of(vibration, WAVES)


@pytest.mark.parametrize(("mass", "spring"), [(0.05, 0.0), (0.0, 5e4), (0.05, 5e4)])
def test_secular_equation(
    vibration: Vibration, inflated: Inflated, mass: float, spring: float
) -> None:
    """det(1 + (k - lambda m) H(lambda)) = 0 at every coupled eigenvalue, H the dynamic receptance
    p^T (K - lambda M)^-1 p summed over the harmonics, each solved directly: what Ritz's method
    leaves out of the basis is worth less than 1e-3 of the shift in lambda."""
    a = on_crown(inflated, mass, spring)
    modes = coupled.attached_modes(vibration, a, WAVES, COUNT)
    free = ~inflated.held.ravel()
    M = csr_array(np.kron(support.full(vibration.mass), np.eye(3))[free][:, free])
    whole = support.matrices(inflated.model, inflated.U, inflated.loads)
    K0, K1, K2 = (csr_array(K[free][:, free]) for K in whole)
    p = np.zeros((len(free), 3))
    p[3 * a.rows + a.components, range(3)] = 1.0
    p = p[free]
    change = lambda value: np.diag(a.stiffness.real - value * a.mass.real)

    def gap(value: float) -> float:
        """The eigenvalue of change^-1 + H nearest to zero, as a share of the largest."""
        H = np.zeros((3, 3))
        for n in range(SECTORS + 1):
            K = K0 + 1j * n * K1 + n * n * K2 - value * M
            x = splu(K.tocsc()).solve(p.astype(complex))
            H += (p.T @ x).real * a.share(n) ** 2 / (np.pi if n else 2 * np.pi)
        return float(np.sort(np.linalg.eigvals(np.eye(3) + change(value) @ H).real)[0])

    was = plain(vibration)
    found = frequencies(modes)
    moved = np.argsort(-abs(found / was - 1))[:2]
    for j in moved:
        step = 2e-3 * abs(found[j] - was[j])
        assert gap(found[j] - step) * gap(found[j] + step) < 0


def test_what_is_attached_leaves_shapes_of_unit_mass(
    vibration: Vibration, inflated: Inflated
) -> None:
    """Next to nothing on the tyre: each member of a doublet is as large as the plain mode."""
    modes = coupled.attached_modes(vibration, on_crown(inflated, 1e-9), WAVES, COUNT)
    mass = lambda u: float((u.conj() * (vibration.mass @ u)).real.sum())
    for n, found in zip(WAVES, modes, strict=True):
        own = mass(vibration.modes(n, 1).shapes[0])
        assert [mass(u) for u in found.shapes] == pytest.approx([own] * len(found.shapes), rel=1e-6)


def test_time_is_looked_at_for_every_harmonic_of_what_is_attached(
    vibration: Vibration, inflated: Inflated
) -> None:
    """Those of the sectors, and those asked for beyond; the fields of n = 0 are real."""
    looks: list[int] = []
    attached = on_crown(inflated, 0.05)
    coupled.attached_modes(vibration, attached, [0, 7], 1, lambda: looks.append(1))
    assert len(looks) == max(SECTORS, 7) + 1
    force = coupled._unit_forces(vibration.numbering, attached)
    families = [coupled._with_response(vibration, n, 1, force) for n in (0, 1)]
    assert [np.iscomplexobj(family.shapes) for family in families] == [False, True]


def test_mass_lowers_and_spring_raises(vibration: Vibration, inflated: Inflated) -> None:
    """Rayleigh: no frequency rises with a mass or falls with a spring. A radial spring, of rank 1,
    leaves one member of every doublet within a hair of where it was."""
    was = plain(vibration)
    heavier = frequencies(coupled.attached_modes(vibration, on_crown(inflated, 0.05), WAVES, COUNT))
    stiffer = coupled.attached_modes(vibration, on_crown(inflated, 0, 5e4), WAVES, COUNT)
    assert (heavier <= was * (1 + 1e-9)).all() and heavier.min() < 0.999 * was.max()
    assert (frequencies(stiffer) >= was * (1 - 1e-9)).all()
    for n, modes in zip(WAVES[1:], stiffer[1:], strict=True):
        lower, upper = modes.eigenvalues.reshape(-1, 2).T
        known = vibration.modes(n, COUNT).eigenvalues
        np.testing.assert_allclose(lower, known, rtol=1e-6)
        assert (upper > lower).all()
        assert modes.members is not None and modes.members.tolist() == [1, 2] * COUNT


@pytest.mark.parametrize("n", [1, 2, 3])
def test_small_mass_by_first_order_perturbation(
    vibration: Vibration, inflated: Inflated, n: int
) -> None:
    """The two members of a doublet under 1 mg: d lambda = -lambda m |p|^2 in the basis of the
    doublet that makes p^T p diagonal."""
    mass = 1e-6
    a = on_crown(inflated, mass)
    modes = coupled.attached_modes(vibration, a, WAVES, COUNT)[n]
    known = vibration.modes(n, COUNT)
    for k in range(COUNT):
        u = known.shapes[k][a.rows, a.components] / np.sqrt(np.pi) * a.share(n)
        p = np.stack([u.real, -u.imag], 1)
        shift = -known.eigenvalues[k] * mass * np.linalg.eigvalsh(p.T @ p)[::-1]
        found = modes.eigenvalues[2 * k : 2 * k + 2] - known.eigenvalues[k]
        np.testing.assert_allclose(found, shift, rtol=2e-3, atol=1e-9 * known.eigenvalues[k])


def test_a_heavier_sector_weighs_where_it_is(vibration: Vibration, inflated: Inflated) -> None:
    """u M~ u of every wave up to the highest, by the integral over the sector of 0.4 rad."""
    other, top, width = stiffer(inflated.model, 1.0), 3, 0.4
    around = splice.full_circle(top)
    tyre = Revolved(inflated.model, inflated.loads, around)
    fields = splice.FullCircle(vibration, tyre, SpliceSector(width, other), top)
    u = np.where(inflated.held, 0.0, 1.0)
    plain, more = (float((u * (mechanics.mass(m) @ u)).sum()) for m in (inflated.model, other))
    angle = np.linspace(-width / 2, width / 2, 4001)
    for n in range(top + 1):
        for wave in (1.0, 1j) if n else (1.0,):
            field = fields.field(n, wave * u)
            inside = np.trapezoid((wave * np.exp(1j * n * angle)).real ** 2, angle)
            whole = np.pi if n else 2 * np.pi
            wanted = plain * whole + (more - plain) * inside
            assert (field * fields.inertia(field)).sum() == pytest.approx(wanted, rel=1e-6)
            amplitude = fields.wave(field, n)
            np.testing.assert_allclose(amplitude, wave * u, atol=1e-12)


def test_an_equilibrium_with_a_splice_looks_at_the_time(
    vibration: Vibration, inflated: Inflated
) -> None:
    """Once where the state is one already; more often with a stiffer sector, or it does not end."""
    around = splice.full_circle(2)
    looks: list[int] = []
    for share, more in ((0.0, 1), (0.05, 2)):
        other = stiffer(inflated.model, share)
        sector = SpliceSector(2 * np.pi, other)
        tyre = Revolved(splice.blended(inflated.model, other, np.ones(9)), inflated.loads, around)
        fields = splice.FullCircle(vibration, tyre, sector, 2)
        looks.clear()
        splice.equilibrium(fields, inflated.U, lambda: looks.append(1))
        assert more <= len(looks) <= 3 * more
    with pytest.raises(TimeoutError):
        splice.equilibrium(fields, inflated.U, timed_out)


def timed_out() -> None:
    raise TimeoutError


def test_slopes_by_masses_and_springs(random: np.random.Generator) -> None:
    """sum of (k' - lambda m') p^2 over the components."""
    k, m = random.normal(size=(2, 4))
    step = 1j * COMPLEX_STEP
    at = PointElements(np.arange(4), np.zeros(4, int), 1.0 + step * m, 2.0 + step * k, 9)
    values, p = np.array([3.0, 5.0]), random.normal(size=(4, 2))
    wanted = [sum((k - value * m) * p[:, j] ** 2) for j, value in enumerate(values)]
    assert at.rates(values, p) == pytest.approx(wanted)
    assert at.total_kg == pytest.approx(4 / 3)
    nothing = np.zeros(4)
    empty = PointElements(np.arange(4), np.zeros(4, int), nothing, nothing, 9)
    assert bool(at) and not empty
    assert replace(empty, mass=np.ones(4)) and replace(empty, stiffness=np.ones(4))


def test_few_fields_stand_for_those_far_above(random: np.random.Generator) -> None:
    """Masses and springs on 400 fields: those that stand for the high ones leave the lowest modes
    as they are, to ninefold's sixth power; all are orthonormal."""
    eigenvalues, p = np.linspace(1.0, 40.0, 400) ** 2, random.normal(size=(3, 400))
    low, high, rest = coupled._reduced(eigenvalues, p, 20)
    fewer = np.zeros((400, len(low) + rest.shape[1]))
    fewer[low, range(len(low))], fewer[high, len(low) :] = 1.0, rest
    assert fewer.shape[1] < 100
    np.testing.assert_allclose(fewer.T @ fewer, np.eye(fewer.shape[1]), atol=1e-12)
    mass, spring = np.diag([0.0, 1e-2, 1e-3]), np.diag([3.0, 0.0, 1.0])
    K, M = np.diag(eigenvalues) + p.T @ spring @ p, np.eye(400) + p.T @ mass @ p
    whole = eigh(K, M, eigvals_only=True)[:20]
    some = eigh(fewer.T @ K @ fewer, fewer.T @ M @ fewer, eigvals_only=True)[:20]
    assert abs(whole / eigenvalues[:20] - 1).max() > 1e-3
    np.testing.assert_allclose(some, whole, rtol=9.0**-6)


def test_the_response_to_what_is_attached_is_among_the_fields() -> None:
    """Of stiff stuff as of soft; two of one component have one."""
    for shear in (1e5, 1e15):
        work = ring((0.2, 0.21, 0.23), 0.02, 2, support.Rubber(C10=shear))
        still = Vibration(work.model, work.U, [], support.numbering(work.model, ~work.free), 0.0)
        outside = np.flatnonzero(work.model.mesh.X[:, 0] > 0.2299)[[0, 0, 1, 1]]
        nothing = np.zeros(4, complex)
        at = PointElements(outside, np.array([0, 2, 0, 0]), nothing, nothing, SECTORS)
        force = coupled._unit_forces(still.numbering, at)
        np.testing.assert_allclose(force.T @ force, np.eye(3), atol=1e-12)
        assert len(coupled._with_response(still, 1, 2, force).shapes) == 2 + 3
        assert len(coupled._with_response(still, 0, 0, force).shapes) == 3


def test_the_series_of_a_sector_is_one_in_it_and_zero_elsewhere() -> None:
    sector = SpliceSector(0.5, None)  # type: ignore[arg-type]
    angles = np.array([0.0, 0.15, -0.2, 0.3, 1.0, np.pi])
    share = sector.share(angles, 4000)
    np.testing.assert_allclose(share, [1, 1, 1, 0, 0, 0], atol=5e-3)
    circle = np.arange(64) * np.pi / 32
    for h in range(5):
        part = (sector.share(circle, 5) * np.cos(h * circle)).mean()
        assert part == pytest.approx(np.sinc(h * 0.5 / 2 / np.pi) * 0.5 / (2 * np.pi))
    assert np.allclose(sector.share(circle, 2), sector.share(-circle, 2))


def test_full_circle_is_exact_for_waves() -> None:
    around = splice.full_circle(4)
    stations = 2 * np.pi * np.arange(17) / 17
    for n in range(5):
        for wave, slope in ((np.cos, lambda x: -np.sin(x)), (np.sin, np.cos)):
            values = wave(n * around.angles)
            np.testing.assert_allclose(around.N @ values, wave(n * stations), atol=1e-12)
            np.testing.assert_allclose(around.slope @ values, n * slope(n * stations), atol=1e-11)


def stiffer(model: support.Model, share: float) -> support.Model:
    """Rubber and cords (1 + share) times as stiff, and cords as heavy too."""
    *rubbers, cords = model.with_laws(lambda law: law.stiffened(1 + share)).parts
    law = replace(cords.law, stiffness=cords.law.stiffness * (1 + share))
    cords = replace(cords, law=law, mass=cords.mass * (1 + share))
    return replace(model, parts=[*rubbers, cords])


def test_a_sector_of_360_degrees_is_another_tyre(vibration: Vibration, inflated: Inflated) -> None:
    """chi = 1 all round: modes and inflated state of the stiffer, heavier tyre, found from the
    plain one's; no doublet splits."""
    other = stiffer(inflated.model, 0.05)
    waves = [0, 1, 2]
    got = splice.sector_modes(
        vibration,
        inflated.U,
        inflated.loads,
        inflated.model,
        SpliceSector(2 * np.pi, other),
        waves,
        COUNT,
        beyond=1,
    )
    U = support.inflate(other, inflated.held, inflated.loads)
    number = support.numbering(other, inflated.held)
    there = Vibration(other, U, inflated.loads, number, 0.0)
    for n, modes in zip(waves, got, strict=True):
        wanted = np.repeat(there.modes(n, COUNT).eigenvalues, 2 if n else 1)
        was = np.repeat(vibration.modes(n, COUNT).eigenvalues, 2 if n else 1)
        assert abs(wanted / was - 1).max() > 1e-3
        np.testing.assert_allclose(modes.eigenvalues, wanted, rtol=2e-6)


def test_no_share_is_the_plain_tyre(vibration: Vibration, inflated: Inflated) -> None:
    got = splice.sector_modes(
        vibration,
        inflated.U,
        inflated.loads,
        inflated.model,
        SpliceSector(0.2, inflated.model),
        WAVES,
        COUNT,
        beyond=1,
    )
    np.testing.assert_allclose(frequencies(got), plain(vibration), rtol=1e-8)
    mass = lambda u: float((u.conj() * (vibration.mass @ u)).real.sum())
    for n, modes in zip(WAVES, got, strict=True):
        own = [mass(u) for u in vibration.modes(n, COUNT).shapes]
        assert [mass(u) for u in modes.shapes] == pytest.approx(own[:1] * len(modes.shapes))


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
        """Of (connectivity, by u u, u v, v v) parts (s, e, 3a, 3a), v = du/dTheta."""
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


ELEMENTS = 12


@pytest.fixture(scope="module")
def small() -> Inflated:
    tyre = support.tyre((2, 1, 1, 1), (1, 1, 1, 1), quadratic=False)
    model = support.model_of(tyre.deck)
    held, loads = support.held(model, tyre.rim), support.cavity(model, 240e3)
    return Inflated(tyre, model, held, loads, support.inflate(model, held, loads))


def test_the_iteration_finds_the_lowest_and_looks_at_the_time() -> None:
    """Of a diagonal problem, K over M known; the first fields' shares in the modes are theirs; time
    is looked at for every field."""
    k, m = np.arange(1.0, 41.0).reshape(4, 5, 2) ** 2, np.linspace(1, 2, 40).reshape(4, 5, 2)
    fields: Any = SimpleNamespace(
        inertia=lambda f: m * f, forces=lambda f: k * f, response=lambda f: f / k
    )
    start = list(np.eye(40)[:6].reshape(6, 4, 5, 2) + 0.05)
    looks: list[int] = []
    values, modes, first = splice.ritz_davidson(fields, start, 4, lambda: looks.append(1))
    wanted = np.sort((k / m).ravel())[:4]
    assert values[:4] == pytest.approx(wanted, rel=1e-4)
    assert len(looks) >= len(start) + 4
    for j in range(4):
        assert (modes(j) * m * modes(j)).sum() == pytest.approx(1.0)
        for i, field in enumerate(start):
            size = np.sqrt((field * m * field).sum())
            assert first[i, j] == pytest.approx((field * m * modes(j)).sum() / size)


@pytest.mark.slow
def test_against_bricks(small: Inflated) -> None:
    """Frequency by frequency, the change that a stiff sector of 30 degrees, or 0.1 kg spread
    over it, makes in a tyre of finite elements round the circumference, its inflated state found
    by its own Newton's method: within 2 % of the largest change (12 elements round are up to 1.5 %
    too stiff in lambda, and harmonics end at 8 for the sector)."""
    model, free = small.model, ~small.held
    vibration = Vibration(model, small.U, small.loads, support.numbering(model, small.held), 0.0)
    waves, stiff = [0, 1, 2], stiffer(model, 0.3)

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


def plain_of(vibration: Vibration, waves: list[int]) -> Array:
    each = [(n, vibration.modes(n, COUNT).eigenvalues) for n in waves]
    return np.concatenate([np.repeat(values, 2 if n else 1) for n, values in each])
