"""Every wrong case is refused in sentences that name what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.tyre.load import validate

from .bad_cases import BAD, write


def test_the_table_is_long_enough() -> None:
    assert len(BAD) >= 60


@pytest.mark.parametrize("name", BAD)
def test_wrong_case(name: str, tmp_path: Path) -> None:
    path = write(name, tmp_path)
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}
    mistakes = validate(path)
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == before
    listing = "\n".join(map(str, mistakes))
    assert any(m.key == BAD[name].key and BAD[name].words in m.message for m in mistakes), listing
    for mistake in mistakes:
        assert str(mistake).isprintable() and len(mistake.message) < 400
        exists = path.is_file()  # else no line is to blame
        assert mistake.line >= exists and mistake.file.startswith(str(tmp_path))
