"""Modes of the pressed tyre: against its harmonics, the whole problem, and what is held or free."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.road import footprint_job
from tyrecal_solvers.bundled.road import loaded_modes as loaded_modes_module
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton
from tyrecal_solvers.bundled.road.loaded_modes import (
    Inertia,
    LoadedModes,
    TyreOnRoad,
    hold_of_patch,
    loaded_modes,
    standing_waves,
)
from tyrecal_solvers.bundled.road.multifrontal import Elimination
from tyrecal_solvers.bundled.road.pressed_response import PressedLosses
from tyrecal_solvers.bundled.section.mechanics import mass
from tyrecal_solvers.bundled.section.symmetry import HALF_TURN
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import RunFailed

from ..chance import generator
from . import support
from .contact import (
    ETA,
    LENGTHS,
    Round,
    State,
    harmonic,
    held,
    modes,
    no_hold,
    press,
    pressed_tyre,
    soft_ring,
    start,
)

pytestmark = pytest.mark.numbers
Array = np.ndarray


@pytest.fixture(scope="module")
def tyre() -> Round:
    return soft_ring()


@pytest.fixture(scope="module")
def pressed(tyre: Round) -> State:
    return press(tyre, 10.0)


@pytest.fixture(scope="module")
def lowest(tyre: Round, pressed: State) -> LoadedModes:
    return modes(tyre, pressed.U, pressed.hold, pressed.around, 10)


def test_without_a_road_the_modes_are_the_harmonic_ones(tyre: Round) -> None:
    """n <= 1 to rounding, for the elements' functions hold it; n = 2, 3 with the fourth power of
    the elements' length; doublets have one member of each parity, equal to rounding."""
    exact = {n: harmonic(tyre, n).eigenvalues[0] for n in range(4)}
    errors: dict[int, list[float]] = {2: [], 3: []}
    for elements in (8, 16):
        around = half_circle(np.full(elements, np.pi / elements))
        loaded = modes(tyre, tyre.everywhere(around), no_hold(tyre, around), around, 12)
        assert (np.diff(loaded.eigenvalues) >= 0).all()
        for n, value in exact.items():
            near = np.argsort(abs(loaded.eigenvalues - value))[: 2 if n else 1]
            if n < 2:
                np.testing.assert_allclose(loaded.eigenvalues[near], value, rtol=1e-7)
            else:
                errors[n].append(loaded.eigenvalues[near].mean() / value - 1)
                np.testing.assert_allclose(*loaded.eigenvalues[near], rtol=1e-7)
            assert sorted(loaded.parity[near]) == ([-1, 1] if n else sorted(loaded.parity[near]))
    for each in errors.values():
        assert 0 < each[1] < 0.01
        assert support.order(each)[0] > 3.5


def test_waves_beyond_the_patch_are_the_modes_own(tyre: Round) -> None:
    """The remaining error of harmonic modes is that of the elements, fourth order in their
    length, up to n = 4: elements are 1 degree near the patch, and waves to 5 are beyond."""
    errors = []
    for elements in (6, 12):
        around = half_circle(np.full(elements, np.radians(36.0) / elements), 5)
        loaded = modes(tyre, tyre.everywhere(around), no_hold(tyre, around), around, 14)
        errors.append([])
        for n in range(5):
            value = harmonic(tyre, n).eigenvalues[0]
            near = np.argsort(abs(loaded.eigenvalues - value))[: 2 if n else 1]
            assert sorted(loaded.parity[near]) == ([-1, 1] if n else sorted(loaded.parity[near]))
            errors[-1].append(abs(loaded.eigenvalues[near] / value - 1).max())
    assert max(errors[1]) < 1e-6 and max(errors[0][:2]) < 1e-7


def test_standing_waves_of_the_unloaded_tyre_are_nearly_its_modes(tyre: Round) -> None:
    """Each standing wave has the frequency of its harmonic, as exactly as the elements permit,
    and keeps or reverses the half turn. Each mode occurs once, each doublet once for either
    parity."""
    around = half_circle(np.full(24, np.pi / 24))
    work, weigh = tyre.tyre(around), Inertia(tyre.model, around)
    work.residual(tyre.everywhere(around))
    for n in range(4):
        (value,) = (unloaded := harmonic(tyre, n, 1)).eigenvalues
        by_parity = {p: standing_waves([unloaded], tyre.symmetry(around, p)) for p in (1, -1)}
        assert [bool(waves) for waves in by_parity.values()].count(True) == (2 if n else 1)
        for parity, waves in by_parity.items():
            symmetry = tyre.symmetry(around, parity)
            for V in waves:
                quotient = (V * work.product(V)).sum() / (V * weigh(V)).sum()
                assert quotient == pytest.approx(value, rel=2e-3)
                np.testing.assert_allclose(
                    symmetry.spread(symmetry.parts(V)), V, atol=1e-9 * abs(V).max()
                )


def test_they_solve_the_whole_problem(tyre: Round, pressed: State, lowest: LoadedModes) -> None:
    """K x = lambda M x on the whole tyre, modal masses 1, different modes orthogonal."""
    work = tyre.tyre(pressed.around)
    work.residual(pressed.U)
    weigh = Inertia(tyre.model, pressed.around)
    for value, parity, x in zip(lowest.eigenvalues, lowest.parity, lowest.shapes, strict=True):
        symmetry = tyre.symmetry(pressed.around, int(parity))
        gathered = lambda F, symmetry=symmetry: symmetry.gather(F)
        force = gathered(work.product(x) + held(pressed, x))
        inertia = value * gathered(weigh(x))
        assert np.linalg.norm(force - inertia) < 2e-3 * np.linalg.norm(inertia)
        energy = float((x * (work.product(x) + held(pressed, x))).sum())
        assert 2 * energy == pytest.approx(value, rel=1e-8)
    gram = 2 * np.einsum("akni,bkni->ab", lowest.shapes, [weigh(x) for x in lowest.shapes])
    same = lowest.parity[:, None] == lowest.parity
    np.testing.assert_allclose(gram[same], np.eye(10)[same], atol=1e-7)


def test_one_mode_is_the_lowest(tyre: Round, pressed: State, lowest: LoadedModes) -> None:
    (value,) = modes(tyre, pressed.U, pressed.hold, pressed.around, 1).eigenvalues
    assert value == pytest.approx(lowest.eigenvalues[0], rel=1e-6)


@pytest.mark.slow
def test_a_wheel_free_along_the_load(tyre: Round, pressed: State, lowest: LoadedModes) -> None:
    """Modes that the half turn reverses stay as they were. A wheel far heavier than the tyre swings
    slowly on the tyre's stiffness, which statics gives, and all else is as if it were held; a wheel
    without mass lowers each eigenvalue, and none below the one before."""
    there = pressed_tyre(tyre, pressed.U, pressed.around)
    work = there.tyre

    def free(wheel_kg: float) -> LoadedModes:
        return loaded_modes(there, [pressed.hold], start(tyre), 10, wheel_kg)[0]

    heavy, light = free(1e6), free(0.0)
    keeps = lowest.eigenvalues[lowest.parity == 1]
    np.testing.assert_allclose(
        heavy.eigenvalues[heavy.parity == -1][:3],
        lowest.eigenvalues[lowest.parity == -1][:3],
        rtol=1e-7,
    )
    swing, *others = heavy.eigenvalues[heavy.parity == 1]
    np.testing.assert_allclose(others[:3], keeps[:3], rtol=1e-4)
    shape = heavy.shapes[0]
    shift = shape[0, ~tyre.free.any(1), 0]
    np.testing.assert_allclose(shift, shift[0], rtol=1e-9)
    stiffness = (shape * (work.product(shape) + held(pressed, shape))).sum() / shift[0] ** 2
    assert swing == pytest.approx(2 * stiffness / 1e6, rel=1e-3)
    mine = light.eigenvalues[light.parity == 1]
    assert (mine[:3] < keeps[:3] * (1 + 1e-8)).all() and (mine[1:4] > keeps[:3] * (1 - 1e-8)).all()
    assert mine[0] < 0.1 * keeps[0]


@pytest.mark.slow
def test_a_second_hold_is_as_if_it_were_the_first(tyre: Round, pressed: State) -> None:
    """The factor's hold exchanged for none along the road: the same eigenvalues, below those of
    the patch that sticks."""
    contact = pressed.pressed.contact
    smooth = hold_of_patch(replace(contact, road=replace(contact.road, friction=0.0)))
    alone = modes(tyre, pressed.U, smooth, pressed.around, 10)
    there = pressed_tyre(tyre, pressed.U, pressed.around)
    both = loaded_modes(there, [pressed.hold, smooth], start(tyre), 10)
    np.testing.assert_allclose(both[1].eigenvalues, alone.eigenvalues, rtol=1e-8)
    assert (both[1].eigenvalues < both[0].eigenvalues).all()


@pytest.mark.slow
def test_the_footprints_factor_gives_the_same_modes(
    tyre: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Modes of parity 1 take the factor that pressed the ring, also one of half the moduli that
    they vibrate with, and form none: the eigenvalues are those with an own factor."""
    work = tyre.press(LENGTHS, 1e9, 0.5)
    state = work.to(10.0)
    U, hold = work.symmetry.spread(state.parts), hold_of_patch(state.contact)
    (rubber,) = tyre.model.parts
    twice = np.full(rubber.rows.weights.size, 2.0)
    stiff = tyre.model.with_laws(lambda law: replace(law, shear_ratio=twice, bulk_ratio=twice))
    formed: list[int] = []
    real = loaded_modes_module.Factor

    def factor(order: Elimination, *given: Any) -> Any:
        formed.append(order.symmetry.parity)
        return real(order, *given)

    monkeypatch.setattr(loaded_modes_module, "Factor", factor)
    shared = work.release_factor()
    for model in (tyre.model, stiff):
        results = []
        for release in (lambda: shared, lambda: None):
            revolved = Revolved(model, [], work.tyre.around)
            there = TyreOnRoad(revolved, work.symmetry, U, 0 * U, lambda: None)
            given = there, [hold], start(tyre), 8, None, release
            results.append(loaded_modes(*given)[0].eigenvalues)
        np.testing.assert_allclose(*results, rtol=1e-8)
    assert formed == [-1, 1, -1] * 2


def test_a_road_before_waves(tyre: Round) -> None:
    """A ring pressed on 5 short elements and waves bears the load, and as deeply as on elements
    alone, to 1 %."""
    heights = []
    for around in (half_circle(LENGTHS), half_circle(np.radians([5.0] * 4 + [10.0]), 7)):
        symmetry, start = tyre.symmetry(around), tyre.everywhere(around)
        road = tyre.road(around, 1e9)
        state = ContactNewton(tyre.tyre(around), symmetry, road, start, lambda: None).to(10.0)
        assert state.contact.force == pytest.approx(10.0, rel=1e-6)
        heights.append(0.1 - state.height)
    assert heights[1] == pytest.approx(heights[0], rel=0.01)


def test_mass_of_rigid_motions(tyre: Round) -> None:
    """Half the tyre's mass for shifts down and along the axle, whatever the elements' lengths."""
    around = half_circle(LENGTHS)
    weigh, total = Inertia(tyre.model, around), 2 * np.pi * mass(tyre.model).sum()
    c, s = np.cos(around.angles)[:, None], np.sin(around.angles)[:, None]
    ones = np.ones((1, len(tyre.U)))
    down = np.stack([c * ones, -s * ones, 0 * c * ones], -1)
    across = np.stack([0 * c * ones, 0 * c * ones, 1 + 0 * c * ones], -1)
    for V in (down, across):
        assert (V * weigh(V)).sum() == pytest.approx(total / 2, rel=1e-9)


def test_a_hold_raises_every_frequency(tyre: Round, pressed: State, lowest: LoadedModes) -> None:
    """Weyl: none of the pressed tyre's eigenvalues falls with the hold, more so a rigid one; what
    the contact's own stiffness leaves to a rigid hold is little."""
    free = modes(tyre, pressed.U, 0 * pressed.hold, pressed.around, 10)
    rigid = modes(tyre, pressed.U, 1e2 * pressed.hold, pressed.around, 10)
    assert (free.eigenvalues < lowest.eigenvalues * (1 + 1e-9)).all()
    assert (lowest.eigenvalues < rigid.eigenvalues * (1 + 1e-9)).all()
    np.testing.assert_allclose(lowest.eigenvalues, rigid.eigenvalues, rtol=0.02)
    assert (lowest.eigenvalues / free.eigenvalues).max() > 1.05


def test_the_same_bits_again(tyre: Round, pressed: State, lowest: LoadedModes) -> None:
    again = modes(tyre, pressed.U, pressed.hold, pressed.around, 10)
    np.testing.assert_array_equal(again.eigenvalues, lowest.eigenvalues)
    np.testing.assert_array_equal(again.shapes, lowest.shapes)


def test_time_is_looked_at_before_the_factor_and_every_product(
    tyre: Round, pressed: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clock that ends at a look: nothing is done after it."""
    done: list[str] = []
    real = loaded_modes_module.Factor

    def factor(*given: Any) -> Any:
        done.append("factor")
        return real(*given)

    monkeypatch.setattr(loaded_modes_module, "Factor", factor)

    def weigh(self: Inertia, V: Array) -> Array:
        done.append("product")
        return np.zeros_like(V)

    monkeypatch.setattr(Inertia, "__call__", weigh)
    for allowed, wanted in ((0, []), (1, ["factor"])):
        left = [allowed]

        def clock(left: list[int] = left) -> None:
            left[0] -= 1
            if left[0] < 0:
                raise TimeoutError

        done.clear()
        there = pressed_tyre(tyre, pressed.U, pressed.around, clock)
        with pytest.raises(TimeoutError):
            loaded_modes(there, [pressed.hold], start(tyre), 4)
        assert done == wanted


def test_an_unstable_state_fails_by_its_name(tyre: Round, pressed: State) -> None:
    pushed = -10 * pressed.hold
    with pytest.raises(RunFailed, match="not stable"):
        modes(tyre, pressed.U, pushed, pressed.around, 4)


@pytest.mark.slow
def test_results_hold_the_half_turn(tyre: Round, pressed: State, lowest: LoadedModes) -> None:
    """Shapes on the whole tyre, as the job writes them: each kept or reversed by the half turn."""
    work = tyre.press(LENGTHS, 1e9, 0.5)
    rows = np.arange(len(tyre.U))
    wanted = footprint_job.ModeRequest(tyre.model, 6, rows)
    state = work.to(10.0)
    equations = support.numbering(tyre.model, ~tyre.free)
    written = footprint_job._modes(work, state, wanted, equations, tyre.U, work.tyre.around.angles)
    shapes = written["mode_shape"]
    back = (-np.arange(shapes.shape[1])) % shapes.shape[1]
    image = HALF_TURN * shapes[:, back][:, :, work.symmetry.other]
    parity = lowest.parity[:6, None, None, None]
    np.testing.assert_allclose(shapes, parity * image, atol=1e-6 * abs(shapes).max())
    hertz = np.sqrt(lowest.eigenvalues[:6]) / (2 * np.pi)
    np.testing.assert_allclose(written["mode_frequency_Hz"], hertz, rtol=1e-7)


def test_the_vibration_modulus_counts(tyre: Round, pressed: State) -> None:
    """Twice the shear and bulk moduli for vibrations: K of the rubber, all there is, doubles but
    for the pressure's part."""
    (rubber,) = tyre.model.parts
    twice = np.full(rubber.rows.weights.size, 2.0)
    moving = tyre.model.with_laws(lambda law: replace(law, shear_ratio=twice, bulk_ratio=twice))
    works = [Revolved(m, [], pressed.around) for m in (tyre.model, moving)]
    x = generator(1).normal(size=pressed.U.shape)
    small = np.zeros_like(pressed.U)
    still, twice = ((w.residual(small), w.product(x))[1] for w in works)
    np.testing.assert_allclose(twice, 2 * still, atol=1e-9 * abs(still).max())


def test_damping_is_half_the_loss_factor_times_the_slope_of_ln_omega_squared(
    tyre: Round, pressed: State, lowest: LoadedModes
) -> None:
    """zeta = eta / 2 d ln lambda / d ln G at the fixed state, by central differences; the patch's
    hold and the initial stress store the rest of the energy."""
    rubber, *others = tyre.model.parts
    squares = []
    for step in (1e-4, -1e-4):
        law = replace(rubber.law, shear_ratio=1 + step, bulk_ratio=1 + step)
        stiffer = replace(tyre.model, parts=[replace(rubber, law=law), *others])
        changed = replace(tyre, model=stiffer)
        squares.append(modes(changed, pressed.U, pressed.hold, pressed.around, 10).eigenvalues)
    slopes = np.log(squares[0] / squares[1]) / 2e-4
    ratios = PressedLosses(tyre.tyre(pressed.around), pressed.U).damping_ratios(lowest)
    np.testing.assert_allclose(ratios, ETA / 2 * slopes, rtol=1e-6)
    assert np.ptp(ratios) > 1e-4 * ETA
