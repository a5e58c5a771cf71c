"""Wrong cases through the command line: exit code 2, one sentence each, nothing written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ..case import bad_cases
from .test_cli import run


def snapshot(folder: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


LARGE = {"many_values", "deep_nest"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in LARGE))
        for name in sorted(bad_cases.BAD)
    ],
)
def test_a_wrong_case(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = bad_cases.write(name, tmp_path)
    before, here = snapshot(tmp_path), set(os.listdir())  # noqa: PTH208
    # one command for each case: all of them read it as any study does
    command = ("validate", "fit", "modes")[sorted(bad_cases.BAD).index(name) % 3]
    assert run(command, str(path)) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    lines = printed.err.splitlines()
    assert lines and all(line.startswith("error: ") for line in lines)
    assert "Traceback" not in printed.err
    assert snapshot(tmp_path) == before
    assert set(os.listdir()) == here  # noqa: PTH208
