"""Derivatives of modes whose rim moves and whose cavity holds air, against central differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from tyrecal_solvers.bundled.modes import sensitivity
from tyrecal_solvers.bundled.modes.bordered import Bordered
from tyrecal_solvers.bundled.modes.cavity import GasCavity
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.modes.wheel import Wheel
from tyrecal_solvers.bundled.section import model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.language import text as language

from . import support
from .wheel_and_gas import MOTIONS, REFERENCE, STEEL, closed

Array = np.ndarray
PRESSURE, HARMONICS, COUNT = 240e3, (0, 1, 2), 2
TYRE = support.tyre((3, 2, 2, 1))
DECK = closed(TYRE.deck, 0.02)
LINES = DECK.splitlines()
SPRINGS = {"axial": 1e6, "radial": 2e6, "spin": 3e4, "tilt": 2e4}
NODES = LINES.index("*NODE, NSET=ALL") + 1
BELT = next(i for i, line in enumerate(LINES) if line.startswith("L2,"))


@dataclass(frozen=True)
class Variable:
    """Numbers of the deck, (0-based line, field): each moves by ``scale`` times p."""

    places: tuple[tuple[int, int], ...]
    scale: float

    def deck(self, p: float) -> str:
        lines = LINES.copy()
        for line, field in self.places:
            fields = lines[line].split(",")
            fields[field] = repr(float(fields[field]) + p * self.scale)
            lines[line] = ",".join(fields)
        return "\n".join(lines)

    def seeded(self) -> model.Model:
        tangents = [(line + 1, field, self.scale) for line, field in self.places]
        return model.build(language.seed(language.read_keywords(DECK), tangents), None, True)


RIM = [NODES + row for row in TYRE.rim]
AXLE = LINES.index(f"{REFERENCE}, 0.0, 0.02")
VARIABLES = {
    "R of the rim": Variable(tuple((i, 1) for i in RIM), 0.001),
    "Z of one of its nodes": Variable(((RIM[0], 2),), 0.003),
    "Z of the axle's point": Variable(((AXLE, 2),), 0.01),
    "belt area": Variable(((BELT, 1),), 2.1e-7),
}


def around(m: model.Model, with_air: bool) -> tuple[Wheel, GasCavity | None, list[Pressure]]:
    """The wheel on its springs, the air, and the loads on cavity and well."""
    loads = [Pressure(m.mesh.faces[name], PRESSURE) for name in ("CAVITY", "WELL")]
    row = m.mesh.index[REFERENCE]
    wheel = Wheel(row, np.array(TYRE.rim), frozenset(MOTIONS), SPRINGS, STEEL)
    return (
        wheel,
        GasCavity(4.06, 4.78e5, [load.lines for load in loads]) if with_air else None,
        loads,
    )


def solved(text: str, with_air: bool) -> tuple[Vibration, Array, list]:
    m = support.model_of(text)
    wheel, air, loads = around(m, with_air)
    held = support.held(m, [*TYRE.rim, m.mesh.index[REFERENCE]])
    U = support.inflate(m, held, loads[:1])
    vibration = Vibration(m, U, loads, support.numbering(m, held), 0.0, wheel, air)
    return vibration, U, [vibration.modes(n, COUNT) for n in HARMONICS]


def eigenvalues(text: str, with_air: bool) -> Array:
    return np.concatenate([m.eigenvalues for m in solved(text, with_air)[2]])


@pytest.mark.parametrize("with_air", [False, True])
@pytest.mark.parametrize("name", VARIABLES)
def test_against_central_differences(name: str, with_air: bool) -> None:
    """d lambda/dp of six modes, within 1e-5 of the largest, the rim's shapes carried along with its
    nodes; with air 1e-4, since its quadrature starts from the middle of the section, which stays
    where it is for the derivative. No eigenvalue depends on a mode's phase: multiplied by i^0.3,
    the amplitudes of the rim and of the air have both parts."""
    variable = VARIABLES[name]
    vibration, U, modes = solved(DECK, with_air)
    turn = np.exp(0.3j * np.pi / 2)
    shapes = np.concatenate([m.shapes for m in modes]) * turn
    rim = [q * turn for m in modes for q in (m.rim if len(m.rim) else np.zeros((COUNT, 0)))]
    flow = [w * turn for m in modes for w in (m.air if len(m.air) else np.zeros((COUNT, 0)))]
    seeded = variable.seeded()
    wheel, air, loads = around(seeded, with_air)
    factor = vibration.factor(0)
    assert isinstance(factor, Bordered)
    V = sensitivity.state_rate(seeded, U, loads, vibration.numbering, factor.tyre)
    got = sensitivity.eigenvalue_rates(
        seeded,
        U,
        V,
        loads,
        sensitivity.ModeShapes(np.repeat(HARMONICS, COUNT), shapes),
        np.concatenate([m.eigenvalues for m in modes]),
        sensitivity.RimAndAir(wheel, air, rim, flow),
    )
    h = 5e-3
    at = {k: eigenvalues(variable.deck(k * h), with_air) for k in (-2, -1, 1, 2)}
    wanted = (8 * (at[1] - at[-1]) - at[2] + at[-2]) / (12 * h)
    assert abs(got - wanted).max() <= (1e-4 if with_air else 1e-5) * abs(wanted).max()
    assert abs(wanted[:4]).max() > 1.0  # of the modes in which the rim moves
