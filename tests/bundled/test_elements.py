"""Gradient operators of the section: patch tests, folding, hourglass vectors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tyrecal_solvers.bundled.section import elements
from tyrecal_solvers.bundled.section.parts.cords import cord_rows
from tyrecal_solvers.bundled.section.parts.part import on_diagonals
from tyrecal_solvers.bundled.section.shapes import TYPES, ElementType
from tyrecal_solvers.errors import Inverted

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
