"""The command line: results, exit codes, one sentence per mistake, nothing written over."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal import studies
from tyrecal.cli.main import main

from ..conftest import CASES
from ..solved import run_anew

CASE = str(CASES / "p235_75r17.yaml")


def run(*arguments: str) -> int:
    """Exit code of a command run in this process."""
    with pytest.raises(SystemExit) as leave:
        main(list(arguments))
    code = leave.value.code
    return code if isinstance(code, int) else 0


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['tyrecal', '--help']\n"
        "from tyrecal.cli.main import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pydantic', 'jinja2', 'matplotlib', 'rich', 'meshio'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for name in ("validate", "deck", "modes", "fit", "Exit codes"):
        assert name in done.stdout


@pytest.mark.slow
def test_commands_import_what_they_use(tmp_path: Path) -> None:
    """One process runs all in turn: what one has imported, those after it have too."""
    out = ["--output", str(tmp_path / "out"), "--store", str(tmp_path / "store"), "--quiet"]
    coarse = ["--mesh", "coarse"]
    never = ("scipy.stats", "scipy.interpolate")
    never += ("matplotlib", "meshio", "pyuff", "distributed", "tyrecal.measured.identify")
    commands: list[tuple[list[str], tuple[str, ...]]] = [
        (["completion", "bash"], ("scipy", "numpy")),
        (["validate", CASE], ("scipy",)),
        (["effects"], ("scipy",)),
        (["solvers"], ("scipy",)),
        (["modes", CASE, *coarse, *out], ("scipy.interpolate",)),
        (["sweep-pressure", CASE, *coarse, "--no-pictures", *out], ()),
        (["deck", CASE, *out[:2]], ()),
        (["footprint", CASE, "--help"], ()),
        (["doctor"], ()),
        (["store", str(tmp_path / "store"), "--verify"], ()),
        (["batch", CASE, "--studies", "modes", "--output", str(tmp_path)], ()),
        (["fit", CASE, *coarse, "--no-pictures", *out], ()),  # SciPy's optimiser, by the fit alone
    ]
    code = (
        "import sys\nfrom tyrecal.cli.main import main\n"
        f"for command, unused in {commands!r}:\n"
        "    try: main(command)\n"
        "    except SystemExit as leave: assert not leave.code, (command, leave.code)\n"
        f"    found = [name for name in (*unused, *{never!r}) if name in sys.modules]\n"
        "    assert not found, (command, found)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", ["validate", "deck", "modes", "fit"])
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(command, "--help") == 0
    assert "CASE" in capsys.readouterr().out


def test_modes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["modes", CASE, "--output", str(tmp_path / "out"), "--json"]
    assert run(*arguments, "--pressure-kPa", "200", "--set", "A_belt=2.118683e-7") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "out" / "modes.json").read_text())
    assert printed["pressure_kPa"] == 200.0 and printed["load_N"] == 0.0
    assert printed["mass_kg"] == pytest.approx(12.797, abs=0.01)
    axial = next(m for m in printed["modes"] if m["kind"] == "axial")
    assert axial["frequency_Hz"] == pytest.approx(33.9071, rel=5e-3)
    assert not (tmp_path / "out" / "runs").exists()
    assert run(*arguments, "--set", "materials.rubber.density_kg_per_m3=2200") == 0
    heavier = json.loads(capsys.readouterr().out)
    assert heavier["mass_kg"] > 1.5 * printed["mass_kg"]


def test_modes_next_to_measurements(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mode measured in this state has its deviation; one at another pressure has none."""
    out, measured = tmp_path / "out", tmp_path / "measured.csv"
    measured.write_text("c,m,frequency_Hz,sigma_Hz,pressure_kPa\n2,0,80,0.1,240\n3,0,90,0.1,200\n")
    arguments = ["modes", CASE, "--mesh", "coarse", "--measured", str(measured)]
    assert run(*arguments, "--output", str(out), "--json") == 0
    modes = json.loads(capsys.readouterr().out)["modes"]
    (compared,) = [mode for mode in modes if "measured_Hz" in mode]
    assert (compared["c"], compared["m"], compared["measured_Hz"]) == (2, 0, 80.0)
    percent = 100 * (compared["frequency_Hz"] / 80.0 - 1)
    assert compared["deviation_percent"] == pytest.approx(percent)
    for words in (["--pressure-kPa", "220"], ["--load-N", "4000"]):
        assert run(*arguments, *words, "--output", str(tmp_path / "none")) == 2
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_fit_writes_the_same_bytes_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bundled, "run", run_anew)
    words = ["fit", CASE, "--mesh", "coarse", "--no-pictures", "--no-store", "--output"]
    for name in ("one", "two"):
        assert run(*words, str(tmp_path / name)) == 0
    for file in ("fit.json", "fit.csv", "fit_history.csv"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    fit = json.loads((tmp_path / "one" / "fit.json").read_text())
    assert set(fit["variables"]) == {"A_belt", "A_carcass", "C10"}
    run_facts = json.loads((tmp_path / "one" / "run.json").read_text())["fit"]
    assert run_facts["command"] == "fit" and run_facts["solver"].startswith("bundled ")


@pytest.mark.slow
def test_fit_with_pictures(tmp_path: Path) -> None:
    coarse = ["--mesh", "coarse", "--fix", "C10", "--quiet"]
    assert run("fit", CASE, *coarse, "--output", str(tmp_path)) == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert {"fit.json", "convergence.png", "fit_section.png", "fit_modes.png"} <= names
    modes = [name for name in names if name.startswith("fit_mode_")]
    assert len(modes) == 9 and all(name.endswith(".vtu") for name in modes)
    assert "C10" not in json.loads((tmp_path / "fit.json").read_text())["variables"]


def test_a_deck_that_the_solver_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One sentence, and no folder: of rubber at a frequency, and of an option that is none."""
    other = str(CASES / "205_60r15.yaml")
    for case, more, why in (
        (other, [], "analysis.vibration_frequency_Hz must be null"),
        (CASE, ["--set", "analysis.sectors=8"], "analysis.sectors is 8, must be at least"),
    ):
        out = tmp_path / "out"
        assert run("deck", case, "--solver", "calculix", "--output", str(out), *more) == 2
        *_, message = capsys.readouterr().err.splitlines()
        assert message.startswith("error: ") and why in message
        assert not out.exists()


@pytest.mark.slow
def test_deck_runs_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("deck", CASE, "--output", str(tmp_path / "decks"), "--json") == 0
    paths = [Path(p) for p in json.loads(capsys.readouterr().out)]
    assert {p.name for p in paths} == {"inflate.inp", "modes.inp", "modes.request.json"}
    solver = [sys.executable, "-m", "tyrecal_solvers.bundled"]
    subprocess.run([*solver, str(tmp_path / "decks" / "modes"), "--oldjob", "inflate"], check=True)
    modes = json.loads((tmp_path / "decks" / "modes.json").read_text())["steps"][0]["modes"]
    assert len(modes) == 10


def test_validate(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("validate", CASE) == 0
    assert "no mistakes" in capsys.readouterr().out


def test_a_failed_solver_run_is_kept_and_quoted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = [
        "--mesh",
        "coarse",
        "--allow-unusual",
        "--pressure-kPa",
        "1900",
        "--set",
        "A_carcass=1e-8",
        "--set",
        "C10=1e5",
    ]
    assert run("modes", CASE, "--output", str(out), *arguments) == 3
    message = capsys.readouterr().err
    assert "inflation stopped at" in message and "of 1900 kPa" in message
    (kept,) = (out / "runs").iterdir()
    assert str(kept) in message and (kept / "inflate.inp").exists()
    assert not (out / "modes.json").exists()


def test_says_so_when_it_does_not_move(
    case_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Targets equal to the start's own frequencies: nothing to gain, exit code 4."""
    path = case_folder / "p235_75r17.yaml"
    out = str(case_folder / "out")
    assert run("modes", str(path), "--output", out, "--json") == 0
    text = path.read_text()
    for mode in json.loads(capsys.readouterr().out)["modes"]:
        kind = f", kind: {mode['kind']}" if mode["kind"] else ""
        start = f"    - {{c: {mode['c']}, m: {mode['m']}{kind}, frequency_Hz: "
        for line in text.splitlines():
            if line.startswith(start):
                text = text.replace(line, f"{start}{mode['frequency_Hz']!r}}}")
    path.write_text(text)
    assert run("fit", str(path), "--output", out, "--no-pictures") == 4
    assert "DID NOT MOVE" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "A_bolt=1"], "A_belt"),
        (["--set", "A_belt"], "NAME=VALUE"),
        (["--set", "A_belt=wide"], "number"),
        (["--set", "A_belt=nan"], "finite"),
        (["--set", "A_belt=-1e-7"], "area_m2"),
        (["--pressure-kPa", "-3"], "pressure_kPa"),
        (["--mesh", "finest"], "refined"),
        (["--solver", "nastran"], "bundled"),
    ],
)
def test_wrong_options(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("modes", CASE, "--output", str(out), *arguments) == 2
    message = capsys.readouterr().err
    assert words in message and "Traceback" not in message
    assert not out.exists()


def test_wrong_options_of_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = ["--output", str(tmp_path / "out"), "--no-pictures"]
    assert run("fit", CASE, *out, "--fix", "A_bolt") == 2
    assert "A_belt" in capsys.readouterr().err
    assert run("fit", CASE, *out, "--set", "A_belt=5e-8") == 2
    assert "bounds" in capsys.readouterr().err
    assert run("fit", CASE, *out, "--fix", "A_belt", "--fix", "A_carcass", "--fix", "C10") == 2
    assert "no variable is free" in capsys.readouterr().err
    assert run("fit", CASE, *out, "--pressure-kPa", "200") == 2
    assert "no target was measured at 200 kPa, only at 240 kPa" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_folder_of_another_case_is_refused(
    case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    assert run("modes", CASE, "--mesh", "coarse", "--output", out, "--quiet") == 0
    before = (tmp_path / "out" / "modes.json").read_bytes()
    other = str(case_folder / "p235_75r17.yaml")
    assert run("modes", other, "--output", out, "--set", "A_belt=3e-7") == 2
    assert "--output" in capsys.readouterr().err
    assert (tmp_path / "out" / "modes.json").read_bytes() == before


def test_a_number_that_a_variable_sets_is_said_not_to_count(
    case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Edited alone it would change nothing, unseen."""
    path, out = case_folder / "p235_75r17.yaml", tmp_path / "out"
    path.write_text(path.read_text().replace("C10_Pa: 1.0e+6", "C10_Pa: 2.0e+6", 1))
    words = "materials.rubber.C10_Pa is 2e+06 in the case, but does not count: its variable 'C10'"
    for arguments in (["validate"], ["modes", "--mesh", "coarse"], ["deck"]):
        where = ["--output", str(out)] if arguments != ["validate"] else []
        assert run(arguments[0], str(path), *arguments[1:], *where) == 0
        assert f"{words} starts at 1e+06\n" in capsys.readouterr().err, arguments
    assert run("deck", str(path), "--output", str(out), "--set", "C10=3e6") == 0
    assert run("validate", CASE) == 0
    assert "does not count" not in capsys.readouterr().err


def test_results_go_on_where_their_project_was_moved(case_folder: Path, tmp_path: Path) -> None:
    options = ["--mesh", "coarse", "--quiet", "--output"]
    out = case_folder / "out"
    assert run("modes", str(case_folder / "p235_75r17.yaml"), *options, str(out)) == 0
    moved = case_folder.rename(tmp_path / "moved")
    assert run("modes", str(moved / "p235_75r17.yaml"), *options, str(moved / "out")) == 0
    facts = json.loads((moved / "out" / "run.json").read_text())["modes"]
    assert facts["case"] == "../p235_75r17.yaml" and facts["solver_runs"] == 0


@pytest.mark.parametrize("content", ["", "[]", "{}", '"a case"', '{"case": "/gone/other.yaml"}'])
def test_a_folder_with_a_record_of_something_else_is_refused(
    content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "run.json").write_text(content)
    assert run("deck", CASE, "--output", str(tmp_path)) == 2
    error = capsys.readouterr().err
    assert "holds results of " in error and "; give another one with --output" in error
    assert (tmp_path / "run.json").read_text() == content


def test_a_fit_on_this_machine_and_on_others_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    both = ["--jobs", "2", "--scheduler", "tcp://localhost:1"]
    assert run("fit", CASE, *both, "--output", str(out)) == 2
    assert "--jobs applies to this machine only" in capsys.readouterr().err
    assert not out.exists()


def test_a_scheduler_that_would_have_nothing_to_do_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("fit", CASE, "--scheduler", "tcp://localhost:1", "--output", str(out)) == 2
    assert "--scheduler has no effect here: " in capsys.readouterr().err
    assert not out.exists()


def test_jobs_with_nothing_to_do_are_mentioned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Scripts give --jobs to every command."""
    out = ["--output", str(tmp_path / "out"), "--no-pictures"]
    assert run("modes", CASE, "--mesh", "coarse", "--jobs", "2", *out) == 0
    assert "--jobs has no effect here: only one design" in capsys.readouterr().err


def test_a_template_that_runs_code_is_refused(
    case_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = case_folder / "own"
    own.mkdir()
    (own / "inflate.inp.j2").write_text("{{ ''.__class__.__base__.__subclasses__() }}")
    path = case_folder / "p235_75r17.yaml"
    path.write_text(path.read_text() + "\ntemplates: own\n")
    assert run("modes", str(path), "--output", str(case_folder / "out")) == 2
    message = capsys.readouterr().err
    assert "unsafe" in message and "Traceback" not in message and message.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "rebar_layers.belt_1.area_m2=3e-7"], "is set by the variable 'A_belt'"),
        (["--set", "A_belt=3e-7", "--set", "A_belt=4e-7"], "--set A_belt=3e-7 and --set A"),
        (
            ["--set", "pressure_kPa=200", "--pressure-kPa", "220"],
            "--set pressure_kPa=200 and --pressure-kPa 220: two values for one number",
        ),
        (
            ["--set", "rebar_layers.belt_1.area_m2=3e-7", "--set", "A_belt=4e-7"],
            "--set rebar_layers.belt_1.area_m2=3e-7 and --set A_belt=4e-7: two values",
        ),
    ],
)
def test_an_assignment_is_never_ignored(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("modes", CASE, "--output", str(tmp_path / "out"), *arguments) == 2
    assert words in capsys.readouterr().err


def test_variables_that_start_at_zero(
    case_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pressure and a Prony share have no design below 0: slopes are one-sided there."""
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text()
    extra = "".join(
        f"  {name}:\n    sets: [{where}]\n    start: 0\n    lower: 0\n    upper: {upper}\n"
        "    scale: linear\n"
        for name, where, upper in (
            ("p", "pressure_kPa", 300),
            ("k", "materials.rubber.prony.0.k", 0.5),
        )
    )
    path.write_text(text.replace("\ntargets:", f"\n{extra}\ntargets:"))
    assert (
        run("deck", str(path), "--output", str(case_folder / "out"), "--quiet", "--allow-unusual")
        == 0
    )
    request = json.loads((case_folder / "out" / "modes.request.json").read_text())
    slopes = {name: [row[3] for row in rows] for name, rows in request["sensitivities"].items()}
    assert slopes["p"] == pytest.approx([1e3, 1e3])
    assert slopes["k"] == pytest.approx([1.0])


@pytest.mark.slow
def test_a_gauge_is_a_number_like_any_other(
    case_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A thicker tread is heavier, and as a variable its slope is exact."""
    path = case_folder / "p235_75r17.yaml"
    gauge = "\n  gauges: [{between: [belt2, outer], regions: [crown], factor: 1.0}]\n\nmesh:"
    path.write_text(path.read_text().replace("\n\nmesh:", gauge))
    arguments = ["modes", str(path), "--output", str(case_folder / "out"), "--json"]
    masses, axial = [], []
    for factor in (1.0, 1.01, 0.99):
        assert run(*arguments, "--set", f"section.gauges.0.factor={factor}") == 0
        result = json.loads(capsys.readouterr().out)
        masses.append(result["mass_kg"])
        axial.append(next(m["frequency_Hz"] for m in result["modes"] if m["kind"] == "axial"))
    assert masses[1] > masses[0] > masses[2]
    assert masses[1] - masses[2] == pytest.approx(0.02 * 4.4, rel=0.2)  # a tread of 4.4 kg
    from tyrecal.simulate.deck.tyre_design import TyreDesign
    from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
    from tyrecal.tyre.case import start_values
    from tyrecal.tyre.load import load_case

    case = load_case(path)
    name = "section.gauges.0.factor"
    answer = Evaluator(TyreDesign(case)).evaluate(
        Question({**start_values(case), name: 1.0}, (name,))
    )
    modes = [(m.frequency_Hz, g) for m, g in zip(answer.modes, answer.gradients[name], strict=True)]
    slope = min(modes, key=lambda mode: abs(mode[0] - axial[0]))[1]
    assert slope == pytest.approx((axial[1] - axial[2]) / 0.02, rel=1e-3)


def test_a_broken_command_or_study_of_a_package_costs_no_other(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    broken = EntryPoint("weigh", "no_such_package:command", "tyrecal.commands")
    monkeypatch.setattr("tyrecal.cli.main._outside", lambda: {"weigh": broken})
    assert run("--help") == 0
    printed = capsys.readouterr()
    assert "weigh" not in printed.out and "Calibrate the case's variables" in printed.out
    assert "command 'weigh' of 'no_such_package:command' cannot be loaded" in printed.err
    assert run("weigh") == 2
    assert "install a newer version of the package" in capsys.readouterr().err
    monkeypatch.setattr(studies, "entry_points", lambda group: [broken])
    assert list(studies.result_types()) == list(studies.STUDIES)
    assert "study 'weigh'" in caplog.text


NOT_MAPPED = ImportError("_flapack.so: failed to map segment from shared object")


@pytest.mark.parametrize(
    "failure", [MemoryError(), OSError(12, "Cannot allocate memory"), NOT_MAPPED]
)
def test_too_little_memory_is_one_sentence(
    failure: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(path: Path, allow_unusual: bool) -> None:
        raise failure

    monkeypatch.setattr("tyrecal.measured.load.judged", fail)
    assert run("validate", CASE) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ") and "memory" in line


@pytest.mark.parametrize(("given", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_blas_has_one_thread_unless_its_variable_is_set(
    given: dict[str, str], threads: str
) -> None:
    """Set before NumPy is imported, which reads it once."""
    code = "import os, sys, tyrecal.cli.main; print(os.environ['OPENBLAS_NUM_THREADS'])"
    code += "; assert 'numpy' not in sys.modules"
    env = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")} | given
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == threads
