"""Real runs of ccx 2.20: a ring in closed form, and every way in which ccx is known to lie."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.calculix.adapter import CalculiX
from tyrecal_solvers.calculix.results import read_fields
from tyrecal_solvers.calculix.runner import run_job
from tyrecal_solvers.errors import RunFailed

from .ring import INFLATE, MODES, sector, write_ring

pytestmark = pytest.mark.ccx
N2_HZ = 55.94  # of the ring in closed form, which one element meets within 0.06 %
MASS_KG = 1100 * np.pi * (0.315**2 - 0.30**2) * 0.02


def evaluate(folder: Path) -> dict:
    solver = CalculiX()
    solver.run(folder, 30.0)
    return solver.read(folder)


@pytest.mark.parametrize("place", ["plain", "with blanks and ümlauts", "long" * 40])
def test_an_inflated_ring(tmp_path: Path, place: str) -> None:
    """The ring also runs in folders whose path ccx cannot use."""
    folder = write_ring(tmp_path / place)
    for _ in range(2):  # twice the same job in the same folder
        answer = evaluate(folder)
        (mode,) = answer["modes"]
        assert mode["frequency_Hz"] == pytest.approx(N2_HZ, rel=6e-4)
        assert (mode["n"], mode["multiplicity"]) == (2, 2)
        assert answer["mass_kg"] == pytest.approx(MASS_KG, rel=1e-3)
    assert not list(folder.glob("*.r*")) and not list(tmp_path.glob("*.dat"))


CUT_INFLATION, CUT_MODES = INFLATE[: INFLATE.index("*DLOAD")], MODES[: MODES.index("*DLOAD")]


@pytest.mark.parametrize(
    ("changed", "cause", "words"),
    [
        ({"inflate": CUT_INFLATION}, "no_results", "left no inflate.rout"),
        ({"inflate": INFLATE.replace("*END STEP\n", "")}, "crashed", "reported an error"),
        ({"modes_2": CUT_MODES}, "no_results", "left no modes_2.dat"),
        ({"modes_2": MODES.replace("*END STEP\n", "")}, "no_results", "left no modes_2.dat"),
        ({"modes_2": MODES.replace("\n2\n", "\n5000\n")}, "crashed", "converged eigenvalues=0"),
        (
            {
                "inflate": INFLATE.replace("240000", "-240000"),
                "modes_2": MODES.replace("120000", "-120000"),
            },
            "unstable",
            "is unstable",
        ),
        ({"sector": "*NO SUCH KEYWORD\n" + sector()}, "crashed", "NOSUCHKEYWORD"),
        ({"sector": "*NODE, NO=1\n" + sector()}, "crashed", "NO=1"),
        ({"sector": sector().replace("MATERIAL=RUBBER", "MATERIAL=R")}, "crashed", "code 201"),
        ({"sector": sector().replace("1e+08", "nan")}, "crashed", "code 255"),
        ({"sector": sector().replace("1100.0", "nan")}, "crashed", "code 255"),
        ({"inflate": INFLATE.replace("240000", "inf")}, "crashed", "code 255"),
        ({"inflate": INFLATE.replace("INC=1000", "INC=1")}, "no_equilibrium", "max. # of"),
        ({"sector": sector(C10=1e4)}, "no_equilibrium", "inflated state"),
        ({"sector": sector(C10=-1e8)}, "unstable", "rubber of C10"),
        ({"modes_2": MODES.replace("STEP=1", "STEP=3")}, "crashed", "code 201"),
    ],
)
def test_wrong_decks_are_typed_failures(
    tmp_path: Path, changed: dict[str, str], cause: str, words: str
) -> None:
    folder = write_ring(tmp_path / "run")
    evaluate(folder)  # whole results of an older run
    write_ring(folder, **changed)
    with pytest.raises(RunFailed, match=words) as failure:
        evaluate(folder)
    assert failure.value.cause == cause


@pytest.mark.parametrize("job", ["nothing", "inflate.inp"])
def test_a_deck_that_is_not_there_or_is_named_with_its_ending(tmp_path: Path, job: str) -> None:
    write_ring(tmp_path)
    with pytest.raises(RunFailed, match="cannot open file") as failure:
        run_job(tmp_path, job, [], ["ccx"], 20.0)
    assert failure.value.cause == "crashed"


def test_two_runs_in_one_file(tmp_path: Path) -> None:
    """The runner cannot keep others out: two runs of the same job share a folder at the same
    time."""
    write_ring(tmp_path)
    run_job(tmp_path, "inflate", ["sector.inp"], ["ccx"], 20.0)
    written = (tmp_path / "inflate.frd").read_text()
    (tmp_path / "inflate.frd").write_text(written + written)
    with pytest.raises(RunFailed, match="two runs"):
        read_fields(tmp_path / "inflate.frd")


@pytest.mark.parametrize("part", [0.2, 0.6, 0.95])
def test_an_inflated_state_that_is_cut_off(tmp_path: Path, part: float) -> None:
    folder = write_ring(tmp_path)
    run_job(folder, "inflate", ["sector.inp"], ["ccx"], 20.0)
    state = (folder / "inflate.rout").read_bytes()
    (folder / "modes_2.rin").write_bytes(state[: int(part * len(state))])
    with pytest.raises(RunFailed) as failure:
        run_job(folder, "modes_2", ["modes_2.rin"], ["ccx"], 20.0)
    assert failure.value.cause == "crashed"


@pytest.fixture
def disc(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own; its size is set by mounting it again."""
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("only root can mount a file system")
    folder = tmp_path / "disc"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disc(disc: Path) -> None:
    """Whatever does not fit, the answer is the right one or none."""
    write_ring(disc)
    right = evaluate(disc)["modes"][0]
    outcomes = []
    for blocks in range(5, 120, 3):
        for path in disc.iterdir():
            path.unlink()
        resize = ["mount", "-o", f"remount,size={4 * blocks}k", str(disc)]
        subprocess.run(resize, check=True)
        try:
            (mode,) = evaluate(write_ring(disc))["modes"]
        except (RunFailed, OSError) as failure:
            outcomes.append(getattr(failure, "cause", "disc"))
            continue
        assert mode["frequency_Hz"] == right["frequency_Hz"]
        assert (mode["amplitude"] == right["amplitude"]).all()
        outcomes.append("right")
    assert outcomes[-1] == "right" and len(set(outcomes[:-1])) > 1, outcomes
