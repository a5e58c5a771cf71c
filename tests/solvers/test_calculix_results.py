"""CalculiX's files are read to the last column, and its silent failures never pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.calculix.adapter import CalculiX, _inflated, _shapes
from tyrecal_solvers.calculix.results import Fields, pairs
from tyrecal_solvers.errors import RunFailed

from .standin_calculix import IMAGINARY, LEFT, REAL, STATIC, block, evaluate, folder_for, frd, rows


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
