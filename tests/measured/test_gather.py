"""Several files together: geometry apart, more than one reference, modes that are missing."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.gather import _entry, gather, result, unlabelled
from tyrecal.measured.labels import Judged
from tyrecal.measured.modal import Layout, ModalTest
from tyrecal.measured.sensors import MeasuredMode
from tyrecal.simulate.modes.label import Label

from ..chance import generator
from .test_universal import function, shape, write

pytestmark = pytest.mark.numbers

F = np.arange(20.0, 140.0, 0.5)
ANGLES = np.radians([3, 31, 65, 88, 124, 149, 187, 214, 246, 271, 303, 337])
MODES = {Label(1, 0): 58.5, Label(2, 0): 79.5, Label(3, 0): 97.6, Label(4, 0): 115.9}
LAYOUT = Layout(directions="cylindrical", highest=6, band=(40.0, 130.0))


def nodes(moved: float = 0.0) -> dict[str, Any]:
    one = np.ones(12, int)
    return {
        "type": 15,
        "node_nums": np.arange(1, 13),
        "def_cs": one,
        "disp_cs": one,
        "color": one,
        "x": 0.39 * np.cos(ANGLES) + moved,
        "y": 0.39 * np.sin(ANGLES),
        "z": 0.05 * np.tile([1.0, -1.0, 0.0], 4),
    }


def functions(reference: int, seed: int, kept: range = range(12)) -> list[dict[str, Any]]:
    """Mobilities, radial and tangential, of a belt that moves in its plane; the two of a doublet
    are driven unlike by each reference."""
    rng = generator(seed)
    w, sets = 2 * np.pi * F, []
    for node in kept:
        for k in (1, 2):
            H = np.zeros(len(F), complex)
            for label, hertz in MODES.items():
                turn = label.c * (ANGLES[node] - 0.4 * reference)
                phi = np.cos(turn) if k == 1 else -np.sin(turn) / label.c
                wk = 2 * np.pi * hertz
                H += phi * 1j * w / (wk**2 - w**2 + 0.05j * w * wk)
            H += 2e-5 * (rng.standard_normal(len(F)) + 1j * rng.standard_normal(len(F)))
            sets.append(
                {
                    **function(H, F, node + 1),
                    "rsp_dir": k,
                    "ref_node": reference,
                    "ordinate_spec_data_type": 11,
                }
            )
    return sets


def test_a_file_is_no_repeat_of_itself(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("c,m,pressure [kPa],frequency [Hz]\n2,1,240,66.1\n")
    (tmp_path / "sub").mkdir()
    with pytest.raises(InputError, match="is given twice"):
        gather([tmp_path / "t.csv", tmp_path / "sub" / ".." / "t.csv"])


@pytest.mark.slow
def test_nothing_is_assumed_of_frequencies_without_labels(tmp_path: Path) -> None:
    """Unless the user says how far they may be off."""
    (tmp_path / "t.csv").write_text("pressure [kPa],frequency [Hz]\n240,66.1\n")
    with pytest.raises(InputError, match="--sigma-percent"):
        unlabelled(tmp_path / "t.csv", 240.0)
    (row,), *_ = unlabelled(tmp_path / "t.csv", 240.0, assumed=0.01)
    assert row.sigma == pytest.approx(0.661)


def test_two_references_and_geometry_of_its_own(tmp_path: Path) -> None:
    """Further contents of a file are passed over and reported."""
    where = write(tmp_path / "where.uff", nodes())
    coherence = function(np.ones(len(F)), F, func_type=6)
    more = [[coherence, coherence], []]
    files = [
        write(tmp_path / f"{k}.uff", *functions(101, k), *functions(102, k + 9), *more[k - 1])
        for k in (1, 2)
    ]
    gathered = gather([where, *files], 240.0, LAYOUT)
    assert {row.label: row.value for row in gathered.rows} == pytest.approx(MODES, rel=1e-3)
    assert len(gathered.runs) == 2 and gathered.notes == [
        f"{files[0]}: not used: coherence (2 times)"
    ]
    assert all(run.explained > 0.99 for run in gathered.runs)
    assert all(mode["confidence"] > 0.97 for mode in result(gathered)["modes"])
    with pytest.raises(InputError, match="node 1 has no coordinates"):
        gather(files, 240.0, LAYOUT)


def test_shapes_leave_nothing_to_explain() -> None:
    """Functions: the share of their mean square, where the modes are fitted."""
    assert ModalTest("shapes", ()).explained == 1.0
    H, made = np.array([[3.0, 4.0j, 9.0]]), np.array([[3.0, 3.0j, np.nan]])
    assert ModalTest("functions", (), F[:3], H, made).explained == pytest.approx(1 - 1 / 25)


def test_a_reference_need_not_have_every_signal(tmp_path: Path) -> None:
    path = write(tmp_path / "f.uff", nodes(), *functions(101, 1), *functions(102, 2, range(9)))
    gathered = gather([path], 240.0, LAYOUT)
    assert {row.label: row.value for row in gathered.rows} == pytest.approx(MODES, rel=1e-3)
    assert not gathered.notes


def test_files_must_agree_on_where_a_node_is(tmp_path: Path) -> None:
    one = write(tmp_path / "1.uff", nodes(), shape(np.ones((8, 3)) + 0j))
    two = write(tmp_path / "2.uff", nodes(0.01), shape(np.ones((8, 3)) + 0j))
    with pytest.raises(InputError, match=r"2\.uff: node 1 has other coordinates"):
        gather([one, two], 240.0, LAYOUT)


def test_a_mode_that_was_missed_is_noticed(tmp_path: Path) -> None:
    narrow = Layout(directions="cylindrical", highest=6, band=(70.0, 90.0))
    plain = write(tmp_path / "f.uff", nodes(), *functions(101, 1))
    assert not gather([plain], 240.0, narrow).notes  # what lies outside the band is allowed for
    sharp = functions(101, 1)
    w, wk = 2 * np.pi * F, 2 * np.pi * 70.0
    for each in sharp:  # a resonance that is no tyre's: too sharp to be taken for one
        each["data"] = each["data"] + 0.2j * w / (wk**2 - w**2 + 2e-3j * w * wk)
    note, *_ = gather([write(tmp_path / "g.uff", nodes(), *sharp)], 240.0, LAYOUT).notes
    assert "the modes make" in note and "one may be missing" in note


def test_a_mode_is_told_with_digits_that_mean_something() -> None:
    """A number that is not known is None."""
    mode = MeasuredMode(66.1234567, np.ones(3))
    judged = Judged(None, {Label(1, 0): 0.87654321}, "mixed")
    labelled: Any = SimpleNamespace(mode=mode, judged=judged, collinearity=0.12345678, member="1")
    run: Any = SimpleNamespace(name="a.uff")
    assert _entry(run, labelled) == {
        "file": "a.uff",
        "frequency_Hz": 66.1234567,
        "sigma_Hz": None,
        "damping_ratio": None,
        "collinearity": 0.1235,
        "c": None,
        "m": None,
        "kind": None,
        "member": "1",
        "confidence": 0.8765,
        "why": "mixed",
    }
