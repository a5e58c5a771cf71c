"""Waves and elements round the tyre under a load are fine enough."""

from __future__ import annotations

import pytest

from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .loaded_mesh import frequencies


@pytest.mark.slow
def test_finer_round_the_tyre_moves_no_mode() -> None:
    """Every mode at 4 kN, of a patch that sticks and of one that slides, within 3e-4 of the same
    mesh near the patch with shorter elements and more waves beyond."""
    case = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    own, finer = (frequencies(case, [4000.0], name) for name in ("", "far"))
    assert len(own) == 16 and own.keys() == finer.keys()
    for member, both in own.items():
        assert both == pytest.approx(finer[member], rel=3e-4), member
