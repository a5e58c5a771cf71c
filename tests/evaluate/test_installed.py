"""Command of each registered solver, and who set it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.simulate.evaluate import solver


@pytest.mark.parametrize(
    ("started_by", "wanted"),
    [
        (([], ""), ("ccx", "default")),
        ((["ccx_2.21", "-i"], "settings.toml"), (["ccx_2.21", "-i"], "settings.toml")),
    ],
)
def test_a_command_and_who_set_it(
    started_by: tuple[list[str], str], wanted: tuple[object, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solver, "command_of", lambda name: started_by)
    monkeypatch.setenv("PATH", "")  # whether ccx is installed here must not matter
    facts = {each["name"]: each for each in solver.installed()}
    calculix, bundled = facts["calculix"], facts["bundled"]
    command = calculix["command"]
    assert calculix["command_from"] == wanted[1]
    assert command == wanted[0] or Path(command[0]).name == wanted[0]
    assert bundled["command"] is None and bundled["command_from"] is None
    assert bundled["problem"] is None and "modes" in bundled["capabilities"]
