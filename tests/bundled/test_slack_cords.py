"""Cords that bear no compression, in whole models: a tube that wrinkles, and slopes at the edge."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.section.parts import cords
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
R, LENGTH, STIFFNESS = 0.2, 0.05, 1e6  # m, m, E A / s in N/m


def moment(nodes: int, strain: float, curvature: float) -> float:
    """M / (p pi R^3) of a tube of axial cords with the pressure p = 2 k ``strain`` / R in it,
    bent to ``curvature`` times p / (2 k): k = E A / s. Its end turns as a plane."""
    z = np.linspace(0.0, LENGTH, nodes)
    layer = Layer(np.arange(nodes)[None], 1e-6, 1e-3, STIFFNESS * 1e3, 0.0, 0.0, True)
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

    thrust = 2 * np.pi * R * STIFFNESS * strain  # p pi R^2
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
    layer = Layer(np.arange(nodes)[None], 1e-6, 1e-3, STIFFNESS * 1e3, 0.0, 0.0, False)
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
