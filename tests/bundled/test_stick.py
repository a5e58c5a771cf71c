"""Hold of the road on the patch while the tyre vibrates, and its limits as the load changes."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.solid3d.circumference import half_circle

from .contact import Round
from .soft_ring import LENGTHS, State, held, modes, no_hold, press, shifted, soft_ring

pytestmark = pytest.mark.numbers


@pytest.fixture(scope="module")
def tyre() -> Round:
    return soft_ring()


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
