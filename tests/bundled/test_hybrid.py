"""Elements with a pressure of their own: consistency, closed forms, half the section."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck, Tangent
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.results import StepResult
from tyrecal_solvers.bundled.section import inflation, mechanics
from tyrecal_solvers.bundled.section.band import Cholesky
from tyrecal_solvers.bundled.section.laws.hyperelastic import Hyperelastic
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.hybrid import Hybrid
from tyrecal_solvers.bundled.section.parts.part import ModeShapes, TyrePart
from tyrecal_solvers.bundled.section.shapes import TYPES
from tyrecal_solvers.language.text import DeckError

from ..effects.support import CASE, decks
from . import support

Array = np.ndarray
C10 = 1e6
POISSON = 0.4999
PROJECTED = [kind for kind, each in TYPES.items() if each.pressures and each.points > 1]


@dataclass(frozen=True)
class Cells:
    """Elements of one type between two radii and two heights."""

    kind: str
    X: Array
    rows: Array

    def model(self, D1: float, inner: float | None = None) -> Model:
        """Model of neo-Hookean rubber; ``inner``: the radius of the surface CAVITY."""
        out = ["*NODE, NSET=ALL"]
        out += [f"{i}, {r!r}, {z!r}" for i, (r, z) in enumerate(self.X.tolist(), 1)]
        out += [f"*ELEMENT, TYPE={self.kind}, ELSET=RUBBER"]
        out += [", ".join(map(str, (e, *(row + 1)))) for e, row in enumerate(self.rows, 1)]
        if inner is not None:
            at = abs(self.X[:, 0] - inner) < 1e-9
            out += ["*SURFACE, NAME=CAVITY"]
            for e, row in enumerate(self.rows, 1):
                faces = enumerate(TYPES[self.kind].faces, 1)
                out += [f"{e}, S{f}" for f, own in faces if at[row[list(own)]].all()]
        out += ["*SOLID SECTION, ELSET=RUBBER, MATERIAL=GUM", "*MATERIAL, NAME=GUM"]
        out += ["*HYPERELASTIC, NEO HOOKE", f"{C10!r}, {D1!r}", "*DENSITY", "1100."]
        return support.model_of("\n".join(out) + "\n")


def cells(kind: str, r: tuple[float, float, int], z: tuple[float, float, int]) -> Cells:
    """Quadrilaterals, or two triangles in the place of each."""
    b, nodes = support.block(r, z, True), TYPES[kind].nodes
    X, corner, middle = b.X, b.solids[:, :4], b.solids[:, 4:]
    if nodes == 6:
        own = len(X) + np.arange(len(corner))[:, None]  # on the diagonal
        X = np.concatenate([X, X[corner].mean(1)])
        low = np.hstack([corner[:, [0, 1, 2]], middle[:, [0, 1]], own])
        rows = np.concatenate([low, np.hstack([corner[:, [0, 2, 3]], own, middle[:, [2, 3]]])])
    elif nodes == 3:
        rows = np.concatenate([corner[:, [0, 1, 2]], corner[:, [0, 2, 3]]])
    else:
        rows = b.solids[:, :nodes]
    used, place = np.unique(rows, return_inverse=True)
    return Cells(kind, X[used], place.reshape(rows.shape))


@pytest.fixture(params=PROJECTED)
def bent(request: pytest.FixtureRequest, random: np.random.Generator) -> tuple[Hybrid, Array]:
    """Distorted elements in a state with strains of some 10 %."""
    own = cells(request.param, (0.2, 0.26, 2), (0.0, 0.05, 2))
    X = own.X + 1e-3 * random.uniform(-1, 1, own.X.shape)
    (part,) = replace(own, X=X).model(2e-8).parts
    assert isinstance(part, Hybrid)
    return part, 2e-3 * random.uniform(-1, 1, (len(X), 3))


def test_the_projection(bent: tuple[Hybrid, Array]) -> None:
    """Pi Pi = Pi, of as many terms as the pressure has, w Pi symmetric, and Pi 1 = 1."""
    P, w = bent[0].projection, bent[0].rows.weights
    np.testing.assert_allclose(P @ P, P, atol=1e-12)
    np.testing.assert_allclose(P.sum(2), 1.0, rtol=1e-12)
    weighted = w[..., None] * P
    np.testing.assert_allclose(weighted, weighted.swapaxes(1, 2), atol=1e-12 * w.max())
    nodes, points = bent[0].connectivity.shape[1], w.shape[1]
    terms = 3 if nodes == 8 else 1
    np.testing.assert_allclose(np.trace(P, axis1=1, axis2=2), terms, rtol=1e-12)
    assert points > terms


def test_force_and_stiffness_are_derivatives(bent: tuple[Hybrid, Array]) -> None:
    """Derivatives of the energy by complex step, in the section; at a vibration's moduli at rest,
    those of such rubber."""
    part, U = bent
    force, K0, _ = part.force(U), *part.tangents(U, False)[:2]
    for b in range(part.connectivity.shape[1]):
        for i in range(3):
            step = U + 0j
            node = part.connectivity[0, b]
            step[node, i] += 1e-30j
            total = np.zeros(U.shape)
            np.add.at(total, part.connectivity, force.reshape(*part.connectivity.shape, 3))
            assert part.energy(step).imag / 1e-30 == pytest.approx(
                total[node, i], rel=1e-9, abs=1e-12 * abs(force).max()
            )
            got = part.force(step)[0].imag / 1e-30
            np.testing.assert_allclose(got, K0[0, :, 3 * b + i], atol=1e-11 * abs(K0).max())
    law = part.law
    assert isinstance(law, Hyperelastic)
    points = part.rows.weights.size
    moving = replace(law, shear_ratio=np.full(points, 1.4), bulk_ratio=np.full(points, 1.1))
    for own, its in zip(
        replace(part, law=moving).tangents(0 * U, True),
        replace(part, law=law.scaled(1.4, 1.1)).tangents(0 * U, True),
        strict=True,
    ):
        np.testing.assert_allclose(own, its, atol=1e-11 * abs(K0).max())


def test_a_law_of_frequency(bent: tuple[Hybrid, Array]) -> None:
    """K at another shear modulus is K and its growth, about a state that is strained."""
    part, U = bent
    law, points = part.law, part.rows.weights.size
    assert isinstance(law, Hyperelastic)
    tabled = replace(part, law=replace(law, table=np.zeros(points, int)))
    grown = tabled.frequency_dependent_part(0)
    assert grown is not None and tabled.frequency_dependent_part(1) is not None
    stiff = replace(law, shear_ratio=np.full(points, 1.4), bulk_ratio=np.ones(points))
    whole = replace(part, law=stiff).tangents(U, True)
    for K, one, more in zip(whole, part.tangents(U, True), grown.tangents(U, True), strict=True):
        np.testing.assert_allclose(K, one + 0.4 * more, atol=1e-10 * abs(whole[0]).max())
    other = tabled.frequency_dependent_part(1)
    assert other is not None and not np.any(other.tangents(U, False)[0])


def test_at_stations_as_in_the_section(bent: tuple[Hybrid, Array]) -> None:
    """Force and tangents of a state that is the same all round; K1 is the station's less its
    transpose; products with fields are derivatives of the force, the tangents those of products;
    energies are the section's."""
    part, U = bent
    n = len(U)
    at = part.at_stations(n)
    u, still = np.repeat(U.reshape(-1, 1), 2, 1), np.zeros((3 * n, 2))
    by_u, _ = at.force(u, still)
    np.testing.assert_allclose(by_u[..., 1], part.force(U), atol=1e-10 * abs(by_u).max())
    np.testing.assert_allclose(at.energy(), part.energy(U), rtol=1e-12)
    K0, K1, K2 = part.tangents(U, True)
    S0, S1, S2 = (each[1] for each in at.tangents(np.float64))
    for own, its in ((K0, S0), (K1, S1 - S1.swapaxes(1, 2)), (K2, S2)):
        np.testing.assert_allclose(own, its, atol=1e-10 * abs(K0).max())
    v = np.stack([np.sin(1.0 + np.arange(3 * n)), np.cos(np.arange(3 * n))], 1)
    twist = 1e-3 * v[:, ::-1]
    at.force(u, twist)
    got, energy = at.product(v, -v), at.energy
    tangents = at.tangents(np.float64)
    up, down = (at.force(u + h * v, twist - h * v) for h in (1e-6, -1e-6))
    for mine, a, b in zip(got, up, down, strict=True):
        np.testing.assert_allclose(mine, (a - b) / 2e-6, atol=1e-6 * abs(mine).max())
    own = v[at.dofs]  # (e, 3a, s)
    by_u = np.einsum("seij,ejs->eis", tangents[0], own) - np.einsum(
        "seij,ejs->eis", tangents[1], own
    )
    np.testing.assert_allclose(got[0], by_u, atol=1e-10 * abs(by_u).max())
    forces, h = [at.force(u, twist)], 1e-6
    values = []
    for sign in (1, -1):
        at.force(u + sign * h * v, twist)
        values.append(energy())
    work = (forces[0][0] * own).sum((0, 1))
    np.testing.assert_allclose((values[0] - values[1]) / (2 * h), work, rtol=1e-6)


def test_forms_of_modes(bent: tuple[Hybrid, Array], random: np.random.Generator) -> None:
    """phi^H K phi without the matrices."""
    part, U = bent
    shapes = random.normal(size=(3, *U.shape)) + 1j * random.normal(size=(3, *U.shape))
    fields = ModeShapes(np.array([0, 1, 3]), shapes)
    np.testing.assert_allclose(part.form(U, fields), TyrePart.form(part, U, fields), rtol=1e-10)


def lame(kind: str, elements: int) -> float:
    """Relative error of the bore's growth of a thick tube, small strains, plane strain: u = p a^2 /
    (2 G (b^2 - a^2)) ((1 - 2 nu) a + b^2 / a) (Lame, 1852)."""
    a, b, p, G = 0.1, 0.2, 1.0, 2 * C10
    D1 = 3 * (1 - 2 * POISSON) / (G * (1 + POISSON))
    own = cells(kind, (a, b, elements), (0.0, 0.1, elements))
    m = own.model(D1, a)
    held = support.held(m, [], True)
    held[:, 1] = True
    number, rest = support.numbering(m, held), np.zeros((len(own.X), 3))
    K = number.assemble(mechanics.tangents(m, rest, [], False)[0])
    force = mechanics.residual(m, rest, support.cavity(m, p), number)
    u = number.spread(-Cholesky(K).solve(force))[abs(own.X[:, 0] - a) < 1e-9, 0].mean()
    exact = p * a**2 / (2 * G * (b**2 - a**2)) * ((1 - 2 * POISSON) * a + b**2 / a)
    return float(u / exact - 1)


@pytest.mark.parametrize(("kind", "order"), [("CGAX8H", 4), ("CGAX4H", 2), ("CGAX6H", 3)])
def test_order_on_a_nearly_incompressible_tube(kind: str, order: int) -> None:
    """Poisson's ratio 0.4999. Twice the order of the strain energy's norm: 4, 2 and, with one
    pressure in a six-node triangle, 3. Four elements across are within 0.5 %."""
    errors = [lame(kind, n) for n in (4, 8, 16)]
    assert (support.order(errors) > order - 0.1).all()
    assert abs(errors[0]) < 5e-3


@pytest.mark.parametrize("kind", ["CGAX8RH", "CGAX8R", "CGAX4RH", "CGAX4R"])
def test_reduced_elements_are_exact_on_a_tube(kind: str) -> None:
    """Displacements of nodes are exact to round-off, which the bulk modulus multiplies."""
    assert abs(lame(kind, 2)) < 1e-8


def test_what_would_lock_does() -> None:
    """Full integration of the volume: the closed form is a sharp one."""
    assert lame("CGAX8", 2) < -0.5 and lame("CGAX3", 4) < -0.2


def grown(kind: str, elements: int) -> float:
    """Relative error of the growth by 15 % of an incompressible tube's bore, its pressure 2 C10
    (ln(b/a) - ln(b'/a') - k/2 (1/b'^2 - 1/a'^2)), k = a'^2 - a^2 (Rivlin, 1949)."""
    a, b = 0.1, 0.15

    def pressure(bore: float) -> float:
        k = bore**2 - a**2
        outside = np.sqrt(b**2 + k)
        curved = k / 2 * (outside**-2 - bore**-2)
        return float(2 * C10 * (np.log(b / a) - np.log(outside / bore) - curved))

    own = cells(kind, (a, b, elements), (0.0, 0.05 / elements, 1))
    m = own.model(0.0, a)
    held = support.held(m, [], True)
    held[:, 1] = True
    p = pressure(1.15 * a)
    U = support.inflate(m, held, support.cavity(m, p))
    displacement = U[abs(own.X[:, 0] - a) < 1e-9, 0].mean()
    assert brentq(lambda x: pressure(x) - p, a, 1.3 * a) == pytest.approx(1.15 * a)
    return float(displacement / (0.15 * a) - 1)


@pytest.mark.parametrize(
    ("kind", "elements", "bound"),
    [
        ("CGAX8H", 2, 1e-3),
        ("CGAX8RH", 2, 1e-3),
        ("CGAX6H", 2, 1e-3),
        ("CGAX4H", 4, 5e-3),
        ("CGAX4RH", 2, 5e-3),
        ("CGAX3H", 4, 5e-3),
    ],
)
def test_incompressible_tube(kind: str, elements: int, bound: float) -> None:
    """Within 0.5 %, 0.06 % of which is the bulk modulus that stands for none."""
    assert abs(grown(kind, elements)) < bound


def moment(kind: str, across: int, D1: float) -> float:
    """Relative error of the bending moment of a strip five times as long as thick, bent by a radian
    into a sector, free on both faces: r^2 = 2 A x + B, theta = z / A, r1 r2 = A^2 (Rivlin, 1949;
    Ogden, Non-Linear Elastic Deformations, ch. 5.2.4). Its ends are given that shape."""
    t, length, angle, R = 0.01, 0.05, 1.0, 1e4
    own = cells(kind, (R - t / 2, R + t / 2, across), (-length / 2, length / 2, 5 * across))
    m, A = own.model(D1), length / angle
    outer = np.sqrt(A * t + np.sqrt(A**2 * t**2 + A**4))
    inner = A**2 / outer
    x, z = own.X[:, 0] - R, own.X[:, 1]
    r = np.sqrt(2 * A * x + (inner**2 + outer**2) / 2)
    U = np.stack([r * np.cos(z / A) - A - x, 0 * x, r * np.sin(z / A) - z], 1)
    free = np.repeat((abs(abs(z) - length / 2) > 1e-9)[:, None], 3, 1)
    free[:, 1] = False
    rows = np.flatnonzero(free)
    for _ in range(8):
        parts = mechanics.tangents(m, U, [], False)[0]
        K = support.sparse(parts, len(U))[rows][:, rows]
        U.reshape(-1)[rows] -= spsolve(K.tocsc(), mechanics.gradient(m, U, []).reshape(-1)[rows])
    force, top = mechanics.gradient(m, U, []), abs(z - length / 2) < 1e-9
    across_axis, along_axis = (x + A + U[:, 0])[top], (z + U[:, 2])[top]
    torque = (across_axis * force[top, 2] - along_axis * force[top, 0]).sum() / R
    # M = int s_theta r dr, s_theta = s_r + l W', s_r = W(l) - W(l1), W = C10 (l^2 + l^-2 - 2)
    q, w = np.polynomial.legendre.leggauss(20)
    place = (inner + outer) / 2 + (outer - inner) / 2 * q
    energy = lambda s: C10 * (s**2 + s**-2 - 2)
    s = place / A
    hoop = energy(s) - energy(inner / A) + C10 * 2 * (s**2 - s**-2)
    return float(torque / ((hoop * place) @ w * (outer - inner) / 2) - 1)


@pytest.mark.parametrize(
    ("kind", "across", "D1", "bound"),
    [
        ("CGAX8H", 1, 0.0, 5e-3),
        ("CGAX8RH", 1, 0.0, 5e-3),
        ("CGAX8RH", 2, 0.0, 5e-4),
        ("CGAX8R", 2, 1e-9, 1e-3),
        pytest.param("CGAX4H", 10, 0.0, 5.5e-3, marks=pytest.mark.slow),
        pytest.param("CGAX4RH", 10, 0.0, 5.5e-3, marks=pytest.mark.slow),
        pytest.param("CGAX6H", 8, 0.0, 5e-3, marks=pytest.mark.slow),
    ],
)
def test_incompressible_strip_bent_by_a_radian(
    kind: str, across: int, D1: float, bound: float
) -> None:
    """Four-node elements need ten across, as they do where rubber is soft: it is bending that they
    do not hold, at second order."""
    assert abs(moment(kind, across, D1)) < bound


def tyre(kind: str, D1: str) -> dict[str, str]:
    """The coarse tyre of other elements."""
    own = decks(CASE)
    text = own["inflate.inp"].replace("TYPE=CGAX8R", f"TYPE={kind}").replace("5.085e-08", D1)
    return {"inflate": text, "modes": own["modes.inp"]}


def run(pair: dict[str, str], **request: object) -> StepResult:
    whole_request = Request(harmonics=[0, 1, 2], modes_per_harmonic=2, **request)  # type: ignore[arg-type]
    return Job(Deck(pair, "modes", "inflate"), whole_request).run()[-1]


@pytest.mark.parametrize(("kind", "D1"), [("CGAX8H", "5.085e-08"), ("CGAX8RH", "0")])
def test_half_the_section_is_the_whole(kind: str, D1: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """States, modes, and slopes by C10, which are those of differences."""
    monkeypatch.setattr(lanczos, "INVERSE_RTOL", 1e-12)  # slopes are as good as shapes
    pair = tyre(kind, D1)
    lines = pair["inflate"].splitlines()
    place = next(i for i, line in enumerate(lines) if line == f"1000000, 0, {D1}")
    tangents: dict[str, list[Tangent]] = {"C10": [("inflate", place + 1, 0, 1e6)]}
    half = run(pair, sensitivities=tangents)
    with monkeypatch.context() as patch:
        patch.setattr(jobs, "keeps_half_turn", lambda *_: False)
        whole = run(pair, sensitivities=tangents)
    np.testing.assert_allclose(half.U, whole.U, atol=1e-9 * abs(whole.U).max())
    values = [np.concatenate([m.eigenvalues for m in each.modes]) for each in (half, whole)]
    np.testing.assert_allclose(*values, rtol=1e-7)
    slopes = [np.concatenate(each.rates["C10"]) for each in (half, whole)]
    np.testing.assert_allclose(*slopes, atol=1e-6 * abs(slopes[1]).max())
    moved = []
    for h in (-0.02, -0.01, 0.01, 0.02):  # far apart: Newton's method ends at 1e-9 of the force
        lines[place] = f"{1e6 * (1 + h)!r}, 0, {D1}"
        result = run({**pair, "inflate": "\n".join(lines) + "\n"})
        moved.append(np.concatenate([m.eigenvalues for m in result.modes]))
    wanted = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / 0.12
    np.testing.assert_allclose(slopes[0], wanted, atol=1e-5 * abs(wanted).max())


def test_triangles_among_quadrilaterals_on_half_the_section(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """CGAX4H, and in each sidewall two cut along diagonals that are mirror images: the whole's."""
    case = CASE.case
    mesh = case.mesh.model_copy(update={"element": "CGAX4R"})
    own = decks(replace(CASE, case=case.model_copy(update={"mesh": mesh})))
    text, triangles = own["inflate.inp"].replace("TYPE=CGAX4R", "TYPE=CGAX4H"), []
    for number, other in ((3002, False), (3003, False), (18002, True), (18003, True)):
        a, b, c, d = number, number + 1, number + 1001, number + 1000
        row = f"\n{number}, {a}, {b}, {c}, {d}\n"
        assert text.count(row) == 1
        text = text.replace(row, "\n")
        a, b, c, d = (b, c, d, a) if other else (a, b, c, d)
        triangles += [f"{number}, {a}, {b}, {c}", f"7{number}, {a}, {c}, {d}"]
    start = "*ELEMENT, TYPE=CGAX4H, ELSET=SOLID_1"
    rows = "\n".join(["*ELEMENT, TYPE=CGAX3H, ELSET=SOLID_1", *triangles, start])
    pair = {"inflate": text.replace(start, rows), "modes": own["modes.inp"]}
    quadrilaterals = {**pair, "inflate": own["inflate.inp"].replace("CGAX4R", "CGAX4H")}
    assert Job(Deck(pair, "modes", "inflate"), Request()).tyre.half
    half, plain = run(pair), run(quadrilaterals)
    monkeypatch.setattr(jobs, "keeps_half_turn", lambda *_: False)
    whole = run(pair)
    assert half.mass_kg == pytest.approx(plain.mass_kg, rel=1e-9)
    values = [np.concatenate([m.eigenvalues for m in each.modes]) for each in (half, whole, plain)]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-8)
    np.testing.assert_allclose(values[0], values[2], rtol=0.1)
    assert abs(values[0] / values[2] - 1).max() > 1e-4


def test_the_way_to_incompressible_rubber_is_one_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """Softer bulk first, and full bulk at once, lead to the same state; the first needs fewer
    factorisations."""
    steps = []
    for ratio in (inflation.EASED, float("inf")):
        monkeypatch.setattr(inflation, "EASED", ratio)
        steps.append(run(tyre("CGAX8RH", "0")))
    np.testing.assert_allclose(steps[0].U, steps[1].U, atol=1e-8 * abs(steps[0].U).max())
    assert steps[0].factorisations < steps[1].factorisations


def test_incompressible_rubber_needs_hybrid_elements() -> None:
    with pytest.raises(DeckError, match="CGAX8R would lock, CGAX8RH does not"):
        run(tyre("CGAX8R", "0"))


def test_incompressible_rubber_starts_near_a_shape_at_full_bulk() -> None:
    """A start from its own shape needs no step, a start from the shape of softer rubber a few."""
    pair = tyre("CGAX8RH", "0")
    shapes = []
    for C in ("1000000", "900000"):
        text = pair["inflate"].replace("1000000, 0, 0", f"{C}, 0, 0")
        job = Job(Deck({**pair, "inflate": text}, "modes", "inflate"), Request())
        job._static(job.steps[0])
        index = job.model.mesh.index
        shapes.append(np.column_stack([sorted(index, key=index.__getitem__), job.tyre.U]))
    for shape, most in zip(shapes, (0, 5), strict=True):
        job = Job(Deck(pair, "modes", "inflate"), Request(), start=shape)
        job._static(job.steps[0])
        assert job.factorisations <= most
        np.testing.assert_allclose(job.tyre.U, shapes[0][:, 1:], atol=1e-8)
