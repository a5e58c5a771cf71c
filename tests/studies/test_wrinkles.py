"""A truck whose cords bear no compression: one tyre, whatever the mesh."""

from __future__ import annotations

import pytest

from tyrecal.tyre.effects.edit import changed, with_part

from .wrinkles import by_size, finer, frequencies, with_compression


@pytest.mark.slow
@pytest.mark.parametrize("holds", ["whole_bead", "bead_surface"])
def test_its_modes_do_not_hang_on_the_mesh_at_the_bead(holds: str) -> None:
    """Frequencies stay within 1 % with twice the elements and rows. If cords bear compression,
    [0,0] axial of a bead whose surface is held falls by more than 5 %."""
    case = by_size("11R22.5")
    case = changed(case, rim=with_part(case.case.rim, holds=holds))
    moved = {}
    for bears in (False, True) if holds == "bead_surface" else (False,):
        tyre = with_compression(case, bears)
        coarse, fine = (frequencies(each, 500.0) for each in (tyre, finer(tyre, 2, 2)))
        moved[bears] = {label: fine[label] / coarse[label] - 1 for label in coarse if label in fine}
    assert len(moved[False]) >= 9
    assert max(map(abs, moved[False].values())) < 0.01
    if holds == "bead_surface":
        assert moved[True][0, 0, "axial"] < -0.05
