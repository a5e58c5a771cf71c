"""The first wave in a cavity that is not the same all round: closed forms of acoustics."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.request import CavityRequest, Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.road.pressed_cavity import cavity_modes

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.values import with_values

from ..effects.support import CASE
from .test_cavity import BULK, RHO, C, rectangle, resonances

Array = np.ndarray
ANGLES = np.concatenate([np.radians([0.0, 7.0, 20.0]), np.arange(3, 24) * 2 * np.pi / 24])


def moved(field: Array, nodes: int = 4) -> Array:
    """A displacement (ring, 3) as that of all nodes."""
    return np.repeat(field[:, None], nodes, 1)


def test_the_same_all_round() -> None:
    """Both members are the rigid duct's wave (Bessel functions, `test_cavity`)."""
    X, air = rectangle(0.25, 0.40, 0.1)
    at_rest = cavity_modes(air, X, np.zeros((len(ANGLES), 4, 3)), ANGLES)
    np.testing.assert_allclose(at_rest, resonances(0.25, 0.40, 1)[0], rtol=1e-8)


@pytest.mark.parametrize("direction", ["down", "turned", "along"])
def test_a_cavity_that_moves_as_a_whole_keeps_its_frequencies(direction: str) -> None:
    X, air = rectangle(0.25, 0.40, 0.1)
    c, s, r = np.cos(ANGLES), np.sin(ANGLES), X[:, 0]
    u = {
        "down": moved(np.stack([c, -s, 0 * c], -1) * 0.01),
        "turned": np.zeros((len(ANGLES), 4, 3)) + np.stack([r * 0, r * 0, r * 0], -1),
        "along": moved(np.stack([0 * c, 0 * c, 0.02 + 0 * c], -1)),
    }[direction]
    if direction == "turned":
        u = u + np.stack([r * (np.cos(0.1) - 1), r * np.sin(0.1), 0 * r], -1)
    wanted = resonances(0.25, 0.40, 1)[0]
    np.testing.assert_allclose(cavity_modes(air, X, u, ANGLES), wanted, rtol=1e-6)


def test_the_areas_second_harmonic_splits_a_thin_torus() -> None:
    """Webster's equation with A = A0 (1 + a cos 2 phi): c / (2 pi R) (1 -+ a / 2) to first order;
    narrow at the patch, the vertical mode is the higher one."""
    R, h = 0.3, 0.01
    X, air = rectangle(R - h, R + h, 2 * h)
    first = C / (2 * np.pi * R)
    lack = []
    for a in (-0.04, -0.02, 0.02):
        scale = np.sqrt(1 + a * np.cos(2 * ANGLES)) - 1
        u = np.zeros((len(ANGLES), 4, 3))
        u[..., 0::2] = scale[:, None, None] * (X - [R, h])
        fore_aft, vertical = cavity_modes(air, X, u, ANGLES)
        assert (vertical - fore_aft) / first == pytest.approx(-a, rel=2e-3)
        lack.append((vertical + fore_aft) / 2 / first - 1)
    assert max(map(abs, lack)) < 5e-4
    # no first harmonic splits it at first order, nor a fourth
    for n in (1, 4):
        scale = np.sqrt(1 + 0.02 * np.cos(n * ANGLES)) - 1
        u = np.zeros((len(ANGLES), 4, 3))
        u[..., 0::2] = scale[:, None, None] * (X - [R, h])
        assert np.ptp(cavity_modes(air, X, u, ANGLES)) < 2e-4 * first


def test_frequencies_are_those_of_the_gas() -> None:
    X, air = rectangle(0.25, 0.40, 0.1)
    u = np.zeros((len(ANGLES), 4, 3))
    heavy = replace(air, density=4 * RHO)
    stiff = replace(air, bulk=9 * BULK)
    one = cavity_modes(air, X, u, ANGLES)
    np.testing.assert_allclose(cavity_modes(heavy, X, u, ANGLES), one / 2, rtol=1e-9)
    np.testing.assert_allclose(cavity_modes(stiff, X, u, ANGLES), one * 3, rtol=1e-9)


LOADS = (1000.0, 3000.0)
FILLED = TyreDesign(with_values(CASE, {"cavity.share": 1.0}))


def test_only_loaded_modes_ask_for_the_cavity(tmp_path: Path) -> None:
    """Loaded modes request the cavity only with a gas; the stored answer of a footprint depends
    on its decks alone."""
    filled, empty = FILLED, TyreDesign(CASE)
    Bundled().write(Decks(filled, loads_N=LOADS), tmp_path)
    Bundled().write(Decks(empty, loads_N=LOADS, loaded_modes=4), tmp_path)
    assert not list(tmp_path.glob("*.json"))
    Bundled().write(Decks(filled, loads_N=LOADS, loaded_modes=4), tmp_path)
    (path,) = tmp_path.glob("*.json")
    assert path.name == "press.request.json"
    cavity = {"material": "CAVITY_GAS", "surfaces": ["CAVITY", "WELL"]}
    assert json.loads(path.read_text()) == {"cavity": cavity}


@pytest.mark.slow
def test_a_tyre_on_the_road() -> None:
    """The mean stays where it was, near c / (2 pi R), the vertical mode rises, the fore-aft one
    falls, the split grows; without a gas there is none."""
    texts = Decks(FILLED, loads_N=LOADS).texts("abaqus")
    pair = {name: texts[f"{name}.inp"] for name in ("inflate", "press")}
    cavity = CavityRequest("CAVITY_GAS", ["CAVITY", "WELL"])
    result = Job(Deck(pair, "press", "inflate"), Request(cavity=cavity)).press()
    free, splits = result["cavity_Hz"], [0.0]
    assert free == pytest.approx(186.0, rel=0.01)
    for each in result["footprints"]:
        fore_aft, vertical = each["cavity_Hz"]
        assert fore_aft < free < vertical
        assert (fore_aft + vertical) / 2 == pytest.approx(free, rel=1e-3)
        splits.append(vertical - fore_aft)
    assert splits[0] < splits[1] < splits[2] < 5.0
    pair["press"] = Decks(FILLED, loads_N=LOADS[:1]).texts("abaqus")["press.inp"]
    plain = Job(Deck(pair, "press", "inflate"), Request()).press()
    assert "cavity_Hz" not in plain and "cavity_Hz" not in plain["footprints"][0]
