"""Enclosed volume of the pressure surface and its variations."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.section import elements, mechanics
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts import pressure
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.language.text import DeckError

from . import support

Array = np.ndarray
ANGLES = np.arange(24) * 2 * np.pi / 24


def arc(elements: int, nodes: int) -> tuple[Array, Array]:
    """Nodes (n, 2) and lines of an open, asymmetric arc in the section."""
    count = (nodes - 1) * elements + 1
    t = np.linspace(0.4, 4.9, count)
    X = np.stack([0.3 + 0.06 * np.cos(t), 0.08 * np.sin(t) + 0.01 * t], -1)
    return X, np.arange(nodes) + (nodes - 1) * np.arange(elements)[:, None]


def revolved_volume(X: Array, lines: elements.Lines, fields: list[tuple[int, Array]]) -> float:
    """1/2 of the flux of (x, y, 0) through the surface, in Cartesian components, for
    u = sum of Re[U exp(i n Theta)]: independent of the solver's frame and formulas."""
    total = 0.0
    for angle in ANGLES:
        c, s = np.cos(angle), np.sin(angle)
        Q, dQ = (
            np.array([[a, -b, 0], [b, a, 0], [0, 0, d]]) for a, b, d in ((c, s, 1), (-s, c, 0))
        )
        wave = [(U, np.exp(1j * n * angle), n) for n, U in fields]
        local = np.insert(X, 1, 0.0, 1) + sum((U * w).real for U, w, _ in wave)
        turn = sum((1j * n * U * w).real for U, w, n in wave)
        x = local @ Q.T
        by_angle = local @ dQ.T + turn @ Q.T
        at = lambda v: np.einsum("ga,eai->egi", lines.N, v[lines.connectivity])
        slope = np.einsum("ega,eai->egi", lines.slope, x[lines.connectivity])
        flux = (at(x) * [1, 1, 0] * np.cross(slope, at(by_angle))).sum(-1) / 2
        total += (flux * lines.weights).sum() * 2 * np.pi / len(ANGLES)
    return total


def test_volume_of_a_torus() -> None:
    """V = 2 pi^2 R a^2 (Pappus). The trapezoidal rule is exact for a trigonometric integrand."""
    R, a, m = 0.3, 0.08, 16
    t = np.arange(m) * 2 * np.pi / m
    x = np.stack([R + a * np.cos(t), 0 * t, a * np.sin(t)], -1)
    slope = np.stack([-a * np.sin(t), 0 * t, a * np.cos(t)], -1)
    V = pressure.volume(x, -slope, np.full(m, 2 * np.pi / m))
    np.testing.assert_allclose(V, np.pi * R * a**2, rtol=1e-13)


def test_volume_of_a_cylinder_and_a_cone() -> None:
    """V = pi r^2 L and pi L (r^2 + r s + s^2) / 3; 2 pi of the solver's volume per radian."""
    for r, s in ((0.3, 0.3), (0.2, 0.35)):
        lines = elements.lines(np.array([[s, 0.5], [r, 0.0]]), np.array([[0, 1]]))
        x = np.einsum("ga,ai->gi", lines.N, [[s, 0, 0.5], [r, 0, 0.0]])
        dx = np.einsum("ga,ai->gi", lines.slope[0], [[s, 0, 0.5], [r, 0, 0.0]])
        V = 2 * np.pi * pressure.volume(x, dx, lines.weights[0])
        wanted = np.pi * 0.5 * (r * r + r * s + s * s) / 3
        np.testing.assert_allclose(V, wanted, rtol=1e-13)


def test_first_variation(random: np.random.Generator) -> None:
    """Gradients of the integrand of V by x and x' = those by complex step."""
    x, dx = random.normal(size=(2, 6, 3))
    one, h = np.ones(1), 1e-30
    by_x, by_dx = pressure.first(x, dx)
    for g in range(6):
        for i in range(3):
            step = 1j * h * np.eye(3)[i]
            V = pressure.volume(x[g : g + 1] + step, dx[g : g + 1], one)
            assert V.imag / h == pytest.approx(by_x[g, i], rel=1e-13, abs=1e-15)
            V = pressure.volume(x[g : g + 1], dx[g : g + 1] + step, one)
            assert V.imag / h == pytest.approx(by_dx[g, i], rel=1e-13, abs=1e-15)


@pytest.mark.parametrize("nodes", [2, 3])
@pytest.mark.parametrize("n", range(5))
def test_second_variation(n: int, nodes: int, random: np.random.Generator) -> None:
    """d2/de2 of the three-dimensional volume of U0 + e phi = pi phi^H K(n) phi (2 pi for n = 0)
    at p = -1, about a deformed and twisted state, with free open ends. V is cubic in u, so the
    central second difference is exact. K(n) is Hermitian."""
    X, table = arc(5, nodes)
    lines = elements.lines(X, table, 3)
    U0 = 0.02 * random.normal(size=(len(X), 3))
    phi = random.normal(size=(2, len(X), 3)).T @ [1, 1j if n else 0]
    phi = 0.1 * phi.T
    V = [revolved_volume(X, lines, [(0, U0), (n, e * phi)]) for e in (1.0, 0.0, -1.0)]
    wanted = V[0] - 2 * V[1] + V[2]
    model = Model(SimpleNamespace(X=X), [])
    K0, K1, K2 = support.matrices(model, U0, [Pressure(lines, -1.0)])
    K = K0 + 1j * n * K1 + n * n * K2
    assert abs(K - K.conj().T).max() <= 1e-13 * abs(K).max()
    form = np.pi * (1 if n else 2) * (phi.ravel().conj() @ K @ phi.ravel())
    assert form.real == pytest.approx(wanted, rel=1e-10)


def test_pressure_force_is_minus_p_times_the_first_variation(random: np.random.Generator) -> None:
    """r = -p dV/du, against a central difference of the three-dimensional volume."""
    X, table = arc(5, 3)
    lines = elements.lines(X, table, 3)
    U0, phi = 0.02 * random.normal(size=(2, len(X), 3))
    model = Model(SimpleNamespace(X=X), [])
    e = 1e-4
    V = [revolved_volume(X, lines, [(0, U0 + s * e * phi)]) for s in (2, 1, -1, -2)]
    slope = (8 * (V[1] - V[2]) - V[0] + V[3]) / (12 * e)  # exact for a cubic
    number = mechanics.Numbering([table], np.ones((len(X), 3), bool))
    force = number.spread(mechanics.residual(model, U0, [Pressure(lines, 7.0)], number))
    assert (force * phi).sum() * 2 * np.pi == pytest.approx(-7.0 * slope, rel=1e-10)


def test_the_force_of_an_open_surface_is_the_followers_and_a_caps_thrust(
    random: np.random.Generator,
) -> None:
    """p n dA, in components, and along the axle p r^2 / 2 per radian at the ends, out of the one
    and into the other: nothing where they are held along the axle, as ABAQUS's P has it."""
    X, table = arc(5, 3)
    lines = elements.lines(X, table, 3)
    U = 0.02 * random.normal(size=(len(X), 3))
    x, dx = pressure.surface_point(lines, U)
    normal = np.cross(dx, np.stack([-x[..., 1], x[..., 0], 0 * x[..., 0]], -1))
    follower = np.zeros_like(U)
    of_nodes = np.einsum("ga,eg,egi->eai", lines.N, lines.weights, normal)
    np.add.at(follower, table, -7.0 * of_nodes)
    force = np.zeros_like(U)
    np.add.at(force, table, Pressure(lines, 7.0).force(U).reshape(*table.shape, 3))
    for end, sign in ((table[-1, -1], 1), (table[0, 0], -1)):
        r = np.hypot(X[end, 0] + U[end, 0], U[end, 1])
        follower[end, 2] += sign * 7.0 * r**2 / 2
    np.testing.assert_allclose(force, follower, atol=1e-12 * abs(force).max())


TUBE = support.block((0.30, 0.31, 1), (0.0, 0.1, 3), True)


def tube(*held: str, surface: str = "", cap: float = 0.0) -> Job:
    """A rubber tube under 100 Pa on its inside, with sets LOW and HIGH of its ends' nodes."""
    text = support.deck(TUBE.X, TUBE.solids, support.Rubber(), inner=TUBE.inner)
    for name, z in (("LOW", 0.0), ("HIGH", 0.1)):
        own = ", ".join(map(str, np.flatnonzero(TUBE.where(1, z)) + 1))
        text += f"*NSET, NSET={name}\n{own}\n"
    rows = "\n".join(("LOW, 5", *held))
    text += f"{surface}*STEP, NLGEOM=YES\n*STATIC, LONG TERM\n1.0, 1.0\n*BOUNDARY\n{rows}\n"
    text += "*DSLOAD\nCAVITY, P, 100.0\n" + (f"LID, P, {cap!r}\n" if cap else "") + "*END STEP\n"
    return Job(Deck({"tube": text}, "tube", None), Request())


def test_an_end_that_is_free_along_the_axle_is_refused() -> None:
    """The refusal names the node, at the procedure's line. Held along the axle, the tube widens
    as Lame's does in plane strain."""
    inner = np.flatnonzero(TUBE.where(0, 0.30) & TUBE.where(1, 0.1))[0]
    with pytest.raises(DeckError, match=rf"line \d+.*node {inner + 1}, which is free along the"):
        tube("LOW, 2").run()
    with pytest.raises(DeckError, match="free along the axle"):
        tube("LOW, 2", "HIGH, 1").run()
    (result,) = tube("LOW, 2", "HIGH, 2").run()
    rubber, a, b = support.Rubber(), 0.30, 0.31
    G, K = rubber.shear, 2 / rubber.D1
    wanted = 100.0 * a**2 / (b**2 - a**2) * (a / (2 * (K + G / 3)) + b**2 / (2 * G * a))
    assert result.U[inner, 0] == pytest.approx(wanted, rel=2e-3)


def test_an_end_is_closed_by_a_surface_under_the_same_pressure() -> None:
    """A surface from end to end closes it, as a wheel's well does; one under another pressure
    does not."""
    low, high = (np.flatnonzero(TUBE.where(0, 0.30) & TUBE.where(1, z))[0] + 1 for z in (0.0, 0.1))
    lid = f"*ELEMENT, TYPE=SFMGAX1, ELSET=LID\n99, {high}, {low}\n*SURFACE, NAME=LID\nLID, SPOS\n"
    for text, cap in ((lid, 100.0), (lid.replace(f"{high}, {low}", f"{low}, {high}"), -100.0)):
        tube("LOW, 2", surface=text, cap=cap).run()
    for cap in (101.0, -100.0):
        with pytest.raises(DeckError, match="free along the axle"):
            tube("LOW, 2", surface=lid, cap=cap).run()
