"""Shape functions and Gauss rules, against the properties that define them."""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest
from tyrecal_solvers.bundled.section import shapes

Array = np.ndarray
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
