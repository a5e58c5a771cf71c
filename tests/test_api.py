"""Contents of ``import tyrecal``: light, typed, and every example of it runs.

Examples in the docstrings of `tyrecal.studies` run and give what they show.

Those of `diagnose`, `sample` and `blind` are elsewhere.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tyrecal
from tyrecal import api, studies
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label

from .cli.test_cli import run
from .conftest import CASES, ROOT

CASE, DATA = CASES / "p235_75r17.yaml", CASES / "p235_75r17_wheeler.csv"
FUNCTIONS = [name for name in tyrecal.__all__ if name[0].islower() and name != "with_values"]


@pytest.fixture(scope="module")
def coarse() -> tyrecal.LoadedCase:
    return tyrecal.load_case(CASE, mesh="coarse")


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


def test_the_errors_of_the_guide_are_offered() -> None:
    _, _, text = (ROOT / "cases/python.md").read_text(encoding="utf-8").partition("## Errors")
    errors = re.findall(r"^\| `(\w+)` \|", text.partition("\n## ")[0], re.MULTILINE)
    assert errors and set(errors) <= set(api.__all__)


SLOW = {"diagnose_case", "evaluate_footprint", "read_results"}


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
        (lambda case: tyrecal.run("fti", case), "did you mean 'fit'"),
        (lambda case: tyrecal.run("effects", case), "by its command only"),
        (lambda case: tyrecal.run("fit", case, start=2), "no option 'start': it has measured"),
        (lambda case: tyrecal.run("footprint", case, loads_N=[2, 1]), "above 0 and rise"),
        (lambda case: tyrecal.run("sweep-pressure", case, pressures_kPa=2.4), "usual is 50"),
        (lambda case: tyrecal.run("fit", case, method="bfgs"), "none of slsqp, gauss-newton"),
        (lambda case: tyrecal.run("fit", case, prior="no"), "prior must be True or False"),
        (lambda case: tyrecal.run("frf", case, form="mobility"), "none of receptance"),
        (lambda case: tyrecal.run("frf", case, excite=["tread:0deg:radial"]), "must be text"),
        (lambda case: tyrecal.run("frf", case, step_Hz="1"), "step_Hz must be a number"),
    ],
)
def test_wrong_input_is_a_value_error_in_a_sentence(
    call: Any, words: str, coarse: tyrecal.LoadedCase
) -> None:
    """Wrong input is not a failure of the solver, and never silently another question."""
    with pytest.raises(ValueError, match=words) as error:
        call(coarse)
    assert "\n" not in str(error.value)


def test_a_fit_to_a_file_is_that_of_the_command(coarse: tyrecal.LoadedCase, tmp_path: Path) -> None:
    """The same content of fit.json; what was measured elsewhere is told."""
    path, record = tmp_path / "measured.csv", str(tmp_path / "record")
    path.write_text(DATA.read_text() + "frequency_Hz,2,0,,,160,0,70,0.5\n")
    given = ["--mesh", "coarse", "--no-pictures", "--store", record, "--fix", "C10"]
    given += ["--measured", str(path), "--pressure-kPa", "240", "--output", str(tmp_path / "out")]
    assert run("fit", str(CASE), *given) == 0
    case = tyrecal.with_values(coarse, {"pressure_kPa": 240})
    fit = tyrecal.fit_case(case, path, fixed="C10", record=record)
    assert fit.result == tyrecal.read_results(tmp_path / "out")["fit"]
    assert fit.result["provenance"]["measured_sha256"] == sha256(path.read_bytes()).hexdigest()
    assert fit.left_out == ["1 values at 160 kPa"]
    assert repr(fit).startswith("Fit(fits, ") and len(repr(fit)) < 150


def test_what_is_shown_in_a_notebook_is_short(coarse: tyrecal.LoadedCase) -> None:
    mode = tyrecal.Mode(Label(2, 1), 66.123, 2, 0.9, 0, None)  # type: ignore[arg-type]
    assert repr(mode) == "Mode([2,1], 66.12 Hz, doublet)"
    assert (
        repr(tyrecal.State("", 240.0, [mode], None)) == "State(240 kPa: 1 modes, 66.1 to 66.1 Hz)"
    )
    case = tyrecal.with_values(coarse, {"C10": 2e6})
    words = "P235/75R17 on an 8 inch rim, 240 kPa, mesh coarse, C10=2e+06"
    assert repr(case) == f"LoadedCase({str(CASE)!r}: {words})"
    filler = tyrecal.list_effects()["bead_filler"]
    assert repr(filler) == "Effect(bead_filler: Bead filler, 0 to 3)"


def test_values_of_variables_are_those_of_the_design_everywhere(coarse: tyrecal.LoadedCase) -> None:
    """Set by `with_values`, or given with a question, they give the same numbers."""
    case = coarse
    stiff = tyrecal.with_values(case, {"C10": 2e6})
    hertz = [mode.frequency_Hz for mode in tyrecal.evaluate_modes(case, {"C10": 2e6})]
    assert [mode.frequency_Hz for mode in tyrecal.evaluate_modes(stiff)] == hertz
    (state,) = tyrecal.sweep_pressure(stiff, [240])
    assert state.modes[0].frequency_Hz == pytest.approx(hertz[0], rel=1e-9)
    with pytest.raises(ValueError, match="C10_Pa is set by the variable 'C10'"):
        tyrecal.with_values(case, {"materials.rubber.C10_Pa": 2e6})


@pytest.fixture
def unrun(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Lets no solver run: a call that comes so far was accepted."""

    def refuse(*given: Any) -> Any:
        raise EvaluationFailed("crashed", "the solver would have run")

    monkeypatch.setattr(Evaluator, "_ask", refuse)
    monkeypatch.chdir(tmp_path)


VALUES = {"C10": 1.1e6}
NATURAL: dict[str, list[dict[str, Any]]] = {  # arguments beside the case, that each function takes
    "load_case": [{"path": CASE}, {"path": str(CASE), "mesh": "coarse"}],
    "with_values": [{"values": VALUES}, {"values": {"pressure_kPa": np.float32(200)}}],
    "evaluate_modes": [{}, {"values": VALUES}, {"values": None}],
    "fit_case": [
        {},
        {"measured": DATA},
        {"measured": str(DATA), "fixed": "C10"},
        {"fixed": ["C10", "A_belt"], "starts": np.int64(2)},
        {"fixed": VALUES},
    ],
    "sweep_pressure": [{"pressures_kPa": x} for x in (200, 200.0, (200, 240), np.array([200.0]))],
    "evaluate_footprint": [
        {"loads_N": x} for x in (3000, [1e3, 2e3], iter([1e3]), np.float64(1e3))
    ],
    "diagnose_case": [
        {"measured": DATA, "effects": "rim_width"},
        {"measured": str(DATA), "effects": ("rim_width", "cap_ply")},
    ],
    "emulate": [{}, {"pressures_kPa": [200, 280]}, {"reach": 1}],
    "list_effects": [{}],
    "run": [
        {"study": "modes"},
        {"study": "sweep-pressure", "pressures_kPa": [200.0], "jobs": 1},
        {"study": "footprint", "loads_N": 3000},
        {"study": "fit", "fixed": "C10", "measured": DATA, "values": VALUES},
        {"study": "diagnose", "effects": "rim_width", "measured": str(DATA)},
    ],
    "read_results": [{"folder": CASES / "ci"}, {"folder": str(CASES / "ci")}],
}
WRONG = [2.5, "neither", object(), [None], {"C10": "soft"}, None, -1, b"x"]
NEVER_WRONG = {"allow_unusual"}  # true or false, as anything is


def accepted(name: str, given: dict[str, Any], case: Any) -> bool:
    """Return whether a call comes as far as the solver, or returns; else it is refused in a
    sentence."""
    function = getattr(tyrecal, name)
    takes_case = "case" in inspect.signature(function).parameters
    try:
        function(**{**({"case": case} if takes_case else {}), **given})
    except EvaluationFailed:
        pass
    except (ValueError, FileNotFoundError) as error:
        if "could be evaluated" in str(error):  # an emulator's designs: all of them failed
            return True
        words = str(error)
        assert words and "\n" not in words, words
        assert any(part in words for part in (*given, *VALUES, "neither")), f"{given}: {words}"
        return False
    return True


@pytest.mark.parametrize("name", NATURAL)
def test_natural_calls_are_accepted(name: str, coarse: tyrecal.LoadedCase, unrun: None) -> None:
    """A path for a case or a file, a plain number or name where there may be several."""
    for given in NATURAL[name]:
        assert accepted(name, given, coarse), given
    if "case" in inspect.signature(getattr(tyrecal, name)).parameters:
        assert accepted(name, NATURAL[name][0], str(CASE))


@pytest.mark.parametrize("name", NATURAL)
def test_wrong_arguments_are_named(name: str, coarse: tyrecal.LoadedCase, unrun: None) -> None:
    """Each argument of each function gets wrong values: no error comes from within."""
    parameters = inspect.signature(getattr(tyrecal, name)).parameters
    for parameter in sorted(parameters.keys() - NEVER_WRONG):
        refused = sum(
            not accepted(name, {**NATURAL[name][0], parameter: value}, coarse) for value in WRONG
        )
        assert refused >= 4, parameter


def test_the_walk_knows_every_function() -> None:
    functions = {name for name in api.__all__ if inspect.isfunction(getattr(tyrecal, name))}
    assert functions == NATURAL.keys()


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
fit = tyrecal.fit_case("case.yaml", Path("measured.csv"), fixed="C10")
assert_type(fit.fitted.objective, float)
(state,) = tyrecal.sweep_pressure(case, [240.0])
tyrecal.sweep_pressure(Path("case.yaml"), 240)
assert_type(state, tyrecal.State)
assert_type(tyrecal.evaluate_footprint(case, [1e3])[0]["area_m2"], float)
found = tyrecal.diagnose_case(case, "measured.csv", effects=["rim_width"])
tyrecal.diagnose_case(case, "measured.csv", repeats="again.csv", effects="rim_width")
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
    output = done.stdout.splitlines()
    assert [line.partition(": error:")[0] for line in output if ": error:" in line] == [
        str(program.with_name(place)) for place in wrong
    ], done.stdout
    types = [line.partition("Revealed type is ")[2] for line in output if "Revealed" in line]
    assert len(types) == len(tyrecal.__all__) and '"Any"' not in types


ENTRIES = {  # what other rooms, studies from outside and Python users begin with, by module
    "emulator": ["Emulator"],
    "fit.calibrate": ["calibrate"],
    "fit.problem": ["Problem", "objective"],
    "fit.study": ["FitStudy"],
    "fit.targets": ["Target", "read_targets"],
    "variable": ["DesignVariable", "read_variables"],
    "labelling.tree": ["labelings"],
    "modes": ["run"],
    "run_plan": ["RunPlan"],
    "pressure": ["sweep"],
    "pressure_range": ["PressureRange"],
    "result": ["Column", "Table"],
    "signature": ["Plain"],
}
SLOW_IN_STUDIES = {"Emulator", "calibrate"}


@pytest.fixture(scope="module")
def setting() -> Iterator[dict[str, object]]:
    """Names that the examples take from that of the package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        case = tyrecal.load_case(Path("cases/p235_75r17.yaml"), mesh="coarse")
        yield {"case": case, "evaluator": Evaluator(TyreDesign(case)), "tyrecal": tyrecal}


@pytest.mark.parametrize(
    ("module", "name"),
    [
        pytest.param(module, name, marks=[pytest.mark.slow] * (name in SLOW_IN_STUDIES))
        for module, names in {"": ["", "result_types"], **ENTRIES}.items()
        for name in names
    ],
)
def test_the_example_in_studies(module: str, name: str, setting: dict[str, object]) -> None:
    room = importlib.import_module(f"{studies.__name__}.{module}".rstrip("."))
    subject = getattr(room, name) if name else room
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
    (test,) = finder.find(subject, name or module, module=False, globs={**vars(room), **setting})
    assert test.examples
    assert runner.run(test).failed == 0
