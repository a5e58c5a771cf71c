"""A sector that is stiffer and heavier: inflated, its modes, a tyre of elements all round."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.sparse import csr_array, kron
from scipy.sparse.linalg import eigsh, splu
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck.request import Request, SectorRequest
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform import coupled, splice
from tyrecal_solvers.bundled.nonuniform.splice import (
    FullCircle,
    SpliceSector,
    blended,
    full_circle,
    sector_modes,
)
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.bundled.section.point_elements import PointElements
from tyrecal_solvers.bundled.solid3d.circumference import Circumference, functions, points
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.language.text import read_keywords

from ..effects.support import CASE, decks
from . import support
from .conftest import Inflated
from .support import COUNT, WAVES, Halves, frequencies, plain, plain_of

Array = np.ndarray


def test_a_heavier_sector_weighs_where_it_is(vibration: Vibration, inflated: Inflated) -> None:
    """u M~ u of every wave up to the highest, by the integral over the sector of 0.4 rad."""
    other, top, width = support.stiffer(inflated.model, 1.0), 3, 0.4
    around = splice.full_circle(top)
    tyre = Revolved(inflated.model, inflated.loads, around)
    fields = splice.FullCircle(vibration, tyre, SpliceSector(width, other), top)
    u = np.where(inflated.held, 0.0, 1.0)
    plain, more = (float((u * (mechanics.mass(m) @ u)).sum()) for m in (inflated.model, other))
    angle = np.linspace(-width / 2, width / 2, 4001)
    for n in range(top + 1):
        for wave in (1.0, 1j) if n else (1.0,):
            field = fields.field(n, wave * u)
            inside = trapezoid((wave * np.exp(1j * n * angle)).real ** 2, angle)
            whole = np.pi if n else 2 * np.pi
            wanted = plain * whole + (more - plain) * inside
            assert (field * fields.inertia(field)).sum() == pytest.approx(wanted, rel=1e-6)
            amplitude = fields.wave(field, n)
            np.testing.assert_allclose(amplitude, wave * u, atol=1e-12)


def test_an_equilibrium_with_a_splice_looks_at_the_time(
    vibration: Vibration, inflated: Inflated
) -> None:
    """The time limit is checked once if the state is an equilibrium already, and more often with
    a stiffer sector."""
    around = splice.full_circle(2)
    looks: list[int] = []
    for share, more in ((0.0, 1), (0.05, 2)):
        other = support.stiffer(inflated.model, share)
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


def test_a_sector_of_360_degrees_is_another_tyre(vibration: Vibration, inflated: Inflated) -> None:
    """chi = 1 all round: modes and inflated state of the stiffer, heavier tyre, found from the
    plain one's; no doublet splits."""
    other = support.stiffer(inflated.model, 0.05)
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


def test_the_iteration_finds_the_lowest_and_looks_at_the_time() -> None:
    """A diagonal problem, K over M known; the first fields' shares in the modes are theirs; the
    time is checked for every field."""
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


@dataclass(frozen=True)
class Circles:
    """A spliced tyre and what its modes are asked with."""

    model: Model
    loads: list[Pressure]
    vibration: Vibration
    sector: SpliceSector
    fields: FullCircle
    rest: Array  # forces out of balance in the plain state

    @classmethod
    def of(cls, model: Model, U: Array, loads: list[Pressure], coordinates: Any) -> Circles:
        top, around = 3, full_circle(3)
        sector = SpliceSector(0.5, support.stiffer(model, 0.3))
        share = sector.share(2 * np.pi * np.arange(13) / 13, 2 * top)
        vibration = Vibration(model, U, loads, coordinates, 0.0)
        tyre = Revolved(blended(model, sector.model, share), loads, around)
        fields = FullCircle(vibration, tyre, sector, top)
        return cls(
            model, loads, vibration, sector, fields, fields.out_of_balance(np.repeat(U[None], 7, 0))
        )


@pytest.fixture(scope="module")
def circles(halves: Halves) -> tuple[Circles, Circles]:
    """Half of a tyre with a stiffer and heavier sector, and all of it, as inflated without."""
    numbering = support.numbering(halves.whole, ~halves.free)
    return (
        Circles.of(halves.half, halves.U, support.cavity(halves.half, 240e3), halves.fields),
        Circles.of(halves.whole, halves.U, halves.loads, numbering),
    )


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_fields_round_a_spliced_tyre_on_half_the_section(
    circles: tuple[Circles, Circles], turn: float, random: np.random.Generator
) -> None:
    """Forces, inertia and responses of what half a turn keeps, and of what it reverses."""
    half, whole = (each.fields for each in circles)
    assert (half.turn, whole.turn) == (1.0, 0.0)
    own = half.turning(turn)
    u = random.normal(size=(7, *half.free.shape)) * half.free
    kept = own.part(u)
    np.testing.assert_allclose(own.turned(kept), turn * kept, atol=1e-13)
    np.testing.assert_allclose(kept + half.turning(-turn).part(u), u, atol=1e-13)
    assert whole.part(u) is u and whole.whole(u) is u
    for name in ("forces", "inertia", "response"):
        mine, its = getattr(own, name)(kept), getattr(whole, name)(kept)
        np.testing.assert_allclose(mine, its, atol=1e-9 * abs(its).max())
    rest = [each.rest for each in circles]
    np.testing.assert_allclose(*rest, atol=1e-10 * abs(rest[1]).max())


@pytest.mark.slow
def test_modes_of_a_spliced_tyre_on_half_the_section(
    circles: tuple[Circles, Circles], halves: Halves
) -> None:
    """Half a turn keeps one mode of each doublet and reverses the other; results list both kinds
    together."""
    half, whole = (
        sector_modes(c.vibration, halves.U, c.loads, c.model, c.sector, [0, 1, 2], 2, beyond=2)
        for c in circles
    )
    for mine, its in zip(half, whole, strict=True):
        apart = abs(its.eigenvalues[1] / its.eigenvalues[0] - 1)
        assert apart > 1e-4
        np.testing.assert_allclose(mine.eigenvalues, its.eigenvalues, rtol=1e-3 * apart)
        for u, v in zip(mine.shapes, its.shapes, strict=True):
            lengths = np.linalg.norm(u), np.linalg.norm(v)
            assert abs(np.vdot(u, v)) == pytest.approx(lengths[0] * lengths[1], rel=1e-4)
            assert lengths[0] == pytest.approx(lengths[1], rel=1e-4)


def test_a_splice_is_solved_on_half_where_the_sector_is_symmetric_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    texts = decks(CASE, stiffness_splice=0.5)
    sector = read_keywords(texts["splice.inp"])
    own = Deck({name: texts[f"{name}.inp"] for name in ("inflate", "modes")}, "modes", "inflate")
    request = Request(harmonics=[0], sector=SectorRequest("splice", 10.0))
    assert Job(own, request, sector=sector).tyre.half
    kept = jobs.keeps_half_turn
    lopsided = lambda mesh, filled, steps: filled != sector and kept(mesh, filled, steps)
    monkeypatch.setattr(jobs, "keeps_half_turn", lopsided)
    assert not Job(own, request, sector=sector).tyre.half and Job(own, request).tyre.half


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
