"""Belts as the study of stability turns them."""

from __future__ import annotations

import pytest

from tyrecal.tyre.case import with_level

from .belts import COMMANDS, counts, failures, with_belts
from .wrinkles import by_size, with_compression


@pytest.mark.parametrize("size", ["205/55R16", "11R22.5"])
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


@pytest.mark.slow
@pytest.mark.parametrize("bears", [True, False])
def test_the_three_commands_agree(bears: bool) -> None:
    """A carcass that bears compression buckles under belts at 24 degrees; slack cords do not."""
    case = with_compression(with_level(by_size("205/55R16"), "coarse"), bears)
    line = failures(with_belts(case, 24.0, 250.0), 300.0, False)
    assert {line[name].split(":")[0] for name in COMMANDS} == {"unstable" if bears else ""}
    assert counts([line]) == f"1 tyres, {int(not bears)} computed, the commands agree about 1"
