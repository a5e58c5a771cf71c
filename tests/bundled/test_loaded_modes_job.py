"""Modes of the pressed tyre as decks ask for them and the job writes them; hold of the patch."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.modes.harmonics import HarmonicModes, Vibration
from tyrecal_solvers.bundled.road import footprint_job
from tyrecal_solvers.bundled.road.loaded_modes import LoadedModes, TyreOnRoad
from tyrecal_solvers.bundled.section.symmetry import HALF_TURN
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.language.text import DeckError

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign

from ..chance import generator
from . import support
from .contact import (
    LENGTHS,
    Round,
    State,
    coarse_case,
    held,
    modes,
    no_hold,
    press,
    shifted,
    soft_ring,
)

pytestmark = pytest.mark.numbers


Array = np.ndarray
LOADS = (1000.0,)


def texts(count: int = 6, **road: object) -> dict[str, str]:
    design = TyreDesign(coarse_case(**road))
    return Decks(design, loads_N=LOADS, loaded_modes=count).texts("abaqus")


def refused(folder: Path, edit: Callable[[str], str]) -> str:
    for name, text in texts().items():
        (folder / name).write_text(edit(text) if name == "press.inp" else text)
    with pytest.raises(DeckError) as error:
        job.run(folder, "press", "inflate")
    return str(error.value)


@pytest.mark.parametrize(
    ("pattern", "new", "words"),
    [
        (r"(?s)\*STEP, NAME=LOAD_1.*?\*END STEP\n", "", "come after a force"),
        (r"(MASS\n6\n\*BOUNDARY, OP=NEW\n.*\n)900002, 1, 6\n", r"\1", "must hold the road"),
        (r"(MASS\n6\n\*BOUNDARY, OP=NEW\n)900001, 1, 6\n", r"\g<1>900001, 3, 6\n", "held in 2, 6"),
        (r"MASS\n6\n", "MASS\n6, , 100.0\n", "limits and shifts"),
        (r"NSET=CROWN", "NSET=HUB", "a set of the section"),
        (r"PERTURBATION", "INTERMITTENT", "INTERMITTENT"),
        (r"LOAD_1, NLGEOM=YES", "LOAD_1, NLGEOM=YES, PERTURBATION", "no linear PERTURBATION"),
    ],
)
def test_what_is_not_honoured(tmp_path: Path, pattern: str, new: str, words: str) -> None:
    def edit(text: str) -> str:
        changed, count = re.subn(pattern, new, text)
        assert count
        return changed

    assert words in refused(tmp_path, edit)


def test_the_deck_says_how_the_wheel_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Held, or free along the load with the rim's mass, which no plain footprint's deck has."""
    vibrations: list[Any] = []

    def press(*given: Any) -> dict[str, Any]:
        vibrations.extend(each.modes for each in given[2].values())
        raise RunFailed("crashed", "enough")

    monkeypatch.setattr(footprint_job, "press", press)
    for wheel, kg in (("held", None), ("free_along_load", 15.0)):
        for name, text in texts(wheel=wheel).items():
            (tmp_path / name).write_text(text)
        with pytest.raises(RunFailed, match="enough"):
            job.run(tmp_path, "press", "inflate")
        assert vibrations[-1].wheel_kg == kg
    plain = Decks(TyreDesign(coarse_case(wheel="free_along_load")), loads_N=LOADS).texts("abaqus")
    assert "MASS" not in plain["press.inp"]


@pytest.fixture(scope="module")
def tyre() -> Round:
    return soft_ring()


def test_what_the_job_asks_for_and_how_it_writes_it(
    tyre: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Modes about the pressed state with its hold, from so many and spare ones of the inflated
    tyre, with the footprint's factor, given away once; their shapes on the whole tyre,
    kept or reversed by the half turn."""
    work = tyre.press(LENGTHS, 1e9, 0.5)
    state = work.to(10.0)
    k, nodes = len(work.tyre.around.angles), np.array([3, 0, 5])
    shapes = generator(2).normal(size=(2, k, len(tyre.U), 3))
    canned = LoadedModes(np.array([400.0, 900.0]) * np.pi**2, np.array([1, -1]), shapes)
    calls: list[Any] = []

    def lowest(vibration: Vibration, wanted: int, check: object) -> list[HarmonicModes]:
        calls.append((vibration.shift, wanted, vibration.factor(0).solve(np.ones(free))))
        return []

    loose = LoadedModes(np.array([100.0]) * np.pi**2, np.array([-1]), shapes[1:])

    def modes_(there: TyreOnRoad, holds: Any, *rest: Any) -> list[LoadedModes]:
        there.tyre.residual(there.U)
        calls.append((there.tyre.product(shapes[0]), holds, rest))
        return [canned, loose]

    monkeypatch.setattr(footprint_job, "lowest_of_all", lowest)
    monkeypatch.setattr(footprint_job, "loaded_modes", modes_)
    equations = support.numbering(tyre.model, ~tyre.free)
    free = equations.size
    wanted = footprint_job.ModeRequest(tyre.model, 2, nodes, 9.0)
    work.tyre.residual(0 * shapes[0])  # a state that is not the wanted one
    factor = work._factor
    written = footprint_job._modes(work, state, wanted, equations, tyre.U, work.tyre.around.angles)
    (shift, started, solved), (product, (hold, smooth), rest) = calls
    plain = Vibration(tyre.model, tyre.U, work.tyre.loads, equations, 0.0)
    np.testing.assert_array_equal(solved, plain.factor(0).solve(np.ones(free)))
    assert (shift, started) == (0.0, 2 + 6) and rest[:2] == ([], 2)
    here = press(tyre, 10.0)
    assert abs(hold - here.hold).max() < 1e-9 * abs(here.hold).max()
    V = shifted(tyre, here.around, 0)
    assert abs(smooth @ V.ravel() - hold @ V.ravel()).max() < 1e-9 * abs(here.hold).max()
    assert abs(smooth @ shifted(tyre, here.around, 1).ravel()).max() < 1e-3
    assert rest[-2] == 9.0
    assert rest[-1]() is factor is not None and rest[-1]() is None
    again = tyre.tyre(work.tyre.around)
    again.residual(here.U)
    np.testing.assert_allclose(product, again.product(shapes[0]), rtol=1e-9, atol=1e-6)
    assert written["mode_frequency_Hz"] == pytest.approx([10.0, 15.0])
    assert written["mode_node"].tolist() == [3, 0, 5]
    whole = written["mode_shape"]
    assert whole.shape == (2, 2 * (k - 1), 3, 3)
    np.testing.assert_allclose(whole[:, :k], shapes[:, :, nodes], atol=1e-12)
    other = work.symmetry.other[nodes]
    for ring_ in range(k, 2 * (k - 1)):
        image = HALF_TURN * shapes[:, 2 * (k - 1) - ring_][:, other]
        np.testing.assert_allclose(whole[:, ring_], [[[1.0]], [[-1.0]]] * image, atol=1e-12)


def test_traction_of_a_patch_that_sticks() -> None:
    """Sizes of the forces along the road, of both halves: down does not count, what is along at 30
    degrees is turned there, waves are not nodes."""
    around = half_circle(np.radians([30.0, 30.0]), 2)
    force = np.zeros((around.N.shape[1], 3, 3))
    force[0, 0] = 5.0, 3.0, -4.0
    force[2, 1] = 2.0 * np.array([np.sin(np.pi / 6), np.cos(np.pi / 6), 0.0])
    force[2, 2] = 7.0 * np.array([np.cos(np.pi / 6), -np.sin(np.pi / 6), 0.0])
    force[5] = 1.0
    assert footprint_job._traction(around, force) == pytest.approx(2 * (5.0 + 2.0))


@pytest.fixture(scope="module")
def pressed(tyre: Round) -> State:
    return press(tyre, 10.0)


def test_the_hold_is_the_contacts_stiffness_over_the_patch(tyre: Round, pressed: State) -> None:
    """Against a shift down, along or across it is k times the patch's area before deformation,
    and nothing couples them; without friction nothing holds along the road."""
    points = pressed.pressed.contact.points
    shifts = [shifted(tyre, pressed.around, i) for i in range(3)]
    forces = [held(pressed, V) for V in shifts]
    total = np.array([[(V * F).sum() for F in forces] for V in shifts])
    np.testing.assert_allclose(total, 1e9 * points.area.sum() * np.eye(3), rtol=1e-9, atol=1e-3)
    smooth = press(tyre, 10.0, 0.0)
    for i, V in enumerate(shifts):
        assert bool(abs(held(smooth, V)).max() > 1e-3) == (i == 0)


@pytest.mark.slow
def test_the_hold_goes_to_nothing_with_the_load(tyre: Round) -> None:
    """Over a patch as wide as the ring: its length, as a cylinder's on a rigid road, with the
    square root of the load (Hertz) where the rubber gives way, with the cubic where the road's
    stiffness alone does."""
    loads = np.array([3.0, 1.0, 0.1, 0.01])
    totals = np.array([press(tyre, load).pressed.contact.stiffness for load in loads])
    powers = np.diff(np.log(totals)) / np.diff(np.log(loads))
    assert (powers > 1 / 3 - 0.02).all() and (powers < 1 / 2 + 0.02).all()


@pytest.mark.slow
def test_light_loads_leave_the_unloaded_modes(tyre: Round) -> None:
    """The least frequencies come down to those of the same mesh without a road."""
    around = half_circle(LENGTHS)
    unloaded = modes(tyre, tyre.everywhere(around), no_hold(tyre, around), around, 8)
    away = []
    for load in (1.0, 0.1, 0.01):
        state = press(tyre, load, stiffness=1e7)
        loaded = modes(tyre, state.U, state.hold, state.around, 8)
        away.append(abs(loaded.eigenvalues / unloaded.eigenvalues - 1).max())
    assert away[0] > away[1] > away[2]
    assert away[2] < 0.4 * away[0]
