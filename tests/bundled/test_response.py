"""Response to a force on a patch: the direct solution, reactions of the rim, closed forms."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.deck.request import Request, ResponseRequest, read_request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.modes.response import Response, TreadPatch, tread_patch
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.materials import ModulusTable
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.errors import Refused

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.values import with_values

from ..effects.support import CASE
from . import support
from .support import Rubber

pytestmark = pytest.mark.numbers

Array = np.ndarray
HIGHEST_HZ, HARMONICS, ETA = 300.0, (0, 1, 2, 3), 0.3
RADIAL, TANGENTIAL, LATERAL = range(3)
POINTS = [(0.0, RADIAL), (0.3, TANGENTIAL), (1.0, LATERAL)]


@dataclass(frozen=True, eq=False)
class Solved:
    """An inflated tyre with losses, its whole section, and its response in a few harmonics."""

    model: Model
    U: Array
    loads: list[Any]
    mask: Array
    patch: TreadPatch
    response: Response

    @cached_property
    def matrices(self) -> list[tuple[Array, Array, Array]]:
        """K(n), the losses' part of it, and M over all components."""
        return [self._matrices(n) for n in HARMONICS]

    def _matrices(self, n: int) -> tuple[Array, Array, Array]:
        waves = lambda three: three[0] + 1j * n * three[1] + n * n * three[2]
        K = waves(support.matrices(self.model, self.U, self.loads))
        parts = [part for modulus in (0, 1) for part in self.model.material_parts(0, modulus)]
        losses = waves(support.matrices(replace(self.model, parts=parts), self.U, []))
        M = np.kron(support.full(mechanics.mass(self.model)), np.eye(3))
        return K, ETA * losses, M

    @property
    def forces(self) -> Array:
        """The patch's forces in each direction over all components (3 nodes, 3)."""
        S = np.zeros((*self.U.shape, 3))
        for i in range(3):
            S[self.patch.nodes, i, i] = self.patch.weights
        return S.reshape(-1, 3)


@pytest.fixture(scope="module")
def solved() -> Solved:
    return solve()


def solve() -> Solved:
    """A tyre of four elements across the section, at 240 kPa."""
    made = support.tyre((3, 2, 2, 1), quadratic=False)
    text = made.deck.replace("*DENSITY", f"*DAMPING, STRUCTURAL={ETA}\n*DENSITY", 1)
    m = support.model_of(text)
    mask, loads = support.held(m, made.rim), support.cavity(m, 240e3)
    U = support.inflate(m, mask, loads)
    outer = _outer_nodes(m.mesh.X)
    patch = tread_patch(m.mesh.X, U, outer, 0.15)
    vibration = Vibration(m, U, loads, support.numbering(m, mask), 0.0)
    response = Response(vibration, m, U, patch, HIGHEST_HZ, lambda: None)
    response.harmonics = [response.harmonics[n] for n in HARMONICS]
    return Solved(m, U, loads, mask, patch, response)


def _outer_nodes(X: Array) -> Array:
    """Nodes of the tread's outer surface: the outermost at each z near the middle."""
    rows = np.flatnonzero(abs(X[:, 1]) < 0.08)
    place = np.round(X[rows, 1], 4)
    return np.array([rows[place == z][np.argmax(X[rows[place == z], 0])] for z in np.unique(place)])


def direct(solved: Solved, n: int, hertz: float) -> tuple[Array, Array]:
    """Full fields (3 nodes, 3) of both signs of the losses' i, and the rim's reactions."""
    K, losses, M = solved.matrices[n]
    free = ~solved.mask.ravel()
    fields, reactions = [], []
    for i in (1j, -1j):
        Z = K + i * losses - (2 * np.pi * hertz) ** 2 * M
        u = np.zeros((len(Z), 3), complex)
        u[free] = np.linalg.solve(Z[np.ix_(free, free)], solved.forces[free])
        fields.append(u)
        reactions.append(Z @ u - solved.forces)
    return np.array(fields), np.array(reactions)


def _combined(pair: Array, angle: float) -> complex:
    """Re_i[exp(i angle) (a + j b)] from the values for j = i and j = -i."""
    a, b = (pair[0] + pair[1]) / 2, (pair[0] - pair[1]) / 2j
    return complex((np.exp(1j * angle) * a).real, (np.exp(1j * angle) * b).real)


def direct_errors(solved: Solved, frequencies: Array) -> tuple[Array, Array]:
    """Errors (p, p, f) of the receptances between p points, over the largest of all; and of those
    of driving points (p, f), over the largest of each."""
    receptance, _ = solved.response.at(frequencies, POINTS, POINTS)
    exact = np.zeros_like(receptance)
    for k, hertz in enumerate(frequencies):
        for n in HARMONICS:
            fields, _ = direct(solved, n, hertz)
            motion = solved.forces.T @ fields
            weight = solved.patch.share(n) ** 2 / (np.pi if n else 2 * np.pi)
            for e, (angle, way) in enumerate(POINTS):
                for s, (at, other) in enumerate(POINTS):
                    pair = motion[:, other, way]
                    exact[s, e, k] += weight * _combined(pair, n * (at - angle))
    error, size = np.abs(receptance - exact), np.abs(exact).max(2)
    own = np.arange(len(POINTS))
    return error / size.max(), error[own, own] / size[own, own][:, None]


def compare(solved: Solved, frequencies: Array) -> None:
    """Receptances within 0.2 % of the largest, those of driving points within 0.2 % of their own
    largest."""
    every, driving = direct_errors(solved, frequencies)
    assert every.max() < 0.002 and driving.max() < 0.002


def test_direct_solution(solved: Solved) -> None:
    compare(solved, np.array([0.0, 43.0, 66.0, 130.0, HIGHEST_HZ]))


@pytest.mark.slow
def test_direct_solution_at_many_frequencies(solved: Solved) -> None:
    compare(solved, np.linspace(0.0, HIGHEST_HZ, 30))


def test_the_force_on_the_hub_is_the_rims_reaction(solved: Solved) -> None:
    """Forces and moments of the tyre, from the direct solution's forces on the rim's nodes; waves
    from n = 2 on have none."""
    X, U = solved.model.mesh.X.real, solved.U
    r, t, z = X[:, 0] + U[:, 0], U[:, 1], X[:, 1] + U[:, 2]
    one, o = np.ones(len(r)), np.zeros(len(r))
    motions = [[[o, o, one], [-t, r, o]], [[one, 1j * one, o], [1j * z, -z, t - 1j * r]]]
    hertz, angle = np.array([20.0, 66.0, 180.0]), 0.4
    _, hub = solved.response.at(hertz, [(angle, RADIAL), (angle, LATERAL)], [(0.0, RADIAL)])
    for k, f in enumerate(hertz):
        for n in (0, 1):
            _, reactions = direct(solved, n, f)
            for i, motion in enumerate(motions[n]):
                T = np.array(motion).T.ravel()
                on_hub = -(T.conj() @ reactions) * solved.patch.share(n)
                for e, way in enumerate((RADIAL, LATERAL)):
                    rows = [3 * i + 2] if n == 0 else [3 * i, 3 * i + 1]
                    for row, axis in zip(rows, (0.0, np.pi / 2), strict=False):
                        exact = _combined(on_hub[:, way], n * (axis - angle))
                        assert hub[row, e, k] == pytest.approx(exact, rel=1e-4, abs=1e-5)


def test_statically_the_hub_bears_what_is_applied(solved: Solved) -> None:
    """A radial force at 90 degrees, a lateral one at 0 with its moment about the fore-aft axis."""
    points = [(np.pi / 2, RADIAL), (0.0, LATERAL), (0.0, TANGENTIAL)]
    _, hub = solved.response.at(np.zeros(1), points, [(0.0, RADIAL)])
    share, patch = solved.patch.share(1), solved.patch
    z = patch.weights @ (solved.model.mesh.X[patch.nodes, 1].real + solved.U[patch.nodes, 2])
    expected = np.zeros((6, 3))
    expected[1, 0], expected[3, 0] = share, -z * share
    expected[2, 1], expected[4, 1] = 1.0, -patch.radius * share
    expected[1, 2], expected[3, 2], expected[5, 2] = share, -z * share, patch.radius
    twist = patch.weights @ solved.U[patch.nodes, 1]
    expected[3, 1], expected[5, 0] = twist * share, -twist
    assert hub[..., 0] == pytest.approx(expected, abs=1e-9)


def test_reciprocity_and_dissipated_power(solved: Solved) -> None:
    frequencies = np.linspace(1.0, HIGHEST_HZ, 40)
    receptance, _ = solved.response.at(frequencies, POINTS, POINTS)
    np.testing.assert_allclose(
        receptance, receptance.swapaxes(0, 1), rtol=0, atol=1e-9 * np.abs(receptance).max()
    )
    assert (np.diagonal(receptance).imag < 0).all()


@pytest.mark.parametrize("growth", [0.0, 0.5])
def test_a_heavy_ring_on_rubber_in_closed_form(growth: float) -> None:
    """A ring of moment of inertia J on massless rubber that turns about the axle:
    u / F = R^2 / (k (1 + i eta) - omega^2 J), k = 4 pi G L / (1/a^2 - 1/b^2); G is by 1 + growth
    larger than the static one, at all frequencies, and its losses are given as of the latter."""
    b = support.block((0.1, 0.3, 40), (-0.025, 0.025, 1), True)
    text = support.deck(b.X, b.solids, Rubber(C10=2e5, density=1e-3))
    text = text.replace("*DENSITY", f"*DAMPING, STRUCTURAL={ETA}\n*DENSITY")
    ring = "*MATERIAL, NAME=RING\n*HYPERELASTIC, MOONEY-RIVLIN\n2E10, 0.0, 5E-12\n*DENSITY\n1E4\n"
    head, _, rest = text.partition("*SOLID SECTION")
    sets = "*ELSET, ELSET=R\n40\n*ELSET, ELSET=S, GENERATE\n1, 39\n"
    sections = "*SOLID SECTION, ELSET=R, MATERIAL=RING\n*SOLID SECTION, ELSET=S, MATERIAL=RUBBER\n"
    m = support.model_of(head + sets + sections + rest.partition("\n")[2] + ring)
    if growth:
        places = np.repeat([0, -1], np.array([39, 1]) * m.parts[0].rows.weights.shape[1])
        m = m.with_laws(lambda own: replace(own, table=places))
        m = replace(m, tables=[ModulusTable((1.0, 100.0), (1 + growth,) * 2)])
    mask = np.repeat(abs(m.mesh.X[:, :1] - 0.1) < 1e-9, 3, 1)
    outer = np.flatnonzero(abs(m.mesh.X[:, 0] - 0.3) < 1e-9)
    patch = tread_patch(m.mesh.X, 0.0 * mask, outer, 0.2)
    vibration = Vibration(m, 0.0 * mask, [], support.numbering(m, mask), 0.0)
    response = Response(vibration, m, 0.0 * mask, patch, 40.0, lambda: None)
    hertz = np.linspace(0.0, 40.0, 21)
    assert len(response.harmonics) > 1
    response.harmonics = response.harmonics[:1]
    receptance, hub = response.at(hertz, [(0.0, TANGENTIAL)], [(1.0, TANGENTIAL)])
    a, c, G, L = 0.1, 0.295, 4e5, 0.05
    k = 4 * np.pi * G * L / (a**-2 - c**-2) * (1 + growth + 1j * ETA)
    J = np.pi / 2 * 1e4 * L * (0.3**4 - c**4)
    exact = 0.3**2 / (k - (2 * np.pi * hertz) ** 2 * J)
    np.testing.assert_allclose(receptance[0, 0], exact, atol=1e-3 * abs(exact).max())
    moment = 0.3 * k / (k - (2 * np.pi * hertz) ** 2 * J)
    np.testing.assert_allclose(hub[5, 0], moment, atol=1e-3 * abs(moment).max())


WANTED: dict[str, Any] = {
    "lowest_Hz": 20.0,
    "highest_Hz": 100.0,
    "lines": 14,
    "patch_m": 0.15,
    "excite": [[0.0, "radial"], [30.0, "lateral"]],
    "respond": [[90.0, "radial"]],
}


@pytest.mark.slow
def test_half_and_whole_sections_respond_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """A free wheel and its tread move alike."""
    texts = Decks(TyreDesign(with_values(CASE, {"rim.free": True}))).texts("abaqus")
    texts["inflate.inp"] = texts["inflate.inp"].replace(
        "*DENSITY\n1100", "*DAMPING, STRUCTURAL=0.2\n*DENSITY\n1100"
    )
    deck = Deck({name.removesuffix(".inp"): t for name, t in texts.items()}, "modes", "inflate")
    answers = []
    for keeps in (True, False):
        if not keeps:
            monkeypatch.setattr("tyrecal_solvers.bundled.job.keeps_half_turn", lambda *of: False)
        (step,) = Job(deck, Request([0, 1], response=ResponseRequest(**WANTED))).run()
        assert step.response is not None
        answers.append(step.response)
    half, whole = answers
    assert half.harmonics == whole.harmonics == half.harmonics_wanted > 10
    for name in ("receptance", "hub"):
        one, other = getattr(half, name), getattr(whole, name)
        assert np.abs(one - other).max() < 1e-4 * np.abs(other).max()


@pytest.mark.slow
def test_a_free_wheel_has_no_response_at_0_Hz_and_no_matrices() -> None:
    texts = Decks(TyreDesign(with_values(CASE, {"rim.free": True}))).texts("abaqus")
    deck = Deck({name.removesuffix(".inp"): t for name, t in texts.items()}, "modes", "inflate")
    for change, words in ({"lowest_Hz": 0.0}, "no response at 0 Hz"), ({"modes": 40}, "is held"):
        wanted = ResponseRequest(**{**WANTED, **change})
        with pytest.raises(Refused, match=words):
            Job(deck, Request([0], response=wanted)).run()


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("lines", 1, "response.lines is 1, must be greater than or equal to 2"),
        ("patch_m", 0, "response.patch_m is 0, must be greater than or equal to 0.001"),
        ("highest_Hz", 10.0, "response.highest_Hz is 10.0, must be above lowest_Hz"),
        ("excite", [], "response.excite is \\[\\], "),
        ("respond", [[0, "up"]], 'response.respond\\[0\\]\\[1\\] is "up", must be .radial'),
    ],
)
def test_requests_that_are_refused(tmp_path: Path, key: str, value: Any, words: str) -> None:
    path = tmp_path / "modes.request.json"
    path.write_text(json.dumps({"response": {**WANTED, key: value}}))
    with pytest.raises(Refused, match=words):
        read_request(path, ["modes"])
