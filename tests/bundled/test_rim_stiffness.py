"""Stiffness of the rim on the road: what costs nothing, what costs as much as a load's rise, and
how a deck asks for it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.road import footprint_job
from tyrecal_solvers.bundled.road.half_turn_symmetry import HalfTurn
from tyrecal_solvers.bundled.road.loaded_modes import TyreOnRoad, hold_of_patch
from tyrecal_solvers.bundled.road.rim_stiffness import reactions, rim_stiffness
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.language.text import DeckError

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign

from . import support
from .contact import LENGTHS, Round, ball, coarse_case, soft_ring

pytestmark = pytest.mark.numbers
Array = np.ndarray


def stiffnesses(
    tyre: Round, loads: list[float], friction: float, lengths: Array = LENGTHS
) -> list[tuple[Array, float, float]]:
    """The rim's at each load, with the footprint's vertical stiffness and the road's height."""
    work = tyre.press(lengths, 1e9, friction)
    results = []
    for load in loads:
        state = work.to(load)
        U = work.symmetry.spread(state.parts)
        hold, factor = hold_of_patch(state.contact), work.release_factor()
        there = TyreOnRoad(work.tyre, work.symmetry, U, work.tyre.residual(U), lambda: None)
        C = rim_stiffness(there, hold, factor=factor)
        results.append((C, state.stiffness, state.height))
    return results


@pytest.fixture(scope="module")
def smooth() -> Array:
    """A ring's stiffness on a road without friction at 10 N."""
    ((C, down, _),) = stiffnesses(soft_ring(), [10.0], 0.0)
    assert C[0, 0] == pytest.approx(down, rel=1e-6)
    return C


def test_on_a_smooth_road_only_the_way_down_has_a_price(smooth: Array) -> None:
    """It is the footprint's tangent (see `smooth`) and the rise of the load over that of the
    deflection. Shifts along and across, the turn about the vertical and spin cost nothing."""
    work = soft_ring().press(LENGTHS, 1e9, 0.0)
    low, high = (work.to(load).height for load in (9.9, 10.1))
    assert smooth[0, 0] == pytest.approx(0.2 / (low - high), rel=2e-3)
    assert abs(smooth[[1, 2], [1, 2]]).max() < 1e-6 * smooth[0, 0]
    assert abs(smooth[[3, 5], [3, 5]]).max() < 0.05 * 10 * 0.1  # of the load on the ring's radius


def test_a_held_patch_lets_the_wheel_roll_and_no_more(smooth: Array) -> None:
    """All else is stiff, symmetric and stiffer than on a smooth road; rolling turns the ring about
    the patch, below the axle by the road's distance."""
    ((C, down, height),) = stiffnesses(soft_ring(), [10.0], 0.5)
    np.testing.assert_array_equal(C, C.T)
    values, motions = np.linalg.eigh(C)
    assert abs(values[0]) < 1e-3 * C[5, 5] and values[1] > 1.0
    assert motions[1, 0] / motions[5, 0] == pytest.approx(-height, rel=2e-3)
    assert np.linalg.eigvalsh(C - smooth).min() > -1e-3
    assert C[0, 0] == pytest.approx(down, rel=0.02)
    assert not C[np.ix_([0, 3], [1, 2, 4, 5])].any()  # by the half turn's symmetry


@pytest.mark.slow
def test_a_ball_turns_freely_about_any_axis() -> None:
    """On a smooth road; its sides, which are cut off, are far from the patch."""
    rubber = support.Rubber(C10=2e5, D1=2.5e-7)
    sphere = ball((0.08, 0.1), np.radians([0, 4, 8, 14, 25, 45, 65]), rubber)
    lengths = np.radians([3.0, 4.0, 6.0, 10.0, 17.0, 40.0, 100.0])
    ((C, down, _),) = stiffnesses(sphere, [2.0], 0.0, lengths)
    assert C[0, 0] == pytest.approx(down, rel=1e-6)
    assert abs(np.diag(C)[3:]).max() < 0.2 * 2.0 * 0.1  # of the load on its radius


@pytest.mark.slow
def test_an_inflated_tyre_without_a_road_costs_nothing_to_move() -> None:
    """The forces that hold its beads are some 10 kN m/rad, about a diameter with those of its
    cavity's ends."""
    texts = Decks(TyreDesign(coarse_case()), loads_N=(1000.0,)).texts("abaqus")
    decks = {name.removesuffix(".inp"): text for name, text in texts.items()}
    work = job.Job(Deck(decks, "press", "inflate"), Request())
    inflate = work.steps[0]
    inflate.held = work._off_road(inflate).held
    work._static(inflate)
    for step in work.steps:
        step.held = work._off_road(step).held
    _, inflated = work._on_road()
    model, equations = inflated.model, inflated.equations
    around = half_circle(np.radians([60.0, 60.0, 60.0]))
    symmetry = HalfTurn(model.mesh, equations.equation < equations.size, around)
    U = np.multiply.outer(around.turn(0).real, work.tyre.U)
    tyre, none = Revolved(model, inflated.loads, around), csr_matrix((U.size, U.size))
    C = rim_stiffness(TyreOnRoad(tyre, symmetry, U, tyre.residual(U), lambda: None), none)
    assert abs(C).max() < 0.01


@pytest.mark.slow
def test_stiffnesses_are_smooth_over_the_load() -> None:
    """Their second differences are as small as the vertical one's."""
    loads = [6.0, 7.0, 8.0, 9.0, 10.0]
    values = np.array([np.diag(C)[:4] for C, *_ in stiffnesses(soft_ring(), loads, 0.5)])
    assert (np.diff(values, axis=0) > 0).all()
    assert (abs(np.diff(values, 2, axis=0)) < 0.01 * values[1:-1]).all()


def test_reactions_are_along_the_decks_axes() -> None:
    """1 is down, 2 the axle, 3 against the rolling direction; the same of turns."""
    C = np.arange(36.0).reshape(6, 6)
    C += C.T
    moved = reactions(C, np.eye(6))
    place, sign = np.array([0, 2, 1, 3, 5, 4]), np.array([1, 1, -1, 1, 1, -1])
    np.testing.assert_array_equal(moved, sign[:, None] * sign * C[np.ix_(place, place)])


def texts() -> dict[str, str]:
    design = TyreDesign(coarse_case())
    return Decks(design, loads_N=(1000.0, 2000.0), rim_stiffness=True).texts("abaqus")


def test_the_deck_moves_the_rim_in_six_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    requests: dict[float, Any] = {}

    def press(*given: Any) -> dict[str, Any]:
        requests.update({load: each.rim for load, each in given[2].items()})
        raise RunFailed("crashed", "enough")

    monkeypatch.setattr(footprint_job, "press", press)
    for name, text in texts().items():
        (tmp_path / name).write_text(text)
    with pytest.raises(RunFailed, match="enough"):
        job.run(tmp_path, "press", "inflate")
    assert requests.keys() == {1000.0, 2000.0}
    lengths = re.findall(r"(.*), 1, 1.0, C\n", (tmp_path / "press.inp").read_text())
    assert max(map(float, lengths)) <= 12.0  # degrees: the whole tyre bends
    for each in requests.values():
        np.testing.assert_array_equal(each.motions, np.eye(6))
        assert each.reference_z == 0.0


@pytest.mark.parametrize(
    ("pattern", "new", "words"),
    [
        (r"(?s)\*STEP, NAME=LOAD_1.*?\*END STEP\n", "", "come after a force"),
        (r"RIM_1, PERTURBATION", "RIM_1, PERTURBATION, NLGEOM=YES", "no linear PERTURBATION"),
        (r"(RIM_1, PERTURBATION\n\*STATIC)", r"\1\n0.1, 1.0", "takes no data"),
        (r"900001, 6, 6, 0.0\n", "", "needs a displacement in each of 1 to 6"),
        (r"(900001, 6, 6, 0.0\n)900002, 1, 6\n", r"\g<1>900002, 2, 6\n", "must be held in 1, 6"),
        (r"(LOAD_1(?s:.)*?900001), 1, 6", r"\1, 1, 6, 0.01", "only zero displacements"),
    ],
)
def test_what_is_not_honoured(tmp_path: Path, pattern: str, new: str, words: str) -> None:
    def edit(text: str) -> str:
        changed, count = re.subn(pattern, new, text)
        assert count
        return changed

    for name, text in texts().items():
        (tmp_path / name).write_text(edit(text) if name == "press.inp" else text)
    with pytest.raises(DeckError, match=words):
        job.run(tmp_path, "press", "inflate")
