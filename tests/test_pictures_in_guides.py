"""Pictures of the guides show what the commands draw today, by the numbers that they draw."""

from __future__ import annotations

from pathlib import Path

import pytest

from .studies.pictures import DRAWN, PICTURES, Drawn, differences, draw


def test_every_picture_of_the_guides_has_a_command() -> None:
    names = [name for drawn in DRAWN for name in drawn.pictures]
    assert sorted(names) == sorted(path.name for path in PICTURES.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    "drawn",
    [drawn for drawn in DRAWN if drawn.is_quick],
    ids=lambda drawn: next(iter(drawn.pictures)),
)
def test_pictures_are_of_today(drawn: Drawn, tmp_path: Path) -> None:
    for name, path in draw(drawn, tmp_path).items():
        assert not list(differences(path, PICTURES / name)), name
