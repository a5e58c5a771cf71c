"""The ABAQUS runner against stand-ins that solve its decks, and a user's own."""

from __future__ import annotations

import json
import os
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest
from tyrecal_solvers.abaqus import launch
from tyrecal_solvers.abaqus.adapter import Abaqus
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.language.text import read_keywords

from tyrecal.cli.main import main
from tyrecal.simulate.deck.decks import Decks, without_header
from tyrecal.simulate.deck.tyre_design import OWN_TEXT, TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.fit.problem import Problem
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from ..cli.test_cli import run
from ..tyre import own_decks

STANDIN = Path(__file__).with_name("standin_abaqus.py")


COARSE = """
    small:
      elements: {crown: 4, upper_sidewall: 3, lower_sidewall: 3, bead: 1}
      rows: [1, 1, 1, 1]
    default:
"""


@pytest.fixture
def coarse(case_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Makes a coarse case, and has ``command`` be the user's."""

    def make(
        command: Sequence[str] = (sys.executable, str(STANDIN)),
        wait_s: float = 2.0,
        time_limit_s: float = 60,
    ) -> Path:
        monkeypatch.setenv("TYRECAL_SOLVER_COMMAND", shlex.join(command))
        options = {"licence_wait_s": wait_s, "licence_first_wait_s": 0.1}
        path = case_folder / "p235_75r17.yaml"
        text = path.read_text()
        for old, new in (
            ("  options: {}", f"  options: {json.dumps(options)}"),
            ("\n    default:\n", COARSE),
            ("time_limit_s: 300", f"time_limit_s: {time_limit_s}"),
            ("level: default", "level: small"),
            ("sectors: 60", "sectors: 24"),
        ):
            assert text.count(old) == 1
            text = text.replace(old, new)
        path.write_text(text)
        return path

    return make


def tyrecal(*arguments: object) -> int:
    with pytest.raises(SystemExit) as leaving:
        main([str(a) for a in arguments])
    return int(leaving.value.code or 0)


def test_modes_are_those_of_the_bundled_solver(coarse: Callable[..., Path], tmp_path: Path) -> None:
    case = coarse()
    common = ("--pressure-kPa", 200, "--quiet")
    assert tyrecal("modes", case, "--solver", "abaqus", "--output", tmp_path / "a", *common) == 0
    assert tyrecal("modes", case, "--output", tmp_path / "b", *common) == 0
    ours, theirs = (json.loads((tmp_path / d / "modes.json").read_text()) for d in "ab")
    label = lambda mode: (mode["c"], mode["m"], mode["kind"], mode["multiplicity"])
    hertz = {label(mode): mode["frequency_Hz"] for mode in ours["modes"]}
    for mode in theirs["modes"][:9]:
        assert hertz[label(mode)] == pytest.approx(mode["frequency_Hz"], rel=1e-9)
    assert ours["pressure_kPa"] == 200
    assert ours["mass_kg"] == pytest.approx(theirs["mass_kg"], rel=1e-6)


@pytest.mark.slow
def test_a_fit_ends_where_the_bundled_solver_ends(
    coarse: Callable[..., Path], tmp_path: Path
) -> None:
    case = coarse()
    common = ("--fix", "A_belt", "--fix", "A_carcass", "--method", "gauss-newton", "--quiet")
    assert tyrecal("fit", case, "--solver", "abaqus", "--output", tmp_path / "a", *common) == 0
    assert tyrecal("fit", case, "--no-pictures", "--output", tmp_path / "b", *common) == 0
    ours, theirs = (json.loads((tmp_path / d / "fit.json").read_text()) for d in "ab")
    assert ours["objective_Hz"] == pytest.approx(theirs["objective_Hz"], rel=1e-6)
    for one, other in zip(ours["modes"], theirs["modes"], strict=True):
        assert one["fitted_Hz"] == pytest.approx(other["fitted_Hz"], rel=1e-4)
    assert (tmp_path / "a" / "fit_section.png").exists()


@pytest.mark.slow
def test_slopes_and_record_are_the_same_with_any_number_of_jobs(
    coarse: Callable[..., Path], tmp_path: Path
) -> None:
    """A design whose neighbours, from which the slopes come, are evaluated in parallel."""
    case, points, records = load_case(coarse()), [], []
    command = (sys.executable, str(STANDIN))  # workers may be older than the environment is
    for jobs in (1, 2):
        evaluator = Evaluator(
            TyreDesign(case), "abaqus", store=Store(tmp_path / f"{jobs}"), command=command
        )
        problem = Problem(case, evaluator, {"A_belt": 2.2e-7}, jobs=jobs)
        points.append(problem.evaluate(problem.start()))
        assert (evaluator.counts.runs, evaluator.counts.recorded) == (3, 0)
        paths = evaluator.store.folder.rglob("*.record") if evaluator.store else ()
        records.append({path.name: path.read_bytes() for path in paths})
    assert (points[0].jacobian == points[1].jacobian).all()
    assert (points[0].residuals == points[1].residuals).all()
    assert records[0] == records[1] and len(records[0]) == 3


FAULTS = [
    ("crash", "crashed", r"exit code 1: \*\*\*ERROR: ELEMENT 7 IS TOO ODD"),
    ("diverge", "no_equilibrium", "TOO MANY ATTEMPTS"),
    ("hang", "timed_out", "time limit"),
    ("nothing", "crashed", "without completing"),
    ("aborted", "crashed", "without completing"),
    ("no_fil", "no_results", "lists 20 frequencies, but there is no modes.fil.*SIM=NO"),
    ("truncated", "no_results", "cut short|same nodes"),
    ("disc_full", "no_results", "cut short"),
    ("doubled", "no_results", "mode 1 is in it twice"),
    ("zeros", "no_results", "is zero"),
    ("nan", "no_results", "values that are not numbers"),
    ("negative", "unstable", "is negative"),
    ("few", "no_results", "has 19 modes, 20 were requested"),
    ("stale", "no_results", "older than the deck"),
    ("other_dat", "no_results", "disagree on mode 1"),
    ("no_mass", "no_results", "no TOTAL MASS"),
]


QUICK = ("crash",)


@pytest.mark.parametrize(
    ("fault", "cause", "message"),
    [pytest.param(*fault, marks=[] if fault[0] in QUICK else pytest.mark.slow) for fault in FAULTS],
)
def test_no_fault_becomes_a_number(
    coarse: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fault: str,
    cause: str,
    message: str,
) -> None:
    monkeypatch.setenv("STANDIN_FAULT", fault)
    evaluator = Evaluator(
        TyreDesign(load_case(coarse(time_limit_s=4 if fault == "hang" else 60))),
        "abaqus",
        tmp_path / "runs",
    )
    with pytest.raises(EvaluationFailed, match=message) as failure:
        evaluator.evaluate(Question({}))
    assert failure.value.cause == cause
    assert failure.value.folder and (failure.value.folder / "modes.inp").exists()


@pytest.mark.slow
def test_results_of_an_earlier_run_are_removed_first(
    coarse: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluator = Evaluator(TyreDesign(load_case(coarse())), "abaqus", tmp_path / "runs", keep=True)
    evaluator.evaluate(Question({}))
    (folder,) = (tmp_path / "runs").iterdir()
    monkeypatch.setenv("STANDIN_FAULT", "nothing")
    adapter = Abaqus()
    with pytest.raises(adapter.failures):
        adapter.run(folder, 60)
    assert not (folder / "inflate.sta").exists()


@pytest.mark.slow
def test_a_licence_is_waited_for(
    coarse: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STANDIN_FAULT", "licence:2")
    evaluator = Evaluator(TyreDesign(load_case(coarse())), "abaqus", tmp_path / "runs", keep=True)
    assert len(evaluator.evaluate(Question({})).modes) == 20
    (folder,) = (tmp_path / "runs").iterdir()
    assert len((folder / "denials").read_text()) == 4  # two denied, two granted


@pytest.mark.slow
def test_a_licence_that_never_comes(
    coarse: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STANDIN_FAULT", "licence:inf")
    evaluator, waits = (
        Evaluator(TyreDesign(load_case(coarse(wait_s=0.5))), "abaqus", tmp_path / "runs"),
        [],
    )
    clock = SimpleNamespace(monotonic=time.monotonic, sleep=waits.append)
    monkeypatch.setattr(launch, "time", clock)
    with pytest.raises(EvaluationFailed, match=r"after 0\.5 s of waiting.*FLEXnet") as failure:
        evaluator.evaluate(Question({}))
    assert failure.value.cause == "licence"
    assert waits == pytest.approx([0.1, 0.2, 0.2])
    assert failure.value.folder
    assert len((failure.value.folder / "denials").read_text()) == 4


@pytest.mark.slow
def test_a_job_that_queues_until_its_time_is_over(
    coarse: Callable[..., Path], tmp_path: Path
) -> None:
    queue = "print('Queued for 5 Abaqus licenses', flush=True); time.sleep(60)"
    words = f"import sys, time; 'release' in sys.argv[1] and sys.exit(); {queue}"
    case = load_case(coarse([sys.executable, "-c", words], time_limit_s=4))
    with pytest.raises(EvaluationFailed, match="Queued for 5") as failure:
        Evaluator(TyreDesign(case), "abaqus", tmp_path / "runs").evaluate(Question({}))
    assert failure.value.cause == "licence"


def test_a_missing_command(
    coarse: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = coarse(["no-such-abaqus"])
    assert tyrecal("modes", case, "--solver", "abaqus", "--output", tmp_path / "out") == 3
    message = capsys.readouterr().err
    assert "no folder of PATH holds the program 'no-such-abaqus'; install it or give" in message
    assert message.count("\n") == 1 and not list(tmp_path.glob("out/runs/*"))


def test_options_that_are_wrong(
    coarse: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = coarse(wait_s=-1.0)
    assert tyrecal("modes", case, "--solver", "abaqus", "--output", tmp_path / "out") == 2
    assert "solver.options.licence_wait_s must be" in capsys.readouterr().err


def test_a_deck_without_modes_is_refused_before_it_runs(
    coarse: Callable[..., Path], tmp_path: Path
) -> None:
    case = coarse()
    own = case.parent / "own"
    own.mkdir()
    (own / "modes.inp.j2").write_text("*STEP\n*STATIC\n1.0, 1.0\n*END STEP\n")
    case.write_text(case.read_text() + "templates: own\n")
    with pytest.raises(DeckRefused, match="needs one"):
        Evaluator(TyreDesign(load_case(case)), "abaqus", tmp_path / "runs").evaluate(Question({}))


def test_the_release_is_asked_of_the_command_on_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert Abaqus().version == "unknown"
    command = tmp_path / "abaqus"
    command.write_text("#!/bin/sh\necho Abaqus 2023.HF4\n")
    command.chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join([str(tmp_path), os.defpath]))
    assert Abaqus().version == "2023.HF4"


OWN_DECK_STANDIN = Path(__file__).with_name("standin_own_deck.py")


RESTART = "*RESTART, WRITE\n"


MIDDLE = range(own_decks.BELT[0], own_decks.BELT[1] + 1, 2)


CROWN = "*NSET, NSET=CROWN\n" + "".join(f"{own_decks.number(4, j)},\n" for j in MIDDLE)


def case_of(folder: Path, text: str) -> Path:
    """A case of a deck that ABAQUS could revolve."""
    path = folder / "tyre.inp"
    path.write_text(text.replace("*SOLID SECTION", f"{RESTART}{CROWN}*SOLID SECTION", 1))
    deck = read_own_deck(path)
    case = folder / "tyre.yaml"
    case.write_text(own_case(deck, deck.flat({}), "P235/75R17", None))
    return case


@pytest.mark.slow
@pytest.mark.parametrize("style", [own_decks.plain, own_decks.millimetres])
def test_modes_of_an_own_deck(
    style: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The deck is in m or mm, with a number set by a path and another pressure."""
    case = case_of(tmp_path, style())  # type: ignore[operator]
    name = next(iter(load_case(case).case.variables))
    value = 1.2 * load_case(case).case.variables[name].start
    given = ("--set", f"{name}={value!r}", "--pressure-kPa", "180", "--json", "--no-store")
    command = ("--solver", "abaqus", "--solver-command", f"{sys.executable} {OWN_DECK_STANDIN}")
    results = []
    for folder, more in (("a", command), ("b", ())):
        assert run("modes", str(case), *given, *more, "--output", str(tmp_path / folder)) == 0
        results.append(json.loads(capsys.readouterr().out))
    ours, theirs = results
    assert ours["mass_kg"] == pytest.approx(theirs["mass_kg"], rel=1e-5)
    label = lambda mode: (mode["c"], mode["m"], mode["kind"])
    hertz = {label(mode): mode["frequency_Hz"] for mode in ours["modes"]}
    same = [m for m in theirs["modes"] if label(m) in hertz]
    assert len(same) >= 6
    for mode in same:
        assert hertz[label(mode)] == pytest.approx(mode["frequency_Hz"], rel=1e-6)


def test_the_text_is_the_users_but_for_the_marks(tmp_path: Path) -> None:
    """Every line, comments and blanks among them, and what it includes; the grammar takes both."""
    mesh, rest = own_decks.plain().split("*SOLID SECTION", 1)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text(mesh + RESTART + CROWN)
    text = "** mine\n*INCLUDE, INPUT=parts/mesh.inp\n*SOLID SECTION" + rest.replace(
        "BELT_2, 2.1e-7", "BELT_2 ,  {{ A_belt }}"
    )
    (tmp_path / "tyre.inp").write_text(text)
    deck = read_own_deck(tmp_path / "tyre.inp")
    content = own_case(deck, deck.flat({"A_belt": 2.1e-7}), "P235/75R17", None)
    (tmp_path / "tyre.yaml").write_text(content.replace("numbers: {}", "numbers: {A_belt: 2.1e-7}"))
    case = load_case(tmp_path / "tyre.yaml")

    def written(values: dict[str, float]) -> dict[str, str]:
        texts = Decks(TyreDesign(with_values(case, values))).texts(OWN_TEXT)
        return {file: without_header(text.encode()).decode() for file, text in texts.items()}

    plain = written({})
    assert plain["inflate.inp"] == text.replace("{{ A_belt }}", "2.1e-07")
    assert plain["parts/mesh.inp"] == mesh + RESTART + CROWN
    first = read_keywords(plain["parts/mesh.inp"] + plain["inflate.inp"].split("mesh.inp\n")[1])
    assert not [finding for finding in findings(first) if finding.sure]
    assert not findings(read_keywords(plain["modes.inp"]), first)
    other = written({"deck.numbers.A_belt": 3e-7, "material RUBBER / HYPERELASTIC / C10": 9e5})
    lines = zip(plain["inflate.inp"].splitlines(), other["inflate.inp"].splitlines(), strict=True)
    assert [pair for pair in lines if pair[0] != pair[1]] == [
        (
            "BELT_2 ,  2.1e-07, 1.16e-3, 0.0, CORD, 110.0",
            "BELT_2 ,  3e-07, 1.16e-3, 0.0, CORD, 110.0",
        ),
        ("800000.0, 200000.0, 5e-08", "900000, 200000.0, 5e-08"),
    ]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (RESTART, "", "put .RESTART, WRITE into the deck"),
        ("NSET=CROWN", "NSET=TOP", "no node set CROWN: .* deck.crown"),
        ("*STATIC, LONG TERM", "*STATIC", "static_moduli must be those"),
        (
            "*END STEP",
            "*END STEP\n*STEP\n*STATIC\n*USER SUBROUTINE\n*END STEP",
            "leads out of the run's folder",
        ),
    ],
)
def test_what_abaqus_would_not_revolve(tmp_path: Path, old: str, new: str, words: str) -> None:
    case = case_of(tmp_path, own_decks.plain())
    path = tmp_path / "tyre.inp"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(TemplateFailed, match=words):
        Decks(TyreDesign(load_case(case))).texts(OWN_TEXT)


def test_parts_are_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "tyre.inp").write_text(own_decks.cae())
    deck = read_own_deck(tmp_path / "tyre.inp")
    (tmp_path / "tyre.yaml").write_text(own_case(deck, deck.flat({}), "P235/75R17", None))
    with pytest.raises(TemplateFailed, match="Do not use parts and assemblies"):
        Decks(TyreDesign(load_case(tmp_path / "tyre.yaml"))).texts(OWN_TEXT)
