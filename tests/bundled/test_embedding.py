"""Cords in elements of another mesh: linear constraints, exact where the field is linear.

Membranes: a law without stress across, a pressurised cylinder in closed form.
"""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.section.embedding import _inverse
from tyrecal_solvers.bundled.section.laws.plane_stress import PlaneStress
from tyrecal_solvers.bundled.section.laws.polynomial import MooneyRivlin
from tyrecal_solvers.bundled.section.mesh import DeckMesh, read_mesh
from tyrecal_solvers.bundled.section.model import build
from tyrecal_solvers.bundled.section.parts.cords import LogarithmicCord
from tyrecal_solvers.bundled.section.parts.elastic import Elastic
from tyrecal_solvers.bundled.section.shapes import TYPES, solids
from tyrecal_solvers.language.text import DeckError, read_keywords

HOSTS = {  # two distorted quadrilaterals on top of each other, or the triangles that they are
    "CGAX4": ((1, 2, 4, 3), (3, 4, 6, 5)),
    "CGAX3": ((1, 2, 4), (1, 4, 3), (3, 4, 6), (3, 6, 5)),
}
NODES = ((0.20, 0.0), (0.30, -0.01), (0.21, 0.05), (0.28, 0.06), (0.19, 0.1), (0.3, 0.11))
ENDS = np.array([(0.23, 0.005), (0.26, 0.095)])  # of the cords' line
CORDS = """*SOLID SECTION, ELSET=SOLID, MATERIAL=RUBBER
*SURFACE SECTION, ELSET=PLY
*REBAR LAYER
PLY, 4e-7, 1e-3, 0, CORD, 30
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
8e5, 5e-8
*DENSITY
1100
*MATERIAL, NAME=CORD
*ELASTIC
1e10, 0.3
*DENSITY
1500
"""


def deck(kind: str, shares: tuple[float, ...], options: str = "", off: float = 0.0) -> str:
    """Hosts, and a line of cords with nodes at shares of its length; the last one ``off`` in r."""
    text = "*NODE\n" + "".join(f"{n}, {r}, {z}\n" for n, (r, z) in enumerate(NODES, 1))
    for k, share in enumerate(shares):
        r, z = ENDS[0] + share * (ENDS[1] - ENDS[0]) + (off if k + 1 == len(shares) else 0, 0)
        text += f"{11 + k}, {r:.17g}, {z:.17g}\n"
    text += f"*ELEMENT, TYPE={kind}, ELSET=SOLID\n"
    text += "".join(f"{e}, {', '.join(map(str, n))}\n" for e, n in enumerate(HOSTS[kind], 1))
    text += "*ELEMENT, TYPE=SFMGAX1, ELSET=PLY\n"
    text += "".join(f"{101 + k}, {11 + k}, {12 + k}\n" for k in range(len(shares) - 1))
    return text + f"*EMBEDDED ELEMENT, HOST ELSET=SOLID{options}\nPLY\n" + CORDS


def mesh_of(*args: object) -> DeckMesh:
    return read_mesh(read_keywords(deck(*args)))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", [kind for kind in solids() if kind in TYPES])
def test_the_map_is_inverted(name: str) -> None:
    """The inverse holds in a distorted element with bent sides, and a little outside."""
    kind, random = TYPES[name], np.random.default_rng(3)
    square, corner = [(-1, -1), (1, -1), (1, 1), (-1, 1)], [(0, 0), (1, 0), (0, 1)]
    X = np.array(square if len(kind.faces) == 4 else corner, float)
    if kind.nodes > len(X):
        X = np.vstack([X, (X + np.roll(X, -1, 0)) / 2])
    X = 0.3 + 0.01 * (X + 0.08 * random.uniform(-1, 1, X.shape))
    for xi in random.uniform(0.05, 0.45, (20, 2)):
        result = _inverse(kind, X, kind.at(xi[None])[0][0] @ X)
        assert result == pytest.approx(xi, abs=1e-12)


@pytest.mark.parametrize("kind", HOSTS)
def test_a_linear_field_stretches_cords_as_it_does_the_rubber(kind: str) -> None:
    """Patch test: W = E A / (2 s) ln^2 |F a|, times the integral of R ds, whatever the line's
    nodes; and a mass of A rho / s times that."""
    a, b, c = 0.02, 0.03, -0.01
    F = np.array([[1 + a, 0, 0], [0, 1 + a, 0], [b, 0, 1 + c]])
    along = ENDS[1] - ENDS[0]
    length, alpha = np.hypot(*along), np.radians(30)
    t = along / length
    cord = F @ (np.cos(alpha) * np.array([t[0], 0, t[1]]) + np.sin(alpha) * np.array([0, 1, 0]))
    ring = length * ENDS[:, 0].mean()
    energy = 1e10 * 4e-7 / 1e-3 / 2 * np.log(np.linalg.norm(cord)) ** 2 * ring
    for shares in ((0.0, 1.0), (0.0, 0.3, 0.55, 1.0)):
        model = build(read_keywords(deck(kind, shares)), None, True)
        R, Z = model.mesh.X.T
        U = np.stack([a * R, 0 * R, b * R + c * Z], 1)
        own = [part for part in model.parts if isinstance(part, Elastic)]
        plies = [part for part in own if isinstance(part.law, LogarithmicCord)]
        assert sum(p.energy(U) for p in plies) == pytest.approx(energy, rel=1e-12)
        mass = sum(p.mass.sum() for p in plies if p.mass is not None)
        assert mass == pytest.approx(4e-7 / 1e-3 * 1500 * ring, rel=1e-12)
    assert len(model.mesh.index) == len(NODES)  # a guest has no equations


def test_a_guest_on_a_side_moves_with_that_side_alone() -> None:
    """A guest at a midpoint moves with the ends by halves; a guest at a node is the node."""
    text = deck("CGAX4", (0.0, 1.0))
    sides = np.array(NODES)
    for n, (r, z) in ((11, (sides[2] + sides[3]) / 2), (12, sides[5])):
        line = next(row for row in text.splitlines() if row.startswith(f"{n}, "))
        text = text.replace(line, f"{n}, {r:.17g}, {z:.17g}")
    mesh = read_mesh(read_keywords(text))
    (block,) = mesh.embedded.values()
    rows = [mesh.index[n] for n in (3, 4, 6)]
    assert block.rows.tolist() == [rows]
    assert block.weights(mesh.X, mesh.guests)[0] == pytest.approx(
        np.array([[0.5, 0.5, 0], [0, 0, 1]]), abs=1e-12
    )


def test_a_guest_outside_is_refused_beyond_the_tolerance() -> None:
    """5 % of the mean element by default, or what is asked for; within it moves as if inside."""
    reach = 0.296 - ENDS[1, 0]  # 2 mm beyond the side of the host at that height
    mesh = mesh_of("CGAX4", (0.0, 1.0), "", reach - 0.001)
    (block,) = mesh.embedded.values()
    weights = block.weights(mesh.X, mesh.guests)
    assert weights.sum(-1) == pytest.approx(1.0, abs=1e-14)
    assert weights @ mesh.X[block.rows] == pytest.approx(
        block.points_at(mesh.X, mesh.guests), abs=1e-14
    )
    for options, off in (("", 0.05), (", ABSOLUTE EXTERIOR TOLERANCE=1e-4", reach)):
        with pytest.raises(DeckError, match=r"outside its hosts|in no host element") as error:
            mesh_of("CGAX4", (0.0, 1.0), options, off)
        assert error.value.place.line == deck("CGAX4", (0.0, 1.0)).splitlines().index("PLY") + 1
    assert mesh_of("CGAX4", (0.0, 1.0), ", ABSOLUTE EXTERIOR TOLERANCE=0.05", 0.05).guests


C10, THICKNESS, RADIUS, LENGTH = 8e5, 1e-3, 0.3, 0.1
CYLINDER = f"""*NODE
1, {RADIUS}, 0.
2, {RADIUS}, {LENGTH}
*ELEMENT, TYPE=MGAX1, ELSET=PLY
1, 1, 2
*MEMBRANE SECTION, ELSET=PLY, MATERIAL=GUM
{THICKNESS}
*MATERIAL, NAME=GUM
*HYPERELASTIC, NEO HOOKE
{C10}
*DENSITY
1100.
"""


def test_force_and_tangent_are_derivatives() -> None:
    """Force and tangent agree with central differences and with the complex step that forms
    sensitivities."""
    rng = np.random.default_rng(1)
    flat = np.array([1.0, 0, 0, 0, 1.0, 0])
    z = flat + 0.1 * rng.standard_normal((4, 6))
    law = PlaneStress(MooneyRivlin(np.full(4, C10), np.full(4, C10 / 4), np.full(4, 4e8)))
    force, tangent = law.force(z), law.tangent(z)
    for i in range(6):
        step = 1e-6 * np.eye(6)[i]
        by_energy = (law.energy(z + step) - law.energy(z - step)) / 2e-6
        np.testing.assert_allclose(by_energy, force[:, i], rtol=1e-6, atol=1e-3 * C10 * 1e-3)
        imaginary = law.force(z + 1e-30j * np.eye(6)[i]).imag / 1e-30
        np.testing.assert_allclose(imaginary, tangent[:, :, i], rtol=1e-7, atol=1e-7 * C10)


@pytest.mark.parametrize("stretch", [1.02, 1.3])
def test_a_pressurised_cylinder(stretch: float) -> None:
    """p r L of each radian balances the wall: p = h / (R stretch) dW/dstretch, incompressible."""
    model = build(read_keywords(CYLINDER), None, True)
    (membrane,) = model.parts
    U = np.zeros((2, 3))
    U[:, 0] = (stretch - 1) * RADIUS
    radial = membrane.force(U).reshape(2, 3)[:, 0].sum()
    pressure = radial / (stretch * RADIUS * LENGTH)
    exact = THICKNESS / (RADIUS * stretch) * 2 * C10 * (stretch - stretch**-3)
    assert pressure == pytest.approx(exact, rel=0.003)
    assert membrane.mass is not None
    assert membrane.mass.sum() == pytest.approx(1100 * THICKNESS * RADIUS * LENGTH)
