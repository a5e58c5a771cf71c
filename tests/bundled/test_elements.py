"""Gradient operators of the section: patch tests, folding, hourglass vectors.

Masses and springs on nodes of the tyre: where they act, and what they weigh.
Shape functions and Gauss rules, against the properties that define them.
"""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest
from scipy.integrate import trapezoid
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.section import elements, shapes
from tyrecal_solvers.bundled.section.model import build
from tyrecal_solvers.bundled.section.parts.cords import cord_rows
from tyrecal_solvers.bundled.section.parts.part import on_diagonals
from tyrecal_solvers.bundled.section.point_elements import read_point_elements
from tyrecal_solvers.bundled.section.shapes import TYPES, ElementType
from tyrecal_solvers.errors import Inverted
from tyrecal_solvers.language.text import DeckError

from .support import MASS, PLAIN, texts

Array = np.ndarray


def element(nodes: int, points: int) -> ElementType:
    name = {3: "CGAX3", 4: "CGAX4R", 6: "CGAX6", 8: "CGAX8"}[nodes]
    return replace(TYPES[name], points=points)


ANGLES = np.arange(8) * 2 * np.pi / 8
HARMONICS = (0, 1, 2)
STATES = {
    "axial stretch (n = 0)": [[0, 0, 0], [0, 0, 0], [0, 0, 1]],
    "radial stretch (n = 0)": [[1, 0, 0], [0, 1, 0], [0, 0, 0]],
    "spin (n = 0)": [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
    "shear u_x = z (n = 1)": [[0, 0, 1], [0, 0, 0], [0, 0, 0]],
    "tilt (n = 1)": [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
    "plane shear (n = 2)": [[1, 0, 0], [0, -1, 0], [0, 0, 0]],
    "everything": [[0.3, -0.8, 0.5], [0.9, 0.1, -0.4], [-0.7, 0.6, 0.2]],
}
STATE = pytest.mark.parametrize("A", [np.array(a, float) for a in STATES.values()], ids=STATES)


def frame(angle: float) -> Array:
    """Columns e_r, e_theta, e_z in Cartesian components."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def harmonics_of(A: Array, shift: Array, X: Array) -> dict[int, Array]:
    """Amplitudes U (n, 3) per harmonic of the Cartesian field u = A x + shift, by Fourier sums."""
    samples = []
    for angle in ANGLES:
        Q = frame(angle)
        x = np.insert(X, 1, 0.0, 1) @ Q.T
        samples.append((x @ A.T + shift) @ Q)
    waves = {n: np.exp(-1j * n * ANGLES)[:, None, None] for n in HARMONICS}
    return {n: (2 if n else 1) * (np.array(samples) * wave).mean(0) for n, wave in waves.items()}


@pytest.fixture
def patch(random: np.random.Generator) -> tuple[Array, Array]:
    """Nodes and 3 x 3 distorted eight-node elements; the first four columns serve as Q4."""
    R, Z = np.linspace(0.2, 0.5, 7), np.linspace(-0.2, 0.1, 7)
    X = np.stack(np.meshgrid(R, Z, indexing="ij"), -1).reshape(-1, 2)
    X = X + 0.008 * random.uniform(-1, 1, (49, 2))
    number = np.arange(49).reshape(7, 7)
    steps = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    starts = [(i, j) for i in (0, 2, 4) for j in (0, 2, 4)]
    return X, np.array([[number[i + a, j + b] for a, b in steps] for i, j in starts])


@STATE
@pytest.mark.parametrize(("nodes", "points"), [(4, 1), (8, 2), (8, 3), (3, 1), (6, 3)])
def test_patch(A: Array, nodes: int, points: int, patch: tuple[Array, Array]) -> None:
    """u = A x + c in Cartesian components: sum over n of Re[(B0 + i n B1) U_n exp(i n Theta)] is
    Q^T A Q at every Gauss point and angle, exactly, on a distorted mesh with curved sides
    (patch test; isoparametric elements hold every linear field, Hughes ch. 3)."""
    X, table = patch
    if nodes in (3, 6):  # corners 1, 2, 3; the midside of the diagonal is the element's own
        middle = len(X) + np.arange(len(table))
        X = np.concatenate([X, X[table[:, [0, 2]]].mean(1)])
        table = np.column_stack([table[:, [0, 1, 2, 4, 5]], middle])
    s = elements.solids(X, table[:, :nodes], element(nodes, points))
    fields = harmonics_of(A, np.array([0.2, -0.1, 0.3]), X)
    for angle in (0.0, 0.7, 2.9):
        Q, H = frame(angle), 0.0
        for n, U in fields.items():
            u = U[s.connectivity].reshape(len(table), 1, -1, 1)
            part = (s.B0 @ u)[..., 0]
            part[..., 1::3] += 1j * n * (on_diagonals(s.hoop) @ u)[..., 0]
            H = H + (part * np.exp(1j * n * angle)).real
        wanted = (Q.T @ A @ Q).ravel()
        assert abs(H - wanted).max() <= 1e-12


@STATE
@pytest.mark.parametrize("nodes", [2, 3])
def test_cord_patch(A: Array, nodes: int, random: np.random.Generator) -> None:
    """The same fields along a curved line: b0 U + i n hoop U is Q^T A Q a for the cord's unit
    vector a, at 70 degrees from the meridian."""
    t = np.linspace(0, 1.2, 7)
    X = np.stack([0.3 + 0.05 * np.cos(t), 0.06 * np.sin(t)], -1)
    table = np.arange(nodes) + (nodes - 1) * np.arange(6 // (nodes - 1))[:, None]
    lines = elements.lines(X, table)
    angle = np.radians(70.0)
    rows = cord_rows(lines, np.cos(angle), np.sin(angle))
    a, b0, hoop = rows.rest, rows.B0, rows.hoop
    np.testing.assert_allclose((a * a).sum(-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(a[..., 1], np.sin(angle), rtol=1e-14)
    Theta = 0.7
    q = 0.0
    for n, U in harmonics_of(A, np.zeros(3), X).items():
        u = U[table]
        part = (b0 @ u.reshape(len(table), 1, -1, 1))[..., 0]
        part = part + 1j * n * np.einsum("ega,eai->egi", hoop, u)
        q = q + (part * np.exp(1j * n * Theta)).real
    Q = frame(Theta)
    assert abs(q - a @ (Q.T @ A @ Q).T).max() <= 1e-12


@pytest.mark.parametrize(("nodes", "points"), [(4, 2), (8, 2), (8, 3)])
def test_weights_add_up_to_the_volume(nodes: int, points: int) -> None:
    """sum of w det R = (b^2 - a^2) / 2 L: a ring's volume per radian (Pappus), for straight sides
    that are not parallel to the axes: R dA is cubic at most in each of xi, eta."""
    X = np.array([[0.2, 0.0], [0.5, 0.1], [0.6, 0.4], [0.3, 0.5]])
    X = np.concatenate([X, (X + np.roll(X, -1, 0)) / 2])[:nodes]
    s = elements.solids(X, np.arange(nodes)[None], element(nodes, points))
    r, z = X[:4].T
    r1, z1 = np.roll(r, -1), np.roll(z, -1)
    moment = ((r + r1) * (r * z1 - r1 * z)).sum() / 6  # of the polygon's area about the axis
    assert s.weights.sum() == pytest.approx(moment, rel=1e-13)
    assert s.mass_weights.sum() == pytest.approx(moment, rel=1e-13)


def test_hourglass_vectors(patch: tuple[Array, Array], random: np.random.Generator) -> None:
    """gamma . u = 0 for every u = a + b R + c Z, and not for the hourglass mode itself
    (Flanagan and Belytschko 1981, eq. 51)."""
    X, table = patch
    s = elements.solids(X, table[:, :4], element(4, 1))
    assert s.hourglass is not None
    linear = X @ random.normal(size=2) + 0.4
    size = abs(s.hourglass).max()
    assert abs((s.hourglass * linear[s.connectivity]).sum(1)).max() <= 1e-14 * size
    assert (abs(s.hourglass @ [1, -1, 1, -1]) > 0.5 * size).all()


def test_hourglass_scale() -> None:
    """The scale on a rectangle a x b at mean radius R is gamma . h = sqrt(R a b (1/a^2 + 1/b^2))
    for h = (1, -1, 1, -1), since sum |grad N|^2 = 1/a^2 + 1/b^2 at the centre."""
    a, b, R = 0.02, 0.05, 0.3
    X = np.array([R, 0.0]) + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [a / 2, b / 2]
    (gamma,) = elements.solids(X, np.arange(4)[None], element(4, 1)).hourglass
    wanted = np.sqrt(R * a * b * (1 / a**2 + 1 / b**2))
    assert gamma @ [1, -1, 1, -1] == pytest.approx(wanted, rel=1e-13)


@pytest.mark.parametrize("nodes", [4, 8])
def test_folded_element_is_named(nodes: int, patch: tuple[Array, Array]) -> None:
    """An element whose nodes run clockwise has det dX/dxi < 0; its index is reported."""
    X, table = patch
    table = table[:, :nodes].copy()
    table[5] = table[5][[0, 3, 2, 1, 7, 6, 5, 4][:nodes]]
    with pytest.raises(Inverted) as error:
        elements.solids(X, table, element(nodes, 2))
    assert error.value.element == 5


def test_masses_and_springs_stand_in_their_components() -> None:
    """A mass in all three; springs along 1, 2 and 3 radially, along the axle, round it; two on one
    node add up; the mean over a sector of one of 60."""
    pair = dict(texts(MASS))
    springs = (
        "*ELEMENT, TYPE=SPRING1, ELSET=K{0}\n99910001{0}, {1}\n*SPRING, ELSET=K{0}\n{0}\n{2}\n"
    )
    more = "".join(
        springs.format(i, n, k) for i, n, k in ((1, 21009, 1e3), (2, 21009, 2e3), (3, 19009, 3e3))
    )
    pair["modes"] = pair["modes"].replace("*STEP, NAME=EQ", more + "*STEP, NAME=EQ")
    deck = Deck(pair, "modes", "inflate")
    model = Job(deck, Request()).model
    _, revolve, _ = deck.read([])
    elements = read_point_elements(revolve, model.mesh)
    at = {
        (int(r), int(c)): (m, k)
        for r, c, m, k in zip(
            elements.rows, elements.components, elements.mass, elements.stiffness, strict=True
        )
    }
    one, other = model.mesh.index[21009], model.mesh.index[19009]
    assert at == {
        (one, 0): (0.1, 1e3),
        (one, 1): (0.1, 0.0),
        (one, 2): (0.1, 2e3),
        (other, 1): (0.0, 3e3),
    }
    assert elements.total_kg == pytest.approx(0.1) and elements.sectors == elements.highest == 60
    angle = np.linspace(-np.pi / 60, np.pi / 60, 2001)
    for n in (0, 1, 7):
        assert elements.share(n) == pytest.approx(np.mean(np.cos(n * angle)), rel=1e-3)
    for n in (0, 1):
        assert elements.share(n) == pytest.approx(trapezoid(np.cos(n * angle), angle) * 30 / np.pi)
    bad = springs.format(4, 21009, 1e3)
    pair["modes"] = pair["modes"].replace("*STEP, NAME=EQ", bad + "*STEP, NAME=EQ")
    _, revolve, _ = Deck(pair, "modes", "inflate").read([])
    with pytest.raises(DeckError, match="a spring acts along 1, 2 or 3, got 4"):
        read_point_elements(revolve, model.mesh)


def test_the_mass_is_the_sections_and_what_is_attached() -> None:
    """Volume by Pappus's rule times density, the plies' thickness being none, and 0.1 kg."""
    plain, more = (Job(Deck(texts(e), "modes", "inflate"), Request()) for e in (PLAIN, MASS))
    whole = build(Deck(texts(PLAIN), "modes", "inflate").read([])[0], None, True)
    rubber, cords = (part.mass.sum() for part in whole.parts)
    assert plain.mass_kg == pytest.approx(2 * np.pi * (rubber + cords), rel=1e-9)
    assert 10 < plain.mass_kg < 16
    assert more.mass_kg - plain.mass_kg == pytest.approx(0.1)


MIDSIDES = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
NODES = {4: shapes.CORNERS, 8: np.concatenate([shapes.CORNERS, MIDSIDES])}
LINES = {2: np.array([[-1.0], [1.0]]), 3: np.array([[-1.0], [0.0], [1.0]])}
# monomials x^i y^j that each element holds: serendipity lacks x^2 y^2 only
POWERS = {
    4: [(0, 0), (1, 0), (0, 1), (1, 1)],
    8: [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2)],
    2: [(0,), (1,)],
    3: [(0,), (1,), (2,)],
}
CASES = [(shapes.quad, n, NODES[n]) for n in NODES] + [(shapes.line, n, LINES[n]) for n in LINES]


def monomial(x: Array, powers: tuple[int, ...]) -> Array:
    return np.prod(x ** np.array(powers), -1)


def slope(x: Array, powers: tuple[int, ...]) -> Array:
    """Gradient of a monomial, (points, dim)."""
    parts = []
    for k, power in enumerate(powers):
        lower = tuple(p - (i == k) for i, p in enumerate(powers))
        parts.append(power * monomial(x, lower) if power else 0 * x[:, 0])
    return np.stack(parts, -1)


@pytest.mark.parametrize(("rule", "nodes", "places"), CASES)
def test_completeness(rule, nodes: int, places: Array) -> None:
    """sum_a N_a(x) q(x_a) = q(x) and sum_a dN_a(x) q(x_a) = grad q(x) for every monomial q of the
    element's space, partition of unity being q = 1 (Hughes, The Finite Element Method, ch. 3).
    As many monomials as nodes: they fix N and dN completely, the nodes' order included."""
    assert len(POWERS[nodes]) == nodes
    points = 4
    x, _ = shapes.gauss(points, places.shape[1])
    r = rule(nodes, points)
    for powers in POWERS[nodes]:
        q = monomial(places, powers)
        np.testing.assert_allclose(r.N @ q, monomial(x, powers), atol=1e-14)
        got = np.einsum("gak,a->gk", r.dN, q)
        np.testing.assert_allclose(got, slope(x, powers), atol=1e-14)


@pytest.mark.parametrize(("rule", "nodes", "places"), CASES)
def test_derivative_is_that_of_N(rule, nodes: int, places: Array, monkeypatch) -> None:
    """dN/dxi_k = (N(xi + h e_k) - N(xi - h e_k)) / 2h: N is quadratic at most in each xi_k, for
    which the central difference is exact."""
    dim, h = places.shape[1], 1e-2
    x, w = shapes.gauss(3, dim)

    def at(points: Array) -> Array:
        monkeypatch.setattr(shapes, "gauss", lambda *_: (points, w))
        return rule(nodes, 3).N

    expected = [(at(x + h * e) - at(x - h * e)) / (2 * h) for e in np.eye(dim)]
    monkeypatch.undo()
    np.testing.assert_allclose(rule(nodes, 3).dN, np.stack(expected, -1), atol=1e-12)


@pytest.mark.parametrize("dimension", [1, 2])
@pytest.mark.parametrize("points", [1, 2, 3])
def test_gauss_exactness(points: int, dimension: int) -> None:
    """m points integrate x^i exactly for i <= 2m - 1 on [-1, 1] and not for i = 2m."""
    x, w = shapes.gauss(points, dimension)
    exact = [(1 + (-1) ** i) / (i + 1) for i in range(2 * points + 1)]
    for i in range(2 * points):
        for j in range(2 * points) if dimension == 2 else [0]:
            powers = (i, j)[:dimension]
            wanted = np.prod([exact[p] for p in powers])
            assert w @ monomial(x, powers) == pytest.approx(wanted, abs=1e-14)
    assert abs(w @ x[:, 0] ** (2 * points) / 2 ** (dimension - 1) - exact[-1]) > 1e-2


TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
OF_TRIANGLE = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]  # i, j of x^i y^j


@pytest.mark.parametrize("nodes", [3, 6])
@pytest.mark.parametrize(("points", "degree"), [(1, 1), (3, 2), (7, 5)])
def test_triangles(nodes: int, points: int, degree: int) -> None:
    """N and dN hold every polynomial of the element's degree, which fixes both; the points have the
    integral i! j! / (i + j + 2)! of x^i y^j up to their degree, and no further."""
    r = shapes.triangle(nodes, points)
    x = r.N[:, :3] @ TRIANGLE[:3] if nodes == 3 else r.N @ TRIANGLE
    for powers in OF_TRIANGLE[:nodes]:
        q = monomial(TRIANGLE[:nodes], powers)
        np.testing.assert_allclose(r.N @ q, monomial(x, powers), atol=1e-14)
        got = np.einsum("gak,a->gk", r.dN, q)
        np.testing.assert_allclose(got, slope(x, powers), atol=1e-14)
    misses = []
    for i in range(degree + 2):
        for j in range(degree + 2 - i):
            exact = factorial(i) * factorial(j) / factorial(i + j + 2)
            error = abs(r.weights @ monomial(x, (i, j)) - exact)
            assert error < 1e-15 or i + j > degree
            misses += [error] if i + j == degree + 1 else []
    assert max(misses) > 1e-5


@pytest.mark.parametrize("kind", [k for k, each in shapes.TYPES.items() if each.faces])
def test_faces_of_every_solid(kind: str) -> None:
    """Face S_k of corners k and k + 1, its midside between them; as many faces as corners."""
    each = shapes.TYPES[kind]
    corners = len(each.faces)
    places = NODES[each.nodes] if corners == 4 else TRIANGLE[: each.nodes]
    for k, face in enumerate(each.faces):
        assert (face[0], face[-1]) == (k, (k + 1) % corners)
        if len(face) == 3:
            np.testing.assert_array_equal(2 * places[face[1]], places[face[0]] + places[face[2]])


def test_faces_run_along_the_edges() -> None:
    """Face S_k joins corners k and k + 1 (ABAQUS numbering), its midside between them."""
    for k, (first, middle, last) in enumerate(shapes.FACES_QUADRATIC):
        assert (first, last) == (k, (k + 1) % 4) == shapes.FACES_LINEAR[k]
        np.testing.assert_array_equal(2 * NODES[8][middle], NODES[8][first] + NODES[8][last])
