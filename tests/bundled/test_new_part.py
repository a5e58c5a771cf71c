"""A part, a law or an element added from outside: the section, 3-D and slopes have it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from tyrecal_solvers.bundled.modes import sensitivity
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.section import mechanics, model, shapes
from tyrecal_solvers.bundled.section.elements import Solids
from tyrecal_solvers.bundled.section.laws.energy_law import EnergyLaw
from tyrecal_solvers.bundled.section.parts.elastic import Elastic
from tyrecal_solvers.bundled.section.parts.part import Rows, SectionJob, TyrePart, on_diagonals
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved

from ..chance import generator
from . import support
from .conftest import Inflated

Array = np.ndarray


@dataclass(frozen=True)
class SaintVenantKirchhoff(EnergyLaw):
    """W = G E : E + L/2 tr(E)^2, E = (F^T F - 1) / 2, in place of Mooney and Rivlin's."""

    G: Array
    L: Array

    def _strain(self, z: Array) -> tuple[Array, Array, Array]:
        F = z.reshape(-1, 3, 3)
        E = (F.swapaxes(1, 2) @ F - np.eye(3)) / 2
        trace = np.einsum("pii->p", E)
        stress = 2 * self.G[:, None, None] * E + (self.L * trace)[:, None, None] * np.eye(3)
        return F, E, stress

    def energy(self, z: Array) -> Array:
        _, E, _ = self._strain(z)
        return self.G * (E * E).sum((1, 2)) + self.L / 2 * np.einsum("pii->p", E) ** 2

    def force(self, z: Array) -> Array:
        F, _, S = self._strain(z)
        return (F @ S).reshape(-1, 9)

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        F, _, S = self._strain(z)
        one = np.eye(3)
        A = np.einsum("ik,pJL->piJkL", one, S)
        B = np.einsum("piM,pkM->pik", F, F)
        A = A + np.einsum("p,pik,JL->piJkL", self.G, B, one)
        A = A + np.einsum("p,piL,pkJ->piJkL", self.G, F, F)
        A = A + np.einsum("p,piJ,pkL->piJkL", self.L, F, F)
        return A.reshape(-1, 9, 9) * np.reshape(weights, (-1, 1, 1))


def test_a_law_of_ones_own(inflated: Inflated) -> None:
    """Small strains of the same moduli: the same frequencies to round-off times the stiffest mode's
    lambda over the lowest, 1e7; the 3-D tyre's force about a state that is the same all round is
    the section's; a slope is that of a difference."""
    own = inflated.model

    def kirchhoff(scale: complex = 1.0) -> model.Model:
        def changed(law: EnergyLaw) -> EnergyLaw:
            if not hasattr(law, "C10"):
                return law
            G = 2 * (law.C10 + law.C01)
            return SaintVenantKirchhoff(scale * G, 2 * law.inverse_D1 - 2 / 3 * scale * G)

        return own.with_laws(changed)

    number, U = support.numbering(own, inflated.held), 0 * inflated.U
    values = [Vibration(m, U, [], number, 0.0).modes(1, 4) for m in (own, kirchhoff())]
    np.testing.assert_allclose(values[1].eigenvalues, values[0].eigenvalues, rtol=1e-8)

    m, around = kirchhoff(), half_circle(np.full(3, np.pi / 3))
    bent = 1e-3 * inflated.U
    force = Revolved(m, [], around).residual(np.repeat(bent[None], 7, 0)).sum(0)
    section = mechanics.gradient(m, bent, [])
    np.testing.assert_allclose(force, np.pi * section, atol=1e-9 * abs(section).max())

    modes, h = values[1], 1e-3
    fields = sensitivity.ModeShapes(np.full(4, 1), modes.shapes)
    seeded = kirchhoff(1 + 1e-30j)
    got = sensitivity.eigenvalue_rates(seeded, U, U, [], fields, modes.eigenvalues)
    up, down = (
        Vibration(kirchhoff(1 + s), U, [], number, 0.0).modes(1, 4).eigenvalues for s in (h, -h)
    )
    np.testing.assert_allclose(got, (up - down) / (2 * h), rtol=1e-4)


@dataclass(frozen=True)
class Bedding(EnergyLaw):
    """Springs to the ground at every point of the rubber, W = k u^2 / 2."""

    k: Array

    def energy(self, z: Array) -> Array:
        return self.k * (z * z).sum(1) / 2

    def force(self, z: Array) -> Array:
        return self.k[:, None] * z

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        return (self.k * weights)[:, None, None] * np.eye(3)


def bedding(job: SectionJob) -> list[TyrePart]:
    """Read from a deck: under all rubber, in proportion to its mass."""
    parts: list[TyrePart] = []
    for solids in job.mesh.blocks.values():
        if isinstance(solids, Solids):
            N = np.broadcast_to(solids.mass_N, (*solids.mass_weights.shape, len(solids.mass_N[0])))
            rows = Rows(on_diagonals(N), 0 * N, slice(0, 3), np.zeros(3), solids.mass_weights)
            k = np.full(solids.mass_weights.size, SPRING * support.Rubber().density)
            parts.append(Elastic(solids.connectivity, rows, Bedding(k)))
    return parts


SPRING = 1e5  # of k over the density, 1/s2


@pytest.mark.parametrize("quadratic", [True, False], ids=["Q8", "Q4"])
def test_a_part_of_ones_own(monkeypatch: pytest.MonkeyPatch, quadratic: bool) -> None:
    """Springs in proportion to the mass add k / rho to every omega^2; one reader is one line."""
    b = support.block((0.2, 0.3, 3), (0.0, 0.1, 2), quadratic)
    deck = support.deck(b.X, b.solids, support.Rubber())
    bare = support.model_of(deck)
    monkeypatch.setattr(model, "READERS", (*model.READERS, bedding))
    bedded = support.model_of(deck)
    assert len(bedded.parts) == len(bare.parts) + 1
    mask = support.held(bare, list(range(3)))
    for n in (0, 2):
        values = [
            support.eigenvalues(m, np.zeros((len(b.X), 3)), [], mask, n, 4) for m in (bare, bedded)
        ]
        np.testing.assert_allclose(values[1] - values[0], SPRING, rtol=1e-6)
    phi = generator(3).normal(size=(7, len(b.X), 3))
    around = half_circle(np.full(3, np.pi / 3))
    works = [Revolved(m, [], around) for m in (bare, bedded)]
    forces = [work.residual(1e-6 * phi) for work in works]
    more = (forces[1] - forces[0]) / 1e-6
    np.testing.assert_allclose(works[1].product(phi) - works[0].product(phi), more, rtol=1e-5)
    spun = replace(bedded, parts=bedded.parts[-1:])
    assert mechanics.potential(spun, np.ones((len(b.X), 3)), []) == pytest.approx(
        1.5 * SPRING * mechanics.mass(bare).sum(), rel=1e-12
    )


def nine(points: int) -> shapes.Rule:
    """The Lagrangian quadrilateral: products of two lines' functions."""
    xi, weights = shapes.gauss(points, 2)
    along, up = ((x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2) for x in xi.T)
    slopes = [(x - 0.5, -2 * x, x + 0.5) for x in xi.T]
    places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
    N = np.stack([along[i] * up[j] for i, j in places], -1)
    dN = np.stack(
        [np.stack([slopes[0][i] * up[j], along[i] * slopes[1][j]], -1) for i, j in places], 1
    )
    return shapes.Rule(N, dN, weights)


def test_an_element_of_ones_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thick ring of nine-node elements: its mass, and the lowest modes of n = 0..2 of one of
    eight-node elements, which are almost as rich."""
    kind = shapes.ElementType(9, nine, 3, 3, shapes.FACES_QUADRATIC)
    monkeypatch.setitem(shapes.TYPES, "CGAX9", kind)
    b = support.block((0.2, 0.3, 6), (0.0, 0.1, 4), True)
    eight = support.deck(b.X, b.solids, support.Rubber()).replace("CGAX8R", "CGAX8")
    head, rest = eight.split("*ELEMENT", 1)
    rows, after = rest.split("\n", len(b.solids) + 1)[1:-1], rest.split("\n", len(b.solids) + 1)[-1]
    middles = b.X[b.solids[:, :4]].mean(1)
    numbers = len(b.X) + 1 + np.arange(len(middles))
    nodes = [f"{n}, {float(r)!r}, {float(z)!r}" for n, (r, z) in zip(numbers, middles, strict=True)]
    rows = [f"{row}, {n}" for row, n in zip(rows, numbers, strict=True)]
    start = rest.split("\n", 1)[0].replace("CGAX8", "CGAX9")
    deck = "\n".join([head + "\n".join(nodes), "*ELEMENT" + start, *rows, after])
    models = [support.model_of(text) for text in (eight, deck)]
    assert [m.parts[0].connectivity.shape[1] for m in models] == [8, 9]
    masses = [mechanics.mass(m).sum() for m in models]
    assert masses[1] == pytest.approx(masses[0], rel=1e-12)
    for n in range(3):
        values = []
        for m in models:
            held = support.held(m, np.flatnonzero(m.mesh.X[:, 0] < 0.2 + 1e-9))
            values.append(support.eigenvalues(m, 0 * held, [], held, n, 3))
        np.testing.assert_allclose(values[1], values[0], rtol=0.02)
