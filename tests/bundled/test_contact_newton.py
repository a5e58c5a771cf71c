"""A ring pressed on the road by Newton's method: steps, unstable states, slopes, time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.road import contact_newton
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton, Imbalance, PressedState
from tyrecal_solvers.errors import Indefinite, NoEquilibrium, RunFailed

from .contact import GRADED, Late, Round, solid_ring

Array = np.ndarray


@pytest.fixture(scope="module")
def solid() -> Round:
    return solid_ring()


@pytest.mark.slow
def test_a_first_load_out_of_reach_fails(solid: Round) -> None:
    for load in (1e7, 2e4):
        with pytest.raises(NoEquilibrium, match="flat on its rim"):
            solid.press(GRADED, 1e10).to(load)


def test_a_clock_that_runs_out_between_loads(solid: Round) -> None:
    """The loads reached before stay."""
    press = solid.press(GRADED, 1e10)
    first = press.to(50.0)
    press.check = Late(1)
    with pytest.raises(RunFailed):
        press.to(200.0)
    assert press.load == 50.0
    np.testing.assert_array_equal(press.parts, first.parts)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_two_presses_give_the_same_bits(solid: Round, friction: float) -> None:
    runs: list[ContactNewton] = []
    for _ in range(2):
        runs.append(solid.press(GRADED, 1e10, friction))
        for load in (50.0, 100.0):
            runs[-1].to(load)
    np.testing.assert_array_equal(runs[0].parts, runs[1].parts)
    assert runs[0].height == runs[1].height


def test_off_the_road_there_is_no_step(solid: Round) -> None:
    """Newton's step has overshot to where nothing touches: a smaller load is tried."""
    press = solid.press(GRADED, 1e10)
    lifted = press._state(press.parts, press.height + 0.01, 100.0, None)
    with pytest.raises(NoEquilibrium, match="no force answers"):
        press._step(lifted, 1e-6)


def test_nearly_the_same_load_again(solid: Round) -> None:
    """A start that is in equilibrium already needs no step, and has its stiffness all the same."""
    press = solid.press(GRADED, 1e10)
    first = press.to(50.0)
    again = press.to(50.0 * (1 + 1e-9))
    assert again.height == pytest.approx(first.height, rel=1e-9)
    assert again.stiffness == pytest.approx(first.stiffness, rel=2e-3)


@pytest.mark.slow
def test_a_stiffness_that_is_not_found_is_no_number(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(contact_newton, "MAX_UNIT_RESIDUAL", 1e-30)
    with pytest.raises(NoEquilibrium, match="vertical stiffness was not found in 60 iterations"):
        solid.press(GRADED, 1e10).to(50.0)


def test_a_little_more_load_is_one_step_along_the_slope(solid: Round) -> None:
    """1 % more: what the slope by the load leaves is of second order, and what one step of Newton's
    method leaves of that of fourth, so two do, with the preconditioner of the load before; without
    the slope it takes several. A fifth more has one of its own."""
    press = solid.press(GRADED, 1e10)
    states = [press.to(load) for load in (198.0, 200.0)]
    before = press.iterations, press.factorisations
    states.append(press.to(202.0))
    assert (press.iterations, press.factorisations) == (before[0] + 2, before[1])
    parts, heights = np.array([f.parts for f in states]), [f.height for f in states]
    curved = np.linalg.norm(parts[0] - 2 * parts[1] + parts[2])
    assert curved < 0.02 * np.linalg.norm(parts[2] - parts[1])
    assert abs(heights[0] - 2 * heights[1] + heights[2]) < 0.02 * (heights[1] - heights[2])
    press.to(242.0)
    assert press.factorisations == before[1] + 1


@pytest.mark.parametrize(("used", "formed"), [(8, 0), (9, 1)])
def test_after_many_iterations_the_preconditioner_is_formed_anew(
    solid: Round, used: int, formed: int
) -> None:
    press = solid.press(GRADED, 1e10)
    press.to(50.0)
    state = press._state(press.parts, press.height, 51.0, None)
    before, press._used = press.factorisations, used
    press._step(state, 1e-2)
    assert press.factorisations == before + formed and press._used < 15


def test_an_unstable_tangent_has_no_preconditioner(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one before is let go first, as memory holds but one: the load is not reached."""
    press = solid.press(GRADED, 1e10)
    contact = press.to(50.0).contact
    alive: list[bool] = []

    def unstable(*given: object) -> None:
        alive.append(press._factor is not None)
        raise Indefinite

    monkeypatch.setattr(contact_newton, "Factor", unstable)
    with pytest.raises(Indefinite):
        press._form(contact)
    assert alive == [False]
    with pytest.raises(NoEquilibrium, match="no equilibrium between 50 and"):
        press.to(60.0)


def pressed_past(
    unstable: Callable[[int], bool], solid: Round, monkeypatch: pytest.MonkeyPatch
) -> tuple[PressedState, list[float], list[bool]]:
    """The state at 100 N where true preconditioners with these numbers cannot be formed, one for
    each step; the loads on the way, and whether each preconditioner was of a steadied tangent."""
    form, steadied, loads = ContactNewton._form, list[bool](), list[float]()

    def formed(press: ContactNewton, contact: Any) -> Any:
        steadied.append(press._steadied)
        if unstable(len(steadied) - 1) and not press._steadied:
            raise Indefinite("unstable")
        return form(press, contact)

    with monkeypatch.context() as patch:
        patch.setattr(contact_newton, "MAX_GMRES_BEFORE_NEW_FACTOR", -1)
        patch.setattr(ContactNewton, "_form", formed)
        press = solid.press(GRADED, 1e10)
        patch.setattr(press, "settled", lambda work, state: loads.append(work.load))
        return press.to(100.0), loads, steadied


@pytest.mark.parametrize("unstable", [(), (0,), (2,), (4,)])
def test_a_steadied_tangent_leads_past_unstable_states(
    solid: Round, monkeypatch: pytest.MonkeyPatch, unstable: tuple[int, ...]
) -> None:
    """To the same state, by no smaller load, and only where it is needed."""
    state, reached, steadied = pressed_past(unstable.__contains__, solid, monkeypatch)
    assert reached == [100.0]
    assert [steadied[i + 1] for i in unstable] == [True] * len(unstable)
    assert any(steadied) == bool(unstable) and not steadied[-1]
    plain = solid.press(GRADED, 1e10).to(100.0)
    assert state.height == pytest.approx(plain.height, rel=1e-8)
    assert state.stiffness == pytest.approx(plain.stiffness, rel=1e-6)


@pytest.mark.parametrize("unstable", [3, 4])
def test_after_some_steps_the_true_tangent_is_tried(
    solid: Round, monkeypatch: pytest.MonkeyPatch, unstable: int
) -> None:
    """And kept where it is stable by then."""
    monkeypatch.setattr(contact_newton, "STEADIED_STEPS", 2)
    _, _, steadied = pressed_past(lambda i: i < unstable, solid, monkeypatch)
    assert steadied[:5] == [False, True, True, False, unstable == 4]


@pytest.mark.slow
def test_a_load_that_is_reached_past_an_unstable_state_is_a_stable_one(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is halved where its own tangent has no preconditioner; else that is not looked at."""
    _, reached, steadied = pressed_past((2,).__contains__, solid, monkeypatch)
    last = len(steadied) - 1
    assert reached == [100.0] and not steadied[last]
    assert pressed_past((2, last).__contains__, solid, monkeypatch)[1] == [50.0, 100.0]
    many = len(pressed_past(().__contains__, solid, monkeypatch)[2])
    assert pressed_past((many,).__contains__, solid, monkeypatch)[1] == [100.0]


@pytest.mark.parametrize("most", [2, pytest.param(99, marks=pytest.mark.slow)])
def test_no_state_that_is_not_stable_is_a_result(
    solid: Round, monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    """Where no true tangent is stable a steadied one reaches the force, but not the load, which is
    given up after so many states, or at a sixteenth of it."""
    monkeypatch.setattr(contact_newton, "MAX_UNSTABLE", most)
    last = "100" if most == 2 else "6"
    with pytest.raises(NoEquilibrium, match=f"no equilibrium between 0 and {last}"):
        pressed_past(lambda i: True, solid, monkeypatch)


def test_a_guess_that_comes_to_an_unstable_state_is_a_bad_one(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Past that it may find another equilibrium: the answer is that without a guess."""
    cold, form = solid.press(GRADED, 1e10).to(100.0), ContactNewton._form
    press, steadied = solid.press(GRADED, 1e10), list[bool]()

    def formed(press: ContactNewton, contact: Any) -> Any:
        steadied.append(press._steadied)
        if len(steadied) == 1:
            raise Indefinite("unstable")
        return form(press, contact)

    monkeypatch.setattr(ContactNewton, "_form", formed)
    deflection = 1.1 * (press.free_radius - cold.height)
    press.guesses[100.0] = contact_newton.FirstGuess(cold.parts, deflection)
    np.testing.assert_array_equal(press.to(100.0).parts, cold.parts)
    assert len(steadied) > 1 and not any(steadied)


def test_of_a_load_that_is_not_taken_nothing_is_left(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next try starts along the slope of the last load, with its bounds of friction."""
    press, newton = solid.press(GRADED, 1e10, 0.5), ContactNewton._newton
    press.to(50.0)
    known = press._slope, press._bound

    def unstable(*given: object) -> None:
        raise Indefinite("unstable")

    def without_a_slope(load: float) -> PressedState:
        newton(press, load)
        monkeypatch.setattr(press, "_form", unstable)
        assert press._slope is not known[0] and press._bound is not known[1]
        raise Indefinite("unstable")

    monkeypatch.setattr(press, "_newton", without_a_slope)
    with pytest.raises(NoEquilibrium, match="no equilibrium between 50 and"):
        press.to(60.0)
    assert press._slope is known[0] and press._bound is known[1] and press.load == 50.0


def test_time_is_looked_at_before_every_iteration(solid: Round) -> None:
    looks: list[int] = []
    press = solid.press(GRADED, 1e10, check=lambda: looks.append(1))
    press.to(50.0)
    looks.clear()
    before = press.iterations
    state = press.parts, press.height - 1e-4, 100.0, None, 1e-8
    press._iterate(*state)
    assert len(looks) == press.iterations - before + 1 > 2


def test_friction_that_does_not_converge_is_left_soon(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The iteration ends one step after the last that may fail to halve the residual."""
    press = solid.press(GRADED, 1e10, 0.5)
    press.to(50.0)
    monkeypatch.setattr(press, "_step", lambda *given: (0 * press.parts, 0.0))
    before = press.iterations
    with pytest.raises(NoEquilibrium, match="did not converge"):
        press._iterate(press.parts, press.height - 1e-4, 100.0, None, 1e-8)
    assert press.iterations == before + contact_newton.MAX_SETBACKS + 1


@pytest.mark.parametrize(
    ("residual", "tried"),
    [
        ({0.0: 10.0, 1.0: 9.0}, [0.0, 1.0]),
        ({0.0: 10.0, 1.0: 30.0, 0.5: 9.0}, [0.0, 1.0, 0.5]),
        ({0.0: 10.0, 1.0: 30.0, 0.5: 20.0, 0.25: 11.0}, [0.0, 1.0, 0.5, 0.25]),
    ],
)
def test_a_step_with_coulombs_friction_is_halved_for_a_smaller_residual(
    solid: Round, monkeypatch: pytest.MonkeyPatch, residual: dict[float, float], tried: list[float]
) -> None:
    """Twice at most: where points begin to slide the residual may have to grow."""
    press, lengths = solid.press(GRADED, 1e10, 0.5), list[float]()
    contact = press.road.forces(press.symmetry.spread(press.parts), press.height)

    def state(parts: Array, height: float, *_: object) -> Imbalance:
        lengths.append(height)
        return Imbalance(0 * parts, residual[height], contact)

    def step(*_: object) -> tuple[Array, float]:
        if len(lengths) > 1:
            raise NoEquilibrium("the first step has been taken")
        return 0 * press.parts, 1.0

    monkeypatch.setattr(press, "_state", state)
    monkeypatch.setattr(press, "_step", step)
    with pytest.raises(NoEquilibrium):
        press._iterate(press.parts, 0.0, 100.0, None, 1e-8)
    assert lengths == tried


@pytest.mark.slow
def test_a_load_begins_at_its_guess(solid: Round, monkeypatch: pytest.MonkeyPatch) -> None:
    """At once, however large it is, and by Tresca's friction where Coulomb's does not converge."""
    load, begun = 3000.0, list[tuple[bool, float]]()
    cold = solid.press(GRADED, 1e10, 0.5)
    state = cold.to(load)
    settle = ContactNewton._iterate

    def note(self: ContactNewton, parts: Array, height: float, N: float, *rest: Any) -> Any:
        begun.append((rest[0] is not None, height))
        if len(begun) == 1:
            raise NoEquilibrium("Coulomb's friction")
        return settle(self, parts, height, N, *rest)

    monkeypatch.setattr(ContactNewton, "_iterate", note)
    press = solid.press(GRADED, 1e10, 0.5)
    deflection = 1.1 * (press.free_radius - state.height)
    press.guesses[load] = contact_newton.FirstGuess(state.parts, deflection)
    warm = press.to(load)
    height = press.free_radius - deflection
    assert begun[:2] == [(False, height), (True, height)]
    assert warm.height == pytest.approx(state.height, rel=1e-8)
    assert press.iterations < 0.7 * cold.iterations


@pytest.mark.parametrize(("share", "words"), [(0.9e-4, "no lower energy"), (1.1e-4, "converge")])
def test_the_line_search_asks_for_a_ten_thousandth_of_the_slope(
    solid: Round, monkeypatch: pytest.MonkeyPatch, share: float, words: str
) -> None:
    """An energy that falls by a share of what the forces on the parts and on the road tell."""
    press = solid.press(GRADED, 1e10)
    press.to(50.0)
    parts, height = press.parts, press.height - 1e-5
    force, lacking, _ = press._state(parts, height, 100.0, press._bound)
    step, rise = -1e-9 * force / (force**2).sum(), -1e-9 / lacking
    monkeypatch.setattr(press, "_step", lambda *given: (step, rise))
    fall = lambda contact, load, at: -share * 2e-9 * (at - height) / rise
    monkeypatch.setattr(press, "_energy", fall)
    with pytest.raises(NoEquilibrium, match=words):
        press._iterate(parts, height, 100.0, press._bound, 1e-8)


def test_a_load_starts_along_the_slope_of_the_last_one(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one by a micrometre per newton."""
    press = solid.press(GRADED, 1e10)
    started: list[tuple[Array, float]] = []
    settle = ContactNewton._iterate

    def note(self: ContactNewton, parts: Array, height: float, *rest: Any) -> Any:
        started.append((parts, height))
        return settle(self, parts, height, *rest)

    monkeypatch.setattr(ContactNewton, "_iterate", note)
    rest, free = press.parts, press.free_radius
    first = press.to(50.0)
    np.testing.assert_array_equal(started[0][0], rest)
    assert started[0][1] == pytest.approx(free - 50e-6, abs=1e-12)
    started.clear()
    slope = press._slope
    press.to(80.0)
    assert slope is not None and slope[1] < 0
    np.testing.assert_allclose(started[0][0], first.parts + 30 * slope[0], atol=1e-15)
    assert started[0][1] == pytest.approx(first.height + 30 * slope[1], abs=1e-12)
    assert slope[1] == pytest.approx(-1 / first.stiffness)


def test_how_far_down_is_told_in_words(solid: Round) -> None:
    """The way ends where the crown, 10 mm thick, lies on the rim, 200 mm from the axle."""
    X = np.array(
        [[0.15, 0.0], [0.2, 0.1], [0.2, -0.1], [0.3, 0.1], [0.31, 0], [0.305, 0], [0.3, 0]]
    )
    assert ContactNewton._flat_height(X, np.array([1, 2])) == pytest.approx(0.21)
    assert ContactNewton._flat_height(X[3:], np.array([], int)) == pytest.approx(0.01)
    press = solid.press(GRADED, 1e10)
    assert press.depth() == ""
    press.flat, press.height, press.load = press.free_radius - 0.04, press.free_radius - 0.013, 1.0
    assert press.depth() == " (13 of 40 mm down to the rim)"


def test_a_time_limit_names_the_cords_that_buckle(
    solid: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a state on the way was unstable, before the first load, too; else only the load."""
    press = solid.press(GRADED, 1e10)
    monkeypatch.setattr(press, "_buckling", lambda: "the cords of layer A buckle")
    assert press.progress() == ""
    press._steady(True)
    assert press.progress() == ": the cords of layer A buckle"
    press.to(50.0)
    assert press.progress().startswith(" after 50 N (0 of ")
    press._steady(True)
    assert press.progress().endswith(" mm down to the rim): the cords of layer A buckle")


@pytest.mark.parametrize(("most_N", "reached"), [(101.0, 2), (26.0, 8), (12.6, 16), (12.4, 0)])
def test_a_load_is_reached_in_up_to_sixteen_steps(
    solid: Round, monkeypatch: pytest.MonkeyPatch, most_N: float, reached: int
) -> None:
    """Steps are halved until Newton's method finds a state; time is looked at before each."""
    press, looks = solid.press(GRADED, 1e10), []
    monkeypatch.setattr(press, "check", lambda: looks.append(1))
    first, taken = press.to(50.0), []

    def newton(load: float) -> object:
        if load > press.load + most_N:
            raise NoEquilibrium("too much")
        taken.append(load)
        return first

    monkeypatch.setattr(press, "_newton", newton)
    looks.clear()
    if reached:
        press.to(250.0)
        assert taken == pytest.approx([50.0 + 200.0 / reached * (i + 1) for i in range(reached)])
        assert len(looks) == reached + np.log2(reached)
    else:
        with pytest.raises(
            NoEquilibrium, match=r"no equilibrium between 50 and 62.5 N \(.*too much"
        ):
            press.to(250.0)


def test_a_much_larger_load_after_a_small_one(solid: Round) -> None:
    """A hundred times the load: the same as at once."""
    press = solid.press(GRADED, 1e10)
    press.to(5.0)
    state, direct = press.to(500.0), solid.press(GRADED, 1e10).to(500.0)
    assert state.height == pytest.approx(direct.height, rel=1e-8)
    np.testing.assert_allclose(state.parts, direct.parts, atol=1e-6 * abs(direct.parts).max())


@pytest.mark.parametrize(
    "slip", [1e-2, *(pytest.param(slip, marks=pytest.mark.slow) for slip in (1e-4, 1e-6))]
)
@pytest.mark.parametrize("friction", [0.5, pytest.param(3.0, marks=pytest.mark.slow)])
def test_friction_of_any_size_converges(solid: Round, friction: float, slip: float) -> None:
    """The iteration converges from a soft to a hard stick, and with more friction than rubber
    has."""
    press = solid.press(GRADED, 1e10, friction, slip)
    press.to(50.0)
    state = press.to(100.0)
    assert state.contact.force == pytest.approx(100.0, rel=1e-7)
    traction = np.linalg.norm(state.contact.traction, axis=-1)
    assert (traction <= friction * state.contact.normal * (1 + 1e-9)).all()


def test_a_ring_is_pressed_in_the_middle(solid: Round) -> None:
    """A ring without cords is mirrored in both planes, so the second part of the fold stays
    zero."""
    press = solid.press(GRADED, 1e10, 0.5)
    press.to(50.0)
    state = press.to(100.0)
    assert abs(state.parts[1]).max() < 1e-9 * abs(state.parts[0]).max()
    assert state.contact.force == pytest.approx(100.0, rel=1e-8)
    assert abs(state.contact.traction).max() > 0.0  # friction is at work


@pytest.mark.slow
def test_a_softer_road_gives_more(solid: Round) -> None:
    """The overclosure is a spring in series: at 1e12 Pa/m it no longer matters."""
    heights = {k: solid.press(GRADED, k).to(100.0).height for k in (1e9, 1e10, 1e11, 1e12)}
    given = [heights[1e12] - heights[k] for k in (1e9, 1e10, 1e11)]
    assert given[0] > given[1] > given[2] > 0
    assert given[1] < 0.2 * given[0] and given[2] < 0.2 * given[1]
