"""An effect is added to a case's file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.studies.diagnose.add import add
from tyrecal.tyre.case.editor import EDITOR_LINE
from tyrecal.tyre.load import load_case

from ..case.test_guard import SLIPS


def test_an_effect_is_added_with_the_files_comments_kept(case_folder: Path) -> None:
    old = case_folder / "p235_75r17.yaml"
    new = add(old, {"bead_filler": 1.5})
    added = [line for line in new.read_text().splitlines() if line not in old.read_text()]
    apart = "effects:", EDITOR_LINE.strip()
    assert [word for line in added if (word := line.strip()) not in apart] == ["bead_filler: 1.5"]
    assert "# Table 1 of the paper" in new.read_text()
    with pytest.raises(InputError):
        add(old, {"bead_filler": 1.5})
    with pytest.raises(ValueError, match="no 'nothing'"):
        add(old, {"nothing": 1.5})


def test_an_effect_is_added_to_a_case_whose_numbers_are_unusual(case_folder: Path) -> None:
    """Its user was told of them already."""
    path = case_folder / "p235_75r17.yaml"
    old, new, *_ = next(iter(SLIPS.values()))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert load_case(add(path, {"bead_filler": 1.5}), allow_unusual=True).case.effects
