"""What ``import tyrecal`` offers: light, typed, and every example of it runs."""

from __future__ import annotations

import doctest
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import tyrecal
from tyrecal import api

from .conftest import CASES, ROOT

CASE, DATA = CASES / "p235_75r17.yaml", CASES / "p235_75r17_wheeler.csv"
FUNCTIONS = [name for name in tyrecal.__all__ if name[0].islower() and name != "with_values"]


def test_the_package_is_light() -> None:
    code = (
        "import sys, tyrecal\n"
        "heavy = {'numpy', 'scipy', 'pydantic', 'click', 'matplotlib', 'rich'}\n"
        "assert not hasattr(tyrecal, '__wrapped__')  # what tools look for in any module\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
        "assert callable(tyrecal.load_case) and 'numpy' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
def test_a_part_of_the_package_is_found_before_the_rest() -> None:
    code = "from tyrecal import cli, report\nassert cli and report\n"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_all_that_is_offered_is_there_and_nothing_else() -> None:
    offered: dict[str, object] = {}
    exec("from tyrecal import *", offered)
    assert set(offered) - {"__builtins__"} == set(api.__all__) <= set(dir(tyrecal))
    for name in api.__all__:
        assert getattr(tyrecal, name) is getattr(api, name)
    own = [
        name for name, what in vars(api).items() if getattr(what, "__module__", "") == api.__name__
    ]
    assert {name for name in own if not name.startswith("_")} <= set(api.__all__)
    with pytest.raises(AttributeError, match="no attribute 'fit_everything'"):
        tyrecal.fit_everything  # noqa: B018


SLOW = {"diagnose_case", "evaluate_footprint", "read_results", "emulate"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW)) for n in [*FUNCTIONS, ""]]
)
def test_the_example_of(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """``with_values`` is shown with ``load_case``; "": the package's own."""
    monkeypatch.chdir(ROOT)
    what = getattr(api, name) if name else tyrecal
    globs = {**vars(api), "tyrecal": tyrecal}
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
    (test,) = finder.find(what, name or "tyrecal", module=False, globs=globs)
    assert test.examples
    assert runner.run(test).failed == 0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda case: tyrecal.load_case(CASE, mesh="fine"), "mesh level 'fine'"),
        (lambda case: tyrecal.evaluate_modes(case, {"C11": 1e6}), "did you mean 'C10'"),
        (lambda case: tyrecal.evaluate_modes(case, {"C10": "1e6"}), "must be a number"),
        (lambda case: tyrecal.evaluate_modes(case, {"C10": -1.0}), "must be greater than"),
        (lambda case: tyrecal.fit_case(case, method="bfgs"), "none of slsqp, gauss-newton"),
        (lambda case: tyrecal.fit_case(case, starts=0), "starts must be at least 1, got 0"),
        (lambda case: tyrecal.fit_case(case, fixed={"X": 1.0}), "no variable 'X'"),
        (lambda case: tyrecal.sweep_pressure(case, [200, 24000]), "less than 2000"),
        (lambda case: tyrecal.evaluate_footprint(case, []), "loads_N must be above 0 and rise"),
        (lambda case: tyrecal.evaluate_footprint(case, [2e3, 1e3]), r"got \[2000.0, 1000.0\]"),
        (lambda case: tyrecal.evaluate_footprint(case, [float("nan")]), "above 0 and rise"),
        (lambda case: tyrecal.diagnose_case(case, DATA, effects=["rim_with"]), "'rim_width'"),
        (lambda case: tyrecal.diagnose_case(case, DATA, effects="rim_width"), "not one of the eff"),
    ],
)
def test_wrong_input_is_a_value_error_in_a_sentence(call: Any, words: str) -> None:
    """Not a failure of the solver, and never silently another question."""
    case = tyrecal.load_case(CASE, mesh="coarse")
    with pytest.raises(ValueError, match=words) as error:
        call(case)
    assert "\n" not in str(error.value)


def test_values_of_variables_are_those_of_the_design_everywhere() -> None:
    """What `with_values` sets and the same values of one question give the same numbers."""
    case = tyrecal.load_case(CASE, mesh="coarse")
    stiff = tyrecal.with_values(case, {"C10": 2e6})
    hertz = [mode.frequency_Hz for mode in tyrecal.evaluate_modes(case, {"C10": 2e6})]
    assert [mode.frequency_Hz for mode in tyrecal.evaluate_modes(stiff)] == hertz
    (state,) = tyrecal.sweep_pressure(stiff, [240])
    assert state.modes[0].frequency_Hz == pytest.approx(hertz[0], rel=1e-9)
    with pytest.raises(ValueError, match="C10_Pa is set by the variable 'C10'"):
        tyrecal.with_values(case, {"materials.rubber.C10_Pa": 2e6})


@pytest.mark.lint
def test_strict_types(tmp_path: Path) -> None:
    """mypy --strict knows what every function takes and returns, and what is not offered."""
    program = tmp_path / "program.py"
    program.write_text(
        """
from pathlib import Path
from typing import assert_type

import tyrecal

case = tyrecal.load_case("cases/p235_75r17.yaml", mesh="coarse")
assert_type(case, tyrecal.LoadedCase)
assert_type(tyrecal.with_values(case, {"C10": 1.1e6}), tyrecal.LoadedCase)
modes = tyrecal.evaluate_modes(case, {"C10": 1.1e6}, record=Path("record"))
assert_type(modes, list[tyrecal.Mode])
assert_type(modes[0].frequency_Hz, float)
fit = tyrecal.fit_case(case, fixed={"C10": 1e6}, starts=2, jobs=2)
assert_type(fit.fitted.objective, float)
(state,) = tyrecal.sweep_pressure(case, [240.0])
assert_type(state, tyrecal.State)
assert_type(tyrecal.evaluate_footprint(case, [1e3])[0]["area_m2"], float)
found = tyrecal.diagnose_case(case, "measured.csv", effects=["rim_width"])
assert_type(found.verdict.words, str)
assert_type(tyrecal.list_effects()["rim_width"].low, float)
try:
    tyrecal.read_results("p235_75r17")
except (tyrecal.CaseError, tyrecal.EvaluationFailed):
    raise
tyrecal.fit_case(case, method=1)  # WRONG
tyrecal.fit_everything(case)  # WRONG
"""
        + "".join(f"reveal_type(tyrecal.{name})\n" for name in tyrecal.__all__)
        + f"# {tmp_path}: else mypy may have it from its cache, by another path\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", str(program)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    lines = program.read_text().splitlines()
    wrong = [f"program.py:{i}" for i, line in enumerate(lines, 1) if line.endswith("# WRONG")]
    told = done.stdout.splitlines()
    assert [line.partition(": error:")[0] for line in told if ": error:" in line] == [
        str(program.with_name(place)) for place in wrong
    ], done.stdout
    types = [line.partition("Revealed type is ")[2] for line in told if "Revealed" in line]
    assert len(types) == len(tyrecal.__all__) and '"Any"' not in types
