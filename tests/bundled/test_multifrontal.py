"""The preconditioner: how near it is to the tangent's inverse, and how it follows the contact."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse import bsr_matrix, csr_array, csr_matrix, triu
from scipy.sparse.csgraph import reverse_cuthill_mckee
from tyrecal_solvers.bundled.road.contact_update import ContactUpdate
from tyrecal_solvers.bundled.road.half_turn_symmetry import HalfTurn
from tyrecal_solvers.bundled.road.multifrontal import Elimination, Factor
from tyrecal_solvers.bundled.section.sparse import assembled, narrow_order
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import Indefinite

from ..chance import generator
from . import support
from .conftest import Inflated
from .contact import ring

Array = np.ndarray
LENGTHS = np.array([0.05, 0.05, 0.1, 0.3, 0.6, 0.9, np.pi - 2.0])


class Problem:
    """The tangent on the parts at an axisymmetric state, with or without contact blocks."""

    def __init__(
        self,
        work: Inflated,
        parity: int = 1,
        contact: Array | None = None,
        lengths: Array = LENGTHS,
        waves: int = 0,
    ):
        around = half_circle(lengths, waves)
        k = around.N.shape[1]
        self.symmetry = HalfTurn(work.model.mesh, ~work.held, around, parity)
        self.tyre = Revolved(work.model, work.loads, around)
        self.tyre.residual(np.multiply.outer(around.turn(0).real, work.U))
        self.contact = np.zeros((k, len(work.U), 3, 3))
        if contact is not None:
            self.contact[: len(contact)] = contact
        tangents = self.tyre.tangents(np.float32)
        order = Elimination(tangents, self.symmetry)
        self.factor = Factor(order, tangents, self.folded(self.contact))

    def folded(self, contact: Array) -> csr_matrix:
        """Stiffness at single nodes (k, n, 3, 3), on the parts of the fold."""
        nodes = np.arange(contact.shape[0] * contact.shape[1] + 1)
        return self.symmetry.fold(bsr_matrix((contact.reshape(-1, 3, 3), nodes[:-1], nodes)))

    def product(self, x: Array) -> Array:
        U = self.symmetry.spread(x)
        contact = np.einsum("knij,knj->kni", self.contact, U)
        return self.symmetry.gather(self.tyre.product(U) + contact)

    def random(self) -> Array:
        x = generator(5).normal(size=(2, *self.symmetry.mask.shape))
        return x * self.symmetry.mask


def conjugate_gradients(
    product: Callable[[Array], Array], inverse: Callable[[Array], Array], b: Array
) -> tuple[Array, int]:
    """Iterations until the residual is 1e-6 of the right side."""
    precondition = lambda r: inverse(r).astype(float)  # parts are added up in double precision
    x, r = np.zeros_like(b), b.copy()
    z = precondition(r)
    p, before = z, (r * z).sum()
    for used in range(1, 60):
        Ap = product(p)
        length = before / (p * Ap).sum()
        x, r = x + length * p, r - length * Ap
        if np.linalg.norm(r) <= 1e-6 * np.linalg.norm(b):
            return x, used
        z = precondition(r)
        now = (r * z).sum()
        p, before = z + now / before * p, now
    return x, 60


def road_blocks(work: Inflated, stiffness: float, sideways: float) -> Array:
    """Stiffness (N/m) of the outermost nodes at the first angles, of the middle and one side:
    down, turned a little along, and a tenth of it across."""
    k, X = 2 * len(LENGTHS) + 1, work.model.mesh.X
    blocks = np.zeros((k, len(X), 3, 3))
    outside = np.flatnonzero((X[:, 0] > 0.97 * X[:, 0].max()) & (X[:, 1] > -0.02))
    down = np.array([1.0, -sideways, 0.0])
    blocks[:5, outside] = stiffness * (np.outer(down, down) + np.diag([0.0, 0.1, 0.1]))
    return blocks


@pytest.mark.numbers
@pytest.mark.parametrize("waves", [0, 3], ids=["elements", "waves"])
@pytest.mark.parametrize(
    "parity", [1, pytest.param(-1, marks=pytest.mark.slow)], ids=["kept", "reversed"]
)
def test_few_iterations_on_the_inflated_tyre(inflated: Inflated, parity: int, waves: int) -> None:
    """Single precision and the dropped couplings cost at most eight iterations to 1e-6."""
    problem = Problem(inflated, parity, lengths=LENGTHS[:4] if waves else LENGTHS, waves=waves)
    b = problem.random()[0]
    x, used = conjugate_gradients(problem.product, problem.factor.solve, b)
    assert np.linalg.norm(problem.product(x) - b) <= 2e-6 * np.linalg.norm(b)
    assert used <= 8


@pytest.mark.numbers
@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "sideways"),
    [
        (1e5, 0.1),
        pytest.param(1e7, 0.1, marks=pytest.mark.slow),
        pytest.param(1e7, 0.5, marks=pytest.mark.slow),
    ],
)
def test_contact_is_part_of_it(inflated: Inflated, stiffness: float, sideways: float) -> None:
    """Nodes of one side and the middle, more stiffly held than the tyre is; a factor without them
    takes many times as long."""
    problem = Problem(inflated, contact=road_blocks(inflated, stiffness, sideways))
    b = problem.random()[0]
    used = conjugate_gradients(problem.product, problem.factor.solve, b)[1]
    assert used <= 12
    without = Problem(inflated).factor
    assert conjugate_gradients(problem.product, without.solve, b)[1] > used + 10


@pytest.mark.numbers
@pytest.mark.slow
def test_approximate_inverse_is_symmetric(inflated: Inflated) -> None:
    """The inverse is symmetric to single precision, and positive; held components stay at rest."""
    for contact in (None, road_blocks(inflated, 1e6, 0.1)):
        problem = Problem(inflated, contact=contact)
        x, y = problem.random()
        Mx, My = problem.factor.solve(x), problem.factor.solve(y)
        assert (y * Mx).sum() == pytest.approx(
            (x * My).sum(), abs=1e-4 * np.linalg.norm(Mx) * np.linalg.norm(y)
        )
        assert (x * Mx).sum() > 0
        assert not Mx[~problem.symmetry.mask].any()


@pytest.mark.numbers
@pytest.mark.parametrize("quadratic", [True, False], ids=["Q8", "Q4"])
def test_exact_without_cords(quadratic: bool) -> None:
    """A section without a bias has no coupling to drop: the inverse, to single precision, also
    with a road under both sides and the middle, and with waves beyond it."""
    work = ring((0.2, 0.21, 0.23), 0.02, 4, support.Rubber(), 2e3, quadratic=quadratic)
    plain = Inflated(None, work.model, ~work.free, work.loads, work.U)  # type: ignore[arg-type]
    blocks = np.zeros((2 * len(LENGTHS) + 1, len(work.U), 3, 3))
    down = np.array([1.0, -0.3, 0.0])
    outside = work.model.mesh.X[:, 0] > 0.2299
    blocks[:5, outside] = 1e6 * (np.outer(down, down) + np.diag([0.0, 0.1, 0.1]))
    blocks[0, outside, 0, 1] = blocks[0, outside, 1, 0] = 0.0
    cases = (None, LENGTHS, 0), (blocks, LENGTHS, 0), (blocks[:5], LENGTHS[:4], 3)
    for contact, lengths, waves in cases:
        problem = Problem(plain, contact=contact, lengths=lengths, waves=waves)
        x = problem.random()[0]
        back = problem.factor.solve(problem.product(x))
        np.testing.assert_allclose(back, x, atol=2e-3 * abs(x).max())


@pytest.mark.numbers
def test_boxes_side_by_side_do_not_couple() -> None:
    """Every free unknown goes once, and what a front leaves goes later; boxes that are no part of
    each other share no unknown but of those that hold both; each cell is put together once."""
    work = ring((0.2, 0.21, 0.23), 0.04, 8, support.Rubber())
    tyre, symmetry = work.tyre(half_circle(LENGTHS)), work.symmetry(half_circle(LENGTHS))
    tyre.residual(np.zeros(symmetry.shape))
    order = Elimination(tyre.tangents(np.float32), symmetry)
    fronts = order.fronts
    gone = np.concatenate([front.own for front in fronts])
    np.testing.assert_array_equal(np.sort(gone), np.flatnonzero(symmetry.mask))
    place = np.full(symmetry.mask.size, -1)
    place[gone] = np.arange(len(gone))
    holds: list[set[int]] = []  # of each front the fronts inside
    for front in fronts:
        assert (place[front.left] > place[front.own].max(initial=-1)).all()
        holds.append(set(front.inner).union(*(holds[i] for i in front.inner)))
        for i in front.inner:
            assert np.isin(fronts[i].left, np.concatenate([front.own, front.left])).all()
    for i, front in enumerate(fronts):
        beside = [j for j in range(i) if j not in holds[i]]
        assert not any(np.isin(front.own, fronts[j].left).any() for j in beside)
    cells = [
        (part, column, piece)
        for front in fronts
        if front.cells
        for part in front.parts
        for column in range(*front.cells[0])
        for piece in range(*front.cells[1])
    ]
    assert len(order.dissection.columns) == 4
    assert sorted(cells) == list(np.ndindex(2, 4, len(LENGTHS)))


@pytest.mark.numbers
def test_linear_elements_with_cords(inflated: Inflated) -> None:
    """Four-node rubber with hourglass stiffness, two-node cords; long elements round the tyre, for
    so coarse a section in these is unstable in short waves (harmonics n >= 28)."""
    tyre = support.tyre(quadratic=False)
    m = support.model_of(tyre.deck)
    held, loads = support.held(m, tyre.rim), support.cavity(m, 240e3)
    U = support.inflate(m, held, loads)
    problem = Problem(Inflated(tyre, m, held, loads, U), lengths=np.full(8, np.pi / 8))
    b = problem.random()[0]
    assert conjugate_gradients(problem.product, problem.factor.solve, b)[1] <= 8


@pytest.mark.numbers
def test_two_layers_on_one_line() -> None:
    """Layers that share their nodes, at +20 and -20 degrees, of different stiffness: each image
    in the mirror is the same layer's."""
    b = support.block((0.3, 0.31, 2), (-0.05, 0.05, 4), True)
    line = b.columns[1]
    layers = [
        support.Layer(line, 2e-7, 1e-3, modulus, 5000.0, angle)
        for modulus, angle in ((1e11, 70.0), (3e11, 110.0))
    ]
    m = support.model_of(support.deck(b.X, b.solids, support.Rubber(), layers, b.inner))
    held = support.held(m, list(np.flatnonzero(abs(b.X[:, 1]) > 0.0499)))
    loads = support.cavity(m, 1e5)
    U = support.inflate(m, held, loads)
    problem = Problem(Inflated(None, m, held, loads, U))  # type: ignore[arg-type]
    right = problem.random()[0]
    assert conjugate_gradients(problem.product, problem.factor.solve, right)[1] <= 8


@pytest.mark.numbers
def test_an_unstable_state_is_told(inflated: Inflated) -> None:
    """A road that pulls harder than the tyre is stiff."""
    with pytest.raises(Indefinite):
        Problem(inflated, contact=-road_blocks(inflated, 1e7, 0.1))


NODES = 30


def drawn(kind: type) -> tuple[csr_array, Array]:
    """Elements of three nodes each, some twice, and the same matrix with all its zeros."""
    random = generator("sparse", kind.__name__)
    c = np.array([random.choice(NODES, 3, replace=False) for _ in range(40)])
    c[-1] = c[0]
    matrices = random.normal(size=(40, 3, 3)).astype(kind)
    if kind is complex:
        matrices[:20] += 1j * random.normal(size=(20, 3, 3))
    full = np.zeros((NODES, NODES), kind)
    for nodes, own in zip(c, matrices, strict=True):
        full[np.ix_(nodes, nodes)] += own
    return assembled([(c[:25], matrices[:25]), (c[25:], matrices[25:])], NODES), full


@pytest.mark.parametrize("kind", [float, complex])
def test_a_sparse_matrix_is_the_full_one(kind: type) -> None:
    got, full = drawn(kind)
    assert support.full(got) == pytest.approx(full, rel=1e-12, abs=1e-12)
    assert got.nnz == np.count_nonzero(full)


def test_neighbours_stand_nearly_as_near_as_scipy_puts_them() -> None:
    """A strip of quadrilaterals with its nodes numbered at random, where ties are broken otherwise;
    nothing is left out, loose nodes neither."""
    random = generator("order")
    shuffled = random.permutation(41 * 4 + 2)[: 41 * 4].reshape(41, 4)
    corners = [shuffled[:-1, :-1], shuffled[1:, :-1], shuffled[1:, 1:], shuffled[:-1, 1:]]
    c = np.stack([each.ravel() for each in corners], 1)
    pairs = np.stack([np.repeat(c, 4, 1).ravel(), np.tile(c, (1, 4)).ravel()], 1)
    n = 41 * 4 + 2
    graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (n, n))
    widths = []
    for order in (narrow_order(pairs, n), reverse_cuthill_mckee(graph, symmetric_mode=True)):
        assert sorted(order) == list(range(n))
        place = np.argsort(order)
        widths.append(abs(np.diff(place[pairs])).max())
    assert widths[0] <= 1.5 * widths[1] < 12


STARVED = """
import resource
import numpy, scipy.linalg, scipy.sparse
size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
hard = resource.getrlimit(resource.RLIMIT_AS)[1]
resource.setrlimit(resource.RLIMIT_AS, (size + 20_000_000, hard))  # a buffer has 32 MB
from tyrecal_solvers.bundled.section import band
"""


@pytest.mark.skipif(sys.platform != "linux", reason="sizes of processes are read from /proc")
def test_no_memory_for_the_buffers_of_lapack_is_an_error() -> None:
    """OpenBLAS itself tries for ever, so that a fit would not end."""
    command = [sys.executable, "-c", STARVED]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1 and "MemoryError" in done.stderr, done.stderr


@pytest.mark.slow
def test_follows_the_contact(inflated: Inflated) -> None:
    """The update follows contact that begins, stiffens and ends, with as few iterations as a
    factor formed there."""
    touching = ContactUpdate(Problem(inflated).factor)
    for blocks in (
        road_blocks(inflated, 1e6, 0.1),
        road_blocks(inflated, 1e7, 0.5),
        0 * road_blocks(inflated, 1e6, 0.1),
    ):
        problem = Problem(inflated, contact=blocks)
        touching.to(problem.folded(blocks))
        b = problem.random()[0]
        x, used = conjugate_gradients(problem.product, touching.solve, b)
        assert np.linalg.norm(problem.product(x) - b) <= 2e-6 * np.linalg.norm(b)
        assert used <= conjugate_gradients(problem.product, problem.factor.solve, b)[1] + 3


@pytest.mark.slow
def test_one_node_in_the_middle_of_the_patch(inflated: Inflated) -> None:
    """The node adds a single column: both symmetries hold it, except for its way down."""
    blocks, X = np.zeros_like(road_blocks(inflated, 1e6, 0.0)), inflated.model.mesh.X
    blocks[0, np.lexsort((abs(X[:, 1]), -X[:, 0].round(9)))[0]] = np.diag([1e6, 0.0, 0.0])
    touching, problem = ContactUpdate(Problem(inflated).factor), Problem(inflated, contact=blocks)
    touching.to(problem.folded(blocks))
    x = problem.random()[0]
    expected = problem.factor.solve(x)
    np.testing.assert_allclose(touching.solve(x), expected, atol=1e-3 * abs(expected).max())


def test_the_transposed_inverse_is_the_adjoint(inflated: Inflated) -> None:
    """x . S y = S^T x . y of a contact that is not symmetric, both in one call."""
    problem = Problem(inflated)
    contact = problem.folded(road_blocks(inflated, 1e6, 0.1))
    touching = ContactUpdate(problem.factor)
    touching.to(csr_matrix(contact + 0.5 * triu(contact, 1)))
    x, y = problem.random()[0], np.roll(problem.random()[0], 1, axis=1)
    y, x = touching.solve(touching.solve(y)), touching.solve(x)  # of moderate stiffness
    Sy, Sx, Tx = touching.solve(np.stack([y, x, x]), [False, False, True])
    assert (x * Sy).sum() == pytest.approx((Tx * y).sum(), rel=1e-4)
    assert abs(Tx - Sx).max() > 1e-4 * abs(Sx).max()


@pytest.mark.slow
def test_releases_what_the_factor_holds(inflated: Inflated) -> None:
    """Nodes on one side let go, others left: to the same inverse as the factor without them."""
    before = road_blocks(inflated, 1e6, 0.1)
    after = before.copy()
    after[2:] = 0.0
    touching = ContactUpdate(Problem(inflated, contact=before).factor)
    problem = Problem(inflated, contact=after)
    touching.to(problem.folded(after))
    x = problem.random()[0]
    expected = problem.factor.solve(x)
    # what the factor drops where the parts are eliminated singly, it no longer drops
    np.testing.assert_allclose(touching.solve(x), expected, atol=2e-2 * abs(expected).max())


def test_friction_is_not_symmetric(inflated: Inflated) -> None:
    """Traction that grows with the pressure: solved at once, where the symmetric part is not."""
    normal = road_blocks(inflated, 1e6, 0.0)
    whole = normal.copy()
    whole[..., 1, 0] += 0.5 * normal[..., 0, 0]
    whole[0, :, 1] = 0.0
    problem = Problem(inflated, contact=normal)
    touching = ContactUpdate(problem.factor)
    problem.contact = whole
    x = problem.random()[0]
    image = problem.product(x)
    error = {}
    for name, blocks in (("symmetric", normal), ("whole", whole)):
        touching.to(problem.folded(blocks))
        error[name] = np.linalg.norm(touching.solve(image) - x) / np.linalg.norm(x)
    assert error["whole"] < 0.3 * error["symmetric"]


@pytest.mark.slow
def test_places_are_formed_once(inflated: Inflated) -> None:
    """Columns for the same nodes again cost nothing, and stay in place for more nodes."""
    blocks = road_blocks(inflated, 1e6, 0.1)
    some = blocks.copy()
    some[1:] = 0.0
    problem = Problem(inflated)
    all_, few = problem.folded(blocks), problem.folded(some)
    touching, x = ContactUpdate(problem.factor), problem.random()[0]
    touching.to(few)
    first = touching.solve(x)
    touching.to(all_)
    assert not np.allclose(touching.solve(x), first, atol=1e-3 * abs(first).max())
    touching.to(few)
    np.testing.assert_array_equal(touching.solve(x), first)
    fresh = ContactUpdate(Problem(inflated).factor)
    fresh.to(all_)
    touching.to(all_)
    expected = fresh.solve(x)
    assert touching.solve(x) == pytest.approx(expected, abs=1e-4 * abs(expected).max())


def test_takes_what_the_factor_left_out_of_the_contact() -> None:
    """The update adds what couples the two parts of the factor. Without cords the factor
    separates fields that keep the mirror from those that reverse it; a road under one side
    couples them. The inverse is right to single precision."""
    work = ring((0.2, 0.21, 0.23), 0.02, 2, support.Rubber(), 2e3)
    plain = Inflated(None, work.model, ~work.free, work.loads, work.U)  # type: ignore[arg-type]
    X = work.model.mesh.X
    blocks = np.zeros((2 * len(LENGTHS) + 1, len(X), 3, 3))
    blocks[1:4, (X[:, 0] > 0.2299) & (X[:, 1] > 0.001)] = 1e7 * np.diag([1.0, 0.1, 0.1])
    problem = Problem(plain, contact=blocks)
    touching = ContactUpdate(problem.factor)
    touching.to(problem.folded(blocks))
    x = problem.random()[0]
    back = touching.solve(problem.product(x))
    np.testing.assert_allclose(back, x, atol=1e-2 * abs(x).max())
    assert abs(problem.factor.solve(problem.product(x)) - x).max() > 0.1 * abs(x).max()


def test_changes_of_less_than_a_thousandth_are_left_out() -> None:
    """Changes below a thousandth of the stiffest contact's stiffness are left out; the solution is
    then the factor's."""
    work = ring((0.2, 0.21, 0.23), 0.02, 2, support.Rubber(), 2e3)
    plain = Inflated(None, work.model, ~work.free, work.loads, work.U)  # type: ignore[arg-type]
    blocks = np.zeros((2 * len(LENGTHS) + 1, len(work.U), 3, 3))
    blocks[1:4, work.model.mesh.X[:, 0] > 0.2299] = 1e7 * np.diag([1.0, 0.1, 0.1])
    problem = Problem(plain, contact=blocks)
    touching, x = ContactUpdate(problem.factor), problem.random()[0]
    was = problem.factor.solve(x)
    np.testing.assert_array_equal(touching.solve(x), was)
    for more, same in ((1 + 0.9e-3, True), (1 + 1.1e-3, False)):
        touching.to(problem.folded(more * blocks))
        assert np.array_equal(touching.solve(x), was) == same
