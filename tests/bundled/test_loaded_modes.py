"""Modes of the pressed tyre: against its harmonics, the hold, what decks may ask."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.deck.keywords import DeckError
from tyrecal_solvers.bundled.modes.harmonics import HarmonicModes, Vibration
from tyrecal_solvers.bundled.road import footprint_job, stick
from tyrecal_solvers.bundled.road import loaded_modes as loaded_modes_module
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton, PressedState
from tyrecal_solvers.bundled.road.loaded_modes import (
    Inertia,
    LoadedModes,
    loaded_modes,
    standing_waves,
)
from tyrecal_solvers.bundled.section.mechanics import mass
from tyrecal_solvers.bundled.section.symmetry import HALF_TURN
from tyrecal_solvers.bundled.solid3d.circumference import HalfCircle, half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign

from ..chance import generator
from . import support
from .contact import Round, coarse_case, ring

pytestmark = pytest.mark.numbers

Array = np.ndarray
LENGTHS = np.radians([5.0] * 4 + [20.0] * 8)


@pytest.fixture(scope="module")
def tyre() -> Round:
    """A soft ring on a hub."""
    return ring((0.08, 0.09, 0.1), 0.02, 2, support.Rubber(C10=2e5, D1=2.5e-7))


def harmonic(work: Round, n: int, count: int = 2) -> HarmonicModes:
    equations = support.numbering(work.model, ~work.free)
    return Vibration(work.model, work.U, work.loads, equations, 0.0).modes(n, count)


def start(work: Round) -> list[HarmonicModes]:
    return [harmonic(work, n, 4) for n in range(5)]


def modes(work: Round, U: Array, held: csr_matrix, around: HalfCircle, count: int) -> LoadedModes:
    symmetry = work.symmetry(around)
    (found,) = loaded_modes(
        work.tyre(around), symmetry, U, [held], start(work), count, lambda: None
    )
    return found


def no_hold(work: Round, around: HalfCircle) -> csr_matrix:
    size = around.N.shape[1] * work.U.size
    return csr_matrix((size, size))


@dataclass
class State:
    """A pressed ring and what holds it."""

    around: HalfCircle
    U: Array
    pressed: PressedState
    hold: csr_matrix


def press(work: Round, load: float, friction: float = 0.5, stiffness: float = 1e9) -> State:
    stand = work.press(LENGTHS, stiffness, friction)
    found = stand.to(load)
    U = stand.symmetry.spread(found.parts)
    return State(stand.tyre.around, U, found, stick.held(found.contact))


@pytest.fixture(scope="module")
def pressed(tyre: Round) -> State:
    return press(tyre, 10.0)


@pytest.fixture(scope="module")
def found(tyre: Round, pressed: State) -> LoadedModes:
    return modes(tyre, pressed.U, pressed.hold, pressed.around, 10)


def test_without_a_road_the_modes_are_the_harmonic_ones(tyre: Round) -> None:
    """n <= 1 to rounding, for the elements' functions hold it; n = 2, 3 with the fourth power of
    the elements' length; doublets have one member of each parity, equal to rounding."""
    exact = {n: harmonic(tyre, n).eigenvalues[0] for n in range(4)}
    errors: dict[int, list[float]] = {2: [], 3: []}
    for elements in (8, 16):
        around = half_circle(np.full(elements, np.pi / elements))
        found = modes(tyre, tyre.everywhere(around), no_hold(tyre, around), around, 12)
        assert (np.diff(found.eigenvalues) >= 0).all()
        for n, value in exact.items():
            near = np.argsort(abs(found.eigenvalues - value))[: 2 if n else 1]
            if n < 2:
                np.testing.assert_allclose(found.eigenvalues[near], value, rtol=1e-7)
            else:
                errors[n].append(found.eigenvalues[near].mean() / value - 1)
                np.testing.assert_allclose(*found.eigenvalues[near], rtol=1e-7)
            assert sorted(found.parity[near]) == ([-1, 1] if n else sorted(found.parity[near]))
    for each in errors.values():
        assert 0 < each[1] < 0.01
        assert support.order(each)[0] > 3.5


def test_waves_beyond_the_patch_are_the_modes_own(tyre: Round) -> None:
    """What elements of 1 degree near the patch and waves to 5 beyond leave of the harmonic modes'
    error is the elements' own, fourth order in their length, up to n = 4."""
    errors = []
    for elements in (6, 12):
        around = half_circle(np.full(elements, np.radians(36.0) / elements), 5)
        found = modes(tyre, tyre.everywhere(around), no_hold(tyre, around), around, 14)
        errors.append([])
        for n in range(5):
            value = harmonic(tyre, n).eigenvalues[0]
            near = np.argsort(abs(found.eigenvalues - value))[: 2 if n else 1]
            assert sorted(found.parity[near]) == ([-1, 1] if n else sorted(found.parity[near]))
            errors[-1].append(abs(found.eigenvalues[near] / value - 1).max())
    assert max(errors[1]) < 1e-6 and max(errors[0][:2]) < 1e-7


def test_standing_waves_of_the_unloaded_tyre_are_nearly_its_modes(tyre: Round) -> None:
    """Each has the frequency of its harmonic, as exactly as the elements hold it, and keeps or
    reverses the half turn; of every mode there is one, of a doublet one of either parity."""
    around = half_circle(np.full(24, np.pi / 24))
    work, weigh = tyre.tyre(around), Inertia(tyre.model, around)
    work.residual(tyre.everywhere(around))
    for n in range(4):
        (value,) = (unloaded := harmonic(tyre, n, 1)).eigenvalues
        found = {p: standing_waves([unloaded], tyre.symmetry(around, p)) for p in (1, -1)}
        assert [bool(waves) for waves in found.values()].count(True) == (2 if n else 1)
        for parity, waves in found.items():
            symmetry = tyre.symmetry(around, parity)
            for V in waves:
                quotient = (V * work.product(V)).sum() / (V * weigh(V)).sum()
                assert quotient == pytest.approx(value, rel=2e-3)
                np.testing.assert_allclose(
                    symmetry.spread(symmetry.parts(V)), V, atol=1e-9 * abs(V).max()
                )


def test_they_solve_the_whole_problem(tyre: Round, pressed: State, found: LoadedModes) -> None:
    """K x = lambda M x on the whole tyre, modal masses 1, different modes orthogonal."""
    work = tyre.tyre(pressed.around)
    work.residual(pressed.U)
    weigh = Inertia(tyre.model, pressed.around)
    for value, parity, x in zip(found.eigenvalues, found.parity, found.shapes, strict=True):
        symmetry = tyre.symmetry(pressed.around, int(parity))
        gathered = lambda F, symmetry=symmetry: symmetry.gather(F)
        force = gathered(work.product(x) + held(pressed, x))
        inertia = value * gathered(weigh(x))
        assert np.linalg.norm(force - inertia) < 2e-3 * np.linalg.norm(inertia)
        energy = float((x * (work.product(x) + held(pressed, x))).sum())
        assert 2 * energy == pytest.approx(value, rel=1e-8)
    gram = 2 * np.einsum("akni,bkni->ab", found.shapes, [weigh(x) for x in found.shapes])
    same = found.parity[:, None] == found.parity
    np.testing.assert_allclose(gram[same], np.eye(10)[same], atol=1e-7)


def test_a_wheel_free_along_the_load(tyre: Round, pressed: State, found: LoadedModes) -> None:
    """What the half turn reverses is as it was. A wheel far heavier than the tyre swings slowly on
    the tyre's stiffness, which statics knows, all else as if it were held; a wheel without mass
    lowers each eigenvalue, and none below the one before."""
    symmetry, work = tyre.symmetry(pressed.around), tyre.tyre(pressed.around)

    def free(wheel_kg: float) -> LoadedModes:
        given = work, symmetry, pressed.U, [pressed.hold], start(tyre), 10, lambda: None, wheel_kg
        return loaded_modes(*given)[0]

    heavy, light = free(1e6), free(0.0)
    keeps = found.eigenvalues[found.parity == 1]
    np.testing.assert_allclose(
        heavy.eigenvalues[heavy.parity == -1][:3],
        found.eigenvalues[found.parity == -1][:3],
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


def test_a_second_hold_is_as_if_it_were_the_first(tyre: Round, pressed: State) -> None:
    """The factor's hold exchanged for none along the road: the same eigenvalues, below those of
    the patch that sticks."""
    contact = pressed.pressed.contact
    smooth = stick.held(replace(contact, road=replace(contact.road, friction=0.0)))
    alone = modes(tyre, pressed.U, smooth, pressed.around, 10)
    symmetry, work = tyre.symmetry(pressed.around), tyre.tyre(pressed.around)
    holds = [pressed.hold, smooth]
    both = loaded_modes(work, symmetry, pressed.U, holds, start(tyre), 10, lambda: None)
    np.testing.assert_allclose(both[1].eigenvalues, alone.eigenvalues, rtol=1e-8)
    assert (both[1].eigenvalues < both[0].eigenvalues).all()


def test_a_road_before_waves(tyre: Round) -> None:
    """A ring pressed on 5 short elements and waves bears the load, and as deeply as on elements
    alone, to 1 %."""
    heights = []
    for around in (half_circle(LENGTHS), half_circle(np.radians([5.0] * 4 + [10.0]), 7)):
        symmetry, start = tyre.symmetry(around), tyre.everywhere(around)
        road = tyre.road(around, 1e9)
        found = ContactNewton(tyre.tyre(around), symmetry, road, start, lambda: None).to(10.0)
        assert found.contact.force == pytest.approx(10.0, rel=1e-6)
        heights.append(0.1 - found.height)
    assert heights[1] == pytest.approx(heights[0], rel=0.01)


def test_mass_of_rigid_motions(tyre: Round) -> None:
    """Half the tyre's mass for shifts down and along the axle, whatever the elements' lengths."""
    around = half_circle(LENGTHS)
    weigh, total = Inertia(tyre.model, around), 2 * np.pi * mass(tyre.model).entries.sum()
    c, s = np.cos(around.angles)[:, None], np.sin(around.angles)[:, None]
    ones = np.ones((1, len(tyre.U)))
    down = np.stack([c * ones, -s * ones, 0 * c * ones], -1)
    across = np.stack([0 * c * ones, 0 * c * ones, 1 + 0 * c * ones], -1)
    for V in (down, across):
        assert (V * weigh(V)).sum() == pytest.approx(total / 2, rel=1e-9)


def test_a_hold_raises_every_frequency(tyre: Round, pressed: State, found: LoadedModes) -> None:
    """Weyl: none of the pressed tyre's eigenvalues falls with the hold, more so a rigid one; what
    the contact's own stiffness leaves to a rigid hold is little."""
    free = modes(tyre, pressed.U, 0 * pressed.hold, pressed.around, 10)
    rigid = modes(tyre, pressed.U, 1e2 * pressed.hold, pressed.around, 10)
    assert (free.eigenvalues < found.eigenvalues * (1 + 1e-9)).all()
    assert (found.eigenvalues < rigid.eigenvalues * (1 + 1e-9)).all()
    np.testing.assert_allclose(found.eigenvalues, rigid.eigenvalues, rtol=0.02)
    assert (found.eigenvalues / free.eigenvalues).max() > 1.05


def shifted(work: Round, around: HalfCircle, component: int) -> Array:
    """The field (k, n, 3) of a unit shift of all down, along or across the road."""
    c, s = np.cos(around.angles)[:, None], np.sin(around.angles)[:, None]
    field = np.zeros((len(around.angles), len(work.U), 3))
    if component == 2:
        field[..., 2] = 1.0
    else:
        field[..., 0], field[..., 1] = ((c, -s), (s, c))[component]
    return field


def held(state: State, V: Array) -> Array:
    return np.asarray((state.hold @ V.ravel()).reshape(V.shape))


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


def test_the_hold_goes_to_nothing_with_the_load(tyre: Round) -> None:
    """Over a patch as wide as the ring: its length, as a cylinder's on a rigid road, with the
    square root of the load (Hertz) where the rubber gives way, with the cubic where the road's
    stiffness alone does."""
    loads = np.array([3.0, 1.0, 0.1, 0.01])
    totals = np.array([press(tyre, load).pressed.contact.stiffness for load in loads])
    powers = np.diff(np.log(totals)) / np.diff(np.log(loads))
    assert (powers > 1 / 3 - 0.02).all() and (powers < 1 / 2 + 0.02).all()


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


def test_the_same_bits_again(tyre: Round, pressed: State, found: LoadedModes) -> None:
    again = modes(tyre, pressed.U, pressed.hold, pressed.around, 10)
    np.testing.assert_array_equal(again.eigenvalues, found.eigenvalues)
    np.testing.assert_array_equal(again.shapes, found.shapes)


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
        work, symmetry = tyre.tyre(pressed.around), tyre.symmetry(pressed.around)
        with pytest.raises(TimeoutError):
            loaded_modes(work, symmetry, pressed.U, [pressed.hold], start(tyre), 4, clock)
        assert done == wanted


def test_an_unstable_state_fails_by_its_name(tyre: Round, pressed: State) -> None:
    pushed = -10 * pressed.hold
    with pytest.raises(RunFailed, match="not stable"):
        modes(tyre, pressed.U, pushed, pressed.around, 4)


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
    asked: list[Any] = []

    def press(*given: Any) -> dict[str, Any]:
        asked.extend(given[-2].values())
        raise RunFailed("crashed", "enough")

    monkeypatch.setattr(footprint_job, "press", press)
    for wheel, kg in (("held", None), ("free_along_load", 15.0)):
        for name, text in texts(wheel=wheel).items():
            (tmp_path / name).write_text(text)
        with pytest.raises(RunFailed, match="enough"):
            job.run(tmp_path, "press", "inflate")
        assert asked[-1].wheel_kg == kg
    plain = Decks(TyreDesign(coarse_case(wheel="free_along_load")), loads_N=LOADS).texts("abaqus")
    assert "MASS" not in plain["press.inp"]


@pytest.mark.slow
def test_results_hold_the_half_turn(tyre: Round, pressed: State, found: LoadedModes) -> None:
    """Shapes on the whole tyre, as the job writes them: each kept or reversed by the half turn."""
    work = tyre.press(LENGTHS, 1e9, 0.5)
    rows = np.arange(len(tyre.U))
    wanted = footprint_job.ModesAtLoad(tyre.model, 6, rows)
    state = work.to(10.0)
    equations = support.numbering(tyre.model, ~tyre.free)
    written = footprint_job._modes(work, state, wanted, equations, tyre.U, work.tyre.around.angles)
    shapes = written["mode_shape"]
    back = (-np.arange(shapes.shape[1])) % shapes.shape[1]
    image = HALF_TURN * shapes[:, back][:, :, work.symmetry.other]
    parity = found.parity[:6, None, None, None]
    np.testing.assert_allclose(shapes, parity * image, atol=1e-6 * abs(shapes).max())
    hertz = np.sqrt(found.eigenvalues[:6]) / (2 * np.pi)
    np.testing.assert_allclose(written["mode_frequency_Hz"], hertz, rtol=1e-7)


def test_what_the_job_asks_for_and_how_it_writes_it(
    tyre: Round, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Modes about the pressed state with its hold, from twice so many and spare ones of the
    inflated tyre; their shapes on the whole tyre, kept or reversed by the half turn."""
    work = tyre.press(LENGTHS, 1e9, 0.5)
    state = work.to(10.0)
    k, nodes = len(work.tyre.around.angles), np.array([3, 0, 5])
    shapes = generator(2).normal(size=(2, k, len(tyre.U), 3))
    canned = LoadedModes(np.array([400.0, 900.0]) * np.pi**2, np.array([1, -1]), shapes)
    asked: list[Any] = []

    def lowest(vibration: Vibration, wanted: int, check: object) -> list[HarmonicModes]:
        asked.append((vibration.shift, wanted, vibration.factor(0).solve(np.ones(free))))
        return []

    loose = LoadedModes(np.array([100.0]) * np.pi**2, np.array([-1]), shapes[1:])

    def modes_(work_: Revolved, kept: Any, U: Array, holds: Any, *rest: Any) -> list[LoadedModes]:
        work_.residual(U)
        asked.append((work_.product(shapes[0]), holds, rest))
        return [canned, loose]

    monkeypatch.setattr(footprint_job, "lowest_of_all", lowest)
    monkeypatch.setattr(footprint_job, "loaded_modes", modes_)
    equations = support.numbering(tyre.model, ~tyre.free)
    free = equations.size
    wanted = footprint_job.ModesAtLoad(tyre.model, 2, nodes, 9.0)
    work.tyre.residual(0 * shapes[0])  # a state that is not the wanted one
    written = footprint_job._modes(work, state, wanted, equations, tyre.U, work.tyre.around.angles)
    assert work._factor is None
    (shift, started, solved), (product, (hold, smooth), rest) = asked
    plain = Vibration(tyre.model, tyre.U, work.tyre.loads, equations, 0.0)
    np.testing.assert_array_equal(solved, plain.factor(0).solve(np.ones(free)))
    assert (shift, started) == (0.0, 2 * (2 + 6)) and rest[:2] == ([], 2)
    here = press(tyre, 10.0)
    assert abs(hold - here.hold).max() < 1e-9 * abs(here.hold).max()
    V = shifted(tyre, here.around, 0)
    assert abs(smooth @ V.ravel() - hold @ V.ravel()).max() < 1e-9 * abs(here.hold).max()
    assert abs(smooth @ shifted(tyre, here.around, 1).ravel()).max() < 1e-3
    assert rest[-1] == 9.0
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
