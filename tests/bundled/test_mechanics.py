"""Whole sections: rigid bodies, variations of energy and enclosed volume, mass, symmetry."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.section import elements, mechanics, shapes
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts import pressure
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.language.text import DeckError

from . import support
from .conftest import Inflated

Array = np.ndarray
ANGLES = np.arange(24) * 2 * np.pi / 24


RIGID: dict[str, tuple[int, Callable[[Array, Array], list[Array]]]] = {
    "axial shift": (0, lambda R, Z: [0 * R, 0 * R, 1 + 0 * R]),
    "spin": (0, lambda R, Z: [0 * R, R, 0 * R]),
    "translation": (1, lambda R, Z: [1 + 0 * R, 1j + 0 * R, 0 * R]),
    "tilt": (1, lambda R, Z: [Z, 1j * Z, -R]),
}


@pytest.fixture(scope="module", params=[True, False], ids=["Q8", "Q4"])
def free_tyre(request) -> Model:
    return support.model_of(support.tyre(quadratic=request.param).deck)


@pytest.mark.parametrize("motion", RIGID)
def test_rigid_bodies_cost_nothing(free_tyre: Model, motion: str) -> None:
    """|K(n) u| <= 1e-13 |K| |u| for infinitesimal rigid motions of the unloaded tyre with free
    beads: n = 0 axial shift and spin; n = 1 translation in x, (cos, -sin) Theta, and tilt
    e_y x X; the other translation and tilt are i times these."""
    n, field = RIGID[motion]
    X = free_tyre.mesh.X
    u = np.stack(field(*X.T), -1).ravel()
    K0, K1, K2 = support.matrices(free_tyre, np.zeros((len(X), 3)), [])

    def relative(n: int) -> float:
        K = K0 + 1j * n * K1 + n * n * K2
        size = np.linalg.norm(K, axis=0).max()  # at most the 2-norm, so the bound is stricter
        return np.linalg.norm(K @ u) / (size * np.linalg.norm(u))

    assert relative(n) <= 1e-13
    assert relative(n + 2) > 1e-5


def test_finite_spin_changes_no_energy(inflated: Inflated) -> None:
    """The inflated tyre turned by a finite angle: x' = Q x in the frame of the reference angle,
    the same potential and the same force, turned."""
    X3 = np.insert(inflated.model.mesh.X, 1, 0.0, 1)
    c, s = np.cos(1.1), np.sin(1.1)
    Q = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turned = (X3 + inflated.U) @ Q.T - X3
    energy = mechanics.potential(inflated.model, inflated.U, inflated.loads)
    after = mechanics.potential(inflated.model, turned, inflated.loads)
    assert after == pytest.approx(energy, rel=1e-10)
    number = support.numbering(inflated.model)
    before, after = (
        number.spread(mechanics.residual(inflated.model, u, inflated.loads, number))
        for u in (inflated.U, turned)
    )
    assert abs(after - before @ Q.T).max() <= 1e-9 * abs(before).max()


@pytest.mark.parametrize("spin", [0.0, 3000.0])
def test_residual_and_tangent_are_gradients(
    free_tyre: Model, random: np.random.Generator, spin: float
) -> None:
    """r . phi = d/de potential(U + e phi) and K0 phi = d/de r(U + e phi), by complex step, for
    rough fields (hourglass patterns included) at a state out of balance, under pressure, and
    turning so fast (rad/s) that its own forces are as large."""
    m, loads = support.turning(free_tyre, spin), support.cavity(free_tyre, 240e3)
    X, h = m.mesh.X, 1e-30
    U, phi = 1e-5 * random.normal(size=(2, len(X), 3))
    number = support.numbering(m)
    r = number.spread(mechanics.residual(m, U, loads, number))
    slope = mechanics.potential(m, U + 1j * h * phi, loads).imag / h
    assert (r * phi).sum() == pytest.approx(slope, rel=1e-9)
    rate = number.spread(mechanics.residual(m, U + 1j * h * phi, loads, number).imag / h)
    K0, _, _ = support.matrices(m, U, loads)
    np.testing.assert_allclose(K0 @ phi.ravel(), rate.ravel(), atol=1e-11 * abs(rate).max())


def smooth(X: Array, n: int) -> Array:
    """A field (nodes, 3) without symmetry that varies slowly along the section."""
    R, Z = (X - X.mean(0)).T / 0.1
    field = np.stack([1 + Z - 0.3 * R * Z, 0.5 * R + 0.8 * Z**2, 0.4 - R + 0.2 * Z], -1)
    return field if n == 0 else field + 1j * np.stack([0.3 * Z**2, 1 - R, R * Z], -1)


def energy_3d(m: Model, p: float, fields: list[tuple[int, Array]], step: Array) -> complex:
    """Strain energy - p V of the revolved tyre, J, for u = Re[sum U exp(i n Theta)] + step field.

    Sampled at 24 angles (exact to second order: 2 n <= 8 < 24), with gradients formed afresh:
    H = [u,R | (u,Theta + e_z x u) / R | u,Z]. ``fields``: real (n, U); ``step`` scales the last.
    """
    X, inner, total = m.mesh.X, m.mesh.faces["CAVITY"], 0.0
    for angle in ANGLES:
        u, turn = 0.0, 0.0
        for (n, U), scale in zip(fields, (1.0, step), strict=True):
            u = u + scale * (U * np.exp(1j * n * angle)).real
            turn = turn + scale * (1j * n * U * np.exp(1j * n * angle)).real
        around = turn + np.stack([-u[:, 1], u[:, 0], 0 * u[:, 2]], -1)  # + e_z x u
        for part in m.parts[:-1]:
            c = part.connectivity
            rule = shapes.quad(c.shape[1], round(np.sqrt(part.rows.weights.shape[1])))
            J = np.einsum("gak,eaj->egjk", rule.dN, X[c])
            dN = np.einsum("gak,egkj->egaj", rule.dN, np.linalg.inv(J))
            R = X[c, 0] @ rule.N.T
            H = np.empty((*R.shape, 3, 3), np.result_type(u, float))
            H[..., 0::2] = np.einsum("egaj,eai->egij", dN, u[c])
            H[..., 1] = np.einsum("ga,eai->egi", rule.N, around[c]) / R[..., None]
            W = part.law.energy((np.eye(3) + H).reshape(-1, 9))
            total += (W * (rule.weights * np.linalg.det(J) * R).ravel()).sum()
        layers, direction = m.parts[-1], m.parts[-1].rows.rest
        lines = elements.lines(X, layers.connectivity)
        along = np.einsum("ega,eai->egi", lines.slope, u[lines.connectivity])
        hoop = np.einsum("ga,eai->egi", lines.N, around[lines.connectivity]) / lines.R[..., None]
        sin = direction[..., 1:2]
        cos = (direction[..., ::2] * lines.tangent).sum(-1)[..., None]
        q = (direction + cos * along + sin * hoop).reshape(-1, 3)
        total += (layers.law.energy(q) * (lines.R * lines.weights).ravel()).sum()
        x = np.insert(X, 1, 0.0, 1) + u
        y = turn + np.stack([-x[:, 1], x[:, 0], 0 * x[:, 2]], -1)
        at = lambda v: np.einsum("ga,eai->egi", inner.N, v[inner.connectivity])
        slope = np.einsum("ega,eai->egi", inner.slope, x[inner.connectivity])
        flux = (at(x)[..., :2] * np.cross(slope, at(y))[..., :2]).sum(-1) / 2
        total -= p * (flux * inner.weights).sum()
    return total * 2 * np.pi / len(ANGLES)


@pytest.mark.parametrize("n", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (0, 2, 3, 4))])
def test_second_variation_of_the_3d_energy(inflated: Inflated, n: int) -> None:
    """d2/de2 E(u0 + e Re[phi exp(i n Theta)]) = pi phi^H K(n) phi (2 pi for n = 0) about the
    inflated, twisted tyre, for its two lowest modes and a generic field. First derivative by
    complex step, second by a central difference of fourth order."""
    m, U = inflated.model, inflated.U
    assert abs(U[:, 1]).max() > 1e-5  # the belts twist the section
    K0, K1, K2 = support.matrices(m, U, inflated.loads)
    K = K0 + 1j * n * K1 + n * n * K2
    number = support.numbering(m, inflated.held)
    modes = harmonics.Vibration(m, U, inflated.loads, number, 0.0).modes(n, 2).shapes
    for phi in (*modes, smooth(m.mesh.X, n)):
        phi = phi / abs(phi).max()
        e = 1e-4

        def slope(s: float, phi: Array = phi) -> float:
            return energy_3d(m, 240e3, [(0, U), (n, phi)], s + 1e-30j).imag / 1e-30

        wanted = (8 * (slope(e) - slope(-e)) - slope(2 * e) + slope(-2 * e)) / (12 * e)
        form = np.pi * (1 if n else 2) * (phi.ravel().conj() @ K @ phi.ravel()).real
        assert form == pytest.approx(wanted, rel=1e-6)


def test_mass_of_a_tyre_by_pappus(inflated: Inflated) -> None:
    """M = 2 pi rho int R dA + cords; int R dA = 1/2 contour integral of R^2 dZ (Green), taken
    along the outline; cords: 2 pi (A rho / s) int R ds."""
    m, rule = inflated.model, shapes.line(3, 4)
    moment = 0.0
    for edge in inflated.tyre.outline:
        X, dX = rule.N @ m.mesh.X[edge], rule.dN[..., 0] @ m.mesh.X[edge]
        moment += (rule.weights * X[:, 0] ** 2 * dX[:, 1]).sum() / 2
    total = 1100.0 * moment
    per_area = {"ply": 4.2e-7 * 1500 / 1e-3, "belt": 2.1e-7 * 5900 / 1.16e-3}
    cords = m.parts[-1]
    sin = cords.rows.rest[..., 1]
    smeared = np.where(sin < 0.5, per_area["ply"], per_area["belt"])
    total += (smeared * cords.rows.weights).sum()
    assert mechanics.mass(m).sum() == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("quadratic", [True, False])
def test_mass_of_a_ring(quadratic: bool) -> None:
    """M = rho pi (b^2 - a^2) L = 2 pi 1^T m 1, and pi u^H m u = M for a unit translation
    u = (1, i, 0) exp(i Theta); moment of inertia about the axis rho pi (b^4 - a^4) L / 2."""
    b = support.block((0.2, 0.5, 3), (0.0, 0.1, 2), quadratic)
    m = support.model_of(support.deck(b.X, b.solids, support.Rubber()))
    mass, one = mechanics.mass(m), np.ones(len(b.X))
    total = 1100.0 * np.pi * (0.5**2 - 0.2**2) * 0.1
    assert 2 * np.pi * one @ (mass @ one) == pytest.approx(total, rel=1e-13)
    u = np.outer(one, [1, 1j, 0])
    assert np.pi * (u.conj() * (mass @ u)).sum().real == pytest.approx(total, rel=1e-13)
    R = b.X[:, 0]
    inertia = 1100.0 * np.pi * (0.5**4 - 0.2**4) * 0.1 / 2
    assert 2 * np.pi * R @ (mass @ R) == pytest.approx(inertia, rel=1e-13)


def test_harmonics_of_a_state_without_twist_are_mirror_symmetric() -> None:
    """A lone layer at +alpha and its mirror image at -alpha have the same frequencies: reflection
    u_theta -> -u_theta, n -> -n."""
    text = support.tyre((2, 2, 2, 1)).deck
    mirrored = text.replace("CORD2, 70.0", "CORD2, -70.0").replace("CORD3, 110.0", "CORD3, -110.0")
    assert mirrored != text
    values = []
    for deck in (text, mirrored):
        m = support.model_of(deck)
        mask = support.held(m, support.tyre((2, 2, 2, 1)).rim)
        loads = support.cavity(m, 240e3)
        U = support.inflate(m, mask, loads)
        values.append(support.eigenvalues(m, U, loads, mask, 2, 4))
    np.testing.assert_allclose(values[0], values[1], rtol=1e-9)


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
