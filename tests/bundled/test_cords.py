"""Cords: the law W = (EA / 2s) ln^2(lambda), and layers that bear no compression."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import qr
from scipy.optimize import brentq
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.section.parts import cords
from tyrecal_solvers.bundled.section.parts.cords import TRANSITION, LogarithmicCord
from tyrecal_solvers.bundled.section.parts.elastic import Elastic
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved

from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.values import with_values

from ..effects.support import decks
from ..studies.wrinkles import by_size
from . import support
from .support import Layer, Rubber

Array = np.ndarray
H = 1e-30


STIFFNESS = np.array([1e5, 2e6, 3e7, 4e6])


CORD = LogarithmicCord(STIFFNESS)


@pytest.fixture
def q(random: np.random.Generator) -> Array:
    return random.normal(size=(4, 3)) * 0.2 + [0.9, 0.3, -0.4]


def close(got: Array, wanted: Array, tolerance: float = 1e-13) -> None:
    assert abs(got - wanted).max() <= tolerance * abs(wanted).max()


def test_force_and_tangent_by_complex_step(q: Array) -> None:
    """f = dW/dq and D = df/dq, D symmetric."""
    steps = np.eye(3) * 1j * H
    force = np.stack([CORD.energy(q + s).imag / H for s in steps], -1)
    close(CORD.force(q), force)
    D = np.stack([CORD.force(q + s).imag / H for s in steps], -1)
    close(CORD.tangent(q), D)
    close(CORD.tangent(q), D.swapaxes(1, 2))


def test_a_cord_that_bears_no_compression_is_slack_below_its_length(q: Array) -> None:
    """W, f and D are 0 there, and those of any cord above it, less a constant of W."""
    one = replace(CORD, compressed=np.array([0.0, 0.0, 1.0, 1.0]))
    q *= (np.array([0.9, 1.1, 0.9, 1.1]) / np.sqrt((q * q).sum(-1)))[:, None]
    for got, any_cord in ((one.energy, CORD.energy), (one.force, CORD.force), (one.tangent,) * 2):
        assert not got(q)[0].any()
        np.testing.assert_array_equal(got(q)[2:], any_cord(q)[2:])
    np.testing.assert_array_equal(one.force(q)[1], CORD.force(q)[1])
    np.testing.assert_array_equal(one.tangent(q)[1], CORD.tangent(q)[1])
    constant = STIFFNESS[1] * TRANSITION**2 / 10
    assert one.energy(q)[1] == pytest.approx(CORD.energy(q)[1] + constant, rel=1e-14)


@pytest.mark.parametrize("share", [-1.001, -0.999, -0.3, 0.0, 0.8, 0.999, 1.001])
def test_a_cord_goes_slack_smoothly(q: Array, share: float) -> None:
    """Force and tangent are derivatives by complex steps throughout, and all three are continuous:
    next to the ends of the transition they are those of the ends."""
    slack = replace(CORD, compressed=np.zeros(4))
    direction = q / np.sqrt((q * q).sum(-1))[:, None]
    at = np.exp(share * TRANSITION) * direction
    steps = np.eye(3) * 1j * H
    force = np.stack([slack.energy(at + s).imag / H for s in steps], -1)
    np.testing.assert_allclose(slack.force(at), force, rtol=1e-11, atol=1e-9)
    D = np.stack([slack.force(at + s).imag / H for s in steps], -1)
    np.testing.assert_allclose(slack.tangent(at), D, rtol=1e-11, atol=1e-4)
    end = np.exp(np.sign(share) * TRANSITION) * direction
    if abs(abs(share) - 1) < 0.01:
        for law in (slack.energy, slack.force, slack.tangent):
            largest = abs(law(np.exp(TRANSITION) * direction)).max()
            assert abs(law(at) - law(end)).max() < 2e-3 * largest


def test_an_artificial_tension_holds_every_direction_alike(q: Array) -> None:
    """The artificial tension has no energy and no force, but a tangent, with its weight."""
    taut, weights = CORD.tautened(7.0), np.array([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(taut.energy(q), CORD.energy(q))
    np.testing.assert_array_equal(taut.force(q), CORD.force(q))
    more = taut.tangent(q, weights) - CORD.tangent(q, weights)
    np.testing.assert_allclose(more, 7 * weights[:, None, None] * np.eye(3), atol=1e-6)
    np.testing.assert_allclose(
        CORD.tangent(q, weights), weights[:, None, None] * CORD.tangent(q), rtol=1e-14
    )


@pytest.mark.parametrize("stretch", [0.9, 0.9999, 1.0001, 1.2])
def test_a_steadied_tangent_lets_no_cord_buckle(q: Array, stretch: float) -> None:
    """Across a compressed cord it is 0, along it the true one; that of a taut cord, energy and
    force are as they were."""
    steadied = replace(CORD, steadied=True)
    q *= (stretch / np.sqrt((q * q).sum(-1)))[:, None]
    np.testing.assert_array_equal(steadied.energy(q), CORD.energy(q))
    np.testing.assert_array_equal(steadied.force(q), CORD.force(q))
    more = steadied.tangent(q) - CORD.tangent(q)
    compression = STIFFNESS * max(-np.log(stretch), 0.0) / stretch**2
    t = q / stretch
    across = np.eye(3) - t[:, :, None] * t[:, None, :]
    close(more, compression[:, None, None] * across, 1e-9)
    assert np.linalg.eigvalsh(steadied.tangent(q)).min() > -1e-9 * STIFFNESS.max()


def test_frame_indifference(q: Array, random: np.random.Generator) -> None:
    """W(Qq) = W(q), f(Qq) = Q f(q), D(Qq) = Q D(q) Q^T for a rotation Q."""
    Q = qr(random.normal(size=(3, 3)))[0]
    close(CORD.energy(q @ Q.T), CORD.energy(q))
    close(CORD.force(q @ Q.T), CORD.force(q) @ Q.T)
    close(CORD.tangent(q @ Q.T), Q @ CORD.tangent(q) @ Q.T)


@pytest.mark.parametrize("stretch", [0.9, 1.0, 1.2])
def test_uniaxial_stretch(stretch: float) -> None:
    """Along a: W' = EA/s ln(l) / l and W'' = EA/s (1 - ln l) / l^2; across: W' / l, the stiffness
    of a taut string of unit reference length."""
    a = np.array([0.6, 0.0, 0.8])
    q = np.tile(stretch * a, (4, 1))
    log = np.log(stretch)
    np.testing.assert_allclose(CORD.force(q) @ a, STIFFNESS * log / stretch, rtol=1e-13)
    D = CORD.tangent(q)
    across = np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(a @ (D @ a).T, STIFFNESS * (1 - log) / stretch**2, rtol=1e-13)
    np.testing.assert_allclose((D @ across) @ across, STIFFNESS * log / stretch**2, rtol=1e-13)


R, LENGTH, TUBE_STIFFNESS = 0.2, 0.05, 1e6  # m, m, E A / s in N/m


def moment(nodes: int, strain: float, curvature: float) -> float:
    """M / (p pi R^3) of a tube of axial cords with the pressure p = 2 k ``strain`` / R in it,
    bent to ``curvature`` times p / (2 k): k = E A / s. Its end turns as a plane."""
    z = np.linspace(0.0, LENGTH, nodes)
    layer = Layer(np.arange(nodes)[None], 1e-6, 1e-3, TUBE_STIFFNESS * 1e3, 0.0, 0.0, True)
    X = np.stack([np.full(nodes, R), z], -1)
    around = half_circle(np.full(40, np.pi / 40))
    deck = support.deck(X, np.empty((0, 4), int), Rubber(), [layer])
    tube = Revolved(support.model_of(deck), [], around)
    stretched = np.zeros((len(around.angles), nodes, 3))
    stretched[..., 2] = z
    bent = stretched * (R * np.cos(around.angles))[:, None, None]
    kappa = curvature * strain / R

    def force(extension: float, along: Array) -> float:
        forces = tube.residual(extension * stretched + kappa * bent)
        return 2 * float((forces * along).sum()) / LENGTH  # the half circle, twice

    thrust = 2 * np.pi * R * TUBE_STIFFNESS * strain  # p pi R^2
    extension = brentq(lambda e: force(e, stretched) - thrust, -2 * kappa * R, 2 * strain)
    return force(extension, bent) / (thrust * R)


@pytest.mark.parametrize("nodes", [2, 3], ids=["linear", "quadratic"])
@pytest.mark.parametrize("taut_deg", [179.0, 150.0, 120.0, 90.0, 59.0])
def test_a_pressurised_cylinder_wrinkles_in_bending(
    nodes: int, taut_deg: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stein and Hedgepeth (NASA TN D-813, 1961), up to 0.9 of collapse at p pi R^3: with cords taut
    up to the angle a from the outermost, M / (p pi R^3) = (a - sin a cos a) / (2 (sin a - a cos a))
    at the curvature pi p / (2 k (sin a - a cos a)). Strains are small here, and cords go slack
    within a hundredth of them."""
    a = np.radians(taut_deg)
    shape = np.sin(a) - a * np.cos(a)
    wanted = (a - np.sin(a) * np.cos(a)) / (2 * shape)
    assert 0.5 < wanted < 0.905
    strain = 1e-4
    monkeypatch.setattr(cords, "TRANSITION", strain / 100)
    assert moment(nodes, strain, np.pi / shape) == pytest.approx(wanted, rel=2e-3)


@pytest.mark.parametrize("curvature", [1.0, 3.0, 10.0])
def test_the_transition_is_not_felt_at_the_strains_of_a_carcass(
    curvature: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1 %, where the transition as it is moves the moment by less than 0.5 %."""
    smooth = moment(2, 0.01, curvature)
    monkeypatch.setattr(cords, "TRANSITION", 1e-7)
    assert smooth == pytest.approx(moment(2, 0.01, curvature), rel=5e-3)


@cache
def written(kPa: float) -> dict[str, str]:
    """Decks of a car's tyre by `init`, of few elements."""
    case = by_size("205/60R15")
    level = case.case.mesh.levels["coarse"]
    levels = {"default": with_part(level, rows=[1] * len(level.rows))}
    case = changed(case, mesh=with_part(case.case.mesh, levels=levels))
    texts = decks(with_values(case, {"pressure_kPa": kPa}))
    return {name: texts[f"{name}.inp"] for name in ("inflate", "modes")}


def solved(kPa: float, share: float = 1.0) -> tuple[Array, Array, Array]:
    """Eigenvalues of [0,0] with cords of the carcass ``share`` times as thick, their slopes by the
    logarithm of that area, and strains of tension-only cords over the transition's."""
    pair = dict(written(kPa))
    lines, places = pair["inflate"].splitlines(), []
    for i, line in enumerate(lines):
        if line.startswith(("CARCASS,", "CARCASS_TURN_UP,")):
            name, area, rest = line.split(",", 2)
            places.append(("inflate", i + 1, 1, float(area)))
            lines[i] = f"{name}, {float(area) * share!r},{rest}"
    assert len(places) == 2
    pair["inflate"] = "\n".join(lines) + "\n"
    request = Request(harmonics=[0], sensitivities={"area": places})
    job = Job(Deck(pair, "modes", "inflate"), request)
    modes = job.run()[-1]
    (part,) = (p for p in job.model.parts if isinstance(p, Elastic) and p.rows.B0.shape[2] == 3)
    assert isinstance(part.law, cords.LogarithmicCord)
    strain = np.log(cords.stretch(part.at(job.tyre.U)))[np.asarray(part.law.compressed) == 0]
    return modes.modes[0].eigenvalues, modes.rates["area"][0], strain / cords.TRANSITION


@pytest.mark.parametrize(
    ("kPa", "low", "high"),
    [
        pytest.param(200.0, -np.inf, -1.0, marks=pytest.mark.slow),
        (250.0, -1.0, -0.1),
        pytest.param(300.0, 0.1, 1.0, marks=pytest.mark.slow),
    ],
)
def test_slopes_are_exact_on_both_sides_of_slack_and_between(
    kPa: float, low: float, high: float
) -> None:
    """d lambda/d ln A of the carcass against central differences, where a point next to the rim is
    slack, or within the transition on either side."""
    _, slopes, strain = solved(kPa)
    assert ((low < strain) & (strain < high)).any()
    step = 1e-4
    wanted = (solved(kPa, 1 + step)[0] - solved(kPa, 1 - step)[0]) / (2 * step)
    assert slopes == pytest.approx(wanted, abs=2e-5 * abs(wanted).max())


def test_the_layer_that_is_compressed_most_is_named() -> None:
    """A tube bent by the strain e at its outermost cords: -e on the inside of the bend, to what the
    outermost station lacks of it."""
    strain, nodes, z = 1e-3, 3, np.linspace(0.0, LENGTH, 3)
    X = np.stack([np.full(nodes, R), z], -1)
    layer = Layer(np.arange(nodes)[None], 1e-6, 1e-3, TUBE_STIFFNESS * 1e3, 0.0, 0.0, False)
    around = half_circle(np.full(40, np.pi / 40))
    deck = support.deck(X, np.empty((0, 4), int), Rubber(), [layer])
    tube = Revolved(support.model_of(deck), [], around)
    bent = np.zeros((len(around.angles), nodes, 3))
    bent[..., 2] = strain * np.cos(around.angles)[:, None] * z
    tube.residual(bent)
    (part,) = (each for each in tube.parts if isinstance(each, cords.CordsAtStations))
    lowest, name, where = part.most_compressed()
    assert lowest == pytest.approx(np.log1p(-strain), rel=1e-2)
    assert sorted(where) == [0, 1, 2]
    assert f"\n{name}, " in deck
