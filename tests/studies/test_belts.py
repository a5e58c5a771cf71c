"""Belts as the study of stability turns them."""

from __future__ import annotations

import pytest

from .belts import with_belts
from .wrinkles import by_size


@pytest.mark.parametrize("size", ["155/80R13", "11R22.5"])
def test_working_belts_are_turned_to_their_own_sides(size: str) -> None:
    """24 degrees from the circumference; the carcass, cap plies and a truck's steep belt stay."""
    case = by_size(size)
    own, turned = case.case.rebar_layers, with_belts(case, 24.0, 200.0).case.rebar_layers
    angles = {name: layer.angle_deg for name, layer in turned.items()}
    working = [name for name in own if name.startswith("belt") and own[name].angle_deg != 50]
    assert len(working) == (3 if size == "11R22.5" else 2)
    for name, layer in own.items():
        kept = layer.angle_deg
        new = (66.0 if kept < 90 else 114.0) if name in working else kept
        assert angles[name] == pytest.approx(new)
