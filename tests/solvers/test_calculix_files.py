"""CalculiX's decks, command and results: what is refused, and that no failure passes."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.calculix import adapter
from tyrecal_solvers.calculix.adapter import CalculiX, Refused, _check_rubber, _inflated, _shapes
from tyrecal_solvers.calculix.results import Fields, pairs
from tyrecal_solvers.calculix.runner import _is_safe, _said
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from .standin_calculix import (
    IMAGINARY,
    LEFT,
    REAL,
    STATIC,
    block,
    evaluate,
    folder_for,
    frd,
    rows,
    with_two_diameters,
)


def main_case(**options: object) -> LoadedCase:
    """The paper's tyre with options of the solver."""
    loaded = load_case(CASES / "p235_75r17.yaml")
    solver = loaded.case.solver.model_copy(update={"name": "calculix", "options": options})
    return LoadedCase(
        loaded.case.model_copy(update={"solver": solver}),
        loaded.path,
        loaded.section,
        loaded.folder,
        loaded.file_data,
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"comand": "ccx"}, "no 'comand'"),
        ({"command": "ccx"}, "has no 'command'"),
        ({"parallel": 0}, "must be 1 or more"),
        ({"parallel": True}, "must be 1 or more"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, options: dict, words: str) -> None:
    with pytest.raises(Refused, match=words):
        CalculiX().write(Decks(TyreDesign(main_case(**options))), tmp_path)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"element": "C3D4"}, "must be C3D20R, C3D20 or C3D8"),
        ({"ply_thickness_m": "thin"}, "must be a thickness"),
        ({"ply_thickness_m": 2e-3}, "do not fit.*folds over"),
    ],
)
def test_decks_that_cannot_be_written(options: dict, words: str) -> None:
    with pytest.raises(TemplateFailed, match=words):
        Decks(TyreDesign(main_case(**options))).texts("calculix")


def test_a_vibration_frequency_is_refused(tmp_path: Path) -> None:
    case = with_values(main_case(), {})
    analysis = case.case.analysis.model_copy(update={"vibration_frequency_Hz": 50.0})
    case = LoadedCase(
        case.case.model_copy(update={"analysis": analysis}),
        case.path,
        case.section,
        case.folder,
        case.file_data,
    )
    with pytest.raises(TemplateFailed, match="vibration_frequency_Hz must be null"):
        Evaluator(TyreDesign(case), "calculix", folder=tmp_path).evaluate(Question({}))


@pytest.mark.parametrize(
    ("row", "stable"),
    [
        ("1e5, -0.9e5, 1e-8", True),
        ("1e5, -1e5, 1e-8", False),
        ("1e5, 1e5, 0.0", False),
        ("1e5, 1e5, -1e-8", False),
        ("-1e5, 2e5, 1e-8", True),
        ("1e5, x, 1e-8", True),  # ccx complains of it
    ],
)
def test_rubber_that_is_none_is_not_left_to_ccx(tmp_path: Path, row: str, stable: bool) -> None:
    path = tmp_path / "sector.inp"
    good = "*HYPERELASTIC, MOONEY-RIVLIN\n5e5, 1e5, 1e-8\n"
    path.write_text(f"{good}*HYPERELASTIC, MOONEY-RIVLIN\n{row}\n*DENSITY\n1100\n")
    if stable:
        _check_rubber(path)
    else:
        with pytest.raises(RunFailed, match="is unstable") as failure:
            _check_rubber(path)
        assert failure.value.cause == "unstable"


def test_decks_have_one_diameter_each_and_half_the_pressure() -> None:
    """Demands of three silent traps of ccx 2.20, and the plies' stiffness and mass."""
    texts = Decks(TyreDesign(main_case(), {}), modes_per_harmonic=3).texts("calculix")
    assert list(texts) == ["sector.inp", "inflate.inp", *(f"modes_{n}.inp" for n in range(5))]
    assert "CAVITY, P6, 240000\n" in texts["inflate.inp"]
    for n in range(5):
        deck = texts[f"modes_{n}.inp"]
        assert deck.count("*FREQUENCY\n6\n") == 1
        assert f"NMIN={n}, NMAX={n}\n" in deck
        assert "CAVITY, P6, 120000\n" in deck and "*RESTART, READ, STEP=2\n" in deck
    lines = texts["sector.inp"].splitlines()
    start = lines.index("*MATERIAL, NAME=BELT_1_8")
    values = [float(x) for x in ",".join(lines[start + 2 : start + 5]).split(",")]
    k = 172.2e9 * 2.118683e-7 / (1.16e-3 * 2e-4)
    # near the crown, 70 degrees from the meridian: theta theta theta theta is sin^4
    assert len(values) == 21
    assert values[2] == pytest.approx(k * np.sin(np.radians(70)) ** 4, rel=1e-4)
    assert values[5] == pytest.approx(k * np.cos(np.radians(70)) ** 4, rel=2e-3)
    density = float(lines[lines.index("*DENSITY", start) + 1])
    assert density == pytest.approx(5900 * 2.118683e-7 / (1.16e-3 * 2e-4), rel=2e-4)


def test_the_inflated_state_is_one_of_revolution_and_let_go() -> None:
    """Nodes halfway between the faces follow those in front, in the inflating step alone."""
    texts = Decks(TyreDesign(main_case())).texts("calculix")
    rows = re.findall(r"\*EQUATION\n3\n([^\n]*)", texts["sector.inp"])
    nodes = texts["sector.inp"].split("*NODE, NSET=TYRE\n")[1].split("*")[0].splitlines()
    place = {n: np.array([float(x) for x in xyz]) for n, *xyz in (x.split(", ") for x in nodes)}
    for row in rows:
        node, i, minus, front, one, a, other, two, b = row.split(", ")
        assert (minus, one, two, front) == ("-1.0", "1", "2", other)
        carried = float(a) * place[front][0] + float(b) * place[front][1]
        assert carried == pytest.approx(place[node][int(i) - 1], abs=1e-6)
    first, second = texts["inflate.inp"].split("*END STEP", 1)
    assert rows and "*EQUATION" not in first and "*EQUATION, REMOVE\nBETWEEN, 1, 3" in second
    plain = Decks(TyreDesign(main_case(element="C3D8"))).texts("calculix")
    assert "EQUATION" not in plain["sector.inp"] + plain["inflate.inp"]
    assert "*RESTART, READ, STEP=1\n" in plain["modes_0.inp"]


def test_the_program_says_its_version() -> None:
    solver = CalculiX()
    for words, version in (("This is Version 2.20", "2.20"), ("who knows", "unknown")):
        solver.command = [sys.executable, "-c", f"print('{words}')"]
        assert solver.version == version
    solver.command = ["no-such-ccx"]
    assert solver.version == "unknown"


@pytest.mark.parametrize("place", ["plain", "with blanks and ümlauts", "long" * 30])
def test_whole_results_are_read(tmp_path: Path, place: str) -> None:
    folder = folder_for(tmp_path / place, "none")
    answer = evaluate(folder)
    (mode,) = answer["modes"]
    assert mode["frequency_Hz"] == pytest.approx(np.sqrt(1e5) / (2 * np.pi), rel=1e-12)
    assert (mode["n"], mode["multiplicity"]) == (1, 2)
    assert answer["mass_kg"] == pytest.approx(60 * 0.213091)
    assert answer["pressure_Pa"] == 240000.0
    assert answer["nodes"].tolist() == [1, 2]
    np.testing.assert_allclose(answer["points"], [[0.3, -0.1], [0.3, 0.1]])
    np.testing.assert_allclose(answer["displacement"], [[0.001, 0, 0], [0, 0, 0]])
    shape = np.array([v for _, v in REAL]) + 1j * np.array([v for _, v in IMAGINARY])
    expected = shape * 1j * np.sqrt(2 / 60)  # -4i, the largest, becomes real and positive
    np.testing.assert_allclose(mode["amplitude"], expected, atol=1e-12)
    assert (folder / "modes_1.log").exists() and (folder / "modes_1.frd").exists()
    assert not list(folder.glob("*.rin")) and not list(folder.glob("*.rout"))  # they are large


@pytest.mark.parametrize(
    ("fault", "cause", "words"),
    [
        ("crash", "crashed", "ended with code 139"),
        ("code", "crashed", "code 201.*a node is wrong"),
        ("cutbacks", "no_equilibrium", "too many cutbacks"),
        ("error", "crashed", "a is wrong"),
        ("skipped", "crashed", "STEP,NLGEO"),
        ("unfinished", "crashed", "before its end"),
        ("silent", "no_results", "left no modes_1.dat"),
        ("no shapes", "no_results", "left no modes_1.frd"),
        ("empty", "no_results", "left no modes_1.dat"),
        ("fewer", "no_results", "1 of 2 modes"),
        ("zeros", "no_results", "eigenvalues are 0"),
        ("nan", "no_results", "'NaN' is not a number"),
        ("negative", "unstable", "-100000"),
        ("unpaired", "no_results", "pairs"),
        ("cut", "no_results", "cut off"),
        ("doubled", "no_results", "two runs"),
        ("nan shape", "no_results", "'NaN' is not a number"),
        ("stars", "no_results", "not a number"),
        ("one part", "no_results", "lacks shapes"),
        ("missing node", "no_results", "nodes are missing"),
        ("inflation: crash", "crashed", "code 139"),
        ("inflation: cutbacks", "no_equilibrium", "too many cutbacks"),
        ("inflation: unfinished", "crashed", "before its end"),
        ("inflation: no state", "no_results", "left no inflate.rout"),
        ("inflation: empty state", "no_results", "left no inflate.rout"),
        ("inflation: silent", "no_results", "left no inflate.frd"),
        ("inflation: empty", "no_results", "left no inflate.dat"),
        ("inflation: nan mass", "no_results", "'NaN' is not a number"),
        ("inflation: nan displacement", "no_results", "'NaN' is not a number"),
        ("inflation: doubled", "no_results", "two runs"),
        ("inflation: buckled", "unstable", "no body of revolution: node 3 is 2 micrometres off"),
    ],
)
def test_a_failure_is_typed_and_never_a_number(
    tmp_path: Path, fault: str, cause: str, words: str
) -> None:
    folder = folder_for(tmp_path, fault)
    for name, text in LEFT.items():  # whole results of an older run
        (folder / name).write_text(text.replace("state", "older state"))
    with pytest.raises(RunFailed, match=words) as failure:
        evaluate(folder)
    assert failure.value.cause == cause


@pytest.mark.parametrize("fault", ["crash", "cutbacks", "no state"])
def test_no_modes_about_a_state_that_was_not_found(tmp_path: Path, fault: str) -> None:
    folder = folder_for(tmp_path, f"inflation: {fault}")
    for name, text in LEFT.items():
        (folder / name).write_text(text)
    with pytest.raises(RunFailed):
        evaluate(folder)
    assert (tmp_path / "tools" / "jobs").read_text() == "inflate "
    with pytest.raises(RunFailed, match="left no"):
        CalculiX().read(folder)


@pytest.mark.parametrize(("off", "whole"), [(0.98, True), (1.02, False)])
def test_how_far_an_inflated_tyre_may_be_from_a_body_of_revolution(
    tmp_path: Path, off: float, whole: bool
) -> None:
    """A thousandth of the largest displacement."""
    moved = [STATIC[0], STATIC[1], (3, (0.0, 0.0, off * 1e-6))]
    (tmp_path / "inflate.frd").write_text(frd(block("DISP", moved, 0)))
    if whole:
        fields, front = _inflated(tmp_path / "inflate.frd")
        assert fields.nodes[front].tolist() == [1, 2]
    else:
        with pytest.raises(RunFailed, match="no body of revolution"):
            _inflated(tmp_path / "inflate.frd")


def test_displacements_turn_with_their_nodes(tmp_path: Path) -> None:
    """A radial growth and a twist, the same at every angle, are a body of revolution's."""
    points = [(1, (0.3, 0.0, 0.1))]
    for n, angle in ((2, 0.1), (3, -0.4)):
        points.append((n, (0.3 * np.cos(angle), 0.3 * np.sin(angle), 0.1)))
    grown = []
    for n, (x, y, _) in points:
        c, s = x / 0.3, y / 0.3
        grown.append((n, (2e-3 * c - 1e-3 * s, 2e-3 * s + 1e-3 * c, 5e-4)))
    text = "    1C\n    2C\n" + rows(points) + " -3\n" + block("DISP", grown, 0) + " 9999\n"
    (tmp_path / "inflate.frd").write_text(text)
    fields, front = _inflated(tmp_path / "inflate.frd")
    assert front.tolist() == [0] and fields.blocks[0][2][0] == pytest.approx([2e-3, 1e-3, 5e-4])
    behind = text.replace(rows(points[:1]), rows([(1, (0.3, 1e-9, 0.1))]))
    (tmp_path / "inflate.frd").write_text(behind)
    with pytest.raises(RunFailed, match="no nodes at Theta = 0"):
        _inflated(tmp_path / "inflate.frd")


def test_pairs_are_as_equal_as_digits_allow() -> None:
    """A ten thousandth; of a pair their mean."""
    values = np.array([1.0, 1.00009, 4.0, 4.0])
    assert pairs(values, "a") == pytest.approx([1.000045, 4.0], abs=1e-12)
    for wrong in ([1.0, 1.00011], [1.00011, 1.0], [1.0, 1.0, 4.0]):
        with pytest.raises(RunFailed, match="do not come in pairs"):
            pairs(np.array(wrong), "a")


def test_modes_without_waves_are_single(tmp_path: Path) -> None:
    folder = folder_for(tmp_path, "none")
    (folder / "modes_1.inp").rename(folder / "modes_0.inp")
    for suffix in ("dat", "frd"):
        text = LEFT[f"modes_1.{suffix}"].replace("\n    1     ", "\n    0     ")
        (tmp_path / "tools" / f"modes_0.{suffix}").write_text(text)
    (mode,) = evaluate(folder)["modes"]
    assert (mode["n"], mode["multiplicity"]) == (0, 1)
    assert abs(mode["amplitude"]).max() == pytest.approx(4.0 / np.sqrt(60))


@pytest.mark.parametrize(("n", "multiplicity"), [(0, 1), (1, 2)])
def test_shapes_have_the_tyres_modal_mass(n: int, multiplicity: int) -> None:
    """ccx's have one sector's; a shape without any motion is refused."""
    shape = np.array([[3.0, 0.0, 0.0], [0.0, 4.0, 0.0]])
    fields = lambda size: Fields(
        np.array([1, 2]), np.zeros((2, 3)), [(1, "DISP", 0 * shape), (1, "DISPI", size * shape)]
    )
    (scaled,) = _shapes(fields(1.0), 1, n, 60, "modes")
    assert scaled == pytest.approx(shape * np.sqrt(multiplicity / 60))
    with pytest.raises(RunFailed, match="mode 1 is no shape"):
        _shapes(fields(0.0), 1, n, 60, "modes")


def test_folders_without_decks_have_no_results(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="no decks") as failure:
        CalculiX().read(tmp_path)
    assert failure.value.cause == "no_results"
    folder = folder_for(tmp_path, "none")
    (folder / "sector.inp").write_text("*NODE\n")
    with pytest.raises(RunFailed, match=r"sector.inp has no .*CYCLIC") as failure:
        evaluate(folder)
    assert failure.value.cause == "no_results"


def test_decks_run_at_the_same_time_and_tell_the_same(tmp_path: Path) -> None:
    """The two decks wait for each other to begin; with one at a time neither would end."""
    together = evaluate(with_two_diameters(tmp_path / "two", "together", 2))
    alone = evaluate(with_two_diameters(tmp_path / "one", "none", 1))
    assert [mode["n"] for mode in together["modes"]] == [1, 2]
    for mode, other in zip(together["modes"], alone["modes"], strict=True):
        assert mode["frequency_Hz"] == other["frequency_Hz"]
        np.testing.assert_array_equal(mode["amplitude"], other["amplitude"])
    assert not list(tmp_path.glob("*/run/*.rin")) and not list(tmp_path.glob("*/run/*.rout"))


@pytest.mark.parametrize("parallel", [1, 2])
def test_one_deck_of_several_that_fails_fails_all(tmp_path: Path, parallel: int) -> None:
    with pytest.raises(RunFailed, match="a is wrong"):
        evaluate(with_two_diameters(tmp_path, "error", parallel))


@pytest.mark.parametrize(("parallel", "ended"), [(1, 0), (2, 1)])
def test_an_interruption_ends_the_decks_at_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parallel: int, ended: int
) -> None:
    """The interruption reaches decks in this thread by itself."""
    folder, calls = with_two_diameters(tmp_path, "none", parallel), []

    def run_job(place: Path, job: str, *given: object) -> None:
        if job != "inflate":
            raise KeyboardInterrupt
        (place / f"{job}.rout").write_text("a state")

    monkeypatch.setattr(adapter, "run_job", run_job)
    monkeypatch.setattr(adapter, "end_commands", lambda: calls.append(1))
    with pytest.raises(KeyboardInterrupt):
        evaluate(folder)
    assert len(calls) == ended


def test_after_a_failure_nothing_runs_on(tmp_path: Path) -> None:
    """The folder may go: a deck that had begun has ended."""
    with pytest.raises(RunFailed, match="code 139"):
        evaluate(with_two_diameters(tmp_path, "one of two", 2))
    assert (tmp_path / "tools" / "ended").exists()


@pytest.mark.slow
def test_a_run_that_hangs_is_ended(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match=r"time limit.*Newton goes on") as failure:
        evaluate(folder_for(tmp_path, "hang"), 4.0)
    assert failure.value.cause == "timed_out"


def test_a_command_that_is_not_there(tmp_path: Path) -> None:
    solver = CalculiX()
    solver.command = ["no-such-ccx"]
    with pytest.raises(RunFailed, match="cannot start 'no-such-ccx'"):
        solver.run(folder_for(tmp_path, "none"), 30.0)


def test_of_an_error_three_lines_are_told(tmp_path: Path) -> None:
    log = tmp_path / "a.log"
    log.write_text("first\n *ERROR in e_c3d:\n\n one\n two\n three\n *ERROR again\nJob finished\n")
    assert _said(log) == ("*ERROR in e_c3d: one two", False, True)
    log.write_text("*WARNING reading *STEP.\n*WARNING in x: Card image:\nToo many cutbacks\n")
    assert _said(log) == ("", True, False)


def test_paths_that_ccx_copes_with() -> None:
    """Safe paths have 100 characters at most, no blank, and only ASCII."""
    assert _is_safe(Path("/" + 99 * "x")) and not _is_safe(Path("/" + 100 * "x"))
    assert not _is_safe(Path("/a b")) and not _is_safe(Path("/\u00fc"))


def test_a_program_has_twenty_seconds_to_say_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(command: list[str], timeout: float, **given: object) -> None:
        assert command == ["mute", "-v"] and timeout == 20
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", silent)
    assert adapter._version(("mute",)) == "unknown"
