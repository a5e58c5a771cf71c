"""Command of each registered solver, and who set it."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from tyrecal.errors import InputError
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


def test_a_broken_solver_is_named_where_it_is_used_and_listed_with_its_problem(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The solver's module lacks it, or it cannot be made."""
    bundled = EntryPoint("bundled", "tyrecal_solvers.bundled.adapter:Bundled", solver.GROUP)
    entries = [
        bundled,
        EntryPoint("absent", "tyrecal.version:Absent", solver.GROUP),
        EntryPoint("odd", "builtins:bytearray.fromhex", solver.GROUP),
    ]
    monkeypatch.setattr(solver, "entry_points", lambda group: entries)
    problems = {each["name"]: each["problem"] for each in solver.installed()}
    assert problems.pop("bundled") is None
    for name, problem in problems.items():
        assert f"solver '{name}' of '" in problem and "cannot be loaded (" in problem
        with pytest.raises(InputError, match=f"solver '{name}' of .* cannot be loaded"):
            solver.find_solver(name)
    assert solver.find_solver("bundled").name == "bundled"
